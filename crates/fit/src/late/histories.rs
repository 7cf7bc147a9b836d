//! One trace of rays, re-weighted for any absorption and scattering.
//!
//! The histories of rays (when each met which wall) are kept, so that the energy left after a time is a mean of products for
//! whatever the walls take, without tracing again.

use crate::error::FitError;
use crate::numerics::Random;
use crate::room::{FlatRoom, Form, Walls};
use promenade_acoustics::{Air, Material, Met, Room, reflections};

/// Rays of a trace.
const RAYS: usize = 768;
/// Share of reflections that are scattered while tracing. Directions depend little on it as long as there is some.
const SCATTERED: f64 = 0.3;

/// Number of the surface of what is lost.
const LOST: u16 = u16::MAX;

/// When rays met walls.
#[derive(Clone, Debug)]
pub struct Histories {
    /// Of each ray the times in bins and walls of its reflections.
    rays: Vec<Vec<(f32, u16)>>,
    /// Length of a bin, seconds.
    pub bin_s: f64,
    /// Bins of the energies.
    pub bins: usize,
    volume_m3: f64,
    /// The air in the room.
    pub air: Air,
}

/// What a wall does to energy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Share of the energy that is absorbed, 0 to 1.
    pub absorption: f64,
    /// Share of the reflected energy that is scattered, 0 to 1.
    pub scattering: f64,
}

impl Histories {
    /// Traces rays from a place for a time, seconds.
    #[must_use]
    pub fn of_box(walls: &Walls, air: Air, source_m: [f64; 3], bin_s: f64, length_s: f64, seed: u64) -> Self {
        let bins = (length_s / bin_s).ceil() as usize;
        let bin_m = bin_s * air.speed_m_s();
        let rays = (0..RAYS).map(|i| trace(walls, source_m, bin_m, bins, &mut Random::new(seed, i as u64))).collect();
        Self { rays, bin_s, bins, volume_m3: walls.volume_m3(), air }
    }

    /// Traces rays in any room of flat walls: surfaces are its own. What leaves through an opening is lost.
    ///
    /// # Errors
    /// A mesh that is none, a source that is not finite.
    pub fn of_room(
        room: &FlatRoom,
        air: Air,
        source_m: [f64; 3],
        bin_s: f64,
        length_s: f64,
        seed: u64,
    ) -> Result<Self, FitError> {
        let mesh = match &room.form {
            Form::Box(walls) => return Ok(Self::of_box(walls, air, source_m, bin_s, length_s, seed)),
            Form::Mesh(mesh) => mesh,
        };
        let bins = (length_s / bin_s).ceil() as usize;
        let ready = Room::new(mesh, &vec![Material::even("", 0.1, 0.1); mesh.groups.len()])?;
        let met = reflections(&ready, source_m, RAYS, length_s * air.speed_m_s(), SCATTERED, seed)?;
        let bin_m = bin_s * air.speed_m_s();
        let at = |m: &Met| ((m.way_m / bin_m) as f32, m.group.map_or(LOST, |g| g as u16));
        let rays = met.iter().map(|ray| ray.iter().map(at).collect()).collect();
        Ok(Self { rays, bin_s, bins, volume_m3: room.volume_m3(), air })
    }

    /// These rays for the first bins alone.
    #[must_use]
    pub(crate) fn first(&self, bins: usize) -> Self {
        let until = |ray: &Vec<(f32, u16)>| ray.iter().copied().take_while(|(at, _)| *at < bins as f32).collect();
        Self { rays: self.rays.iter().map(until).collect(), bins, ..*self }
    }

    /// Energy by bin of all sound but what mirrors alone have sent on up to `order` times, as the mean over the room, for a
    /// source whose direct sound has an energy of 1 at 1 m in the mean over directions; and of all sound.
    #[must_use]
    pub fn energies(&self, surfaces: &[Surface], order: u32, air_per_m: f64) -> [Vec<f64>; 2] {
        let (mut diffuse, mut whole) = (vec![0.0; self.bins], vec![0.0; self.bins]);
        for ray in &self.rays {
            let (mut left, mut mirrored, mut hits, mut bin) = (1.0, 1.0, 0, 0);
            let mut count = |to: usize, left: f64, mirrored: f64, hits: u32| {
                let share = if hits > order { 1.0 } else { 1.0 - mirrored };
                for b in bin..to.min(self.bins) {
                    whole[b] += left;
                    diffuse[b] += left * share;
                }
                bin = bin.max(to.min(self.bins));
            };
            for (at, wall) in ray {
                // A bin belongs to what holds in its middle.
                count((at + 0.5) as usize, left, mirrored, hits);
                let Some(surface) = surfaces.get(usize::from(*wall)) else {
                    left = 0.0;
                    break;
                };
                left *= 1.0 - surface.absorption;
                mirrored *= 1.0 - surface.scattering;
                hits += 1;
            }
            count(self.bins, left, mirrored, hits);
        }
        let bin_m = self.bin_s * self.air.speed_m_s();
        // One at a level of 1 at 1 m has 4 pi in all, which stays in a volume as long as sound takes through it.
        let level = 4.0 * std::f64::consts::PI * bin_m / self.volume_m3 / self.rays.len() as f64;
        for energies in [&mut diffuse, &mut whole] {
            for (bin, e) in energies.iter_mut().enumerate() {
                *e *= level * (-air_per_m * (bin as f64 + 0.5) * bin_m).exp();
            }
        }
        [diffuse, whole]
    }
}

fn trace(walls: &Walls, source_m: [f64; 3], bin_m: f64, bins: usize, random: &mut Random) -> Vec<(f32, u16)> {
    let mut heading = sphere(random);
    let mut at = source_m;
    let (mut time, mut hits) = (0.0, Vec::new());
    loop {
        let (mut nearest, mut wall) = (f64::INFINITY, 0);
        for a in 0..3 {
            let (way, w) = match heading[a] {
                d if d > 0.0 => ((walls.high_m[a] - at[a]) / d, 2 * a + 1),
                d if d < 0.0 => ((walls.low_m[a] - at[a]) / d, 2 * a),
                _ => continue,
            };
            if way < nearest {
                (nearest, wall) = (way, w);
            }
        }
        time += nearest.max(0.0) / bin_m;
        if !time.is_finite() || time >= bins as f64 {
            return hits;
        }
        hits.push((time as f32, wall as u16));
        let axis = wall / 2;
        for (a, coordinate) in at.iter_mut().enumerate() {
            *coordinate = (*coordinate + nearest * heading[a]).clamp(walls.low_m[a], walls.high_m[a]);
        }
        at[axis] = walls.wall_m(wall);
        if random.uniform() < SCATTERED {
            // Lambert's law: the normal and a point of the unit sphere about its end.
            let mut scattered = sphere(random);
            scattered[axis] += if wall.is_multiple_of(2) { 1.0 } else { -1.0 };
            let length = scattered.iter().map(|c| c * c).sum::<f64>().sqrt().max(1e-9);
            heading = scattered.map(|c| c / length);
        } else {
            heading[axis] = -heading[axis];
        }
    }
}

fn sphere(random: &mut Random) -> [f64; 3] {
    let z = 1.0 - 2.0 * random.uniform();
    let (sine, cosine) = (std::f64::consts::TAU * random.uniform()).sin_cos();
    let radius = (1.0 - z * z).max(0.0).sqrt();
    [radius * cosine, radius * sine, z]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn energy_decays_near_eyring_and_what_is_mirrored_is_left_out() {
        let walls = Walls::of_size([7.0, 5.0, 3.0]).unwrap();
        let trace = Histories::of_box(&walls, Air::default(), [2.0, 2.0, 1.5], 0.004, 1.0, 1);
        let [diffuse, whole] = trace.energies(&[Surface { absorption: 0.2, scattering: 0.3 }; 6], 4, 0.0);
        let (a, b) = (whole[25], whole[100]);
        let t60 = 6.0 * std::f64::consts::LN_10 * 75.0 * 0.004 / (a / b).ln();
        // Eyring: 55.3 / 343 * V / (S -ln(1 - alpha)).
        let eyring = 24.0 * std::f64::consts::LN_10 / 343.0 * 105.0 / (142.0 * -(0.8_f64.ln()));
        assert!((t60 / eyring - 1.0).abs() < 0.08, "{t60} {eyring}");
        assert!(diffuse[0] < 0.1 * whole[0] && (diffuse[100] / whole[100] - 1.0).abs() < 0.02);
        let [none, _] = trace.energies(&[Surface { absorption: 0.2, scattering: 0.0 }; 6], 1000, 0.0);
        assert!(none.iter().all(|e| *e == 0.0), "without scattering mirrors have it all");
    }
}
