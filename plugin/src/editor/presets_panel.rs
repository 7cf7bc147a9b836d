//! Presets, and copies for the comparison of two settings.

use super::ctx::Ctx;
use super::panel::Panel;
use super::theme::{CONTROL, SPACE};
use super::widgets::{button, field, labelled, note, outcome};
use super::words::Word;
use crate::history::presets::{self, About, Preset};
use crate::history::user_state::UserState;
use egui::{ScrollArea, TextEdit, Ui, Vec2};
use promenade_fault::{Fault, with_causes};
use std::path::PathBuf;

/// Width of the column beside the list, points.
const SIDE: f32 = 280.0;

/// The presets of the factory and of the user.
pub(super) struct PresetsPanel {
    folder: Option<PathBuf>,
    presets: Vec<Preset>,
    search: String,
    name: String,
    chosen: Option<Preset>,
    /// What was done last, or what went wrong.
    outcome: Option<Result<String, String>>,
}

impl Default for PresetsPanel {
    fn default() -> Self {
        let folder = presets::folder();
        let presets = presets::list(folder.as_deref());
        Self { folder, presets, search: String::new(), name: String::new(), chosen: None, outcome: None }
    }
}

impl Panel for PresetsPanel {
    fn title(&self) -> Word {
        Word::Presets
    }

    fn show(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>) {
        let height = ui.available_height();
        ui.horizontal_top(|ui| {
            let list = Vec2::new((ui.available_width() - SIDE - 3.0 * SPACE).max(160.0), height);
            ui.allocate_ui(list, |ui| {
                ui.vertical(|ui| self.list(ui, ctx));
            });
            ui.add_space(2.0 * SPACE);
            ui.allocate_ui(Vec2::new(SIDE, height), |ui| {
                ui.vertical(|ui| self.side(ui, ctx));
            });
        });
    }
}

impl PresetsPanel {
    fn list(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>) {
        field(ui, &mut self.search, "Search presets: speech, music, film, walk");
        let wanted = self.search.to_lowercase();
        let mut clicked = None;
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            for (title, users) in [("Factory", false), ("Yours", true)] {
                let says = |p: &Preset| [&p.name, &p.about.sentence].iter().any(|text| text.to_lowercase().contains(&wanted));
                let fits = |p: &Preset| says(p) || p.about.uses.contains(&wanted);
                let shown = |p: &&Preset| p.file.is_some() == users && fits(p);
                let mut any = false;
                for preset in self.presets.iter().filter(shown) {
                    if !any {
                        note(ui, ctx.palette, title);
                        any = true;
                    }
                    let mut label = ui.selectable_label(self.chosen.as_ref() == Some(preset), &preset.name);
                    let About { sentence, uses, .. } = &preset.about;
                    if !sentence.is_empty() {
                        label = label.on_hover_text(format!("{sentence}\n{}", uses.join(", ")));
                    }
                    if label.clicked() {
                        clicked = Some(preset.clone());
                    }
                }
            }
        });
        if let Some(preset) = clicked {
            self.outcome = match presets::read(&preset) {
                Ok(state) => {
                    let now = UserState::of(ctx.params());
                    ctx.restore(&UserState::from_saved(state, &now));
                    self.name.clone_from(&preset.name);
                    self.chosen = Some(preset);
                    None
                }
                Err(error) => Some(Err(with_causes(&error))),
            };
        }
    }

    fn side(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>) {
        labelled(ui, ctx.palette, Word::Compare, |ui| {
            let copy = if ctx.history.is_b() { Word::CopyToA } else { Word::CopyToB };
            if button(ui, ctx.palette, copy).clicked() {
                ctx.history.copy(UserState::of(ctx.params()));
            }
        });
        labelled(ui, ctx.palette, Word::SaveAs, |ui| {
            let width = (ui.available_width() - 56.0).max(60.0);
            ui.add_sized(Vec2::new(width, CONTROL), TextEdit::singleline(&mut self.name).hint_text("Name"));
            if button(ui, ctx.palette, Word::Save).clicked() {
                self.save(ctx);
            }
        });
        let folder = self.folder.as_ref().map_or_else(String::new, |f| format!("Yours are in {}", f.display()));
        outcome(ui, ctx.palette, self.outcome.as_ref(), &folder);
    }

    fn save(&mut self, ctx: &Ctx<'_>) {
        let state = ctx.gui.get_state();
        let folder = self.folder.as_ref().ok_or_else(|| Fault::new("this system names no home folder to keep presets in"));
        self.outcome = Some(match folder.and_then(|folder| presets::save(folder, &self.name, &state)) {
            Ok(preset) => {
                let done = format!("Saved as {}", preset.file.as_ref().unwrap_or(&PathBuf::new()).display());
                self.presets = presets::list(self.folder.as_deref());
                self.chosen = Some(preset);
                Ok(done)
            }
            Err(error) => Err(with_causes(&error)),
        });
    }
}
