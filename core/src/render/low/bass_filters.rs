//! Responses of a room's bass at the low rates that they are heard at.

use crate::StftGrid;
use crate::latency::Pace;
use crate::number::{single, whole};
use crate::render::late::decay_curve::DecayCurve;
use crate::scene::{BASS_SIGNALS, BassEars, BassField};
use glam::Vec3;
use promenade_fourier::num_complex::Complex32;
use promenade_fourier::{forward, inverse};
use std::f64::consts::{PI, TAU};

/// Samples a second that the low half is heard at, times the crossover, at least.
const RATE: f64 = 10.0;
/// Half the length of the filters between both rates, samples of the low one.
pub(super) const REACH: usize = 4;
/// Shape of their window (Kaiser): 70 dB.
const KAISER: f64 = 6.76;
/// An ear lies so far from the head's centre, metres: half as far again as it is, since waves go round the head (Kuhn 1977).
pub(super) const EAR_M: f32 = 0.131;
/// Time over which a response goes from its beginning to the rest, seconds.
const JOINT_S: f64 = 0.01;
/// A listener may be so far beyond the places, metres.
const BEYOND_M: f32 = 10.0;
/// Velocities are not made below here, Hz.
const VELOCITY_FROM_HZ: f64 = 15.0;
/// Signals of a place where it is heard in Ambisonics: pressure, slopes, and the velocity's.
pub(super) const WITH_VELOCITY: usize = 7;

/// What all renderers of a scene's bass share at one rate.
pub(crate) struct BassFilters {
    pub(super) signals: usize,
    /// All of the responses at one rate, or their beginning and the rest.
    pub(super) rates: Vec<AtRate>,
    pub(super) speed_m_s: f32,
    /// How it dies away, by sample of the scene's: its modes ring as long as the walls let them, noise as its band does.
    pub(super) curve: DecayCurve,
}

/// Responses at a low rate.
pub(super) struct AtRate {
    /// Samples of the host for one of the low half.
    pub(super) every: usize,
    pub(super) rate_hz: f64,
    pub(super) length: usize,
    /// `[place][signal][sample]`
    pub(super) samples: Vec<f32>,
    /// Between both rates: the sum over it is 1.
    pub(super) window: Vec<f32>,
    /// Samples of the low rate by which a response's first comes after what was taken in, beside the filters' own; below 0
    /// where the first are not heard.
    pub(super) wait: f64,
    /// Share of each sample that is heard; empty for all of a response.
    pub(super) part: Vec<f32>,
}

impl AtRate {
    /// For a delay of so many samples of the host.
    fn new((bass, speed_m_s): (&BassField, f32), (every, delay): (usize, usize), host_hz: f64) -> Self {
        let rate_hz = host_hz / every as f64;
        let signals = signals(bass);
        let length = whole((bass.len() as f64 * rate_hz / bass.rate_hz).ceil()).max(1);
        let resampler = Resampler::new(bass.len(), rate_hz / bass.rate_hz);
        let mut samples = Vec::with_capacity(bass.place_count() * signals * length);
        for place in bass.samples.chunks_exact((BASS_SIGNALS * bass.len()).max(1)) {
            for signal in 0..signals {
                // Of a wave from somewhere the velocity is the slope's integral, times the speed of sound.
                let (from, velocity) = if signal < BASS_SIGNALS { (signal, false) } else { (signal - 3, true) };
                let one = &place[from * bass.len()..][..bass.len()];
                samples.extend(resampler.resample(one, length, |share| {
                    let number = TAU * share * bass.rate_hz / f64::from(speed_m_s);
                    match (bass.ears, velocity) {
                        // As loud to both ears in a diffuse field as it is.
                        (BassEars::Head, _) => {
                            let ear = number * f64::from(EAR_M);
                            Complex32::new(single((1.0 + ear * ear / 3.0).sqrt().recip()), 0.0)
                        }
                        (_, false) => Complex32::new(1.0, 0.0),
                        (_, true) if share * bass.rate_hz < VELOCITY_FROM_HZ => Complex32::default(),
                        (_, true) => Complex32::new(0.0, -single(number.recip())),
                    }
                }));
            }
        }
        let wait = delay as f64 / every as f64 - 2.0 * REACH as f64;
        Self { every, rate_hz, length, samples, window: window(every), wait, part: Vec::new() }
    }

    /// Keeps of the responses what is heard until the joint's end, of a listener so far away at most.
    fn beginning(mut self, from_s: f64, travels_s: f64) -> Self {
        let kept = whole(((travels_s + from_s + JOINT_S) * self.rate_hz).ceil()) + 2;
        if kept < self.length {
            self.samples = self.samples.chunks_exact(self.length).flat_map(|row| &row[..kept]).copied().collect();
            self.length = kept;
        }
        let taps = whole((self.wait + (from_s + JOINT_S) * self.rate_hz).ceil());
        self.part = (0..taps).map(|n| 1.0 - self.joint(n, from_s)).collect();
        self
    }

    /// Keeps what is heard from the joint on.
    fn rest(mut self, from_s: f64) -> Self {
        self.part = (0..self.length).map(|n| self.joint(n, from_s)).collect();
        self
    }

    /// Share of the rest in what is heard at a sample.
    fn joint(&self, n: usize, from_s: f64) -> f32 {
        let along = ((n as f64 - self.wait) / self.rate_hz - from_s) / JOINT_S;
        single(0.5 - 0.5 * (PI * along.clamp(0.0, 1.0)).cos())
    }
}

/// Signals of a place.
fn signals(bass: &BassField) -> usize {
    if bass.ears == BassEars::Head { BASS_SIGNALS } else { WITH_VELOCITY }
}

impl BassFilters {
    pub(crate) fn new(bass: &BassField, emitter: Vec3, speed_m_s: f32, grid: &StftGrid, pace: &Pace) -> Self {
        let host_hz = grid.sample_rate_hz;
        // The filters between both rates fit into the latency.
        let delay = pace.sample_delay;
        let least = whole((host_hz / (RATE * bass.crossover_hz)).floor()).max(1);
        let every = least.min(delay / (2 * REACH + 1)).max(1);
        let at = |every: usize| AtRate::new((bass, speed_m_s), (every, delay), host_hz);
        let farthest = BassField::places_of(&bass.places).map(|place| place.distance(emitter)).fold(0.0, f32::max);
        let mut first = at(every);
        first.wait = first.wait.max(0.0);
        let rates = if 2 * every > least {
            vec![first]
        } else {
            let rest = at(least);
            let from_s = -rest.wait / rest.rate_hz;
            let travels_s = f64::from((farthest + BEYOND_M) / speed_m_s);
            vec![first.beginning(from_s, travels_s), rest.rest(from_s)]
        };
        let mut energies = vec![0.0; bass.len()];
        for (place, responses) in
            BassField::places_of(&bass.places).zip(bass.samples.chunks_exact((BASS_SIGNALS * bass.len()).max(1)))
        {
            let travels = whole((f64::from(place.distance(emitter) / speed_m_s) * bass.rate_hz).round()).min(bass.len());
            let pressure = &responses[travels..bass.len()];
            energies.iter_mut().zip(pressure).for_each(|(energy, p)| *energy += f64::from(*p).powi(2));
        }
        let curve = DecayCurve::of_samples(&energies);
        Self { signals: signals(bass), rates, speed_m_s, curve }
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        let bytes = |at: &AtRate| size_of_val(&*at.samples) + size_of_val(&*at.window) + size_of_val(&*at.part);
        self.rates.iter().map(bytes).sum()
    }
}

/// A windowed sinc between both rates, `2 * REACH * every + 1` samples.
fn window(every: usize) -> Vec<f32> {
    let reach = (REACH * every) as f64;
    let bessel = |x: f64| {
        let (mut sum, mut term) = (1.0, 1.0);
        for n in 1..24 {
            term *= (0.5 * x / f64::from(n)).powi(2);
            sum += term;
        }
        sum
    };
    let at = |i: usize| {
        let t = i as f64 - reach;
        let x = PI * t / every as f64;
        let sinc = if t == 0.0 { 1.0 } else { x.sin() / x };
        sinc * bessel(KAISER * (1.0 - (t / (reach + 1.0)).powi(2)).max(0.0).sqrt())
    };
    let all: Vec<f64> = (0..2 * REACH * every + 1).map(at).collect();
    let sum: f64 = all.iter().sum();
    all.iter().map(|v| single(v / sum)).collect()
}

/// Takes signals of one length to another rate by their transforms.
struct Resampler {
    n: usize,
    to: usize,
}

impl Resampler {
    /// For signals of `length` samples; of the lengths of transforms that will do the one is taken whose ratio is nearest.
    fn new(length: usize, ratio: f64) -> Self {
        let off = |n: usize| {
            let to = n as f64 * ratio / 2.0;
            ((to - to.round()) / to).abs()
        };
        let shortest = length + 64;
        let all = (shortest..shortest + 256).filter(|n| n.is_multiple_of(2));
        let n = all.min_by(|a, b| off(*a).total_cmp(&off(*b))).unwrap_or(shortest);
        Self { n, to: 2 * whole((n as f64 * ratio / 2.0).round()).max(1) }
    }

    /// `filter` is asked at frequencies, shares of the signal's rate.
    fn resample(&self, signal: &[f32], length: usize, filter: impl Fn(f64) -> Complex32) -> Vec<f32> {
        let (forward, inverse) = (forward(self.n), inverse(self.to));
        let mut time = forward.make_input_vec();
        time[..signal.len()].copy_from_slice(signal);
        let mut bins = forward.make_output_vec();
        let mut to = inverse.make_input_vec();
        let mut out = inverse.make_output_vec();
        let scale = single((self.to as f64).recip());
        let done = forward.process(&mut time, &mut bins);
        debug_assert!(done.is_ok());
        let both = to.len().min(bins.len()) - 1;
        for (k, (to, bin)) in to.iter_mut().zip(&bins).enumerate().take(both).skip(1) {
            *to = *bin * filter(k as f64 / self.n as f64) * scale;
        }
        let done = inverse.process(&mut to, &mut out);
        debug_assert!(done.is_ok());
        out.resize(length, 0.0);
        out
    }
}
