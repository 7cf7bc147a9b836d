//! The panel on the right: pose, sources, quality, output.

use super::ctx::Ctx;
use super::knobs::{choice, list, number, slider, toggle};
use super::theme::GRID;
use super::widgets::{heading, row};
use crate::remote::Knob;
use egui::{Frame, Margin, ScrollArea, Ui};

/// Width, points.
const WIDTH: f32 = 248.0;

/// Shows it.
pub(super) fn right(ui: &mut Ui, ctx: &mut Ctx<'_>) {
    let frame = Frame::new().fill(ctx.palette.panel).inner_margin(Margin::symmetric(12, 4));
    egui::Panel::right("controls").exact_size(WIDTH).resizable(false).frame(frame).show(ui, |ui| {
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            heading(ui, ctx.palette, "Listener");
            triple(ui, ctx, [(Knob::X, "x "), (Knob::Y, "y "), (Knob::Z, "z ")]);
            triple(ui, ctx, [(Knob::Yaw, "yaw "), (Knob::Pitch, "pit "), (Knob::Roll, "rol ")]);
            heading(ui, ctx.palette, "Movement");
            choice(ui, ctx, Knob::Follow, |_| true);
            slider(ui, ctx, Knob::Path, "Position");
            toggle(ui, ctx, Knob::Offset, "Add the listener above");
            row(ui, ctx.palette, "Tracker", |ui| list(ui, ctx, Knob::Tracking));
            row(ui, ctx.palette, "Group", |ui| list(ui, ctx, Knob::Group));
            toggle(ui, ctx, Knob::Lead, "Leads the group");
            heading(ui, ctx.palette, "Emitter offset");
            triple(ui, ctx, [(Knob::Ex, "x "), (Knob::Ey, "y "), (Knob::Ez, "z ")]);
            heading(ui, ctx.palette, "Tier");
            choice(ui, ctx, Knob::Tier, |_| true);
            slider(ui, ctx, Knob::Rate, "Decodes");
            heading(ui, ctx.palette, "Output");
            slider(ui, ctx, Knob::Mix, "Mix");
            slider(ui, ctx, Knob::Gain, "Gain");
            toggle(ui, ctx, Knob::Bypass, "Bypass");
        });
    });
}

/// Three numbers side by side.
fn triple(ui: &mut Ui, ctx: &mut Ctx<'_>, knobs: [(Knob, &str); 3]) {
    let width = (ui.available_width() - 2.0 * GRID) / 3.0;
    ui.horizontal(|ui| {
        for (knob, prefix) in knobs {
            ui.scope(|ui| {
                ui.set_width(width);
                number(ui, ctx, knob, prefix);
            });
        }
    });
}
