//! Where the listener is and which way the head faces.

use glam::{EulerRot, Quat, Vec3};

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

    /// Pose from yaw, pitch and roll in radians, applied in that order about the head's own axes.
    ///
    /// Yaw is positive to the left, pitch positive nose up, roll positive right ear down.
    #[must_use]
    pub fn from_ypr(position: Vec3, yaw: f32, pitch: f32, roll: f32) -> Self {
        // Nose up is a negative right-hand turn about y (left).
        Self { position, orientation: Quat::from_euler(EulerRot::ZYX, yaw, -pitch, roll).normalize() }
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

    /// Whether every component is finite and the orientation has unit length within 1e-3.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        self.position.is_finite() && self.orientation.is_finite() && (self.orientation.length() - 1.0).abs() < 1e-3
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
}
