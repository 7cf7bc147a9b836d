//! The past of the dry sound and of its low-passes.

use super::spline::{REACH, Shares};
use super::wall::{BASES, WallFilters, Weights};
use crate::simd::LANES;
use pulp::Simd;

/// States of low-passes below this have died away: what follows would be subnormal.
const DEAD: f32 = 1e-20;

/// The first sample that lies where vectors do in memory. An array that is never grown stays where it is.
pub(crate) fn aligned(samples: &[f32]) -> usize {
    samples.as_ptr().align_offset(LANES * size_of::<f32>()).min(LANES)
}

/// The newest samples of each basis, as shares of a spline. Each is kept twice, one length apart, so that any stretch of them
/// lies in one piece.
pub(crate) struct DelayLine {
    length: usize,
    shares: Shares,
    /// Those of a hop.
    fresh: Vec<f32>,
    /// `[basis][2 * length]`, after `origin` samples that only bring them to a multiple of a vector's size in memory.
    samples: Vec<f32>,
    origin: usize,
    poles: [f32; BASES - 1],
    states: [f32; BASES - 1],
    /// Where the next sample is written.
    now: usize,
}

impl DelayLine {
    /// Samples by which what is read comes later than it says.
    pub(crate) const LAG: usize = REACH;

    /// For reads at most `longest` samples back from the oldest sample of a hop.
    pub(crate) fn new(walls: &WallFilters, longest: usize, hop: usize) -> Self {
        // A stretch may be as long as two hops, and ends with a whole vector.
        let length = (longest + 2 * hop + 5 * LANES).next_multiple_of(LANES);
        let samples = vec![0.0; BASES * 2 * length + LANES];
        let origin = aligned(&samples);
        Self {
            length,
            shares: Shares::new(hop),
            fresh: vec![0.0; hop],
            samples,
            origin,
            poles: walls.poles,
            states: [0.0; BASES - 1],
            now: 0,
        }
    }

    /// Takes a hop of the dry sound.
    pub(crate) fn write(&mut self, hop: &[f32]) {
        let (length, start) = (self.length, self.now);
        self.now = (start + hop.len()) % length;
        let mut fresh = std::mem::take(&mut self.fresh);
        self.shares.of(hop, &mut fresh);
        let (before, after) = fresh[..hop.len()].split_at(hop.len().min(length - start));
        self.write_piece(start, before);
        self.write_piece(0, after);
        self.fresh = fresh;
        for state in &mut self.states {
            if state.abs() < DEAD {
                *state = 0.0;
            }
        }
    }

    /// Writes samples that do not wrap round.
    fn write_piece(&mut self, start: usize, piece: &[f32]) {
        let mut bases = self.samples[self.origin..].chunks_exact_mut(2 * self.length);
        let mut next = || bases.next().unwrap_or_default().split_at_mut(self.length);
        let places: [(&mut [f32], &mut [f32]); BASES] = std::array::from_fn(|_| next());
        let inputs = self.poles.map(|pole| 1.0 - pole);
        for (i, x) in piece.iter().enumerate() {
            places[0].0[start + i] = *x;
            for k in 0..BASES - 1 {
                self.states[k] = inputs[k] * x + self.poles[k] * self.states[k];
                places[k + 1].0[start + i] = self.states[k];
            }
        }
        for (first, second) in places {
            second[start..][..piece.len()].copy_from_slice(&first[start..][..piece.len()]);
        }
    }

    /// Mixes as many samples as `out` has, whole vectors, from `back` samples before the first of a hop on, or some earlier, so
    /// that reads begin where a vector does. Returns how many earlier, less than [`LANES`]. Of the hop `newest` samples are
    /// written; all are within what is kept.
    #[inline(always)]
    pub(crate) fn mix<S: Simd>(&self, simd: S, weights: &Weights, back: usize, newest: usize, out: &mut [f32]) -> usize {
        let wanted = (self.now + 2 * self.length - newest - back) % self.length;
        let start = wanted / LANES * LANES;
        let stretch = |basis: usize| {
            let from = self.origin + 2 * basis * self.length + start;
            S::as_simd_f32s(&self.samples[from..from + out.len()]).0
        };
        let bases: [&[S::f32s]; BASES] = std::array::from_fn(stretch);
        let out = S::as_mut_simd_f32s(out).0;
        for i in 0..out.len() {
            let mut sum = simd.splat_f32s(0.0);
            for k in 0..BASES {
                sum = simd.mul_add_e_f32s(simd.splat_f32s(weights[k]), bases[k][i], sum);
            }
            out[i] = sum;
        }
        wanted - start
    }

    pub(crate) fn reset(&mut self) {
        self.shares.reset();
        self.samples.fill(0.0);
        self.states.fill(0.0);
        self.now = 0;
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(&*self.samples)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn low_passes_end_in_zeros_instead_of_subnormal_numbers() {
        const HOP: usize = 240;
        let mut line = DelayLine::new(&WallFilters::new(48_000.0), 500, HOP);
        line.write(&[1.0; HOP]);
        for _ in 0..100 {
            line.write(&[0.0; HOP]);
        }
        // Rounded to the nearest, a subnormal number that a pole above a half goes on with never ends.
        assert_eq!(line.states, [0.0; BASES - 1]);
        assert!(line.samples.iter().all(|x| *x == 0.0));
    }
}
