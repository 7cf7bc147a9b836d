//! The decoders written down plainly in double precision, nothing folded, and random models for them.

#![allow(dead_code, unreachable_pub, reason = "each test uses a part of it")]

use promenade_core::Bands;
use promenade_core::glam::Vec3;
use promenade_core::network::{CloudKind, CloudModel, CloudParts, Listener, Placement, PoseConvention, Tensor};
use promenade_testing::Noise;
use std::collections::BTreeMap;

/// What a decoder gives.
pub struct Exact {
    pub mixture: Vec<f64>,
    pub difference: Vec<f64>,
    /// `[band][width]`.
    pub embedding: Vec<f64>,
    /// `[band][anchor]`, as the published network has them.
    pub weights: Vec<f64>,
    /// `[anchor]`.
    pub attention: Vec<f64>,
}

type Rows = Vec<Vec<f64>>;

struct Plain<'a>(&'a CloudModel);

pub fn decode(model: &CloudModel, listener: &Listener) -> Exact {
    let (m, parts, sizes) = (Plain(model), model.parts(), model.sizes());
    let matrix = listener.camera_to_world;
    let matrix = if parts.convention == PoseConvention::Published { matrix } else { matrix.transpose() };
    let relative = |anchor: &Vec3| {
        // Phases of up to a thousand radians: single precision where the network has it, so as not to compare its rounding.
        let r: Vec3 = matrix * (*anchor - listener.centre) / parts.max_norm;
        encode(&r.to_array(), model.weights("vec_embedder.freqs"))
    };
    let value = m.mlp("vec_proj", parts.anchors.iter().map(relative).collect());
    let features = parts.features.chunks(sizes.features).map(|f| f.iter().map(|v| f64::from(*v)).collect());
    let scene = m.mlp("pcd_av_proj", features.collect());
    let key: Rows = value.iter().zip(&scene).map(|(a, b)| sum(a, b)).collect();
    let audio = rows(model.weights("_audio_features_f"), sizes.width);
    let (hs, weights, shrink) = match parts.kind {
        CloudKind::SimpleSh => {
            let scale = 1.0 / (sizes.width as f64).sqrt();
            let queries = rows(model.weights("freq_weights"), sizes.width);
            let a: Rows = queries.iter().map(|q| key.iter().map(|k| scale * dot(q, k)).collect()).collect();
            let shrink = 1.0 / (sizes.anchors as f64).sqrt();
            let hs = mix(&a, &value).into_iter().map(|row| row.into_iter().map(|v| shrink * v).collect()).collect();
            (hs, a, shrink)
        }
        CloudKind::Full | CloudKind::Sh | CloudKind::Taps => {
            let (hs, a) = m.transformer(&key, &value);
            (hs, a, 1.0)
        }
    };
    let mixed: Rows = mix(&weights, &audio).into_iter().map(|row| row.into_iter().map(|v| shrink * v).collect()).collect();
    let column = |anchor: usize| weights.iter().map(|row| row[anchor].abs()).sum::<f64>();
    let columns: Vec<f64> = (0..sizes.anchors).map(column).collect();
    let total: f64 = columns.iter().sum();
    Exact {
        mixture: m.linear("mix_prj", &mixed).into_iter().flatten().collect(),
        difference: m.linear("diff_prj", &hs).into_iter().flatten().map(|x| 2.0 / (1.0 + (-x).exp()) - 1.0).collect(),
        embedding: hs.concat(),
        weights: weights.concat(),
        attention: columns.into_iter().map(|c| c / total).collect(),
    }
}

impl Plain<'_> {
    fn linear(&self, stem: &str, x: &Rows) -> Rows {
        self.affine(self.0.weights(&format!("{stem}.weight")), self.0.weights(&format!("{stem}.bias")), x)
    }

    fn affine(&self, weights: &[f32], bias: &[f32], x: &Rows) -> Rows {
        let weights = rows(weights, weights.len() / bias.len());
        let neuron = |x: &Vec<f64>| weights.iter().zip(bias).map(|(w, b)| dot(w, x) + f64::from(*b)).collect();
        x.iter().map(neuron).collect()
    }

    fn mlp(&self, stem: &str, x: Rows) -> Rows {
        let slope = f64::from(self.0.weights(&format!("{stem}.1.weight"))[0]);
        let hidden = self.linear(&format!("{stem}.0.proj"), &x);
        let hidden = hidden.into_iter().map(|row| row.into_iter().map(|x| if x < 0.0 { slope * x } else { x }).collect());
        self.linear(&format!("{stem}.2.proj"), &hidden.collect())
    }

    fn norm(&self, stem: &str, x: Rows) -> Rows {
        let (scale, bias) = (self.0.weights(&format!("{stem}.weight")), self.0.weights(&format!("{stem}.bias")));
        let normalise = |row: Vec<f64>| {
            let mean = row.iter().sum::<f64>() / row.len() as f64;
            let variance = row.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / row.len() as f64;
            let unit = row.iter().map(|x| (x - mean) / (variance + 1e-5).sqrt());
            unit.zip(scale).zip(bias).map(|((x, s), b)| x * f64::from(*s) + f64::from(*b)).collect()
        };
        x.into_iter().map(normalise).collect()
    }

    /// Output and weights averaged over heads.
    fn attention(&self, stem: &str, query: &Rows, key: &Rows, value: &Rows) -> (Rows, Rows) {
        let (c, heads) = (self.0.sizes().width, self.0.parts().heads);
        let projection = self.0.weights(&format!("{stem}.in_proj_weight"));
        let bias = self.0.weights(&format!("{stem}.in_proj_bias"));
        let project = |i: usize, x: &Rows| self.affine(&projection[i * c * c..(i + 1) * c * c], &bias[i * c..(i + 1) * c], x);
        let (q, k, v) = (project(0, query), project(1, key), project(2, value));
        let width = c / heads;
        let mut mean = vec![vec![0.0; key.len()]; query.len()];
        let mut joined = vec![vec![0.0; c]; query.len()];
        for h in (0..heads).map(|h| h * width..(h + 1) * width) {
            for ((q, mean), joined) in q.iter().zip(&mut mean).zip(&mut joined) {
                let scores = k.iter().map(|k| dot(&q[h.clone()], &k[h.clone()]) / (width as f64).sqrt());
                let mut weights: Vec<f64> = scores.collect();
                let top = weights.iter().copied().fold(f64::MIN, f64::max);
                weights.iter_mut().for_each(|w| *w = (*w - top).exp());
                let total: f64 = weights.iter().sum();
                for ((weight, v), mean) in weights.iter().zip(&v).zip(mean) {
                    *mean += weight / total / heads as f64;
                    joined[h.clone()].iter_mut().zip(&v[h.clone()]).for_each(|(o, v)| *o += weight / total * v);
                }
            }
        }
        (self.linear(&format!("{stem}.out_proj"), &joined), mean)
    }

    fn transformer(&self, key: &Rows, value: &Rows) -> (Rows, Rows) {
        let sizes = self.0.sizes();
        let encoded = linspace(sizes.bands).map(|x| encode(&[x], self.0.weights("freq_embedder.freqs")));
        let mut t = relu(self.linear("query_prj.0", &encoded.collect()));
        let mut weights = Vec::new();
        for l in 0..sizes.layers {
            let stem = format!("decoder.layers.{l}");
            let (own, _) = self.attention(&format!("{stem}.self_attn"), &t, &t, &t);
            t = self.norm(&format!("{stem}.norm1"), add(&t, &own));
            let (cross, mean) = self.attention(&format!("{stem}.multihead_attn"), &t, key, value);
            t = self.norm(&format!("{stem}.norm2"), add(&t, &cross));
            let wide = relu(self.linear(&format!("{stem}.linear1"), &t));
            t = self.norm(&format!("{stem}.norm3"), add(&t, &self.linear(&format!("{stem}.linear2"), &wide)));
            weights = mean;
        }
        (self.norm("decoder.norm", t), weights)
    }
}

fn rows(values: &[f32], cols: usize) -> Rows {
    values.chunks(cols).map(|row| row.iter().map(|v| f64::from(*v)).collect()).collect()
}

/// `torch.linspace(-0.99, 0.99, count)`: a step in single precision from the nearer end.
fn linspace(count: usize) -> impl Iterator<Item = f32> {
    let step = f64::from((0.99 - -0.99) / (count - 1) as f32);
    let from_low = move |i: usize| f64::from(-0.99_f32) + step * i as f64;
    let from_high = move |i: usize| f64::from(0.99_f32) - step * (count - 1 - i) as f64;
    (0..count).map(move |i| if i < count / 2 { from_low(i) } else { from_high(i) } as f32)
}

fn encode(x: &[f32], frequencies: &[f32]) -> Vec<f64> {
    let phases = || frequencies.iter().flat_map(|f| x.iter().map(move |x| f64::from(x * f)));
    x.iter().map(|x| f64::from(*x)).chain(phases().map(f64::sin)).chain(phases().map(f64::cos)).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn sum(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + b).collect()
}

fn add(a: &Rows, b: &Rows) -> Rows {
    a.iter().zip(b).map(|(a, b)| sum(a, b)).collect()
}

fn relu(x: Rows) -> Rows {
    x.into_iter().map(|row| row.into_iter().map(|x| x.max(0.0)).collect()).collect()
}

/// Weighted sums of rows.
fn mix(weights: &Rows, values: &Rows) -> Rows {
    let width = values[0].len();
    let one = |weights: &Vec<f64>| {
        let mut out = vec![0.0; width];
        for (w, v) in weights.iter().zip(values) {
            out.iter_mut().zip(v).for_each(|(o, v)| *o += w * v);
        }
        out
    };
    weights.iter().map(one).collect()
}

/// Sizes of a random model.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    pub anchors: usize,
    pub bands: usize,
    pub width: usize,
    pub heads: usize,
    pub layers: usize,
    pub kind: CloudKind,
    pub physical: bool,
}

impl Case {
    /// Weights of the size that training starts from; attention somewhat sharper. No time filters, no convolution.
    pub fn model(&self) -> CloudModel {
        let mut noise = Noise::new(7);
        let (n, c, features, octaves) = (self.anchors, self.width, 12, 10);
        let mut weights = BTreeMap::new();
        let mut put = |name: &str, shape: &[usize], scale: f32, offset: f32| {
            let values = (0..shape.iter().product()).map(|_| offset + scale * noise.value()).collect();
            weights.insert(name.to_owned(), Tensor { shape: shape.to_vec(), values });
        };
        for (stem, inputs) in [("pcd_av_proj", features), ("vec_proj", 3 * (1 + 2 * octaves))] {
            put(&format!("{stem}.0.proj.weight"), &[c, inputs], 2.0 / (inputs as f32).sqrt(), 0.0);
            put(&format!("{stem}.0.proj.bias"), &[c], 0.1, 0.0);
            put(&format!("{stem}.1.weight"), &[1], 0.0, 0.25);
            put(&format!("{stem}.2.proj.weight"), &[c, c], 2.0 / (c as f32).sqrt(), 0.0);
            put(&format!("{stem}.2.proj.bias"), &[c], 0.1, 0.0);
        }
        put("_audio_features_f", &[n, c, 1], 1.0, 0.25);
        for stem in ["mix_prj", "diff_prj"] {
            put(&format!("{stem}.weight"), &[1, c], 1.0 / (c as f32).sqrt(), 0.0);
            put(&format!("{stem}.bias"), &[1], 0.1, 0.0);
        }
        if self.kind == CloudKind::SimpleSh {
            put("freq_weights", &[self.bands, c], 0.5, 0.0);
        } else {
            put("query_prj.0.weight", &[c, 1 + 2 * octaves], 0.4, 0.0);
            put("query_prj.0.bias", &[c], 0.1, 0.0);
            put("decoder.norm.weight", &[c], 0.1, 1.0);
            put("decoder.norm.bias", &[c], 0.1, 0.0);
        }
        for l in 0..if self.kind == CloudKind::SimpleSh { 0 } else { self.layers } {
            let stem = format!("decoder.layers.{l}");
            let (scale, wide) = (1.7 / (c as f32).sqrt(), 4 * c);
            for attention in ["self_attn", "multihead_attn"] {
                put(&format!("{stem}.{attention}.in_proj_weight"), &[3 * c, c], scale, 0.0);
                put(&format!("{stem}.{attention}.in_proj_bias"), &[3 * c], 0.3, 0.0);
                put(&format!("{stem}.{attention}.out_proj.weight"), &[c, c], scale, 0.0);
                put(&format!("{stem}.{attention}.out_proj.bias"), &[c], 0.3, 0.0);
            }
            put(&format!("{stem}.linear1.weight"), &[wide, c], scale, 0.0);
            put(&format!("{stem}.linear1.bias"), &[wide], 0.1, 0.0);
            put(&format!("{stem}.linear2.weight"), &[c, wide], 0.5 * scale, 0.0);
            put(&format!("{stem}.linear2.bias"), &[c], 0.1, 0.0);
            for norm in 1..=3 {
                put(&format!("{stem}.norm{norm}.weight"), &[c], 0.1, 1.0);
                put(&format!("{stem}.norm{norm}.bias"), &[c], 0.1, 0.0);
            }
        }
        for embedder in ["vec_embedder.freqs", "freq_embedder.freqs"] {
            let values: Vec<f32> = (0..octaves).map(|k| (10.0 * k as f32 / 9.0).exp2()).collect();
            weights.insert(embedder.to_owned(), Tensor { shape: vec![octaves], values });
        }
        if self.kind == CloudKind::SimpleSh {
            weights.remove("freq_embedder.freqs");
        }
        let point = |noise: &mut Noise| Vec3::new(8.0 * noise.value(), 8.0 * noise.value(), 3.0 * noise.value());
        let top = (self.bands.max(2) - 1) as f32;
        CloudModel::new(CloudParts {
            kind: self.kind,
            heads: self.heads,
            max_norm: 25.0,
            convention: if self.physical { PoseConvention::Physical } else { PoseConvention::Published },
            placement: Placement::IDENTITY,
            frequencies: Bands::new((0..self.bands).map(|k| 11_025.0 * k as f32 / top).collect()).unwrap(),
            anchors: (0..n).map(|_| point(&mut noise)).collect(),
            features: (0..n * features).map(|_| 1.7 * noise.value()).collect(),
            weights,
        })
        .unwrap()
    }
}
