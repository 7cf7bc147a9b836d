//! Early reflections that image sources play in the place of measured responses.

use glam::Vec3;

/// How far from where a response was measured its reflections are all the images', metres.
const WALKED_M: f32 = 0.3;

/// What measured responses lose of their early reflections as the listener leaves where they were measured, and the scene's
/// images play instead. At a measured place responses are heard whole, and images not at all.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lifted {
    /// Listener positions that were measured, metres.
    pub places: Vec<Vec3>,
    /// What is taken off, at the scene's rate, `[response][ear][hop * sample]`, of as many hops as reflections are early, the
    /// first hop at a distance of 1 m, as [`MeasuredRoom::samples`](super::MeasuredRoom::samples).
    pub samples: Vec<f32>,
}

impl Lifted {
    /// How far a listener is away from the places, 0 to 1.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    #[must_use]
    pub fn away(&self, position: Vec3) -> f32 {
        let nearest = self.places.iter().map(|place| place.distance_squared(position)).fold(f32::INFINITY, f32::min);
        let along = (nearest.sqrt() / WALKED_M).clamp(0.0, 1.0);
        along * along * (3.0 - 2.0 * along)
    }

    /// Gain of the images for a listener who is so far away: with what responses have left of a reflection they make up its
    /// energy.
    pub(crate) fn images_gain(away: f32) -> f32 {
        (away * (2.0 - away)).max(0.0).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_a_place_nothing_is_lifted_and_a_step_away_all_is() {
        let lifted = Lifted { places: vec![Vec3::ZERO, Vec3::X], samples: Vec::new() };
        for (x, away) in [(0.0, 0.0), (0.15, 0.5), (0.5, 1.0), (0.85, 0.5), (1.0, 0.0), (7.0, 1.0)] {
            assert!((lifted.away(Vec3::new(x, 0.0, 0.0)) - away).abs() < 1e-5, "{x}");
        }
        assert_eq!(lifted.away(Vec3::NAN), 1.0);
        let left: f32 = 1.0 - 0.3;
        assert!((left * left + Lifted::images_gain(0.3).powi(2) - 1.0).abs() < 1e-6);
    }
}
