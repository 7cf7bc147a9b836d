//! The panel on the left: the scenes to choose from, and the one that is played.

use super::chooser::{Chooser, FileKind, Place};
use super::ctx::{Ctx, Owed};
use super::theme::{Palette, ROUND, SPACE, faded};
use super::widgets::{button, field, focus_ring, heading, note, switch};
use super::words::Word;
use crate::history::user_state::UserState;
use crate::library;
use crate::library::lister::{Listed, Lister, Listing, card_at};
use crate::library::scene_key::SceneKey;
use crate::parameter::choices::SceneChoice;
use crate::parameter::{Parameter, SLOTS};
use crate::worker::{LISTER, TaskHandle};
use egui::{Align, CornerRadius, Frame, Layout, Margin, RichText, ScrollArea, Sense, TextEdit, Ui, Vec2, WidgetInfo, vec2};
use nice_plug::nice_error;
use nice_plug::prelude::Enum;
use promenade_core::{Scene, SceneCard, Tier};
use std::path::Path;
use std::sync::Arc;

/// Width, points.
const WIDTH: f32 = 224.0;
/// Height of a line of the list, points.
const LINE: f32 = 44.0;

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
    /// Height that the scene's credit and notes want, points.
    about: f32,
}

const KIND: FileKind = FileKind { name: "Promenade scene", extensions: library::SCENES };
/// Room for the button beside the search, points.
const OPEN: f32 = 68.0;

/// The scene's credit and notes are shown from this height on, points.
const LEAST_ABOUT: f32 = 156.0;

/// What a line of the list chooses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Pick {
    Loft,
    Factory(usize),
    Slot(usize),
    Room,
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
            about: 0.0,
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
            self.header(ui, ctx, listing);
            let all = ui.available_height();
            let about = about_height(all, self.about);
            let height = (all - about).max(80.0);
            ScrollArea::vertical().max_height(height).auto_shrink(false).show(ui, |ui| {
                ui.set_width(ui.available_width() - 4.0);
                self.lines(ui, ctx, listing);
            });
            if about > 0.0
                && let Some(scene) = ctx.scene
            {
                self.about = about_scene(ui, ctx.palette, scene);
            }
        });
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
            field(ui, &mut self.file, "A scene file elsewhere: type, then Open");
        }
        ui.horizontal(|ui| {
            let search = TextEdit::singleline(&mut self.search)
                .hint_text("Search")
                .margin(Margin::symmetric(8, 5))
                .desired_width(ui.available_width() - OPEN);
            ui.add(search);
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

    fn lines(&self, ui: &mut Ui, ctx: &mut Ctx<'_>, listing: &Listing) {
        let wanted = self.search.trim().to_lowercase();
        let chosen = chosen(ctx);
        let loft = listing.loft.iter().map(|listed| (Pick::Loft, listed));
        let factory = listing.factory.iter().enumerate().map(|(index, listed)| (Pick::Factory(index), listed));
        let factory = loft.chain(factory);
        let library = listing.scenes.iter().enumerate().map(|(index, listed)| (Pick::Slot(index + 1), listed));
        let mut clicked = None;
        let saved = ctx.params().scene_key.get().0;
        for (title, lines) in [("Built in", factory.collect::<Vec<_>>()), ("Library", library.collect())] {
            caption(ui, ctx.palette, title);
            let shown = lines.iter().filter(|(_, listed)| matches(listed, &wanted)).collect::<Vec<_>>();
            if title == "Library" && saved.is_some() && matches!(chosen, Pick::Slot(0)) {
                note(ui, ctx.palette, format!("Saved with the project: {}", saved.title));
            }
            if shown.is_empty() {
                let why = if lines.is_empty() { "No scene files in the library's folders" } else { "None found" };
                note(ui, ctx.palette, why);
            }
            for (pick, listed) in shown {
                if line(ui, ctx.palette, *pick, listed, *pick == chosen) {
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
            Some(Pick::Slot(slot)) => {
                // The slot first: the scene that was chosen before is not read again in between.
                ctx.set(Parameter::Slot, slot as f32);
                ctx.set(Parameter::Scene, SceneChoice::Library.to_index() as f32);
            }
            None => {}
        }
    }
}

/// Height of credit and notes below the list, points: as much as their text needs, but the list keeps half, and all of a low
/// window.
fn about_height(all: f32, wanted: f32) -> f32 {
    if all > 2.0 * LEAST_ABOUT { wanted.clamp(LEAST_ABOUT, all / 2.0) } else { 0.0 }
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
fn chosen(ctx: &Ctx<'_>) -> Pick {
    let scene = ctx.index(Parameter::Scene);
    if ctx.drawn_room().is_some() {
        Pick::Room
    } else if ctx.params().chooses_own_scene() && ctx.params().scene_key.get().0.is_loft() {
        Pick::Loft
    } else if scene == SceneChoice::Library.to_index() {
        Pick::Slot(ctx.index(Parameter::Slot))
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

/// A size with its unit.
fn size(bytes: u64) -> String {
    let bytes = bytes as f64;
    if bytes < 1e6 { format!("{:.0} kB", bytes / 1e3) } else { format!("{:.1} MB", bytes / 1e6) }
}

/// The ground of a line of the list.
fn plate(ui: &mut Ui, palette: &Palette, on: bool) -> (egui::Rect, egui::Response) {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), LINE), Sense::click());
    let fill = match (on, response.hovered()) {
        (true, _) => faded(palette.accent, 0.16),
        (false, true) => palette.control,
        (false, false) => palette.panel,
    };
    ui.painter().rect_filled(rect, CornerRadius::same(ROUND), fill);
    if on {
        let mark = egui::Rect::from_min_size(rect.min + vec2(0.0, 8.0), vec2(3.0, LINE - 16.0));
        ui.painter().rect_filled(mark, CornerRadius::same(1), palette.accent);
    }
    (rect, response)
}

/// Title of a line, and the text below it with its colour and what it leaves free at its end.
fn texts(ui: &Ui, palette: &Palette, inside: egui::Rect, title: &str, on: bool, below: (&str, egui::Color32, f32)) {
    let short = |text: &str, font: egui::FontId, colour, width: f32| {
        let mut job = egui::text::LayoutJob::simple_singleline(text.to_owned(), font, colour);
        job.wrap = egui::text::TextWrapping::truncate_at_width(width);
        ui.painter().layout_job(job)
    };
    let title_colour = if on { palette.accent } else { palette.text };
    let title = short(title, Palette::body(), title_colour, inside.width());
    ui.painter().galley(inside.min + vec2(0.0, 6.0), title, title_colour);
    let (text, colour, free) = below;
    let second = short(text, Palette::caption(), colour, inside.width() - free);
    ui.painter().galley(inside.min + vec2(0.0, 24.0), second, colour);
}

/// The line of the drawn room; returns whether it was clicked.
fn room_line(ui: &mut Ui, palette: &Palette, word: Word, below: &str, on: bool) -> bool {
    let (rect, response) = plate(ui, palette, on);
    texts(ui, palette, rect.shrink2(vec2(10.0, 0.0)), word.label(), on, (below, palette.soft, 0.0));
    focus_ring(ui, palette, &response, rect.shrink(1.0), ROUND);
    response.widget_info(|| WidgetInfo::selected(egui::Role::RadioButton, true, on, word.label()));
    response.on_hover_text(word.help()).clicked() && !on
}

/// A line of the list; returns whether it was clicked.
fn line(ui: &mut Ui, palette: &Palette, pick: Pick, listed: &Listed, on: bool) -> bool {
    let (rect, response) = plate(ui, palette, on);
    let beyond = matches!(pick, Pick::Slot(slot) if slot > usize::from(SLOTS));
    let (below, colour) = match &listed.card {
        None => ("reading".to_owned(), palette.soft),
        Some(Err(_)) => ("cannot be read".to_owned(), palette.error),
        Some(Ok(_)) if beyond => (format!("beyond slot {SLOTS}"), palette.warn),
        Some(Ok(card)) => (line_of(card, listed.bytes), palette.soft),
    };
    let inside = rect.shrink2(vec2(10.0, 0.0));
    let tiers = if matches!(listed.card, Some(Ok(_))) { TIER_MARKS } else { 0.0 };
    texts(ui, palette, inside, listed.title(), on, (&below, colour, tiers));
    if let Some(Ok(card)) = &listed.card {
        for (index, tier) in Tier::ALL.into_iter().enumerate() {
            let has = card.tiers.contains(&tier);
            let at = egui::pos2(inside.right() - 4.0 - (3 - index) as f32 * 9.0, rect.top() + 31.0);
            let colour = if has { palette.accent } else { palette.line };
            ui.painter().circle_filled(at, 3.0, colour);
        }
    }
    focus_ring(ui, palette, &response, rect.shrink(1.0), ROUND);
    response.widget_info(|| WidgetInfo::selected(egui::Role::RadioButton, !beyond, on, listed.title()));
    response.on_hover_ui(|ui| tooltip(ui, palette, listed)).clicked() && !on && !beyond
}

/// What a line says of a scene. What knows no treble says so first, since lines are cut.
fn line_of(card: &SceneCard, bytes: u64) -> String {
    let dull = if card.sample_rate_hz < FULL_BAND_HZ { format!("{}  ", at_rate(card)) } else { String::new() };
    format!("{dull}{}  {}", size(bytes), card.provenance.licence)
}

/// The rate of a scene's data, in words.
fn at_rate(card: &SceneCard) -> String {
    format!("at {} kHz", card.sample_rate_hz / 1e3)
}

/// Data at lower rates lack treble that is heard, hertz.
const FULL_BAND_HZ: f64 = 32_000.0;

/// Room for the four marks of tiers, points.
const TIER_MARKS: f32 = 44.0;

/// Everything that is known of a listed scene.
fn tooltip(ui: &mut Ui, palette: &Palette, listed: &Listed) {
    ui.set_max_width(320.0);
    ui.label(RichText::new(listed.title()).font(Palette::heading()).color(palette.text));
    match &listed.card {
        Some(Ok(card)) => {
            let tiers = card.tiers.iter().map(|tier| tier.name()).collect::<Vec<_>>().join(", ");
            note(ui, palette, &card.provenance.credit);
            note(ui, palette, format!("Licence: {}", card.provenance.licence));
            note(
                ui,
                palette,
                format!("Qualities: {tiers}. {}, {} measurements to be judged by", size(listed.bytes), card.held_out),
            );
            note(ui, palette, format!("Measured or made {}: there is no more treble than that", at_rate(card)));
        }
        Some(Err(error)) => {
            ui.label(RichText::new(error).font(Palette::caption()).color(palette.error));
        }
        None => note(ui, palette, "Being read"),
    }
    if !listed.path.as_os_str().is_empty() {
        note(ui, palette, listed.path.display().to_string());
    }
}

/// Notes that programs write for programs are long; a person wants their beginning.
const LONGEST_NOTE: usize = 120;

/// The beginning of a text, up to a word's end.
fn beginning(text: &str) -> String {
    let Some((end, _)) = text.char_indices().nth(LONGEST_NOTE) else { return text.to_owned() };
    let cut = text[..end].rfind(' ').unwrap_or(end);
    format!("{} ...", &text[..cut])
}

/// Credit, licence and notes of the scene that is played; returns the height that they want.
fn about_scene(ui: &mut Ui, palette: &Palette, scene: &Scene) -> f32 {
    let top = ui.cursor().top();
    ui.add_space(SPACE);
    let rule = ui.available_rect_before_wrap();
    ui.painter().hline(rule.x_range(), rule.top(), egui::Stroke::new(1.0, palette.line));
    heading(ui, palette, Word::Playing);
    let head = ui.cursor().top() - top;
    let shown = ScrollArea::vertical().id_salt("playing").auto_shrink(false).show(ui, |ui| {
        ui.set_width(ui.available_width() - 4.0);
        ui.spacing_mut().item_spacing = Vec2::new(SPACE, 2.0);
        ui.label(RichText::new(scene.title()).color(palette.text));
        note(ui, palette, scene.credit());
        note(ui, palette, format!("Licence: {}", scene.licence()));
        let grid = scene.grid();
        let kind = match (scene.field(), scene.cloud()) {
            (Some(_), Some(_)) => "For Draft and Standard, and for High",
            (Some(_), None) => "For Draft and Standard",
            (None, Some(_)) => "For High",
            (None, None) => "Empty",
        };
        note(ui, palette, format!("{kind}, {} at {} Hz", size(scene.memory_bytes() as u64), grid.sample_rate_hz));
        for text in &scene.provenance().notes {
            let text = format!("Note: {text}");
            let shown = ui.label(RichText::new(beginning(&text)).font(Palette::caption()).color(palette.soft));
            shown.on_hover_text(text.as_str());
        }
    });
    head + shown.content_size.y + SPACE
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_easily() {
        assert_eq!((size(812_000), size(1_374_352)), ("812 kB".to_owned(), "1.4 MB".to_owned()));
    }

    #[test]
    fn credit_and_notes_get_what_they_need_and_the_list_keeps_half() {
        for (all, wanted, given) in [(690.0, 200.0, 200.0), (690.0, 900.0, 345.0), (690.0, 20.0, 156.0), (300.0, 200.0, 0.0)] {
            assert_eq!(about_height(all, wanted), given, "{wanted} of {all}");
        }
    }

    #[test]
    fn a_long_note_ends_at_a_word() {
        assert_eq!(beginning("as it is"), "as it is");
        let long = beginning(&"eleven words and more ".repeat(20));
        assert!(long.len() <= LONGEST_NOTE + 4 && long.ends_with(" ...") && !long.contains("mor ."), "{long}");
        assert_eq!(beginning(&"x".repeat(500)).len(), LONGEST_NOTE + 4);
    }

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
