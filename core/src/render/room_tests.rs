//! The render head against the equations of docs/signal-flow.md in double precision, stage by stage.

use super::*;
use crate::Bands;
use crate::decode::Change;
use crate::number::single;
use crate::render::carrier::noise::smooth_phases;
use crate::render::voice_filters::Plan;
use crate::stft::{Analysis, Synthesis};
use crate::{StftGrid, TailModel};
use promenade_fourier::num_complex::Complex64;
use promenade_testing::noise;
use std::f64::consts::PI;

const GRID: StftGrid = StftGrid { sample_rate_hz: 48_000.0, n_fft: 960, hop: 240 };
const TAPS: usize = 24;
const FRAMES: usize = 160;
/// Yaw of the head, radians.
const FACING: f64 = 0.7;

type Spectrum64 = Vec<Complex64>;

/// Parts of the head that sound.
#[derive(Clone, Copy, Default)]
struct Sounding {
    direct: bool,
    taps: bool,
    late: bool,
}

const ALL: Sounding = Sounding { direct: true, taps: true, late: true };

fn bands() -> Bands {
    Bands::for_rate(GRID.sample_rate_hz)
}

fn shape() -> TransferShape {
    TransferShape { bins: GRID.bins(), bands: bands().count(), taps: TAPS }
}

fn tail() -> TailModel {
    let count = bands().count();
    TailModel {
        seed: 11,
        t60_s: (0..count).map(|b| 0.8 - 0.02 * b as f32).collect(),
        coherence: vec![0.3; count],
        by_phase: false,
    }
}

/// A transfer function along a way from 0 to 1.
fn transfer(along: f32, sounding: Sounding) -> TransferFunction {
    let shape = shape();
    let mut tf = shape.silent();
    if sounding.direct {
        for k in 0..shape.bins {
            let bin = k as f32;
            tf.mixture[k] = 0.6 + 0.3 * (0.13 * bin + along).sin();
            tf.difference[k] = 0.7 * (0.05 * bin + 2.0 * along).sin();
            tf.phase[k] = -0.02 * bin * (1.0 + along);
            tf.phase[shape.bins + k] = 0.5 * (0.1 * bin + along).cos();
        }
    }
    tf.delay_s = 5e-4 * (3.0 * along - 1.0).sin();
    let gain =
        |hop: usize, i: usize| 0.1 * 0.93_f32.powi(hop as i32) * (1.0 + 0.3 * (0.7 * (i + hop) as f32 + 3.0 * along).sin());
    for (hop, gains) in tf.taps.chunks_exact_mut(shape.tap_len()).enumerate().filter(|_| sounding.taps) {
        gains.iter_mut().enumerate().for_each(|(i, g)| *g = gain(hop, i));
    }
    if sounding.late {
        tf.late.iter_mut().enumerate().for_each(|(i, g)| *g = gain(TAPS, i));
    }
    tf
}

fn double(x: &Complex32) -> Complex64 {
    Complex64::new(x.re.into(), x.im.into())
}

/// A delay of whole hops, bin by bin.
struct Delay {
    gain: Spectrum64,
    ring: Vec<Spectrum64>,
}

/// The head as its equations say. Carriers and the angles of the late part, which are drawn, are taken as they are.
struct Exact {
    carriers: Arc<Carriers>,
    centres_hz: Vec<f64>,
    inputs: Vec<Spectrum64>,
    tails: Vec<[Spectrum64; 2]>,
    diffusers: Vec<Delay>,
    lines: Vec<Delay>,
    frame: usize,
}

impl Exact {
    fn new(carriers: Arc<Carriers>) -> Self {
        let tail = tail();
        let centres_hz: Vec<f64> = bands().centres_hz().iter().map(|hz| f64::from(*hz)).collect();
        let decays: Vec<f64> = tail.t60_s.iter().map(|t| 10.0_f64.powf(-3.0 * GRID.hop_s() / f64::from(*t))).collect();
        let mut stream = 16;
        let mut delay = |hops: usize, turning: bool| {
            stream += 1;
            let turns = smooth_phases(&GRID, &GRID, tail.seed, stream);
            let gain = turns.iter().enumerate().map(|(k, turn)| {
                let decay = in_bands(&centres_hz, &decays, GRID.bin_hz(k)).powi(hops as i32);
                if turning { double(turn) / double(turn).norm() * decay } else { decay.into() }
            });
            Delay { gain: gain.collect(), ring: vec![vec![Complex64::default(); GRID.bins()]; hops] }
        };
        let diffusers = [1, 3, 5].map(|hops| delay(hops, false)).into();
        let lines = [11, 13, 17, 19].map(|hops| delay(hops, true)).into();
        Self { carriers, centres_hz, inputs: Vec::new(), tails: Vec::new(), diffusers, lines, frame: 0 }
    }

    /// One frame of the late network at each ear.
    fn advance(&mut self, input: &[Complex64]) -> [Spectrum64; 2] {
        let mut out = [(); 2].map(|()| vec![Complex64::default(); input.len()]);
        let coherence: Vec<f64> = tail().coherence.iter().map(|c| f64::from(*c)).collect();
        for k in 0..input.len() {
            let (mut x, mut kept) = (input[k], [input[k]; 3]);
            let g = 0.7;
            for (line, kept) in self.diffusers.iter_mut().zip(&mut kept) {
                let at = self.frame % line.ring.len();
                let delayed = line.gain[k] * line.ring[at][k];
                let entered = x + g * delayed;
                line.ring[at][k] = entered;
                (x, *kept) = (delayed - g * entered, entered);
            }
            let [a, b, c, d] =
                [0, 1, 2, 3].map(|i| self.lines[i].gain[k] * self.lines[i].ring[self.frame % self.lines[i].ring.len()][k]);
            for (line, fed) in self.lines.iter_mut().zip([a + b + c + d, a - b + c - d, a + b - c - d, a - b - c + d]) {
                let at = self.frame % line.ring.len();
                line.ring[at][k] = 0.5 * (x + fed);
            }
            let kept = kept.map(|kept| 0.95 * 0.51_f64.sqrt() * kept);
            let first = 0.95 * x + a - b + c - d;
            let [along, across] = [kept[2] + a + b - c - d, kept[1] + a - b - c + d];
            // The left ear of a head that is turned is at the left of its face.
            let differs = Complex64::i() * (-FACING.sin() * along + FACING.cos() * across);
            let common = in_bands(&self.centres_hz, &coherence, GRID.bin_hz(k));
            let (middle, apart) = ((0.5 + 0.5 * common).sqrt() * first, (0.5 - 0.5 * common).sqrt() * differs);
            (out[0][k], out[1][k]) = (middle + apart, middle - apart);
        }
        self.frame += 1;
        out
    }

    /// Both ears of the next frame.
    fn render(&mut self, spectrum: Spectrum64, tf: &TransferFunction) -> [Spectrum64; 2] {
        self.inputs.push(spectrum);
        let newest = self.inputs.len() - 1;
        let silence = vec![Complex64::default(); GRID.bins()];
        let fed = newest.checked_sub(TAPS - 6).map_or(silence, |t| self.inputs[t].clone());
        let tail = self.advance(&fed);
        self.tails.push(tail);
        let (bins, shape, t60_s) = (GRID.bins(), shape(), super::tests::tail().t60_s);
        let decay: Vec<f64> = t60_s.iter().map(|t| 10.0_f64.powf(-3.0 * GRID.hop_s() / f64::from(*t))).collect();
        let gains = |row: &[f32], ear: usize| -> Vec<f64> {
            row[ear * shape.bands..][..shape.bands].iter().map(|g| f64::from(*g)).collect()
        };
        [(0, -1.0), (1, 1.0)].map(|(ear, sign)| {
            let mut out = vec![Complex64::default(); bins];
            let turn = |k: usize| Complex64::cis(sign * PI * GRID.bin_hz(k) * f64::from(tf.delay_s));
            for (k, out) in out.iter_mut().enumerate() {
                let gain = f64::from(tf.mixture[k]) * (1.0 + sign * f64::from(tf.difference[k]));
                *out = Complex64::cis(tf.phase[ear * bins + k].into()) * turn(k) * gain * self.inputs[newest][k];
            }
            let carrier = |set: &crate::render::carrier::set::CarrierSet, hop: usize, k: usize| {
                let block = &set.hop(0, hop)[k / LANES].ears[ear];
                Complex64::new(block.re[k % LANES].into(), block.im[k % LANES].into())
            };
            for hop in (0..TAPS).filter(|hop| *hop < newest) {
                let gains = gains(&tf.taps[hop * shape.tap_len()..], ear);
                for (k, out) in out.iter_mut().enumerate() {
                    let gain = in_bands(&self.centres_hz, &gains, GRID.bin_hz(k));
                    let turn = if hop < 2 { turn(k) } else { 1.0.into() };
                    *out += gain * turn * carrier(&self.carriers.taps, hop, k) * self.inputs[newest - 1 - hop][k];
                }
            }
            let late = gains(&tf.late, ear);
            for hop in (0..8).filter(|hop| *hop <= newest) {
                let stated: Vec<f64> =
                    late.iter().zip(&decay).map(|(h, r)| h * r.powi(hop as i32 - 7) / 0.464_f64.sqrt()).collect();
                for (k, out) in out.iter_mut().enumerate() {
                    let gain = in_bands(&self.centres_hz, &stated, GRID.bin_hz(k));
                    *out += gain * carrier(&self.carriers.late, hop, k) * self.tails[newest - hop][ear][k];
                }
            }
            out
        })
    }
}

/// A value per band at a frequency.
fn in_bands(centres_hz: &[f64], values: &[f64], hz: f64) -> f64 {
    let above = centres_hz.partition_point(|c| *c <= hz);
    if above == 0 || above == centres_hz.len() {
        return values[above.min(values.len() - 1)];
    }
    let along = (hz - centres_hz[above - 1]) / (centres_hz[above] - centres_hz[above - 1]);
    values[above - 1] + along * (values[above] - values[above - 1])
}

/// The analysis window with the transform's length: three boxes of one hop, convolved, over the sum of their copies a hop
/// apart.
fn window() -> Vec<f64> {
    let hop = GRID.hop;
    let convolved = |a: &[f64], b: &[f64]| -> Vec<f64> {
        let at = |i: usize| (0..b.len()).filter(|j| *j <= i && i - j < a.len()).map(|j| a[i - j] * b[j]).sum();
        (0..a.len() + b.len() - 1).map(at).collect()
    };
    let unit = vec![1.0; hop];
    let mut spline = convolved(&convolved(&unit, &unit), &unit);
    spline.resize(3 * hop, 0.0);
    let sums: Vec<f64> = (0..hop).map(|i| spline[i] + spline[i + hop] + spline[i + 2 * hop]).collect();
    spline.iter().enumerate().map(|(i, v)| v / sums[i % hop] / GRID.n_fft as f64).collect()
}

/// Spectra of the frames of a signal, as the stream makes them.
fn analysed(x: &[f32]) -> Vec<Spectrum64> {
    let (window, forward) = (window(), promenade_fourier::forward::<f64>(GRID.n_fft));
    let frame = |t: usize| {
        let mut time = vec![0.0; GRID.n_fft];
        let first = (t as i64 + 1) * GRID.hop as i64 - window.len() as i64;
        for (i, w) in window.iter().enumerate() {
            let sample = usize::try_from(first + i as i64).map_or(0.0, |at| x[at].into());
            time[GRID.hop / 4 + i] = sample * w;
        }
        let mut spectrum = vec![Complex64::default(); GRID.bins()];
        forward.process(&mut time, &mut spectrum).unwrap();
        spectrum
    };
    (0..x.len() / GRID.hop).map(frame).collect()
}

/// The sound of an ear's frames.
fn synthesised(frames: &[Spectrum64]) -> Vec<f64> {
    let inverse = promenade_fourier::inverse::<f64>(GRID.n_fft);
    let mut out = vec![0.0; (frames.len() + 4) * GRID.hop];
    for (t, frame) in frames.iter().enumerate() {
        let (mut spectrum, mut time) = (frame.clone(), vec![0.0; GRID.n_fft]);
        (spectrum[0].im, spectrum[GRID.n_fft / 2].im) = (0.0, 0.0);
        inverse.process(&mut spectrum, &mut time).unwrap();
        out[t * GRID.hop..].iter_mut().zip(time).for_each(|(o, s)| *o += s);
    }
    out.truncate(frames.len() * GRID.hop);
    out
}

/// A lone voice in its room.
pub(crate) struct Lone {
    voices: [VoiceFilters; 1],
    room: Room,
    filter_hops: usize,
    taps: usize,
}

impl AsRef<VoiceFilters> for VoiceFilters {
    fn as_ref(&self) -> &VoiceFilters {
        self
    }
}

impl AsMut<VoiceFilters> for VoiceFilters {
    fn as_mut(&mut self) -> &mut VoiceFilters {
        self
    }
}

impl Lone {
    pub(crate) fn new(grid: &StftGrid, shape: TransferShape, tail: &TailModel, carriers: &Arc<Carriers>) -> Self {
        let plan = Plan { grid, scene_grid: grid, shape, tail, carriers, own_taps: shape.taps };
        let (voices, room) = ([VoiceFilters::new(&plan)], Room::new(&plan));
        Self { filter_hops: room.filter_hops(&voices[0]), voices, room, taps: shape.taps }
    }

    /// Is heard by a transfer function, with the head turned.
    pub(crate) fn update(&mut self, tf: &TransferFunction, facing: Quat) {
        let change = Change::whole(self.filter_hops, self.taps);
        self.room.face(facing, true);
        self.voices[0].update(tf, &change);
        self.room.update(tf, &change);
    }

    pub(crate) fn render(&mut self, spectrum: &[Complex32], ears: [&mut [Complex32]; 2]) {
        self.voices[0].is_heard = true;
        self.voices[0].write(spectrum);
        self.room.render(&mut self.voices, false, &Trim::NEUTRAL, ears).unwrap();
    }
}

fn head() -> Lone {
    let carriers = Arc::new(Carriers::of_noise(&GRID, &GRID, TAPS, &bands(), &tail(), 20_000.0));
    Lone::new(&GRID, shape(), &tail(), &carriers)
}

/// Where the listener is on the way at a frame.
fn along(frame: usize, moves: bool) -> f32 {
    if moves { frame as f32 / FRAMES as f32 } else { 0.4 }
}

/// Plays one frame with a transfer function.
fn play(head: &mut Lone, spectrum: &[Complex32], tf: &TransferFunction) -> [Vec<Complex32>; 2] {
    head.update(tf, Quat::from_rotation_z(single(FACING)));
    let mut ears = [vec![Complex32::default(); GRID.bins()], vec![Complex32::default(); GRID.bins()]];
    let [left, right] = &mut ears;
    head.render(spectrum, [left, right]);
    ears
}

/// Energy of an error and of what it is an error of.
#[derive(Default)]
struct Ratio {
    error: f64,
    whole: f64,
}

impl Ratio {
    fn add(&mut self, found: Complex64, want: Complex64) {
        self.error += (found - want).norm_sqr();
        self.whole += want.norm_sqr();
    }

    fn db(&self) -> f64 {
        10.0 * (self.error / self.whole).log10()
    }
}

fn single_spectrum(spectrum: &[Complex64]) -> Vec<Complex32> {
    spectrum.iter().map(|x| Complex32::new(single(x.re), single(x.im))).collect()
}

/// Error of the head's parts alone: the same spectra in, spectra out.
fn head_db(sounding: Sounding, moves: bool) -> f64 {
    let x = noise(21, FRAMES * GRID.hop);
    let mut head = head();
    let mut exact = Exact::new(Arc::clone(head.room.carriers()));
    let mut ratio = Ratio::default();
    for (t, frame) in analysed(&x).iter().enumerate() {
        let (tf, frame) = (transfer(along(t, moves), sounding), single_spectrum(frame));
        let found = play(&mut head, &frame, &tf);
        let want = exact.render(frame.iter().map(double).collect(), &tf);
        for (found, want) in found.iter().flatten().zip(want.iter().flatten()) {
            ratio.add(double(found), *want);
        }
    }
    ratio.db()
}

/// Error of the whole way from samples to samples, and of its two transforms.
fn stream_db(moves: bool) -> [f64; 3] {
    let x = noise(21, FRAMES * GRID.hop);
    let mut head = head();
    let (mut analysed_by, mut synthesised_by, mut back) = (Analysis::new(GRID), Synthesis::new(GRID), Synthesis::new(GRID));
    let mut exact = Exact::new(Arc::clone(head.room.carriers()));
    let (mut analysis, mut synthesis, mut total) = (Ratio::default(), Ratio::default(), Ratio::default());
    let mut want = [Vec::new(), Vec::new()];
    let (mut heard, mut given) = ([Vec::new(), Vec::new()], [Vec::new(), Vec::new()]);
    let (mut spectrum, mut hop) = (vec![Complex32::default(); GRID.bins()], vec![0.0; GRID.hop]);
    for (t, (frame, dry)) in analysed(&x).into_iter().zip(x.chunks_exact(GRID.hop)).enumerate() {
        let tf = transfer(along(t, moves), ALL);
        analysed_by.newest().copy_from_slice(dry);
        analysed_by.analyse(&mut spectrum);
        spectrum.iter().zip(&frame).for_each(|(found, want)| analysis.add(double(found), *want));
        let ears = play(&mut head, &spectrum, &tf);
        for (ear, (exact, mut played)) in exact.render(frame, &tf).into_iter().zip(ears).enumerate() {
            let mut rounded = single_spectrum(&exact);
            want[ear].push(exact);
            synthesised_by.synthesise(ear, &mut played, &mut hop);
            heard[ear].extend_from_slice(&hop);
            back.synthesise(ear, &mut rounded, &mut hop);
            given[ear].extend_from_slice(&hop);
        }
    }
    for (ear, want) in want.iter().enumerate() {
        for ((want, heard), given) in synthesised(want).into_iter().zip(&heard[ear]).zip(&given[ear]) {
            total.add(f64::from(*heard).into(), want.into());
            synthesis.add(f64::from(*given).into(), want.into());
        }
    }
    [analysis.db(), synthesis.db(), total.db()]
}

#[test]
fn single_precision_is_heard_in_no_stage() {
    let only = Sounding::default();
    for moves in [false, true] {
        let [analysis, synthesis, total] = stream_db(moves);
        let stages = [
            ("transform", analysis, -130.0),
            ("direct sound", head_db(Sounding { direct: true, ..only }, moves), -125.0),
            ("taps", head_db(Sounding { taps: true, ..only }, moves), -125.0),
            ("late part", head_db(Sounding { late: true, ..only }, moves), -125.0),
            ("synthesis", synthesis, -130.0),
            ("all", total, -125.0),
        ];
        for (stage, db, most) in stages {
            println!("{stage}, {}: {db:.1} dB", if moves { "moving" } else { "standing" });
            assert!(db < most, "{stage}: {db} dB, expected less than {most}");
        }
    }
}
