//! A line of the list of scenes, and what is known of its scene.

use crate::editor::theme::{Palette, ROUND, faded};
use crate::editor::widgets::{focus_ring, note};
use crate::editor::words::Word;
use crate::library::lister::Listed;
use egui::{CornerRadius, RichText, Sense, Ui, WidgetInfo, vec2};
use promenade_core::SceneCard;

/// Height of a line of the list, points.
const LINE: f32 = 36.0;

/// A size with its unit.
pub(super) fn size(bytes: u64) -> String {
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
    ui.painter().galley(inside.min + vec2(0.0, 3.0), title, title_colour);
    let (text, colour, free) = below;
    let second = short(text, Palette::caption(), colour, inside.width() - free);
    ui.painter().galley(inside.min + vec2(0.0, 19.0), second, colour);
}

/// The line of the drawn room; returns whether it was clicked.
pub(super) fn room_line(ui: &mut Ui, palette: &Palette, word: Word, below: &str, on: bool) -> bool {
    let (rect, response) = plate(ui, palette, on);
    texts(ui, palette, rect.shrink2(vec2(10.0, 0.0)), word.label(), on, (below, palette.soft, 0.0));
    focus_ring(ui, palette, &response, rect.shrink(1.0), ROUND);
    response.widget_info(|| WidgetInfo::selected(egui::Role::RadioButton, true, on, word.label()));
    response.on_hover_text(word.help()).clicked() && !on
}

/// A line of the list; returns whether it was clicked.
pub(super) fn line(ui: &mut Ui, palette: &Palette, listed: &Listed, on: bool) -> bool {
    let (rect, response) = plate(ui, palette, on);
    let (below, colour) = match &listed.card {
        None => ("loading".to_owned(), palette.soft),
        Some(Err(_)) => ("cannot be read".to_owned(), palette.error),
        Some(Ok(card)) => (line_of(card, listed.bytes), palette.soft),
    };
    let inside = rect.shrink2(vec2(10.0, 0.0));
    texts(ui, palette, inside, listed.title(), on, (&below, colour, 0.0));
    focus_ring(ui, palette, &response, rect.shrink(1.0), ROUND);
    response.widget_info(|| WidgetInfo::selected(egui::Role::RadioButton, true, on, listed.title()));
    response.on_hover_ui(|ui| tooltip(ui, palette, listed)).clicked() && !on
}

/// What a line says of a scene: up to which frequency it knows the sound.
fn line_of(card: &SceneCard, bytes: u64) -> String {
    format!("up to {:.0} kHz, {}", 0.5 * card.sample_rate_hz / 1e3, size(bytes))
}

/// Everything that is known of a listed scene.
fn tooltip(ui: &mut Ui, palette: &Palette, listed: &Listed) {
    ui.set_max_width(320.0);
    ui.label(RichText::new(listed.title()).font(Palette::heading()).color(palette.text));
    match &listed.card {
        Some(Ok(card)) => {
            note(ui, palette, &card.provenance.credit);
            note(ui, palette, format!("Licence: {}", card.provenance.licence));
            note(ui, palette, format!("{}, {} held-out measurements", size(listed.bytes), card.held_out));
            note(ui, palette, format!("Sampled at {} kHz: no treble above half of that", card.sample_rate_hz / 1e3));
        }
        Some(Err(error)) => {
            ui.label(RichText::new(error).font(Palette::caption()).color(palette.error));
        }
        None => note(ui, palette, "Loading"),
    }
    if !listed.path.as_os_str().is_empty() {
        note(ui, palette, listed.path.display().to_string());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_easily() {
        assert_eq!((size(812_000), size(1_374_352)), ("812 kB".to_owned(), "1.4 MB".to_owned()));
    }
}
