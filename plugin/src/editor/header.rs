//! The line at the top.

use super::theme::{Palette, faded};
use super::widgets::{button, tab, value_button};
use super::{controls::toggle, ctx::Ctx, presets::Presets, words::Word};
use crate::history::user_state::UserState;
use crate::parameter::Parameter;
use crate::project::{preferences::SCALES, settings::Theme};
use egui::{Align, CornerRadius, Frame, Layout, Margin, Popup, RichText, Sense, Stroke, Ui, vec2};

/// Height, points.
const HEIGHT: f32 = 40.0;
/// Scales to choose from.
const STEPS: [f32; 8] = [SCALES.0, 0.9, 1.0, 1.25, 1.5, 2.0, 2.5, SCALES.1];

/// Shows it.
pub(super) fn show(ui: &mut Ui, ctx: &mut Ctx<'_>, presets: &mut Presets) {
    let frame = Frame::new().fill(ctx.palette.panel).inner_margin(Margin::symmetric(12, 0));
    egui::Panel::top("header").exact_size(HEIGHT).resizable(false).frame(frame).show(ui, |ui| {
        ui.horizontal_centered(|ui| {
            let palette = ctx.palette;
            mark(ui, palette);
            if !ctx.narrow {
                ui.label(RichText::new("Promenade").font(Palette::heading()).color(palette.text));
            }
            ui.add_space(4.0);
            let open = ctx.list_is_open();
            if tab(ui, palette, Word::Scenes, *open).clicked() {
                *open = !*open;
            }
            ui.add_space(4.0);
            ui.scope(|ui| presets.show(ui, ctx));
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                let (other, name) = match ctx.preferences.theme {
                    Theme::Dark => (Theme::Light, Word::Light),
                    Theme::Light => (Theme::Dark, Word::Dark),
                };
                if button(ui, palette, name).clicked() {
                    ctx.preferences.theme = other;
                }
                scale(ui, ctx);
                ui.add_space(4.0);
                toggle(ui, ctx, Parameter::Bypass);
                ui.add_space(4.0);
                // From right to left.
                let copy = if ctx.history.is_b() { Word::CopyToA } else { Word::CopyToB };
                if button(ui, palette, copy).clicked() {
                    ctx.history.copy(UserState::of(ctx.params()));
                }
                for (name, b) in [(Word::B, true), (Word::A, false)] {
                    if tab(ui, palette, name, ctx.history.is_b() == b).clicked() && ctx.history.is_b() != b {
                        ctx.compare();
                    }
                }
                ui.add_space(4.0);
                let (undo, redo) = ctx.history.can();
                if ui.add_enabled_ui(redo, |ui| button(ui, palette, Word::Redo)).inner.clicked() {
                    ctx.redo();
                }
                if ui.add_enabled_ui(undo, |ui| button(ui, palette, Word::Undo)).inner.clicked() {
                    ctx.undo();
                }
                ui.with_layout(Layout::left_to_right(Align::Center), |ui| state(ui, ctx));
            });
        });
    });
}

/// The scene's title and what keeps it from being heard.
fn state(ui: &mut Ui, ctx: &Ctx<'_>) {
    let palette = ctx.palette;
    ui.add_space(8.0);
    let title = ctx.scene.map_or("No scene", |scene| scene.title());
    let remark = if ctx.is_on(Parameter::Bypass) {
        Some("bypassed")
    } else if !ctx.sounding {
        Some("the host is not playing")
    } else if ctx.frame.dry {
        Some("dry sound only")
    } else if ctx.frame.offline {
        Some("rendering offline")
    } else {
        None
    };
    if ui.available_width() > 48.0 {
        ui.add(egui::Label::new(RichText::new(title).color(palette.soft)).truncate());
    }
    if let Some(remark) = remark {
        let galley = ui.painter().layout_no_wrap(remark.to_owned(), Palette::caption(), palette.warn);
        let size = galley.size() + vec2(16.0, 6.0);
        if ui.available_width() > size.x {
            let (rect, _) = ui.allocate_exact_size(size, Sense::hover());
            ui.painter().rect_filled(rect, CornerRadius::same(9), faded(palette.warn, 0.14));
            ui.painter().galley(rect.min + vec2(8.0, 3.0), galley, palette.warn);
        }
    }
}

/// How large everything is.
fn scale(ui: &mut Ui, ctx: &mut Ctx<'_>) {
    let palette = ctx.palette;
    let percent = |scale: f32| format!("{:.0} %", scale * 100.0);
    let response = value_button(
        ui,
        palette,
        &percent(ctx.preferences.scale),
        "Scale of every editor window of yours; the host is asked for a window that fits",
    );
    Popup::menu(&response).show(|ui| {
        ui.set_min_width(72.0);
        for step in STEPS {
            let on = (ctx.preferences.scale - step).abs() < 1e-3;
            if ui.selectable_label(on, percent(step)).clicked() {
                ctx.preferences.scale = step;
            }
        }
    });
}

/// The mark: two ears around a path.
fn mark(ui: &mut Ui, palette: &Palette) {
    let (rect, _) = ui.allocate_exact_size(vec2(20.0, 20.0), Sense::hover());
    let (painter, centre) = (ui.painter(), rect.center());
    painter.circle_stroke(centre, 8.0, Stroke::new(1.5, palette.accent));
    painter.circle_filled(centre - vec2(8.0, 0.0), 2.5, palette.left);
    painter.circle_filled(centre + vec2(8.0, 0.0), 2.5, palette.right);
    painter.circle_filled(centre - vec2(0.0, 3.0), 2.0, palette.accent);
}
