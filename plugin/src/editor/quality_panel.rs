//! What each quality costs and how far it is off, how often poses are decoded, and the budget of all instances.

use super::widgets::{columns, dimmed, fact, note};
use super::{budget, controls::slider, ctx::Ctx, panel::Panel, tier::figures, words::Word};
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
        columns(ui, [216.0, 232.0, 232.0], |ui, column| match column {
            0 => match ctx.scene {
                Some(scene) => figures(ui, ctx, scene, ctx.frame.tier),
                None => note(ui, ctx.palette, "No scene is played."),
            },
            1 => {
                fact(ui, ctx.palette, Word::Processor, &format!("{:.1} %", ctx.frame.load * 100.0));
                let decodes = ctx.frame.tier >= Tier::High && ctx.scene.is_some();
                dimmed(ui, !decodes, |ui| slider(ui, ctx, Parameter::Rate));
            }
            _ => drop(ScrollArea::vertical().id_salt("budget").auto_shrink(false).show(ui, |ui| budget::show(ui, ctx))),
        });
    }
}
