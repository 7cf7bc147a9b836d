//! AV-Cloud's decoder as a graph that can be differentiated (Chen and Shlizerman, "AV-Cloud", NeurIPS 2024; sizes and names as
//! in `promenade_core::network`).

use crate::settings::NetworkSettings;
use crate::setup::Cloud;
use crate::simulated::FEATURES;
use crate::softmax::softmax;
use crate::weights::{Arrays, is_fixed};
use burn::tensor::activation::{relu, sigmoid};
use burn::tensor::{Device, Gradients, Tensor, TensorData};
use promenade_core::decode::MAX_LOG_COEFFICIENT;
use promenade_core::glam::Vec3;
use promenade_core::network::Listener;
use std::collections::BTreeMap;

/// Ends of the queries' encoding.
const QUERY_END: f32 = 0.99;
/// Added to variances before they are divided by.
const NORM_EPS: f64 = 1e-5;

/// The weights of one step as parts of a graph.
pub(crate) struct Graph {
    device: Device,
    leaves: BTreeMap<String, Leaf>,
}

/// Arrays of one, two or three dimensions; the graph keeps them as matrices.
struct Leaf {
    tensor: Tensor<2>,
}

/// Masks and embeddings of a batch of listeners.
pub(crate) struct Decoded {
    /// Mixture mask, `[listener][query]`.
    pub(crate) mixture: Tensor<2>,
    /// Difference mask, `[listener][query]`.
    pub(crate) difference: Tensor<2>,
    /// Embedding, `[listener][query][width]`.
    pub(crate) embedding: Tensor<3>,
}

/// A listener with what is heard.
#[derive(Clone, Copy)]
pub(crate) struct Query<'a> {
    pub(crate) listener: Listener,
    /// The emitter, where the last anchor is one, in the cloud's world.
    pub(crate) emitter: Option<Vec3>,
    /// Levels of a simulation, `[query][feature]`, where the network has them.
    pub(crate) simulated: Option<&'a [f32]>,
}

/// `[rows][cols]` as a tensor.
fn matrix(values: Vec<f32>, cols: usize, device: &Device) -> Tensor<2> {
    let rows = values.len() / cols;
    Tensor::from_data(TensorData::new(values, [rows, cols]), device)
}

/// Positional encoding of rows of `d` numbers: the numbers, then sines, then cosines of all of them by each factor.
fn encode(rows: &[f32], d: usize, factors: &[f32]) -> Vec<f32> {
    let mut out = Vec::with_capacity(rows.len() * (1 + 2 * factors.len()));
    for row in rows.chunks_exact(d) {
        out.extend(row);
        out.extend(factors.iter().flat_map(|f| row.iter().map(move |x| (f * x).sin())));
        out.extend(factors.iter().flat_map(|f| row.iter().map(move |x| (f * x).cos())));
    }
    out
}

impl Graph {
    /// Takes the weights to a device; those that are learnt are differentiated by.
    #[must_use]
    pub(crate) fn new(weights: &Arrays, device: &Device) -> Self {
        let leaf = |tensor: &promenade_core::network::Tensor, fixed: bool| {
            let cols = match tensor.shape[..] {
                [n] => n,
                [_, .., 1] => tensor.shape[1],
                _ => tensor.shape[1..].iter().product(),
            };
            let tensor = matrix(tensor.values.clone(), cols, device);
            Leaf { tensor: if fixed { tensor } else { tensor.require_grad() } }
        };
        let leaves = weights.iter().map(|(name, tensor)| (name.clone(), leaf(tensor, is_fixed(name)))).collect();
        Self { device: device.clone(), leaves }
    }

    /// Weights by name, `[rows][cols]`; arrays of one dimension are one row.
    ///
    /// # Panics
    /// If there are none of that name.
    pub(crate) fn get(&self, name: &str) -> Tensor<2> {
        self.leaves[name].tensor.clone()
    }

    /// The derivatives by all weights that the differentiated number depends on.
    pub(crate) fn gradients(&self, gradients: &Gradients) -> BTreeMap<String, Vec<f32>> {
        let of = |leaf: &Leaf| leaf.tensor.grad(gradients).and_then(|g| g.into_data().try_into_vec::<f32>().ok());
        self.leaves.iter().filter_map(|(name, leaf)| Some((name.clone(), of(leaf)?))).collect()
    }

    pub(crate) fn linear(&self, stem: &str, x: Tensor<2>) -> Tensor<2> {
        x.matmul(self.get(&format!("{stem}.weight")).transpose()) + self.get(&format!("{stem}.bias"))
    }

    fn projection(&self, stem: &str, x: Tensor<2>) -> Tensor<2> {
        let hidden = self.linear(&format!("{stem}.0.proj"), x);
        // PReLU with one slope: what is below 0 comes back by its share.
        let slope = self.get(&format!("{stem}.1.weight"));
        let hidden = relu(hidden.clone()) - relu(-hidden) * slope;
        self.linear(&format!("{stem}.2.proj"), hidden)
    }

    fn norm(&self, stem: &str, x: Tensor<2>) -> Tensor<2> {
        let centred = x.clone() - x.mean_dim(1);
        let variance = (centred.clone() * centred.clone()).mean_dim(1);
        centred / (variance + NORM_EPS).sqrt() * self.get(&format!("{stem}.weight")) + self.get(&format!("{stem}.bias"))
    }

    /// One of the three input projections of an attention, `[rows][width]`.
    fn part(&self, stem: &str, part: usize, x: Tensor<2>) -> Tensor<2> {
        let width = x.dims()[1];
        let weight = self.get(&format!("{stem}.in_proj_weight")).slice([part * width..(part + 1) * width, 0..width]);
        let bias = self.get(&format!("{stem}.in_proj_bias")).slice([0..1, part * width..(part + 1) * width]);
        x.matmul(weight.transpose()) + bias
    }

    /// Attention of `batch` sets of queries to as many sets of keys and values, all as rows; its weights on request.
    fn attend(&self, stem: &str, [q, k, v]: [Tensor<2>; 3], batch: usize, heads: usize) -> (Tensor<2>, Tensor<4>) {
        let width = q.dims()[1];
        let head = width / heads;
        let split = |x: Tensor<2>| {
            let rows = x.dims()[0] / batch;
            x.reshape([batch, rows, heads, head]).swap_dims(1, 2)
        };
        let q = self.part(stem, 0, q) * (1.0 / (head as f64).sqrt());
        let (q, k, v) = (split(q), split(self.part(stem, 1, k)), split(self.part(stem, 2, v)));
        let weights = softmax(q.matmul(k.swap_dims(2, 3)));
        let rows = batch * weights.dims()[2];
        let out = weights.clone().matmul(v).swap_dims(1, 2).reshape([rows, width]);
        (self.linear(&format!("{stem}.out_proj"), out), weights)
    }

    /// Masks and embeddings of what is heard.
    #[must_use]
    pub(crate) fn decode(
        &self,
        cloud: &Cloud,
        heard: &[Query<'_>],
        settings: &NetworkSettings,
        factors: [&[f32]; 2],
    ) -> Decoded {
        let (batch, bands, width) = (heard.len(), settings.bands, settings.width);
        let [relative_factors, query_factors] = factors;
        let mut relative = Vec::with_capacity(3 * batch * cloud.anchors.len());
        for Query { listener, emitter, .. } in heard {
            let turn = listener.camera_to_world.transpose();
            let fixed = cloud.anchors.len() - usize::from(cloud.has_emitter);
            let last = emitter.or(cloud.anchors.last().copied()).filter(|_| cloud.has_emitter);
            let anchors = cloud.anchors[..fixed].iter().copied().chain(last);
            relative.extend(anchors.flat_map(|a| (turn * (a - listener.centre) / cloud.max_norm).to_array()));
        }
        let inputs = 3 * (1 + 2 * relative_factors.len());
        let value = self.projection("vec_proj", matrix(encode(&relative, 3, relative_factors), inputs, &self.device));
        let anchors = cloud.anchors.len();
        let features = cloud.features.len() / anchors;
        let seen = self.projection("pcd_av_proj", matrix(cloud.features.clone(), features, &self.device));
        let key = value.clone().reshape([batch, anchors, width]) + seen.unsqueeze::<3>();
        let key = key.reshape([batch * anchors, width]);

        let places: Vec<f32> = (0..bands).map(|k| QUERY_END * (2.0 * k as f32 / (bands - 1) as f32 - 1.0)).collect();
        let encoded = matrix(encode(&places, 1, query_factors), 1 + 2 * query_factors.len(), &self.device);
        let mut t = relu(self.linear("query_prj.0", encoded));
        let each = |t: Tensor<2>| t.unsqueeze::<3>().expand([batch, bands, width]).reshape([batch * bands, width]);
        if settings.simulated {
            let levels = heard.iter().flat_map(|h| h.simulated.iter().copied().flatten().copied()).collect();
            t = each(t) + self.linear("sim_prj", matrix(levels, FEATURES, &self.device));
        }
        let mut attention = Tensor::<4>::zeros([batch, settings.heads, bands, anchors], &self.device);
        for layer in 0..settings.layers {
            let stem = format!("decoder.layers.{layer}");
            // Before anything of the listeners comes in, one computation does for all of them.
            let is_common = layer == 0 && !settings.simulated;
            let sets = if is_common { 1 } else { batch };
            let own = self.attend(&format!("{stem}.self_attn"), [t.clone(), t.clone(), t.clone()], sets, settings.heads).0;
            t = self.norm(&format!("{stem}.norm1"), t + own);
            if is_common {
                t = each(t);
            }
            let cross = format!("{stem}.multihead_attn");
            let (crossed, weights) = self.attend(&cross, [t.clone(), key.clone(), value.clone()], batch, settings.heads);
            attention = weights;
            t = self.norm(&format!("{stem}.norm2"), t + crossed);
            let wide = relu(self.linear(&format!("{stem}.linear1"), t.clone()));
            t = self.norm(&format!("{stem}.norm3"), t + self.linear(&format!("{stem}.linear2"), wide));
        }
        let embedding = self.norm("decoder.norm", t);
        // Linear in the weights averaged over heads: each anchor's features come to one number.
        let gains = self.get("_audio_features_f").matmul(self.get("mix_prj.weight").transpose());
        let mixture = attention.mean_dim(1).reshape([batch * bands, anchors]).matmul(gains) + self.get("mix_prj.bias");
        let difference = sigmoid(self.linear("diff_prj", embedding.clone())) * 2.0 - 1.0;
        Decoded {
            mixture: mixture.reshape([batch, bands]),
            difference: difference.reshape([batch, bands]),
            embedding: embedding.reshape([batch, bands, width]),
        }
    }

    /// Coefficients of the tap shapes, `[listener][query, ear, shape]`.
    #[must_use]
    pub(crate) fn coefficients(&self, embedding: &Tensor<3>) -> Tensor<2> {
        let [batch, bands, width] = embedding.dims();
        let logs = self.linear("tap_prj", embedding.clone().reshape([batch * bands, width]));
        let outputs = logs.dims()[1];
        logs.clamp_max(MAX_LOG_COEFFICIENT).exp().reshape([batch, bands * outputs])
    }
}
