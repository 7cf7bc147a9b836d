//! Anchor clouds of any size with random weights.

use crate::signal::{Noise, noise};
use promenade_core::Bands;
use promenade_core::glam::Vec3;
use promenade_core::network::{CloudKind, CloudModel, CloudParts, Placement, PoseConvention, Tensor};
use std::collections::BTreeMap;

/// Sizes that are chosen freely.
#[derive(Clone, Copy, Debug)]
pub struct Sizes {
    /// Anchors.
    pub anchors: usize,
    /// Frequencies of the masks.
    pub bands: usize,
    /// Frames that the time filters look over.
    pub frames: usize,
    /// Width of the transformer.
    pub width: usize,
    /// Hidden units of the hyper-network; 0 for a constant kernel.
    pub hyper: usize,
}

/// The sizes of the published models.
pub const PUBLISHED: Sizes = Sizes { anchors: 256, bands: 257, frames: 174, width: 128, hyper: 32 };

/// A model of that kind with all its weights.
///
/// # Panics
/// The sizes fit no model.
#[must_use]
pub fn model(kind: CloudKind, sizes: Sizes) -> CloudModel {
    CloudModel::new(parts(kind, sizes)).unwrap()
}

/// The same with masks that let sound through at every pose: at random they may all be silent.
///
/// # Panics
/// The sizes fit no model.
#[must_use]
pub fn sounding(kind: CloudKind, sizes: Sizes) -> CloudModel {
    let mut parts = parts(kind, sizes);
    parts.weights.insert("mix_prj.bias".into(), Tensor { shape: vec![1], values: vec![0.7] });
    if let Some(last) = parts.weights.get_mut("out.4.weight") {
        // What the convolution layers add at random stays below that.
        last.values.iter_mut().for_each(|w| *w *= 0.05);
    }
    CloudModel::new(parts).unwrap()
}

/// The parts of such a model, to be changed before it is made.
///
/// # Panics
/// There are no bands.
#[must_use]
pub fn parts(kind: CloudKind, sizes: Sizes) -> CloudParts {
    let Sizes { anchors: n, bands, frames, width: c, .. } = sizes;
    let mut weights = BTreeMap::new();
    let mut tensor = |name: &str, shape: &[usize], scale: f32| {
        let values = Noise::new(weights.len() as u64).take(shape.iter().product()).map(|value| scale * value).collect();
        weights.insert(name.to_owned(), Tensor { shape: shape.to_vec(), values });
    };
    for (stem, inputs) in [("pcd_av_proj", 150), ("vec_proj", 63)] {
        for (layer, inputs) in [(0, inputs), (2, c)] {
            let scale = (1.0 / inputs as f32).sqrt();
            tensor(&format!("{stem}.{layer}.proj.weight"), &[c, inputs], scale);
            tensor(&format!("{stem}.{layer}.proj.bias"), &[c], scale);
        }
        tensor(&format!("{stem}.1.weight"), &[1], 0.25);
    }
    tensor("_audio_features_f", &[n, c, 1], 1.0);
    for name in ["mix_prj", "diff_prj"] {
        tensor(&format!("{name}.weight"), &[1, c], 0.1);
        tensor(&format!("{name}.bias"), &[1], 0.1);
    }
    for (stem, outputs, inputs, size) in [("out.0", 16, 4, 7), ("out.2", 16, 16, 3), ("out.4", 1, 16, 3)] {
        let scale = (1.0 / (inputs * size * size) as f32).sqrt();
        tensor(&format!("{stem}.weight"), &[outputs, inputs, size, size], scale);
        tensor(&format!("{stem}.bias"), &[outputs], scale);
    }
    match kind {
        CloudKind::Full => hyper_network(&mut tensor, sizes),
        CloudKind::Sh | CloudKind::SimpleSh => {
            tensor("time_weights", &[bands, frames], 1.0);
            tensor("time_freq_weights", &[n, bands, 4], 1.0);
            tensor("_acoustic_features_t", &[n, 2 * frames], (1.0 / frames as f32).sqrt());
        }
        CloudKind::Taps => (),
    }
    match kind {
        CloudKind::SimpleSh => tensor("freq_weights", &[bands, c], 1.0),
        CloudKind::Full | CloudKind::Sh | CloudKind::Taps => transformer(&mut tensor, c),
    }
    let octaves: Vec<f32> = (0..10_u8).map(|k| 1024.0_f32.powf(f32::from(k) / 9.0)).collect();
    for name in ["vec_embedder.freqs", "freq_embedder.freqs"] {
        if name.starts_with("vec") || kind != CloudKind::SimpleSh {
            weights.insert(name.to_owned(), Tensor { shape: vec![10], values: octaves.clone() });
        }
    }
    CloudParts {
        kind,
        heads: 4,
        max_norm: 25.0,
        convention: PoseConvention::Published,
        placement: Placement::IDENTITY,
        frequencies: Bands::new((0..bands).map(|k| k as f32 * 43.066).collect()).unwrap(),
        anchors: noise(100, 3 * n).chunks(3).map(|point| 5.0 * Vec3::from_slice(point)).collect(),
        features: noise(101, 150 * n),
        weights,
    }
}

fn hyper_network(tensor: &mut impl FnMut(&str, &[usize], f32), sizes: Sizes) {
    let Sizes { frames: t, width: c, hyper, .. } = sizes;
    let scale = (1.0 / c as f32).sqrt();
    let mut layers = vec![("bias_model", 32, t, 0.1)];
    if hyper == 0 {
        tensor("post_process.kernel", &[3 * t, t], 1.0 / t as f32);
    } else {
        layers.push(("weight_model", hyper, 3 * t * t, 1.0 / t as f32));
    }
    for (name, units, outputs, size) in layers {
        tensor(&format!("post_process.{name}.0.weight"), &[units, c, 1], scale);
        tensor(&format!("post_process.{name}.0.bias"), &[units], scale);
        tensor(&format!("post_process.{name}.2.weight"), &[outputs, units, 1], size * (1.0 / units as f32).sqrt());
        tensor(&format!("post_process.{name}.2.bias"), &[outputs], size);
    }
}

fn transformer(tensor: &mut impl FnMut(&str, &[usize], f32), c: usize) {
    let scale = (1.0 / c as f32).sqrt();
    for l in 0..3 {
        let stem = format!("decoder.layers.{l}");
        for attention in ["self_attn", "multihead_attn"] {
            tensor(&format!("{stem}.{attention}.in_proj_weight"), &[3 * c, c], scale);
            tensor(&format!("{stem}.{attention}.in_proj_bias"), &[3 * c], scale);
            tensor(&format!("{stem}.{attention}.out_proj.weight"), &[c, c], scale);
            tensor(&format!("{stem}.{attention}.out_proj.bias"), &[c], scale);
        }
        for (name, outputs, inputs) in [("linear1", 4 * c, c), ("linear2", c, 4 * c)] {
            tensor(&format!("{stem}.{name}.weight"), &[outputs, inputs], (1.0 / inputs as f32).sqrt());
            tensor(&format!("{stem}.{name}.bias"), &[outputs], scale);
        }
        for norm in 1..=3 {
            tensor(&format!("{stem}.norm{norm}.weight"), &[c], 1.0);
            tensor(&format!("{stem}.norm{norm}.bias"), &[c], 0.1);
        }
    }
    tensor("decoder.norm.weight", &[c], 1.0);
    tensor("decoder.norm.bias", &[c], 0.1);
    tensor("query_prj.0.weight", &[c, 21], 0.2);
    tensor("query_prj.0.bias", &[c], 0.2);
}
