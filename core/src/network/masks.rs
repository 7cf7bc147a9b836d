//! What the network predicts for one listener.

use crate::network::CloudSizes;

/// Masks of one listener, one value per query frequency.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Masks {
    /// Mixture mask m, linear gain; unbounded, of either sign.
    pub mixture: Vec<f32>,
    /// Difference mask in (-1, 1); positive = right louder.
    pub difference: Vec<f32>,
    /// Embedding of each query, `[band][width]`, that the hyper-network reads; empty without a transformer.
    pub embedding: Vec<f32>,
}

impl Masks {
    /// Room for the masks of a model.
    #[must_use]
    pub fn new(sizes: &CloudSizes) -> Self {
        let embedding = if sizes.layers > 0 { sizes.bands * sizes.width } else { 0 };
        Self { mixture: vec![0.0; sizes.bands], difference: vec![0.0; sizes.bands], embedding: vec![0.0; embedding] }
    }
}
