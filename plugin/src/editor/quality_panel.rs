//! Latency, accuracy and what it costs, how often poses are decoded, and the budget of all instances.

use super::widgets::{columns, dimmed, fact};
use super::{accuracy, budget, controls::slider, ctx::Ctx, panel::Panel, words::Word};
use crate::parameter::Parameter;
use egui::{ScrollArea, Ui};

/// Latency, accuracy, budget.
pub(super) struct QualityPanel;

impl Panel for QualityPanel {
    fn title(&self) -> Word {
        Word::Quality
    }

    fn show(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>) {
        columns(ui, [236.0, 216.0, 216.0], |ui, column| {
            // A low window has less room than the first column takes.
            ScrollArea::vertical().id_salt(("quality", column)).auto_shrink(false).show(ui, |ui| match column {
                0 => accuracy::show(ui, ctx),
                1 => {
                    fact(ui, ctx.palette, Word::Processor, &format!("{:.1} %", ctx.frame.load * 100.0));
                    let decodes = ctx.scene.is_some_and(|scene| scene.cloud().is_some());
                    dimmed(ui, !decodes, |ui| slider(ui, ctx, Parameter::Rate));
                }
                _ => budget::show(ui, ctx),
            });
        });
    }
}
