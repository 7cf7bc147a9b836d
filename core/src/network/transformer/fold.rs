//! Weights of the transformer networks; what no pose changes is computed once, in double precision.
//!
//! - The first layer's self-attention, its normalisation and the query projection after it see no pose.
//! - The anchors' second layer is linear: it goes into the key and value projections of every layer.
//! - A bias of the keys adds the same to all scores of a query, which the softmax takes away again.
//! - Weights of a softmax sum to 1: a bias of the values goes through the output projection into its bias.
//! - Queries take the factor `1 / sqrt(head width)`, and `log2 e` for a softmax of powers of two.
//! - The mixture mask is linear in the weights averaged over heads: each anchor's features come to one number.

use super::{Layer, NormWeights, Scratch, SelfAttention, Transformer};
use crate::network::kernels::{Matrix, Panels, dot};
use crate::network::relative::{Relative, Visual, in_rows};
use crate::network::{CloudModel, CloudSizes};
use crate::number::single;
use crate::simd::Weights;
use pulp::Arch;
use std::f64::consts::LOG2_E;

/// Ends of the queries' encoding.
const QUERY_END: f32 = 0.99;

impl Transformer {
    pub(crate) fn new(model: &CloudModel, arch: Arch) -> Self {
        let fold = Fold { model, sizes: model.sizes(), heads: model.parts().heads };
        let visual = Visual::new(model);
        let audio = Matrix::from_weights(model.weights("_audio_features_f"), fold.sizes.width);
        let (start, start_query) = fold.start();
        Self {
            arch,
            heads: fold.heads,
            relative: Relative::new(model, arch),
            layers: (0..fold.sizes.layers).map(|l| fold.layer(l, &visual)).collect(),
            start: panels(&start),
            start_query: panels(&start_query),
            norm: fold.norm("decoder.norm"),
            difference: fold.plain("diff_prj"),
            mixture: in_rows(&audio.apply(&fold.values("mix_prj.weight"))),
            mixture_bias: model.weights("mix_prj.bias").first().copied().unwrap_or(0.0),
            scratch: Scratch::new(model),
        }
    }
}

/// Projections of one attention.
struct Projections {
    query: Matrix,
    query_bias: Vec<f64>,
    key: Matrix,
    value: Matrix,
    output: Matrix,
    /// Of the output, with what the values' bias comes to.
    output_bias: Vec<f64>,
}

struct Fold<'a> {
    model: &'a CloudModel,
    sizes: CloudSizes,
    heads: usize,
}

impl Fold<'_> {
    fn values(&self, name: &str) -> Vec<f64> {
        self.model.weights(name).iter().map(|v| f64::from(*v)).collect()
    }

    fn matrix(&self, name: &str, cols: usize) -> Matrix {
        Matrix::from_weights(self.model.weights(name), cols)
    }

    fn plain(&self, stem: &str) -> Weights {
        let bias = self.values(&format!("{stem}.bias"));
        let weights = self.values(&format!("{stem}.weight"));
        let cols = weights.len() / bias.len();
        Matrix::new(weights.into_iter(), cols).weights(&bias)
    }

    fn norm(&self, stem: &str) -> NormWeights {
        let take = |part: &str| self.model.weights(&format!("{stem}.{part}")).to_vec();
        NormWeights { scale: take("weight"), bias: take("bias") }
    }

    /// `value_shift` is what every value has added besides the projection's bias.
    fn projections(&self, stem: &str, value_shift: &[f64]) -> Projections {
        let c = self.sizes.width;
        let projection = self.matrix(&format!("{stem}.in_proj_weight"), c);
        let bias = self.values(&format!("{stem}.in_proj_bias"));
        let scale = LOG2_E / ((c / self.heads) as f64).sqrt();
        let output = self.matrix(&format!("{stem}.out_proj.weight"), c);
        let value_bias: Vec<_> = bias[2 * c..].iter().zip(value_shift).map(|(b, s)| b + s).collect();
        let output_bias = output.apply(&value_bias).into_iter().zip(self.values(&format!("{stem}.out_proj.bias")));
        Projections {
            query: projection.some_rows(0..c).map(|w| scale * w),
            query_bias: bias[..c].iter().map(|b| scale * b).collect(),
            key: projection.some_rows(c..2 * c),
            value: projection.some_rows(2 * c..3 * c),
            output_bias: output_bias.map(|(a, b)| a + b).collect(),
            output,
        }
    }

    fn layer(&self, layer: usize, visual: &Visual) -> Layer {
        let stem = format!("decoder.layers.{layer}");
        let cross = format!("{stem}.multihead_attn");
        let second = self.matrix("vec_proj.2.proj.weight", self.sizes.width);
        let second_bias = self.values("vec_proj.2.proj.bias");
        let none = vec![0.0; self.sizes.width];
        let unshifted = self.projections(&cross, &none);
        let p = self.projections(&cross, &unshifted.value.apply(&second_bias));
        let key_start = visual.hidden.linear(&p.key.times(&visual.second), &p.key.apply(&visual.bias));
        let self_attention = (layer > 0).then(|| {
            let own = self.projections(&format!("{stem}.self_attn"), &none);
            SelfAttention {
                query: own.query.weights(&own.query_bias),
                key: own.key.weights(&none),
                value: own.value.weights(&none),
                output: own.output.weights(&own.output_bias),
                norm: self.norm(&format!("{stem}.norm1")),
                cross_query: p.query.weights(&p.query_bias),
            }
        });
        Layer {
            self_attention,
            key: p.key.times(&second).weights(&none),
            key_start: panels(&key_start),
            value: p.value.times(&second).weights(&none),
            output: p.output.weights(&p.output_bias),
            norm: self.norm(&format!("{stem}.norm2")),
            widen: self.plain(&format!("{stem}.linear1")),
            narrow: self.plain(&format!("{stem}.linear2")),
            final_norm: self.norm(&format!("{stem}.norm3")),
        }
    }

    /// Queries after the first layer's self-attention and normalisation, and their cross-attention projection,
    /// `[band][feature]`.
    fn start(&self) -> (Matrix, Matrix) {
        let (c, bands) = (self.sizes.width, self.sizes.bands);
        let t = self.queries();
        let none = vec![0.0; c];
        let own = self.projections("decoder.layers.0.self_attn", &none);
        let (q, k, v) = (t.linear(&own.query, &own.query_bias), t.linear(&own.key, &none), t.linear(&own.value, &none));
        let mut attended = Matrix::new(std::iter::repeat_n(0.0, bands * c), c);
        let width = c / self.heads;
        for head in (0..self.heads).map(|h| h * width..(h + 1) * width) {
            let mut weights = q.some_cols(head.clone()).times(&k.some_cols(head.clone()).transposed());
            for band in 0..bands {
                let row = weights.row_mut(band);
                let top = row.iter().copied().fold(f64::MIN, f64::max);
                row.iter_mut().for_each(|s| *s = (*s - top).exp2());
                let sum: f64 = row.iter().sum();
                row.iter_mut().for_each(|s| *s /= sum);
            }
            let values = weights.times(&v.some_cols(head.clone()));
            for band in 0..bands {
                attended.row_mut(band)[head.clone()].copy_from_slice(values.row(band));
            }
        }
        let mut t = t.plus(&attended.linear(&own.output, &own.output_bias));
        let norm = self.norm("decoder.layers.0.norm1");
        for band in 0..bands {
            normalise(t.row_mut(band), &norm);
        }
        let cross = self.projections("decoder.layers.0.multihead_attn", &none);
        let query = t.linear(&cross.query, &cross.query_bias);
        (t, query)
    }

    /// Embedding of the query frequencies, `[band][feature]`.
    fn queries(&self) -> Matrix {
        let frequencies = self.model.weights("freq_embedder.freqs");
        let encoded = (0..self.sizes.bands).flat_map(|band| {
            // Products in single precision, as the published network was trained with.
            let x = query_place(band, self.sizes.bands);
            let phases = frequencies.iter().map(move |f| f64::from(f * x));
            std::iter::once(f64::from(x)).chain(phases.clone().map(f64::sin)).chain(phases.map(f64::cos))
        });
        let encoded = Matrix::new(encoded, 1 + 2 * frequencies.len());
        let weights = self.matrix("query_prj.0.weight", encoded.cols());
        encoded.linear(&weights, &self.values("query_prj.0.bias")).map(|x| x.max(0.0))
    }
}

/// Evenly spaced from one end to the other, rounded as `torch.linspace` does: from the nearer end, with a step in single
/// precision.
///
/// The last bit of it turns the highest octave's phase by 6e-5.
fn query_place(band: usize, bands: usize) -> f32 {
    let last = bands.max(2) - 1;
    let step = f64::from(2.0 * QUERY_END / last as f32);
    let end = f64::from(QUERY_END);
    single(if band < bands / 2 { step * band as f64 - end } else { end - step * (last - band) as f64 })
}

fn normalise(row: &mut [f64], norm: &NormWeights) {
    let count = row.len() as f64;
    let mean = row.iter().sum::<f64>() / count;
    row.iter_mut().for_each(|x| *x -= mean);
    let inverse = 1.0 / (dot(row, row) / count + 1e-5).sqrt();
    for ((x, scale), bias) in row.iter_mut().zip(&norm.scale).zip(&norm.bias) {
        *x = *x * inverse * f64::from(*scale) + f64::from(*bias);
    }
}

fn panels(matrix: &Matrix) -> Panels {
    Panels::from_fn(matrix.cols(), matrix.rows(), |position, feature| matrix.at(position, feature))
}
