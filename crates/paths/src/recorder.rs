//! Poses of a walk while it happens.

use crate::simplify;
use promenade_core::{Keyframe, MAX_KEYFRAMES, PathError, Pose};
use thiserror::Error;

/// How much a recorder keeps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecorderConfig {
    /// Poses kept a second, at most, none within half of that time of another; what comes faster is passed over. Above 0.
    pub rate_hz: f64,
    /// Poses kept altogether, 1 to [`MAX_KEYFRAMES`].
    pub max_poses: usize,
}

impl Default for RecorderConfig {
    /// 60 a second, for an hour.
    fn default() -> Self {
        Self { rate_hz: 60.0, max_poses: 60 * 3600 }
    }
}

/// Why a pose is not recorded.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum RecordError {
    /// The rate or the number of poses is out of range.
    #[error("expected a rate above 0 and 1 to {MAX_KEYFRAMES} poses, found {rate_hz} a second and {max_poses}")]
    Config {
        /// Poses a second.
        rate_hz: f64,
        /// Poses altogether.
        max_poses: usize,
    },
    /// Times rise from pose to pose.
    #[error("expected a time after {previous} s, found {found} s")]
    NotRising {
        /// The time, seconds.
        found: f64,
        /// The time before, seconds.
        previous: f64,
    },
    /// The time or the pose is not finite.
    #[error("expected a finite time and pose")]
    NotFinite,
    /// No more poses are kept.
    #[error("the recording is full: {0} poses")]
    Full(usize),
}

/// Collects poses and makes keyframes of them.
///
/// For an editor's thread, which allocates as the recording grows.
#[derive(Clone, Debug)]
pub struct Recorder {
    config: RecorderConfig,
    poses: Vec<Keyframe>,
    /// The last pose that was passed over, which ends the recording if nothing follows.
    passed: Option<Keyframe>,
    /// When the next pose is kept.
    due_s: f64,
}

impl Recorder {
    /// An empty recording.
    ///
    /// # Errors
    /// A configuration out of range.
    pub fn new(config: RecorderConfig) -> Result<Self, RecordError> {
        let RecorderConfig { rate_hz, max_poses } = config;
        if !(rate_hz.is_finite() && rate_hz > 0.0 && (1..=MAX_KEYFRAMES).contains(&max_poses)) {
            return Err(RecordError::Config { rate_hz, max_poses });
        }
        Ok(Self { config, poses: Vec::new(), passed: None, due_s: f64::NEG_INFINITY })
    }

    /// Takes a pose at a time in seconds; whether it is kept, and not passed over because it comes too soon after the last.
    ///
    /// # Errors
    /// A time that does not rise, a pose that is not finite, or a full recording. What was recorded before stays.
    ///
    /// # Real-time
    /// Not real-time safe.
    pub fn push(&mut self, t_s: f64, pose: Pose) -> Result<bool, RecordError> {
        if !t_s.is_finite() || !pose.is_valid() {
            return Err(RecordError::NotFinite);
        }
        if let Some(last) = self.passed.or(self.poses.last().copied())
            && t_s <= last.t_s
        {
            return Err(RecordError::NotRising { found: t_s, previous: last.t_s });
        }
        let keyframe = Keyframe { t_s, pose };
        if t_s < self.due_s {
            self.passed = Some(keyframe);
            return Ok(false);
        }
        if self.poses.len() == self.config.max_poses {
            return Err(RecordError::Full(self.poses.len()));
        }
        self.poses.push(keyframe);
        self.passed = None;
        // From when it was due, so that poses that come a little early are not passed over one by one; and no burst after a
        // pause.
        let period_s = 1.0 / self.config.rate_hz;
        self.due_s = (self.due_s + period_s).max(t_s + 0.5 * period_s);
        Ok(true)
    }

    /// Poses kept.
    #[must_use]
    pub fn len(&self) -> usize {
        self.poses.len()
    }

    /// Whether nothing is recorded.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.poses.is_empty()
    }

    /// Seconds from the first pose to the last.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        let last = self.passed.or(self.poses.last().copied());
        last.zip(self.poses.first()).map_or(0.0, |(last, first)| last.t_s - first.t_s)
    }

    /// The recording in few keyframes, as [`simplify()`] makes them. It ends where the listener was last.
    ///
    /// # Errors
    /// Nothing was recorded.
    pub fn finish(mut self, tolerance_m: f32, tolerance_rad: f32) -> Result<Vec<Keyframe>, PathError> {
        if let Some(passed) = self.passed {
            // A full recording gives up the last but one.
            if self.poses.len() > 1 && self.poses.len() == self.config.max_poses {
                self.poses.pop();
            }
            self.poses.push(passed);
        }
        simplify(&self.poses, tolerance_m, tolerance_rad)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn at(x: f32) -> Pose {
        Pose { position: Vec3::new(x, 0.0, 0.0), ..Pose::IDENTITY }
    }

    fn recorder(rate_hz: f64, max_poses: usize) -> Recorder {
        Recorder::new(RecorderConfig { rate_hz, max_poses }).unwrap()
    }

    #[test]
    fn faster_poses_are_passed_over_and_the_last_one_stays() {
        let mut recorder = recorder(10.0, 1000);
        for i in 0..=1005 {
            recorder.push(f64::from(i) * 1e-3, at(i as f32)).unwrap();
        }
        assert_eq!(recorder.len(), 11);
        assert!((recorder.duration_s() - 1.005).abs() < 1e-12);
        let all = recorder.finish(-1.0, -1.0).unwrap();
        assert_eq!((all.len(), all[1].pose.position.x, all[11].pose.position.x), (12, 50.0, 1005.0));
    }

    #[test]
    fn the_rate_itself_is_kept_though_it_trembles() {
        let mut kept = 0;
        let mut recorder = recorder(60.0, 1000);
        for i in 0..600 {
            let tremble = if i % 2 == 0 { 1e-3 } else { -1e-3 };
            kept += usize::from(recorder.push(f64::from(i) / 60.0 + tremble, at(0.0)).unwrap());
        }
        assert!(kept >= 598, "{kept}");
    }

    #[test]
    fn a_pause_is_no_licence_for_a_burst() {
        let mut recorder = recorder(10.0, 1000);
        recorder.push(0.0, at(0.0)).unwrap();
        let kept = (0..1000).filter(|i| recorder.push(60.0 + 1e-3 * f64::from(*i), at(0.0)).unwrap()).count();
        assert!((10..=11).contains(&kept), "{kept} in a second");
    }

    #[test]
    fn refuses_what_is_no_recording() {
        let mut recorder = recorder(8.0, 2);
        assert_eq!(recorder.push(f64::NAN, at(0.0)), Err(RecordError::NotFinite));
        assert_eq!(recorder.push(0.0, at(f32::INFINITY)), Err(RecordError::NotFinite));
        assert_eq!(recorder.push(1.0, at(1.0)), Ok(true));
        assert_eq!(recorder.push(1.0, at(1.0)), Err(RecordError::NotRising { found: 1.0, previous: 1.0 }));
        assert_eq!(recorder.push(1.05, at(2.0)), Ok(false));
        assert_eq!(
            recorder.push(1.05, at(2.0)),
            Err(RecordError::NotRising { found: 1.05, previous: 1.05 }),
            "passed over, but seen"
        );
        assert_eq!(recorder.push(1.0625, at(3.0)), Ok(true));
        assert_eq!(recorder.push(1.25, at(4.0)), Err(RecordError::Full(2)));
        assert_eq!(recorder.push(1.125, at(5.0)), Ok(false));
        let few = recorder.finish(0.0, 0.0).unwrap();
        assert_eq!(few.iter().map(|k| k.t_s).collect::<Vec<_>>(), [1.0, 1.125], "it ends at the last pose, within its bound");
        assert_eq!(self::recorder(10.0, 2).finish(0.0, 0.0), Err(PathError::Empty));
        for (rate_hz, max_poses) in [(0.0, 1), (f64::NAN, 1), (60.0, 0), (60.0, MAX_KEYFRAMES + 1)] {
            assert!(matches!(Recorder::new(RecorderConfig { rate_hz, max_poses }), Err(RecordError::Config { .. })));
        }
    }

    #[test]
    fn a_recorded_circle_becomes_few_keyframes() {
        let mut recorder = Recorder::new(RecorderConfig::default()).unwrap();
        for i in 0..=3600_u16 {
            let angle = std::f32::consts::TAU * f32::from(i) / 3600.0;
            let pose = Pose::from_ypr(Vec3::new(2.0 * angle.cos(), 2.0 * angle.sin(), 1.7), angle, 0.0, 0.0);
            recorder.push(f64::from(i) / 60.0, pose).unwrap();
        }
        let few = recorder.finish(0.01, 0.01).unwrap();
        assert!((3..30).contains(&few.len()), "{}", few.len());
    }
}
