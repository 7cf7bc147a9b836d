//! The render head at one pose for a whole clip, and the derivative of what it renders: what training goes through.

use crate::bands::BandPlace;
use crate::number::single;
use crate::render::carrier::noise::{EarSpectra, LATE_SET, TAP_SET, band_places, hop_carriers, per_bin};
use crate::render::late::network::{LATE_HOPS, Late, late_gain, late_lead, left_ear};
use crate::render::transform::lanes::{Block, LANES, blocks_for};
use crate::render::transform::ring::{Slot, SlotMut};
use crate::render::voice_filters::DELAYED_TAPS;
use crate::stft::{Analysis, Synthesis};
use crate::{Bands, StftGrid, TailModel, TransferFunction, TransferShape};
use glam::{Quat, Vec2};
use promenade_fourier::RealToComplex;
use promenade_fourier::num_complex::Complex32;
use pulp::{Arch, Simd, WithSimd};
use std::ops::Range;
use std::sync::Arc;

/// Spectra one after the other, real and imaginary parts apart.
#[derive(Clone, Debug, Default, PartialEq)]
struct Frames {
    bins: usize,
    re: Vec<f32>,
    im: Vec<f32>,
}

impl Frames {
    fn new(count: usize, bins: usize) -> Self {
        Self { bins, re: vec![0.0; count * bins], im: vec![0.0; count * bins] }
    }

    fn of(spectra: &[&[Complex32]]) -> Self {
        let mut frames = Self::new(spectra.len(), spectra.first().map_or(0, |s| s.len()));
        for (t, spectrum) in spectra.iter().enumerate() {
            frames.set(t, spectrum);
        }
        frames
    }

    fn set(&mut self, frame: usize, spectrum: &[Complex32]) {
        let at = frame * self.bins;
        for (k, x) in spectrum.iter().enumerate() {
            (self.re[at + k], self.im[at + k]) = (x.re, x.im);
        }
    }

    fn get(&self, frame: usize, spectrum: &mut [Complex32]) {
        let (re, im) = self.frame(frame);
        for ((x, re), im) in spectrum.iter_mut().zip(re).zip(im) {
            *x = Complex32::new(*re, *im);
        }
    }

    fn frame(&self, frame: usize) -> (&[f32], &[f32]) {
        let range = frame * self.bins..(frame + 1) * self.bins;
        (&self.re[range.clone()], &self.im[range])
    }

    fn frame_mut(&mut self, frame: usize) -> (&mut [f32], &mut [f32]) {
        let range = frame * self.bins..(frame + 1) * self.bins;
        (&mut self.re[range.clone()], &mut self.im[range])
    }
}

/// A dry clip as the head takes it.
#[derive(Clone, Debug, PartialEq)]
pub struct ClipRenderInput {
    dry: Frames,
    /// Of each ear.
    tails: [Frames; 2],
    /// Frames that reach into the clip.
    heard: Range<usize>,
    /// Samples before the clip, and of the clip.
    pre_roll: usize,
    len: usize,
}

/// Renders clips with one transfer function each, as [`crate::Renderer`] does for a listener who rests, at the scene's own
/// rate.
///
/// The trainer makes one for each of its threads; it is not for the audio thread.
///
/// What is rendered is linear in masks, taps and late gains; [`Self::adjoint`] gives its derivative by all of them.
pub struct ClipRender {
    arch: Arch,
    grid: StftGrid,
    shape: TransferShape,
    places: Vec<BandPlace>,
    /// Carriers of both ears: explicit taps, then late hops.
    carriers: [Frames; 2],
    /// Per band, gain of each late hop for a late gain of 1.
    late_gains: Vec<Vec<f32>>,
    network: Late,
    analysis: Analysis,
    synthesis: Synthesis,
    forward: Arc<dyn RealToComplex<f32>>,
    scratch: Vec<Complex32>,
    spectrum: Vec<Complex32>,
    time: Vec<f32>,
}

impl ClipRender {
    /// Draws the carriers; allocates.
    #[must_use]
    pub fn new(grid: &StftGrid, bands: &Bands, tail: &TailModel, taps: usize) -> Self {
        let places = band_places(grid, bands, f32::INFINITY);
        let ears: Vec<EarSpectra> = [(TAP_SET, taps), (LATE_SET, LATE_HOPS)]
            .iter()
            .flat_map(|(set, hops)| hop_carriers(grid, grid, bands, tail, *set, *hops))
            .collect();
        let decay: Vec<f64> = tail.t60_s.iter().map(|t| 10.0_f64.powf(-3.0 * grid.hop_s() / f64::from(*t))).collect();
        let late = |hop| decay.iter().map(|d| Late::carrier_gain() * single(late_gain(*d, 1.0, hop, taps))).collect();
        let forward = promenade_fourier::forward(grid.n_fft);
        Self {
            arch: Arch::new(),
            grid: *grid,
            shape: TransferShape { bins: grid.bins(), bands: bands.count(), taps },
            carriers: [0, 1].map(|ear| Frames::of(&ears.iter().map(|e| &e[ear][..]).collect::<Vec<_>>())),
            late_gains: (0..LATE_HOPS).map(late).collect(),
            network: Late::new(grid, grid, tail, &per_bin(&places, &decay), &per_bin(&places, &tail.coherence)),
            places,
            analysis: Analysis::new(*grid),
            synthesis: Synthesis::new(*grid),
            scratch: forward.make_scratch_vec(),
            forward,
            spectrum: vec![Complex32::default(); grid.bins()],
            time: vec![0.0; grid.n_fft],
        }
    }

    /// Sizes of the transfer functions that are taken.
    #[must_use]
    pub fn shape(&self) -> TransferShape {
        self.shape
    }

    /// Transforms a dry clip for a head that is turned; its first `pre_roll` samples come before the clip, for the room to
    /// sound on from.
    #[must_use]
    pub fn analyse(&mut self, dry: &[f32], pre_roll: usize, orientation: Quat) -> ClipRenderInput {
        let (hop, bins) = (self.grid.hop, self.grid.bins());
        let lag = self.lag();
        let frames = (dry.len() + lag).div_ceil(hop);
        let mut input = ClipRenderInput {
            dry: Frames::new(frames, bins),
            tails: [(); 2].map(|()| Frames::new(frames, bins)),
            heard: (pre_roll + lag).saturating_sub(self.grid.n_fft).div_ceil(hop)..frames,
            pre_roll: pre_roll.min(dry.len()),
            len: dry.len().saturating_sub(pre_roll),
        };
        self.analysis.reset();
        self.network.reset();
        let blocks = blocks_for(bins);
        let [mut fed, mut left, mut right] = [(); 3].map(|()| vec![Block::default(); blocks]);
        let facing = left_ear(orientation, Vec2::Y);
        let late_from = self.shape.taps + 1 - late_lead(self.shape.taps);
        for t in 0..frames {
            let newest = self.analysis.newest();
            newest.fill(0.0);
            let part = dry.get(t * hop..).unwrap_or(&[]);
            let count = part.len().min(hop);
            newest[..count].copy_from_slice(&part[..count]);
            self.analysis.analyse(&mut self.spectrum);
            input.dry.set(t, &self.spectrum);
            if t >= late_from {
                input.dry.get(t - late_from, &mut self.spectrum);
                SlotMut::of(&mut fed).write(&self.spectrum);
            }
            self.network.advance(Slot::of(&fed), facing, [SlotMut::of(&mut left), SlotMut::of(&mut right)]);
            for (tail, late) in input.tails.iter_mut().zip([&left, &right]) {
                let (re, im) = tail.frame_mut(t);
                for (k, (re, im)) in re.iter_mut().zip(im).enumerate() {
                    (*re, *im) = (late[k / LANES].re[k % LANES], late[k / LANES].im[k % LANES]);
                }
            }
        }
        input
    }

    /// Both ears' sound of the clip, as long as the clip.
    #[must_use]
    pub fn render(&mut self, input: &ClipRenderInput, transfer: &TransferFunction) -> [Vec<f32>; 2] {
        let (hop, lag, bins) = (self.grid.hop, self.lag(), self.grid.bins());
        let from = input.pre_roll + lag;
        [0, 1].map(|ear| {
            let filters = self.filters(transfer, ear);
            self.synthesis.reset();
            let mut out = vec![0.0; input.heard.end * hop];
            let mut sum = Frames::new(1, bins);
            for t in input.heard.clone() {
                sum.re.fill(0.0);
                sum.im.fill(0.0);
                self.arch.dispatch(Filter { filters: &filters, input, ear, taps: self.shape.taps, frame: t, sum: &mut sum });
                sum.get(0, &mut self.spectrum);
                self.synthesis.synthesise(0, &mut self.spectrum, &mut out[t * hop..(t + 1) * hop]);
            }
            out[from..from + input.len].to_vec()
        })
    }

    /// The derivative of a number by the transfer function that a clip was rendered with, from its derivative by every sample
    /// of both ears: added to `out`. The phase is taken as given.
    ///
    /// # Panics
    /// If a gradient is shorter than the clip.
    pub fn adjoint(
        &mut self,
        input: &ClipRenderInput,
        transfer: &TransferFunction,
        gradient: [&[f32]; 2],
        out: &mut TransferFunction,
    ) {
        let (bins, bands, taps) = (self.shape.bins, self.shape.bands, self.shape.taps);
        let count = input.heard.len();
        for (ear, gradient) in gradient.into_iter().enumerate() {
            let frames = self.transform_gradient(input, gradient);
            let mut by_filter = Frames::new(1 + taps + LATE_HOPS, bins);
            self.arch.dispatch(Correlate { gradient: &frames, input, ear, taps, count, out: &mut by_filter });
            let sign = if ear == 0 { -1.0 } else { 1.0 };
            let turn_per_bin = self.turn_per_bin(transfer, ear);
            let phases = &transfer.phase[ear * bins..(ear + 1) * bins];
            for (k, phase) in phases.iter().enumerate() {
                let turn = Complex32::from_polar(1.0, turn_per_bin * k as f32);
                let at = |hop: usize| Complex32::new(by_filter.re[hop * bins + k], by_filter.im[hop * bins + k]);
                // By the delay, of something that is turned by it.
                let swing = Complex32::new(0.0, sign * std::f32::consts::PI * self.bin_hz() * k as f32);
                let (m, d) = (transfer.mixture[k], 1.0 + sign * transfer.difference[k]);
                let unit = turn * Complex32::from_polar(1.0, *phase);
                let by_gain = (unit.conj() * at(0)).re;
                out.mixture[k] += d * by_gain;
                out.difference[k] += sign * m * by_gain;
                out.delay_s += ((swing * unit * m * d).conj() * at(0)).re;
                let p = self.places[k];
                let shares = [(p.band, 1.0 - p.fraction), (p.band + 1, p.fraction)];
                for hop in 0..taps + LATE_HOPS {
                    let carrier = Complex32::new(self.carriers[ear].re[hop * bins + k], self.carriers[ear].im[hop * bins + k]);
                    let turned = if hop < DELAYED_TAPS.min(taps) { carrier * turn } else { carrier };
                    let by_gain = (turned.conj() * at(1 + hop)).re;
                    for (band, share) in shares {
                        if hop < taps {
                            out.taps[(2 * hop + ear) * bands + band] += share * by_gain;
                        } else {
                            out.late[ear * bands + band] += share * self.late_gains[hop - taps][band] * by_gain;
                        }
                    }
                    if hop < DELAYED_TAPS.min(taps) {
                        let gain: f32 = shares.iter().map(|(b, s)| s * transfer.taps[(2 * hop + ear) * bands + b]).sum();
                        out.delay_s += gain * ((swing * turned).conj() * at(1 + hop)).re;
                    }
                }
            }
        }
    }

    /// Samples from input to output besides what framing takes in blocks.
    fn lag(&self) -> usize {
        self.grid.latency_samples() - self.grid.hop
    }

    fn bin_hz(&self) -> f32 {
        single(self.grid.bin_hz(1))
    }

    /// Radians per bin that an ear is turned by its half of the interaural delay.
    fn turn_per_bin(&self, transfer: &TransferFunction, ear: usize) -> f32 {
        let sign = if ear == 0 { -1.0 } else { 1.0 };
        sign * std::f32::consts::PI * transfer.delay_s * self.bin_hz()
    }

    /// One ear's filters: direct sound, explicit taps, late hops.
    fn filters(&self, transfer: &TransferFunction, ear: usize) -> Frames {
        let (bins, bands, taps) = (self.shape.bins, self.shape.bands, self.shape.taps);
        let mut filters = Frames::new(1 + taps + LATE_HOPS, bins);
        let sign = if ear == 0 { -1.0 } else { 1.0 };
        let turn_per_bin = self.turn_per_bin(transfer, ear);
        for k in 0..bins {
            let turn = Complex32::from_polar(1.0, turn_per_bin * k as f32);
            let gain = transfer.mixture[k] * (1.0 + sign * transfer.difference[k]);
            let direct = turn * Complex32::from_polar(gain, transfer.phase[ear * bins + k]);
            (filters.re[k], filters.im[k]) = (direct.re, direct.im);
            let p = self.places[k];
            for hop in 0..taps + LATE_HOPS {
                let of = |band: usize| {
                    if hop < taps {
                        transfer.taps[(2 * hop + ear) * bands + band]
                    } else {
                        self.late_gains[hop - taps][band] * transfer.late[ear * bands + band]
                    }
                };
                let gain = of(p.band) + p.fraction * (of(p.band + 1) - of(p.band));
                let carrier = Complex32::new(self.carriers[ear].re[hop * bins + k], self.carriers[ear].im[hop * bins + k]);
                let filter = gain * if hop < DELAYED_TAPS.min(taps) { carrier * turn } else { carrier };
                let at = (1 + hop) * bins + k;
                (filters.re[at], filters.im[at]) = (filter.re, filter.im);
            }
        }
        filters
    }

    /// The derivative by every bin of the frames that are heard, by real and imaginary part.
    fn transform_gradient(&mut self, input: &ClipRenderInput, gradient: &[f32]) -> Frames {
        let (n, hop) = (self.grid.n_fft, self.grid.hop);
        let mut frames = Frames::new(input.heard.len(), self.grid.bins());
        let first = input.pre_roll + self.lag();
        for (i, t) in input.heard.clone().enumerate() {
            for (j, x) in self.time.iter_mut().enumerate() {
                let at = (t * hop + j).checked_sub(first);
                *x = at.filter(|at| *at < input.len).map_or(0.0, |at| gradient[at]);
            }
            let done = self.forward.process_with_scratch(&mut self.time, &mut self.spectrum, &mut self.scratch);
            debug_assert!(done.is_ok());
            // Every bin but the ends stands for its mirror image too; the ends are real.
            for (k, x) in self.spectrum.iter_mut().enumerate() {
                *x = if k == 0 || k == n / 2 { Complex32::new(x.re, 0.0) } else { 2.0 * *x };
            }
            frames.set(i, &self.spectrum);
        }
        frames
    }
}

/// Frame that an ear's filter reads: of the dry sound for the direct sound and the taps, of the late network for the rest.
fn read(input: &ClipRenderInput, ear: usize, taps: usize, filter: usize, frame: usize) -> Option<(&[f32], &[f32])> {
    if filter <= taps {
        frame.checked_sub(filter).map(|t| input.dry.frame(t))
    } else {
        frame.checked_sub(filter - 1 - taps).map(|t| input.tails[ear].frame(t))
    }
}

/// Sums what all filters make of one frame.
struct Filter<'a> {
    filters: &'a Frames,
    input: &'a ClipRenderInput,
    ear: usize,
    taps: usize,
    frame: usize,
    sum: &'a mut Frames,
}

impl WithSimd for Filter<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        for filter in 0..=self.taps + LATE_HOPS {
            let Some((x_re, x_im)) = read(self.input, self.ear, self.taps, filter, self.frame) else { continue };
            let (h_re, h_im) = self.filters.frame(filter);
            let sums = self.sum.re.iter_mut().zip(&mut self.sum.im);
            for (((((y_re, y_im), h_re), h_im), x_re), x_im) in sums.zip(h_re).zip(h_im).zip(x_re).zip(x_im) {
                *y_re += h_re * x_re - h_im * x_im;
                *y_im += h_re * x_im + h_im * x_re;
            }
        }
    }
}

/// Correlates the gradient with what every filter reads.
struct Correlate<'a> {
    gradient: &'a Frames,
    input: &'a ClipRenderInput,
    ear: usize,
    taps: usize,
    count: usize,
    out: &'a mut Frames,
}

impl WithSimd for Correlate<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        for i in 0..self.count {
            let (g_re, g_im) = self.gradient.frame(i);
            for filter in 0..=self.taps + LATE_HOPS {
                let Some((x_re, x_im)) = read(self.input, self.ear, self.taps, filter, self.input.heard.start + i) else {
                    continue;
                };
                let (y_re, y_im) = self.out.frame_mut(filter);
                let sums = y_re.iter_mut().zip(y_im);
                for (((((y_re, y_im), g_re), g_im), x_re), x_im) in sums.zip(g_re).zip(g_im).zip(x_re).zip(x_im) {
                    *y_re += g_re * x_re + g_im * x_im;
                    *y_im += g_im * x_re - g_re * x_im;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::carriers::Carriers;
    use crate::render::room::tests::Lone;
    use promenade_testing::{noise, noise_at};
    use std::sync::Arc;

    const GRID: StftGrid = StftGrid { sample_rate_hz: 8000.0, n_fft: 64, hop: 16 };
    const TAPS: usize = 9;

    fn room() -> (Bands, TailModel, TransferFunction) {
        let bands = Bands::for_rate(GRID.sample_rate_hz);
        let n = bands.count();
        let tail = TailModel { seed: 3, t60_s: vec![0.2; n], coherence: vec![0.3; n], by_phase: false };
        let shape = TransferShape { bins: GRID.bins(), bands: n, taps: TAPS };
        let values = |count: usize, of: u64, low: f32, high: f32| -> Vec<f32> {
            (0..count).map(|i| low + (high - low) * (0.5 + 0.5 * noise_at(of, i))).collect()
        };
        let transfer = TransferFunction {
            mixture: values(shape.bins, 1, 0.2, 1.0),
            difference: values(shape.bins, 2, -0.8, 0.8),
            phase: values(2 * shape.bins, 3, -0.5, 0.5),
            delay_s: 2.3e-4,
            taps: values(shape.tap_len() * TAPS, 4, 0.0, 0.5),
            late: values(shape.tap_len(), 5, 0.0, 0.3),
            shares: crate::transfer::Shares::FIRST,
        };
        (bands, tail, transfer)
    }

    #[test]
    fn renders_what_the_stream_does() {
        let (bands, tail, transfer) = room();
        let dry = noise(11, 700);
        let carriers = Arc::new(Carriers::of_noise(&GRID, &GRID, TAPS, &bands, &tail, 4000.0));
        let mut head = Lone::new(&GRID, ClipRender::new(&GRID, &bands, &tail, TAPS).shape(), &tail, &carriers);
        let facing = Quat::from_rotation_z(0.7);
        head.update(&transfer, facing);
        let (mut analysis, mut synthesis) = (Analysis::new(GRID), Synthesis::new(GRID));
        let spectrum = || vec![Complex32::default(); GRID.bins()];
        let (mut x, mut left, mut right) = (spectrum(), spectrum(), spectrum());
        let mut streamed = [Vec::new(), Vec::new()];
        for hop in 0..50 {
            for (i, s) in analysis.newest().iter_mut().enumerate() {
                *s = dry.get(hop * GRID.hop + i).copied().unwrap_or(0.0);
            }
            analysis.analyse(&mut x);
            head.render(&x, [&mut left, &mut right]);
            for (ear, y) in [&mut left, &mut right].into_iter().enumerate() {
                let mut out = vec![0.0; GRID.hop];
                synthesis.synthesise(ear, y, &mut out);
                streamed[ear].extend(out);
            }
        }
        let mut clips = ClipRender::new(&GRID, &bands, &tail, TAPS);
        for pre_roll in [0, 133, 300] {
            let input = clips.analyse(&dry, pre_roll, facing);
            let out = clips.render(&input, &transfer);
            for (streamed, out) in streamed.iter().zip(&out) {
                assert_eq!(out.len(), dry.len() - pre_roll);
                let from = pre_roll + clips.lag();
                let worst = out.iter().zip(&streamed[from..]).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
                assert!(worst < 1e-5, "{worst} with a pre-roll of {pre_roll}");
                assert!(out.iter().any(|v| v.abs() > 0.1));
            }
        }
    }

    #[test]
    fn the_adjoint_is_the_derivative() {
        let (bands, tail, transfer) = room();
        let mut clips = ClipRender::new(&GRID, &bands, &tail, TAPS);
        let input = clips.analyse(&noise(12, 500), 120, Quat::IDENTITY);
        let gradient = [noise(13, 380), noise(14, 380)];
        let mut by = clips.shape().silent();
        clips.adjoint(&input, &transfer, [&gradient[0], &gradient[1]], &mut by);
        let mut value = |t: &TransferFunction| -> f64 {
            let out = clips.render(&input, t);
            out.iter().zip(&gradient).flat_map(|(o, g)| o.iter().zip(g)).map(|(o, g)| f64::from(*o) * f64::from(*g)).sum()
        };
        let mut check = |what: &str, step: f32, change: &dyn Fn(&mut TransferFunction, f32), got: f32| {
            let mut ends = [1.0, -1.0].map(|sign| {
                let mut t = transfer.clone();
                change(&mut t, sign * step);
                value(&t)
            });
            ends[0] = (ends[0] - ends[1]) / (2.0 * f64::from(step));
            let scale = ends[0].abs().max(0.05);
            assert!((ends[0] - f64::from(got)).abs() < 2e-2 * scale, "{what}: {got}, differences give {}", ends[0]);
        };
        for k in [0, 1, 7, 20, 32] {
            check("mixture", 1e-2, &|t, s| t.mixture[k] += s, by.mixture[k]);
            check("difference", 1e-2, &|t, s| t.difference[k] += s, by.difference[k]);
        }
        for i in [0, 3, bands.count(), 3 * bands.count() + 2, by.taps.len() - 1] {
            check("tap", 1e-2, &|t, s| t.taps[i] += s, by.taps[i]);
        }
        for i in [0, bands.count() + 1, by.late.len() - 1] {
            check("late", 1e-2, &|t, s| t.late[i] += s, by.late[i]);
        }
        check("delay in ms", 1e-3, &|t, s| t.delay_s += 1e-3 * s, 1e-3 * by.delay_s);
    }
}
