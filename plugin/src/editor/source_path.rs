//! The path of the chosen source: a file that the project takes over.

use super::path_panel::{KIND, read};
use super::{chooser::FileField, ctx::Ctx, widgets::button, words::Word};
use crate::project::walk::SavedWalk;
use egui::Ui;
use nice_plug::params::persist::PersistentField;

/// Chooses the file, or takes the path away.
#[derive(Default)]
pub(super) struct SourcePath {
    /// Reads a path, for a source.
    file: FileField<(usize, SavedWalk)>,
}

impl SourcePath {
    /// Shows the path of a source, 0 for the first.
    pub(super) fn show(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>, source: usize) {
        let used = ctx.params().source_walks.map(|walks| walks.of(source).map(|walk| walk.name.clone()));
        let hint =
            used.as_deref().map_or("Path file for the source", |name| if name.is_empty() { "A path of its own" } else { name });
        let chosen = self.file.show(ui, ctx, (hint, Word::SourcePath, KIND), move |path| Ok((source, read(path)?.0)));
        if let Some((source, walk)) = chosen {
            ctx.undoable(|ctx| ctx.keep(&ctx.params().source_walks, |walks| walks.set(source, Some(walk))));
        }
        if used.is_some() && button(ui, ctx.palette, Word::NoSourcePath).clicked() {
            ctx.keep(&ctx.params().source_walks, |walks| walks.set(source, None));
        }
    }
}
