//! A head tracker as the messages so far have it, mapped to the head's axes and recentred.

pub mod axes;
pub mod custom;
pub mod format;
pub mod reading;

use crate::tracker::axes::AxisMap;
use crate::tracker::reading::{Facing, Reading};
use promenade_core::Pose;
use promenade_core::glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// What a tracker's recentring resets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Recenter {
    /// The direction and the place; pitch and roll stay those that gravity gives the tracker.
    #[default]
    Yaw,
    /// The whole orientation and the place.
    Full,
    /// Nothing: the tracker's own origin.
    Off,
}

/// A tracker's newest orientation, as it came.
#[derive(Clone, Copy, Debug)]
enum Last {
    Turned(Quat),
    Angles([f32; 3]),
}

/// One instance's tracker. Its OSC input owns it and publishes its poses; the audio thread never sees it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tracker {
    facing: Last,
    position: Vec3,
    /// Whether the maps apply: not to what is in this plugin's own conventions.
    mapped: bool,
    axes: AxisMap,
    position_axes: AxisMap,
    /// The pose that is the origin.
    origin: Option<Pose>,
    /// When the last message came.
    pub(crate) heard: Option<Instant>,
}

impl Tracker {
    pub(crate) fn new(axes: AxisMap, position_axes: AxisMap) -> Self {
        Self {
            facing: Last::Angles([0.0; 3]),
            position: Vec3::ZERO,
            mapped: false,
            axes,
            position_axes,
            origin: None,
            heard: None,
        }
    }

    /// Takes other maps, which apply to the present pose too.
    pub(crate) fn remap(&mut self, axes: AxisMap, position_axes: AxisMap) {
        (self.axes, self.position_axes) = (axes, position_axes);
    }

    /// Takes a message's reading; `mapped` when it is in a tracker's conventions, not this plugin's own.
    pub(crate) fn take(&mut self, reading: &Reading, mapped: bool, now: Instant) {
        self.mapped = mapped;
        self.heard = Some(now);
        if let Some(position) = reading.position {
            self.position = position;
        }
        match reading.facing {
            Some(Facing::Turned(quaternion)) => self.facing = Last::Turned(quaternion),
            Some(Facing::Angles(angles)) => {
                let before = match self.facing {
                    Last::Angles(angles) => angles,
                    Last::Turned(_) => [0.0; 3],
                };
                self.facing = Last::Angles(std::array::from_fn(|axis| angles[axis].unwrap_or(before[axis])));
            }
            None => (),
        }
    }

    /// The pose before it is recentred.
    fn raw(&self) -> Pose {
        let (axes, position_axes) =
            if self.mapped { (self.axes, self.position_axes) } else { (AxisMap::IDENTITY, AxisMap::IDENTITY) };
        let orientation = match self.facing {
            Last::Turned(quaternion) => axes.turn(quaternion),
            Last::Angles(angles) => {
                let [yaw, pitch, roll] = axes.apply(angles);
                Pose::from_ypr(Vec3::ZERO, yaw, pitch, roll).orientation
            }
        };
        Pose { position: position_axes.apply_to(self.position), orientation }
    }

    /// Makes the present pose the origin.
    pub(crate) fn recenter(&mut self, how: Recenter) {
        let raw = self.raw();
        self.origin = match how {
            Recenter::Off => None,
            Recenter::Full => Some(raw),
            Recenter::Yaw => Some(Pose { orientation: heading(raw.orientation), ..raw }),
        };
    }

    /// The pose of the head.
    pub(crate) fn pose(&self) -> Pose {
        let raw = self.raw();
        let Some(origin) = self.origin else { return raw };
        let back = origin.orientation.conjugate();
        Pose { position: back * (raw.position - origin.position), orientation: (back * raw.orientation).normalize() }
    }
}

/// The turn about the vertical that brings +x to where an orientation faces, seen from above.
///
/// A head that looks straight up or down faces where its chin or the top of its head points.
fn heading(orientation: Quat) -> Quat {
    let ahead = orientation * Vec3::X;
    let flat = if ahead.truncate().length() > 1e-3 { ahead } else { orientation * Vec3::Z * -ahead.z.signum() };
    Quat::from_rotation_z(flat.y.atan2(flat.x))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(yaw: f32, pitch: f32, roll: f32) -> Reading {
        Reading { facing: Some(Facing::Angles([Some(yaw), Some(pitch), Some(roll)])), ..Reading::default() }
    }

    fn check(pose: Pose, wanted: (f32, f32, f32)) {
        let found = pose.ypr();
        let off = |a: f32, b: f32| (a - b).abs() < 1e-4;
        assert!(off(found.0, wanted.0) && off(found.1, wanted.1) && off(found.2, wanted.2), "{found:?}, not {wanted:?}");
    }

    fn tracker() -> Tracker {
        Tracker::new(AxisMap::IDENTITY, AxisMap::IDENTITY)
    }

    #[test]
    fn single_angles_come_together() {
        let mut tracker = tracker();
        for (axis, value) in [(0, 0.5), (1, 0.2), (2, -0.1)] {
            let mut angles = [None; 3];
            angles[axis] = Some(value);
            tracker.take(&Reading { facing: Some(Facing::Angles(angles)), ..Reading::default() }, true, Instant::now());
        }
        check(tracker.pose(), (0.5, 0.2, -0.1));
    }

    #[test]
    fn recentring_by_yaw_keeps_pitch_and_roll() {
        let mut tracker = tracker();
        tracker.take(&at(1.0, 0.3, -0.2), true, Instant::now());
        tracker.recenter(Recenter::Yaw);
        check(tracker.pose(), (0.0, 0.3, -0.2));
        tracker.take(&at(1.5, 0.0, 0.0), true, Instant::now());
        check(tracker.pose(), (0.5, 0.0, 0.0));
        tracker.recenter(Recenter::Off);
        check(tracker.pose(), (1.5, 0.0, 0.0));
    }

    #[test]
    fn recentring_in_full_makes_the_head_level() {
        let mut tracker = tracker();
        tracker.take(&at(1.0, 0.3, -0.2), true, Instant::now());
        tracker.recenter(Recenter::Full);
        check(tracker.pose(), (0.0, 0.0, 0.0));
    }

    #[test]
    fn recentring_takes_the_place_along_and_turns_the_way() {
        let mut tracker = tracker();
        let quarter = std::f32::consts::FRAC_PI_2;
        tracker.take(&Reading { position: Some(Vec3::new(1.0, 2.0, 3.0)), ..at(quarter, 0.0, 0.0) }, true, Instant::now());
        tracker.recenter(Recenter::Yaw);
        assert!(tracker.pose().position.length() < 1e-6);
        // A step along the tracker's y, the way the head faced, is a step forward.
        tracker.take(&Reading { position: Some(Vec3::new(1.0, 3.0, 3.0)), ..Reading::default() }, true, Instant::now());
        assert!((tracker.pose().position - Vec3::X).length() < 1e-5);
    }

    #[test]
    fn a_head_that_looks_straight_up_can_be_recentred() {
        for pitch in [std::f32::consts::FRAC_PI_2, -std::f32::consts::FRAC_PI_2] {
            let mut tracker = tracker();
            let up = Pose::from_ypr(Vec3::ZERO, 0.7, pitch, 0.0);
            tracker.take(&Reading { facing: Some(Facing::Turned(up.orientation)), ..Reading::default() }, true, Instant::now());
            tracker.recenter(Recenter::Yaw);
            let wanted = Pose::from_ypr(Vec3::ZERO, 0.0, pitch, 0.0).orientation;
            assert!(tracker.pose().orientation.dot(wanted).abs() > 1.0 - 1e-5);
        }
    }

    #[test]
    fn maps_apply_to_trackers_and_at_once() {
        let mut tracker = tracker();
        tracker.take(&at(0.5, 0.2, 0.0), true, Instant::now());
        tracker.remap(AxisMap { order: [0, 1, 2], invert: [true, false, false] }, AxisMap::IDENTITY);
        check(tracker.pose(), (-0.5, 0.2, 0.0));
        tracker.take(&at(0.5, 0.2, 0.0), false, Instant::now());
        check(tracker.pose(), (0.5, 0.2, 0.0));
    }
}
