//! The energy in a box that played images do not have: particles that fly from wall to wall and are counted where they are.
//!
//! A box needs no search for the next wall, and counting all particles at even times measures the density of energy everywhere
//! at once (Schroeder 2011, "Physically based real-time auralization", chapter 5, with cells in the place of spheres).

use crate::directivity::lattice::{direction, lambert};
use crate::error::{AcousticsError, place};
use crate::images::shoebox::{BoxImage, Shoebox};
use crate::materials::air::{Air, speed_m_s};
use crate::rays::echogram::{Echogram, LANES, Lanes, lanes_decay_per_m};
use crate::rays::surface::Surface;
use glam::DVec3;
use promenade_core::random::Random;

/// A particle that has less of its energy than this, in every octave, is left: 80 dB.
const LEAST_ENERGY: f32 = 1e-8;
/// Largest number of bins of all cells.
const MOST_BINS: f64 = 1e6;

/// How particles are counted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParticleOptions {
    /// Particles from the source.
    pub particles: usize,
    /// How long they fly, seconds.
    pub length_s: f64,
    /// Time from one count to the next, seconds.
    pub bin_s: f64,
    /// Cells along x, y and z.
    pub cells: [usize; 3],
    /// What the air takes.
    pub air: Option<Air>,
    /// Seed of scattering.
    pub seed: u64,
}

/// Images that are played, by the number of rooms that they lie away.
struct Played {
    reach: i32,
    /// `[z][y][x]`.
    held: Vec<bool>,
}

impl Played {
    fn new(images: &[BoxImage]) -> Self {
        let reach = images.iter().flat_map(|i| i.rooms).map(i32::abs).max().unwrap_or(0);
        let side = 2 * reach as usize + 1;
        let mut played = Self { reach, held: vec![false; side.pow(3)] };
        for image in images {
            if let Some(place) = played.place(image.rooms) {
                played.held[place] = true;
            }
        }
        played
    }

    fn place(&self, rooms: [i32; 3]) -> Option<usize> {
        let side = 2 * self.reach + 1;
        let inside = rooms.iter().all(|n| n.abs() <= self.reach);
        inside.then(|| rooms.iter().rev().fold(0, |sum, n| sum * side as usize + (n + self.reach) as usize))
    }

    /// Whether a particle that was never scattered and has crossed so many walls of the unfolded box, with its direction's
    /// signs, is sound of an image that is played: after an even number along an axis the last wall was that on the side that
    /// it flies away from.
    fn has(&self, crossed: [i32; 3]) -> bool {
        let image = crossed.map(|m| if m % 2 == 0 { -m } else { m });
        self.place(image).is_some_and(|place| self.held[place])
    }
}

impl Shoebox {
    /// Energy over time in each cell, `[z][y][x]`, of all sound of a source but that of the `played` images of
    /// [`Reflected::Specular`](crate::Reflected::Specular). The same input and seed give the same numbers.
    ///
    /// # Errors
    /// A box or a source as in [`Shoebox::images`], an option out of range.
    pub fn late_field(
        &self,
        source: [f64; 3],
        played: &[BoxImage],
        options: &ParticleOptions,
    ) -> Result<Vec<Echogram>, AcousticsError> {
        self.check()?;
        self.check_source(source)?;
        let cells: usize = options.cells.iter().product();
        let bins = (options.length_s / options.bin_s).ceil();
        if !(options.bin_s > 0.0 && options.length_s > 0.0 && cells > 0 && bins * cells as f64 <= MOST_BINS) {
            let found = format!("{} s in bins of {} s, {cells} cells", options.length_s, options.bin_s);
            return Err(AcousticsError::argument("length of echograms", "above 0 s and at most a million bins", found));
        }
        if !(1..=1 << 24).contains(&options.particles) {
            return Err(AcousticsError::argument("particles", "1 to 16777216", options.particles));
        }
        let mut flight = Flight {
            size: self.size.into(),
            source: place("source", source)?,
            surfaces: self.materials.each_ref().map(Surface::new),
            played: Played::new(played),
            options,
            bins: bins as usize,
            found: vec![Lanes::default(); cells * bins as usize],
        };
        (0..options.particles).for_each(|index| flight.follow(index));
        let decay = lanes_decay_per_m(options.air);
        // Within a volume, energy stays as long as sound takes through it: one at a level of 1 at 1 m has 4 pi in all.
        let volume = self.size.iter().product::<f64>() / cells as f64;
        let level = 4.0 * std::f64::consts::PI / options.particles as f64 * speed_m_s(options.air) * options.bin_s / volume;
        let left = |bin: usize, band: usize| {
            let way = (bin as f64 + 0.5) * options.bin_s * speed_m_s(options.air);
            (level * (-decay[band] * way).exp()) as f32
        };
        Ok(flight.found.chunks(flight.bins).map(|bins| Echogram::new(options.bin_s, bins, left)).collect())
    }
}

struct Flight<'a> {
    size: DVec3,
    source: DVec3,
    surfaces: [Surface; 6],
    played: Played,
    options: &'a ParticleOptions,
    bins: usize,
    /// `[cell][bin]`.
    found: Vec<Lanes>,
}

impl Flight<'_> {
    /// The axis of the wall that a particle meets next, and metres to it.
    fn next_wall(&self, at: DVec3, heading: DVec3) -> (usize, f64) {
        let ways: [f64; 3] = std::array::from_fn(|a| match heading[a] {
            d if d > 0.0 => (self.size[a] - at[a]) / d,
            d if d < 0.0 => -at[a] / d,
            _ => f64::INFINITY,
        });
        let axis = if ways[0] <= ways[1] && ways[0] <= ways[2] { 0 } else { 1 + usize::from(ways[2] < ways[1]) };
        (axis, ways[axis].max(0.0))
    }

    fn follow(&mut self, index: usize) {
        let options = self.options;
        let mut random = Random::stream(options.seed, index as u64);
        let step = options.bin_s * speed_m_s(options.air);
        let per_metre = DVec3::from_array(options.cells.map(|n| n as f64)) / self.size;
        let (mut at, mut heading) = (self.source, direction(index, options.particles));
        let outward = heading.signum();
        let mut energy = [1.0_f32; LANES];
        // Metres to the next count: the middle of the first bin.
        let (mut bin, mut rest) = (0, 0.5 * step);
        let (mut crossed, mut mirrored) = ([0_i32; 3], true);
        loop {
            let (axis, way) = self.next_wall(at, heading);
            let counts = !(mirrored && self.played.has(crossed));
            while rest <= way {
                if counts {
                    let place = (at + rest * heading) * per_metre;
                    let cell = (0..3).rev().fold(0, |sum, a| {
                        let last = options.cells[a] - 1;
                        sum * options.cells[a] + (place[a] as usize).min(last)
                    });
                    self.found[cell * self.bins + bin].collect(&energy, 1.0, (-heading).as_vec3().to_array());
                }
                bin += 1;
                rest += step;
                if bin == self.bins {
                    return;
                }
            }
            rest -= way;
            at = (at + way * heading).clamp(DVec3::ZERO, self.size);
            let high = heading[axis] > 0.0;
            at[axis] = if high { self.size[axis] } else { 0.0 };
            let surface = &self.surfaces[2 * axis + usize::from(high)];
            energy.iter_mut().zip(&surface.reflected).for_each(|(e, r)| *e *= r);
            if energy.iter().all(|e| *e < LEAST_ENERGY) {
                return;
            }
            let scattered = surface.chance > 0.0 && random.uniform_f64() < surface.chance;
            // As long as images share the way, each octave keeps its own share of what is scattered.
            if mirrored && crossed.iter().all(|n| n.abs() <= self.played.reach) {
                let factors = if scattered { &surface.if_scattered } else { &surface.if_mirrored };
                energy.iter_mut().zip(factors).for_each(|(e, f)| *e *= f);
            }
            if scattered {
                mirrored = false;
                let mut normal = DVec3::ZERO;
                normal[axis] = if high { -1.0 } else { 1.0 };
                heading = lambert(normal, &mut random);
            } else {
                heading[axis] = -heading[axis];
                crossed[axis] += outward[axis] as i32;
            }
        }
    }
}
