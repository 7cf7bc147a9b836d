//! Binaural responses of a box room: image sources with HRTFs, and a statistical tail after them.
//!
//! Allen and Berkley, "Image method for efficiently simulating small-room acoustics", J. Acoust. Soc. Am. 65 (1979). The room
//! is the box from the origin to its size: metres, z up. Walls mirror, their absorption depends on the octave and not on the
//! angle; air absorbs nothing; the emitter radiates alike in all directions.

use super::early::{Early, Heard};
use super::part::Part;
use super::tail::{Tail, Variance};
use super::walls::{filters, left};
use super::{Absorption, Hrtf, LEAST_DISTANCE_M, MAX_LENGTH_S, SPEED_OF_SOUND_M_S};
use crate::{BakeError, Response, Responses};
use promenade_acoustics::{BoxImage, box_images};
use promenade_core::Pose;
use promenade_core::glam::Vec3;
use promenade_fourier::num_complex::Complex32;
use promenade_judge::random::Random;

/// Highest order of images.
pub const MAX_ORDER: u32 = 20;
/// Length that responses have at most unless told, seconds.
const LONGEST_BY_ITSELF_S: f32 = 4.0;
/// Places in the room that the images' mean energy is taken over.
const PLACES: usize = 400;

/// A room with six walls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoxRoom {
    /// Length, width and height, metres: 0.5 to 100.
    pub size: Vec3,
    /// Of the walls at x = 0, x = size, y = 0, y = size, floor and ceiling.
    pub absorption: [Absorption; 6],
}

/// How responses are computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoxOptions {
    /// Samples per second of the responses, 8000 to 192 000.
    pub sample_rate_hz: u32,
    /// Walls that an image has met at most; what has met more is the statistical tail. At most [`MAX_ORDER`].
    pub order: u32,
    /// Length of the responses in seconds, above 0 and at most [`MAX_LENGTH_S`]; without it the longest reverberation time of
    /// the octaves, but at most 4.
    pub length_s: Option<f32>,
    /// Seed of the tails' noise.
    pub seed: u64,
    /// The share of the places that is computed: what it has is bit for bit what the whole has there.
    pub part: Part,
}

impl Default for BoxOptions {
    fn default() -> Self {
        Self { sample_rate_hz: 24_000, order: 6, length_s: None, seed: 1, part: Part::WHOLE }
    }
}

impl BoxRoom {
    /// Cubic metres.
    #[must_use]
    pub fn volume_m3(&self) -> f32 {
        self.size.element_product()
    }

    /// Square metres of each wall, in the order of [`BoxRoom::absorption`].
    #[must_use]
    pub fn areas_m2(&self) -> [f32; 6] {
        let [x, y, z] = (Vec3::splat(self.volume_m3()) / self.size).to_array();
        [x, x, y, y, z, z]
    }

    /// Reverberation time by octave, seconds (Eyring 1930); infinite where nothing absorbs and 0 where everything does.
    #[must_use]
    pub fn eyring_t60_s(&self) -> [f32; 7] {
        self.decay_per_s().map(|d| (6.0 * std::f32::consts::LN_10) / d)
    }

    /// Decay of the energy, per second.
    fn decay_per_s(&self) -> [f32; 7] {
        let areas = self.areas_m2();
        let whole: f32 = areas.iter().sum();
        std::array::from_fn(|octave| {
            let mean = areas.iter().zip(&self.absorption).map(|(s, a)| s * a[octave]).sum::<f32>() / whole;
            -SPEED_OF_SOUND_M_S * whole / (4.0 * self.volume_m3()) * (1.0 - mean).max(0.0).ln()
        })
    }

    fn check(&self) -> Result<(), BakeError> {
        if !self.size.to_array().iter().all(|s| (0.5..=100.0).contains(s)) {
            return Err(BakeError::argument("size of the room", "0.5 to 100 m in each direction", self.size));
        }
        match self.absorption.iter().flatten().find(|a| !(0.0..=1.0).contains(*a)) {
            Some(a) => Err(BakeError::argument("absorption", "0 to 1", a)),
            None => Ok(()),
        }
    }

    /// Whether a point is inside, off the walls.
    fn contains(&self, point: Vec3) -> bool {
        point.cmpgt(Vec3::ZERO).all() && point.cmplt(self.size).all()
    }
}

/// Binaural responses of an emitter in a room for heads at `poses`.
///
/// The direct sound of an emitter at 1 m has the level of the HRTF, 0 dB in a diffuse field, and arrives after distance
/// over [`SPEED_OF_SOUND_M_S`]; sample 0 is when the emitter sounds. Only poses of the options' part have one. `done` is called
/// with the number of finished poses. The same input and seed give the same samples.
///
/// # Errors
/// A room, an emitter or an option out of range; a pose outside the room or within 0.1 m of the emitter, which the message
/// names by its number from 0.
pub fn simulate_box(
    room: &BoxRoom,
    emitter: Vec3,
    hrtf: &Hrtf,
    poses: &[Pose],
    options: &BoxOptions,
    mut done: impl FnMut(usize),
) -> Result<Responses, BakeError> {
    check(room, emitter, hrtf, poses, options)?;
    let longest = room.eyring_t60_s().into_iter().fold(0.0, f32::max);
    let diagonal_s = room.size.length() / SPEED_OF_SOUND_M_S;
    let length_s = options.length_s.unwrap_or_else(|| longest.max(diagonal_s + 0.05).min(LONGEST_BY_ITSELF_S));
    let length = (f64::from(length_s) * f64::from(options.sample_rate_hz)).ceil() as usize;
    let images = box_images(options.order);
    let walls = filters(&room.absorption, hrtf.bins);
    let heard = |image: &BoxImage| (position(image, emitter, room.size), left(&walls, &image.hits().map(|n| n as f32)));
    let reflected: Vec<(Vec3, Vec<Complex32>)> = images.iter().map(heard).collect();
    let (early, tail) = (Early::new(hrtf), Tail::new(hrtf, length, options.seed));
    let gains: Vec<Vec<f32>> = variances(room, emitter, &images, &tail, hrtf).iter().map(|v| tail.gains(v)).collect();
    let next = options.order + 1;
    let next: Vec<Vec3> =
        box_images(next).iter().filter(|i| i.order() == next).map(|i| position(i, emitter, room.size)).collect();
    let mine = options.part.poses(poses);
    let mut responses = Vec::with_capacity(mine.len());
    for index in mine {
        let pose = &poses[index];
        let mut ears = [vec![0.0; length], vec![0.0; length]];
        early.add(pose, reflected.iter().map(|(position, left)| Heard { position: *position, left }), &mut ears);
        // What begins before the first image that is left out would be heard among those that are not.
        let silent = next.iter().map(|i| i.distance(pose.position)).fold(f32::INFINITY, f32::min);
        let silent = f64::from(silent / SPEED_OF_SOUND_M_S) * hrtf.bins.sample_rate_hz;
        let first = (0..gains.len()).find(|l| (*l as f64 - 1.0) * tail.hop() as f64 > silent);
        tail.add(index as u64, first.unwrap_or(usize::MAX), |l| [&gains[l], &gains[l]], &mut ears);
        let [left, right] = ears;
        responses.push(Response { listener: *pose, source: emitter, left, right, name: format!("pose-{index:05}") });
        done(responses.len());
    }
    let [x, y, z] = room.size.to_array();
    Ok(Responses {
        title: format!("Box of {x} x {y} x {z} m"),
        credit: hrtf.credit.clone(),
        licence: hrtf.licence.clone(),
        sample_rate_hz: f64::from(options.sample_rate_hz),
        responses,
        ..Responses::default()
    })
}

fn check(room: &BoxRoom, emitter: Vec3, hrtf: &Hrtf, poses: &[Pose], options: &BoxOptions) -> Result<(), BakeError> {
    let wrong = |what, expected: String, found: String| Err(BakeError::argument(what, expected, found));
    room.check()?;
    let inside = || format!("inside the room, between 0,0,0 and {}", room.size);
    if !room.contains(emitter) {
        return wrong("emitter", inside(), emitter.to_string());
    }
    if options.sample_rate_hz != hrtf.sample_rate_hz() {
        return wrong("sample rate", format!("the HRTF's {} Hz", hrtf.sample_rate_hz()), options.sample_rate_hz.to_string());
    }
    if options.order > MAX_ORDER {
        return wrong("order of images", format!("at most {MAX_ORDER}"), options.order.to_string());
    }
    if let Some(s) = options.length_s.filter(|s| !(1e-3..=MAX_LENGTH_S).contains(s)) {
        return wrong("length of the responses", format!("0.001 to {MAX_LENGTH_S} s"), s.to_string());
    }
    for (index, pose) in poses.iter().enumerate() {
        let place = format!("pose {index} at {}", pose.position);
        if !pose.is_valid() || !room.contains(pose.position) {
            return wrong("listener", inside(), place);
        }
        if pose.position.distance(emitter) < LEAST_DISTANCE_M {
            return wrong("listener", format!("at least {LEAST_DISTANCE_M} m from the emitter at {emitter}"), place);
        }
    }
    Ok(())
}

/// Where an image lies, for an emitter in the room from the origin to `size`.
fn position(image: &BoxImage, emitter: Vec3, size: Vec3) -> Vec3 {
    Vec3::from_array(image.position(emitter.as_dvec3().to_array(), size.as_dvec3().to_array()).map(|c| c as f32))
}

/// What the walls leave of an image's energy, in an octave.
fn energy(room: &BoxRoom, image: &BoxImage, octave: usize) -> f64 {
    let left = |(a, n): (&Absorption, u32)| f64::from(1.0 - a[octave]).powi(n.cast_signed());
    room.absorption.iter().zip(image.hits()).map(left).product()
}

/// Energy a sample by hop and octave that the images do not have, of the statistical `4 pi c / V` a second where the direct
/// sound at 1 m has 1, decaying after Eyring.
fn variances(room: &BoxRoom, emitter: Vec3, early: &[BoxImage], tail: &Tail, hrtf: &Hrtf) -> Vec<Variance> {
    let (hops, hop, rate) = (tail.hops(), tail.hop(), hrtf.bins.sample_rate_hz);
    let mut random = Random::new(0);
    let mut had = vec![[0.0_f64; 7]; hops];
    let energies: Vec<[f64; 7]> = early.iter().map(|i| std::array::from_fn(|octave| energy(room, i, octave))).collect();
    for _ in 0..PLACES {
        let place = room.size * Vec3::new(random.uniform(), random.uniform(), random.uniform());
        for (image, energy) in early.iter().zip(&energies) {
            let distance = f64::from(position(image, emitter, room.size).distance(place));
            let at = distance / f64::from(SPEED_OF_SOUND_M_S) * rate / hop as f64;
            let Some(had) = had.get_mut(at.round() as usize) else { continue };
            for (h, e) in had.iter_mut().zip(energy) {
                *h += e / distance.powi(2).max(0.01) / (PLACES * hop) as f64;
            }
        }
    }
    let decay = room.decay_per_s().map(f64::from);
    let density = 4.0 * std::f64::consts::PI * f64::from(SPEED_OF_SOUND_M_S) / f64::from(room.volume_m3()) / rate;
    had.iter()
        .enumerate()
        .map(|(l, had)| {
            std::array::from_fn(|octave: usize| {
                let t = (l * hop) as f64 / rate;
                (density * (-decay[octave] * t).exp() - had[octave]).max(0.0)
            })
        })
        .collect()
}

#[cfg(test)]
mod tests;
