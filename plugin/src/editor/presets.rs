//! Presets in the top line: the chosen one, the ones before and after it, and a menu of all.

use super::theme::{CONTROL, Palette, SPACE};
use super::widgets::{button, field, note, outcome, value_button};
use super::{ctx::Ctx, words::Word};
use crate::history::presets::{self, About, Preset};
use crate::history::user_state::UserState;
use crate::library;
use egui::{Popup, PopupCloseBehavior, RichText, ScrollArea, TextEdit, Ui, Vec2};
use promenade_fault::{Fault, with_causes};
use std::path::{Path, PathBuf};

/// Width of the menu and of the name in the top line, and height of the list, points.
const MENU: f32 = 340.0;
const NAME: f32 = 184.0;
const LIST: f32 = 320.0;

/// The presets of the factory and of the user.
pub(super) struct Presets {
    folder: Option<PathBuf>,
    all: Vec<Preset>,
    search: String,
    name: String,
    /// What was done last, or what went wrong.
    outcome: Option<Result<String, String>>,
}

impl Default for Presets {
    fn default() -> Self {
        let folder = presets::folder();
        let all = presets::list(folder.as_deref());
        Self { folder, all, search: String::new(), name: String::new(), outcome: None }
    }
}

impl Presets {
    /// Shows the name of the chosen preset between buttons for the one before and the one after it.
    pub(super) fn show(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>) {
        ui.spacing_mut().item_spacing.x = 2.0;
        if button(ui, ctx.palette, Word::PreviousPreset).clicked() {
            self.step(ctx, -1);
        }
        let shown = short(ui, ctx.preset.as_deref().unwrap_or("No preset"), NAME - 20.0);
        let response = value_button(ui, ctx.palette, &shown, Word::Presets.help());
        Popup::menu(&response).close_behavior(PopupCloseBehavior::CloseOnClickOutside).show(|ui| {
            ui.set_width(MENU);
            self.menu(ui, ctx);
        });
        if button(ui, ctx.palette, Word::NextPreset).clicked() {
            self.step(ctx, 1);
        }
    }

    fn step(&mut self, ctx: &mut Ctx<'_>, by: isize) {
        let at = self.all.iter().position(|preset| Some(&preset.name) == ctx.preset.as_ref());
        let last = self.all.len().saturating_sub(1);
        let next = match (at, by) {
            (None, 1..) => 0,
            (None, _) => last,
            (Some(at), by) => at.checked_add_signed(by).map_or(last, |next| if next > last { 0 } else { next }),
        };
        if let Some(preset) = self.all.get(next).cloned() {
            self.load(ctx, &preset);
        }
    }

    fn load(&mut self, ctx: &mut Ctx<'_>, preset: &Preset) {
        self.outcome = match presets::read(preset) {
            Ok(state) => {
                let before = UserState::of(ctx.params());
                let wanted = UserState::from_saved(state, &before);
                ctx.restore(&wanted);
                // The slot may be taken later than the values: what is undone is all of it.
                ctx.history.record(before, &wanted);
                self.name.clone_from(&preset.name);
                *ctx.preset = Some(preset.name.clone());
                None
            }
            Err(error) => Some(Err(with_causes(&error))),
        };
    }

    /// Loads a preset's file from anywhere.
    ///
    /// # Errors
    /// The file is no preset.
    pub(super) fn load_file(&mut self, ctx: &mut Ctx<'_>, file: &Path) -> Result<(), String> {
        let preset = presets::of_file(file).ok_or_else(|| format!("{}: expected a preset of your own", file.display()))?;
        self.load(ctx, &preset);
        match &self.outcome {
            Some(Err(why)) => Err(why.clone()),
            _ => Ok(()),
        }
    }

    fn menu(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>) {
        field(ui, &mut self.search, "Search: speech, music, film, walk");
        let wanted = self.search.to_lowercase();
        let mut clicked = None;
        ScrollArea::vertical().max_height(LIST).auto_shrink([false, true]).show(ui, |ui| {
            for (title, users) in [("Factory", false), ("Yours", true)] {
                let says = |p: &Preset| [&p.name, &p.about.sentence].iter().any(|text| text.to_lowercase().contains(&wanted));
                let fits = |p: &Preset| says(p) || p.about.uses.contains(&wanted);
                let shown: Vec<_> = self.all.iter().filter(|p| p.file.is_some() == users && fits(p)).collect();
                if !shown.is_empty() {
                    note(ui, ctx.palette, title);
                }
                for preset in shown {
                    let chosen = Some(&preset.name) == ctx.preset.as_ref();
                    let mut label = ui.selectable_label(chosen, RichText::new(&preset.name).color(ctx.palette.text));
                    let About { sentence, uses, .. } = &preset.about;
                    if !sentence.is_empty() {
                        label = label.on_hover_text(format!("{sentence}\n{}", uses.join(", ")));
                    }
                    if label.clicked() {
                        clicked = Some(preset.clone());
                    }
                    if let Some(file) = preset.scene.as_ref().filter(|scene| !library::has_file(&ctx.listing.folders, scene)) {
                        let text = format!("    needs {}, which is not installed", file.file_name());
                        ui.label(RichText::new(text).font(Palette::caption()).color(ctx.palette.warn));
                    }
                }
            }
        });
        if let Some(preset) = clicked {
            self.load(ctx, &preset);
        }
        ui.separator();
        ui.horizontal(|ui| {
            ui.add_sized(
                Vec2::new(MENU - 64.0, CONTROL),
                TextEdit::singleline(&mut self.name).hint_text("Name of a new preset"),
            );
            if button(ui, ctx.palette, Word::Save).clicked() {
                self.save(ctx);
            }
        });
        let folder = self.folder.as_ref().map_or_else(String::new, |f| format!("Yours are in {}", f.display()));
        ui.add_space(SPACE);
        outcome(ui, ctx.palette, self.outcome.as_ref(), &folder);
    }

    fn save(&mut self, ctx: &mut Ctx<'_>) {
        let state = ctx.gui.get_state();
        let folder = self.folder.as_ref().ok_or_else(|| Fault::new("this system names no home folder to keep presets in"));
        self.outcome = Some(match folder.and_then(|folder| presets::save(folder, &self.name, &state)) {
            Ok(preset) => {
                self.all = presets::list(self.folder.as_deref());
                *ctx.preset = Some(preset.name.clone());
                Ok(format!("Saved as {}", preset.file.unwrap_or_default().display()))
            }
            Err(error) => Err(with_causes(&error)),
        });
    }
}

/// A text that is as wide as this at most, cut where it is wider.
fn short(ui: &Ui, text: &str, width: f32) -> String {
    let wide = |text: &str| ui.painter().layout_no_wrap(text.to_owned(), Palette::body(), egui::Color32::WHITE).size().x;
    if wide(text) <= width {
        return text.to_owned();
    }
    let cut = text.char_indices().map(|(at, _)| &text[..at]).take_while(|start| wide(start) <= width - 10.0).last();
    format!("{}…", cut.unwrap_or_default().trim_end())
}
