//! Neural acoustic fields (Luo et al., NeurIPS 2022, section 3).

use super::layers::{Graph, Start, WIDTH, crossed, encode, encoded, frequencies};
use super::{Baseline, Bounds, Heard, placed, yaw};
use burn::tensor::Tensor;
use burn::tensor::activation::leaky_relu;
use promenade_core::glam::Vec3;
use promenade_trainer::Arrays;

/// Spacing of the grid of local features, metres, and numbers at each of its points.
const SPACING_M: f32 = 0.25;
const FEATURES: usize = 64;
/// Layers of the decoder after the first, and the one that is given the first one's output again.
const LAYERS: usize = 7;
const SKIP: usize = 4;
/// Slope of a rectifier below 0.
const LEAK: f64 = 0.1;
/// The largest logarithm of a gain.
const LOUDEST: f32 = 5.0;

/// Features are learnt on a grid over the floor, the same for emitter and listener, and averaged about each by a Gaussian
/// kernel whose width is learnt at each point (section 3.2). A decoder gives the logarithm of the gain of an ear from them,
/// from encoded places and frequency, and from learnt embeddings of direction and ear.
///
/// The published decoder has time among its inputs, for responses; a gain is for all times.
pub(crate) struct Naf {
    pub(crate) bounds: Bounds,
    pub(crate) bins: usize,
}

impl Naf {
    fn counts(&self) -> [usize; 2] {
        let size = self.bounds[1] - self.bounds[0];
        [size.x, size.y].map(|length| (length / SPACING_M).ceil() as usize + 1)
    }

    fn points(&self) -> usize {
        self.counts().iter().product()
    }

    /// Squares of the distances to the grid's points, metres, `[place][point]`.
    fn squares(&self, places: impl Iterator<Item = Vec3>) -> Vec<f32> {
        let ([across, along], low) = (self.counts(), self.bounds[0]);
        let point = |i: usize| (low.x + SPACING_M * (i % across) as f32, low.y + SPACING_M * (i / across) as f32);
        let of = |at: Vec3| (0..across * along).map(point).map(move |(x, y)| (at.x - x).powi(2) + (at.y - y).powi(2));
        places.flat_map(of).collect()
    }

    /// The grid's features about places.
    fn local(&self, graph: &Graph, places: impl Iterator<Item = Vec3>) -> Tensor<2> {
        let squares = graph.matrix(self.squares(places), self.points());
        // Minus the square over twice the variance, whose logarithm is learnt.
        let kernel = (-squares * (-graph.get("spread")).exp() * 0.5).exp();
        let sum = kernel.clone().sum_dim(1) + 1e-12;
        (kernel / sum).matmul(graph.get("grid"))
    }
}

impl Baseline for Naf {
    fn name(&self) -> &'static str {
        "NAF"
    }

    fn start(&self, seed: u64) -> Arrays {
        let mut start = Start::new(seed);
        start.put("grid", [self.points(), FEATURES], |random| 0.1 * random.normal());
        let variance = SPACING_M * SPACING_M;
        start.put("spread", [1, self.points()], |_| variance.ln());
        start.linear("place", WIDTH, 2 * encoded(2) + 2 * FEATURES);
        start.linear("frequency", WIDTH, encoded(1));
        start.directions();
        start.put("ear", [2, WIDTH], |random| 0.1 * random.normal());
        start.residual("decoder", LAYERS);
        start.linear("gain", 1, WIDTH);
        start.arrays
    }

    fn gains(&self, graph: &Graph, heard: &[Heard]) -> [Tensor<2>; 2] {
        let place = |at: Vec3| encode(&placed(at, self.bounds));
        let places = heard.iter().flat_map(|h| [place(h.emitter), place(h.listener.position)].concat()).collect();
        let places = Tensor::cat(
            vec![
                graph.matrix(places, 2 * encoded(2)),
                self.local(graph, heard.iter().map(|h| h.emitter)),
                self.local(graph, heard.iter().map(|h| h.listener.position)),
            ],
            1,
        );
        let places = graph.linear("place", places) + graph.directions(heard.iter().map(|h| yaw(&h.listener)));
        let frequencies = graph.linear("frequency", graph.matrix(frequencies(self.bins), encoded(1)));
        let common = crossed(places, frequencies);
        [0, 1].map(|ear| {
            let first = leaky_relu(common.clone() + graph.get("ear").slice([ear..ear + 1, 0..WIDTH]), LEAK);
            let last = (0..LAYERS).fold(first.clone(), |x, layer| {
                let x = if layer == SKIP { x + first.clone() } else { x };
                leaky_relu(graph.linear(&format!("decoder.{layer}"), x), LEAK)
            });
            graph.linear("gain", last).clamp_max(LOUDEST).exp().reshape([heard.len(), self.bins])
        })
    }
}
