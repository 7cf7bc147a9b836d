//! Which of a tracker's axes is which of the head's.

use promenade_core::glam::{Quat, Vec3};
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};

/// Which of three axes of a tracker is which of the head's, and which way it counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct AxisMap {
    /// For each of the head's axes the number of the tracker's, 0 to 2.
    #[serde(deserialize_with = "order")]
    pub order: [u8; 3],
    /// For each of the head's axes whether it counts the other way.
    pub invert: [bool; 3],
}

fn order<'de, D: Deserializer<'de>>(saved: D) -> Result<[u8; 3], D::Error> {
    let order = <[u8; 3]>::deserialize(saved)?;
    if order.iter().all(|axis| *axis < 3) { Ok(order) } else { Err(D::Error::custom("axes are numbered 0 to 2")) }
}

impl Default for AxisMap {
    fn default() -> Self {
        Self::IDENTITY
    }
}

impl AxisMap {
    /// The tracker's axes are the head's.
    pub const IDENTITY: Self = Self { order: [0, 1, 2], invert: [false; 3] };
    /// All axes count the other way.
    pub const INVERTED: Self = Self { order: [0, 1, 2], invert: [true; 3] };

    /// The values along the head's axes of values along the tracker's.
    pub fn apply(&self, tracker: [f32; 3]) -> [f32; 3] {
        std::array::from_fn(|axis| {
            let value = tracker[usize::from(self.order[axis]).min(2)];
            if self.invert[axis] { -value } else { value }
        })
    }

    /// The vector part of a quaternion or a position, along x, y and z.
    pub(crate) fn apply_to(&self, tracker: Vec3) -> Vec3 {
        Vec3::from_array(self.apply(tracker.to_array()))
    }

    /// An orientation whose yaw, pitch and roll are taken for others.
    ///
    /// Yaw, pitch and roll turn about z, -y and x, so that the map does to a quaternion what it does to small angles.
    pub(crate) fn turn(&self, tracker: Quat) -> Quat {
        let [yaw, pitch, roll] = self.apply([tracker.z, -tracker.y, tracker.x]);
        let turned = Quat::from_xyzw(roll, -pitch, yaw, tracker.w);
        // Two of the head's axes may be given the same of the tracker's, and nothing be left.
        if turned.length() > 1e-3 { turned.normalize() } else { Quat::IDENTITY }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_core::Pose;

    #[test]
    fn a_quaternion_is_mapped_as_its_angles_are() {
        let map = AxisMap { order: [2, 0, 1], invert: [false, true, false] };
        for angles in [[0.3, 0.0, 0.0], [0.0, 0.3, 0.0], [0.0, 0.0, 0.3]] {
            let of = |[yaw, pitch, roll]: [f32; 3]| Pose::from_ypr(Vec3::ZERO, yaw, pitch, roll).orientation;
            let (found, wanted) = (map.turn(of(angles)), of(map.apply(angles)));
            assert!(found.dot(wanted).abs() > 1.0 - 1e-6, "{angles:?}: {found:?} {wanted:?}");
        }
    }

    #[test]
    fn a_map_that_drops_an_axis_still_gives_an_orientation() {
        let map = AxisMap { order: [0, 0, 0], invert: [false; 3] };
        assert_eq!(map.turn(Quat::from_xyzw(1.0, 0.0, 0.0, 0.0)), Quat::IDENTITY);
        assert!(map.turn(Quat::from_rotation_z(1.0)).is_normalized());
    }
}
