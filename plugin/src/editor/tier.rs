//! The tier: what is asked for, what is played, what it costs.

use super::widgets::{heading, note};
use super::{controls::choice, ctx::Ctx, theme::Palette, words::Word};
use crate::parameter::Parameter;
use crate::parameter::choices::{LatencyChoice, TierChoice};
use egui::{Align2, RichText, Sense, Ui, Vec2};
use nice_plug::prelude::Enum;
use promenade_core::{Latency, Scene, Tier};
use promenade_judge::trade::TradePoint;
use std::sync::Arc;

/// Shows choice, outcome and cost.
pub(super) fn show(ui: &mut Ui, ctx: &mut Ctx<'_>) {
    let scene = ctx.scene;
    let lacks = |tier| scene.and_then(|scene| why_not(scene, tier, scene.played_tier(tier)));
    choice(ui, ctx, Parameter::Tier, |index| lacks(Tier::ALL[index.min(3)]));
    let asked = Tier::from(TierChoice::from_index(ctx.index(Parameter::Tier)));
    let played = ctx.frame.tier;
    if let Some(scene) = scene {
        let (text, colour) = match why_not(scene, asked, played) {
            Some(why) => (format!("Playing {} for {}: {why}", title(played), title(asked)), ctx.palette.warn),
            None => (format!("Playing {}", title(played)), ctx.palette.soft),
        };
        ui.label(RichText::new(text).font(Palette::caption()).color(colour));
    }
    let rate_hz = ctx.instance.loader.sample_rate_hz();
    let keeps = |latency: Latency| Some(latency.played_by(scene?, rate_hz?) != latency);
    heading(ui, ctx.palette, Word::Of(Parameter::Latency));
    choice(ui, ctx, Parameter::Latency, |index| {
        let keeps = keeps(LatencyChoice::from_index(index).into()).unwrap_or(false);
        keeps.then_some("this scene is played in frames alone: its filters are too short, or no multiple of its hop")
    });
    heading(ui, ctx.palette, Word::Of(Parameter::Accuracy));
    choice(ui, ctx, Parameter::Accuracy, |_| None);
}

/// Room for a tier's cost and for its error, points.
const COLUMN: f32 = 62.0;
/// Height of a line, points.
const LINE: f32 = 14.0;

/// What each tier of the scene costs and how far it is off.
pub(super) fn figures(ui: &mut Ui, ctx: &Ctx<'_>, scene: &Arc<Scene>, played: Tier) {
    let palette = ctx.palette;
    let figures = ctx.views.tiers(scene);
    let tiers = match figures.as_deref() {
        Some(Ok(tiers)) => tiers.as_slice(),
        Some(Err(error)) => return note(ui, palette, format!("No figures of this scene: {error}")),
        None => &[],
    };
    let heading = if figures.is_none() { ["measuring", ""] } else { ["of a core", "error"] };
    let cells = |tier: &TradePoint| [cost_text(tier.real_time), error_text(tier.error_jnds())];
    let head = (Word::TierFigures.label(), heading.map(str::to_owned), palette.soft);
    let lines = tiers.iter().map(|tier| {
        let colour = if tier.tier == played { palette.text } else { palette.soft };
        (title(tier.tier), cells(tier), colour)
    });
    for (name, cells, colour) in [head].into_iter().chain(lines) {
        let (rect, response) = ui.allocate_exact_size(Vec2::new(ui.available_width(), LINE), Sense::hover());
        let write = |at, align, text: &str| ui.painter().text(at, align, text, Palette::caption(), colour);
        write(rect.left_center(), Align2::LEFT_CENTER, name);
        for (from_right, text) in [COLUMN, 0.0].into_iter().zip(&cells) {
            write(rect.right_center() - Vec2::new(from_right, 0.0), Align2::RIGHT_CENTER, text);
        }
        response.on_hover_text(Word::TierFigures.help());
    }
}

/// A share of a core.
fn cost_text(real_time: f64) -> String {
    let percent = 100.0 * real_time;
    if percent < 9.95 { format!("{percent:.2} %") } else { format!("{percent:.0} %") }
}

/// An error in differences that are just noticed.
fn error_text(jnds: f64) -> String {
    if jnds < 9.95 { format!("{jnds:.1} JND") } else { format!("{jnds:.0} JND") }
}

/// A tier's name as it is shown.
fn title(tier: Tier) -> &'static str {
    TierChoice::variants().get(tier as usize).copied().unwrap_or_default()
}

/// Why another tier is played than was asked for.
fn why_not(scene: &Scene, asked: Tier, played: Tier) -> Option<&'static str> {
    if asked == played {
        return None;
    }
    Some(match asked {
        Tier::Draft | Tier::Standard if scene.field().is_none() => "this scene has no table of places",
        Tier::Standard => "this scene has no filters over time",
        Tier::High | Tier::Reference if scene.cloud().is_none() => "this scene has no network that works poses out",
        Tier::Reference if !scene.has_tier(Tier::Reference) => "this scene has no convolution layers",
        _ => "it is not ready",
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::library::factory;

    #[test]
    fn figures_are_short() {
        assert_eq!([0.0021, 0.124, 0.4].map(cost_text), ["0.21 %", "12 %", "40 %"]);
        assert_eq!([0.0, 1.26, 12.4].map(error_text), ["0.0 JND", "1.3 JND", "12 JND"]);
    }

    #[test]
    fn a_tier_that_a_scene_lacks_is_explained() {
        let field = Scene::from_bytes(factory::ROOM_A.bytes).unwrap();
        assert_eq!(why_not(&field, Tier::Standard, Tier::Standard), None);
        assert_eq!(why_not(&field, Tier::High, Tier::Standard), Some("this scene has no network that works poses out"));
        let cloud = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../presets/scenes/box.promenade");
        let cloud = Scene::from_bytes(&std::fs::read(cloud).unwrap()).unwrap();
        let played = |asked| cloud.played_tier(asked);
        assert_eq!(why_not(&cloud, Tier::Standard, played(Tier::Standard)), Some("this scene has no table of places"));
        assert_eq!(Tier::ALL.map(title), ["Draft", "Standard", "High", "Reference"]);
    }
}
