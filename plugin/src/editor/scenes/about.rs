//! Credit, licence and notes of the scene that is played.

use super::line::size;
use crate::editor::theme::{Palette, SPACE};
use crate::editor::widgets::note;
use egui::{RichText, ScrollArea, Ui, Vec2};
use promenade_core::Scene;

/// Notes that programs write for programs are long; a person wants their beginning.
const LONGEST_NOTE: usize = 120;

/// The beginning of a text, up to a word's end.
fn beginning(text: &str) -> String {
    let Some((end, _)) = text.char_indices().nth(LONGEST_NOTE) else { return text.to_owned() };
    let cut = text[..end].rfind(' ').unwrap_or(end);
    format!("{} ...", &text[..cut])
}

/// Credit, licence and notes of the scene that is played.
pub(super) fn about_scene(ui: &mut Ui, palette: &Palette, scene: &Scene) {
    ScrollArea::vertical().id_salt("about").auto_shrink(false).show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.spacing_mut().item_spacing = Vec2::new(SPACE, 2.0);
        ui.label(RichText::new(scene.title()).color(palette.text));
        note(ui, palette, scene.credit());
        note(ui, palette, format!("Licence: {}", scene.licence()));
        let grid = scene.grid();
        let rate = format!("{} in memory, made at {} kHz", size(scene.memory_bytes() as u64), grid.sample_rate_hz / 1e3);
        note(ui, palette, rate);
        for text in &scene.provenance().notes {
            let shown = ui.label(RichText::new(beginning(text)).font(Palette::caption()).color(palette.soft));
            shown.on_hover_text(text.as_str());
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_note_ends_at_a_word() {
        assert_eq!(beginning("as it is"), "as it is");
        let long = beginning(&"eleven words and more ".repeat(20));
        assert!(long.len() <= LONGEST_NOTE + 4 && long.ends_with(" ...") && !long.contains("mor ."), "{long}");
        assert_eq!(beginning(&"x".repeat(500)).len(), LONGEST_NOTE + 4);
    }
}
