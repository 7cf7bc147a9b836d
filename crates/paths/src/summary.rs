//! A path in figures.

use crate::simplify::angle_between;
use glam::Vec3;
use promenade_core::CameraPath;

/// Steps of a segment that lengths and speeds are measured in.
const STEPS: u32 = 8;

/// Figures of a path, measured along its spline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Summary {
    /// Their number.
    pub keyframes: usize,
    /// Time of the first keyframe, seconds.
    pub start_s: f64,
    /// Seconds from the first to the last.
    pub duration_s: f64,
    /// Length of the way, metres.
    pub length_m: f64,
    /// Smallest x, y and z, metres.
    pub low: Vec3,
    /// Largest x, y and z, metres.
    pub high: Vec3,
    /// Fastest walking, metres a second, and when, seconds.
    pub fastest_m_s: (f64, f64),
    /// Fastest turning, radians a second, and when, seconds.
    pub fastest_rad_s: (f64, f64),
}

impl Summary {
    /// Measures a path.
    #[must_use]
    pub fn of(path: &CameraPath) -> Self {
        let keyframes = path.keyframes();
        let first = keyframes[0];
        let mut summary = Self {
            keyframes: keyframes.len(),
            start_s: first.t_s,
            duration_s: path.duration_s(),
            length_m: 0.0,
            low: first.pose.position,
            high: first.pose.position,
            fastest_m_s: (0.0, first.t_s),
            fastest_rad_s: (0.0, first.t_s),
        };
        for pair in keyframes.windows(2) {
            let step_s = (pair[1].t_s - pair[0].t_s) / f64::from(STEPS);
            let mut from = pair[0].pose;
            for step in 1..=STEPS {
                let t_s = pair[0].t_s + f64::from(step) * step_s;
                let to = if step == STEPS { pair[1].pose } else { path.pose_at(t_s) };
                let metres = f64::from(from.position.distance(to.position));
                summary.length_m += metres;
                summary.low = summary.low.min(to.position);
                summary.high = summary.high.max(to.position);
                let faster = |fastest: &mut (f64, f64), speed: f64| {
                    if speed > fastest.0 {
                        *fastest = (speed, t_s);
                    }
                };
                faster(&mut summary.fastest_m_s, metres / step_s);
                faster(&mut summary.fastest_rad_s, f64::from(angle_between(&from, &to)) / step_s);
                from = to;
            }
        }
        summary
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_core::{Keyframe, Pose};

    #[test]
    fn a_walk_in_figures() {
        let at = |t_s, x, yaw| Keyframe { t_s, pose: Pose::from_ypr(Vec3::new(x, 2.0, 1.7), yaw, 0.0, 0.0) };
        let path = CameraPath::new(vec![at(1.0, 0.0, 0.0), at(3.0, 2.0, 0.0), at(5.0, 4.0, 3.0)]).unwrap();
        let s = Summary::of(&path);
        assert_eq!((s.keyframes, s.start_s, s.duration_s), (3, 1.0, 4.0));
        assert!((s.length_m - 4.0).abs() < 1e-5 && (s.fastest_m_s.0 - 1.0).abs() < 1e-5);
        assert!((s.fastest_rad_s.0 - 1.5).abs() < 1e-4 && s.fastest_rad_s.1 > 3.0);
        assert_eq!((s.low, s.high), (Vec3::new(0.0, 2.0, 1.7), Vec3::new(4.0, 2.0, 1.7)));
        let still = Summary::of(&CameraPath::new(vec![at(0.0, 1.0, 0.0)]).unwrap());
        assert_eq!((still.length_m, still.fastest_m_s), (0.0, (0.0, 0.0)));
    }
}
