//! Weights of the render head's convolution layers.

use crate::network::{CONV_LAYERS, CloudModel};

/// Weights of one layer.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct ConvLayerWeights {
    /// `[output][input][bin][frame]`: the kernel's axes are frequency and time.
    pub(crate) weight: Vec<f32>,
    /// `[output]`.
    pub(crate) bias: Vec<f32>,
}

impl ConvLayerWeights {
    /// Inputs, for kernels of `size` bins by `size` frames.
    pub(crate) fn inputs(&self, size: usize) -> usize {
        self.weight.len() / (self.bias.len() * size * size).max(1)
    }
}

/// Weights of the three layers in the published order.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ConvWeights {
    /// `out.0`, 16 outputs of 4 inputs, kernels of 7 x 7; `out.2`, 16 of 16, 3 x 3; `out.4`, 1 of 16, 3 x 3.
    ///
    /// The inputs of the first: the time filter's output, the masked magnitude of the ear, the mixture mask, the difference
    /// mask with the ear's sign.
    pub(crate) layers: [ConvLayerWeights; 3],
}

impl ConvWeights {
    /// Those of a model; `None` if it has no such layers.
    pub(crate) fn of(model: &CloudModel) -> Option<Self> {
        let values = |stem: &str, name: &str| model.weights(&format!("{stem}.{name}")).to_vec();
        let layer = |(stem, _): (&str, _)| ConvLayerWeights { weight: values(stem, "weight"), bias: values(stem, "bias") };
        model.sizes().conv.then(|| Self { layers: CONV_LAYERS.map(layer) })
    }
}
