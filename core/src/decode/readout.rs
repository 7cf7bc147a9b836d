//! From a network's masks and embedding to a transfer function.

use crate::bands::BandPlace;
use crate::network::shapes::TAP_SHAPES;
use crate::network::{CloudModel, Masks};
use crate::number::single;
use crate::{Bands, StftGrid, TransferFunction, TransferShape};

/// Logarithms of coefficients stay below this, so that no pose makes a tap infinite.
pub const MAX_LOG_COEFFICIENT: f32 = 6.0;

/// Turns what a network of [`crate::network::CloudKind::Taps`] predicts per query frequency into a transfer function.
///
/// Made with its scene off the audio thread; a live decoder and the trainer use it, unchanged.
///
/// - Masks become the direct sound, linear in Hz between queries; a negative mixture mask is silent.
/// - Taps: of an ear, in band b, at hop l, `g = sum_r c_r[b] S_r[l][b]`: shapes `S` that the scene's poses share, the last hop
///   being the late part's level, and coefficients `c = exp(W e + w)` of the query's embedding `e`, averaged over the queries
///   in the band. How a room's energy is spread over time is the room's; how much of it an ear gets depends on where the
///   listener is.
#[derive(Clone, Debug, PartialEq)]
pub struct Readout {
    pub(crate) shape: TransferShape,
    pub(crate) tap_shapes: usize,
    queries: usize,
    /// Where each bin lies among the query frequencies.
    pub(crate) bins: Vec<BandPlace>,
    /// The queries that make up each band, with weights that sum to 1.
    pub(crate) bands: Vec<Vec<(usize, f32)>>,
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
        let bins: Vec<_> = (0..grid.bins()).map(|k| queries.place(single(grid.bin_hz(k)))).collect();
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
