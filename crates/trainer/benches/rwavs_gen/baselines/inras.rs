//! INRAS (Su et al., NeurIPS 2022, section 3).

use super::layers::{Graph, Start, WIDTH, crossed, encode, encoded, frequencies};
use super::{Baseline, Bounds, Heard, yaw};
use burn::tensor::Tensor;
use burn::tensor::activation::relu;
use promenade_core::glam::Vec3;
use promenade_trainer::Arrays;

/// Layers of the network that puts everything together.
const LAYERS: usize = 4;
/// The largest logarithm of a gain.
const LOUDEST: f32 = 5.0;

/// Sound goes from the emitter to points on the room's surfaces, and from there to the listener. Three modules tell of the
/// emitter's distances to these points (scatter), of the points themselves (bounce) and of their distances to the listener
/// (gather). A fourth gives the logarithms of both ears' gains from all three, the head's direction and the frequency.
///
/// The published fourth module has time in the place of frequency, for responses.
pub(crate) struct Inras {
    /// Points on the surfaces, metres.
    pub(crate) points: Vec<Vec3>,
    pub(crate) bounds: Bounds,
    pub(crate) bins: usize,
}

impl Inras {
    /// Distances of a place to all points, as shares of the room's diagonal.
    fn distances(&self, at: Vec3) -> impl Iterator<Item = f32> {
        let diagonal = self.bounds[1].distance(self.bounds[0]).max(1e-3);
        self.points.iter().map(move |point| point.distance(at) / diagonal)
    }

    fn module(graph: &Graph, stem: &str, x: Tensor<2>) -> Tensor<2> {
        graph.linear(&format!("{stem}.1"), relu(graph.linear(&format!("{stem}.0"), x)))
    }
}

impl Baseline for Inras {
    fn name(&self) -> &'static str {
        "INRAS"
    }

    fn start(&self, seed: u64) -> Arrays {
        let mut start = Start::new(seed);
        for (stem, inputs) in [("scatter", self.points.len()), ("bounce", encoded(3)), ("gather", self.points.len())] {
            start.linear(&format!("{stem}.0"), WIDTH, inputs);
            start.linear(&format!("{stem}.1"), WIDTH, WIDTH);
        }
        start.directions();
        start.linear("frequency", WIDTH, encoded(1));
        start.residual("listener", LAYERS);
        start.linear("gain", 2, WIDTH);
        start.arrays
    }

    fn gains(&self, graph: &Graph, heard: &[Heard]) -> [Tensor<2>; 2] {
        let emitters = heard.iter().flat_map(|h| self.distances(h.emitter)).collect();
        let scatter = Self::module(graph, "scatter", graph.matrix(emitters, self.points.len()));
        let listeners = heard.iter().flat_map(|h| self.distances(h.listener.position)).collect();
        let gather = Self::module(graph, "gather", graph.matrix(listeners, self.points.len()));
        let [low, high] = self.bounds;
        let half = (0.5 * (high - low)).max(Vec3::splat(1e-3));
        let points = self.points.iter().flat_map(|p| encode(&((*p - low) / half - 1.0).to_array())).collect();
        let bounce = Self::module(graph, "bounce", graph.matrix(points, encoded(3))).mean_dim(0);
        let places = scatter + bounce + gather + graph.directions(heard.iter().map(|h| yaw(&h.listener)));
        let frequencies = graph.linear("frequency", graph.matrix(frequencies(self.bins), encoded(1)));
        let all = graph.residual("listener", LAYERS, relu(crossed(places, frequencies)));
        let gains = graph.linear("gain", all).clamp_max(LOUDEST).exp();
        let rows = heard.len() * self.bins;
        [0, 1].map(|ear| gains.clone().slice([0..rows, ear..ear + 1]).reshape([heard.len(), self.bins]))
    }
}
