//! The view by keyboard.

use super::super::ctx::Ctx;
use super::camera::Camera;
use super::grip::wrapped;
use crate::remote::Knob;
use egui::{Event, EventFilter, Key, Response, Ui};
use promenade_core::glam::Vec2 as Flat;

/// A step, metres, and with Shift.
const STEPS_M: (f32, f32) = (0.1, 0.01);
/// A turn, degrees, and with Shift.
const TURNS_DEG: (f32, f32) = (5.0, 1.0);

/// Moves and turns the knobs' listener while the view has the keyboard. Says whether the view is to be fitted.
pub(super) fn move_listener(ui: &Ui, response: &Response, ctx: &mut Ctx<'_>, camera: &Camera) -> bool {
    if !response.has_focus() {
        return false;
    }
    let filter = EventFilter { horizontal_arrows: true, vertical_arrows: true, ..EventFilter::default() };
    ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, filter));
    let (shift, presses, typed) = ui.input(|input| {
        let presses = [Key::ArrowUp, Key::ArrowDown, Key::ArrowLeft, Key::ArrowRight, Key::PageUp, Key::PageDown]
            .map(|key| input.num_presses(key) as f32);
        let typed = input.events.iter().filter_map(|event| match event {
            Event::Text(text) => Some(text.as_str()),
            _ => None,
        });
        (input.modifiers.shift, presses, typed.collect::<String>())
    });
    let step = if shift { STEPS_M.1 } else { STEPS_M.0 };
    let [up, down, left, right, higher, lower] = presses;
    let ahead = camera.up();
    let by = step * ((up - down) * ahead + (left - right) * ahead.rotate(Flat::Y));
    for (knob, by) in [(Knob::X, by.x), (Knob::Y, by.y), (Knob::Z, step * (higher - lower))] {
        if by != 0.0 {
            let value = ctx.value(knob) + by;
            ctx.nudge(knob, value);
        }
    }
    // Letters by what is typed: with Shift they have no key code here.
    let typed = typed.to_lowercase();
    let count = |letters: &str| typed.chars().filter(|c| letters.contains(*c)).count() as f32;
    let turn = count("q[{") - count("e]}");
    if turn != 0.0 {
        let value = wrapped(ctx.value(Knob::Yaw) + turn * if shift { TURNS_DEG.1 } else { TURNS_DEG.0 });
        ctx.nudge(Knob::Yaw, value);
    }
    if count("r") > 0.0 {
        reset(ctx);
    }
    count("f") > 0.0
}

/// Puts the knobs' listener where the scene says to start.
pub(in crate::editor) fn reset(ctx: &mut Ctx<'_>) {
    let start = ctx.scene.map(|scene| scene.start_pose()).unwrap_or_default();
    let (yaw, pitch, roll) = start.ypr();
    let [x, y, z] = start.position.to_array();
    let degrees = [(Knob::Yaw, yaw), (Knob::Pitch, pitch), (Knob::Roll, roll)].map(|(knob, angle)| (knob, angle.to_degrees()));
    for (knob, value) in [(Knob::X, x), (Knob::Y, y), (Knob::Z, z)].into_iter().chain(degrees) {
        ctx.set(knob, value);
    }
}
