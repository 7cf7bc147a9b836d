//! Controls of parameters: what they set goes to the host as gestures.

use super::theme::{CONTROL, ROUND, SPACE};
use super::widgets::{drop_down, focus_ring, labelled, segments, switch};
use super::{ctx::Ctx, host::default_value, host_menu, words::Word};
use crate::parameter::{Parameter, cast::narrow, text};
use crate::project::params::PromenadeParams;
use egui::{CornerRadius, DragValue, Key, Rect, Response, Sense, Ui, Vec2, WidgetInfo};

/// How a parameter's number is shown: what it is multiplied by, its unit, digits after the point, value per point of a drag.
struct Notation {
    factor: f64,
    unit: &'static str,
    decimals: usize,
    speed: f64,
}

fn notation(parameter: Parameter) -> Notation {
    let (factor, unit, decimals, speed) = match parameter.unit() {
        "m" => (1.0, " m", 2, 0.02),
        "deg" => (1.0, "°", 1, 0.5),
        "%" if matches!(parameter, Parameter::Path | Parameter::Mix) => (100.0, " %", 1, 0.25),
        "%" => (100.0, " %", 0, 0.5),
        "Hz" => (1.0, " Hz", 0, 0.5),
        "dB" => (1.0, " dB", 1, 0.1),
        _ => (1.0, "", 0, 0.1),
    };
    Notation { factor, unit, decimals, speed }
}

/// A number to drag, or to type after a click. The width is what is left.
pub fn number(ui: &mut Ui, ctx: &mut Ctx<'_>, parameter: Parameter) -> Response {
    let Notation { factor, unit, decimals, speed } = notation(parameter);
    let (least, greatest) = parameter.limits();
    let mut shown = f64::from(ctx.value(parameter)) * factor;
    let drag = DragValue::new(&mut shown)
        .range(f64::from(least) * factor..=f64::from(greatest) * factor)
        .speed(speed)
        .fixed_decimals(decimals)
        .update_while_editing(false)
        .custom_parser(move |typed| Some(f64::from(text::number(parameter.row().values, typed)?) * factor))
        .suffix(unit);
    let response = ui.add_sized(Vec2::new(ui.available_width(), CONTROL), drag);
    let value = narrow(shown / factor);
    if response.dragged() {
        ctx.hold(parameter, value);
    } else if response.changed() {
        ctx.set(parameter, value);
    }
    host_menu::add(ui, ctx, parameter, &response, response.rect);
    response.on_hover_text(explained(ctx, parameter))
}

/// What a parameter is, and what the host does with it.
fn explained(ctx: &Ctx<'_>, parameter: Parameter) -> String {
    format!("{}{}", parameter.row().help, host_menu::words(&ctx.instance.host_side.mark(parameter)))
}

/// A line with a slider and its number. A double click on the slider sets the default.
pub fn slider(ui: &mut Ui, ctx: &mut Ctx<'_>, parameter: Parameter) {
    const NUMBER: f32 = 68.0;
    let palette = ctx.palette;
    labelled(ui, palette, Word::Of(parameter), |ui| {
        let width = (ui.available_width() - NUMBER - SPACE).max(24.0);
        let (rect, response) = ui.allocate_exact_size(Vec2::new(width, CONTROL), Sense::click_and_drag());
        let (least, greatest) = parameter.limits();
        let track = Rect::from_center_size(rect.center(), Vec2::new(width - 12.0, 4.0));
        let share_of = |value: f32| (value - least) / (greatest - least);
        if response.double_clicked() {
            let usual = default_value(ctx.params(), parameter);
            ctx.set(parameter, usual);
        } else if response.dragged()
            && let Some(at) = response.interact_pointer_pos()
        {
            response.request_focus();
            let fine = ui.input(|i| i.modifiers.shift);
            let value = if fine {
                ctx.value(parameter) + response.drag_delta().x / track.width() * (greatest - least) * 0.1
            } else {
                least + ((at.x - track.left()) / track.width()).clamp(0.0, 1.0) * (greatest - least)
            };
            ctx.hold(parameter, value);
        }
        if response.has_focus() {
            let step = arrows(ui, &response);
            if step != 0.0 {
                let value = ctx.value(parameter) + step * (greatest - least);
                ctx.nudge(parameter, value);
            }
        }
        let at = track.left() + share_of(ctx.value(parameter)) * track.width();
        let from = track.left() + share_of(anchor(ctx.params(), parameter)) * track.width();
        let colour = if ui.is_enabled() { palette.accent } else { palette.soft };
        ui.painter().rect_filled(track, CornerRadius::same(2), palette.raised);
        let filled = Rect::from_x_y_ranges(from.min(at)..=from.max(at), track.y_range());
        ui.painter().rect_filled(filled, CornerRadius::same(2), colour);
        let radius = if response.hovered() || response.dragged() { 7.0 } else { 6.0 };
        let handle = egui::pos2(at, track.center().y);
        ui.painter().circle_filled(handle, radius, colour);
        ui.painter().circle_filled(handle, 2.0, palette.panel);
        focus_ring(ui, palette, &response, rect, ROUND);
        let value = ctx.value(parameter);
        response.widget_info(|| WidgetInfo::slider(ui.is_enabled(), f64::from(value), parameter.row().name));
        host_menu::add(ui, ctx, parameter, &response, rect);
        let what = explained(ctx, parameter);
        response.on_hover_text(format!("{what}\nDrag, with Shift finely; a double click brings the usual value back"));
        number(ui, ctx, parameter);
    });
}

/// Where a slider's fill begins: at the default where that changes nothing, else at 0 where the range has both signs.
fn anchor(params: &PromenadeParams, parameter: Parameter) -> f32 {
    let (least, greatest) = parameter.limits();
    match parameter {
        Parameter::Decay | Parameter::Law | Parameter::Width => default_value(params, parameter),
        _ => 0.0_f32.clamp(least, greatest),
    }
}

/// Steps of the arrow keys, a share of the range; with Shift a tenth of it.
fn arrows(ui: &Ui, response: &Response) -> f32 {
    ui.memory_mut(|memory| {
        let filter = egui::EventFilter { horizontal_arrows: true, ..egui::EventFilter::default() };
        memory.set_focus_lock_filter(response.id, filter);
    });
    ui.input(|input| {
        let presses = |key| input.num_presses(key) as f32;
        let step = if input.modifiers.shift { 0.001 } else { 0.01 };
        (presses(Key::ArrowRight) - presses(Key::ArrowLeft)) * step
    })
}

/// All variants of a choice side by side. `why_not` is asked for those that are not available; they can be chosen all the same.
pub fn choice(ui: &mut Ui, ctx: &mut Ctx<'_>, parameter: Parameter, why_not: impl Fn(usize) -> Option<&'static str>) {
    let Some(variants) = parameter.variants() else { return };
    let tooltip = |index: usize| {
        let what = variants.help[index];
        why_not(index).map_or_else(|| Ok(what.to_owned()), |why| Err(format!("{what}\nGrey, because {why}")))
    };
    if let Some(index) = segments(ui, ctx.palette, variants.names, ctx.index(parameter), tooltip) {
        ctx.set(parameter, index as f32);
    }
}

/// The variants of a choice in a list that drops down.
pub fn list(ui: &mut Ui, ctx: &mut Ctx<'_>, parameter: Parameter) {
    let (Some(variants), chosen) = (parameter.variants(), ctx.index(parameter)) else { return };
    let shown = variants.names.get(chosen).copied().unwrap_or_default();
    if let Some(index) = drop_down(ui, parameter.id(), shown, variants.names, chosen, |index| variants.help[index]) {
        ctx.set(parameter, index as f32);
    }
}

/// A switch.
pub fn toggle(ui: &mut Ui, ctx: &mut Ctx<'_>, parameter: Parameter) {
    let on = ctx.is_on(parameter);
    let response = switch(ui, ctx.palette, Word::Of(parameter), on);
    if response.clicked() {
        ctx.set(parameter, if on { 0.0 } else { 1.0 });
    }
    host_menu::add(ui, ctx, parameter, &response, response.rect);
}
