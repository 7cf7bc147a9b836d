//! Layers of the baselines' networks.

use burn::tensor::activation::relu;
use burn::tensor::{Device, Tensor, TensorData};
use promenade_core::network::Tensor as Array;
use promenade_core::random::Random;
use promenade_trainer::Arrays;
use std::collections::BTreeMap;

/// Width of all three baselines' layers. It gives them the sizes that pi-AVAS states for them (table 1): 0.7 to 0.8 MB.
pub(crate) const WIDTH: usize = 128;
/// Octaves of positional encodings.
pub(crate) const OCTAVES: i32 = 10;
/// Directions whose embeddings are learnt; those between are interpolated.
const DIRECTIONS: usize = 4;

/// The weights of one step as leaves of a graph.
pub(crate) struct Graph {
    leaves: BTreeMap<String, Tensor<2>>,
    device: Device,
}

impl Graph {
    pub(crate) fn new(weights: &Arrays, device: &Device) -> Self {
        let leaf = |array: &Array| {
            let [rows, columns] = array.shape[..] else { panic!("expected a matrix, found the shape {:?}", array.shape) };
            Tensor::from_data(TensorData::new(array.values.clone(), [rows, columns]), device).require_grad()
        };
        Self { leaves: weights.iter().map(|(name, array)| (name.clone(), leaf(array))).collect(), device: device.clone() }
    }

    /// Weights by name.
    ///
    /// # Panics
    /// If there are none of that name.
    pub(crate) fn get(&self, name: &str) -> Tensor<2> {
        self.leaves[name].clone()
    }

    /// Numbers as a matrix of so many columns.
    pub(crate) fn matrix(&self, values: Vec<f32>, columns: usize) -> Tensor<2> {
        let rows = values.len() / columns;
        Tensor::from_data(TensorData::new(values, [rows, columns]), &self.device)
    }

    pub(crate) fn linear(&self, stem: &str, x: Tensor<2>) -> Tensor<2> {
        x.matmul(self.get(&format!("{stem}.weight")).transpose()) + self.get(&format!("{stem}.bias"))
    }

    /// So many linear layers with rectifiers, whose input is added to what they give.
    pub(crate) fn residual(&self, stem: &str, layers: usize, x: Tensor<2>) -> Tensor<2> {
        let through = (0..layers).fold(x.clone(), |x, layer| relu(self.linear(&format!("{stem}.{layer}"), x)));
        x + through
    }

    /// The learnt embeddings of directions, `[direction][WIDTH]`, radians, anticlockwise.
    pub(crate) fn directions(&self, angles: impl Iterator<Item = f32>) -> Tensor<2> {
        self.matrix(angles.flat_map(shares).collect(), DIRECTIONS).matmul(self.get("direction"))
    }

    /// What was derived, by all weights.
    pub(crate) fn gradients(&self, loss: &Tensor<1>) -> BTreeMap<String, Vec<f32>> {
        let gradients = loss.backward();
        let of = |leaf: &Tensor<2>| leaf.grad(&gradients)?.into_data().try_into_vec::<f32>().ok();
        self.leaves.iter().filter_map(|(name, leaf)| Some((name.clone(), of(leaf)?))).collect()
    }
}

/// Shares of the learnt directions in one between two of them.
fn shares(angle: f32) -> [f32; DIRECTIONS] {
    let at = (angle / std::f32::consts::TAU).rem_euclid(1.0) * DIRECTIONS as f32;
    let (below, share) = (at as usize % DIRECTIONS, at.fract());
    let mut out = [0.0; DIRECTIONS];
    out[below] = 1.0 - share;
    out[(below + 1) % DIRECTIONS] += share;
    out
}

/// Every row of some beside every row of others: `x` rows change slowly.
pub(crate) fn crossed(x: Tensor<2>, y: Tensor<2>) -> Tensor<2> {
    let ([many, width], [each, _]) = (x.dims(), y.dims());
    let x = x.reshape([many, 1, width]).expand([many, each, width]);
    let y = y.reshape([1, each, width]).expand([many, each, width]);
    (x + y).reshape([many * each, width])
}

/// Positional encoding (Mildenhall et al. 2020): the numbers, then sines and cosines of pi times their octaves.
pub(crate) fn encode(numbers: &[f32]) -> Vec<f32> {
    let mut out = numbers.to_vec();
    for octave in 0..OCTAVES {
        let factor = std::f32::consts::PI * 2.0_f32.powi(octave);
        out.extend(numbers.iter().flat_map(|x| [(factor * x).sin(), (factor * x).cos()]));
    }
    out
}

/// How many numbers the encoding of so many has.
pub(crate) const fn encoded(numbers: usize) -> usize {
    numbers * (1 + 2 * OCTAVES as usize)
}

/// Encoded frequencies, from -1 to 1 over the bins, `[bin][encoded(1)]`.
pub(crate) fn frequencies(bins: usize) -> Vec<f32> {
    (0..bins).flat_map(|k| encode(&[2.0 * k as f32 / (bins.max(2) - 1) as f32 - 1.0])).collect()
}

/// Draws starting weights.
pub(crate) struct Start {
    random: Random,
    pub(crate) arrays: Arrays,
}

impl Start {
    pub(crate) fn new(seed: u64) -> Self {
        Self { random: Random::new(seed), arrays: Arrays::new() }
    }

    pub(crate) fn put(&mut self, name: &str, shape: [usize; 2], mut value: impl FnMut(&mut Random) -> f32) {
        let values = (0..shape[0] * shape[1]).map(|_| value(&mut self.random)).collect();
        self.arrays.insert(name.to_owned(), Array { shape: shape.to_vec(), values });
    }

    /// Uniform, up to one over the root of the inputs' count.
    pub(crate) fn linear(&mut self, stem: &str, outputs: usize, inputs: usize) {
        let bound = (inputs as f32).sqrt().recip();
        let draw = |random: &mut Random| bound * (2.0 * random.uniform() - 1.0);
        self.put(&format!("{stem}.weight"), [outputs, inputs], draw);
        self.put(&format!("{stem}.bias"), [1, outputs], draw);
    }

    pub(crate) fn residual(&mut self, stem: &str, layers: usize) {
        (0..layers).for_each(|layer| self.linear(&format!("{stem}.{layer}"), WIDTH, WIDTH));
    }

    pub(crate) fn directions(&mut self) {
        self.put("direction", [DIRECTIONS, WIDTH], |random| 0.1 * random.normal());
    }
}
