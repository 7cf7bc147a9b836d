//! A keyframe as files and saved projects write it.

use super::{Keyframe, PathError};
use crate::Pose;
use glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};

/// A keyframe in a camera path file (JSON) or a saved project: `{"t": 0, "position": [x, y, z], "ypr": [0, 0, 0]}`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KeyframeEntry {
    /// Seconds on the path's own time line.
    pub t: f64,
    /// World position x, y, z, metres.
    pub position: [f32; 3],
    /// Yaw, pitch and roll, degrees ...
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ypr: Option<[f32; 3]>,
    /// ... or the unit quaternion w, x, y, z.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quat: Option<[f32; 4]>,
}

impl KeyframeEntry {
    /// The keyframe, radians inside; `index` is its number in the path, for errors.
    ///
    /// # Errors
    /// Not exactly one orientation, or a quaternion more than 1 % off unit length.
    pub fn to_keyframe(&self, index: usize) -> Result<Keyframe, PathError> {
        let position = Vec3::from_array(self.position);
        let pose = match (self.ypr, self.quat) {
            (Some(ypr), None) => Pose::from_ypr64(position, ypr.map(|degrees| f64::from(degrees).to_radians())),
            (None, Some([w, x, y, z])) => {
                let orientation = Quat::from_xyzw(x, y, z, w);
                // Written with few digits a quaternion is a little off unit length; further off it is a mistake.
                let found = orientation.length();
                if !(0.99..=1.01).contains(&found) {
                    return Err(PathError::NotUnit { index, found });
                }
                Pose { position, orientation: orientation.normalize() }
            }
            (ypr, _) => return Err(PathError::Orientation { index, found: if ypr.is_some() { "both" } else { "neither" } }),
        };
        Ok(Keyframe { t_s: self.t, pose })
    }
}

impl From<Keyframe> for KeyframeEntry {
    /// As a quaternion, which says every orientation exactly.
    fn from(keyframe: Keyframe) -> Self {
        let q = keyframe.pose.orientation;
        Self { t: keyframe.t_s, position: keyframe.pose.position.to_array(), ypr: None, quat: Some([q.w, q.x, q.y, q.z]) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn degrees_become_radians_and_quaternions_are_w_first() {
        let ypr = KeyframeEntry { ypr: Some([90.0, 0.0, 0.0]), ..KeyframeEntry::default() }.to_keyframe(0).unwrap();
        let half = std::f32::consts::FRAC_1_SQRT_2;
        let quat = KeyframeEntry { quat: Some([half, 0.0, 0.0, half]), ..KeyframeEntry::default() }.to_keyframe(0).unwrap();
        assert!(ypr.pose.orientation.angle_between(quat.pose.orientation) < 1e-3);
        assert!((ypr.pose.orientation * Vec3::X - Vec3::Y).length() < 1e-6);
    }

    #[test]
    fn a_keyframe_comes_back_from_its_entry() {
        let keyframe = Keyframe { t_s: 0.1, pose: Pose::from_ypr(Vec3::new(0.1, -2.0, 3e-7), 3.1, -1.57, 0.2) };
        let back = KeyframeEntry::from(keyframe).to_keyframe(0).unwrap();
        assert_eq!((back.t_s, back.pose.position), (keyframe.t_s, keyframe.pose.position));
        assert!((back.pose.orientation - keyframe.pose.orientation).length() < 1e-6);
    }

    #[test]
    fn an_orientation_is_given_once_and_has_unit_length() {
        let entry = KeyframeEntry::default();
        assert_eq!(entry.to_keyframe(3), Err(PathError::Orientation { index: 3, found: "neither" }));
        let both = KeyframeEntry { ypr: Some([0.0; 3]), quat: Some([1.0, 0.0, 0.0, 0.0]), ..entry };
        assert_eq!(both.to_keyframe(3), Err(PathError::Orientation { index: 3, found: "both" }));
        for quat in [[2.0, 0.0, 0.0, 0.0], [0.0; 4], [f32::NAN, 0.0, 0.0, 0.0]] {
            let wrong = KeyframeEntry { quat: Some(quat), ..entry };
            assert!(matches!(wrong.to_keyframe(3), Err(PathError::NotUnit { index: 3, .. })));
        }
    }
}
