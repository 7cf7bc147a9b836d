//! The sound that images do not have: rays that walls scatter, collected at all listeners at once.
//!
//! Each ray carries the energy of all octaves as lanes; a wall takes its share of each and sends the ray on, as a mirror or
//! after Lambert's law (Kuttruff, "Room Acoustics"; Schroeder 2011, "Physically based real-time auralization", chapter 5).
//! Spheres about the listeners collect what passes through them, an unbiased measure of the energy at their middles.

use super::listeners::Listeners;
use crate::directivity::lattice::direction;
use crate::directivity::source::{Directivity, Source};
use crate::error::{AcousticsError, place};
use crate::images::search::Images;
use crate::materials::air::{Air, speed_m_s};
use crate::octave::{BANDS, Octaves};
use crate::rays::echogram::{Echogram, LANES, Lanes, lanes_decay_per_m};
use crate::rays::surface::Surface;
use crate::room::Room;
use crate::room::ray::Ray;
use glam::{DQuat, DVec3};
use promenade_core::random::Random;
use rayon::prelude::*;

/// Most shares that a run's rays are divided in.
const SHARES: usize = 64;
/// Shares that are traced at once, whatever the number of threads.
const AT_ONCE: usize = 8;
/// Rays that a share has at least.
const LEAST_RAYS: usize = 256;
/// A ray that has less of its energy than this, in every octave, ends: 70 dB.
const LEAST_ENERGY: f32 = 1e-7;
/// Longest echogram, bins.
const MOST_BINS: f64 = 1e6;

/// How rays are traced.
#[derive(Clone, Copy, Debug)]
pub struct RayOptions<'a> {
    /// Rays from the source.
    pub rays: usize,
    /// How long they go, seconds.
    pub length_s: f64,
    /// Length of a bin of the echograms, seconds.
    pub bin_s: f64,
    /// What these images of the same source bring to a listener, of [`crate::Reflected::Specular`], is left to them,
    /// and nothing else: what mirrors have sent on along ways that no image was found for stays with the rays. The direct
    /// sound is always an image's.
    pub images: Option<&'a Images>,
    /// Radius of the listeners' spheres, metres; less where a wall is nearer. Without it a tenth of the side of a cube of the
    /// volume that the mesh lies in.
    pub radius_m: Option<f64>,
    /// What the air takes.
    pub air: Option<Air>,
    /// Seed of directions and scattering.
    pub seed: u64,
}

impl Default for RayOptions<'_> {
    fn default() -> Self {
        Self { rays: 16_384, length_s: 1.0, bin_s: 0.004, images: None, radius_m: None, air: Some(Air::default()), seed: 1 }
    }
}

/// What became of a source's energy.
#[derive(Clone, Debug, PartialEq)]
pub struct LateField {
    /// Of each listener.
    pub echograms: Vec<Echogram>,
    /// Share of the energy that walls absorbed.
    pub absorbed: Octaves,
    /// Share of the energy that left through openings.
    pub escaped: Octaves,
    /// Share of the energy that was still on its way at the end, or too little to follow.
    pub remaining: Octaves,
    /// Mean way between two walls, metres; 0 if none was met.
    pub mean_free_path_m: f64,
    /// Variance of those ways, over the square of their mean.
    pub path_variance: f64,
    /// Searches for the next wall.
    pub casts: u64,
    /// How far T30 of an octave at one listener is off because rays are few, as a share of it: the standard error that two
    /// halves of the rays show, root mean square over octaves and listeners. `None` where no half has a T30.
    pub t30_error: Option<f64>,
}

impl LateField {
    /// Reverberation times T30 of the octaves, seconds, each a mean over all listeners that have one; `None` if an octave has
    /// none.
    #[must_use]
    pub fn mean_t30_s(&self) -> Option<[f64; BANDS]> {
        let mut means = [0.0; BANDS];
        for (band, mean) in means.iter_mut().enumerate() {
            let all: Vec<f64> = self.echograms.iter().filter_map(|e| e.t30_s(band)).collect();
            *mean = all.iter().sum::<f64>() / all.len() as f64;
        }
        means.iter().all(|m| m.is_finite()).then_some(means)
    }
}

/// Traces rays from a source once and collects them at all listeners. `done` is told the share of the work that is, 0 to 1. The
/// same input and seed give the same numbers on any number of threads.
///
/// # Errors
/// A source or a listener that is not finite, an option out of range.
pub fn late_field(
    room: &Room,
    source: impl Into<Source>,
    listeners: &[[f64; 3]],
    options: &RayOptions<'_>,
    done: impl Fn(f64),
) -> Result<LateField, AcousticsError> {
    let source = source.into();
    let radius = options.radius_m.unwrap_or_else(|| 0.1 * room.bounding_volume().cbrt());
    check(options, radius)?;
    let listeners = Listeners::new(room, listeners, radius)?;
    let tracer = Tracer::new(room, &source, &listeners, options)?;
    let share = options.rays.div_ceil(SHARES).max(LEAST_RAYS);
    let starts: Vec<usize> = (0..options.rays).step_by(share).collect();
    let mut sum = Sum::new(listeners.count(), tracer.bins);
    for (i, wave) in starts.chunks(AT_ONCE).enumerate() {
        let parts: Vec<Sum> = wave.par_iter().map(|start| tracer.trace(*start..(start + share).min(options.rays))).collect();
        // In the order of the rays, so that rounding does not depend on which part was done first.
        parts.iter().for_each(|part| sum.add(part));
        done(((i + 1) * AT_ONCE).min(starts.len()) as f64 / starts.len() as f64);
    }
    Ok(sum.finish(&tracer))
}

/// Traces rays from a source and tells of each that meets a surface: where, on which plane, and the power that it brings, of a
/// source whose direct sound has an energy of 1 at 1 m on its axis. In the order of the rays. A wall ends rays as often as it
/// absorbs and leaves the others as much, so that all bring about as much (Arvo and Kirk 1990, "Particle transport and image
/// synthesis").
pub(crate) fn particles(
    room: &Room,
    source: &Source,
    options: &RayOptions<'_>,
    mut on_wall: impl FnMut(DVec3, u32, &[f32; LANES]),
) -> Result<(), AcousticsError> {
    check(options, 1.0)?;
    let listeners = Listeners::new(room, &[], 1.0)?;
    let tracer = Tracer { roulette: true, ..Tracer::new(room, source, &listeners, options)? };
    let decay = lanes_decay_per_m(options.air);
    let power = 4.0 * std::f64::consts::PI / options.rays as f64;
    let mut sum = Sum::new(0, 0);
    for ray in 0..options.rays {
        tracer.follow(ray, &mut sum, |at, plane, way, energy| {
            let mut lanes = *energy;
            for (lane, decay) in lanes.iter_mut().zip(&decay) {
                *lane *= (power * (-decay * way).exp()) as f32;
            }
            on_wall(at, plane, &lanes);
        });
    }
    Ok(())
}

fn check(options: &RayOptions<'_>, radius: f64) -> Result<(), AcousticsError> {
    let wrong = |what: &str, expected: &str, found: String| Err(AcousticsError::argument(what, expected, found));
    if !(1..=1 << 28).contains(&options.rays) {
        return wrong("rays", "1 to 268435456", options.rays.to_string());
    }
    if !(options.bin_s > 0.0 && options.length_s > 0.0 && options.length_s / options.bin_s <= MOST_BINS) {
        let found = format!("{} s in bins of {} s", options.length_s, options.bin_s);
        return wrong("length of echograms", "above 0 s and at most a million bins", found);
    }
    if !(radius > 0.0 && radius.is_finite()) {
        return wrong("radius of listeners", "above 0 m", radius.to_string());
    }
    Ok(())
}

/// A rotation of the lattice of directions.
fn turn(seed: u64) -> DQuat {
    let mut random = Random::stream(seed, u64::MAX);
    // Evenly over all rotations (Shoemake 1992).
    let (u, v, w) =
        (random.uniform_f64(), std::f64::consts::TAU * random.uniform_f64(), std::f64::consts::TAU * random.uniform_f64());
    let (a, b) = ((1.0 - u).sqrt(), u.sqrt());
    DQuat::from_xyzw(a * v.sin(), a * v.cos(), b * w.sin(), b * w.cos())
}

/// The plane and the image that a ray comes from, if one may have it, and the planes that mirrored it with the metres to each.
type Mirrored<'a> = (Option<(u32, DVec3)>, &'a [(u32, f64)]);

struct Tracer<'a> {
    room: &'a Room,
    source: DVec3,
    directivity: &'a Directivity,
    listeners: &'a Listeners,
    surfaces: Vec<Surface>,
    options: &'a RayOptions<'a>,
    turn: DQuat,
    bins: usize,
    /// Whether walls end rays instead of weakening them.
    roulette: bool,
}

/// What some rays have brought.
struct Sum {
    /// `[listener][bin]`.
    bins: Vec<Lanes>,
    /// What every other ray has brought, without directions, and whether the ray that is followed is one of those.
    half: Vec<[f32; LANES]>,
    is_of_half: bool,
    emitted: [f64; LANES],
    absorbed: [f64; LANES],
    escaped: [f64; LANES],
    remaining: [f64; LANES],
    way_m: f64,
    way2_m2: f64,
    walls: u64,
    casts: u64,
}

impl Sum {
    fn new(listeners: usize, bins: usize) -> Self {
        let none = [0.0; LANES];
        let count = listeners * bins;
        Self {
            bins: vec![Lanes::default(); count],
            half: vec![[0.0; LANES]; count],
            is_of_half: false,
            emitted: none,
            absorbed: none,
            escaped: none,
            remaining: none,
            way_m: 0.0,
            way2_m2: 0.0,
            walls: 0,
            casts: 0,
        }
    }

    fn add(&mut self, other: &Self) {
        self.bins.iter_mut().zip(&other.bins).for_each(|(a, b)| a.add(b));
        self.half.as_flattened_mut().iter_mut().zip(other.half.as_flattened()).for_each(|(a, b)| *a += b);
        add(&mut self.emitted, &other.emitted);
        add(&mut self.absorbed, &other.absorbed);
        add(&mut self.escaped, &other.escaped);
        add(&mut self.remaining, &other.remaining);
        self.way_m += other.way_m;
        self.way2_m2 += other.way2_m2;
        self.walls += other.walls;
        self.casts += other.casts;
    }

    fn finish(self, tracer: &Tracer<'_>) -> LateField {
        let options = tracer.options;
        let decay = lanes_decay_per_m(options.air);
        let air = |bin: usize, band: usize| {
            let way = (bin as f64 + 0.5) * options.bin_s * speed_m_s(options.air);
            (-decay[band] * way).exp() as f32
        };
        let shares = |lanes: [f64; LANES]| std::array::from_fn(|b| (lanes[b] / self.emitted[b].max(f64::MIN_POSITIVE)) as f32);
        let walls = self.walls.max(1) as f64;
        let mean = self.way_m / walls;
        let echograms: Vec<_> = self.bins.chunks(tracer.bins).map(|bins| Echogram::new(options.bin_s, bins, air)).collect();
        let halves = self.half.chunks(tracer.bins).map(|bins| {
            let bins: Vec<_> = bins.iter().map(Lanes::of_energy).collect();
            Echogram::new(options.bin_s, &bins, air)
        });
        LateField {
            t30_error: t30_error(echograms.iter().zip(halves)),
            echograms,
            absorbed: shares(self.absorbed),
            escaped: shares(self.escaped),
            remaining: shares(self.remaining),
            mean_free_path_m: mean,
            path_variance: if mean > 0.0 { self.way2_m2 / walls / (mean * mean) - 1.0 } else { 0.0 },
            casts: self.casts,
        }
    }
}

/// Standard error of T30 from echograms and what a half of the rays has brought to each ([`LateField::t30_error`]).
fn t30_error<'a>(fields: impl Iterator<Item = (&'a Echogram, Echogram)>) -> Option<f64> {
    let mut squares = Vec::new();
    for (whole, half) in fields {
        let mut rest = whole.clone();
        for (rest, half) in rest.bins.iter_mut().zip(&half.bins) {
            rest.energy.iter_mut().zip(half.energy).for_each(|(rest, half)| *rest = (*rest - half).max(0.0));
        }
        let errors = (0..BANDS).filter_map(|band| {
            let [a, b] = [half.t30_s(band)?, rest.t30_s(band)?];
            Some(((a - b) / (a + b)).powi(2))
        });
        squares.extend(errors);
    }
    (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
}

fn add(sum: &mut [f64; LANES], other: &[f64; LANES]) {
    sum.iter_mut().zip(other).for_each(|(a, b)| *a += b);
}

impl<'a> Tracer<'a> {
    fn new(
        room: &'a Room,
        source: &'a Source,
        listeners: &'a Listeners,
        options: &'a RayOptions<'a>,
    ) -> Result<Self, AcousticsError> {
        Ok(Self {
            room,
            source: place("source", source.position)?,
            directivity: &source.directivity,
            listeners,
            surfaces: room.materials().iter().map(Surface::new).collect(),
            options,
            turn: turn(options.seed),
            bins: (options.length_s / options.bin_s).ceil() as usize,
            roulette: false,
        })
    }

    fn trace(&self, rays: std::ops::Range<usize>) -> Sum {
        let mut sum = Sum::new(self.listeners.count(), self.bins);
        for i in rays {
            self.follow(i, &mut sum, |_, _, _, _| ());
        }
        sum
    }

    /// Follows a ray; `on_wall` is told place, plane, way from the source in metres, and energy of each meeting with a surface.
    fn follow(&self, index: usize, sum: &mut Sum, mut on_wall: impl FnMut(DVec3, u32, f64, &[f32; LANES])) {
        let options = self.options;
        sum.is_of_half = index % 2 == 1;
        let mut random = Random::stream(options.seed, index as u64);
        let mut ray = Ray::new(self.source, self.turn * direction(index, options.rays));
        let mut energy = [0.0_f32; LANES];
        let gains = self.directivity.towards(ray.direction.to_array());
        energy.iter_mut().zip(gains.iter().chain(&gains[..1])).for_each(|(e, gain)| *e = gain * gain);
        add(&mut sum.emitted, &energy.map(f64::from));
        let reach = options.length_s * speed_m_s(options.air);
        let (mut way, mut order, mut mirrored) = (0.0, 0, true);
        let images_order = options.images.map_or(0, Images::order);
        // Where the source's image lies that the ray comes from, as long as only mirrors have sent it on.
        let mut image = self.source;
        // The planes of its mirrors and how far they are on its way, where images have a share only.
        let mut met = Vec::new();
        let shared = options.images.is_some_and(Images::are_shared);
        loop {
            sum.casts += 1;
            let hit = ray.cast(self.room);
            let length = hit.map_or(f64::INFINITY, |hit| hit.distance).min(reach - way);
            let of = (mirrored && order <= images_order).then_some((order, image));
            self.collect(&ray, [way, length], &energy, (of, &met), sum);
            let Some(hit) = hit else {
                return add(&mut sum.escaped, &energy.map(f64::from));
            };
            way += hit.distance;
            if way >= reach || energy.iter().all(|e| *e < LEAST_ENERGY) {
                return add(&mut sum.remaining, &energy.map(f64::from));
            }
            sum.way_m += hit.distance;
            sum.way2_m2 += hit.distance * hit.distance;
            sum.walls += 1;
            on_wall(ray.at(hit.distance), self.room.plane(hit.face), way, &energy);
            let surface = &self.surfaces[self.room.material(hit.face)];
            let brought: f32 = energy.iter().sum();
            for ((e, r), absorbed) in energy.iter_mut().zip(&surface.reflected).zip(&mut sum.absorbed) {
                *absorbed += f64::from(*e * (1.0 - r));
                *e *= r;
            }
            if self.roulette {
                let kept = energy.iter().sum::<f32>() / brought.max(f32::MIN_POSITIVE);
                if random.uniform() >= kept {
                    return;
                }
                energy.iter_mut().for_each(|e| *e /= kept);
            }
            let scattered = surface.chance > 0.0 && random.uniform_f64() < surface.chance;
            // While images share the way, each octave keeps its own share of what is scattered. After that the octaves go the
            // same ways: keeping it for ever would make a few rays carry everything.
            if mirrored && order < images_order {
                let factors = if scattered { &surface.if_scattered } else { &surface.if_mirrored };
                energy.iter_mut().zip(factors).for_each(|(e, f)| *e *= f);
            }
            if scattered {
                mirrored = false;
                ray.scatter(self.room, &hit, &mut random);
            } else {
                if mirrored && order < images_order {
                    let plane = self.room.plane(hit.face);
                    image = self.room.planes()[plane as usize].mirror(image);
                    if shared {
                        met.push((plane, way));
                    }
                }
                ray.mirror(self.room, &hit);
            }
            order += 1;
        }
    }

    /// Collects a ray that has come so far, metres, on its next metres; `of` is the order and the place of the image that it
    /// comes from, if one may have it, and what has mirrored it.
    fn collect(&self, ray: &Ray, [way, length]: [f64; 2], energy: &[f32; LANES], (of, met): Mirrored<'_>, sum: &mut Sum) {
        if matches!(of, Some((0, _))) {
            return;
        }
        // Sent out at the level of a direct sound of 1 at 1 m on the axis.
        let level = 4.0 * std::f64::consts::PI / self.options.rays as f64;
        self.listeners.crossed(ray, length, |listener, at, area_m2| {
            let delivers =
                |(order, image)| self.options.images.is_some_and(|all| all.has(order, image, self.listeners.place(listener)));
            let mut left = *energy;
            if of.is_some_and(delivers) {
                if met.is_empty() {
                    return;
                }
                let held = self.options.images.map_or([1.0; LANES], |all| all.held(met, way + at));
                left.iter_mut().zip(held).for_each(|(energy, held)| *energy *= 1.0 - held);
            }
            let bin = ((way + at) / speed_m_s(self.options.air) / self.options.bin_s) as usize;
            if bin < self.bins {
                let (from, scale) = ((-ray.direction).as_vec3(), (level / area_m2) as f32);
                let bin = listener * self.bins + bin;
                sum.bins[bin].collect(&left, scale, from.to_array());
                if sum.is_of_half {
                    sum.half[bin].iter_mut().zip(left).for_each(|(half, e)| *half += scale * e);
                }
            }
        });
    }
}
