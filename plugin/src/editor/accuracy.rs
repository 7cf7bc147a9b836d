//! How late the sound is, and how near to all of the scene: what that costs.

use super::widgets::{heading, note};
use super::{controls::choice, ctx::Ctx, theme::Palette, words::Word};
use crate::library::front;
use crate::parameter::Parameter;
use crate::parameter::choices::{AccuracyChoice, LatencyChoice};
use egui::{Align2, Sense, Ui, Vec2};
use nice_plug::prelude::Enum;
use promenade_core::{FrontPoint, Latency, Scene};
use std::sync::Arc;

/// Shows both choices, and what the accuracy costs.
pub(super) fn show(ui: &mut Ui, ctx: &mut Ctx<'_>) {
    let (scene, rate_hz) = (ctx.scene, ctx.instance.loader.sample_rate_hz());
    let keeps = |latency: Latency| Some(latency.played_by(scene?, rate_hz?) != latency);
    heading(ui, ctx.palette, Word::Of(Parameter::Latency));
    choice(ui, ctx, Parameter::Latency, |index| {
        let keeps = keeps(LatencyChoice::from_index(index).into()).unwrap_or(false);
        keeps.then_some("this scene is played in frames alone: its filters are too short, or no multiple of its hop")
    });
    heading(ui, ctx.palette, Word::Of(Parameter::Accuracy));
    choice(ui, ctx, Parameter::Accuracy, |_| None);
    if let Some(scene) = scene {
        let choice = ctx.instance.loader.choices().accuracy;
        note(ui, ctx.palette, in_words(choice, front::is_awaited(scene), &front::known(scene).unwrap_or_default()));
    }
}

/// What an accuracy is and takes, of a front.
fn in_words(choice: AccuracyChoice, awaited: bool, front: &[FrontPoint]) -> String {
    let Some(jnds) = choice.jnds() else { return "All of the scene".to_owned() };
    if awaited {
        return "Finding what the scene can do without: all of it until then".to_owned();
    }
    match FrontPoint::within(front, jnds) {
        Some(point) => format!("{}, {} of the cost", error_text(point), cost_text(point)),
        None => "This scene has no less".to_owned(),
    }
}

/// Height of a line, and room for its parts from the right, points.
const LINE: f32 = 14.0;
const COLUMNS: [f32; 3] = [150.0, 46.0, 0.0];

/// What each accuracy of a scene costs, and by which measure it is off.
pub(super) fn figures(ui: &mut Ui, ctx: &Ctx<'_>, scene: &Arc<Scene>) {
    let palette = ctx.palette;
    let Some(front) = front::known(scene) else {
        return note(ui, palette, "What less of the scene costs is found once an accuracy is chosen.");
    };
    let chosen = ctx.instance.loader.choices().accuracy;
    let head = [Word::Costs.label(), "off by", "cost"].map(str::to_owned);
    let line = |index: usize| {
        let choice = AccuracyChoice::from_index(index);
        let point = FrontPoint::within(&front, choice.jnds().unwrap_or(0.0))?;
        let colour = if choice == chosen { palette.text } else { palette.soft };
        Some(([AccuracyChoice::variants()[index].to_owned(), error_text(point), cost_text(point)], colour))
    };
    let lines = (0..AccuracyChoice::variants().len()).filter_map(line);
    for (cells, colour) in [(head, palette.soft)].into_iter().chain(lines) {
        let (rect, response) = ui.allocate_exact_size(Vec2::new(ui.available_width(), LINE), Sense::hover());
        for (n, (text, from_right)) in cells.iter().zip(COLUMNS).enumerate() {
            let at = if n == 0 {
                (rect.left_center(), Align2::LEFT_CENTER)
            } else {
                (rect.right_center() - Vec2::new(from_right, 0.0), Align2::RIGHT_CENTER)
            };
            ui.painter().text(at.0, at.1, text, Palette::caption(), colour);
        }
        response.on_hover_text(Word::Costs.help());
    }
}

/// A share of the cost of all of a scene.
fn cost_text(point: &FrontPoint) -> String {
    format!("{:.0} %", 100.0 * point.cost)
}

/// An error and the measure that is nearest to its limit.
fn error_text(point: &FrontPoint) -> String {
    format!("{:.2} JND by {}", point.error.jnds, point.error.measure.name())
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_core::{Audible, Measure, Setting};

    #[test]
    fn an_accuracy_says_what_it_costs_and_what_is_nearest_to_its_limit() {
        let point = |jnds, cost| FrontPoint { setting: Setting::ALL, error: Audible { jnds, measure: Measure::C50 }, cost };
        let front = [point(0.0, 1.0), point(0.96, 0.62)];
        assert_eq!(in_words(AccuracyChoice::One, false, &front), "0.96 JND by C50, 62 % of the cost");
        assert_eq!(in_words(AccuracyChoice::All, false, &front), "All of the scene");
        assert!(in_words(AccuracyChoice::One, true, &[]).starts_with("Finding"));
        assert_eq!(in_words(AccuracyChoice::Two, false, &[]), "This scene has no less");
    }
}
