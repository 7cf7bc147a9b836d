//! The view by keyboard.

use super::{super::ctx::Ctx, camera::Camera, drag::wrapped};
use crate::listener::snapshot::values_of;
use crate::parameter::Parameter;
use egui::{Event, EventFilter, Key, Response, Ui};
use promenade_core::glam::{Vec2 as Flat, Vec3};

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
    let ahead = camera.up();
    let left = ahead.rotate(Flat::Y);
    let (mut by, mut turn_deg, mut resets, mut fits) = (Vec3::ZERO, 0.0, false, false);
    ui.input(|input| {
        for event in &input.events {
            match event {
                Event::Key { key, pressed: true, modifiers, .. } => {
                    let step = if modifiers.shift { STEPS_M.1 } else { STEPS_M.0 };
                    by += step * direction(*key, ahead, left);
                }
                // By what is typed: with Shift, letters have no key code here.
                Event::Text(text) => text.chars().for_each(|letter| match letter {
                    'q' | '[' => turn_deg += TURNS_DEG.0,
                    'e' | ']' => turn_deg -= TURNS_DEG.0,
                    'Q' | '{' => turn_deg += TURNS_DEG.1,
                    'E' | '}' => turn_deg -= TURNS_DEG.1,
                    'r' | 'R' => resets = true,
                    'f' | 'F' => fits = true,
                    _ => {}
                }),
                _ => {}
            }
        }
    });
    for (parameter, by) in [(Parameter::X, by.x), (Parameter::Y, by.y), (Parameter::Z, by.z)] {
        if by != 0.0 {
            let value = ctx.value(parameter) + by;
            ctx.nudge(parameter, value);
        }
    }
    if turn_deg != 0.0 {
        let value = wrapped(ctx.value(Parameter::Yaw) + turn_deg);
        ctx.nudge(Parameter::Yaw, value);
    }
    if resets {
        reset(ctx);
    }
    fits
}

/// Which way a key moves the listener; nowhere for other keys.
fn direction(key: Key, ahead: Flat, left: Flat) -> Vec3 {
    match key {
        Key::ArrowUp => ahead.extend(0.0),
        Key::ArrowDown => -ahead.extend(0.0),
        Key::ArrowLeft => left.extend(0.0),
        Key::ArrowRight => -left.extend(0.0),
        Key::PageUp => Vec3::Z,
        Key::PageDown => Vec3::NEG_Z,
        _ => Vec3::ZERO,
    }
}

/// Moves the knobs to the pose where the scene starts.
pub(in crate::editor) fn reset(ctx: &mut Ctx<'_>) {
    let start = ctx.scene.map(|scene| scene.start_pose()).unwrap_or_default();
    for (parameter, value) in values_of(&start) {
        ctx.set(parameter, value);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrows_move_as_the_window_shows_it() {
        let (ahead, left) = (Flat::NEG_X, Flat::NEG_X.rotate(Flat::Y));
        assert_eq!(direction(Key::ArrowUp, ahead, left), Vec3::NEG_X);
        // Along negative x, negative y is on the left.
        assert_eq!(direction(Key::ArrowLeft, ahead, left), Vec3::NEG_Y);
        assert_eq!(direction(Key::PageUp, ahead, left), Vec3::Z);
        assert_eq!(direction(Key::Tab, ahead, left), Vec3::ZERO);
    }
}
