//! The first hops of the filters in the time domain, without waiting for a frame.

use crate::StftGrid;
use crate::latency::{EARLY_HOPS, Pace};
use crate::number::single;
use crate::render::part::{Heard as HeardBy, Hop, Part};
use crate::render::transform::lanes::{Accumulate, Block, EarBlocks, LANES, blocks_for, ear_spectrum};
use crate::render::transform::ring::Ring;
use crate::simd::LANE;
use promenade_fourier::num_complex::Complex32;
use promenade_fourier::{ComplexToReal, RealToComplex};
use pulp::{Arch, Simd, WithSimd};
use std::ops::Range;
use std::sync::Arc;

/// One response of both ears, cut into blocks.
struct Response {
    /// The first block's samples, which are convolved as they are.
    first: [Vec<f32>; 2],
    /// Spectra of the blocks after it, `[block of bins][block]`.
    rest: Vec<EarBlocks>,
    /// What the blocks after the first make of earlier input, during the block that is running; whole vectors.
    tail: [Vec<f32>; 2],
}

/// Convolution without delay whose response may change at every hop (Gardner 1995): the first block of the response sample by
/// sample, the others by transforms of the blocks of input that are complete. Over a hop the old response fades into the new.
pub(crate) struct Undelayed {
    arch: Arch,
    grid: StftGrid,
    block: usize,
    /// Blocks of a response after its first.
    rest: usize,
    /// Input of the block before and of the one that is running, and room for whole vectors.
    input: Vec<f32>,
    /// Samples of the running hop.
    at: usize,
    /// The newest spectra of input.
    ring: Ring,
    responses: [Response; 2],
    /// The response that is heard, or being faded in.
    now: usize,
    moves: bool,
    is_set: bool,
    /// Blocks since there was input.
    quiet: usize,
    sums: Vec<EarBlocks>,
    frame: Vec<f32>,
    bins: Vec<Complex32>,
    whole_bins: Vec<Complex32>,
    whole: Vec<f32>,
    scratch: Vec<Complex32>,
    forward: Arc<dyn RealToComplex<f32>>,
    inverse: Arc<dyn ComplexToReal<f32>>,
    whole_inverse: Arc<dyn ComplexToReal<f32>>,
}

impl Undelayed {
    /// For a host's grid, cut up as a short pace has it.
    pub(crate) fn new(grid: &StftGrid, pace: &Pace) -> Self {
        let block = pace.block;
        let rest = EARLY_HOPS * grid.hop / block - 1;
        let (forward, inverse) = (promenade_fourier::forward(2 * block), promenade_fourier::inverse(2 * block));
        let whole_inverse: Arc<dyn ComplexToReal<f32>> = promenade_fourier::inverse(grid.n_fft);
        let scratch = forward.get_scratch_len().max(inverse.get_scratch_len()).max(whole_inverse.get_scratch_len());
        let bins = block + 1;
        let response = || Response {
            first: [vec![0.0; block], vec![0.0; block]],
            rest: vec![EarBlocks::default(); blocks_for(bins) * rest],
            tail: [vec![0.0; block + LANES], vec![0.0; block + LANES]],
        };
        Self {
            arch: Arch::new(),
            grid: *grid,
            block,
            rest,
            input: vec![0.0; 2 * block + LANES],
            at: 0,
            ring: Ring::new(blocks_for(bins), rest),
            responses: [response(), response()],
            now: 0,
            moves: false,
            is_set: false,
            quiet: usize::MAX / 2,
            sums: vec![EarBlocks::default(); blocks_for(bins)],
            frame: vec![0.0; 2 * block],
            bins: vec![Complex32::default(); bins],
            whole_bins: vec![Complex32::default(); grid.bins()],
            whole: vec![0.0; grid.n_fft],
            scratch: vec![Complex32::default(); scratch],
            forward,
            inverse,
            whole_inverse,
        }
    }

    /// Begins a hop, with another filter of the first hops, on the host's bins, where there is one. It is faded to over the
    /// hop, but for the first, which is heard at once.
    fn set(&mut self, filter: Option<&[EarBlocks]>) {
        self.moves = self.is_set && filter.is_some();
        if let Some(filter) = filter {
            self.now = if self.is_set { 1 - self.now } else { self.now };
            self.is_set = true;
            for ear in 0..2 {
                self.respond(filter, ear);
                self.cut(ear);
            }
        }
        self.begin_block();
    }

    /// A filter's response, a lead before its time and in a ring.
    fn respond(&mut self, filter: &[EarBlocks], ear: usize) {
        ear_spectrum(filter, ear, &mut self.whole_bins);
        let done = self.whole_inverse.process_with_scratch(&mut self.whole_bins, &mut self.whole, &mut self.scratch);
        debug_assert!(done.is_ok());
    }

    /// Cuts the response in `whole` into blocks.
    fn cut(&mut self, ear: usize) {
        let (n, lead, block) = (self.grid.n_fft, self.grid.lead(), self.block);
        let scale = single((n as f64).recip());
        let response = &mut self.responses[self.now];
        let sample = |i: usize| self.whole[(i + n - lead) % n];
        for (i, x) in response.first[ear].iter_mut().enumerate() {
            *x = sample(i) * scale;
        }
        // The transforms of blocks leave their length in.
        let scale = scale * single((2.0 * block as f64).recip());
        for part in 0..self.rest {
            for (i, x) in self.frame[..block].iter_mut().enumerate() {
                *x = sample((part + 1) * block + i) * scale;
            }
            self.frame[block..].fill(0.0);
            let done = self.forward.process_with_scratch(&mut self.frame, &mut self.bins, &mut self.scratch);
            debug_assert!(done.is_ok());
            for (row, bins) in response.rest.chunks_exact_mut(self.rest).zip(self.bins.chunks(LANES)) {
                let to = &mut row[part].ears[ear];
                for (i, bin) in bins.iter().enumerate() {
                    (to.re[i], to.im[i]) = (bin.re, bin.im);
                }
            }
        }
    }

    /// Samples of the running block.
    fn filled(&self) -> usize {
        self.at % self.block
    }

    /// Convolves samples of one block, the first of number `at` of a hop, and adds what the ears hear of them.
    fn convolve(&mut self, samples: &[f32], at: usize, ears: [&mut [f32]; 2]) {
        self.at = at;
        let (count, from) = (samples.len(), self.filled());
        self.input[self.block + from..][..count].copy_from_slice(samples);
        if samples.iter().any(|x| *x != 0.0) {
            self.quiet = 0;
        }
        // The block that is running and all those that a response reaches back to.
        if self.quiet <= self.rest + 2 {
            let [a, b] = &self.responses;
            let (now, before) = if self.now == 0 { (a, b) } else { (b, a) };
            let hop = self.grid.hop as f32;
            let fade = if self.moves { Some((before, (self.at + 1) as f32 / hop, 1.0 / hop)) } else { None };
            self.arch.dispatch(Heard { input: &self.input, block: self.block, from, now, fade, ears });
        }
        self.at += count;
        if self.filled() == 0 {
            self.end_block();
            if self.at == self.grid.hop {
                // The next filter begins the next block.
                (self.at, self.moves) = (0, false);
            } else {
                self.begin_block();
            }
        }
    }

    fn end_block(&mut self) {
        let block = self.block;
        self.quiet = self.quiet.saturating_add(1);
        self.frame.copy_from_slice(&self.input[..2 * block]);
        let done = self.forward.process_with_scratch(&mut self.frame, &mut self.bins, &mut self.scratch);
        debug_assert!(done.is_ok());
        self.ring.write(&self.bins);
        self.input.copy_within(block..2 * block, 0);
        self.input[block..].fill(0.0);
    }

    /// Works out what is heard of earlier blocks during the next.
    fn begin_block(&mut self) {
        for (number, response) in self.responses.iter_mut().enumerate() {
            if self.quiet > self.rest + 1 || (number != self.now && !self.moves) {
                response.tail.iter_mut().for_each(|tail| tail.fill(0.0));
                continue;
            }
            self.sums.fill(EarBlocks::default());
            Accumulate {
                arch: self.arch,
                newest: [self.ring.at(0)],
                filter: &response.rest,
                hops: self.rest,
                taps: 0..self.rest,
                sums: &mut self.sums,
            }
            .run();
            for (ear, tail) in response.tail.iter_mut().enumerate() {
                ear_spectrum(&self.sums, ear, &mut self.bins);
                let done = self.inverse.process_with_scratch(&mut self.bins, &mut self.frame, &mut self.scratch);
                debug_assert!(done.is_ok());
                tail[..self.block].copy_from_slice(&self.frame[self.block..]);
            }
        }
    }
}

impl Part for Undelayed {
    fn begin(&mut self, hop: &Hop<'_>) {
        self.set(hop.filter);
    }

    fn take(&mut self, hop: &mut [f32], span: Range<usize>, heard: &mut HeardBy<'_>) {
        self.convolve(&hop[span.clone()], span.start, heard.ears.each_mut().map(|ear| &mut **ear));
    }

    fn reset(&mut self) {
        self.input.fill(0.0);
        self.ring.reset();
        (self.at, self.now) = (0, 0);
        (self.moves, self.is_set) = (false, false);
        self.quiet = usize::MAX / 2;
        self.responses.iter_mut().flat_map(|response| &mut response.tail).for_each(|tail| tail.fill(0.0));
    }

    fn memory_bytes(&self) -> usize {
        let response = &self.responses[0];
        let floats = self.input.len() + self.frame.len() + self.whole.len() + 4 * (response.tail[0].len() + self.block);
        floats * size_of::<f32>()
            + self.ring.memory_bytes()
            + 2 * self.bins.len() * size_of::<Block>()
            + (2 * response.rest.len() + self.sums.len()) * size_of::<EarBlocks>()
    }
}

/// Adds what the ears hear of some samples: the first block of a response sample by sample, and the tail.
struct Heard<'a> {
    input: &'a [f32],
    block: usize,
    /// The first sample of the running block that is heard.
    from: usize,
    now: &'a Response,
    /// What is faded from, how much of the new response the first sample has, and how much more each sample.
    fade: Option<(&'a Response, f32, f32)>,
    ears: [&'a mut [f32]; 2],
}

/// Samples of a vector's place whose first is `at`: both ears.
#[inline(always)]
fn heard<S: Simd>(simd: S, input: &[f32], block: usize, at: usize, response: &Response) -> [S::f32s; 2] {
    let lanes = S::F32_LANES;
    let start = |samples: &[f32], at: usize| S::as_simd_f32s(&samples[at..at + lanes]).0[0];
    let [left, right] = &response.first;
    let mut sums = [start(&response.tail[0], at), start(&response.tail[1], at)];
    for (k, (l, r)) in left.iter().zip(right).enumerate() {
        let x = start(input, block + at - k);
        sums[0] = simd.mul_add_e_f32s(simd.splat_f32s(*l), x, sums[0]);
        sums[1] = simd.mul_add_e_f32s(simd.splat_f32s(*r), x, sums[1]);
    }
    sums
}

impl WithSimd for Heard<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { input, block, from, now, fade, ears: [left, right] } = self;
        let lanes = S::F32_LANES;
        let lane = S::as_simd_f32s(&LANE).0[0];
        let count = left.len().min(right.len());
        let mut done = 0;
        while done < count {
            let mut sums = heard(simd, input, block, from + done, now);
            if let Some((before, share, step)) = fade {
                let old = heard(simd, input, block, from + done, before);
                let share = simd.splat_f32s(share + step * done as f32);
                let share = simd.mul_add_e_f32s(simd.splat_f32s(step), lane, share);
                for ear in 0..2 {
                    sums[ear] = simd.mul_add_e_f32s(share, simd.sub_f32s(sums[ear], old[ear]), old[ear]);
                }
            }
            let mut each = [[0.0; LANES]; 2];
            for (each, sum) in each.iter_mut().zip(sums) {
                S::as_mut_simd_f32s(each).0[0] = sum;
            }
            let end = count.min(done + lanes);
            for (ear, each) in [&mut *left, &mut *right].into_iter().zip(&each) {
                ear[done..end].iter_mut().zip(each).for_each(|(ear, x)| *ear += x);
            }
            done = end;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Latency;

    const GRID: StftGrid = StftGrid { sample_rate_hz: 48_000.0, n_fft: 960, hop: 240 };

    /// The filter of a response that begins a lead before its time.
    fn filter_of(responses: [&[f32]; 2]) -> Vec<EarBlocks> {
        let (n, lead) = (GRID.n_fft, GRID.lead());
        let mut filter = vec![EarBlocks::default(); blocks_for(GRID.bins())];
        for (ear, response) in responses.into_iter().enumerate() {
            let mut time = vec![0.0; n];
            for (i, x) in response.iter().enumerate() {
                time[(i + n - lead) % n] = *x;
            }
            let forward = promenade_fourier::forward(n);
            let mut bins = forward.make_output_vec();
            forward.process(&mut time, &mut bins).unwrap();
            for (k, bin) in bins.iter().enumerate() {
                let to = &mut filter[k / LANES].ears[ear];
                (to.re[k % LANES], to.im[k % LANES]) = (bin.re, bin.im);
            }
        }
        filter
    }

    fn undelayed() -> Undelayed {
        Undelayed::new(&GRID, &Pace::new(Latency::None, &GRID, 40))
    }

    /// What it makes of a sound in pieces of some length; `filters` are set at the hops, each once.
    fn played(filters: &[&[EarBlocks]], sound: &[f32], piece: usize) -> [Vec<f32>; 2] {
        let mut undelayed = undelayed();
        let mut ears = [vec![0.0; sound.len()], vec![0.0; sound.len()]];
        let mut at = 0;
        while at < sound.len() {
            if at % GRID.hop == 0 {
                undelayed.set(filters.get(at / GRID.hop).copied());
            }
            let count = piece.min(undelayed.block - at % undelayed.block).min(sound.len() - at);
            let [left, right] = &mut ears;
            undelayed.convolve(&sound[at..at + count], at % GRID.hop, [&mut left[at..at + count], &mut right[at..at + count]]);
            at += count;
        }
        ears
    }

    fn convolved(sound: &[f32], response: &[f32], at: usize) -> f32 {
        response.iter().enumerate().take(at + 1).map(|(k, h)| h * sound[at - k]).sum()
    }

    #[test]
    fn a_filter_that_stays_is_a_plain_convolution_without_delay() {
        let sound = promenade_testing::noise(1, 2_000);
        let responses = [2, 3].map(|seed| promenade_testing::noise(seed, 3 * GRID.hop));
        let filter = filter_of([&responses[0], &responses[1]]);
        for piece in [1, 7, 60, 512] {
            let ears = played(&[&filter], &sound, piece);
            for (ear, response) in ears.iter().zip(&responses) {
                for at in (0..sound.len()).step_by(13) {
                    let wanted = convolved(&sound, response, at);
                    assert!((ear[at] - wanted).abs() < 2e-4, "{piece} {at}: {} {wanted}", ear[at]);
                }
            }
        }
    }

    #[test]
    fn a_filter_that_changes_is_faded_to_over_a_hop() {
        let sound = promenade_testing::noise(1, 1_200);
        let [a, b] = [2, 3].map(|seed| promenade_testing::noise(seed, 3 * GRID.hop));
        let filters = [filter_of([&a, &a]), filter_of([&b, &a])];
        let ears = played(&[&filters[0], &filters[0], &filters[1]], &sound, 100);
        for at in (0..sound.len()).step_by(7) {
            let share = ((at as f32 + 1.0 - 480.0) / 240.0).clamp(0.0, 1.0);
            let (old, new) = (convolved(&sound, &a, at), convolved(&sound, &b, at));
            assert!((ears[0][at] - (old + share * (new - old))).abs() < 2e-4, "{at}");
            assert!((ears[1][at] - old).abs() < 2e-4, "{at}");
        }
    }

    #[test]
    fn silence_ends_exactly_and_a_reset_is_as_new() {
        let filter = filter_of([&[1.0; 720], &[0.5; 720]]);
        let mut sound = promenade_testing::noise(1, 300);
        sound.resize(3_000, 0.0);
        let ears = played(&[&filter], &sound, 64);
        assert!(ears.iter().flatten().any(|x| *x != 0.0));
        assert!(ears.iter().all(|ear| ear[300 + 16 * 60..].iter().all(|x| *x == 0.0)));
        let mut undelayed = undelayed();
        let mut once = || {
            undelayed.set(Some(&filter));
            let [mut left, mut right] = [[0.0; 60], [0.0; 60]];
            undelayed.convolve(&sound[..60], 0, [&mut left, &mut right]);
            undelayed.reset();
            left
        };
        assert_eq!(once(), once());
    }
}
