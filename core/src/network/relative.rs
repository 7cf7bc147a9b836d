//! Where the anchors lie, as a listener sees them.

use crate::network::kernels::{Activation, Matrix, PANEL, PanelProduct, Panels, Row, Start, Waves};
use crate::network::{CloudModel, Listener, PoseConvention};
use crate::simd::Weights;
use glam::Vec3;
use pulp::Arch;

/// Relative vectors are taken no longer than this many times `max_norm`: a listener far outside a scene still gets numbers.
const FARTHEST: f32 = 1e6;

/// Unit vectors from the listener to the anchors, in the cloud's world; 0 for an anchor that the listener stands on.
pub(crate) fn directions(anchors: &[Vec3], centre: Vec3, out: &mut [Vec3]) {
    for (anchor, direction) in anchors.iter().zip(out) {
        let offset = *anchor - centre;
        let distance = offset.length();
        *direction = if distance > 0.0 { offset / distance } else { Vec3::ZERO };
    }
}

/// The pose-dependent half of the anchors' embedding: relative vectors, their positional encoding, the first layer on it.
pub(crate) struct Relative {
    arch: Arch,
    anchors: Vec<Vec3>,
    convention: PoseConvention,
    max_norm: f32,
    frequencies: Vec<f32>,
    layer: Weights,
    slope: f32,
    /// Positional encoding of a panel of anchors.
    encoded: Vec<Row>,
}

impl Relative {
    pub(crate) fn new(model: &CloudModel, arch: Arch) -> Self {
        let (parts, inputs) = (model.parts(), 3 * (1 + 2 * model.sizes().octaves));
        let bias: Vec<_> = model.weights("vec_proj.0.proj.bias").iter().map(|b| f64::from(*b)).collect();
        Self {
            arch,
            anchors: parts.anchors.clone(),
            convention: parts.convention,
            max_norm: parts.max_norm,
            frequencies: model.weights("vec_embedder.freqs").to_vec(),
            layer: Matrix::from_weights(model.weights("vec_proj.0.proj.weight"), inputs).weights(&bias),
            slope: model.weights("vec_proj.1.weight").first().copied().unwrap_or(0.0),
            encoded: vec![Row::default(); inputs],
        }
    }

    /// First layer's outputs for one panel of anchors.
    pub(crate) fn hidden(&mut self, listener: &Listener, panel: usize, output: &mut [Row]) {
        let anchors = &self.anchors[panel * PANEL..];
        let anchors = &anchors[..anchors.len().min(PANEL)];
        let turn = match self.convention {
            PoseConvention::Published => listener.camera_to_world,
            PoseConvention::Physical => listener.camera_to_world.transpose(),
        };
        for (position, anchor) in anchors.iter().enumerate() {
            let relative = turn * (*anchor - listener.centre) / self.max_norm;
            for (row, x) in self.encoded.iter_mut().zip(relative.to_array()) {
                row.0[position] = if x.is_nan() { 0.0 } else { x.clamp(-FARTHEST, FARTHEST) };
            }
        }
        let (vectors, waves) = self.encoded.split_at_mut(3);
        let (sines, cosines) = waves.split_at_mut(3 * self.frequencies.len());
        let waves = sines.chunks_exact_mut(3).zip(cosines.chunks_exact_mut(3));
        for (frequency, (sines, cosines)) in self.frequencies.iter().zip(waves) {
            for ((x, sin), cos) in vectors.iter().zip(sines).zip(cosines) {
                self.arch.dispatch(Waves { frequency: *frequency, x, sin, cos });
            }
        }
        PanelProduct {
            weights: &self.layer,
            input: &self.encoded,
            start: Start::Bias,
            activation: Activation::Prelu(self.slope),
            positions: anchors.len(),
            output,
        }
        .run(self.arch);
    }
}

/// First and second layer of the visual features: the part of an anchor's key that no pose changes, `[anchor][feature]`, in two
/// steps.
pub(crate) struct Visual {
    /// Outputs of the first layer.
    pub(crate) hidden: Matrix,
    /// Second layer, `[output][input]`.
    pub(crate) second: Matrix,
    /// Bias of the second layers of the visual and of the relative half together.
    pub(crate) bias: Vec<f64>,
}

impl Visual {
    pub(crate) fn new(model: &CloudModel) -> Self {
        let (sizes, parts) = (model.sizes(), model.parts());
        let doubles = |name: &str| -> Vec<f64> { model.weights(name).iter().map(|v| f64::from(*v)).collect() };
        let first = Matrix::from_weights(model.weights("pcd_av_proj.0.proj.weight"), sizes.features);
        let slope = doubles("pcd_av_proj.1.weight").first().copied().unwrap_or(0.0);
        let features = Matrix::from_weights(&parts.features, sizes.features);
        let hidden = features.linear(&first, &doubles("pcd_av_proj.0.proj.bias"));
        let bias = doubles("pcd_av_proj.2.proj.bias").into_iter().zip(doubles("vec_proj.2.proj.bias"));
        Self {
            hidden: hidden.map(|x| if x < 0.0 { slope * x } else { x }),
            second: Matrix::from_weights(model.weights("pcd_av_proj.2.proj.weight"), sizes.width),
            bias: bias.map(|(a, b)| a + b).collect(),
        }
    }
}

/// One number per anchor in panels, as rows.
pub(crate) fn in_rows(values: &[f64]) -> Vec<Row> {
    let panels = Panels::from_fn(1, values.len(), |position, _| values[position]);
    panels.iter().flatten().copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_unit_vectors_or_zero() {
        let anchors = [Vec3::new(1.0, 2.0, 3.0), Vec3::new(1.0, 2.0, 7.0)];
        let mut out = [Vec3::ONE; 2];
        directions(&anchors, anchors[0], &mut out);
        assert_eq!(out, [Vec3::ZERO, Vec3::Z]);
    }
}
