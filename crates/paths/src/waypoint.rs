//! Poses on their way from a file to a path.

use crate::PathFileError;
use glam::{DQuat, DVec3, EulerRot, Quat};
use promenade_core::{CameraPath, Keyframe, PathError, Pose};

/// A keyframe in double precision, for worlds whose origin is far away.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Waypoint {
    /// Seconds.
    pub(crate) t_s: f64,
    /// Head centre, z up.
    pub(crate) position: DVec3,
    /// Rotation from head axes to world axes, unit quaternion.
    pub(crate) orientation: DQuat,
}

/// What a format's reader has found.
pub(crate) struct Track {
    /// In the order of the file or of the images' names.
    pub(crate) waypoints: Vec<Waypoint>,
    /// Where one of these is in the file, by its index, for errors.
    pub(crate) place: Box<dyn Fn(usize) -> String>,
    /// What was assumed.
    pub(crate) notes: Vec<String>,
}

impl Waypoint {
    /// A head at a time, seconds.
    pub(crate) fn at(t_s: f64, pose: &Pose) -> Self {
        Self { t_s, position: pose.position.as_dvec3(), orientation: pose.orientation.as_dquat() }
    }

    /// In single precision; what does not fit is not finite.
    fn keyframe(&self) -> Keyframe {
        let pose = Pose { position: self.position.as_vec3(), orientation: self.orientation.as_quat() };
        Keyframe { t_s: self.t_s, pose }
    }
}

impl Track {
    /// The path, or the place that makes it none.
    pub(crate) fn path(&self, file: &str) -> Result<CameraPath, PathFileError> {
        let keyframes: Vec<Keyframe> = self.waypoints.iter().map(Waypoint::keyframe).collect();
        CameraPath::new(keyframes).map_err(|source| match source {
            PathError::NotRising { index, found, previous } => {
                let before = (self.place)(index - 1);
                let expected = format!("a time after {previous} s, that of {before}");
                PathFileError::entry(file, (self.place)(index), expected, format!("{found} s"))
            }
            PathError::NotFinite { index } => {
                let found = "a time, position or orientation out of range";
                PathFileError::entry(file, (self.place)(index), "a finite pose", found)
            }
            source => PathFileError::at(file, "no camera path")(source),
        })
    }
}

/// The rotation of yaw, pitch and roll in degrees.
pub(crate) fn from_degrees([yaw, pitch, roll]: [f64; 3]) -> DQuat {
    // Nose up is a negative right-hand turn about y (left), as in `Pose::from_ypr`.
    DQuat::from_euler(EulerRot::ZYX, yaw.to_radians(), -pitch.to_radians(), roll.to_radians()).normalize()
}

/// Yaw, pitch and roll in degrees; the inverse of [`from_degrees`] with pitch in [-90, 90].
pub(crate) fn to_degrees(orientation: Quat) -> [f64; 3] {
    let (yaw, pitch, roll) = orientation.as_dquat().normalize().to_euler(EulerRot::ZYX);
    [yaw.to_degrees(), -pitch.to_degrees(), roll.to_degrees()]
}

/// A unit quaternion of the components w, x, y, z; else their length.
pub(crate) fn unit([w, x, y, z]: [f64; 4]) -> Result<DQuat, f64> {
    let q = DQuat::from_xyzw(x, y, z, w);
    // Written with few digits a quaternion is a little off unit length; further off it is a mistake.
    let length = q.length();
    if (0.99..=1.01).contains(&length) { Ok(q.normalize()) } else { Err(length) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn degrees_are_those_of_poses() {
        for (yaw, pitch, roll) in [(30.0_f32, 20.0_f32, 10.0_f32), (-170.0, -80.0, 170.0), (90.0, 0.0, 0.0)] {
            let [y, p, r] = [yaw, pitch, roll].map(f32::to_radians);
            let pose = Pose::from_ypr(Vec3::ZERO, y, p, r);
            let ours = from_degrees([yaw, pitch, roll].map(f64::from));
            assert!(ours.as_quat().dot(pose.orientation).abs() > 1.0 - 1e-6);
            for (a, b) in to_degrees(pose.orientation).into_iter().zip([yaw, pitch, roll]) {
                assert!((a - f64::from(b)).abs() < 1e-3, "{a} {b}");
            }
        }
    }

    #[test]
    fn quaternions_have_unit_length() {
        assert!(unit([1.0, 0.005, 0.0, 0.0]).is_ok());
        for wrong in [[0.0; 4], [2.0, 0.0, 0.0, 0.0], [f64::NAN, 0.0, 0.0, 0.0]] {
            assert!(unit(wrong).is_err());
        }
    }
}
