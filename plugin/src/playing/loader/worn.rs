//! What the listener hears with: a head and headphones.

use super::Loader;
use crate::library::{self, LoadedScene, cache, drawn_room::DrawnRoom};
use crate::project::persisted::{Persisted, Report};
use crate::project::{exchange::Exchange, file_wish::FileWish, saved_head::SavedHead, saved_headphones::SavedHeadphones};
use crate::worker::lock::lock;
use nice_plug::nice_error;
use promenade_core::Scene;
use promenade_core::headphones::Headphones;
use promenade_fault::{Fault, with_causes};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;

impl Loader {
    /// Reads the head that has been asked for. The scene's own plays where it cannot be read.
    pub(super) fn refresh_head(&self) {
        let Exchange { head_wish, head_report, .. } = &*self.exchange;
        self.grant(head_wish, &self.params.head, head_report, head_in, Some(SavedHead::default()));
    }

    /// Reads the headphones that have been asked for. Where they cannot be read, those that are there stay.
    pub(super) fn read_headphones(&self) {
        let Exchange { headphones_wish, headphones_report, .. } = &*self.exchange;
        self.grant(headphones_wish, &self.params.headphones, headphones_report, headphones_in, None);
    }

    /// Reads a file that has been asked for, none for an empty name. Where it cannot be read, `instead` takes its place.
    fn grant<T: Clone + Default>(
        &self,
        wish: &FileWish,
        held: &Persisted<T>,
        report: &Report,
        read: fn(&Path) -> Result<T, String>,
        instead: Option<T>,
    ) {
        let Some(name) = wish.take() else { return };
        let (_, restores) = held.get();
        let read = if name.is_empty() { Ok(T::default()) } else { read(&library::place_of(&name)) };
        let (new, reason) = read.map_or_else(|reason| (instead, reason), |new| (Some(new), String::new()));
        // A state that was restored meanwhile has a file of its own.
        if new.is_some_and(|new| !held.replace(new, restores)) {
            return;
        }
        if !reason.is_empty() {
            nice_error!("{reason}");
        }
        report.set_text(reason);
        wish.answer();
        self.repaint.request_repaint();
    }

    /// Makes a filter of the project's headphones, unless it is there already.
    pub(super) fn refresh_headphones(&self) {
        let mut last = lock(&self.last_headphones);
        let sample_rate_bits = self.sample_rate_bits.load(Ordering::Acquire);
        let request = Some((self.params.headphones.get().0.headphones, sample_rate_bits));
        if sample_rate_bits == 0 || *last == request {
            return;
        }
        let filter = |(headphones, bits): &(Option<Headphones>, u64)| {
            headphones.as_ref().map(|headphones| Box::new(headphones.filter(f64::from_bits(*bits))))
        };
        drop(self.headphones.force_push(request.as_ref().and_then(filter)));
        *last = request;
    }

    /// Takes the headphones of a state that the host has restored.
    pub(super) fn restored_headphones(&self) {
        self.exchange.headphones_report.set_text(String::new());
        self.refresh_headphones();
    }

    /// Takes the head of a state that the host has restored.
    pub(super) fn restored_head(&self) {
        self.exchange.head_report.set_text(String::new());
        self.refresh_scene();
    }

    /// The drawn room heard with the project's head, or with the factory's where that cannot be, which is reported.
    pub(super) fn drawn(&self, room: &DrawnRoom, saved: &SavedHead) -> Result<Arc<Scene>, Fault> {
        let (head, report) = match saved.head() {
            Ok(head) => (head, None),
            Err(error) => (None, Some(with_causes(&error))),
        };
        self.exchange.head_name.set_text(head.as_ref().map_or_else(String::new, |head| head.name().to_owned()));
        if head.is_some() || report.is_some() {
            self.exchange.head_report.set_text(report.unwrap_or_default());
        }
        cache::drawn(room, head.as_ref())
    }

    /// The scene heard with the project's head, or as it is where that cannot be, which is reported.
    pub(super) fn heard(&self, found: &LoadedScene, saved: &SavedHead) -> Arc<Scene> {
        let heard = match saved.head() {
            Ok(None) => {
                // What went wrong when a file was read is still to be seen.
                self.exchange.head_name.set_text(String::new());
                return Arc::clone(&found.scene);
            }
            Ok(Some(head)) => {
                let heard = cache::heard_with(&found.scene, &found.hash, &head).map_err(|error| with_causes(&error));
                heard.map(|heard| (heard, head.name().to_owned()))
            }
            Err(error) => Err(with_causes(&error)),
        };
        let (report, heard) = heard.map_or_else(|why| (why, None), |heard| (String::new(), Some(heard)));
        let (heard, name) = heard.unwrap_or_else(|| (Arc::clone(&found.scene), String::new()));
        self.exchange.head_name.set_text(name);
        self.exchange.head_report.set_text(report);
        heard
    }
}

fn head_in(path: &Path) -> Result<SavedHead, String> {
    let head = read_in(path, promenade_sofa::read_head)?;
    // All heads of a data base may have its name.
    let file = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    let name = if head.name().contains(&file) { head.name().to_owned() } else { format!("{}, {file}", head.name()) };
    Ok(SavedHead::of(&head.named(&name)))
}

fn headphones_in(path: &Path) -> Result<SavedHeadphones, String> {
    let name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    read_in(path, promenade_sofa::read_headphones).map(|headphones| SavedHeadphones { name, headphones: Some(headphones) })
}

/// What is in a file. One that makes the reader fail in another way than it promises is as damaged as any.
fn read_in<T>(path: &Path, read: fn(&Path) -> Result<T, Fault>) -> Result<T, String> {
    let damaged = |_| format!("{}: no readable SOFA (HDF5) file", path.display());
    std::panic::catch_unwind(|| read(path)).map_err(damaged)?.map_err(|error| with_causes(&error))
}
