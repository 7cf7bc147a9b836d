//! Where the listener is and which way the head faces.

use glam::{DQuat, EulerRot, Quat, Vec3};

/// Listener pose: position in metres and head orientation.
///
/// World axes are right-handed with z up. Head axes are x forward, y left, z up (AES69-2022, "local coordinate system").
/// `orientation` rotates head axes into world axes and has unit length.
///
/// ```
/// use promenade_core::Pose;
/// use glam::Vec3;
/// let quarter_left = Pose::from_ypr(Vec3::ZERO, std::f32::consts::FRAC_PI_2, 0.0, 0.0);
/// // After turning left by 90 degrees, what was ahead is on the right (negative y).
/// assert!((quarter_left.to_head(Vec3::X) - Vec3::NEG_Y).length() < 1e-6);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Head centre in the world, metres.
    pub position: Vec3,
    /// Rotation from head axes to world axes, unit quaternion.
    pub orientation: Quat,
}

impl Pose {
    /// At the world's origin, facing +x.
    pub const IDENTITY: Self = Self { position: Vec3::ZERO, orientation: Quat::IDENTITY };

    /// The farthest that a head may be from the origin along each axis, metres: squares of distances stay far from the largest
    /// number.
    pub const FARTHEST_M: f32 = 1e12;

    /// Pose from yaw, pitch and roll in radians, applied in that order about the head's own axes.
    ///
    /// Yaw is positive to the left, pitch positive nose up, roll positive right ear down.
    #[must_use]
    pub fn from_ypr(position: Vec3, yaw: f32, pitch: f32, roll: f32) -> Self {
        Self::from_ypr64(position, [yaw, pitch, roll].map(f64::from))
    }

    /// A pose from yaw, pitch and roll, radians, in double precision: the rotation is rounded once, at the end.
    #[must_use]
    pub fn from_ypr64(position: Vec3, [yaw, pitch, roll]: [f64; 3]) -> Self {
        // Nose up is a negative right-hand turn about y (left).
        let orientation = DQuat::from_euler(EulerRot::ZYX, yaw, -pitch, roll).normalize();
        Self { position, orientation: orientation.as_quat() }
    }

    /// Yaw, pitch and roll in radians; the inverse of [`Pose::from_ypr`] with pitch in [-pi/2, pi/2].
    #[must_use]
    pub fn ypr(&self) -> (f32, f32, f32) {
        let (yaw, pitch, roll) = self.orientation.to_euler(EulerRot::ZYX);
        (yaw, -pitch, roll)
    }

    /// A world point, metres, as seen from the head: metres along forward, left, up.
    #[must_use]
    pub fn to_head(&self, world: Vec3) -> Vec3 {
        self.orientation.inverse() * (world - self.position)
    }

    /// The pose at a share of the way to another, 0 to 1: places along the line between them, orientations along the shorter
    /// arc.
    #[must_use]
    pub fn toward(&self, to: &Self, share: f32) -> Self {
        Self {
            position: self.position.lerp(to.position, share),
            orientation: self.orientation.slerp(to.orientation, share).normalize(),
        }
    }

    /// Whether every component is finite, the position within [`Pose::FARTHEST_M`], and the orientation of unit length within
    /// 1e-3.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let near = self.position.abs().cmple(Vec3::splat(Self::FARTHEST_M)).all();
        near && self.orientation.is_finite() && (self.orientation.length() - 1.0).abs() < 1e-3
    }
}

impl Default for Pose {
    fn default() -> Self {
        Self::IDENTITY
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::FRAC_PI_2;

    #[test]
    fn pitch_up_lowers_what_was_ahead() {
        let up = Pose::from_ypr(Vec3::ZERO, 0.0, 0.5, 0.0);
        assert!(up.to_head(Vec3::X).z < -0.4);
        assert!((up.orientation * Vec3::X).z > 0.4, "the nose points up");
    }

    #[test]
    fn roll_puts_the_right_ear_down() {
        let rolled = Pose::from_ypr(Vec3::ZERO, 0.0, 0.0, FRAC_PI_2);
        let right_ear = rolled.orientation * Vec3::NEG_Y;
        assert!((right_ear - Vec3::NEG_Z).length() < 1e-6);
    }

    #[test]
    fn angles_survive_the_round_trip() {
        for &(y, p, r) in &[(0.3, -0.2, 0.1), (-3.0, 1.2, -2.0), (1.5, 0.0, 3.0)] {
            let back = Pose::from_ypr(Vec3::ZERO, y, p, r).ypr();
            assert!((back.0 - y).abs() < 1e-5 && (back.1 - p).abs() < 1e-5 && (back.2 - r).abs() < 1e-5, "{back:?}");
        }
    }

    #[test]
    fn degrees_lose_nothing_but_the_last_rounding() {
        // How far an anchor ten metres away moves in the head's frame, against double precision throughout.
        let mut worst = [0.0_f64; 2];
        for i in 0..2_000 {
            let degrees =
                [0.07, 0.13, 0.19].map(|step| ((f64::from(i) * step * 100.0).round() / 100.0).rem_euclid(360.0) - 180.0);
            let [y, p, r] = degrees.map(f64::to_radians);
            let exact = DQuat::from_euler(EulerRot::ZYX, y, -p, r) * glam::DVec3::new(10.0, 3.0, -2.0);
            let [yaw, pitch, roll] = degrees.map(|d| (d as f32).to_radians());
            let poses =
                [Quat::from_euler(EulerRot::ZYX, yaw, -pitch, roll), Pose::from_ypr64(Vec3::ZERO, [y, p, r]).orientation];
            for (worst, q) in worst.iter_mut().zip(poses) {
                *worst = worst.max((q.as_dquat() * glam::DVec3::new(10.0, 3.0, -2.0) - exact).length());
            }
        }
        println!("single precision throughout {:.1e} m, rounded once {:.1e} m", worst[0], worst[1]);
        assert!(worst[1] < 3e-6 && worst[0] > 1.5 * worst[1], "{worst:?}");
    }

    #[test]
    fn what_is_farther_than_squares_can_tell_is_no_pose() {
        let at = |x| Pose { position: Vec3::new(0.0, x, 0.0), ..Pose::IDENTITY };
        assert!(at(-1e9).is_valid() && at(Pose::FARTHEST_M).is_valid());
        for x in [1e20, -1e20, f32::INFINITY, f32::NAN] {
            assert!(!at(x).is_valid(), "{x}");
        }
    }
}
