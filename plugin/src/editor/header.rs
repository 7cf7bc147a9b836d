//! The line at the top.

use super::ctx::Ctx;
use super::theme::Palette;
use super::widgets::{button, tab};
use crate::settings::Theme;
use egui::{Align, Frame, Layout, Margin, RichText, Ui};

/// Height, points.
const HEIGHT: f32 = 40.0;

/// Shows it.
pub(super) fn show(ui: &mut Ui, ctx: &mut Ctx<'_>) {
    let frame = Frame::new().fill(ctx.palette.panel).inner_margin(Margin::symmetric(12, 0));
    egui::Panel::top("header").exact_size(HEIGHT).resizable(false).frame(frame).show(ui, |ui| {
        ui.horizontal_centered(|ui| {
            let palette = ctx.palette;
            ui.label(RichText::new("Promenade").font(Palette::heading()).color(palette.text));
            ui.add_space(8.0);
            if tab(ui, palette, "Scenes", ctx.settings.scenes).clicked() {
                ctx.settings.scenes = !ctx.settings.scenes;
            }
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                let other = match ctx.settings.theme {
                    Theme::Dark => (Theme::Light, "Light"),
                    Theme::Light => (Theme::Dark, "Dark"),
                };
                if button(ui, palette, other.1).clicked() {
                    ctx.settings.theme = other.0;
                }
            });
        });
    });
}
