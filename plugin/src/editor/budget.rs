//! The budget of processor time: its limit, and the share of each instance.

use super::theme::{CONTROL, Palette};
use super::widgets::{fact, labelled};
use super::{ctx::Ctx, words::Word};
use crate::budget::limit::{LIMITS_PERCENT, limit_percent, set_limit_percent};
use crate::telemetry::members::{self, Spending};
use egui::{Align2, DragValue, Sense, Ui, Vec2};
use std::time::Duration;

/// How often the list is looked at while it is shown.
const LOOK: Duration = Duration::from_millis(250);
/// Height of a line, points.
const LINE: f32 = 14.0;
/// Room for what is taken, points.
const COLUMN: f32 = 48.0;

/// Shows the limit, and the instances where there is one.
pub(super) fn show(ui: &mut Ui, ctx: &Ctx<'_>) {
    let limit = limit_percent();
    labelled(ui, ctx.palette, Word::Budget, |ui| {
        let mut percent = limit.unwrap_or(0.0);
        let drag = DragValue::new(&mut percent)
            .range(0.0..=LIMITS_PERCENT.1)
            .speed(0.1)
            .update_while_editing(false)
            .custom_formatter(|value, _| in_words(value));
        let response = ui.add_sized(Vec2::new(ui.available_width(), CONTROL), drag).on_hover_text(Word::Budget.help());
        if response.changed() {
            set_limit_percent(Some(percent));
        }
        if response.drag_stopped() || response.lost_focus() {
            ctx.touch();
        }
    });
    if limit.is_some() {
        ui.ctx().request_repaint_after(LOOK);
        spending(ui, ctx.palette, &members::spending());
    }
}

fn in_words(percent: f64) -> String {
    if percent > 0.0 { format!("{percent:.1} % of a core") } else { "No limit".to_owned() }
}

/// What all take together, and each with what it may play.
fn spending(ui: &mut Ui, palette: &Palette, all: &[Spending]) {
    let sum: f32 = all.iter().map(|one| one.cost).sum();
    fact(ui, palette, Word::Spent, &format!("{:.1} %", 100.0 * sum));
    for (index, one) in all.iter().enumerate() {
        let (rect, response) = ui.allocate_exact_size(Vec2::new(ui.available_width(), LINE), Sense::hover());
        let name = if one.track.name.is_empty() { format!("Instance {}", index + 1) } else { one.track.name.clone() };
        let write = |at, align, text: String| ui.painter().text(at, align, text, Palette::caption(), palette.soft);
        let right = rect.right_center();
        let shown = ui.painter().with_clip_rect(rect.with_max_x(right.x - 2.0 * COLUMN));
        shown.text(rect.left_center(), Align2::LEFT_CENTER, name, Palette::caption(), palette.soft);
        write(right - Vec2::new(COLUMN, 0.0), Align2::RIGHT_CENTER, one.grant.name().to_owned());
        write(right, Align2::RIGHT_CENTER, format!("{:.2} %", 100.0 * one.cost));
        response.on_hover_text(Word::Spent.help());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_limit_has_a_name() {
        assert_eq!([0.0, 2.5].map(in_words), ["No limit", "2.5 % of a core"]);
    }
}
