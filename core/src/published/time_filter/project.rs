//! From the time filter of clips to the taps of a stream.

use super::harmonics::{Harmonics, band_table, frame_table};
use super::hyper::{Embedding, Hidden};
use super::stream_taps::{Kernel, StreamTaps};
use crate::network::shapes::FREQUENCY_TAPS;
use crate::network::{CloudKind, CloudModel, Listener, Masks};
use crate::number::single;
use crate::published::frames::{FrameProduct, Frames, WeightedRows};
use crate::simd::Weights;
use pulp::Arch;
use std::ops::Range;

/// How the matrix over a clip's frames, which depends on their place in the clip, becomes a filter that does not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Projection {
    /// The average of each diagonal: no look-ahead. Averaging removes what training on short clips left to chance.
    Diagonal,
    /// One row, an output frame from 0 to T - 1: exact for that frame of a clip. Looks ahead to the clip's end.
    Row(usize),
}

impl Projection {
    /// Hops of the future that a filter of `frames` frames needs.
    #[must_use]
    pub fn lookahead_hops(self, frames: usize) -> usize {
        match self {
            Self::Diagonal => 0,
            Self::Row(row) => frames.saturating_sub(row + 1),
        }
    }

    /// Output frames whose average a lag takes.
    fn frames(self, frames: usize, lag: isize) -> Range<usize> {
        match self {
            Self::Diagonal => lag.max(0).unsigned_abs().min(frames)..frames.saturating_add_signed(lag.min(0)),
            Self::Row(row) => {
                let row = row.min(frames - 1);
                let inside = row.checked_add_signed(-lag).is_some_and(|input| input < frames);
                row..row + usize::from(inside)
            }
        }
    }

    /// The average of a matrix over what a lag takes, by output and input frame.
    fn tap(self, frames: usize, lag: isize, at: impl Fn(usize, usize) -> f32) -> f32 {
        let outputs = self.frames(frames, lag);
        let count = outputs.len().max(1) as f64;
        let sum: f64 = outputs.map(|t| f64::from(at(t, t.saturating_add_signed(-lag)))).sum();
        single(sum / count)
    }

    fn bias(self, frames: usize, at: impl Fn(usize) -> f32) -> f32 {
        self.tap(frames, 0, |t, _| at(t))
    }
}

/// Makes [`StreamTaps`] for one listener after the other.
///
/// Made with a live decoder and owned by it, on the decoding thread.
pub struct TapProjector {
    arch: Arch,
    bands: usize,
    lookahead: usize,
    causal: usize,
    form: Form,
}

enum Form {
    Hyper(Box<Hyper>),
    Harmonic(Box<Harmonic>),
}

impl TapProjector {
    /// For taps that read `causal_hops` hops of the present and the past, at least 1; `None` if the model has no time filters.
    #[must_use]
    pub fn new(model: &CloudModel, projection: Projection, causal_hops: usize) -> Option<Self> {
        let sizes = model.sizes();
        if sizes.frames == 0 {
            return None;
        }
        let causal = causal_hops.max(1);
        let lookahead = projection.lookahead_hops(sizes.frames);
        let lags = Lags { projection, frames: sizes.frames, first: -lookahead.cast_signed(), count: lookahead + causal };
        let form = match model.parts().kind {
            CloudKind::Full => Form::Hyper(Box::new(Hyper::new(model, &lags))),
            CloudKind::Taps => return None,
            CloudKind::Sh | CloudKind::SimpleSh => Form::Harmonic(Box::new(Harmonic::new(model, &lags))),
        };
        Some(Self { arch: Arch::new(), bands: sizes.bands, lookahead, causal, form })
    }

    /// Room for the taps of a listener; they let nothing through yet.
    #[must_use]
    pub fn taps(&self) -> StreamTaps {
        let (neighbours, banded) = match &self.form {
            Form::Hyper(hyper) => (FREQUENCY_TAPS, hyper.live.is_some()),
            Form::Harmonic(_) => (1, false),
        };
        StreamTaps::silent(self.bands, neighbours, self.lookahead, self.causal, banded)
    }

    /// Takes the taps of a listener. `out` is from [`TapProjector::taps`].
    ///
    /// # Real-time
    /// Any thread; no allocation.
    pub fn project(&mut self, listener: &Listener, masks: &Masks, out: &mut StreamTaps) {
        match &mut self.form {
            Form::Hyper(hyper) => hyper.project(self.arch, masks, out),
            Form::Harmonic(harmonic) => harmonic.project(self.arch, listener, out),
        }
    }

    /// Bytes in memory.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        match &self.form {
            Form::Hyper(h) => 4 * h.constant.len() + h.live.as_ref().map_or(0, |(_, units)| units.memory_bytes()),
            Form::Harmonic(h) => h.kernel.memory_bytes() + h.bias.memory_bytes(),
        }
    }
}

/// The lags of the taps that are wanted.
struct Lags {
    projection: Projection,
    frames: usize,
    first: isize,
    count: usize,
}

impl Lags {
    fn tap(&self, index: usize, at: impl Fn(usize, usize) -> f32) -> f32 {
        self.projection.tap(self.frames, self.first + index.cast_signed(), at)
    }

    fn bias(&self, at: impl Fn(usize) -> f32) -> f32 {
        self.projection.bias(self.frames, at)
    }
}

/// Taps of the hyper-network: the projection is linear, so each hidden unit has its own and they are summed per band.
struct Hyper {
    embedding: Embedding,
    /// Hidden layer and the weights from its units to taps; none where the kernel is constant.
    live: Option<(Hidden, Weights)>,
    /// Taps that do not depend on the listener.
    constant: Vec<f32>,
    bias_hidden: Hidden,
    bias_weights: Weights,
    bias: f32,
}

impl Hyper {
    fn new(model: &CloudModel, lags: &Lags) -> Self {
        let sizes = model.sizes();
        let (frames, hyper, hyper_bias) = (sizes.frames, sizes.hyper, sizes.hyper_bias);
        let unit_weights = model.weights("post_process.weight_model.2.weight");
        let constant = match hyper {
            0 => model.weights("post_process.kernel"),
            _ => model.weights("post_process.weight_model.2.bias"),
        };
        // Kernels are stored by neighbouring band, input frame and output frame.
        let flat = |tap: usize, t: usize, s: usize| (tap / lags.count * frames + s) * frames + t;
        let taps = FREQUENCY_TAPS * lags.count;
        let unit_tap = |u: usize, tap: usize| lags.tap(tap % lags.count, |t, s| unit_weights[flat(tap, t, s) * hyper + u]);
        let bias_weights = model.weights("post_process.bias_model.2.weight");
        let bias = model.weights("post_process.bias_model.2.bias");
        Self {
            embedding: Embedding::new(model),
            live: (hyper > 0).then(|| (Hidden::new(model, "weight_model"), Weights::new(hyper, taps, unit_tap))),
            constant: (0..taps).map(|tap| lags.tap(tap % lags.count, |t, s| constant[flat(tap, t, s)])).collect(),
            bias_hidden: Hidden::new(model, "bias_model"),
            bias_weights: Weights::new(hyper_bias, 1, |u, _| lags.bias(|t| bias_weights[t * hyper_bias + u])),
            bias: lags.bias(|t| bias[t]),
        }
    }

    fn project(&mut self, arch: Arch, masks: &Masks, out: &mut StreamTaps) {
        let embedding = self.embedding.set(masks);
        out.bias.row_mut(0).fill(self.bias);
        let hidden = self.bias_hidden.run(arch, embedding);
        FrameProduct { weights: &self.bias_weights, x: hidden, gate: None, out: &mut out.bias }.run(arch);
        match (&mut out.kernel, &mut self.live) {
            (Kernel::Banded(taps), Some((hidden, units))) => {
                for (tap, constant) in self.constant.iter().enumerate() {
                    taps.row_mut(tap).fill(*constant);
                }
                let x = hidden.run(arch, embedding);
                FrameProduct { weights: units, x, gate: None, out: taps }.run(arch);
            }
            (Kernel::Shared(taps), None) => taps.row_mut(0).copy_from_slice(&self.constant),
            _ => debug_assert!(false, "taps of another projector"),
        }
    }
}

/// Taps from spherical harmonics: each anchor and harmonic has its own, summed with the harmonics of the listener's place.
struct Harmonic {
    harmonics: Harmonics,
    /// Rows `[anchor][harmonic]` of taps and of biases by band.
    kernel: Frames,
    bias: Frames,
}

impl Harmonic {
    fn new(model: &CloudModel, lags: &Lags) -> Self {
        let sizes = model.sizes();
        let (n, frames, harmonics) = (sizes.anchors, sizes.frames, sizes.harmonics);
        let scale = 1.0 / (n as f32).sqrt();
        let table = frame_table(model, Arch::new());
        let mut kernel = Frames::new(n * harmonics, lags.count);
        let mut bias = band_table(model);
        for (i, features) in model.weights("_acoustic_features_t").chunks_exact(2 * frames).enumerate() {
            let (inputs, biases) = features.split_at(frames);
            let mean = scale * lags.bias(|t| biases[t]);
            for row in i * harmonics..(i + 1) * harmonics {
                let outputs = table.row(row);
                for (lag, tap) in kernel.row_mut(row).iter_mut().enumerate() {
                    *tap = scale * lags.tap(lag, |t, s| outputs[t] * inputs[s]);
                }
                bias.row_mut(row).iter_mut().for_each(|b| *b *= mean);
            }
        }
        Self { harmonics: Harmonics::new(model), kernel, bias }
    }

    fn project(&mut self, arch: Arch, listener: &Listener, out: &mut StreamTaps) {
        let weights = self.harmonics.at(listener.centre);
        let Kernel::Shared(taps) = &mut out.kernel else {
            debug_assert!(false, "taps of another projector");
            return;
        };
        for (table, out) in [(&self.kernel, taps), (&self.bias, &mut out.bias)] {
            arch.dispatch(WeightedRows { weights, table, first: 0, out: out.row_mut(0) });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_diagonal_is_averaged_and_a_row_is_taken() {
        let at = |t: usize, s: usize| (10 * t + s) as f32;
        let tap = |projection: Projection, lag| projection.tap(4, lag, at);
        assert_eq!(tap(Projection::Diagonal, 0), 16.5);
        // (1, 0), (2, 1), (3, 2); then only (3, 0); then none.
        assert_eq!(tap(Projection::Diagonal, 1), 21.0);
        assert_eq!(tap(Projection::Diagonal, 3), 30.0);
        assert_eq!(tap(Projection::Diagonal, 4), 0.0);
        assert_eq!(tap(Projection::Diagonal, 9), 0.0);
        let row = [-2, -1, 0, 1, 2].map(|lag| tap(Projection::Row(2), lag));
        assert_eq!(row, [0.0, 23.0, 22.0, 21.0, 20.0]);
        assert_eq!(Projection::Row(2).lookahead_hops(4), 1);
    }
}
