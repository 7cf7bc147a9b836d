//! Weights of the render head's convolution layers.

use crate::network::{CONV_LAYERS, CloudModel};

/// Weights of one layer, or derivatives by them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ConvLayerWeights {
    /// `[output][input][bin][frame]`: the kernel's axes are frequency and time.
    pub weight: Vec<f32>,
    /// `[output]`.
    pub bias: Vec<f32>,
}

impl ConvLayerWeights {
    /// Inputs, for kernels of `size` bins by `size` frames.
    pub(crate) fn inputs(&self, size: usize) -> usize {
        self.weight.len() / (self.bias.len() * size * size).max(1)
    }
}

/// Weights of the three layers in the published order, or derivatives by them.
#[derive(Clone, Debug, PartialEq)]
pub struct ConvWeights {
    /// `out.0`, 16 outputs of 4 inputs, kernels of 7 x 7; `out.2`, 16 of 16, 3 x 3; `out.4`, 1 of 16, 3 x 3.
    ///
    /// The inputs of the first: the time filter's output, the masked magnitude of the ear, the mixture mask, the difference
    /// mask with the ear's sign.
    pub layers: [ConvLayerWeights; 3],
}

impl ConvWeights {
    /// Zeros.
    #[must_use]
    pub fn zeros() -> Self {
        let layer = |(_, shape): (_, [usize; 4])| ConvLayerWeights {
            weight: vec![0.0; shape.iter().product()],
            bias: vec![0.0; shape[0]],
        };
        Self { layers: CONV_LAYERS.map(layer) }
    }

    /// Those of a model; `None` if it has no such layers.
    #[must_use]
    pub fn of(model: &CloudModel) -> Option<Self> {
        model.sizes().conv.then(|| Self::by_name(|name| Some(model.weights(name)))).flatten()
    }

    /// Those of weights by the published names; `None` if one is not there.
    pub fn by_name<'a>(weights: impl Fn(&str) -> Option<&'a [f32]>) -> Option<Self> {
        let values = |stem: &str, name: &str| Some(weights(&format!("{stem}.{name}"))?.to_vec());
        let layer = |(stem, _)| Some(ConvLayerWeights { weight: values(stem, "weight")?, bias: values(stem, "bias")? });
        let [first, second, last] = CONV_LAYERS.map(layer);
        Some(Self { layers: [first?, second?, last?] })
    }

    /// What each tensor is called, how long it should be and how long it is.
    pub(crate) fn lengths(&self) -> [(&'static str, usize, usize); 6] {
        let [first, second, third] = &self.layers;
        let [a, b, c] = CONV_LAYERS.map(|(_, shape)| (shape.iter().product(), shape[0]));
        [
            ("weights of out.0", a.0, first.weight.len()),
            ("biases of out.0", a.1, first.bias.len()),
            ("weights of out.2", b.0, second.weight.len()),
            ("biases of out.2", b.1, second.bias.len()),
            ("weights of out.4", c.0, third.weight.len()),
            ("biases of out.4", c.1, third.bias.len()),
        ]
    }
}
