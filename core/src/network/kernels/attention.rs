//! Attention of a panel of queries to all keys.

mod single;

use super::exponential::exp2;
use super::panel::{PANEL, Panels, Row};
use super::tile::{Columns, add_products, in_columns, part_of};
use crate::simd::TILE;
use crate::simd::{all, larger, minus, over, plus, times, times_plus};
use pulp::{Simd, WithSimd};
use std::ops::Range;

/// Panels of keys whose scores are held at a time: they stay in the first cache.
const KEY_PANELS: usize = 9;

/// Rows of scores that attention to so many keys asks for: a block, or one for every panel of keys.
pub(crate) fn scores_for(keys: usize) -> usize {
    keys.div_ceil(PANEL).max(KEY_PANELS * PANEL)
}

/// Softmax of the scores of all keys and the values it weighs, for one head.
///
/// Scores are powers of two, not of e: queries are scaled accordingly. Keys are taken in blocks; when a block has a larger
/// score, what was summed before it is scaled down (Milakov and Gimelshein, "Online normalizer calculation for softmax", 2018).
pub(crate) struct Attention<'a> {
    /// Rows of the head.
    pub(crate) query: &'a [Row],
    pub(crate) keys: &'a Panels,
    pub(crate) values: &'a Panels,
    /// Features of the head in keys and values.
    pub(crate) head: Range<usize>,
    /// One number per key, in panels, whose weighted mean is added to `mixed`; empty for none.
    pub(crate) mixture: &'a [Row],
    pub(crate) mixed: &'a mut Row,
    /// Room for the scores: [`scores_for`] rows.
    pub(crate) scores: &'a mut [Row],
    pub(crate) positions: usize,
    /// Rows of the head.
    pub(crate) output: &'a mut [Row],
    /// The largest score of each query, and 1 over the sum of weights relative to it.
    pub(crate) top: &'a mut Row,
    pub(crate) inverse: &'a mut Row,
}

impl WithSimd for Attention<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        if self.positions == 1 {
            single::attention(simd, &mut self);
        } else {
            in_columns(simd, self.positions, &mut self);
        }
    }
}

impl Columns for Attention<'_> {
    #[inline(always)]
    fn columns<S: Simd, const M: usize, const V: usize>(&mut self, simd: S, first: usize) {
        let panels = self.keys.count();
        let mut top = all::<S, V>(simd, f32::MIN);
        let (mut sum, mut mixed) = (all::<S, V>(simd, 0.0), all::<S, V>(simd, 0.0));
        let mut inverse = sum;
        for start in (0..panels).step_by(KEY_PANELS) {
            let block = start..(start + KEY_PANELS).min(panels);
            let before = top;
            let mut count = 0;
            for panel in block.clone() {
                let keys = &self.keys.panel(panel)[self.head.clone()];
                let held = self.keys.held(panel);
                let scores = &mut self.scores[count..][..held.next_multiple_of(TILE)];
                top = score::<S, M, V>(simd, first, self.query, keys, held, scores, top);
                count += held;
            }
            let scores = &mut self.scores[..count];
            let shrink = exp2(simd, minus(simd, before, top));
            sum = times(simd, sum, shrink);
            mixed = times(simd, mixed, shrink);
            if self.mixture.is_empty() {
                for row in &mut *scores {
                    sum = plus(simd, sum, weigh(simd, first, row, top));
                }
            } else {
                for (scores, numbers) in scores.chunks_mut(PANEL).zip(&self.mixture[block.clone()]) {
                    for (row, number) in scores.iter_mut().zip(&numbers.0) {
                        let weight = weigh(simd, first, row, top);
                        sum = plus(simd, sum, weight);
                        mixed = times_plus(simd, all(simd, *number), weight, mixed);
                    }
                }
            }
            inverse = over(simd, all(simd, 1.0), sum);
            for (tile, output) in self.output.as_chunks_mut::<M>().0.iter_mut().enumerate() {
                let mut sums = [all::<S, V>(simd, 0.0); M];
                if start > 0 {
                    for m in 0..M {
                        sums[m] = times(simd, output[m].load(simd, first), shrink);
                    }
                }
                let from = self.head.start + tile * M;
                for (panel, weights) in block.clone().zip(scores.chunks(PANEL)) {
                    sums = weighted_sum::<S, M, V>(simd, first, &self.values.panel(panel)[from..from + M], weights, sums);
                }
                let scale = if block.end == panels { inverse } else { all(simd, 1.0) };
                for m in 0..M {
                    output[m].store(simd, first, times(simd, sums[m], scale));
                }
            }
        }
        self.top.store(simd, first, top);
        self.inverse.store(simd, first, inverse);
        if !self.mixture.is_empty() {
            self.mixed.store(simd, first, times_plus(simd, mixed, inverse, self.mixed.load(simd, first)));
        }
    }
}

/// Scores of the keys of one panel; gives the larger of `top` and the largest score.
#[inline(always)]
fn score<S: Simd, const M: usize, const V: usize>(
    simd: S,
    first: usize,
    query: &[Row],
    keys: &[Row],
    held: usize,
    scores: &mut [Row],
    mut top: [S::f32s; V],
) -> [S::f32s; V] {
    for (eight, scores) in scores.chunks_exact_mut(TILE).enumerate() {
        // The smaller of both is always `eight`; it shows that the keys lie in the panel.
        let eight = eight.min(PANEL / TILE - 1);
        for part in 0..TILE / M {
            let terms = keys.iter().map(|row| part_of::<M>(&row.0.as_chunks().0[eight], part)).zip(query);
            let sums = add_products::<S, M, V>(simd, first, [all(simd, 0.0); M], terms);
            let real = held - (eight * TILE + part * M).min(held);
            for m in 0..M {
                scores[part * M + m].store(simd, first, sums[m]);
                if m < real {
                    top = larger(simd, top, sums[m]);
                }
            }
        }
    }
    top
}

/// Puts the weight in place of a score.
#[inline(always)]
fn weigh<S: Simd, const V: usize>(simd: S, first: usize, row: &mut Row, top: [S::f32s; V]) -> [S::f32s; V] {
    let weight = exp2(simd, minus(simd, row.load(simd, first), top));
    row.store(simd, first, weight);
    weight
}

/// Adds the weighted values of the keys of one panel; `values` are `M` rows, `weights` one row per key.
#[inline(always)]
fn weighted_sum<S: Simd, const M: usize, const V: usize>(
    simd: S,
    first: usize,
    values: &[Row],
    weights: &[Row],
    sums: [[S::f32s; V]; M],
) -> [[S::f32s; V]; M] {
    let Some(values) = values.first_chunk::<M>() else { return sums };
    let terms = weights.iter().zip(0..PANEL).map(|(row, key)| {
        let mut numbers = [&values[0].0[key]; M];
        for m in 0..M {
            numbers[m] = &values[m].0[key];
        }
        (numbers, row)
    });
    add_products::<S, M, V>(simd, first, sums, terms)
}

/// Adds the weight of every key, summed over the queries of a panel, for one head.
pub(crate) struct Tally<'a> {
    /// Rows of the head.
    pub(crate) query: &'a [Row],
    pub(crate) keys: &'a Panels,
    /// Features of the head in keys.
    pub(crate) head: Range<usize>,
    pub(crate) scores: &'a mut [Row],
    pub(crate) positions: usize,
    /// The largest score of each query, as [`Attention`] left it.
    pub(crate) top: &'a Row,
    pub(crate) inverse: &'a Row,
    /// One per key.
    pub(crate) tally: &'a mut [f32],
}

impl WithSimd for Tally<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        in_columns(simd, self.positions, &mut self);
    }
}

impl Columns for Tally<'_> {
    #[inline(always)]
    fn columns<S: Simd, const M: usize, const V: usize>(&mut self, simd: S, first: usize) {
        let top = self.top.load::<S, V>(simd, first);
        // Queries that only fill up the panel count for nothing.
        let mut real = *self.inverse;
        real.0[self.positions.min(PANEL)..].fill(0.0);
        let inverse = real.load::<S, V>(simd, first);
        for (panel, tally) in self.tally.chunks_mut(PANEL).enumerate().take(self.keys.count()) {
            let keys = &self.keys.panel(panel)[self.head.clone()];
            let scores = &mut self.scores[..tally.len().next_multiple_of(TILE)];
            score::<S, M, V>(simd, first, self.query, keys, tally.len(), scores, top);
            for (row, tally) in scores.iter_mut().zip(tally) {
                for weight in times(simd, weigh(simd, first, row, top), inverse) {
                    *tally += simd.reduce_sum_f32s(weight);
                }
            }
        }
    }
}
