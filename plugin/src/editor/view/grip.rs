//! What the pointer can take hold of in the view, and what dragging it does.

use super::camera::Camera;
use crate::remote::Knob;
use egui::{Modifiers, Pos2, Rect};
use promenade_core::Pose;
use promenade_core::glam::Vec3;

/// The pointer takes hold of what is at most this far away, points.
const REACH: f32 = 14.0;

/// Something in the view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Thing {
    /// The listener that is heard, or the knobs' while something else moves that one.
    Listener,
    /// Where the listener's nose points.
    Nose,
    /// The emitter.
    Emitter,
    /// A keyframe of the camera path.
    Keyframe(usize),
}

/// A thing and its place in the window, with the radius that it is drawn with.
pub(super) type Target = (Thing, Pos2, f32);

/// The thing at a place of the window: the nearest, and of two as near the one that was named first.
pub(super) fn pick(targets: &[Target], at: Pos2) -> Option<Thing> {
    let off = |(_, place, radius): &Target| (place.distance(at) - radius).max(0.0);
    let near = targets.iter().filter(|target| off(target) <= REACH);
    near.min_by(|a, b| off(a).total_cmp(&off(b)).then(a.1.distance(at).total_cmp(&b.1.distance(at)))).map(|target| target.0)
}

/// How a thing was when the pointer took hold of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grip {
    /// The thing.
    pub(super) thing: Thing,
    /// Where the pointer was.
    pub(super) from: Pos2,
    /// Where the thing was in the world.
    pub(super) world: Vec3,
    /// The values of the knobs that move it, by axis.
    pub(super) values: [f32; 3],
    /// Yaw of the knobs, degrees.
    pub(super) yaw_deg: f32,
    /// Yaw that is heard, radians.
    pub(super) heard_yaw: f32,
}

impl Grip {
    /// The knobs along x, y and z of the thing.
    pub(super) fn knobs(&self) -> [Knob; 3] {
        match self.thing {
            Thing::Emitter => [Knob::Ex, Knob::Ey, Knob::Ez],
            _ => [Knob::X, Knob::Y, Knob::Z],
        }
    }

    /// What the knobs are to be with the pointer at a place: the thing goes with the pointer on its level, with Alt it rises, with Shift
    /// or by its nose the listener turns.
    pub(super) fn drag(&self, camera: &Camera, rect: Rect, to: Pos2, modifiers: Modifiers) -> Vec<(Knob, f32)> {
        let [x, y, z] = self.knobs();
        let turns = self.thing == Thing::Nose || (self.thing == Thing::Listener && modifiers.shift);
        if turns {
            let Some(target) = camera.on_level(rect, to, self.world.z) else { return Vec::new() };
            let ahead = (target - self.world).truncate();
            if ahead.length() < 1e-3 {
                return Vec::new();
            }
            // The knobs turn by as much as what is heard is to turn: a tracker or a path may be under them.
            return vec![(Knob::Yaw, wrapped(self.yaw_deg + (ahead.to_angle() - self.heard_yaw).to_degrees()))];
        }
        if modifiers.alt {
            return vec![(z, self.values[2] + camera.rise(rect, self.world, self.from, to))];
        }
        let on_level = |at| camera.on_level(rect, at, self.world.z);
        let (Some(from), Some(to)) = (on_level(self.from), on_level(to)) else { return Vec::new() };
        let by = to - from;
        vec![(x, self.values[0] + by.x), (y, self.values[1] + by.y)]
    }
}

/// An angle within -180 to 180 degrees.
pub(super) fn wrapped(degrees: f32) -> f32 {
    let turned = (degrees + 180.0).rem_euclid(360.0) - 180.0;
    if turned.is_finite() { turned } else { 0.0 }
}

/// The pose that position and angle knobs set, in metres and radians.
pub(in crate::editor) fn pose_of(value: impl Fn(Knob) -> f32) -> Pose {
    let position = Vec3::new(value(Knob::X), value(Knob::Y), value(Knob::Z));
    let radians = |knob| value(knob).to_radians();
    Pose::from_ypr(position, radians(Knob::Yaw), radians(Knob::Pitch), radians(Knob::Roll))
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

    fn grip(thing: Thing, camera: &Camera, world: Vec3) -> Grip {
        let from = camera.project(rect(), world).unwrap().at;
        Grip { thing, from, world, values: [10.0, 20.0, 30.0], yaw_deg: 170.0, heard_yaw: 0.0 }
    }

    #[test]
    fn the_nearest_thing_is_picked_and_nothing_far_away() {
        let targets = [
            (Thing::Listener, pos2(100.0, 100.0), 10.0),
            (Thing::Nose, pos2(130.0, 100.0), 4.0),
            (Thing::Keyframe(3), pos2(100.0, 100.0), 4.0),
        ];
        assert_eq!(pick(&targets, pos2(104.0, 100.0)), Some(Thing::Listener));
        assert_eq!(pick(&targets, pos2(128.0, 100.0)), Some(Thing::Nose));
        assert_eq!(pick(&targets[1..], pos2(102.0, 100.0)), Some(Thing::Keyframe(3)));
        assert_eq!(pick(&targets, pos2(100.0, 130.0)), None);
    }

    #[test]
    fn a_thing_goes_with_the_pointer_on_its_level() {
        let world = Vec3::new(0.4, -0.2, 0.5);
        for camera in [Camera::Plan(Plan::default()), Camera::Orbit(Orbit::default())] {
            let grip = grip(Thing::Listener, &camera, world);
            let target = world + Vec3::new(0.3, 0.7, 0.0);
            let to = camera.project(rect(), target).unwrap().at;
            let moved = grip.drag(&camera, rect(), to, Modifiers::NONE);
            let [(Knob::X, x), (Knob::Y, y)] = moved[..] else { panic!("{moved:?}") };
            assert!((x - 10.3).abs() < 1e-3 && (y - 20.7).abs() < 1e-3, "{moved:?}");
        }
    }

    #[test]
    fn alt_lifts_and_the_emitter_has_knobs_of_its_own() {
        let camera = Camera::Plan(Plan::default());
        let grip = grip(Thing::Emitter, &camera, Vec3::X);
        let moved = grip.drag(&camera, rect(), grip.from - vec2(0.0, 40.0), Modifiers::ALT);
        assert_eq!(moved.len(), 1);
        assert!(moved[0].0 == Knob::Ez && (moved[0].1 - 30.5).abs() < 1e-4, "{moved:?}");
        assert_eq!(grip.drag(&camera, rect(), grip.from, SHIFT)[0].0, Knob::Ex, "an emitter does not turn");
    }

    #[test]
    fn shift_or_the_nose_turns_by_as_much_as_is_heard() {
        let camera = Camera::Plan(Plan::default());
        // To the left of the listener.
        let to = camera.project(rect(), Vec3::Y).unwrap().at;
        for (thing, modifiers) in [(Thing::Listener, SHIFT), (Thing::Nose, Modifiers::NONE)] {
            let moved = grip(thing, &camera, Vec3::ZERO).drag(&camera, rect(), to, modifiers);
            assert_eq!(moved[0].0, Knob::Yaw);
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
