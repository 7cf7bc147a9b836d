//! The panel on the left: the scenes to choose from, and the one that is played.

mod about;
mod line;

use self::about::about_scene;
use self::line::{line, room_line};
use super::chooser::{Chooser, FileKind, Place};
use super::ctx::{Ctx, Owed};
use super::theme::{CONTROL, Palette, SPACE};
use super::widgets::{button, button_width, field, note, switch, tab};
use super::words::Word;
use crate::history::user_state::UserState;
use crate::library::lister::{Listed, Lister, Listing, card_at};
use crate::library::{self, scene_key::SceneKey};
use crate::parameter::{Parameter, choices::SceneChoice, row::SlotKind};
use crate::worker::{LISTER, TaskHandle};
use egui::{Align, Frame, Layout, Margin, RichText, ScrollArea, TextEdit, Ui, vec2};
use nice_plug::nice_error;
use nice_plug::prelude::Enum;
use std::path::Path;
use std::sync::Arc;

/// Width, points.
const WIDTH: f32 = 224.0;
/// The list with its search.
pub(super) struct Scenes {
    lister: Arc<Lister>,
    task: Option<TaskHandle>,
    search: String,
    /// Whether the folders are shown.
    folders: bool,
    /// The place of a file that is typed.
    file: String,
    files: Chooser<SceneKey>,
    /// Why no file was opened.
    why_not: Option<String>,
    /// Whether credit, licence and notes of the scene are shown.
    about: bool,
}

const KIND: FileKind = FileKind { name: "Promenade scene", extensions: library::SCENES };
/// Room for the button below the list, points.
const ABOUT: f32 = 32.0;
/// Room for the scroll bar, points.
const BAR: f32 = 4.0;

/// What a line of the list chooses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Pick {
    Loft,
    Factory(usize),
    /// A file of the library, by its number.
    File(usize),
    Room,
    /// A scene that is in no list, saved with the project.
    Own,
}

impl Scenes {
    /// Lists nothing yet.
    pub(super) fn new(lister: Arc<Lister>) -> Self {
        let task = LISTER.add(lister.clone()).inspect_err(|error| nice_error!("no thread to list scenes on: {error}")).ok();
        Self {
            lister,
            task,
            search: String::new(),
            folders: false,
            file: String::new(),
            files: Chooser::default(),
            why_not: None,
            about: false,
        }
    }

    /// What the library has, as far as it is known.
    pub(super) fn listing(&self) -> Arc<Listing> {
        self.lister.newest()
    }

    /// Looks for files in the library's folders.
    pub(super) fn list(&self) {
        if let Some(task) = &self.task {
            task.schedule();
        }
    }

    /// Shows it.
    pub(super) fn show(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>) {
        let frame = Frame::new().fill(ctx.palette.panel).inner_margin(Margin { left: 12, right: 8, top: 4, bottom: 8 });
        egui::Panel::left("scenes").exact_size(WIDTH).resizable(false).frame(frame).show(ui, |ui| {
            let listing = ctx.listing;
            ui.set_max_width(ui.available_width() - BAR);
            self.header(ui, ctx, listing);
            let about = if self.about { 0.4 * ui.available_height() } else { 0.0 };
            let height = (ui.available_height() - about - ABOUT).max(80.0);
            ScrollArea::vertical().max_height(height).auto_shrink(false).show(ui, |ui| {
                ui.set_width(ui.available_width());
                self.lines(ui, ctx, listing);
            });
            if let Some(scene) = ctx.scene {
                ui.add_space(SPACE);
                if tab(ui, ctx.palette, Word::Playing, self.about).clicked() {
                    self.about = !self.about;
                }
                if self.about {
                    about_scene(ui, ctx.palette, scene);
                }
            }
        });
    }

    /// Plays a scene file from anywhere.
    ///
    /// # Errors
    /// The file is no scene.
    pub(super) fn open_file(&mut self, ctx: &mut Ctx<'_>, file: &Path) -> Result<(), String> {
        let key = scene_file(file)?;
        *ctx.owed = None;
        keep_level(ctx);
        open(ctx, key);
        Ok(())
    }

    /// Says why a file was not taken, or nothing any more.
    pub(super) fn tell(&mut self, why_not: Option<String>) {
        self.why_not = why_not;
    }

    fn header(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>, listing: &Listing) {
        ui.horizontal(|ui| {
            ui.label(RichText::new("Scenes").font(Palette::heading()).color(ctx.palette.text));
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                if button(ui, ctx.palette, Word::Folder).clicked() {
                    self.folders = !self.folders;
                }
                if button(ui, ctx.palette, Word::Refresh).clicked() {
                    self.list();
                }
            });
        });
        if self.folders {
            for folder in &listing.folders {
                note(ui, ctx.palette, folder.display().to_string());
                ui.horizontal(|ui| {
                    if button(ui, ctx.palette, Word::CopyPath).clicked() {
                        ui.ctx().copy_text(folder.display().to_string());
                    }
                    if folder.is_dir() && button(ui, ctx.palette, Word::Open).clicked() {
                        ui.ctx().open_url(egui::OpenUrl::new_tab(folder.display()));
                    }
                });
            }
            field(ui, &mut self.file, "Path of a scene file");
        }
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = SPACE;
            let place = vec2(ui.available_width() - button_width(ui, Word::OpenScene) - SPACE, CONTROL);
            ui.add_sized(place, TextEdit::singleline(&mut self.search).hint_text("Search"));
            if ui.add_enabled_ui(!self.files.is_busy(), |ui| button(ui, ctx.palette, Word::OpenScene)).inner.clicked() {
                let typed = if self.folders { self.file.as_str() } else { "" };
                self.why_not = self.files.ask(ctx, KIND, Place::typed_or(typed, Place::Existing), scene_file).err();
            }
        });
        match self.files.take() {
            Some(Ok(key)) => {
                keep_level(ctx);
                open(ctx, key);
            }
            Some(Err(why)) => self.why_not = Some(why),
            None => (),
        }
        if let Some(why) = &self.why_not {
            note(ui, ctx.palette, why);
        }
        matching(ui, ctx);
        ui.add_space(SPACE);
    }

    fn lines(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>, listing: &Listing) {
        let wanted = self.search.trim().to_lowercase();
        let chosen = chosen(ctx, listing);
        let loft = listing.loft.iter().map(|listed| (Pick::Loft, listed));
        let factory = listing.factory.iter().enumerate().map(|(index, listed)| (Pick::Factory(index), listed));
        let factory = loft.chain(factory);
        let library = listing.scenes.iter().enumerate().map(|(number, listed)| (Pick::File(number), listed));
        let mut clicked = None;
        let saved = ctx.params().scene_key.get().0;
        for (title, lines) in [("Built in", factory.collect::<Vec<_>>()), ("Library", library.collect())] {
            caption(ui, ctx.palette, title);
            let shown = lines.iter().filter(|(_, listed)| matches(listed, &wanted)).collect::<Vec<_>>();
            if title == "Library" && saved.is_some() && chosen == Pick::Own {
                note(ui, ctx.palette, format!("Saved with the project: {}", saved.title));
            }
            if shown.is_empty() {
                let why = if lines.is_empty() { "Empty: see Folder" } else { "Nothing matches" };
                note(ui, ctx.palette, why);
            }
            for (pick, listed) in shown {
                if line(ui, ctx.palette, listed, *pick == chosen) {
                    clicked = Some(*pick);
                }
            }
        }
        caption(ui, ctx.palette, "Yours");
        let room = ctx.params().room.get().0;
        let (title, below) = match &room {
            Some(room) => (Word::YourRoom, room.lengths()),
            None => (Word::DrawRoom, "Three lengths and six materials".to_owned()),
        };
        if room_line(ui, ctx.palette, title, &below, chosen == Pick::Room) {
            clicked = Some(Pick::Room);
        }
        if clicked.is_some() {
            *ctx.owed = None;
            keep_level(ctx);
        }
        match clicked {
            Some(Pick::Room) => ctx.choose_room(),
            Some(Pick::Loft) => open(ctx, SceneKey::loft()),
            Some(Pick::Factory(index)) => ctx.set(Parameter::Scene, index as f32),
            Some(Pick::File(number)) => self.why_not = choose(ctx, &listing.scenes[number]).err(),
            Some(Pick::Own) | None => {}
        }
    }
}

/// Plays a file of the library: by its slot, which can be automated, or where it has none as the project's own scene.
fn choose(ctx: &mut Ctx<'_>, listed: &Listed) -> Result<(), String> {
    let key = ctx.params().scene_key.get().0;
    // What is saved with a slot may be another file than the slot's, as in a preset from another project.
    let is_free = |slot: &usize| u32::try_from(*slot) != Ok(key.slot) || key.absolute == listed.path;
    match ctx.params().slots.slot_of(SlotKind::Scene, &listed.path).filter(is_free) {
        Some(slot) => {
            // The slot first: the scene that was chosen before is not read again in between.
            ctx.set(Parameter::Slot, slot as f32);
            ctx.set(Parameter::Scene, SceneChoice::Library.to_index() as f32);
        }
        None => open(ctx, scene_file(&listed.path)?),
    }
    Ok(())
}

/// The key of the scene file at a place.
fn scene_file(path: &Path) -> Result<SceneKey, String> {
    let card = card_at(path).map_err(|why| format!("{}: {why}", path.display()))?;
    Ok(SceneKey::to_file(path, String::new(), card.provenance.title, 0))
}

/// Whether scenes are played as loud as each other, and what that does to the one that is heard.
fn matching(ui: &mut Ui, ctx: &mut Ctx<'_>) {
    let on = ctx.settings.matches;
    ui.horizontal(|ui| {
        if switch(ui, ctx.palette, Word::MatchLevels, on).clicked() {
            ctx.settings.matches = !on;
            if on {
                ctx.keep(&ctx.instance.params.matching, |matching| matching.level_cb = None);
            }
        }
        let change_cb = ctx.params().matching.get().0.change_cb(ctx.instance.loader.level_cb());
        if change_cb != 0 {
            note(ui, ctx.palette, format!("{:+.1} dB", f64::from(change_cb) / 10.0));
        }
    });
}

/// Has the next scenes played as loud as the one that is heard now, where that is wanted.
fn keep_level(ctx: &Ctx<'_>) {
    let now_cb = ctx.instance.loader.level_cb();
    if ctx.settings.matches {
        ctx.keep(&ctx.instance.params.matching, |matching| matching.level_cb = matching.level_cb.or(now_cb));
    }
}

/// Plays a scene file as the project's own.
fn open(ctx: &mut Ctx<'_>, key: SceneKey) {
    *ctx.owed = Some(Owed { slot: 0, key, before: Some(UserState::of(ctx.params())) });
    // A drawn room would be the project's own.
    ctx.keep(&ctx.instance.params.room, |room| *room = None);
    ctx.set(Parameter::Slot, 0.0);
    ctx.set(Parameter::Scene, SceneChoice::Library.to_index() as f32);
}

/// What the parameters choose.
fn chosen(ctx: &Ctx<'_>, listing: &Listing) -> Pick {
    let scene = ctx.index(Parameter::Scene);
    if ctx.drawn_room().is_some() {
        Pick::Room
    } else if ctx.params().chooses_own_scene() && ctx.params().scene_key.get().0.is_loft() {
        Pick::Loft
    } else if scene == SceneChoice::Library.to_index() {
        let (slot, key) = (ctx.index(Parameter::Slot), ctx.params().scene_key.get().0);
        let files = listing.scenes.iter().map(|listed| listed.path.as_path());
        let of_key = || files.clone().position(|file| file == key.absolute);
        let of_slot = || ctx.params().slots.saved().scenes.file(slot, files.clone());
        let is_keys = slot == 0 || u32::try_from(slot) == Ok(key.slot);
        (if is_keys { of_key() } else { of_slot() }).map_or(Pick::Own, Pick::File)
    } else {
        Pick::Factory(scene)
    }
}

/// Whether a scene matches a search, by title, file name, credit or licence.
fn matches(listed: &Listed, wanted: &str) -> bool {
    let has = |text: &str| text.to_lowercase().contains(wanted);
    let credited = match &listed.card {
        Some(Ok(card)) => [&card.provenance.credit, &card.provenance.licence].into_iter().any(|text| has(text)),
        _ => false,
    };
    wanted.is_empty() || has(listed.title()) || has(listed.file_name()) || credited
}

fn caption(ui: &mut Ui, palette: &Palette, text: &str) {
    ui.add_space(SPACE);
    ui.label(RichText::new(text).font(Palette::caption()).color(palette.soft));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_no_scene_is_refused_with_what_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let [good, bad] = ["good.promenade", "walk.json"].map(|name| folder.path().join(name));
        std::fs::write(&good, crate::library::factory::ROOM_B.bytes).unwrap();
        std::fs::write(&bad, r#"[{"t": 0, "position": [1, 2, 3], "ypr": [0, 0, 0]}]"#).unwrap();
        let key = scene_file(&good).unwrap();
        assert_eq!((key.title.as_str(), key.slot, key.absolute), ("IoSR Room B, class room", 0, good));
        for (file, words) in [(bad, ["walk.json", "expected", "found"]), (folder.path().to_owned(), ["", "expected", "found"])]
        {
            let why = scene_file(&file).unwrap_err();
            assert!(words.iter().all(|word| why.contains(word)), "{why}");
        }
    }

    #[test]
    fn a_search_looks_at_title_and_credit() {
        let lister = Lister::new(crate::worker::repaint::Repaint::default());
        crate::worker::Task::run(&*lister);
        let listing = lister.newest();
        let found = |wanted: &str| listing.factory.iter().filter(|listed| matches(listed, wanted)).count();
        assert_eq!((found(""), found("office"), found("surrey"), found("nothing of the kind")), (2, 1, 2, 0));
    }
}
