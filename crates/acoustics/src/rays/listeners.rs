//! Spheres that collect rays.

use crate::error::{AcousticsError, place};
use crate::room::Room;
use crate::room::ray::Ray;
use glam::DVec3;

/// Least radius, as a share of the one asked for: right at a wall part of a sphere is behind it.
const LEAST_RADIUS: f64 = 0.2;
/// Listeners that are compared with a ray together.
const BLOCK: usize = 16;

/// Places and radii of all spheres, in blocks.
pub(super) struct Listeners {
    places: Vec<DVec3>,
    /// Single precision counts from here.
    origin: DVec3,
    blocks: Vec<Block>,
}

#[derive(Clone, Copy)]
struct Block {
    x: [f32; BLOCK],
    y: [f32; BLOCK],
    z: [f32; BLOCK],
    /// Squares of the radii; below 0 where there is no listener.
    radius2: [f32; BLOCK],
}

impl Listeners {
    pub(super) fn new(room: &Room, places: &[[f64; 3]], radius: f64) -> Result<Self, AcousticsError> {
        let origin = room.centre();
        let empty = Block { x: [0.0; BLOCK], y: [0.0; BLOCK], z: [0.0; BLOCK], radius2: [-1.0; BLOCK] };
        let mut blocks = vec![empty; places.len().div_ceil(BLOCK)];
        let mut exact = Vec::with_capacity(places.len());
        for (i, at) in places.iter().enumerate() {
            let at = place(&format!("listener {i}"), *at)?;
            exact.push(at);
            let clear = room.surroundings(at.to_array())?.clearance_m;
            let radius = radius.min(clear).max(LEAST_RADIUS * radius);
            let block = &mut blocks[i / BLOCK];
            let [x, y, z] = (at - origin).as_vec3().to_array();
            (block.x[i % BLOCK], block.y[i % BLOCK], block.z[i % BLOCK]) = (x, y, z);
            block.radius2[i % BLOCK] = (radius * radius) as f32;
        }
        Ok(Self { places: exact, origin, blocks })
    }

    pub(super) fn count(&self) -> usize {
        self.places.len()
    }

    pub(super) fn place(&self, listener: usize) -> DVec3 {
        self.places[listener]
    }

    /// Calls for each sphere whose middle a ray passes on its next `length` metres, near enough: the listener's number, how far
    /// along the ray it is passed, metres, and the area of the sphere's disc, square metres.
    #[inline]
    pub(super) fn crossed(&self, ray: &Ray, length: f64, mut crossed: impl FnMut(usize, f64, f64)) {
        let [ox, oy, oz] = (ray.origin - self.origin).as_vec3().to_array();
        let [dx, dy, dz] = ray.direction.as_vec3().to_array();
        let length = length as f32;
        for (number, block) in self.blocks.iter().enumerate() {
            let mut along = [0.0_f32; BLOCK];
            let mut any = false;
            let mut inside = [false; BLOCK];
            for i in 0..BLOCK {
                let (x, y, z) = (block.x[i] - ox, block.y[i] - oy, block.z[i] - oz);
                let t = x * dx + y * dy + z * dz;
                let off2 = x * x + y * y + z * z - t * t;
                along[i] = t;
                inside[i] = (off2 < block.radius2[i]) & (t >= 0.0) & (t < length);
                any |= inside[i];
            }
            if any {
                for i in (0..BLOCK).filter(|i| inside[*i]) {
                    let area = std::f64::consts::PI * f64::from(block.radius2[i]);
                    crossed(number * BLOCK + i, f64::from(along[i]), area);
                }
            }
        }
    }
}
