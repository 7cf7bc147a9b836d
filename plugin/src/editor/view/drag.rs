//! What the pointer can drag in the view, and the values that a drag sets.

use super::camera::Camera;
use crate::parameter::Parameter;
use egui::{Modifiers, Pos2, Rect};
use promenade_core::glam::Vec3;

/// The pointer picks what is at most this far away, points.
const REACH: f32 = 14.0;

/// Something in the view that the pointer can drag or choose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Handle {
    /// The listener that is heard, or the knobs' while something else moves that one.
    Listener,
    /// Where the listener's nose points.
    Nose,
    /// The emitter.
    Emitter,
    /// A further source, 0 for the first.
    Source(usize),
    /// A keyframe of the camera path.
    Keyframe(usize),
    /// A wall of a drawn room: at the least and the greatest x and y, floor, ceiling.
    Wall(usize),
}

/// A handle and its place in the window, with the radius that it is drawn with.
pub(super) type Target = (Handle, Pos2, f32);

/// The handle at a place of the window: the nearest, and of two as near the first.
pub(super) fn pick(targets: &[Target], at: Pos2) -> Option<Handle> {
    let off = |(_, place, radius): &Target| (place.distance(at) - radius).max(0.0);
    let near = targets.iter().filter(|target| off(target) <= REACH);
    near.min_by(|a, b| off(a).total_cmp(&off(b)).then(a.1.distance(at).total_cmp(&b.1.distance(at)))).map(|target| target.0)
}

/// A drag, as it was when it began.
#[derive(Clone, Copy, Debug)]
pub(super) struct Drag {
    /// What is dragged.
    pub(super) handle: Handle,
    /// Where the pointer was.
    pub(super) from: Pos2,
    /// Where the handle was in the world.
    pub(super) world: Vec3,
    /// The values of the parameters that move it, by axis.
    pub(super) start: [f32; 3],
    /// Yaw of the knobs, degrees.
    pub(super) yaw_deg: f32,
    /// Yaw that is heard, radians.
    pub(super) heard_yaw: f32,
}

impl Drag {
    /// The source that is dragged, 0 for the first.
    pub(super) fn source(&self) -> Option<usize> {
        match self.handle {
            Handle::Emitter => Some(0),
            Handle::Source(further) => Some(1 + further),
            _ => None,
        }
    }

    /// The parameters along x, y and z of the handle.
    pub(super) fn parameters(&self) -> [Parameter; 3] {
        self.source().map_or([Parameter::X, Parameter::Y, Parameter::Z], Parameter::place_of)
    }

    /// What the values of some of its parameters make of those at the start.
    pub(super) fn moved(&self, values: &[(Parameter, f32)]) -> Vec3 {
        let value = |(parameter, start): (Parameter, f32)| {
            values.iter().find(|(moved, _)| *moved == parameter).map_or(start, |(_, value)| *value)
        };
        let [x, y, z] = self.parameters();
        let [at_x, at_y, at_z] = self.start;
        Vec3::from_array([(x, at_x), (y, at_y), (z, at_z)].map(value))
    }

    /// The values to set with the pointer at a place: the handle follows the pointer at its height; with Alt it rises; with
    /// Shift, or by its nose, the listener turns.
    pub(super) fn values(&self, camera: &Camera, rect: Rect, to: Pos2, modifiers: Modifiers) -> Vec<(Parameter, f32)> {
        let [x, y, z] = self.parameters();
        let turns = self.handle == Handle::Nose || (self.handle == Handle::Listener && modifiers.shift);
        if turns {
            let Some(target) = camera.on_level(rect, to, self.world.z) else { return Vec::new() };
            let ahead = (target - self.world).truncate();
            if ahead.length() < 1e-3 {
                return Vec::new();
            }
            // The knobs turn by as much as what is heard is to turn: a tracker or a path may be under them.
            return vec![(Parameter::Yaw, wrapped(self.yaw_deg + (ahead.to_angle() - self.heard_yaw).to_degrees()))];
        }
        if modifiers.alt {
            return vec![(z, self.start[2] + camera.rise(rect, self.world, self.from, to))];
        }
        let on_level = |at| camera.on_level(rect, at, self.world.z);
        let (Some(from), Some(to)) = (on_level(self.from), on_level(to)) else { return Vec::new() };
        let by = to - from;
        vec![(x, self.start[0] + by.x), (y, self.start[1] + by.y)]
    }
}

/// An angle within -180 to 180 degrees.
pub(super) fn wrapped(degrees: f32) -> f32 {
    let turned = (degrees + 180.0).rem_euclid(360.0) - 180.0;
    if turned.is_finite() { turned } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::super::camera::{Orbit, Plan};
    use super::*;
    use egui::{pos2, vec2};

    const SHIFT: Modifiers = Modifiers::SHIFT;

    fn rect() -> Rect {
        Rect::from_min_size(pos2(0.0, 0.0), vec2(600.0, 400.0))
    }

    fn drag(handle: Handle, camera: &Camera, world: Vec3) -> Drag {
        let from = camera.project(rect(), world).unwrap().at;
        Drag { handle, from, world, start: [10.0, 20.0, 30.0], yaw_deg: 170.0, heard_yaw: 0.0 }
    }

    #[test]
    fn the_nearest_handle_is_picked_and_nothing_far_away() {
        let targets = [
            (Handle::Listener, pos2(100.0, 100.0), 10.0),
            (Handle::Nose, pos2(130.0, 100.0), 4.0),
            (Handle::Keyframe(3), pos2(100.0, 100.0), 4.0),
        ];
        assert_eq!(pick(&targets, pos2(104.0, 100.0)), Some(Handle::Listener));
        assert_eq!(pick(&targets, pos2(128.0, 100.0)), Some(Handle::Nose));
        assert_eq!(pick(&targets[1..], pos2(102.0, 100.0)), Some(Handle::Keyframe(3)));
        assert_eq!(pick(&targets, pos2(100.0, 130.0)), None);
    }

    #[test]
    fn a_handle_follows_the_pointer_at_its_height() {
        let world = Vec3::new(0.4, -0.2, 0.5);
        for camera in [Camera::Plan(Plan::default()), Camera::Orbit(Orbit::default())] {
            let drag = drag(Handle::Listener, &camera, world);
            let target = world + Vec3::new(0.3, 0.7, 0.0);
            let to = camera.project(rect(), target).unwrap().at;
            let moved = drag.values(&camera, rect(), to, Modifiers::NONE);
            let [(Parameter::X, x), (Parameter::Y, y)] = moved[..] else { panic!("{moved:?}") };
            assert!((x - 10.3).abs() < 1e-3 && (y - 20.7).abs() < 1e-3, "{moved:?}");
        }
    }

    #[test]
    fn alt_lifts_and_the_emitter_has_knobs_of_its_own() {
        let camera = Camera::Plan(Plan::default());
        let drag = drag(Handle::Emitter, &camera, Vec3::X);
        let moved = drag.values(&camera, rect(), drag.from - vec2(0.0, 40.0), Modifiers::ALT);
        assert_eq!(moved.len(), 1);
        assert!(moved[0].0 == Parameter::Ez && (moved[0].1 - 30.5).abs() < 1e-4, "{moved:?}");
        assert_eq!(drag.values(&camera, rect(), drag.from, SHIFT)[0].0, Parameter::Ex, "an emitter does not turn");
        let source = super::tests::drag(Handle::Source(2), &camera, Vec3::X);
        let ids = source.values(&camera, rect(), drag.from, Modifiers::NONE).into_iter().map(|(parameter, _)| parameter.id());
        assert_eq!(ids.collect::<Vec<_>>(), ["ex4", "ey4"]);
    }

    #[test]
    fn shift_or_the_nose_turns_by_as_much_as_is_heard() {
        let camera = Camera::Plan(Plan::default());
        // To the left of the listener.
        let to = camera.project(rect(), Vec3::Y).unwrap().at;
        for (handle, modifiers) in [(Handle::Listener, SHIFT), (Handle::Nose, Modifiers::NONE)] {
            let moved = drag(handle, &camera, Vec3::ZERO).values(&camera, rect(), to, modifiers);
            assert_eq!(moved[0].0, Parameter::Yaw);
            // 170 + 90 degrees come round.
            assert!((moved[0].1 + 100.0).abs() < 1e-3, "{moved:?}");
        }
    }

    #[test]
    fn angles_come_round() {
        assert_eq!(wrapped(190.0), -170.0);
        assert_eq!(wrapped(-540.0), -180.0);
        assert_eq!(wrapped(f32::NAN), 0.0);
    }
}
