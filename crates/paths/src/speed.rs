//! Walks that are too fast for a head, as where a file's rate is not that of its cameras.

use crate::Summary;
use crate::simplify::angle_between;
use promenade_core::CameraPath;

/// Faster than this no head turns, degrees a second, nor walks, metres a second.
const FASTEST_TURN: f64 = 1_000.0;
const FASTEST_WALK: f64 = 12.0;
/// A pace that cameras are carried at, below which 19 of 20 steps lie.
const USUAL_TURN: f64 = 120.0;
const USUAL_WALK: f64 = 2.0;
const USUAL_SHARE: f64 = 0.95;
/// Rates that recordings have, pictures a second.
const RATES: [f64; 13] = [120.0, 60.0, 50.0, 30.0, 25.0, 24.0, 15.0, 12.0, 10.0, 5.0, 2.0, 1.0, 0.5];

/// What is said of cameras that no head follows, with the rate of pictures that they are likely to have.
pub(crate) fn warning(path: &CameraPath, in_metres: bool) -> Option<String> {
    let found = Summary::of(path);
    let (turn, turn_s) = (found.fastest_rad_s.0.to_degrees(), found.fastest_rad_s.1);
    let (walk, walk_s) = found.fastest_m_s;
    let turns = turn > FASTEST_TURN;
    if !(turns || in_metres && walk > FASTEST_WALK) {
        return None;
    }
    let what = if turns {
        format!("it turns by {turn:.0} degrees a second at {turn_s:.2} s, and no head turns by more than {FASTEST_TURN:.0}")
    } else {
        format!("it moves by {walk:.1} m a second at {walk_s:.2} s, and no listener does by more than {FASTEST_WALK:.0}")
    };
    let likely = likely(path, in_metres).map(|rate| {
        let pictures = if rate == 1.0 { "picture" } else { "pictures" };
        format!("; its cameras look like {rate} {pictures} a second (--fps {rate})")
    });
    Some(format!("{what}{}", likely.unwrap_or_default()))
}

/// The highest rate at which cameras are as fast as they are carried, if it is lower than what the path has.
fn likely(path: &CameraPath, in_metres: bool) -> Option<f64> {
    let pairs = || path.keyframes().windows(2);
    let usual = |mut steps: Vec<f64>| {
        steps.sort_by(f64::total_cmp);
        let last = steps.len().checked_sub(1)?;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a length")]
        steps.get((USUAL_SHARE * last as f64).round() as usize).copied()
    };
    let gap_s = usual(pairs().map(|p| p[1].t_s - p[0].t_s).collect())?;
    let turn = usual(pairs().map(|p| f64::from(angle_between(&p[0].pose, &p[1].pose)).to_degrees()).collect())?;
    let walk = usual(pairs().map(|p| f64::from(p[0].pose.position.distance(p[1].pose.position))).collect())?;
    let fits = |rate: &&f64| **rate * turn <= USUAL_TURN && (!in_metres || **rate * walk <= USUAL_WALK);
    RATES.iter().filter(|rate| **rate < 0.9 / gap_s).find(fits).copied()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use promenade_core::{Keyframe, Pose};

    /// A walk that turns by so many degrees from picture to picture.
    fn walk(rate: f64, degrees: f32, metres: f32) -> CameraPath {
        let pose = |i: u16| Pose::from_ypr(metres * f32::from(i) * Vec3::X, (degrees * f32::from(i)).to_radians(), 0.0, 0.0);
        CameraPath::new((0..200).map(|i| Keyframe { t_s: f64::from(i) / rate, pose: pose(i) }).collect()).unwrap()
    }

    #[test]
    fn a_walk_at_one_picture_a_second_is_none_at_24() {
        // Anchors of a published set: 614 pictures that turn by up to 74 degrees from one to the next.
        let said = warning(&walk(24.0, 74.0, 0.4), false).unwrap();
        assert!(
            said.contains("17") && said.contains("degrees a second") && said.ends_with("1 picture a second (--fps 1)"),
            "{said}"
        );
        assert_eq!(warning(&walk(1.0, 74.0, 0.4), false), None);
        assert_eq!(warning(&walk(24.0, 3.0, 0.1), true), None);
        let said = warning(&walk(30.0, 1.0, 0.9), true).unwrap();
        assert!(said.contains("27.0 m a second") && said.contains("--fps 2)"), "{said}");
        assert_eq!(warning(&walk(30.0, 1.0, 0.9), false), None, "units of its own");
    }
}
