//! The emitter's images in the walls.

use super::BoxRoom;
use promenade_core::glam::Vec3;
use promenade_fourier::num_complex::Complex32;

/// An image by the number of rooms that it lies away along each axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Image {
    rooms: [i32; 3],
}

/// All images that have met at most `order` walls, the emitter itself first.
pub(super) fn images(order: u32) -> Vec<Image> {
    let reach = order.cast_signed();
    let axis = || -reach..=reach;
    let all = axis().flat_map(|x| axis().flat_map(move |y| axis().map(move |z| Image { rooms: [x, y, z] })));
    let mut images: Vec<Image> = all.filter(|i| i.order() <= order).collect();
    images.sort_by_key(Image::order);
    images
}

impl Image {
    /// Walls that it has met.
    pub(super) fn order(&self) -> u32 {
        self.rooms.iter().map(|n| n.unsigned_abs()).sum()
    }

    /// Where it lies, for an emitter in the room from the origin to `size`.
    pub(super) fn position(&self, emitter: Vec3, size: Vec3) -> Vec3 {
        let axis = |a: usize| {
            let n = self.rooms[a];
            let within = if n % 2 == 0 { emitter[a] } else { size[a] - emitter[a] };
            n as f32 * size[a] + within
        };
        Vec3::new(axis(0), axis(1), axis(2))
    }

    /// How often it has met each wall: beyond an odd number, once more the one on its own side.
    pub(super) fn hits(&self) -> [u32; 6] {
        let [x, y, z] = self.rooms.map(|n| {
            let m = n.unsigned_abs();
            [(m + u32::from(n < 0)) / 2, (m + u32::from(n > 0)) / 2]
        });
        [x[0], x[1], y[0], y[1], z[0], z[1]]
    }

    /// What its walls leave of the energy, in an octave.
    pub(super) fn energy(&self, room: &BoxRoom, octave: usize) -> f64 {
        let hits = self.hits();
        let left = |(a, n): (&super::Absorption, u32)| f64::from(1.0 - a[octave]).powi(n as i32);
        room.absorption.iter().zip(hits).map(left).product()
    }

    /// What its walls leave of the amplitude, by bin, from the complex logarithms of the walls.
    pub(super) fn spectrum(&self, walls: &[Vec<Complex32>; 6]) -> Vec<Complex32> {
        let bins = walls[0].len();
        let hits = self.hits();
        (0..bins).map(|k| walls.iter().zip(hits).map(|(w, n)| w[k] * n as f32).sum::<Complex32>().exp()).collect()
    }
}
