//! All sources of an instance: name, colour, mute, solo, level, meter and where each is heard from.

use super::theme::{CONTROL, Palette, SPACE};
use super::widgets::{button, note, tab};
use super::{controls::number, ctx::Ctx, direction::seen_from, meter::share, panel::Panel, words::Word};
use crate::parameter::Parameter;
use crate::parameter::source_knob::{MOST_INPUTS, Part, SourceKnob};
use crate::project::sources::LONGEST_NAME;
use crate::telemetry::decibels;
use egui::{Align2, Color32, CornerRadius, Rect, ScrollArea, Sense, TextEdit, Ui, UiBuilder, Vec2, WidgetInfo, pos2, vec2};

/// Width of a source's line at least, points: as many stand beside each other as there is room for.
const LINE: f32 = OTHERS + LEAST_NAME + 2.0 * SPACE;
/// Parts of a line, points; the name takes what is left.
const DOT: f32 = 18.0;
const NUMBER: f32 = 18.0;
const LEAST_NAME: f32 = 60.0;
const KEY: f32 = 26.0;
const LEVEL: f32 = 58.0;
const METER: f32 = 34.0;
const WHERE: f32 = 76.0;
/// Space between two of them, points.
const GAP: f32 = 2.0;
/// What all parts but the name take, with the space after each, points.
const OTHERS: f32 = DOT + NUMBER + 2.0 * KEY + LEVEL + METER + WHERE + 9.0 * GAP;
/// How fast a meter falls, a share of its length a second.
const FALL_PER_S: f32 = 0.6;

/// The list.
pub(super) struct SourcesPanel {
    /// What the meters show, shares of their length.
    levels: [f32; MOST_INPUTS],
    now_s: f64,
}

impl Default for SourcesPanel {
    fn default() -> Self {
        Self { levels: [0.0; MOST_INPUTS], now_s: 0.0 }
    }
}

impl Panel for SourcesPanel {
    fn title(&self) -> Word {
        Word::Sources
    }

    fn is_there(&self, ctx: &Ctx<'_>) -> bool {
        ctx.params().further() > 0
    }

    fn show(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>) {
        let count = 1 + ctx.params().further();
        let fall = crate::parameter::cast::narrow(ctx.now_s - self.now_s) * FALL_PER_S;
        self.now_s = ctx.now_s;
        for (level, peak) in self.levels.iter_mut().zip(ctx.frame.source_peaks) {
            let peak = if ctx.sounding { share(decibels(peak)) } else { 0.0 };
            *level = peak.max(*level - fall);
        }
        if self.levels.iter().any(|level| *level > 0.0) {
            ui.ctx().request_repaint_after(std::time::Duration::from_millis(33));
        }
        let outside = ctx.sources_outside();
        ui.horizontal(|ui| {
            if button(ui, ctx.palette, Word::Arrange).clicked() {
                ctx.arrange();
            }
            if ctx.sources.silent() != 0 && button(ui, ctx.palette, Word::HearAll).clicked() {
                ctx.change_sources(|all| {
                    (0..count).for_each(|source| all.change(source, |s| (s.mute, s.solo) = (false, false)))
                });
            }
            note(
                ui,
                ctx.palette,
                match outside.len() {
                    0 => "A click on a line chooses the source; drag it in the view".to_owned(),
                    1 => "One source is outside of the walls".to_owned(),
                    some => format!("{some} sources are outside of the walls"),
                },
            );
        });
        let beside = crate::parameter::cast::index(ui.available_width() / LINE).max(1);
        let rows = count.div_ceil(beside);
        ui.spacing_mut().item_spacing.y = 2.0;
        ScrollArea::vertical().id_salt("sources").auto_shrink(false).show_rows(ui, CONTROL, rows, |ui, range| {
            for row in range {
                let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), CONTROL), Sense::hover());
                let width = rect.width() / beside as f32;
                // Down, then to the right.
                for (column, source) in (row..count).step_by(rows).enumerate() {
                    let left = rect.left() + column as f32 * width;
                    let place = Rect::from_min_size(pos2(left, rect.top()), vec2(width - 2.0 * SPACE, CONTROL));
                    let builder = UiBuilder::new().id_salt(("source", source)).max_rect(place);
                    ui.scope_builder(builder, |ui| self.line(ui, ctx, source, outside.contains(&source)));
                }
            }
        });
    }
}

impl SourcesPanel {
    fn line(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>, source: usize, outside: bool) {
        let (rect, palette) = (ui.max_rect(), ctx.palette);
        let sources = ctx.sources;
        let info = sources.of(source);
        let whole = ui.interact(rect, ui.scope_id().with("line"), Sense::click());
        whole.widget_info(|| WidgetInfo::labeled(egui::Role::Button, true, sources.name(source)));
        if ctx.selection.source == source {
            ui.painter().rect_filled(rect, CornerRadius::same(4), palette.control);
        }
        if whole.clicked() {
            ctx.selection.source = source;
        }
        let mut left = rect.left() + GAP;
        let mut cell = |width: f32| {
            let place = Rect::from_min_size(pos2(left, rect.top()), vec2(width, CONTROL));
            left += width + GAP;
            place
        };
        let dot = cell(DOT);
        let colour = ctx.source_colour(source);
        let response = ui.interact(dot, ui.scope_id().with("colour"), Sense::click());
        ui.painter().circle_filled(dot.center(), 6.0, colour);
        egui::Popup::menu(&response).show(|ui| colours(ui, ctx, source));
        response.on_hover_text(Word::SourceColour.help());
        let text = |at, align, text: String, colour: Color32| {
            ui.painter().text(at, align, text, Palette::caption(), colour);
        };
        text(cell(NUMBER).center(), Align2::CENTER_CENTER, (source + 1).to_string(), palette.soft);
        let mut name = info.name.clone();
        let width = rect.width() - OTHERS;
        let place = cell(width);
        let hint = format!("Source {}", source + 1);
        let edit = TextEdit::singleline(&mut name).hint_text(hint).char_limit(LONGEST_NAME).margin(vec2(4.0, 4.0));
        if ui.put(place, edit.desired_width(width)).on_hover_text(Word::SourceName.help()).changed() {
            ctx.change_sources(|all| all.change(source, |info| info.name = name));
        }
        for (word, on) in [(Word::Mute, info.mute), (Word::Solo, info.solo)] {
            let clicked = ui.scope_builder(UiBuilder::new().max_rect(cell(KEY)), |ui| tab(ui, palette, word, on).clicked());
            if clicked.inner {
                ctx.change_sources(|all| {
                    all.change(source, |info| match word {
                        Word::Mute => info.mute = !info.mute,
                        _ => info.solo = !info.solo,
                    });
                });
            }
        }
        let level = cell(LEVEL);
        if let Some(further) = source.checked_sub(1) {
            let parameter = Parameter::Source(SourceKnob { further, part: Part::Level });
            ui.scope_builder(UiBuilder::new().max_rect(level), |ui| number(ui, ctx, parameter));
        }
        let bar = Rect::from_center_size(cell(METER).center(), Vec2::new(METER - 4.0, 6.0));
        ui.painter().rect_filled(bar, CornerRadius::same(3), palette.raised);
        let filled = bar.with_max_x(bar.left() + self.levels[source] * bar.width());
        ui.painter().rect_filled(filled, CornerRadius::same(3), if ctx.is_heard(source) { colour } else { palette.soft });
        let (words, colour) = match ctx.scene.and_then(|scene| scene.emitter()) {
            _ if outside => ("outside".to_owned(), palette.warn),
            Some(home) => {
                let (azimuth, _, distance) = seen_from(&ctx.frame.pose, ctx.source_at(home, source));
                (format!("{azimuth:.0}°, {distance:.1} m").replace('-', "\u{2212}"), palette.soft)
            }
            None => (String::new(), palette.soft),
        };
        ui.painter().with_clip_rect(rect).text(
            pos2(left, rect.center().y),
            Align2::LEFT_CENTER,
            words,
            Palette::caption(),
            colour,
        );
    }
}

/// The colours to choose from.
fn colours(ui: &mut Ui, ctx: &Ctx<'_>, source: usize) {
    ui.horizontal(|ui| {
        for (index, [_, r, g, b]) in super::theme::SOURCE_COLOURS.map(u32::to_be_bytes).into_iter().enumerate() {
            let (rect, response) = ui.allocate_exact_size(Vec2::splat(18.0), Sense::click());
            ui.painter().circle_filled(rect.center(), 7.0, Color32::from_rgb(r, g, b));
            response.widget_info(|| WidgetInfo::labeled(egui::Role::Button, true, format!("Colour {}", index + 1)));
            if response.clicked() {
                ctx.change_sources(|all| all.change(source, |info| info.colour = Some([r, g, b])));
                ui.close();
            }
        }
        if button(ui, ctx.palette, Word::NoColour).clicked() {
            ctx.change_sources(|all| all.change(source, |info| info.colour = None));
            ui.close();
        }
    });
}
