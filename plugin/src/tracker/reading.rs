//! The head's pose as a tracker's message gives it.

use crate::parameter::cast::narrow;
use crate::tracker::axes::AxisMap;
use promenade_core::glam::{Quat, Vec3};

/// Positions beyond this are clamped, metres.
pub const FARTHEST_M: f32 = 1000.0;
/// Angles beyond this are taken for mistakes, turns.
const MOST_TURNS: f64 = 1000.0;
/// A quaternion shorter than this has no direction.
const SHORTEST: f64 = 1e-3;

/// The unit of an angle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Degrees.
    Degrees,
    /// Radians.
    Radians,
    /// 0 to 1 for half a turn one way to half a turn the other, 0.5 ahead.
    Turns,
}

/// Consecutive arguments that belong together. Maps give the head's axes, as in the conventions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Argument {
    /// So many that are skipped.
    Skip(usize),
    /// A word before the numbers.
    Word,
    /// x, y and z, metres.
    Position(AxisMap),
    /// w, x, y and z.
    Quaternion(AxisMap),
    /// x, y, z and w.
    QuaternionLast(AxisMap),
    /// x, y and z of a quaternion; w may follow, and one more that does not count.
    RotationVector(AxisMap),
    /// Three angles; the map gives yaw, pitch and roll.
    Angles(Unit, AxisMap),
    /// One angle: of yaw, pitch and roll the one with this number, and whether it counts the other way.
    Angle(Unit, u8, bool),
}

/// Which way the head faces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Facing {
    /// An orientation.
    Turned(Quat),
    /// Yaw, pitch and roll, radians; `None` stays as it was.
    Angles([Option<f32>; 3]),
}

/// The parts of the head's pose that a message gives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reading {
    /// Where it is, metres.
    pub position: Option<Vec3>,
    /// Which way it faces.
    pub facing: Option<Facing>,
    /// Whether a value was out of range and has been clamped.
    pub clamped: bool,
}

impl Argument {
    /// The least and the greatest number of values.
    const fn count(self) -> (usize, usize) {
        match self {
            Self::Skip(count) => (count, count),
            Self::Word => (0, 0),
            Self::Position(_) | Self::Angles(..) => (3, 3),
            Self::Quaternion(_) | Self::QuaternionLast(_) => (4, 4),
            Self::RotationVector(_) => (3, 5),
            Self::Angle(..) => (1, 1),
        }
    }
}

impl Reading {
    /// Reads the values of such arguments.
    ///
    /// # Errors
    /// A message on the fault: the number of values, or one out of reason.
    pub fn new(arguments: &[Argument], values: &[f64]) -> Result<Self, String> {
        let (least, most) = arguments.iter().fold((0, 0), |(least, most), argument| {
            let (l, m) = argument.count();
            (least + l, most + m)
        });
        if !(least..=most).contains(&values.len()) {
            let expected = if least == most { format!("{least}") } else { format!("{least} to {most}") };
            return Err(format!("expected {expected} numbers, found {}", values.len()));
        }
        if let Some(bad) = values.iter().find(|value| !value.is_finite()) {
            return Err(format!("expected finite numbers, found {bad}"));
        }
        let mut reading = Self::default();
        let mut rest = values;
        for argument in arguments {
            let count = argument.count().1.min(rest.len());
            let (here, after) = rest.split_at(count);
            rest = after;
            reading.take(*argument, here)?;
        }
        Ok(reading)
    }

    fn take(&mut self, argument: Argument, values: &[f64]) -> Result<(), String> {
        match (argument, values) {
            (Argument::Position(map), [x, y, z]) => {
                let found = map.apply_to(Vec3::new(narrow(*x), narrow(*y), narrow(*z)));
                let kept = found.clamp(Vec3::splat(-FARTHEST_M), Vec3::splat(FARTHEST_M));
                self.clamped |= kept != found;
                self.position = Some(kept);
            }
            (Argument::Quaternion(map), [w, x, y, z]) | (Argument::QuaternionLast(map), [x, y, z, w]) => {
                self.facing = Some(Facing::Turned(orientation(map, [*x, *y, *z], *w)?));
            }
            (Argument::RotationVector(map), [x, y, z, rest @ ..]) => {
                let w = rest.first().copied().unwrap_or_else(|| (1.0 - x * x - y * y - z * z).max(0.0).sqrt());
                self.facing = Some(Facing::Turned(orientation(map, [*x, *y, *z], w)?));
            }
            (Argument::Angles(unit, map), [a, b, c]) => {
                let angles = map.apply([unit.radians(*a)?, unit.radians(*b)?, unit.radians(*c)?]);
                self.facing = Some(Facing::Angles(angles.map(Some)));
            }
            (Argument::Angle(unit, axis, inverted), [value]) => {
                let angle = unit.radians(*value)?;
                let mut angles = [None; 3];
                angles[usize::from(axis).min(2)] = Some(if inverted { -angle } else { angle });
                self.facing = Some(Facing::Angles(angles));
            }
            _ => (),
        }
        Ok(())
    }
}

impl Unit {
    /// An angle in radians, within half a turn either way.
    fn radians(self, value: f64) -> Result<f32, String> {
        let turns = match self {
            Self::Degrees => value / 360.0,
            Self::Radians => value / std::f64::consts::TAU,
            Self::Turns => value - 0.5,
        };
        if turns.abs() > MOST_TURNS {
            return Err(format!("an angle of {value} is out of reason"));
        }
        Ok(narrow((turns - turns.round()) * std::f64::consts::TAU))
    }
}

fn orientation(map: AxisMap, vector: [f64; 3], w: f64) -> Result<Quat, String> {
    let length = (vector.iter().map(|v| v * v).sum::<f64>() + w * w).sqrt();
    if !(length.is_finite() && length > SHORTEST) {
        return Err(format!("a quaternion of length {length} has no direction"));
    }
    let [x, y, z] = vector.map(|v| narrow(v / length));
    let head = map.apply_to(Vec3::new(x, y, z));
    Ok(Quat::from_xyzw(head.x, head.y, head.z, narrow(w / length)).normalize())
}

#[cfg(test)]
mod tests {
    use super::*;

    const SAME: AxisMap = AxisMap::IDENTITY;

    #[test]
    fn angles_come_round() {
        let yaw = |value: f64| match Reading::new(&[Argument::Angle(Unit::Degrees, 0, false)], &[value]) {
            Ok(Reading { facing: Some(Facing::Angles([Some(yaw), None, None])), .. }) => yaw.to_degrees(),
            other => panic!("{other:?}"),
        };
        assert!((yaw(270.0) + 90.0).abs() < 1e-4);
        assert!((yaw(-370.0) + 10.0).abs() < 1e-4);
        assert!((yaw(36_000.0 + 45.0) - 45.0).abs() < 1e-3);
    }

    #[test]
    fn what_no_head_can_have_is_refused_with_a_reason() {
        let refused = |argument, values: &[f64]| Reading::new(&[argument], values).unwrap_err();
        assert!(refused(Argument::Angles(Unit::Degrees, SAME), &[0.0, 1.0]).contains("expected 3 numbers, found 2"));
        assert!(refused(Argument::Position(SAME), &[0.0, f64::NAN, 0.0]).contains("finite"));
        assert!(refused(Argument::Quaternion(SAME), &[0.0; 4]).contains("no direction"));
        assert!(refused(Argument::Quaternion(SAME), &[1e300; 4]).contains("no direction"));
        assert!(refused(Argument::Angle(Unit::Degrees, 0, false), &[1e30]).contains("out of reason"));
        assert!(refused(Argument::RotationVector(SAME), &[0.0; 6]).contains("3 to 5"));
    }

    #[test]
    fn far_positions_are_clamped_and_long_quaternions_normalised() {
        let reading =
            Reading::new(&[Argument::Position(SAME), Argument::Quaternion(SAME)], &[1e30, -2.0, 0.0, 0.0, 0.0, 0.0, 9.0]);
        let reading = reading.unwrap();
        assert_eq!(reading.position, Some(Vec3::new(FARTHEST_M, -2.0, 0.0)));
        assert!(reading.clamped);
        assert_eq!(reading.facing, Some(Facing::Turned(Quat::from_xyzw(0.0, 0.0, 1.0, 0.0))));
    }

    #[test]
    fn a_rotation_vector_may_come_without_its_w() {
        let half = 15_f64.to_radians();
        let full = Reading::new(&[Argument::RotationVector(SAME)], &[0.0, 0.0, half.sin(), half.cos()]).unwrap();
        let short = Reading::new(&[Argument::RotationVector(SAME)], &[0.0, 0.0, half.sin()]).unwrap();
        let (Some(Facing::Turned(a)), Some(Facing::Turned(b))) = (full.facing, short.facing) else { panic!() };
        assert!(a.dot(b) > 1.0 - 1e-6);
    }
}
