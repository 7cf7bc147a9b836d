//! Where a foreign world comes to lie in the scene's: what a user gives goes before what the data state.

use crate::PathFileError;
use crate::error::option;
use crate::waypoint::Waypoint;
use glam::{DQuat, DVec3, Vec3};
use promenade_core::Pose;
use promenade_core::network::Placement;
use std::fmt;

/// Metres of one unit that are believed.
const METRES_PER_UNIT: std::ops::RangeInclusive<f64> = 1e-6..=1e6;

/// What becomes the origin of the scene's world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Origin {
    /// The first pose, which also looks along x: the world is turned about its z axis.
    First,
    /// The mean position of the poses; the first one looks along x.
    Centroid,
    /// The foreign world's own origin.
    Keep,
    /// A point of the foreign world, its units.
    Point(Vec3),
}

impl Origin {
    /// The origins that have a name.
    pub const NAMED: [(&str, Self); 3] = [("first", Self::First), ("centroid", Self::Centroid), ("keep", Self::Keep)];
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Point(p) => write!(f, "{},{},{}", p.x, p.y, p.z),
            named => f.write_str(Self::NAMED.iter().find(|(_, o)| o == named).map_or("", |(name, _)| name)),
        }
    }
}

/// What a user gives of a [`Placement`]. What is `None` is as the data state it: up as the cameras of a reconstruction were
/// held, or z; 1 m; the first camera of a reconstruction as the origin, or the world's own.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlacementOptions {
    /// Direction of up in the foreign world, of any length but 0. The world is tilted there and not turned about it.
    pub up: Option<Vec3>,
    /// Metres of one unit, 1e-6 to 1e6.
    pub metres_per_unit: Option<f64>,
    /// What becomes the origin.
    pub origin: Option<Origin>,
}

impl PlacementOptions {
    /// These options over the placement that the data state; `heads` are poses in the foreign world, which may be none.
    ///
    /// # Errors
    /// An option out of range, or an origin by poses where there are none.
    pub fn over(&self, stated: &Placement, heads: &[Pose]) -> Result<Placement, PathFileError> {
        let heads: Vec<Waypoint> = heads.iter().map(|pose| Waypoint::at(0.0, pose)).collect();
        let before = Frame::of(stated);
        let after = self.frame(before, &heads)?;
        let placement = after.placement();
        // What stays is the same to the last bit.
        let rotation = if after.turn == before.turn { stated.rotation } else { placement.rotation };
        Ok(Placement { rotation, ..placement })
    }

    /// These options over a placement in double precision.
    pub(crate) fn frame(&self, stated: Frame, heads: &[Waypoint]) -> Result<Frame, PathFileError> {
        let mut frame = stated;
        if let Some(up) = self.up {
            let direction = up.as_dvec3().try_normalize();
            frame = frame.tilted(direction.ok_or_else(|| option("up", "a direction", up.to_string()))?);
        }
        if let Some(metres) = self.metres_per_unit {
            if !METRES_PER_UNIT.contains(&metres) {
                let expected = "a number from 0.000001 to 1000000";
                return Err(option("metres-per-unit", expected, metres.to_string()));
            }
            frame.metres_per_unit = metres;
        }
        match (self.origin, heads) {
            (None, _) => {}
            (Some(Origin::Keep), _) => frame.origin = DVec3::ZERO,
            (Some(Origin::Point(point)), _) => frame.origin = point.as_dvec3(),
            (Some(by_heads), []) => {
                let expected = "keep or a point, where there are no cameras";
                return Err(option("origin", expected, by_heads.to_string()));
            }
            (Some(by_heads), [first, ..]) => {
                let mean = || heads.iter().map(|w| w.position).sum::<DVec3>() / heads.len() as f64;
                frame.origin = if by_heads == Origin::First { first.position } else { mean() };
                frame.turn = (level_turn(frame.turn * first.orientation) * frame.turn).normalize();
            }
        }
        Ok(frame)
    }
}

/// A [`Placement`] in double precision, for worlds whose origin is far away.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Frame {
    /// The scene's origin in the foreign world, its units.
    origin: DVec3,
    /// Rotation from the foreign axes to the scene's, unit quaternion.
    turn: DQuat,
    metres_per_unit: f64,
}

impl Frame {
    pub(crate) const IDENTITY: Self = Self { origin: DVec3::ZERO, turn: DQuat::IDENTITY, metres_per_unit: 1.0 };

    /// Turned so that this direction of the foreign world, a unit vector, is up.
    pub(crate) fn tilted(self, up: DVec3) -> Self {
        let tilt = DQuat::from_rotation_arc(self.turn.inverse() * DVec3::Z, up).inverse();
        Self { turn: self.turn * tilt, ..self }
    }

    fn of(placement: &Placement) -> Self {
        Self {
            origin: placement.origin.as_dvec3(),
            turn: placement.rotation.as_dquat().inverse(),
            metres_per_unit: f64::from(placement.units_per_metre).recip(),
        }
    }

    pub(crate) fn placement(&self) -> Placement {
        Placement {
            units_per_metre: DVec3::splat(self.metres_per_unit.recip()).as_vec3().x,
            rotation: self.turn.as_quat().normalize().inverse(),
            origin: self.origin.as_vec3(),
        }
    }

    /// Takes poses of the foreign world into the scene's.
    pub(crate) fn place(&self, waypoints: &mut [Waypoint]) {
        for w in waypoints {
            w.position = self.metres_per_unit * (self.turn * (w.position - self.origin));
            w.orientation = (self.turn * w.orientation).normalize();
        }
    }
}

/// The turn about z that takes a head's direction to x; none where it looks straight up or down.
fn level_turn(orientation: DQuat) -> DQuat {
    let ahead = orientation * DVec3::X;
    if ahead.truncate().length() < 1e-3 { DQuat::IDENTITY } else { DQuat::from_rotation_z(-ahead.y.atan2(ahead.x)) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::waypoint::from_degrees;
    use glam::Quat;

    fn walk() -> Vec<Waypoint> {
        let at = |t_s, x, yaw| Waypoint { t_s, position: DVec3::new(x, 2.0, 1.0), orientation: from_degrees([yaw, 30.0, 0.0]) };
        vec![at(0.0, 10.0, 90.0), at(1.0, 12.0, 180.0)]
    }

    fn placed(mut walk: Vec<Waypoint>, origin: Origin, metres: f64) -> Vec<Waypoint> {
        let options = PlacementOptions { origin: Some(origin), metres_per_unit: Some(metres), up: None };
        options.frame(Frame::IDENTITY, &walk).unwrap().place(&mut walk);
        walk
    }

    #[test]
    fn the_first_pose_stands_at_the_origin_and_looks_along_x() {
        let placed = placed(walk(), Origin::First, 0.5);
        assert!(placed[0].position.length() < 1e-12);
        let ahead = placed[0].orientation * DVec3::X;
        assert!(ahead.x > 0.8 && ahead.y.abs() < 1e-12 && (ahead.z - 0.5).abs() < 1e-12, "pitch stays: {ahead}");
        // What was 2 units to the right of one who looked along y is 1 m to the right of one who looks along x.
        assert!((placed[1].position - DVec3::new(0.0, -1.0, 0.0)).length() < 1e-12, "{}", placed[1].position);
    }

    #[test]
    fn the_mean_or_a_point_or_nothing_becomes_the_origin() {
        let mean = placed(walk(), Origin::Centroid, 1.0);
        assert!((mean[0].position + mean[1].position).length() < 1e-12);
        let kept = placed(walk(), Origin::Keep, 2.0);
        assert!((kept[0].position - 2.0 * walk()[0].position).length() < 1e-12);
        assert!((kept[0].orientation - walk()[0].orientation).length() < 1e-12);
        let moved = placed(walk(), Origin::Point(Vec3::new(10.0, 0.0, 0.0)), 2.0);
        assert!((moved[0].position - DVec3::new(0.0, 4.0, 2.0)).length() < 1e-12);
    }

    #[test]
    fn one_who_looks_up_is_not_turned() {
        let mut upwards = walk();
        upwards[0].orientation = from_degrees([40.0, 90.0, 0.0]);
        assert!((placed(upwards, Origin::First, 1.0)[1].position - DVec3::new(2.0, 0.0, 0.0)).length() < 1e-12);
    }

    #[test]
    fn an_option_replaces_one_quantity() {
        let rotation = Quat::from_rotation_x(1.0) * Quat::from_rotation_z(0.3);
        let stated = Placement { units_per_metre: 3.7, rotation, origin: Vec3::new(0.1, -2.0, 7.3) };
        let over = |options: PlacementOptions| options.over(&stated, &[]);
        let none = PlacementOptions::default();
        assert_eq!(over(none).unwrap(), stated);
        let metres = over(PlacementOptions { metres_per_unit: Some(0.5), ..none }).unwrap();
        assert_eq!(metres, Placement { units_per_metre: 2.0, ..stated });
        let moved = over(PlacementOptions { origin: Some(Origin::Point(Vec3::ONE)), ..none }).unwrap();
        assert_eq!(moved, Placement { origin: Vec3::ONE, ..stated });
        let up = over(PlacementOptions { up: Some(Vec3::new(0.0, -2.0, 0.0)), ..none }).unwrap();
        assert!((up.rotation * Vec3::Z).distance(Vec3::NEG_Y) < 1e-6, "{up:?}");
        assert_eq!(up, Placement { rotation: up.rotation, ..stated });
        for (wrong, clue) in [
            (PlacementOptions { up: Some(Vec3::ZERO), ..none }, "option up: expected a direction"),
            (PlacementOptions { metres_per_unit: Some(0.0), ..none }, "option metres-per-unit: expected a number from"),
            (PlacementOptions { metres_per_unit: Some(f64::NAN), ..none }, "option metres-per-unit"),
            (PlacementOptions { origin: Some(Origin::First), ..none }, "where there are no cameras, found first"),
        ] {
            let error = over(wrong).unwrap_err().to_string();
            assert!(error.contains(clue), "{error}");
        }
    }
}
