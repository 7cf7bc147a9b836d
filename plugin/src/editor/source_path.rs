//! The path of the chosen source: a file that the project takes over.

use super::chooser::{Chooser, Place};
use super::ctx::Ctx;
use super::path_panel::{KIND, read};
use super::widgets::{asks_for_file, button, note};
use super::words::Word;
use crate::history::user_state::UserState;
use crate::project::walk::SavedWalk;
use egui::Ui;
use nice_plug::params::persist::PersistentField;

/// Chooses the file, or takes the path away.
#[derive(Default)]
pub(super) struct SourcePath {
    file: String,
    /// Reads a path, for a source.
    chooser: Chooser<(usize, SavedWalk)>,
    /// Why nothing was chosen.
    why_not: Option<String>,
}

impl SourcePath {
    /// Shows the path of a source, 0 for the first.
    pub(super) fn show(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>, source: usize) {
        let used = ctx.params().source_walks.map(|walks| walks.of(source).map(|walk| walk.name.clone()));
        let hint =
            used.as_deref().map_or("Path file for the source", |name| if name.is_empty() { "A path of its own" } else { name });
        if asks_for_file(ui, ctx.palette, &mut self.file, hint, Word::SourcePath, !self.chooser.is_busy()) {
            let place = Place::typed_or(&self.file, Place::Existing);
            let take = move |path: &std::path::Path| Ok((source, read(path)?.0));
            self.why_not = self.chooser.ask(ctx, KIND, place, take).err();
        }
        if used.is_some() && button(ui, ctx.palette, Word::NoSourcePath).clicked() {
            ctx.keep(&ctx.params().source_walks, |walks| walks.set(source, None));
            self.why_not = None;
        }
        match self.chooser.take() {
            Some(Ok((source, walk))) => {
                let before = UserState::of(ctx.params());
                ctx.keep(&ctx.params().source_walks, |walks| walks.set(source, Some(walk)));
                ctx.history.record(before, &UserState::of(&ctx.instance.params));
                self.file.clear();
                self.why_not = None;
            }
            Some(Err(why)) => self.why_not = Some(why),
            None => (),
        }
        if let Some(why) = &self.why_not {
            note(ui, ctx.palette, why);
        }
    }
}
