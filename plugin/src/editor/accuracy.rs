//! How late the sound is, and how near to all of the scene: what that costs.

use super::widgets::{heading, note};
use super::{controls::choice, ctx::Ctx, words::Word};
use crate::library::front;
use crate::parameter::Parameter;
use crate::parameter::choices::{AccuracyChoice, LatencyChoice};
use egui::Ui;
use nice_plug::prelude::Enum;
use promenade_core::{FrontPoint, Latency};

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
        Some(FrontPoint { error, cost, .. }) => {
            format!("{:.2} JND by {}, {:.0} % of the cost", error.jnds, error.measure.name(), 100.0 * cost)
        }
        None => "This scene has no less".to_owned(),
    }
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
