//! What is known of a cloud's emitter besides what the network learnt.

use crate::Pose;
use crate::decode::field::NEAREST_M;
use glam::Vec3;

/// Speed of sound, m/s.
pub const SPEED_OF_SOUND_M_S: f32 = 343.0;
/// Mean radius of a head, metres.
pub const HEAD_RADIUS_M: f32 = 0.0875;

/// Shapes of an interaural delay over directions: see [`CloudEmitter::delay_shapes`].
pub const DELAY_SHAPES: usize = 6;

/// An emitter whose place is known: masks are stated for 1 m, and the ears differ in time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CloudEmitter {
    /// Position in the scene's world, metres.
    pub position: Vec3,
    /// Radius of the listener's head, metres; 0 for no interaural delay.
    pub head_radius_m: f32,
    /// How the head's interaural delay differs from a sphere's: factors of [`Self::delay_shapes`], milliseconds.
    pub delay_shape_ms: [f32; DELAY_SHAPES],
}

impl CloudEmitter {
    /// With a sphere for a head; a radius of 0 for no interaural delay.
    #[must_use]
    pub fn with_sphere(position: Vec3, head_radius_m: f32) -> Self {
        Self { position, head_radius_m, delay_shape_ms: [0.0; DELAY_SHAPES] }
    }
}

impl CloudEmitter {
    /// Gain of the direct sound by distance, 1 at 1 m and held within [`NEAREST_M`].
    #[must_use]
    pub fn gain(&self, listener: &Pose) -> f32 {
        1.0 / listener.position.distance(self.position).max(NEAREST_M)
    }

    /// Interaural delay, seconds, positive = left ear later: that of a rigid sphere (Woodworth 1938), the path round the head
    /// to the far ear, `radius (sin a + a) / c` at a lateral angle a; and what the head's shape adds to it.
    #[must_use]
    pub fn delay_s(&self, listener: &Pose) -> f32 {
        let to_left = self.direction(listener).y.clamp(-1.0, 1.0);
        let sphere = -self.head_radius_m / SPEED_OF_SOUND_M_S * (to_left.asin() + to_left);
        let shape: f32 =
            self.delay_shapes(listener).iter().zip(self.delay_shape_ms).map(|(shape, factor)| shape * factor).sum();
        sphere + 1e-3 * shape
    }

    /// The shapes that make up a head's delay besides a sphere's, at the emitter's direction (x, y, z) seen from the head: y
    /// times 1, x, z, x^2, z^2, x z, which together are the spherical harmonics up to degree 3 that change sign between the
    /// ears.
    #[must_use]
    pub fn delay_shapes(&self, listener: &Pose) -> [f32; DELAY_SHAPES] {
        let Vec3 { x, y, z } = self.direction(listener);
        [1.0, x, z, x * x, z * z, x * z].map(|shape| y * shape)
    }

    fn direction(&self, listener: &Pose) -> Vec3 {
        listener.to_head(self.position).normalize_or_zero()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_source_on_the_left_reaches_the_right_ear_later() {
        let emitter = CloudEmitter::with_sphere(Vec3::new(0.0, 2.0, 0.0), 0.0875);
        assert!((emitter.delay_s(&Pose::IDENTITY) + 656e-6).abs() < 2e-6);
        assert_eq!(emitter.gain(&Pose::IDENTITY), 0.5);
        let at_emitter = Pose { position: emitter.position, ..Pose::IDENTITY };
        assert_eq!((emitter.delay_s(&at_emitter), emitter.gain(&at_emitter)), (0.0, 4.0));
        // A head that is later by 0.1 ms on the far side, and by twice that where the emitter is above.
        let shaped = CloudEmitter { delay_shape_ms: [-0.1, 0.0, -0.1, 0.0, 0.0, 0.0], ..emitter };
        assert!((shaped.delay_s(&Pose::IDENTITY) + 756e-6).abs() < 2e-6);
        let below = Pose { position: Vec3::new(0.0, 0.0, -2.0), ..Pose::IDENTITY };
        let [sphere, shaped] = [emitter, shaped].map(|e| e.delay_s(&below));
        assert!((shaped - sphere + 1e-4 * (0.5_f32.sqrt() + 0.5)).abs() < 1e-7);
    }
}
