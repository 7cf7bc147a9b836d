//! Binaural responses of a box room: image sources with HRTFs, and a statistical tail after them.
//!
//! Allen and Berkley, "Image method for efficiently simulating small-room acoustics", J. Acoust. Soc. Am. 65 (1979). The room is
//! the box from the origin to its size: metres, z up. Walls mirror, their absorption depends on the octave and not on the angle; air
//! absorbs nothing; the emitter radiates alike in all directions.

mod bins;
mod hrtf;
mod poses;
mod tail;
mod walls;

pub use hrtf::Hrtf;
pub use poses::{along, fit, random_poses};

use crate::{BakeError, Response, Responses};
use promenade_acoustics::{BoxImage, box_images};
use promenade_core::Pose;
use promenade_core::glam::Vec3;
pub use promenade_core::network::SPEED_OF_SOUND_M_S;
use promenade_fourier::ComplexToReal;
use promenade_fourier::num_complex::Complex32;
use std::sync::Arc;
use tail::{Tail, ends_real};

/// Centres of the octaves in which walls absorb, Hz.
pub const OCTAVES_HZ: [f32; 7] = [125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0];
/// Shares of the energy that a wall absorbs, by octave.
pub type Absorption = [f32; 7];
/// Highest order of images.
pub const MAX_ORDER: u32 = 20;
/// Longest response, seconds.
pub const MAX_LENGTH_S: f32 = 10.0;
/// Length that responses have at most unless told, seconds.
const LONGEST_BY_ITSELF_S: f32 = 4.0;
/// Least distance of a head from the emitter, metres.
const LEAST_DISTANCE_M: f32 = 0.1;
/// Samples before the arrival of an image at which its piece begins: the ripples of a fractional delay.
const LEAD: usize = 32;

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
    /// Length of the responses in seconds, above 0 and at most [`MAX_LENGTH_S`]; without it the longest reverberation time of the
    /// octaves, but at most 4.
    pub length_s: Option<f32>,
    /// Seed of the tails' noise.
    pub seed: u64,
}

impl Default for BoxOptions {
    fn default() -> Self {
        Self { sample_rate_hz: 24_000, order: 6, length_s: None, seed: 1 }
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
/// over [`SPEED_OF_SOUND_M_S`]; sample 0 is when the emitter sounds. `done` is called with the number of finished poses. The same input and seed
/// give the same samples.
///
/// # Errors
/// A room, an emitter or an option out of range; a pose outside the room or within 0.1 m of the emitter, which the message names by
/// its number from 0.
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
    let walls = walls::walls(room, hrtf.bins);
    let mut early = Early {
        emitter,
        size: room.size,
        hrtf,
        reflected: images.iter().map(|i| (*i, walls::left(i, &walls))).collect(),
        inverse: promenade_fourier::inverse(hrtf.bins.n_fft),
    };
    let tail = Tail::new(room, emitter, &images, hrtf, options, length);
    let mut responses = Vec::with_capacity(poses.len());
    for (index, pose) in poses.iter().enumerate() {
        let mut ears = [vec![0.0; length], vec![0.0; length]];
        early.add(pose, &mut ears);
        tail.add(pose.position, index as u64, &mut ears);
        let [left, right] = ears;
        responses.push(Response { listener: *pose, source: emitter, left, right, name: format!("pose-{index:05}") });
        done(index + 1);
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

/// The direct sound and the images.
struct Early<'a> {
    emitter: Vec3,
    size: Vec3,
    hrtf: &'a Hrtf,
    /// Images with what their walls leave, by bin.
    reflected: Vec<(BoxImage, Vec<Complex32>)>,
    inverse: Arc<dyn ComplexToReal<f32>>,
}

impl Early<'_> {
    fn add(&mut self, pose: &Pose, ears: &mut [Vec<f32>; 2]) {
        let bins = self.hrtf.bins;
        let mut spectrum = self.inverse.make_input_vec();
        let mut piece = self.inverse.make_output_vec();
        let mut scratch = self.inverse.make_scratch_vec();
        for (image, walls) in &self.reflected {
            let to_head = pose.to_head(position(image, self.emitter, self.size));
            let distance = to_head.length();
            let near = self.hrtf.near(to_head / distance);
            for (ear, out) in ears.iter_mut().enumerate() {
                let arrival = f64::from(distance / SPEED_OF_SOUND_M_S) * bins.sample_rate_hz + f64::from(near.delay(ear));
                let start = arrival.floor() - LEAD as f64;
                if start >= out.len() as f64 {
                    continue;
                }
                near.spectrum(ear, &mut spectrum);
                turn(&mut spectrum, walls, arrival - start, bins.n_fft, 1.0 / (distance * bins.n_fft as f32));
                // The lengths come from the plan, and the ends are real: the only things that the transform checks.
                let done = self.inverse.process_with_scratch(&mut spectrum, &mut piece, &mut scratch);
                debug_assert!(done.is_ok());
                let start = start as i64;
                let skip = usize::try_from(-start).unwrap_or(0);
                let from = usize::try_from(start).unwrap_or(0);
                for (o, v) in out.iter_mut().skip(from).zip(piece.iter().skip(skip)) {
                    *o += v;
                }
            }
        }
    }
}

/// Reflects, delays by samples and scales.
fn turn(spectrum: &mut [Complex32], walls: &[Complex32], delay: f64, n_fft: usize, gain: f32) {
    let angle = -2.0 * std::f64::consts::PI * delay / n_fft as f64;
    let step = promenade_fourier::num_complex::Complex64::cis(angle);
    let mut phase = promenade_fourier::num_complex::Complex64::new(f64::from(gain), 0.0);
    for (s, w) in spectrum.iter_mut().zip(walls) {
        let p = Complex32::new(phase.re as f32, phase.im as f32);
        *s *= w * p;
        phase *= step;
    }
    ends_real(spectrum);
}

#[cfg(test)]
mod tests;
