//! Camera path and paths of sources: the project's own, or a file of the library.

use super::{Loader, chooses_a_file};
use crate::library::LoadError;
use crate::parameter::{Parameter, choices::Follow, row::SlotKind};
use crate::project::walk::SavedWalk;
use crate::worker::lock::lock;
use nice_plug::prelude::Enum;
use nice_plug::{nice_error, nice_warn};
use promenade_fault::with_causes;
use std::sync::{Arc, Once, Weak};

impl Loader {
    pub(super) fn refresh_walk(&self) {
        let mut last = lock(&self.last_walk);
        loop {
            let (saved, restores) = self.params.saved_walk.get();
            let request = (self.choices().walk_slot, saved);
            if last.as_ref() == Some(&request) {
                return;
            }
            let result = self.find_walk(request.0, &request.1);
            let chosen = chooses_a_file(&result);
            let (walk, report, file) = match result.and_then(|file| Ok((file.to_walk()?, file))) {
                Ok((walk, file)) => (walk.map(Arc::new), String::new(), file),
                Err(error) => (None, with_causes(&error), request.1.clone()),
            };
            if self.params.saved_walk.replace(file.clone(), restores) {
                static NONE_CHOSEN: Once = Once::new();
                if !chosen && self.params.index(Parameter::Follow) != Follow::Off.to_index() {
                    NONE_CHOSEN.call_once(|| nice_warn!("{report}"));
                } else if chosen && !report.is_empty() {
                    nice_error!("{report}");
                }
                self.exchange.walk_report.set_text(report);
                lock(&self.current).walk = walk.as_ref().map_or_else(Weak::new, Arc::downgrade);
                drop(self.walks.force_push(walk));
                self.repaint.request_repaint();
                *last = Some((request.0, file));
                return;
            }
        }
    }

    /// Makes the paths of sources ready, unless they are.
    pub(super) fn refresh_source_walks(&self) {
        let mut last = lock(&self.last_source_walks);
        let (saved, _) = self.params.source_walks.get();
        if last.as_ref() == Some(&saved) {
            return;
        }
        let (walks, wrong) = saved.to_walks(1 + self.params.further());
        let lines = wrong.iter().map(|(source, error)| format!("source {source}: {}", with_causes(error)));
        let report = lines.collect::<Vec<_>>().join("; ");
        if !report.is_empty() {
            nice_error!("{report}");
        }
        self.exchange.source_walks_report.set_text(report);
        lock(&self.current).source_walks = Some(Arc::downgrade(&walks));
        drop(self.source_walks.force_push(walks));
        self.repaint.request_repaint();
        *last = Some(saved);
    }

    fn find_walk(&self, slot: u32, saved: &SavedWalk) -> Result<SavedWalk, LoadError> {
        if slot == 0 || slot == saved.slot {
            return Ok(saved.clone());
        }
        let path = self.params.slots.file(SlotKind::Walk, slot)?;
        Ok(SavedWalk { slot, ..SavedWalk::from_file(&path)?.0 })
    }
}
