//! Where a path of another world comes to lie in the listener's.

use crate::waypoint::Waypoint;
use glam::{DQuat, DVec3};

/// What becomes the origin of the world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// The first pose, which also looks along x: the world is turned about its z axis.
    First,
    /// The mean position; the first pose looks along x.
    Centroid,
    /// The world's own origin and axes.
    Keep,
}

impl Origin {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::First, Self::Centroid, Self::Keep];

    /// Name in the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::First => "first",
            Self::Centroid => "centroid",
            Self::Keep => "keep",
        }
    }

    /// The origin of a name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|o| o.name() == name)
    }
}

/// Moves, turns and scales a world; `scale` is in metres per unit.
pub(crate) fn place(waypoints: &mut [Waypoint], origin: Origin, scale: f64) {
    let (centre, turn) = frame(waypoints, origin);
    for w in waypoints {
        w.position = scale * (turn * (w.position - centre));
        w.orientation = (turn * w.orientation).normalize();
    }
}

/// The point that becomes the origin, and the turn of the world about it.
pub(crate) fn frame(waypoints: &[Waypoint], origin: Origin) -> (DVec3, DQuat) {
    let Some(first) = waypoints.first() else { return (DVec3::ZERO, DQuat::IDENTITY) };
    let mean = || waypoints.iter().map(|w| w.position).sum::<DVec3>() / waypoints.len() as f64;
    match origin {
        Origin::Keep => (DVec3::ZERO, DQuat::IDENTITY),
        Origin::First => (first.position, level_turn(first.orientation)),
        Origin::Centroid => (mean(), level_turn(first.orientation)),
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

    fn walk() -> Vec<Waypoint> {
        let at = |t_s, x, yaw| Waypoint { t_s, position: DVec3::new(x, 2.0, 1.0), orientation: from_degrees([yaw, 30.0, 0.0]) };
        vec![at(0.0, 10.0, 90.0), at(1.0, 12.0, 180.0)]
    }

    #[test]
    fn the_first_pose_stands_at_the_origin_and_looks_along_x() {
        let mut placed = walk();
        place(&mut placed, Origin::First, 0.5);
        assert!(placed[0].position.length() < 1e-12);
        let ahead = placed[0].orientation * DVec3::X;
        assert!(ahead.x > 0.8 && ahead.y.abs() < 1e-12 && (ahead.z - 0.5).abs() < 1e-12, "pitch stays: {ahead}");
        // What was 2 units to the right of one who looked along y is 1 m to the right of one who looks along x.
        assert!((placed[1].position - DVec3::new(0.0, -1.0, 0.0)).length() < 1e-12, "{}", placed[1].position);
    }

    #[test]
    fn the_mean_or_nothing_becomes_the_origin() {
        let mut placed = walk();
        place(&mut placed, Origin::Centroid, 1.0);
        assert!((placed[0].position + placed[1].position).length() < 1e-12);
        let mut placed = walk();
        place(&mut placed, Origin::Keep, 2.0);
        assert!((placed[0].position - 2.0 * walk()[0].position).length() < 1e-12);
        assert!((placed[0].orientation - walk()[0].orientation).length() < 1e-12);
    }

    #[test]
    fn one_who_looks_up_is_not_turned() {
        let mut placed = walk();
        placed[0].orientation = from_degrees([40.0, 90.0, 0.0]);
        place(&mut placed, Origin::First, 1.0);
        assert!((placed[1].position - DVec3::new(2.0, 0.0, 0.0)).length() < 1e-12);
    }
}
