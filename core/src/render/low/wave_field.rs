//! The bass of a room as waves have it: the lower half of the dry sound through responses at a low rate.
//!
//! The low half is taken at about ten times the crossover, heard through one response for each ear that is mixed anew when the
//! listener moves, and brought back. All of it fits into the latency of the frames. Where there is less, the beginning of a
//! response is heard at a higher rate, and the rest of it, which may come later, at that one.

use crate::decode::NEAREST_M;
use crate::latency::Pace;
use crate::number::{single, whole};
use crate::render::late::decay_curve::DecayCurve;
use crate::render::low::crossover::Crossover;
use crate::render::part::{Heard, Hop, Part};
use crate::render::transform::lanes::WeightedSum;
use crate::scene::{BASS_SIGNALS, BassEars, BassField};
use crate::{EARLY_S, Pose, Scene, StftGrid, Trim};
use glam::Vec3;
use promenade_fourier::num_complex::Complex32;
use promenade_fourier::{forward, inverse};
use pulp::Arch;
use std::f64::consts::{PI, TAU};
use std::ops::Range;
use std::sync::Arc;

/// Samples a second that the low half is heard at, times the crossover, at least.
const RATE: f64 = 10.0;
/// Half the length of the filters between both rates, samples of the low one.
const REACH: usize = 4;
/// Shape of their window (Kaiser): 70 dB.
const KAISER: f64 = 6.76;
/// An ear lies so far from the head's centre, metres: half as far again as it is, since waves go round the head (Kuhn 1977).
const EAR_M: f32 = 0.131;
/// Time over which a response goes from early to late, seconds.
const BORDER_S: f64 = 0.005;
/// Time over which a response goes from its beginning to the rest, seconds.
const JOINT_S: f64 = 0.01;
/// A listener may be so far beyond the places, metres.
const BEYOND_M: f32 = 10.0;
/// Velocities are not made below here, Hz.
const VELOCITY_FROM_HZ: f64 = 15.0;
/// Signals of a place where it is heard in Ambisonics: pressure, slopes, and the velocity's.
const WITH_VELOCITY: usize = 7;
/// Signals that are mixed at a pose, at most: those of the corners of a cell.
const MOST_SIGNALS: usize = 8 * WITH_VELOCITY;

/// What all renderers of a scene's bass share at one rate.
pub(crate) struct BassFilters {
    signals: usize,
    /// All of the responses at one rate, or their beginning and the rest.
    rates: Vec<AtRate>,
    speed_m_s: f32,
    /// How it dies away, by sample of the scene's: its modes ring as long as the walls let them, noise as its band does.
    curve: DecayCurve,
}

/// Responses at a low rate.
struct AtRate {
    /// Samples of the host for one of the low half.
    every: usize,
    rate_hz: f64,
    length: usize,
    /// `[place][signal][sample]`
    samples: Vec<f32>,
    /// Between both rates: the sum over it is 1.
    window: Vec<f32>,
    /// Samples of the low rate by which a response's first comes after what was taken in, beside the filters' own; below 0
    /// where the first are not heard.
    wait: f64,
    /// Share of each sample that is heard; empty for all of a response.
    part: Vec<f32>,
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

/// The newest samples of a stream, so kept that as many as wanted lie one after the other, the newest first.
struct Newest {
    samples: Vec<f32>,
    length: usize,
    at: usize,
}

impl Newest {
    fn new(length: usize) -> Self {
        Self { samples: vec![0.0; 2 * length], length, at: 0 }
    }

    fn push(&mut self, x: f32) {
        self.at = if self.at == 0 { self.length - 1 } else { self.at - 1 };
        self.samples[self.at] = x;
        self.samples[self.at + self.length] = x;
    }

    fn all(&self) -> &[f32] {
        &self.samples[self.at..self.at + self.length]
    }

    fn reset(&mut self) {
        self.samples.fill(0.0);
    }
}

/// Sum of products; what lies beyond the shorter is left out.
fn dot(a: &[f32], b: &[f32]) -> f32 {
    let (a, a_rest) = a[..a.len().min(b.len())].as_chunks::<8>();
    let (b, b_rest) = b.as_chunks::<8>();
    let mut sums = [0.0; 8];
    for (a, b) in a.iter().zip(b) {
        for i in 0..8 {
            sums[i] += a[i] * b[i];
        }
    }
    let b_rest = b.get(a.len()).map_or(b_rest, |chunk| &chunk[..]);
    sums.iter().sum::<f32>() + a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum::<f32>()
}

/// What one stream hears at one of the low rates.
struct Convolver {
    /// The low half at the host's rate, and how many samples are missing to the next of the low rate.
    fine: Newest,
    missing: usize,
    low: Newest,
    /// What both ears hear at the low rate.
    heard: [Newest; 2],
    /// Responses of both ears, as they are and as they were.
    now: [Vec<f32>; 2],
    before: [Vec<f32>; 2],
    mixed: Vec<f32>,
    gains: Vec<f32>,
    /// The decay that `gains` are of.
    decayed: Option<(f32, f32, f32)>,
}

impl Convolver {
    fn new(at: &AtRate) -> Self {
        let taps = if at.part.is_empty() { at.length + whole(at.wait.max(0.0).ceil()) + 2 } else { at.part.len() };
        let ears = || [vec![0.0; taps], vec![0.0; taps]];
        Self {
            fine: Newest::new(at.window.len()),
            missing: at.every,
            low: Newest::new(taps),
            heard: [(); 2].map(|()| Newest::new(2 * REACH + 2)),
            now: ears(),
            before: ears(),
            mixed: vec![0.0; at.length],
            gains: vec![1.0; at.length],
            decayed: None,
        }
    }

    /// Takes a sample of the low half, and gives what both ears hear of it; `along` says how far between the responses of
    /// before and those of now, if they differ.
    fn hear(&mut self, at: &AtRate, low: f32, along: Option<f32>) -> [f32; 2] {
        self.fine.push(low);
        self.missing -= 1;
        if self.missing == 0 {
            self.missing = at.every;
            self.low.push(dot(&at.window, self.fine.all()));
            for ((heard, now), before) in self.heard.iter_mut().zip(&self.now).zip(&self.before) {
                let new = dot(now, self.low.all());
                heard.push(along.map_or(new, |along| {
                    let old = dot(before, self.low.all());
                    old + along * (new - old)
                }));
            }
        }
        // Samples since the newest of the low rate.
        let since = at.every - self.missing;
        self.heard.each_ref().map(|heard| {
            let phases = at.window.iter().skip(since % at.every).step_by(at.every);
            let sum: f32 = phases.zip(heard.all()).map(|(w, x)| w * x).sum();
            sum * at.every as f32
        })
    }

    /// Sets the gains of a response's samples: early and late, and the decay.
    fn set_gains(&mut self, bass: &BassField, filters: &BassFilters, (at, travels): (&AtRate, f64), trim: &Trim) {
        let plain = trim.early == 1.0 && trim.late == 1.0 && trim.decay == 1.0;
        let wanted = (trim.early, trim.late, trim.decay);
        if plain && self.decayed != Some(wanted) {
            self.gains.fill(1.0);
        }
        if !plain {
            for (i, gain) in self.gains.iter_mut().enumerate() {
                let after_s = (i as f64 - travels).max(0.0) / at.rate_hz;
                let border = ((after_s - EARLY_S) / BORDER_S + 0.5).clamp(0.0, 1.0);
                let times = f64::from(trim.decay);
                let decay = if times == 1.0 { 0.0 } else { filters.curve.log_gain(0, after_s * bass.rate_hz, times) };
                *gain = (trim.early + single(border) * (trim.late - trim.early)) * single(decay.exp());
            }
        }
        self.decayed = Some(wanted);
    }

    fn silence(&mut self) {
        self.fine.reset();
        self.low.reset();
        self.heard.iter_mut().for_each(Newest::reset);
    }

    fn memory_bytes(&self) -> usize {
        let taps = self.now[0].len();
        4 * (4 * taps + 2 * taps + self.mixed.len() + self.gains.len() + 2 * self.fine.length)
    }
}

/// The bass of a scene, for one stream.
pub(crate) struct WaveBass {
    arch: Arch,
    scene: Arc<Scene>,
    emitter: Vec3,
    filters: Arc<BassFilters>,
    crossover: Crossover,
    /// By rate of the filters.
    convolvers: Vec<Convolver>,
    /// The pose and trim that the convolvers' responses are of.
    set: Option<(Pose, Trim)>,
    /// The bass of the newest hop.
    out: [Vec<f32>; 2],
    /// The pose and trim that the hop goes to.
    wanted: Option<(Pose, Trim)>,
    /// Whether responses as they are and as they were differ in this hop.
    moves: bool,
    /// Samples since there was input, and after how many nothing sounds any more.
    quiet: usize,
    longest: usize,
}

impl WaveBass {
    /// `None` for a scene without. `filters` are the scene's at the grid's rate.
    pub(crate) fn new(scene: &Arc<Scene>, grid: &StftGrid, filters: &Arc<BassFilters>) -> Option<Self> {
        let (bass, emitter) = (scene.bass()?, scene.emitter()?);
        let mut new = Self {
            arch: Arch::new(),
            scene: Arc::clone(scene),
            emitter,
            crossover: Crossover::new(bass.crossover_hz, grid.sample_rate_hz),
            convolvers: filters.rates.iter().map(Convolver::new).collect(),
            set: None,
            out: [vec![0.0; grid.hop], vec![0.0; grid.hop]],
            wanted: None,
            moves: false,
            quiet: usize::MAX / 2,
            longest: 0,
            filters: Arc::clone(filters),
        };
        new.longest = new.tail_samples() + 2 * grid.hop;
        Some(new)
    }

    /// Takes the pose that was asked for, once the hop is heard.
    fn follow(&mut self) {
        let Some((pose, trim)) = &self.wanted.take() else { return };
        self.moves = self.set != Some((*pose, *trim));
        if self.moves {
            let fresh = self.set.is_none();
            self.convolvers.iter_mut().for_each(|convolver| std::mem::swap(&mut convolver.now, &mut convolver.before));
            self.mix(pose, trim);
            if fresh {
                for Convolver { before, now, .. } in &mut self.convolvers {
                    before.iter_mut().zip(now).for_each(|(before, now)| before.copy_from_slice(now));
                }
            }
            self.set = Some((*pose, *trim));
        }
    }

    /// Takes samples of the hop, the first of number `at`, and leaves their upper half.
    fn split(&mut self, samples: &mut [f32], at: usize) {
        self.quiet = if samples.iter().any(|x| *x != 0.0) { 0 } else { self.quiet.saturating_add(samples.len()) };
        if self.quiet > self.longest {
            if self.quiet - samples.len() <= self.longest {
                self.silence();
            }
            self.out.iter_mut().for_each(|out| out[at..at + samples.len()].fill(0.0));
            return;
        }
        self.follow();
        let count = self.out[0].len() as f32;
        for (i, x) in (at..).zip(samples) {
            let [low, high] = self.crossover.split(f64::from(*x));
            *x = single(high);
            let along = (i + 1) as f32 / count;
            let along = self.moves.then_some(along * along * (3.0 - 2.0 * along));
            let mut ears = [0.0; 2];
            for (convolver, at) in self.convolvers.iter_mut().zip(&self.filters.rates) {
                let heard = convolver.hear(at, single(low), along);
                ears.iter_mut().zip(heard).for_each(|(ear, heard)| *ear += heard);
            }
            self.out.iter_mut().zip(ears).for_each(|(out, ear)| out[i] = ear);
        }
    }

    /// Mixes what both ears hear at a pose.
    fn mix(&mut self, pose: &Pose, trim: &Trim) {
        let scene = Arc::clone(&self.scene);
        let Some(bass) = scene.bass() else { return };
        let filters = Arc::clone(&self.filters);
        let away = pose.position.distance(self.emitter);
        let axes = Vec3::AXES.map(|axis| pose.orientation.inverse() * axis);
        for (convolver, at) in self.convolvers.iter_mut().zip(&filters.rates) {
            let travels = f64::from(away / filters.speed_m_s) * at.rate_hz;
            convolver.set_gains(bass, &filters, (at, travels), trim);
        }
        for ear in 0..2 {
            let mut rows = [(0, 0.0); MOST_SIGNALS];
            let mut places = rows.iter_mut();
            for shares in bass.shares(pose.position) {
                let mut signals = [0.0; WITH_VELOCITY];
                self.ear_shares(bass.ears, ear, &shares, &axes, trim.width, &mut signals);
                let heard = signals.iter().enumerate().take(filters.signals).filter(|(_, share)| **share != 0.0);
                for ((signal, share), place) in heard.zip(&mut places) {
                    let row = shares.place * filters.signals + signal;
                    *place = (u32::try_from(row).unwrap_or_default(), *share);
                }
            }
            let free = places.len();
            let corners = &rows[..MOST_SIGNALS - free];
            // The direct sound, as late at an ear as it is for a head in long waves.
            let towards = pose.to_head(self.emitter) / away.max(1e-6);
            let (level, later_m) = match (bass.ears, ear) {
                (BassEars::Head, 0) => (1.0, -EAR_M * towards.y),
                (BassEars::Head, _) => (1.0, EAR_M * towards.y),
                (BassEars::Pair(0), 0) => (1.0, 0.0),
                (BassEars::Pair(0), _) => (towards.y, 0.0),
                (BassEars::Pair(1), 0) => (towards.z, 0.0),
                (BassEars::Pair(1), _) => (towards.x, 0.0),
                (BassEars::Pair(_), _) => (0.0, 0.0),
            };
            let level = level * trim.direct * bass.direct / away.max(NEAREST_M);
            for (n, (convolver, at)) in self.convolvers.iter_mut().zip(&filters.rates).enumerate() {
                let mixed = &mut convolver.mixed;
                self.arch.dispatch(WeightedSum { rows: &at.samples, corners, row_len: at.length, offset: 0, out: mixed });
                mixed.iter_mut().zip(&convolver.gains).for_each(|(m, g)| *m *= g);
                let out = &mut convolver.now[ear];
                let travels = f64::from(away / filters.speed_m_s) * at.rate_hz;
                move_earlier(mixed, travels - at.wait, out);
                out.iter_mut().zip(&at.part).for_each(|(out, part)| *out *= part);
                if n == 0 {
                    let after = at.wait + f64::from(later_m / filters.speed_m_s) * at.rate_hz;
                    add_impulse(out, after, level);
                }
            }
        }
    }

    /// Shares of a place's signals in what an ear hears; `axes` are the world's, as the head has them.
    fn ear_shares(
        &self,
        ears: BassEars,
        ear: usize,
        shares: &crate::scene::BassShares,
        axes: &[Vec3; 3],
        width: f32,
        out: &mut [f32; WITH_VELOCITY],
    ) {
        // A slope along the head's axis to the left is the mix of the world's that this axis is of.
        let mut velocity = |along: usize| {
            for axis in 0..3 {
                out[4 + axis] = shares.straight * axes[axis][along];
            }
        };
        match (ears, ear) {
            (BassEars::Head, _) => {
                let side = width * if ear == 0 { EAR_M } else { -EAR_M };
                for (signal, out) in out.iter_mut().enumerate().take(BASS_SIGNALS) {
                    let slope: f32 = (0..3).map(|axis| axes[axis].y * shares.of[1 + axis][signal]).sum();
                    *out = shares.of[0][signal] + side * slope;
                }
            }
            (BassEars::Pair(0), 0) => out[..BASS_SIGNALS].copy_from_slice(&shares.of[0]),
            (BassEars::Pair(0), _) => velocity(1),
            (BassEars::Pair(1), 0) => velocity(2),
            (BassEars::Pair(1), _) => velocity(0),
            (BassEars::Pair(_), _) => {}
        }
    }

    fn silence(&mut self) {
        self.crossover.reset();
        self.convolvers.iter_mut().for_each(Convolver::silence);
    }
}

impl Part for WaveBass {
    /// Over the hop the listener moves to where it ends.
    fn begin(&mut self, hop: &Hop<'_>) {
        self.moves = false;
        self.wanted = Some((hop.to, hop.trim));
    }

    fn take(&mut self, hop: &mut [f32], span: Range<usize>, heard: &mut Heard<'_>) {
        self.split(&mut hop[span.clone()], span.start);
        for (ear, out) in heard.ears.iter_mut().zip(&self.out) {
            ear.iter_mut().zip(&out[span.clone()]).for_each(|(ear, out)| *ear += out);
        }
    }

    fn tail_samples(&self) -> usize {
        let rates = self.convolvers.iter().zip(&self.filters.rates);
        rates.map(|(convolver, at)| (convolver.now[0].len() + 4 * REACH) * at.every).max().unwrap_or(0)
    }

    fn reset(&mut self) {
        self.silence();
        self.convolvers.iter_mut().zip(&self.filters.rates).for_each(|(convolver, at)| convolver.missing = at.every);
        self.set = None;
        self.quiet = usize::MAX / 2;
        self.out.iter_mut().for_each(|out| out.fill(0.0));
    }

    fn memory_bytes(&self) -> usize {
        self.convolvers.iter().map(Convolver::memory_bytes).sum::<usize>() + self.out[0].len() * 8
    }
}

/// Weights of the four samples about a place that lies so far from the second to the third (Lagrange).
fn cubic(t: f32) -> [f32; 4] {
    [
        -t * (t - 1.0) * (t - 2.0) / 6.0,
        (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0,
        -(t + 1.0) * t * (t - 2.0) / 2.0,
        (t + 1.0) * t * (t - 1.0) / 6.0,
    ]
}

/// Puts samples into `out`, moved earlier by so many samples.
fn move_earlier(samples: &[f32], earlier: f64, out: &mut [f32]) {
    let base = earlier.floor();
    let weights = cubic(single(earlier - base));
    let at = |i: f64| if i >= 0.0 { samples.get(whole(i)).copied().unwrap_or(0.0) } else { 0.0 };
    // The outputs of which all four samples are there.
    let from = whole((1.0 - base).max(0.0)).min(out.len());
    let inner = samples.get(whole((base - 1.0).max(0.0))..).unwrap_or_default();
    let to = (from + inner.len().saturating_sub(3)).min(out.len());
    for (out, four) in out[from..to].iter_mut().zip(inner.windows(4)) {
        *out = weights.iter().zip(four).map(|(w, x)| w * x).sum();
    }
    for n in (0..from).chain(to..out.len()) {
        let first = base + n as f64 - 1.0;
        out[n] = weights.iter().enumerate().map(|(k, w)| w * at(first + k as f64)).sum();
    }
}

/// Adds an impulse between samples, by Lagrange's cubic; one before the first is at the first.
fn add_impulse(out: &mut [f32], at: f64, level: f32) {
    let at = at.max(1.0);
    let base = at.floor();
    let weights = cubic(single(at - base));
    let first = whole(base) - 1;
    for (k, weight) in weights.iter().enumerate() {
        if let Some(out) = out.get_mut(first + k) {
            *out += level * weight;
        }
    }
}
