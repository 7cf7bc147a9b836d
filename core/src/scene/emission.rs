//! What an emitter sends in each direction.

use crate::Axis;
use crate::octave::Octaves;
use glam::{Mat3, Vec3};

/// What an emitter sends in each direction, as direct sound and image sources leave it.
#[derive(Clone, Debug, PartialEq)]
pub struct Emission {
    /// Directions of the world: elevations from straight down to straight up, and azimuths all around, radians.
    pub elevation: Axis,
    /// See [`Emission::elevation`].
    pub azimuth: Axis,
    /// Natural logarithms of the amplitudes in each direction, over what gains are stated for, `[elevation][azimuth]`.
    pub levels: Vec<Octaves>,
    /// For each image the turn, or mirror, that makes the way from it to a listener the way on which its sound has left the
    /// emitter.
    pub turns: Vec<Mat3>,
}

impl Emission {
    /// What is sent along a way, natural logarithms of amplitudes.
    pub(crate) fn towards(&self, way: Vec3) -> Octaves {
        let way = way.try_normalize().unwrap_or(Vec3::X);
        let (up, ups) = self.elevation.linear(way.z.clamp(-1.0, 1.0).asin());
        let (around, arounds) = self.azimuth.linear(way.y.atan2(way.x));
        let mut sum = Octaves::default();
        for (i, a) in &up[..ups] {
            for (j, b) in &around[..arounds] {
                let levels = &self.levels[i * self.azimuth.count() + j];
                sum.iter_mut().zip(levels).for_each(|(sum, level)| *sum += a * b * level);
            }
        }
        sum
    }

    /// What is sent to an image that a listener sees along a way from it, as [`Emission::towards`].
    pub(crate) fn of_image(&self, image: usize, way: Vec3) -> Octaves {
        self.towards(self.turns.get(image).map_or(way, |turn| *turn * way))
    }

    /// Bytes in memory.
    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(&*self.levels) + size_of_val(&*self.turns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::octave::OCTAVES;
    use std::f32::consts::{FRAC_PI_2, PI};

    #[test]
    fn an_image_has_what_leaves_towards_its_wall() {
        // One neper ahead, along x, and less by the angle's cosine to either side.
        let (elevation, azimuth) = (Axis::uniform(-FRAC_PI_2, FRAC_PI_2 / 9.0, 19), Axis::circle(-PI, 36));
        let level = |up: &f32, around: &f32| [up.cos() * around.cos(); OCTAVES];
        let levels = elevation.nodes().iter().flat_map(|up| azimuth.nodes().iter().map(move |a| level(up, a)));
        let levels = levels.collect();
        let mirror = Mat3::from_diagonal(Vec3::new(-1.0, 1.0, 1.0));
        let emission = Emission { elevation, azimuth, levels, turns: vec![mirror] };
        for (x, y, z) in [(2.0, 0.0, 0.0), (-0.3, 0.4, 0.1), (0.0, -1.0, 5.0), (1.0, 1.0, -1.0)] {
            let way = Vec3::new(x, y, z);
            let want = x / way.length();
            assert!((emission.towards(way)[2] - want).abs() < 0.02, "{way}: {}", emission.towards(way)[2]);
            assert!((emission.of_image(0, way)[2] + want).abs() < 0.02, "{way}: {}", emission.of_image(0, way)[2]);
        }
    }
}
