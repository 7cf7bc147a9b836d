//! Credit, licence and notes of the scene that is played, below the list.

use super::line::size;
use crate::editor::theme::{Palette, SPACE};
use crate::editor::widgets::{heading, note};
use crate::editor::words::Word;
use egui::{RichText, ScrollArea, Ui, Vec2};
use promenade_core::Scene;

/// The scene's credit and notes are shown from this height on, points.
const LEAST_ABOUT: f32 = 156.0;

/// Height of credit and notes below the list, points: as much as their text needs, but the list keeps half, and all of a low
/// window.
pub(super) fn about_height(all: f32, wanted: f32) -> f32 {
    if all > 2.0 * LEAST_ABOUT { wanted.clamp(LEAST_ABOUT, all / 2.0) } else { 0.0 }
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
pub(super) fn about_scene(ui: &mut Ui, palette: &Palette, scene: &Scene) -> f32 {
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
}
