//! Later taps of several frames at once: their filters are read once for all of them.

use crate::decode::{TURNS, group};
use crate::render::transform::lanes::{Block, EarBlocks, LANES, part};
use crate::render::transform::ring::Slot;
use crate::simd::plus;
use pulp::{Arch, Simd, WithSimd};
use std::ops::Range;

/// Frames that are worked out together: until a group of bins has its turn again, its filters stay.
pub(crate) const FRAMES: usize = TURNS;

/// Sums of the newest frame and of those that come next, for groups of blocks that are taken in turns.
///
/// A tap whose frames have all come in can be applied to frames to come.
pub(crate) struct Ahead {
    arch: Arch,
    blocks: Range<usize>,
    /// Of each block, the frames from that of its group's turn on.
    sums: Vec<[EarBlocks; FRAMES]>,
    /// Of each group, hops since its turn.
    ages: [usize; FRAMES],
    /// Nothing has been worked out for the frames to come.
    stale: bool,
}

/// Filters `[block][hop]` that are applied to the frames of a ring.
#[derive(Clone, Copy)]
pub(crate) struct Applied<'a> {
    /// The newest frame that the first of the taps is applied to: by the last of the frames that are worked out. One for both
    /// ears, or the left's.
    pub(crate) newest: Slot<'a>,
    /// The right ear's.
    pub(crate) right: Option<Slot<'a>>,
    pub(crate) filter: &'a [EarBlocks],
    pub(crate) hops: usize,
    pub(crate) first_tap: usize,
}

impl Ahead {
    /// For some blocks.
    pub(crate) fn new(blocks: Range<usize>) -> Self {
        let sums = vec![[EarBlocks::default(); FRAMES]; blocks.len()];
        Self { arch: Arch::new(), blocks, sums, ages: [0; FRAMES], stale: true }
    }

    /// The first of the blocks.
    pub(crate) fn first(&self) -> usize {
        self.blocks.start
    }

    /// Forgets what was worked out for frames to come.
    pub(crate) fn forget(&mut self) {
        self.stale = true;
    }

    /// Works out the group whose turn it is, or all of them where nothing is known, and adds the newest frame to the sums of
    /// all blocks.
    pub(crate) fn add<'a>(&mut self, turn: usize, filters: impl Iterator<Item = Applied<'a>> + Clone, sums: &mut [EarBlocks]) {
        let all = std::mem::take(&mut self.stale);
        for (number, age) in self.ages.iter_mut().enumerate() {
            let blocks = group(&self.blocks, number);
            let first = blocks.start;
            let own = first - self.blocks.start..blocks.end - self.blocks.start;
            if all || number == turn || *age == FRAMES {
                *age = 0;
                let out = &mut self.sums[own.clone()];
                out.fill([EarBlocks::default(); FRAMES]);
                for filters in filters.clone() {
                    self.arch.dispatch(Apply { filters, first, out });
                }
            }
            self.arch.dispatch(Add { from: &self.sums[own], frame: *age, to: &mut sums[first..] });
            *age += 1;
        }
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(&*self.sums)
    }
}

/// Adds one of the frames of some blocks to sums.
struct Add<'a> {
    from: &'a [[EarBlocks; FRAMES]],
    frame: usize,
    to: &'a mut [EarBlocks],
}

impl WithSimd for Add<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for (to, from) in self.to.iter_mut().zip(self.from) {
            for vector in 0..LANES / S::F32_LANES {
                let sum = plus(simd, to.parts::<S>(vector), from[self.frame].parts::<S>(vector));
                to.put_parts::<S>(vector, sum);
            }
        }
    }
}

/// Applies filters to some blocks, from one on, of all frames.
struct Apply<'a> {
    filters: Applied<'a>,
    first: usize,
    out: &'a mut [[EarBlocks; FRAMES]],
}

impl WithSimd for Apply<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { filters: Applied { newest, right, filter, hops, first_tap }, first, out } = self;
        let histories = newest.histories().zip(right.unwrap_or(newest).histories());
        let rows = histories.zip(filter.chunks_exact(hops)).skip(first);
        for (((left, of_right), taps), out) in rows.zip(out) {
            let taps = &taps[first_tap..];
            for vector in 0..LANES / S::F32_LANES {
                // Sums of four frames fill the registers of the widest vectors; others have half as many.
                if right.is_some() {
                    frames::<S, 2, 2>(simd, 0, vector, [left, of_right], taps, out);
                    frames::<S, 2, 2>(simd, 2, vector, [left, of_right], taps, out);
                } else if S::REGISTER_COUNT >= 32 {
                    frames::<S, FRAMES, 1>(simd, 0, vector, [left], taps, out);
                } else {
                    frames::<S, 2, 1>(simd, 0, vector, [left], taps, out);
                    frames::<S, 2, 1>(simd, 2, vector, [left], taps, out);
                }
            }
        }
    }
}

/// Adds `N` of the frames, from one on, in one vector of a block.
#[inline(always)]
fn frames<S: Simd, const N: usize, const EARS: usize>(
    simd: S,
    from: usize,
    vector: usize,
    histories: [[&[Block]; 2]; EARS],
    taps: &[EarBlocks],
    out: &mut [EarBlocks; FRAMES],
) {
    let zero = simd.splat_f32s(0.0);
    let newest = FRAMES - from - N;
    let mut heard = [[[zero; 2]; EARS]; N];
    for (n, heard) in heard[..N - 1].iter_mut().enumerate() {
        *heard = spectra::<S, EARS>(histories, newest + N - 2 - n, vector);
    }
    let mut sums = [[zero; 4]; N];
    for (tap, h) in taps.iter().enumerate() {
        // With the next tap each frame has the spectrum that the one before it had.
        for n in (1..N).rev() {
            heard[n] = heard[n - 1];
        }
        heard[0] = spectra::<S, EARS>(histories, newest + tap + N - 1, vector);
        let h = h.parts::<S>(vector);
        let minus = [simd.sub_f32s(zero, h[1]), simd.sub_f32s(zero, h[3])];
        for (sums, heard) in sums.iter_mut().zip(heard) {
            for ear in 0..2 {
                let [re, im] = heard[ear * (EARS - 1)];
                let (h_re, h_im) = (h[2 * ear], h[2 * ear + 1]);
                sums[2 * ear] = simd.mul_add_e_f32s(minus[ear], im, simd.mul_add_e_f32s(h_re, re, sums[2 * ear]));
                sums[2 * ear + 1] = simd.mul_add_e_f32s(h_im, re, simd.mul_add_e_f32s(h_re, im, sums[2 * ear + 1]));
            }
        }
    }
    for (out, sums) in out[from..].iter_mut().zip(sums) {
        out.put_parts::<S>(vector, plus(simd, out.parts::<S>(vector), sums));
    }
}

/// One vector of a frame of some age in a block, of each ear.
#[inline(always)]
fn spectra<S: Simd, const EARS: usize>(histories: [[&[Block]; 2]; EARS], age: usize, vector: usize) -> [[S::f32s; 2]; EARS] {
    let mut spectra = [[part::<S>(&[0.0; LANES], 0); 2]; EARS];
    for (spectrum, [history, before]) in spectra.iter_mut().zip(histories) {
        let block = if age < history.len() { &history[age] } else { &before[age - history.len()] };
        *spectrum = [part::<S>(&block.re, vector), part::<S>(&block.im, vector)];
    }
    spectra
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::transform::lanes::{Accumulate, blocks_for};
    use crate::render::transform::ring::Ring;
    use crate::simd::tests::arches;
    use promenade_fourier::num_complex::Complex32;
    use promenade_testing::noise;

    /// What is heard of every frame is what each tap adds to it, from the first frame on, and whatever was forgotten.
    #[test]
    fn frames_ahead_are_those_that_would_have_been_worked_out_in_time() {
        let (bins, taps, first_tap, first) = (181, 9, 2, 3);
        let blocks = blocks_for(bins);
        let mut ring = Ring::new(blocks, taps + 1);
        let numbers = noise(3, blocks * taps * 4 * LANES);
        let mut filter = vec![EarBlocks::default(); blocks * taps];
        for (filter, numbers) in filter.iter_mut().zip(numbers.chunks_exact(4 * LANES)) {
            for (ear, numbers) in filter.ears.iter_mut().zip(numbers.chunks_exact(2 * LANES)) {
                ear.re.copy_from_slice(&numbers[..LANES]);
                ear.im.copy_from_slice(&numbers[LANES..]);
            }
        }
        let filter = &filter[..];
        for arch in arches() {
            let mut ahead = Ahead { arch, ..Ahead::new(first..blocks) };
            ring.reset();
            for frame in 0..40_usize {
                let x = noise(frame as u64, 2 * bins);
                ring.write(&x.chunks_exact(2).map(|x| Complex32::new(x[0], x[1])).collect::<Vec<_>>());
                if frame % 11 == 5 {
                    ahead.forget();
                }
                let [mut found, mut wanted] = [(); 2].map(|()| vec![EarBlocks::default(); blocks]);
                let newest = ring.at(0);
                // A turn that is left out is made up for.
                let turn = if frame == 17 { 0 } else { frame % FRAMES };
                ahead.add(turn, [Applied { newest, right: None, filter, hops: taps, first_tap }].into_iter(), &mut found);
                let (newest, sums) = ([ring.at(FRAMES - 1)], &mut wanted);
                Accumulate { arch, newest, filter, hops: taps, taps: first_tap..taps, sums }.run();
                assert!(found[..first].iter().all(|block| *block == EarBlocks::default()));
                for (found, wanted) in found.iter().zip(&wanted).skip(first) {
                    for (found, wanted) in found.ears.iter().zip(&wanted.ears) {
                        let all = found.re.iter().zip(&wanted.re).chain(found.im.iter().zip(&wanted.im));
                        assert!(all.clone().all(|(f, w)| (f - w).abs() < 1e-4), "frame {frame}");
                    }
                }
            }
        }
    }
}
