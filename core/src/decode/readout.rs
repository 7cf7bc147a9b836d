//! From a decoder's masks and embedding to a transfer function, and back for training.

use crate::bands::BandPlace;
use crate::network::shapes::TAP_SHAPES;
use crate::network::{CloudModel, Masks};
use crate::{Bands, StftGrid, TransferFunction, TransferShape};

/// Logarithms of coefficients stay below this, so that no pose makes a tap infinite.
pub const MAX_LOG_COEFFICIENT: f32 = 6.0;

/// The stream's form of what [`crate::network::CloudKind::Taps`] says of a pose, per query frequency.
///
/// - Masks become the direct sound, linear in Hz between queries; a negative mixture mask is silent.
/// - Taps: of an ear, in band b, at hop l, `g = sum_r c_r[b] S_r[l][b]`: shapes `S` that the scene's poses share, the last hop being the
///   late part's level, and coefficients `c = exp(W e + w)` of the query's embedding `e`, averaged over the queries in the band. How a
///   room's energy is spread over time is the room's; how much of it an ear gets depends on where the listener is.
#[derive(Clone, Debug, PartialEq)]
pub struct Readout {
    shape: TransferShape,
    tap_shapes: usize,
    queries: usize,
    /// Where each bin lies among the query frequencies.
    bins: Vec<BandPlace>,
    /// The queries that make up each band, with weights that sum to 1.
    bands: Vec<Vec<(usize, f32)>>,
}

/// Values per query frequency, or derivatives by them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct QueryValues {
    /// Mixture mask, linear gain.
    pub mixture: Vec<f32>,
    /// Difference mask, in (-1, 1); positive = right louder.
    pub difference: Vec<f32>,
    /// Coefficients of the tap shapes, `[query][ear][shape]`.
    pub coefficients: Vec<f32>,
}

impl Readout {
    /// For masks at these query frequencies, taps of `tap_shapes` shapes, 0 for none.
    #[must_use]
    pub fn new(queries: &Bands, grid: &StftGrid, bands: &Bands, taps: usize, tap_shapes: usize) -> Self {
        #[expect(clippy::cast_possible_truncation, reason = "a frequency in Hz")]
        let bins: Vec<_> = (0..grid.bins()).map(|k| queries.place(grid.bin_hz(k) as f32)).collect();
        Self {
            shape: TransferShape { bins: bins.len(), bands: bands.count(), taps },
            tap_shapes,
            queries: queries.count(),
            bins,
            bands: shares(queries.centres_hz(), bands),
        }
    }

    /// Room for the values of all queries.
    #[must_use]
    pub fn values(&self) -> QueryValues {
        let zeros = |count| vec![0.0; count];
        let coefficients = zeros(2 * self.tap_shapes * self.queries);
        QueryValues { mixture: zeros(self.queries), difference: zeros(self.queries), coefficients }
    }

    /// The transfer function of `values` with the tap shapes `[shape][hop][band]`; the direct sound is multiplied by `gain`.
    ///
    /// # Real-time
    /// No allocation, lock or I/O.
    pub fn transfer(&self, values: &QueryValues, shapes: &[f32], gain: f32, out: &mut TransferFunction) {
        self.direct([&values.mixture, &values.difference], gain, out);
        let (bands, hops, ranks) = (self.shape.bands, self.shape.taps + 1, self.tap_shapes);
        if ranks == 0 {
            return;
        }
        for (band, share) in self.bands.iter().enumerate() {
            for ear in 0..2 {
                let at = ear * bands + band;
                (0..hops).for_each(|hop| *tap(out, hop, at, bands) = 0.0);
                for rank in 0..ranks {
                    let c: f32 = share.iter().map(|(q, w)| w * values.coefficients[(2 * q + ear) * ranks + rank]).sum();
                    for hop in 0..hops {
                        *tap(out, hop, at, bands) += c * shapes[(rank * hops + hop) * bands + band];
                    }
                }
            }
        }
    }

    /// The direct sound of a mixture and a difference mask, multiplied by `gain`.
    pub(crate) fn direct(&self, [mixture, difference]: [&[f32]; 2], gain: f32, out: &mut TransferFunction) {
        for ((place, m), d) in self.bins.iter().zip(&mut out.mixture).zip(&mut out.difference) {
            let at = |values: &[f32]| values[place.band] + place.fraction * (values[place.band + 1] - values[place.band]);
            (*m, *d) = (gain * at(mixture).max(0.0), at(difference).clamp(-1.0, 1.0));
        }
    }

    /// The queries in each band, with weights that sum to 1.
    pub(crate) fn bands(&self) -> &[Vec<(usize, f32)>] {
        &self.bands
    }

    /// The derivative by values and tap shapes of what has the derivative `by` by the transfer function: added to both.
    pub fn adjoint(
        &self,
        values: &QueryValues,
        shapes: &[f32],
        gain: f32,
        by: &TransferFunction,
        by_values: &mut QueryValues,
        by_shapes: &mut [f32],
    ) {
        let at = |of: &[f32], p: &BandPlace| of[p.band] + p.fraction * (of[p.band + 1] - of[p.band]);
        for (k, p) in self.bins.iter().enumerate() {
            let heard = if at(&values.mixture, p) > 0.0 { 1.0 } else { 0.0 };
            for (query, share) in [(p.band, 1.0 - p.fraction), (p.band + 1, p.fraction)] {
                by_values.mixture[query] += heard * share * gain * by.mixture[k];
                by_values.difference[query] += share * by.difference[k];
            }
        }
        let (bands, hops, ranks) = (self.shape.bands, self.shape.taps + 1, self.tap_shapes);
        for (band, share) in self.bands.iter().enumerate().filter(|_| ranks > 0) {
            for ear in 0..2 {
                for rank in 0..ranks {
                    let c: f32 = share.iter().map(|(q, w)| w * values.coefficients[(2 * q + ear) * ranks + rank]).sum();
                    let mut by_c = 0.0;
                    for hop in 0..hops {
                        let place = ear * bands + band;
                        let by_tap = if hop + 1 == hops { by.late[place] } else { by.taps[hop * 2 * bands + place] };
                        let shape = (rank * hops + hop) * bands + band;
                        by_c += by_tap * shapes[shape];
                        by_shapes[shape] += by_tap * c;
                    }
                    share.iter().for_each(|(q, w)| by_values.coefficients[(2 * q + ear) * ranks + rank] += w * by_c);
                }
            }
        }
    }
}

/// A hop's gain of one ear and band; the hop after the last tap is the late part.
fn tap(out: &mut TransferFunction, hop: usize, at: usize, bands: usize) -> &mut f32 {
    let taps = out.taps.len() / (2 * bands);
    if hop < taps { &mut out.taps[hop * 2 * bands + at] } else { &mut out.late[at] }
}

/// The query frequencies in each band, with weights that sum to 1.
fn shares(frequencies_hz: &[f32], bands: &Bands) -> Vec<Vec<(usize, f32)>> {
    let mut shares = vec![Vec::new(); bands.count()];
    for (k, hz) in frequencies_hz.iter().enumerate() {
        for (band, weight) in bands.weights(*hz) {
            if weight > 0.0 {
                shares[band].push((k, weight));
            }
        }
    }
    for (share, centre) in shares.iter_mut().zip(bands.centres_hz()) {
        // A band between two of the cloud's frequencies takes the nearest.
        if share.is_empty() {
            let distance = |k: &usize| (frequencies_hz[*k] - centre).abs();
            let nearest = (0..frequencies_hz.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
            share.extend(nearest.map(|k| (k, 1.0)));
        }
        let sum: f32 = share.iter().map(|(_, w)| w).sum();
        share.iter_mut().for_each(|(_, w)| *w /= sum);
    }
    shares
}

/// The weights that make the coefficients of a [`Readout`].
pub(crate) struct LearnedTaps {
    values: QueryValues,
    shapes: Vec<f32>,
    weight: Vec<f32>,
    bias: Vec<f32>,
}

impl LearnedTaps {
    pub(crate) fn new(model: &CloudModel, head: &Readout) -> Self {
        let take = |name: &str| model.weights(name).to_vec();
        Self { values: head.values(), shapes: take(TAP_SHAPES), weight: take("tap_prj.weight"), bias: take("tap_prj.bias") }
    }

    /// # Real-time
    /// No allocation, lock or I/O.
    pub(crate) fn transfer(&mut self, head: &Readout, masks: &Masks, gain: f32, out: &mut TransferFunction) {
        self.values.mixture.copy_from_slice(&masks.mixture);
        self.values.difference.copy_from_slice(&masks.difference);
        if !self.bias.is_empty() {
            let width = self.weight.len() / self.bias.len();
            let rows = masks.embedding.chunks_exact(width).zip(self.values.coefficients.chunks_exact_mut(self.bias.len()));
            for (embedding, coefficients) in rows {
                for ((c, weight), bias) in coefficients.iter_mut().zip(self.weight.chunks_exact(width)).zip(&self.bias) {
                    let log: f32 = bias + weight.iter().zip(embedding).map(|(w, e)| w * e).sum::<f32>();
                    *c = log.min(MAX_LOG_COEFFICIENT).exp();
                }
            }
        }
        head.transfer(&self.values, &self.shapes, gain, out);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(count: usize, of: f32) -> Vec<f32> {
        (0..count).map(|i| 0.1 + 0.8 * (0.5 + 0.5 * (of * 12.9898 * (i as f32 + 1.0)).sin())).collect()
    }

    #[test]
    fn the_adjoint_is_the_derivative() {
        let grid = StftGrid { sample_rate_hz: 8000.0, n_fft: 64, hop: 16 };
        let bands = Bands::for_rate(8000.0);
        let queries = Bands::new((0..12).map(|i| 300.0 * i as f32).collect()).unwrap();
        let (taps, ranks) = (3, 2);
        let head = Readout::new(&queries, &grid, &bands, taps, ranks);
        let mut at = head.values();
        at.mixture = values(at.mixture.len(), 1.0);
        at.difference = values(at.difference.len(), 2.0);
        at.coefficients = values(at.coefficients.len(), 3.0);
        let shapes = values(ranks * (taps + 1) * bands.count(), 4.0);
        let weights = TransferFunction {
            mixture: values(grid.bins(), 5.0),
            difference: values(grid.bins(), 6.0),
            taps: values(2 * bands.count() * taps, 7.0),
            late: values(2 * bands.count(), 8.0),
            ..head.shape.silent()
        };
        let value = |v: &QueryValues, s: &[f32]| -> f64 {
            let mut t = head.shape.silent();
            head.transfer(v, s, 0.7, &mut t);
            let (a, b) = (t.to_row(), weights.to_row());
            a.iter().zip(&b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum()
        };
        let (mut by, mut by_shapes) = (head.values(), vec![0.0; shapes.len()]);
        head.adjoint(&at, &shapes, 0.7, &weights, &mut by, &mut by_shapes);
        let step = 1e-2;
        let slope = |change: &dyn Fn(&mut QueryValues, &mut Vec<f32>, f32)| {
            let ends = [step, -step].map(|h| {
                let (mut v, mut s) = (at.clone(), shapes.clone());
                change(&mut v, &mut s, h);
                value(&v, &s)
            });
            (ends[0] - ends[1]) / (2.0 * f64::from(step))
        };
        let check = |what: &str, got: f32, want: f64| {
            assert!((f64::from(got) - want).abs() < 1e-3 * want.abs().max(0.1), "{what}: {got} against {want}");
        };
        for q in 0..12 {
            check("mixture", by.mixture[q], slope(&|v, _, h| v.mixture[q] += h));
            check("difference", by.difference[q], slope(&|v, _, h| v.difference[q] += h));
            let c = 4 * q + q % 4;
            check("coefficient", by.coefficients[c], slope(&|v, _, h| v.coefficients[c] += h));
        }
        for i in (0..shapes.len()).step_by(7) {
            check("shape", by_shapes[i], slope(&|_, s, h| s[i] += h));
        }
    }
}
