//! A walk: poses over time.

mod entry;

use crate::Pose;
use crate::number::single;
use glam::{Quat, Vec3};
use thiserror::Error;

pub use entry::KeyframeEntry;

/// Keyframes that a path may have.
pub const MAX_KEYFRAMES: usize = 1_000_000;

/// A pose the listener passes through at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Keyframe {
    /// Seconds from the start of the path's time line.
    pub t_s: f64,
    /// Pose at that time.
    pub pose: Pose,
}

/// Why a list of keyframes is no path.
#[derive(Debug, Error, PartialEq)]
pub enum PathError {
    /// A path needs at least one keyframe.
    #[error("a camera path needs at least one keyframe, found none")]
    Empty,
    /// Far too many keyframes.
    #[error("the camera path has {found} keyframes, expected at most {MAX_KEYFRAMES}")]
    TooLong {
        /// Their number.
        found: usize,
    },
    /// A keyframe of a file has no orientation, or two.
    #[error("keyframe {index}: expected an orientation as \"ypr\" or as a unit \"quat\", found {found}")]
    Orientation {
        /// Zero-based number of the keyframe.
        index: usize,
        /// "neither" or "both".
        found: &'static str,
    },
    /// A quaternion of a file is no rotation.
    #[error("keyframe {index}: expected a unit quaternion, found one of length {found}")]
    NotUnit {
        /// Zero-based number of the keyframe.
        index: usize,
        /// Its length.
        found: f32,
    },
    /// Times must rise from keyframe to keyframe.
    #[error("keyframe {index} is at {found} s, expected a time after {previous} s")]
    NotRising {
        /// Zero-based number of the keyframe.
        index: usize,
        /// Its time, seconds.
        found: f64,
        /// The time of the keyframe before it, seconds.
        previous: f64,
    },
    /// A time, position or orientation is not finite, a position beyond [`Pose::FARTHEST_M`], or an orientation is not a unit
    /// quaternion.
    #[error("keyframe {index} has a time, position or orientation that is not a finite pose")]
    NotFinite {
        /// Zero-based number of the keyframe.
        index: usize,
    },
}

/// How a path is run through.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Playback {
    /// Path seconds per second; negative runs backwards.
    pub speed: f64,
    /// Start over at the end instead of staying there.
    pub looping: bool,
}

impl Default for Playback {
    fn default() -> Self {
        Self { speed: 1.0, looping: false }
    }
}

/// Camera path: position by a Catmull-Rom spline, orientation by spherical linear interpolation.
///
/// Read from a file or drawn in the editor off the audio thread; the audio thread asks the whole path for poses by time and
/// never changes it.
///
/// Position tangents are the finite differences of Catmull and Rom (1974) for unequal times; it passes through every keyframe
/// and does not overshoot a standstill between two equal positions at the ends.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraPath {
    keyframes: Vec<Keyframe>,
}

impl CameraPath {
    /// Checks and takes keyframes in rising order of time.
    ///
    /// # Errors
    /// No keyframe or more than [`MAX_KEYFRAMES`], times that do not rise, or a pose that is not finite.
    pub fn new(keyframes: Vec<Keyframe>) -> Result<Self, PathError> {
        if keyframes.is_empty() {
            return Err(PathError::Empty);
        }
        if keyframes.len() > MAX_KEYFRAMES {
            return Err(PathError::TooLong { found: keyframes.len() });
        }
        for (index, k) in keyframes.iter().enumerate() {
            if !k.t_s.is_finite() || !k.pose.is_valid() {
                return Err(PathError::NotFinite { index });
            }
            if index > 0 && k.t_s <= keyframes[index - 1].t_s {
                return Err(PathError::NotRising { index, found: k.t_s, previous: keyframes[index - 1].t_s });
            }
        }
        Ok(Self { keyframes })
    }

    /// The keyframes, rising in time.
    #[must_use]
    pub fn keyframes(&self) -> &[Keyframe] {
        &self.keyframes
    }

    /// Seconds from the first keyframe to the last.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.last().t_s - self.keyframes[0].t_s
    }

    /// Pose `elapsed_s` seconds after playing began at the first keyframe.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O. Cost grows with the logarithm of the number of keyframes.
    #[must_use]
    pub fn pose_after(&self, elapsed_s: f64, playback: Playback) -> Pose {
        let duration = self.duration_s();
        let mut along = elapsed_s * playback.speed;
        if !along.is_finite() || duration <= 0.0 {
            along = 0.0;
        } else if playback.looping {
            along = along.rem_euclid(duration);
        } else if playback.speed < 0.0 {
            along += duration;
        }
        self.pose_at(self.keyframes[0].t_s + along)
    }

    /// Pose at a time on the path's own time line, seconds; the ends hold beyond the ends.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    #[must_use]
    pub fn pose_at(&self, t_s: f64) -> Pose {
        let k = &self.keyframes;
        let next = k.partition_point(|f| f.t_s <= t_s);
        if next == 0 {
            return k[0].pose;
        }
        if next == k.len() {
            return self.last().pose;
        }
        let (a, b) = (&k[next - 1], &k[next]);
        let span = b.t_s - a.t_s;
        let u = single((t_s - a.t_s) / span);
        let before = if next >= 2 { &k[next - 2] } else { a };
        let after = k.get(next + 1).unwrap_or(b);
        let slope = |from: &Keyframe, to: &Keyframe| -> Vec3 {
            let scale = single(span / (to.t_s - from.t_s));
            (to.pose.position - from.pose.position) * scale
        };
        let (u2, u3) = (u * u, u * u * u);
        let position = a.pose.position * (2.0 * u3 - 3.0 * u2 + 1.0)
            + slope(before, b) * (u3 - 2.0 * u2 + u)
            + b.pose.position * (3.0 * u2 - 2.0 * u3)
            + slope(a, after) * (u3 - u2);
        Pose { position, orientation: slerp(a.pose.orientation, b.pose.orientation, u) }
    }

    fn last(&self) -> &Keyframe {
        &self.keyframes[self.keyframes.len() - 1]
    }
}

/// Great-circle interpolation along the shorter arc, renormalised so that long chains of products stay unit.
fn slerp(a: Quat, b: Quat, u: f32) -> Quat {
    a.slerp(b, u).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn walk() -> CameraPath {
        let at = |t_s, x, yaw| Keyframe { t_s, pose: Pose::from_ypr(Vec3::new(x, 0.0, 0.0), yaw, 0.0, 0.0) };
        CameraPath::new(vec![at(1.0, 0.0, 0.0), at(2.0, 1.0, 1.0), at(4.0, 3.0, -1.0)]).unwrap()
    }

    #[test]
    fn passes_through_its_keyframes() {
        let path = walk();
        for k in path.keyframes() {
            assert!((path.pose_at(k.t_s).position - k.pose.position).length() < 1e-6);
            assert!(path.pose_at(k.t_s).orientation.angle_between(k.pose.orientation) < 1e-3);
        }
    }

    #[test]
    fn constant_speed_stays_constant() {
        let path = walk();
        assert!((path.pose_at(3.0).position.x - 2.0).abs() < 1e-6);
    }

    #[test]
    fn loops_clamps_and_runs_backwards() {
        let path = walk();
        let x = |t, speed, looping| path.pose_after(t, Playback { speed, looping }).position.x;
        assert!((x(9.0, 1.0, false) - 3.0).abs() < 1e-6);
        assert!((x(3.0, 1.0, true)).abs() < 1e-6);
        assert!((x(1.0, 2.0, false) - path.pose_at(3.0).position.x).abs() < 1e-6);
        assert!((x(1.0, -1.0, false) - path.pose_at(3.0).position.x).abs() < 1e-6);
    }

    #[test]
    fn a_day_later_a_path_is_as_exact() {
        const DAY_S: f64 = 86_400.0;
        let path = walk();
        let later = path.keyframes().iter().map(|k| Keyframe { t_s: k.t_s + DAY_S, ..*k }).collect();
        let later = CameraPath::new(later).unwrap();
        let looping = Playback { speed: 1.0, looping: true };
        for i in 0..3_000 {
            let t_s = f64::from(i) / 1_000.0;
            let first = path.pose_after(t_s, looping);
            // A path of 3 s goes round a whole number of times in a day.
            for pose in [path.pose_after(t_s + DAY_S, looping), later.pose_at(t_s + 1.0 + DAY_S)] {
                assert!((pose.position - first.position).length() < 1e-6, "{t_s}: {pose:?}, {first:?}");
                assert!((pose.orientation - first.orientation).length() < 1e-6, "{t_s}: {pose:?}, {first:?}");
            }
        }
    }

    #[test]
    fn says_what_is_wrong() {
        assert_eq!(CameraPath::new(vec![]), Err(PathError::Empty));
        let k = Keyframe { t_s: 0.0, pose: Pose::IDENTITY };
        assert!(matches!(CameraPath::new(vec![k, k]), Err(PathError::NotRising { index: 1, .. })));
        let nan = Keyframe { t_s: f64::NAN, ..k };
        assert_eq!(CameraPath::new(vec![nan]), Err(PathError::NotFinite { index: 0 }));
    }
}
