//! Binaural responses of a room of any shape: images by beams, and the energy of scattered rays as noise.
//!
//! Images have what walls neither absorb nor scatter, rays the rest, so that together they have all of it. Air takes its share
//! of both (ISO 9613-1).

use super::bins::Bins;
use super::early::{Arriving, Early};
use super::hrtf::Hrtf;
use super::low::{Bass, Joiner, PILOT_RAYS, Pilot};
use super::part::{Part, distinct};
use super::tail::{Tail, Variance};
use super::walls::{filters, left};
use super::{LEAST_DISTANCE_M, MAX_LENGTH_S, OCTAVES_HZ};
use crate::{BakeError, Response, Responses};
use promenade_acoustics::{
    Air, BANDS, DiffractedImages, DiffractionPath, Echogram, Edges, Image, ImageOptions, Images, LateField, LowField, Mesh,
    RayOptions, Reflected, Room, Source, late_field, octave_energy, speed_m_s,
};
use promenade_core::Pose;
use promenade_core::glam::Vec3;
use promenade_fourier::num_complex::Complex32;
use promenade_room::{EnergyVector, ear_energy};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Lengths that responses have unless told, seconds.
const SHORTEST_BY_ITSELF_S: f64 = 0.1;
const LONGEST_BY_ITSELF_S: f64 = 4.0;
/// Rays that are followed for an accurate T30, beside those that are asked for.
const MOST_TIMES: f64 = 16.0;
/// How long the rays are followed that tell how long a room sounds, seconds.
const PILOT_S: f64 = MAX_LENGTH_S as f64;

/// How responses are computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshOptions {
    /// Reflections that an image has at most.
    pub order: u32,
    /// Beams that search the images.
    pub beams: usize,
    /// Rays of the late field, at least.
    pub rays: usize,
    /// How far T30 of an octave at one place may be off because rays are few ([`LateField::t30_error`]): up to 16 times as many
    /// are followed for that.
    pub t30_within: Option<f64>,
    /// Length of the responses in seconds, above 0 and at most [`MAX_LENGTH_S`]; without it the longest T30 of the octaves that
    /// a few rays show, but at most 4.
    pub length_s: Option<f32>,
    /// What the air takes; nothing without it.
    pub air: Option<Air>,
    /// Below this frequency, Hz, waves are in the place of images and rays; 0 for none. Without it as high as the room's size
    /// asks for and time allows.
    pub waves_hz: Option<f64>,
    /// Seed of rays and noise.
    pub seed: u64,
    /// The share of the places that is computed: what it has is bit for bit what the whole has there.
    pub part: Part,
}

/// Responses with what is known of the room's energy.
#[derive(Clone, Debug)]
pub struct Simulated {
    /// One for each pose of the part, in their order.
    pub responses: Responses,
    /// Rays that were followed.
    pub rays: usize,
    /// Where the energy of the rays went.
    pub late: LateField,
    /// Images that all listeners together may see.
    pub images: usize,
    /// Below this frequency the bass is that of waves, Hz.
    pub crossover_hz: Option<f64>,
    /// How long the room sounds, the longest T30 of its octaves, seconds, where it was not told how long responses are.
    pub rings_s: Option<f64>,
}

/// Binaural responses of a source in a room for heads at `poses`, at the sample rate of the HRTF.
///
/// The direct sound of the source at 1 m on its axis has the level of the HRTF, 0 dB in a diffuse field, and arrives after
/// distance over the speed of sound; sample 0 is when the emitter sounds. `mesh` is what `room` was made of. `done` is told
/// the share of the work that is, 0 to 1. The same input and seed give the same samples on any number of threads.
///
/// # Errors
/// An option out of range; a pose that is not finite or within 0.1 m of the emitter, which the message names by its number from
/// 0.
pub fn simulate_mesh(
    mesh: &Mesh,
    room: &Room,
    source: &Source,
    hrtf: &Hrtf,
    poses: &[Pose],
    options: &MeshOptions,
    done: impl Fn(f64) + Sync,
) -> Result<Simulated, BakeError> {
    let images = ImageOptions { order: options.order, beams: options.beams, ..ImageOptions::default() };
    let images = Images::new(room, source, &images)?;
    simulate(&Surfaces { mesh, room, images }, source, hrtf, poses, options, done)
}

/// A room as it is heard: a mesh with what it was made into, and the images of a source.
pub(super) struct Surfaces<'a> {
    pub(super) mesh: &'a Mesh,
    pub(super) room: &'a Room,
    pub(super) images: Images,
}

/// Binaural responses for heads at `poses`, in a room whose images are known. Errors are those of [`simulate_mesh`].
pub(super) fn simulate(
    surfaces: &Surfaces<'_>,
    source: &Source,
    hrtf: &Hrtf,
    poses: &[Pose],
    options: &MeshOptions,
    done: impl Fn(f64) + Sync,
) -> Result<Simulated, BakeError> {
    let Surfaces { mesh, room, images } = surfaces;
    let emitter = Vec3::from_array(source.position.map(|c| c as f32));
    check(emitter, poses, options)?;
    let rate = hrtf.bins.sample_rate_hz;
    let places = options.part.places(poses);
    let listeners = in_metres(&places);
    let bass = Bass::of(mesh, room, source, options.waves_hz)?;
    // Of all places, so that all parts are of one length and one decay.
    let places_of_all = in_metres(&distinct(poses));
    let asked = options.length_s.is_none() || bass.is_some() || options.t30_within.is_some();
    let pilot = || Pilot::new(room, source, &places_of_all, (options.rays, PILOT_S), (options.air, options.seed));
    let pilot = asked.then(pilot).transpose()?;
    let rings_s = pilot.as_ref().filter(|_| options.length_s.is_none()).map(|pilot| longest_t30_s(&pilot.late));
    let natural = || rings_s.unwrap_or_default().clamp(SHORTEST_BY_ITSELF_S, LONGEST_BY_ITSELF_S);
    let length_s = options.length_s.map_or_else(natural, f64::from);
    let length = (length_s * rate).ceil() as usize;
    let tail = Tail::new(hrtf, length, options.seed);
    let followed = pilot.as_ref().map_or(options.rays, |pilot| followed(options, pilot));
    let rays = RayOptions { rays: followed, ..rays(options, images, &tail, length as f64 / rate, rate) };
    let late = late_field(room, source, &listeners, &rays, |share| done(0.5 * share))?;
    let low = bass.zip(pilot).map(|(bass, pilot)| -> Result<LowField, BakeError> {
        let waves = (length as f64 / rate, options.air);
        let mut low = bass.field(room, source, &listeners, &pilot, waves, |share| done(0.5 + 0.2 * share))?;
        low.add_direct(bass.level, source.position, &listeners, speed_m_s(options.air));
        Ok(low)
    });
    let low = low.transpose()?;
    let joiner = bass.map(|bass| Joiner::new(bass.crossover_hz, length, rate));
    let begun = if bass.is_some() { 0.7 } else { 0.5 };
    let voice = Voice::new(mesh, room, hrtf, options.air);
    let edges = Edges::of(mesh);
    let hearing = Hearing {
        surfaces,
        source,
        diffracted: edges.diffracted_images(room, images, Reflected::Specular)?,
        edges: &edges,
        voice,
    };
    let early = Early::new(hrtf, speed_m_s(options.air) as f32);
    let (finished, count) = (AtomicUsize::new(0), options.part.poses(poses).len());
    let of_place = |(at, (place, echogram)): (usize, (&Vec3, &Echogram))| -> Result<Vec<(usize, Response)>, BakeError> {
        let reflected = hearing.at(*place)?;
        let direct = place.distance(emitter) / speed_m_s(options.air) as f32 * rate as f32;
        let hops = Hops::new(echogram, &tail, f64::from(direct));
        let head = |(index, pose): (usize, &Pose)| {
            let mut ears = [vec![0.0; length], vec![0.0; length]];
            early.add(pose, reflected.iter().map(|(position, left)| Arriving { position: *position, left }), &mut ears);
            let gains = hops.at_ears(pose, hrtf);
            let mut late = [vec![0.0; length], vec![0.0; length]];
            tail.add(index as u64, hops.first, |l| [&gains[l][0], &gains[l][1]], &mut late);
            if let (Some(joiner), Some(low)) = (&joiner, &low) {
                joiner.join(&mut ears, &mut late, low, at, pose.orientation * Vec3::Y);
            }
            for (ear, late) in ears.iter_mut().zip(&late) {
                ear.iter_mut().zip(late).for_each(|(ear, late)| *ear += late);
            }
            let now = finished.fetch_add(1, Ordering::Relaxed) + 1;
            done(begun + (1.0 - begun) * now as f64 / count as f64);
            let [left, right] = ears;
            (index, Response { listener: *pose, source: emitter, left, right, name: format!("pose-{index:05}") })
        };
        Ok(poses.iter().enumerate().filter(|(_, pose)| pose.position == *place).map(head).collect())
    };
    let made: Result<Vec<Vec<(usize, Response)>>, BakeError> =
        places.par_iter().zip(&late.echograms).enumerate().map(of_place).collect();
    let responses = in_order(made?.into_iter().flatten().collect(), hrtf);
    let crossover_hz = bass.map(|bass| bass.crossover_hz);
    Ok(Simulated { responses, images: images.count(), rays: followed, crossover_hz, rings_s, late })
}

/// Rays for the error that T30 may have: it falls with the root of their number.
fn followed(options: &MeshOptions, pilot: &Pilot) -> usize {
    let times = options.t30_within.zip(pilot.late.t30_error).map_or(0.0, |(within, error)| (error / within).powi(2));
    (options.rays.min(PILOT_RAYS) as f64 * times).clamp(options.rays as f64, MOST_TIMES * options.rays as f64) as usize
}

/// How rays are followed for some seconds, for a tail.
fn rays<'a>(options: &MeshOptions, images: &'a Images, tail: &Tail, length_s: f64, rate: f64) -> RayOptions<'a> {
    RayOptions {
        rays: options.rays,
        length_s,
        // Two bins are a hop.
        bin_s: 0.5 * tail.hop() as f64 / rate,
        images: Some(images),
        radius_m: None,
        air: options.air,
        seed: options.seed,
    }
}

/// Responses by their numbers, as a set.
fn in_order(mut responses: Vec<(usize, Response)>, hrtf: &Hrtf) -> Responses {
    responses.sort_by_key(|(index, _)| *index);
    Responses {
        title: "Room of a mesh".to_owned(),
        credit: hrtf.credit.clone(),
        licence: hrtf.licence.clone(),
        sample_rate_hz: hrtf.bins.sample_rate_hz,
        responses: responses.into_iter().map(|(_, response)| response).collect(),
        ..Responses::default()
    }
}

/// What is heard of a source in a room, without rays.
struct Hearing<'a> {
    surfaces: &'a Surfaces<'a>,
    source: &'a Source,
    edges: &'a Edges,
    diffracted: DiffractedImages<'a>,
    voice: Voice<'a>,
}

impl Hearing<'_> {
    /// Places that sound comes to a place from, and its spectra: images, and ways round edges.
    fn at(&self, place: Vec3) -> Result<Vec<(Vec3, Vec<Complex32>)>, BakeError> {
        let Surfaces { room, images, .. } = self.surfaces;
        let at = place.as_dvec3().to_array();
        let bent = self.diffracted.paths(at)?;
        let mut seen = images.seen_from(room, at, Reflected::Specular)?;
        self.diffracted.shade(at, &bent, &mut seen)?;
        let mut reflected: Vec<_> = seen.iter().map(|image| self.voice.of(image, place)).collect();
        if !seen.iter().any(|image| image.order == 0) {
            reflected
                .extend(self.edges.paths_round_one_or_two(room, self.source, at)?.iter().map(|way| self.voice.around(way)));
        }
        reflected.extend(bent.iter().filter(|way| !way.lit).map(|way| self.voice.around(way)));
        Ok(reflected)
    }
}

fn check(emitter: Vec3, poses: &[Pose], options: &MeshOptions) -> Result<(), BakeError> {
    if let Some(s) = options.length_s.filter(|s| !(1e-3..=MAX_LENGTH_S).contains(s)) {
        return Err(BakeError::argument("length of the responses", format!("0.001 to {MAX_LENGTH_S} s"), s));
    }
    for (index, pose) in poses.iter().enumerate() {
        if !pose.is_valid() || pose.position.distance(emitter) < LEAST_DISTANCE_M {
            let expected = format!("at least {LEAST_DISTANCE_M} m from the emitter at {emitter}");
            return Err(BakeError::argument("listener", expected, format!("pose {index} at {}", pose.position)));
        }
    }
    Ok(())
}

fn in_metres(places: &[Vec3]) -> Vec<[f64; 3]> {
    places.iter().map(|p| p.as_dvec3().to_array()).collect()
}

/// The longest T30 of the octaves that rays show, seconds.
fn longest_t30_s(late: &LateField) -> f64 {
    let mean = |band: usize| {
        let times: Vec<f64> = late.echograms.iter().filter_map(|e| e.t30_s(band)).collect();
        times.iter().sum::<f64>() / times.len() as f64
    };
    // An octave without a decay in sight has no mean, and `max` passes over it.
    (0..OCTAVES_HZ.len()).map(mean).fold(0.0, f64::max)
}

/// What materials and air do to images.
struct Voice<'a> {
    mesh: &'a Mesh,
    bins: Bins,
    /// By material, then the air of a metre: complex logarithms by bin.
    filters: Vec<Vec<Complex32>>,
}

impl<'a> Voice<'a> {
    fn new(mesh: &'a Mesh, room: &Room, hrtf: &Hrtf, air: Option<Air>) -> Self {
        let mut filters = filters(room.materials(), hrtf.bins);
        filters.push(hrtf.bins.minimum_phase(|hz| 10.0_f64.powf(-air.map_or(0.0, |air| air.db_per_m(hz)) / 20.0)));
        Self { mesh, bins: hrtf.bins, filters }
    }

    fn of(&self, image: &Image, listener: Vec3) -> (Vec3, Vec<Complex32>) {
        let position = Vec3::from_array(image.position.map(|c| c as f32));
        let mut times = vec![0.0; self.filters.len()];
        for face in &image.faces {
            times[self.mesh.triangles[*face as usize].group as usize] += 1.0;
        }
        if let Some(air) = times.last_mut() {
            *air = position.distance(listener);
        }
        let mut left = left(&self.filters, &times);
        if image.directivity != [1.0; BANDS] {
            let sent = self.bins.minimum_phase(|hz| octave_energy(&image.directivity.map(f64::from), hz));
            left.iter_mut().zip(sent).for_each(|(left, sent)| *left *= sent.exp());
        }
        (position, left)
    }

    /// Sound round edges.
    fn around(&self, way: &DiffractionPath) -> (Vec3, Vec<Complex32>) {
        let edge = self.bins.minimum_phase(|hz| way.amplitude(hz) * way.path_m);
        let air = self.filters.last().into_iter().flatten();
        let taken = edge.iter().zip(air).map(|(edge, air)| (edge + air * way.path_m as f32).exp());
        (Vec3::from_array(way.position.map(|c| c as f32)), taken.collect())
    }
}

/// The late field of one place, hop by hop.
struct Hops {
    /// Hops before are silent.
    first: usize,
    gains: Vec<Vec<f32>>,
    /// Where a hop's energy comes from.
    vectors: Vec<EnergyVector>,
}

impl Hops {
    fn new(echogram: &Echogram, tail: &Tail, direct: f64) -> Self {
        let hop = tail.hop();
        // Noise that lies about a hop begins a hop before it, and not before the direct sound.
        let first = (0..tail.hops()).find(|l| (*l as f64 - 1.0) * hop as f64 >= direct).unwrap_or(tail.hops());
        let mut variances = vec![Variance::default(); tail.hops()];
        let mut vectors = vec![EnergyVector::default(); tail.hops()];
        for (i, bin) in echogram.bins.iter().enumerate() {
            let l = i.div_ceil(2).max(first);
            if l >= tail.hops() {
                break;
            }
            variances[l].add(bin, hop);
            vectors[l].add(bin);
        }
        Self { first, gains: variances.iter().map(|v| tail.gains(v)).collect(), vectors }
    }

    /// Standard deviations at both ears of a head: a part of the energy comes from one side and has the level of the head's
    /// response there, the rest comes from everywhere.
    fn at_ears(&self, pose: &Pose, hrtf: &Hrtf) -> Vec<[Vec<f32>; 2]> {
        let bins = self.gains.first().map_or(0, Vec::len);
        let step = (hrtf.bins.count() - 1) / (bins - 1).max(1);
        let mut spectrum = vec![Complex32::default(); hrtf.bins.count()];
        let ears = |(gains, vector): (&Vec<f32>, &EnergyVector)| {
            let Some((side, share)) = vector.side() else { return [gains.clone(), gains.clone()] };
            let near = hrtf.near(pose.orientation.inverse() * side.as_vec3());
            std::array::from_fn(|ear| {
                near.spectrum(ear, &mut spectrum);
                let level = |k: usize| f64::from(spectrum[k * step].norm_sqr());
                gains.iter().enumerate().map(|(k, g)| g * ear_energy(share, level(k)).sqrt() as f32).collect()
            })
        };
        self.gains.iter().zip(&self.vectors).map(ears).collect()
    }
}

#[cfg(test)]
mod tests;
