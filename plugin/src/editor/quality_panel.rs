//! Accuracy and latency, what they cost, how often poses are decoded, and the budget of all instances.

use super::widgets::{columns, dimmed, fact, note};
use super::{budget, controls::slider, ctx::Ctx, panel::Panel, tier, words::Word};
use crate::parameter::Parameter;
use egui::{ScrollArea, Ui};
use promenade_core::Tier;

/// Cost and error.
pub(super) struct QualityPanel;

impl Panel for QualityPanel {
    fn title(&self) -> Word {
        Word::Of(Parameter::Tier)
    }

    fn show(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>) {
        columns(ui, [236.0, 216.0, 216.0], |ui, column| {
            // A low window has less room than the first column takes.
            ScrollArea::vertical().id_salt(("quality", column)).auto_shrink(false).show(ui, |ui| match column {
                0 => tier::show(ui, ctx),
                1 => {
                    match ctx.scene {
                        Some(scene) => tier::figures(ui, ctx, scene, ctx.frame.tier),
                        None => note(ui, ctx.palette, "No scene is played."),
                    }
                    fact(ui, ctx.palette, Word::Processor, &format!("{:.1} %", ctx.frame.load * 100.0));
                    let decodes = ctx.frame.tier >= Tier::High && ctx.scene.is_some();
                    dimmed(ui, !decodes, |ui| slider(ui, ctx, Parameter::Rate));
                }
                _ => budget::show(ui, ctx),
            });
        });
    }
}
