//! What is known of a cloud's emitter besides what the network learnt.

use crate::Pose;
use crate::decode::field::NEAREST_M;
use glam::Vec3;

/// Speed of sound, m/s.
pub const SPEED_OF_SOUND_M_S: f32 = 343.0;
/// Mean radius of a head, metres.
pub const HEAD_RADIUS_M: f32 = 0.0875;

/// An emitter whose place is known: masks are stated for 1 m, and the ears differ in time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CloudEmitter {
    /// Position in the scene's world, metres.
    pub position: Vec3,
    /// Radius of the listener's head, metres; 0 for no interaural delay.
    pub head_radius_m: f32,
}

impl CloudEmitter {
    /// Gain of the direct sound by distance, 1 at 1 m and held within [`NEAREST_M`].
    #[must_use]
    pub fn gain(&self, listener: &Pose) -> f32 {
        1.0 / listener.position.distance(self.position).max(NEAREST_M)
    }

    /// Interaural delay of a rigid sphere, seconds, positive = left ear later (Woodworth 1938): the path round the head to the far
    /// ear, `radius (sin a + a) / c` at a lateral angle a.
    #[must_use]
    pub fn delay_s(&self, listener: &Pose) -> f32 {
        let to_left = listener.to_head(self.position).normalize_or_zero().y.clamp(-1.0, 1.0);
        -self.head_radius_m / SPEED_OF_SOUND_M_S * (to_left.asin() + to_left)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_source_on_the_left_reaches_the_right_ear_later() {
        let emitter = CloudEmitter { position: Vec3::new(0.0, 2.0, 0.0), head_radius_m: 0.0875 };
        assert!((emitter.delay_s(&Pose::IDENTITY) + 656e-6).abs() < 2e-6);
        assert_eq!(emitter.gain(&Pose::IDENTITY), 0.5);
        let at_emitter = Pose { position: emitter.position, ..Pose::IDENTITY };
        assert_eq!((emitter.delay_s(&at_emitter), emitter.gain(&at_emitter)), (0.0, 4.0));
    }
}
