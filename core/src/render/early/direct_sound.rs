//! The direct sound's filter: masks, phase and interaural delay per bin.

use crate::number::{single, whole};
use crate::render::early::phasor::Phasors;
use crate::render::transform::lanes::{Block, EarBlocks, LANES, blocks_for};
use crate::{StftGrid, TransferFunction};
use promenade_fourier::num_complex::Complex64;
use pulp::{Arch, WithSimd};
use std::ops::Range;

/// From this share of the highest frequency of the data on, what holds above it takes over: here, and in the carriers of the
/// room.
pub(crate) const TAKES_OVER_FROM: f64 = 0.92;
/// The level that holds is measured from this share on.
const MEASURED_FROM: f64 = 0.7;

/// Real and imaginary parts of a spectrum.
type Parts = [Vec<f32>; 2];

/// Filter of the direct sound at both ears on a host's grid.
pub(crate) struct DirectFilter {
    arch: Arch,
    bin_map: BinMap,
    top: Top,
    scene_bins: usize,
    bin_hz: f64,
    /// Gain and phase of each ear on the scene's bins.
    on_scene: [Parts; 2],
    /// The filter's parts on the host's bins, `[ear]`.
    on_host: [Parts; 2],
    /// Half the interaural delay per bin, as the left ear's phasor; the right ear's is its conjugate.
    turn: Vec<Block>,
    filter: Vec<EarBlocks>,
}

impl DirectFilter {
    pub(crate) fn new(grid: &StftGrid, scene_grid: &StftGrid, top_hz: f32) -> Self {
        let blocks = blocks_for(grid.bins());
        let parts = |len: usize| std::array::from_fn(|_| [vec![0.0; len], vec![0.0; len]]);
        Self {
            arch: Arch::new(),
            bin_map: BinMap::new(grid, scene_grid, top_hz),
            top: Top::new(grid, scene_grid, f64::from(top_hz)),
            scene_bins: scene_grid.bins(),
            bin_hz: grid.bin_hz(1),
            on_scene: parts(scene_grid.bins()),
            on_host: parts(blocks * LANES),
            turn: vec![Block::default(); blocks],
            filter: vec![EarBlocks::default(); blocks],
        }
    }

    /// The filter, one block of both ears after the other.
    pub(crate) fn blocks(&self) -> &[EarBlocks] {
        &self.filter
    }

    /// Phasor per bin that delays the left ear by half the interaural delay; its conjugate is the right ear's.
    pub(crate) fn turn(&self) -> &[Block] {
        &self.turn
    }

    /// Takes masks, phase and interaural delay.
    pub(crate) fn set(&mut self, tf: &TransferFunction) {
        let phases = tf.phase.chunks_exact(self.scene_bins);
        for (([re, im], phase), sign) in self.on_scene.iter_mut().zip(phases).zip([-1.0, 1.0]) {
            self.arch.dispatch(Phasors { mixture: &tf.mixture, difference: &tf.difference, sign, phase, re, im });
        }
        for (from, to) in self.on_scene.iter().flatten().zip(self.on_host.iter_mut().flatten()) {
            self.bin_map.spread(from, to);
        }
        for (from, to) in self.on_scene.iter().zip(&mut self.on_host) {
            self.top.level(from, to);
        }
        self.arch.dispatch(Delayed {
            ears: &self.on_host,
            // Half the interaural delay to each ear, so that the head's centre stays where it is.
            turn_per_bin: -std::f64::consts::PI * f64::from(tf.delay_s) * self.bin_hz,
            turn: &mut self.turn,
            out: &mut self.filter,
        });
    }

    /// The filter, to add to it what the masks leave of measured responses.
    pub(crate) fn blocks_mut(&mut self) -> &mut [EarBlocks] {
        &mut self.filter
    }
}

/// How the scene's bins lie under the host's.
struct BinMap {
    /// Host bins that coincide with the scene's.
    aligned: usize,
    /// Scene bin below and fraction towards the next, for the host bins after the aligned ones.
    between: Vec<(usize, f32)>,
    bins: usize,
}

impl BinMap {
    fn new(grid: &StftGrid, scene_grid: &StftGrid, top_hz: f32) -> Self {
        let (bins, scene_bins) = (grid.bins(), scene_grid.bins());
        let place = |k: usize| {
            let hz = grid.bin_hz(k).min(f64::from(top_hz));
            let along = (hz / scene_grid.bin_hz(1)).min((scene_bins - 1) as f64);
            let below = whole(along).min(scene_bins - 2);
            let fraction = single(along - below as f64);
            (below, fraction)
        };
        let coincides = |k: usize| (grid.bin_hz(k) - scene_grid.bin_hz(k)).abs() < 1e-6 && grid.bin_hz(k) <= f64::from(top_hz);
        let aligned = (0..bins.min(scene_bins)).take_while(|k| coincides(*k)).count();
        let mut between: Vec<_> = (aligned..bins).map(place).collect();
        // Above the highest frequency of the data one value holds: it is worked out once.
        while between.len() >= 2 && between[between.len() - 1] == between[between.len() - 2] {
            between.pop();
        }
        Self { aligned, between, bins }
    }

    fn spread(&self, from: &[f32], to: &mut [f32]) {
        let (aligned, rest) = to[..self.bins].split_at_mut(self.aligned);
        aligned.copy_from_slice(&from[..self.aligned]);
        let (middle, held) = rest.split_at_mut(self.between.len());
        let mut last = 0.0;
        for (t, &(below, fraction)) in middle.iter_mut().zip(&self.between) {
            last = from[below] + fraction * (from[below + 1] - from[below]);
            *t = last;
        }
        held.fill(last);
    }
}

/// What holds above the highest frequency of the data: the level of the half octave below it, since that of a single bin may
/// lie in a notch and jump as the head turns.
struct Top {
    /// Scene bins whose level holds.
    measured: Range<usize>,
    /// Host bins from which on it takes over, and from which on it holds.
    from: usize,
    held: usize,
    bins: usize,
}

impl Top {
    fn new(grid: &StftGrid, scene_grid: &StftGrid, top_hz: f64) -> Self {
        let bin = |grid: &StftGrid, hz: f64| whole(hz / grid.bin_hz(1)).min(grid.bins());
        Self {
            measured: bin(scene_grid, MEASURED_FROM * top_hz)..bin(scene_grid, top_hz),
            from: bin(grid, TAKES_OVER_FROM * top_hz),
            held: bin(grid, top_hz),
            bins: grid.bins(),
        }
    }

    fn level(&self, [scene_re, scene_im]: &Parts, [re, im]: &mut Parts) {
        if self.held >= self.bins || self.measured.is_empty() {
            return;
        }
        let energy = |re: &f32, im: &f32| re * re + im * im;
        let measured = scene_re[self.measured.clone()].iter().zip(&scene_im[self.measured.clone()]);
        let level = measured.map(|(re, im)| energy(re, im)).sum::<f32>() / self.measured.len() as f32;
        let toward = |re: f32, im: f32, share: f32| {
            let found = energy(&re, &im);
            let gain = if found > 1e-20 { 1.0 + share * ((level / found).sqrt() - 1.0) } else { 1.0 };
            (gain * re, gain * im)
        };
        let width = (self.held - self.from).max(1) as f32;
        for k in self.from..self.held {
            (re[k], im[k]) = toward(re[k], im[k], (k - self.from) as f32 / width);
        }
        let (held_re, held_im) = toward(re[self.held], im[self.held], 1.0);
        re[self.held..self.bins].fill(held_re);
        im[self.held..self.bins].fill(held_im);
    }
}

/// Turns both ears' phasors by half the interaural delay each, in opposite directions.
struct Delayed<'a> {
    ears: &'a [Parts; 2],
    turn_per_bin: f64,
    turn: &'a mut [Block],
    out: &'a mut [EarBlocks],
}

impl WithSimd for Delayed<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _simd: S) {
        // By recurrence in double precision: after thousands of bins still exact in single.
        let turn_by = |bins: usize| Complex64::cis(self.turn_per_bin * bins as f64);
        let (one, block_turn) = (turn_by(1), turn_by(LANES));
        let mut next = Complex64::ONE;
        let steps: [(f32, f32); LANES] = std::array::from_fn(|_| {
            let step = (single(next.re), single(next.im));
            next *= one;
            step
        });
        let mut base = Complex64::ONE;
        let [left, right] = self.ears.each_ref().map(|[re, im]| {
            let (re, im) = (re.as_chunks::<LANES>().0, im.as_chunks::<LANES>().0);
            re.iter().zip(im)
        });
        for ((block, turn), ((lr, li), (rr, ri))) in self.out.iter_mut().zip(self.turn).zip(left.zip(right)) {
            let (base_re, base_im) = (single(base.re), single(base.im));
            base *= block_turn;
            let [left, right] = &mut block.ears;
            for i in 0..LANES {
                let (c, s) = steps[i];
                let (re, im) = (base_re * c - base_im * s, base_re * s + base_im * c);
                turn.re[i] = re;
                turn.im[i] = im;
                // A positive delay means that the left ear is later.
                left.re[i] = lr[i] * re - li[i] * im;
                left.im[i] = lr[i] * im + li[i] * re;
                right.re[i] = rr[i] * re + ri[i] * im;
                right.im[i] = ri[i] * re - rr[i] * im;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TransferShape;

    #[test]
    fn masks_phase_and_delay_make_the_stated_filter_at_any_rate() {
        let scene_grid = StftGrid { sample_rate_hz: 16_000.0, n_fft: 320, hop: 80 };
        let shape = TransferShape { bins: scene_grid.bins(), bands: 2, taps: 0 };
        let mut tf = shape.silent();
        tf.mixture.fill(0.8);
        tf.difference.fill(0.25);
        tf.phase.fill(-0.3);
        tf.delay_s = 0.0004;
        for rate in [8_000.0, 16_000.0, 44_100.0, 48_000.0] {
            let grid = scene_grid.at_rate(rate);
            let mut direct = DirectFilter::new(&grid, &scene_grid, 7_000.0);
            direct.set(&tf);
            for k in 0..grid.bins() {
                let hz = grid.bin_hz(k);
                for (ear, (gain, lag)) in [(0.6, 0.0002), (1.0, -0.0002)].into_iter().enumerate() {
                    let phase = -0.3 - std::f64::consts::TAU * hz * lag;
                    let block = &direct.blocks()[k / LANES].ears[ear];
                    let (re, im) = (f64::from(block.re[k % LANES]), f64::from(block.im[k % LANES]));
                    assert!((re - gain * phase.cos()).abs() < 1e-4 && (im - gain * phase.sin()).abs() < 1e-4, "{rate} {k}");
                }
            }
        }
    }
}
