//! Attention of one query, the last of the `2^k + 1` bins of a transform: lanes run over keys instead of queries.

use super::Attention;
use crate::network::kernels::exponential::exp2;
use crate::network::kernels::panel::PANEL;
use crate::simd::{all, minus, plus, times_plus};
use pulp::Simd;

/// Scores of a panel of keys fill one row.
#[inline(always)]
pub(super) fn attention<S: Simd>(simd: S, a: &mut Attention<'_>) {
    let vectors = PANEL / S::F32_LANES;
    let panels = a.keys.count();
    let scores = &mut a.scores[..panels];
    let mut top = f32::MIN;
    for (panel, scores) in scores.iter_mut().enumerate() {
        let keys = &a.keys.panel(panel)[a.head.clone()];
        for first in 0..vectors {
            let mut sums = all::<S, 1>(simd, 0.0);
            for (key, query) in keys.iter().zip(a.query) {
                sums = times_plus(simd, key.load(simd, first), all(simd, query.0[0]), sums);
            }
            scores.store(simd, first, sums);
        }
        top = scores.0[..a.keys.held(panel)].iter().copied().fold(top, f32::max);
    }
    let (mut sum, mut mixed) = (all::<S, 1>(simd, 0.0), all::<S, 1>(simd, 0.0));
    for (panel, scores) in scores.iter_mut().enumerate() {
        for first in 0..vectors {
            scores.store(simd, first, exp2::<S, 1>(simd, minus(simd, scores.load(simd, first), all(simd, top))));
        }
        // What only fills up the panel weighs nothing.
        scores.0[a.keys.held(panel)..].fill(0.0);
        for first in 0..vectors {
            sum = plus(simd, sum, scores.load(simd, first));
        }
    }
    for (scores, numbers) in scores.iter().zip(a.mixture) {
        for first in 0..vectors {
            mixed = times_plus(simd, scores.load(simd, first), numbers.load(simd, first), mixed);
        }
    }
    let inverse = 1.0 / simd.reduce_sum_f32s(sum[0]);
    for (feature, output) in a.head.clone().zip(&mut *a.output) {
        let mut sums = all::<S, 1>(simd, 0.0);
        for (panel, scores) in scores.iter().enumerate() {
            let values = &a.values.panel(panel)[feature];
            for first in 0..vectors {
                sums = times_plus(simd, scores.load(simd, first), values.load(simd, first), sums);
            }
        }
        output.0[0] = inverse * simd.reduce_sum_f32s(sums[0]);
    }
    a.top.0[0] = top;
    a.inverse.0[0] = inverse;
    a.mixed.0[0] += inverse * simd.reduce_sum_f32s(mixed[0]);
}
