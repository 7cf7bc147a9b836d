//! The network of pi-AVAS (figure 4): an encoder, gated convolutions of growing dilation that are told time and places, and a
//! decoder of what they all skip.

use crate::network::Graph;
use crate::weights::{Arrays, Start};
use burn::tensor::activation::{relu, sigmoid};
use burn::tensor::{Device, Tensor, TensorData};
use promenade_core::random::Random;

/// Hops between the neighbours of each block's convolution.
const DILATIONS: [usize; 5] = [1, 2, 4, 8, 16];
/// Random frequencies of the encoding of places and time (random Gaussian Fourier embedding), and their deviations: places are
/// told in deviations from their mean, time from 0 to 1.
const FREQUENCIES: usize = 16;
const PLACES_DEVIATION: f32 = 0.5;
const TIME_DEVIATION: f32 = 3.0;
/// How large the decoder's last weights are at the start, beside those of other layers: it begins near zero.
const QUIET: f32 = 0.1;

/// Numbers in and out.
#[derive(Clone, Copy)]
pub(super) struct Sizes {
    /// Of a hop.
    pub(super) features: usize,
    /// That tell the places.
    pub(super) places: usize,
    /// Channels.
    pub(super) width: usize,
}

pub(super) struct Gated {
    sizes: Sizes,
}

impl Gated {
    pub(super) fn new(sizes: Sizes) -> Self {
        Self { sizes }
    }

    /// Starting weights.
    pub(super) fn start(&self, seed: u64) -> Arrays {
        let Sizes { features, places, width } = self.sizes;
        let mut s = Start { random: Random::new(seed), arrays: Arrays::new() };
        s.normal("places.freqs", &[FREQUENCIES, places.max(1)], PLACES_DEVIATION);
        s.normal("time.freqs", &[FREQUENCIES, 1], TIME_DEVIATION);
        s.linear("condition.0", width, 4 * FREQUENCIES);
        s.linear("condition.1", width, width);
        s.linear("encoder.0", width, 2 * features);
        s.linear("encoder.1", width, width);
        for block in 0..DILATIONS.len() {
            s.linear(&format!("{block}.filter"), width, 3 * width);
            s.linear(&format!("{block}.gate"), width, 3 * width);
            s.linear(&format!("{block}.told"), 2 * width, width);
            s.linear(&format!("{block}.residual"), width, width);
            s.linear(&format!("{block}.skip"), width, width);
        }
        s.linear("decoder.0", width, width);
        s.linear("decoder.1", features, width);
        for part in ["weight", "bias"] {
            let values = s.arrays.get_mut(&format!("decoder.1.{part}")).into_iter().flat_map(|t| &mut t.values);
            values.for_each(|w| *w *= QUIET);
        }
        s.arrays
    }

    /// What the network says of levels on the way and of those simulated, `[response][hop][feature]`, a row for each hop.
    pub(super) fn forward(
        &self,
        graph: &Graph,
        [at, simulated]: [&[f32]; 2],
        places: &[f32],
        times: &[f32],
        device: &Device,
    ) -> Tensor<2> {
        let Sizes { features, places: numbers, width } = self.sizes;
        let batch = times.len();
        let hops = at.len() / features / batch;
        let rows = batch * hops;
        let tensor = |values: Vec<f32>, cols: usize| {
            let rows = values.len() / cols;
            Tensor::<2>::from_data(TensorData::new(values, [rows, cols]), device)
        };
        let told = if numbers == 0 { vec![0.0; batch] } else { places.to_vec() };
        let angles = tensor(told, numbers.max(1)).matmul(graph.get("places.freqs").transpose());
        let time = tensor(times.to_vec(), 1).matmul(graph.get("time.freqs").transpose());
        let waves = Tensor::cat(vec![angles.clone().sin(), angles.cos(), time.clone().sin(), time.cos()], 1);
        let condition = relu(graph.linear("condition.0", waves));
        let condition = relu(graph.linear("condition.1", condition));
        let input = Tensor::cat(vec![tensor(at.to_vec(), features), tensor(simulated.to_vec(), features)], 1);
        let mut x = relu(graph.linear("encoder.1", relu(graph.linear("encoder.0", input))));
        let mut skipped: Option<Tensor<2>> = None;
        for (block, dilation) in DILATIONS.into_iter().enumerate() {
            let wide = neighbours(&x, [batch, hops, width], dilation, device);
            let told = graph.linear(&format!("{block}.told"), condition.clone());
            let told = told.unsqueeze_dim::<3>(1).expand([batch, hops, 2 * width]).reshape([rows, 2 * width]);
            let filter = graph.linear(&format!("{block}.filter"), wide.clone()) + told.clone().slice([0..rows, 0..width]);
            let gate = graph.linear(&format!("{block}.gate"), wide) + told.slice([0..rows, width..2 * width]);
            let y = filter.tanh() * sigmoid(gate);
            x = x + graph.linear(&format!("{block}.residual"), y.clone());
            let skip = graph.linear(&format!("{block}.skip"), y);
            skipped = Some(skipped.map_or(skip.clone(), |sum| sum + skip));
        }
        let sum = skipped.unwrap_or(x);
        graph.linear("decoder.1", relu(graph.linear("decoder.0", relu(sum))))
    }
}

/// Each hop's features between those of the hops so far before and after it, zeros beyond the ends.
fn neighbours(x: &Tensor<2>, [batch, hops, width]: [usize; 3], dilation: usize, device: &Device) -> Tensor<2> {
    let d = dilation.min(hops);
    let x = x.clone().reshape([batch, hops, width]);
    let zeros = Tensor::<3>::zeros([batch, d, width], device);
    let before = Tensor::cat(vec![zeros.clone(), x.clone().slice([0..batch, 0..hops - d, 0..width])], 1);
    let after = Tensor::cat(vec![x.clone().slice([0..batch, d..hops, 0..width]), zeros], 1);
    Tensor::cat(vec![before, x, after], 2).reshape([batch * hops, 3 * width])
}
