//! The path of the chosen source: a file that the project takes over.

use super::chooser::{Chooser, Place};
use super::ctx::Ctx;
use super::path_panel::{KIND, read};
use super::theme::{CONTROL, SPACE};
use super::widgets::{button, note};
use super::words::Word;
use crate::history::user_state::UserState;
use crate::project::walk::SavedWalk;
use egui::{Key, TextEdit, Ui, Vec2};
use nice_plug::params::persist::PersistentField;

/// Room for the button beside the field, points.
const CHOOSE: f32 = 72.0;

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
        let hint = used.as_deref().map_or("A file of a path", |name| if name.is_empty() { "A path" } else { name });
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = SPACE;
            let place = Vec2::new(ui.available_width() - CHOOSE, CONTROL);
            let typed = ui.add_sized(place, TextEdit::singleline(&mut self.file).hint_text(hint));
            let entered = typed.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter));
            let free = !self.chooser.is_busy();
            let clicked = ui.add_enabled_ui(free, |ui| button(ui, ctx.palette, Word::SourcePath)).inner.clicked();
            if free && (clicked || (entered && !self.file.trim().is_empty())) {
                let place = Place::typed_or(&self.file, Place::Existing);
                let take = move |path: &std::path::Path| Ok((source, read(path)?.0));
                self.why_not = self.chooser.ask(ctx, KIND, place, take).err();
            }
        });
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
