//! The tier: what is asked for, what is played, what it costs.

use super::controls::{choice, slider};
use super::ctx::Ctx;
use super::theme::Palette;
use super::widgets::{dimmed, fact};
use super::words::Word;
use crate::choices::TierChoice;
use crate::parameter::Parameter;
use egui::{RichText, Ui};
use nice_plug::prelude::Enum;
use promenade_core::{Scene, Tier};

/// Shows choice, outcome and cost.
pub(super) fn show(ui: &mut Ui, ctx: &mut Ctx<'_>) {
    let scene = ctx.scene;
    let lacks = |tier| scene.and_then(|scene| why_not(scene, tier, scene.played_tier(tier)));
    choice(ui, ctx, Parameter::Tier, |index| lacks(Tier::ALL[index.min(3)]));
    let asked = Tier::from(TierChoice::from_index(ctx.index(Parameter::Tier)));
    let played = ctx.frame.tier;
    if let Some(scene) = scene {
        let (text, colour) = match why_not(scene, asked, played) {
            Some(why) => (format!("{} asked, {} played: {why}", title(asked), title(played)), ctx.palette.warn),
            None => (format!("{} is played", title(played)), ctx.palette.soft),
        };
        ui.label(RichText::new(text).font(Palette::caption()).color(colour));
    }
    fact(ui, ctx.palette, Word::Processor, &format!("{:.1} %", ctx.frame.load * 100.0));
    let decodes = played >= Tier::High && scene.is_some();
    dimmed(ui, !decodes, |ui| slider(ui, ctx, Parameter::Rate, Word::Updates));
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
    use crate::factory;

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
