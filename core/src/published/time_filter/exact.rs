//! The time filter of a whole clip, as it is published.

use super::harmonics::{Harmonics, band_table, frame_table};
use super::hyper::{Embedding, Hidden};
use crate::network::shapes::FREQUENCY_TAPS;
use crate::network::{CloudKind, CloudModel, Listener, Masks};
use crate::published::frames::{FrameProduct, Frames, MARGIN, WeightedRows};
use crate::simd::Weights;
use pulp::Arch;

/// Mixes the frames of a clip for a listener.
pub(crate) struct TimeFilter {
    arch: Arch,
    form: Form,
}

enum Form {
    Hyper(Box<Hyper>),
    Harmonic(Box<Harmonic>),
}

impl TimeFilter {
    /// `None` if the model has no time filters.
    pub(crate) fn new(model: &CloudModel, arch: Arch) -> Option<Self> {
        let form = match model.parts().kind {
            _ if model.sizes().frames == 0 => return None,
            CloudKind::Full => Form::Hyper(Box::new(Hyper::new(model))),
            CloudKind::Taps => return None,
            CloudKind::Sh | CloudKind::SimpleSh => Form::Harmonic(Box::new(Harmonic::new(model, arch))),
        };
        Some(Self { arch, form })
    }

    /// Filters magnitudes times the mixture mask into `mix`, both `[frame][band]`. Does not allocate.
    pub(crate) fn apply(&mut self, listener: &Listener, masks: &Masks, masked: &Frames, mix: &mut Frames) {
        match &mut self.form {
            Form::Hyper(hyper) => hyper.apply(self.arch, masks, masked, mix),
            Form::Harmonic(harmonic) => harmonic.apply(self.arch, listener, masked, mix),
        }
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        match &self.form {
            Form::Hyper(h) => h.units.iter().chain([&h.constant, &h.bias_weights]).map(Weights::memory_bytes).sum(),
            Form::Harmonic(h) => {
                let rows = [&h.frame_table, &h.band_table, &h.frame_weights, &h.band_weights, &h.matrix];
                let weights = [&h.kernel_features, &h.bias_features, &h.kernel];
                rows.map(Frames::memory_bytes).iter().chain(&weights.map(Weights::memory_bytes)).sum()
            }
        }
    }
}

/// `mix[f] = x[f] (B + sum_u h_u[f] W_u) + bias[f]`, where x holds the frames of a band and the two below it: the kernel of
/// every band is a sum of few matrices, so it is applied matrix by matrix and never formed.
struct Hyper {
    embedding: Embedding,
    /// Hidden layer and W of each of its units, `[FREQUENCY_TAPS T][T]`; none where the kernel is constant.
    hidden: Option<Hidden>,
    units: Vec<Weights>,
    /// B.
    constant: Weights,
    bias_hidden: Hidden,
    bias_weights: Weights,
    bias: Vec<f32>,
}

impl Hyper {
    fn new(model: &CloudModel) -> Self {
        let sizes = model.sizes();
        let (frames, inputs, hyper) = (sizes.frames, FREQUENCY_TAPS * sizes.frames, sizes.hyper);
        let unit_weights = model.weights("post_process.weight_model.2.weight");
        let constant = match hyper {
            0 => model.weights("post_process.kernel"),
            _ => model.weights("post_process.weight_model.2.bias"),
        };
        let bias_weights = model.weights("post_process.bias_model.2.weight");
        let unit = |u: usize| Weights::new(inputs, frames, |k, t| unit_weights[(k * frames + t) * hyper + u]);
        Self {
            embedding: Embedding::new(model),
            hidden: (hyper > 0).then(|| Hidden::new(model, "weight_model")),
            units: (0..hyper).map(unit).collect(),
            constant: Weights::new(inputs, frames, |k, t| constant[k * frames + t]),
            bias_hidden: Hidden::new(model, "bias_model"),
            bias_weights: Weights::new(sizes.hyper_bias, frames, |u, t| bias_weights[t * sizes.hyper_bias + u]),
            bias: model.weights("post_process.bias_model.2.bias").to_vec(),
        }
    }

    fn apply(&mut self, arch: Arch, masks: &Masks, masked: &Frames, mix: &mut Frames) {
        let embedding = self.embedding.set(masks);
        for (frame, bias) in self.bias.iter().enumerate() {
            mix.row_mut(frame).fill(*bias);
        }
        let hidden = self.bias_hidden.run(arch, embedding);
        FrameProduct { weights: &self.bias_weights, x: hidden, gate: None, out: mix }.run(arch);
        FrameProduct { weights: &self.constant, x: masked, gate: None, out: mix }.run(arch);
        if let Some(hidden) = &mut self.hidden {
            let gates = hidden.run(arch, embedding);
            for (u, weights) in self.units.iter().enumerate() {
                // A unit that is silent for all bands adds nothing.
                if gates.row(u).iter().any(|h| *h != 0.0) {
                    FrameProduct { weights, x: masked, gate: Some((gates, u)), out: mix }.run(arch);
                }
            }
        }
    }
}

/// `mix[f][t] = sum_s K[t][s] masked[s][f] + bias[f][t]`, where K and the bias are sums over anchors of harmonics times
/// features.
struct Harmonic {
    harmonics: Harmonics,
    /// Frame and band weights of each anchor and harmonic, `[anchor][harmonic]`.
    frame_table: Frames,
    band_table: Frames,
    /// Their sums over harmonics, by anchor.
    frame_weights: Frames,
    band_weights: Frames,
    /// From anchors to input frames s, and to the bias's frames t.
    kernel_features: Weights,
    bias_features: Weights,
    /// K, rows of output frames by input frame, and the same in the order of products.
    matrix: Frames,
    kernel: Weights,
}

impl Harmonic {
    fn new(model: &CloudModel, arch: Arch) -> Self {
        let sizes = model.sizes();
        let (n, frames) = (sizes.anchors, sizes.frames);
        let features = model.weights("_acoustic_features_t");
        let scale = 1.0 / (n as f32).sqrt();
        Self {
            harmonics: Harmonics::new(model),
            frame_table: frame_table(model, arch),
            band_table: band_table(model),
            frame_weights: Frames::new(n, frames),
            band_weights: Frames::new(n, sizes.bands),
            kernel_features: Weights::new(n, frames, |i, s| scale * features[i * 2 * frames + s]),
            bias_features: Weights::new(n, frames, |i, t| scale * features[i * 2 * frames + frames + t]),
            matrix: Frames::new(frames, frames),
            kernel: Weights::new(frames, frames, |_, _| 0.0),
        }
    }

    fn apply(&mut self, arch: Arch, listener: &Listener, masked: &Frames, mix: &mut Frames) {
        let harmonics = self.harmonics.at(listener.centre);
        let pairs = [(&self.frame_table, &mut self.frame_weights), (&self.band_table, &mut self.band_weights)];
        for (table, out) in pairs {
            let count = harmonics.len() / out.count().max(1);
            for (anchor, weights) in harmonics.chunks_exact(count.max(1)).enumerate() {
                arch.dispatch(WeightedRows { weights, table, first: count * anchor, out: out.row_mut(anchor) });
            }
        }
        self.matrix.clear();
        FrameProduct { weights: &self.kernel_features, x: &self.frame_weights, gate: None, out: &mut self.matrix }.run(arch);
        self.kernel.set_rows(|input| &self.matrix.padded(input)[MARGIN..]);
        mix.clear();
        FrameProduct { weights: &self.bias_features, x: &self.band_weights, gate: None, out: mix }.run(arch);
        FrameProduct { weights: &self.kernel, x: masked, gate: None, out: mix }.run(arch);
    }
}
