//! Loudness below the level meters.

use super::{ctx::Ctx, theme::Palette, words::Word};
use egui::{Align2, Rect, Sense, Ui, Vec2, WidgetInfo};

/// Height of the line, points.
const HEIGHT: f32 = 18.0;

/// Shows momentary, short-term and integrated loudness. A click begins the last anew.
pub(super) fn show(ui: &mut Ui, ctx: &Ctx<'_>) {
    let palette = ctx.palette;
    let loudness = ctx.views.loudness();
    let (rect, _) = ui.allocate_exact_size(Vec2::new(ui.available_width(), HEIGHT), Sense::hover());
    let unit = ui.painter().text(rect.right_center(), Align2::RIGHT_CENTER, "LUFS", Palette::caption(), palette.soft);
    let width = (unit.left() - rect.left()) / 3.0;
    let all = [
        (Word::Momentary, loudness.momentary),
        (Word::ShortTerm, loudness.short_term),
        (Word::Integrated, loudness.integrated),
    ];
    for (place, (word, level)) in all.into_iter().enumerate() {
        let left = rect.left() + place as f32 * width;
        let cell = Rect::from_x_y_ranges(left..=left + width, rect.y_range());
        let name = ui.painter().text(cell.left_center(), Align2::LEFT_CENTER, word.label(), Palette::caption(), palette.soft);
        let colour = if level.is_some() { palette.text } else { palette.soft };
        let at = name.right_center() + Vec2::new(5.0, 0.0);
        ui.painter().text(at, Align2::LEFT_CENTER, level_text(level), Palette::caption(), colour);
        let response = ui.interact(cell, ui.scope_id().with(word.label()), Sense::click());
        response.widget_info(|| WidgetInfo::labeled(egui::Role::Button, true, word.label()));
        if response.clicked() {
            ctx.views.restart_loudness();
        }
        let gaps = if loudness.gaps { ". Sound came faster than it could be measured: some of it is missing" } else { "" };
        response.on_hover_text(format!("{}{gaps}", word.help()));
    }
}

/// A level as it is written.
fn level_text(level: Option<f32>) -> String {
    level.map_or("\u{2013}".to_owned(), |level| format!("{level:.1}").replace('-', "\u{2212}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn silence_has_no_number() {
        assert_eq!([None, Some(-23.04), Some(0.5)].map(level_text), ["\u{2013}", "\u{2212}23.0", "0.5"]);
    }
}
