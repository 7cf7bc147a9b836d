//! How much sound falls on what a camera sees: particles that rays leave wherever they meet a surface, and the density of their
//! energy (Harvey, Debattista, Bashford-Rogers and Chalmers, "Multi-modal perception for selective rendering", Computer
//! Graphics Forum 2017, after Jensen's photon map).

use crate::directivity::source::Source;
use crate::error::{AcousticsError, place};
use crate::octave::BANDS;
use crate::rays::late_field::{RayOptions, particles};
use crate::room::Room;
use crate::room::ray::Ray;
use glam::DVec3;
use rstar::RTree;
use rstar::primitives::GeomWithData;
use std::f64::consts::PI;

/// Particles whose density is taken.
const NEAREST: usize = 100;
/// Most particles.
const MOST: usize = 1 << 26;

/// A particle: its place, metres, and its power, the mean of all octaves.
type Particle = GeomWithData<[f32; 3], f32>;

/// The sound on a room's surfaces, for any camera.
pub struct Intensity<'a> {
    room: &'a Room,
    /// Particles on each plane: what lies on another wall is not near.
    planes: Vec<RTree<Particle>>,
}

/// What is seen in a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// Metres from the camera.
    pub distance_m: f64,
    /// Energy that falls on it, once and again, over that of the direct sound at 1 m from the source: the mean of all octaves.
    pub intensity: f64,
    /// Number of the plane that it lies in.
    pub plane: u32,
}

impl<'a> Intensity<'a> {
    /// Lets the rays of a source fall on all surfaces, the direct sound among them. Neither images nor listeners matter.
    ///
    /// # Errors
    /// A source that is not finite, an option out of range, or more than some 67 million particles.
    pub fn new(room: &'a Room, source: impl Into<Source>, options: &RayOptions<'_>) -> Result<Self, AcousticsError> {
        let options = RayOptions { images: None, ..*options };
        let mut planes: Vec<Vec<Particle>> = room.planes().iter().map(|_| Vec::new()).collect();
        let mut count = 0;
        particles(room, &source.into(), &options, |at, plane, lanes| {
            count += 1;
            if count <= MOST {
                let power = lanes[..BANDS].iter().sum::<f32>() / BANDS as f32;
                planes[plane as usize].push(Particle::new((at - room.centre()).as_vec3().to_array(), power));
            }
        })?;
        if count > MOST {
            return Err(AcousticsError::argument(
                "particles",
                "at most 67108864: fewer rays, or shorter ones",
                count.to_string(),
            ));
        }
        Ok(Self { room, planes: planes.into_iter().map(RTree::bulk_load).collect() })
    }

    /// What is seen from a place in a direction of any length; none where the room is open.
    ///
    /// # Errors
    /// A place that is not finite.
    pub fn seen(&self, from: [f64; 3], direction: [f64; 3]) -> Result<Option<Seen>, AcousticsError> {
        let from = place("camera", from)?;
        let Some(direction) = DVec3::from_array(direction).try_normalize() else { return Ok(None) };
        let ray = Ray::new(from, direction);
        let Some(hit) = ray.cast(self.room) else { return Ok(None) };
        let at = (ray.at(hit.distance) - self.room.centre()).as_vec3().to_array();
        let plane = self.room.plane(hit.face);
        let tree = &self.planes[plane as usize];
        let (mut power, mut moment, mut reach2) = (0.0, 0.0, 0.0_f64);
        for (particle, distance2) in tree.nearest_neighbor_iter_with_distance_2(at).take(NEAREST) {
            reach2 = f64::from(distance2);
            power += f64::from(particle.data);
            moment += f64::from(particle.data) * reach2;
        }
        // Epanechnikov's kernel over the disc that holds them, which has no edge. A wall that was hardly met has no density.
        let dense = tree.size() >= NEAREST && reach2 > 0.0;
        let intensity = if dense { 2.0 * (power - moment / reach2) / (PI * reach2) } else { 0.0 };
        Ok(Some(Seen { distance_m: hit.distance, intensity, plane }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Material, Shoebox};

    const SIZE: [f64; 3] = [6.0, 5.0, 3.0];
    const SOURCE: [f64; 3] = [2.0, 2.0, 1.5];

    fn room(absorption: f32) -> Room {
        let walls = Shoebox { size: SIZE, materials: [(); 6].map(|()| Material::even("wall", absorption, 0.5)) };
        Room::new(&walls.mesh().unwrap(), &walls.materials).unwrap()
    }

    fn options(rays: usize) -> RayOptions<'static> {
        RayOptions { rays, length_s: 2.0, air: None, ..RayOptions::default() }
    }

    #[test]
    fn walls_that_take_everything_hear_the_direct_sound_alone() {
        let room = room(1.0);
        let intensity = Intensity::new(&room, SOURCE, &options(200_000)).unwrap();
        for point in [[6.0, 2.0, 1.5], [6.0, 3.5, 1.0], [3.0, 3.0, 0.0], [2.0, 5.0, 2.0]] {
            let way = DVec3::from_array(point) - DVec3::from_array(SOURCE);
            let seen = intensity.seen(SOURCE, way.to_array()).unwrap().unwrap();
            assert!((seen.distance_m - way.length()).abs() < 1e-9);
            // What falls on a wall falls on it at an angle.
            let normal = (0..3).find(|&i| point[i] == 0.0 || point[i] == SIZE[i]).unwrap();
            let expected = (way[normal].abs() / way.length()) / way.length_squared();
            assert!((seen.intensity / expected - 1.0).abs() < 0.25, "{point:?}: {} of {expected}", seen.intensity);
        }
    }

    #[test]
    fn all_that_falls_on_all_walls_is_what_was_sent_and_sent_again() {
        let room = room(0.25);
        let intensity = Intensity::new(&room, SOURCE, &options(100_000)).unwrap();
        let (mut sum, mut count) = (0.0, 0);
        // A middle of each wall's parts, as seen from the middle of the room.
        let middle = DVec3::from_array(SIZE) / 2.0;
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for side in [0.0, 1.0] {
                for i in 0..144 {
                    let mut point = DVec3::ZERO;
                    point[axis] = side * SIZE[axis];
                    (point[u], point[v]) = (SIZE[u] * ((i % 12) as f64 + 0.5) / 12.0, SIZE[v] * ((i / 12) as f64 + 0.5) / 12.0);
                    let seen = intensity.seen(middle.to_array(), (point - middle).to_array()).unwrap().unwrap();
                    sum += seen.intensity * SIZE[u] * SIZE[v] / 144.0;
                    count += 1;
                }
            }
        }
        // The source sends out 4 pi, and what comes falls 1 / absorption times.
        let expected = 4.0 * PI / 0.25;
        assert!(count == 864 && (sum / expected - 1.0).abs() < 0.05, "{sum} of {expected}");
    }

    #[test]
    fn what_cannot_be_is_an_error_and_nothing_is_seen_in_no_direction() {
        let room = room(0.5);
        assert!(Intensity::new(&room, [f64::NAN; 3], &options(10)).is_err());
        assert!(Intensity::new(&room, SOURCE, &options(0)).is_err());
        let intensity = Intensity::new(&room, SOURCE, &options(10)).unwrap();
        assert!(intensity.seen([f64::INFINITY; 3], [1.0, 0.0, 0.0]).is_err());
        assert_eq!(intensity.seen(SOURCE, [0.0; 3]).unwrap(), None);
        assert_eq!(intensity.seen(SOURCE, [1.0, 0.0, 0.0]).unwrap().unwrap().intensity, 0.0, "ten rays are no density");
    }
}
