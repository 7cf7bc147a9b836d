//! The audio network of AV-NeRF (Liang et al., NeurIPS 2023, section 4.2).

use super::layers::{Graph, Start, WIDTH, crossed, encode, encoded, frequencies};
use super::{Baseline, Bounds, Heard, placed};
use burn::tensor::Tensor;
use burn::tensor::activation::{relu, sigmoid};
use promenade_trainer::Arrays;

/// Layers of each of the two networks.
const LAYERS: usize = 4;

/// A first network gives the mixture mask `m` by the listener's place and frequency, a second the difference mask `d` by the
/// source's direction as the head sees it. The ears hear `m (1 - d)` and `m (1 + d)` of the dry sound.
///
/// The features of rendered pictures are left out, as there are none: this is the audio network alone.
pub(crate) struct AvNerf {
    pub(crate) bounds: Bounds,
    pub(crate) bins: usize,
}

impl Baseline for AvNerf {
    fn name(&self) -> &'static str {
        "AV-NeRF, audio network"
    }

    fn start(&self, seed: u64) -> Arrays {
        let mut start = Start::new(seed);
        start.linear("place", WIDTH, encoded(2));
        start.linear("frequency", WIDTH, encoded(1));
        start.residual("mixture", LAYERS);
        start.linear("mixture.mask", 1, WIDTH);
        start.directions();
        start.residual("difference", LAYERS);
        start.linear("difference.mask", 1, WIDTH);
        start.arrays
    }

    fn gains(&self, graph: &Graph, heard: &[Heard]) -> [Tensor<2>; 2] {
        let places = heard.iter().flat_map(|h| encode(&placed(h.listener.position, self.bounds))).collect();
        let places = graph.linear("place", graph.matrix(places, encoded(2)));
        let frequencies = graph.linear("frequency", graph.matrix(frequencies(self.bins), encoded(1)));
        let shape = [heard.len(), self.bins];
        let common = graph.residual("mixture", LAYERS, relu(crossed(places, frequencies)));
        let mixture = graph.linear("mixture.mask", common.clone()).reshape(shape);
        // Section 4.3: the direction is told relative to the source.
        let seen = heard.iter().map(|h| h.listener.to_head(h.emitter)).map(|at| at.y.atan2(at.x));
        let directions = graph.directions(seen).reshape([heard.len(), 1, WIDTH]).expand([heard.len(), self.bins, WIDTH]);
        let sided = common + directions.reshape([heard.len() * self.bins, WIDTH]);
        let sided = graph.residual("difference", LAYERS, sided);
        let difference = sigmoid(graph.linear("difference.mask", sided)).reshape(shape) * 2.0 - 1.0;
        [mixture.clone() * (-difference.clone() + 1.0), mixture * (difference + 1.0)]
    }
}
