//! Published AV-Cloud checkpoints: what training left behind becomes a model that can be rendered.
//!
//! [`import`] reads the `.safetensors` with weights, settings and anchors that `presets/recipes/export_avcloud.py` writes. The
//! exporter runs beside the training code: a `.pth` and the pickle of its points are programs to whoever opens them.

mod anchors;
mod float;
mod settings;
mod weights;

use crate::BakeError;
use anchors::Anchors;
use promenade_core::network::{CloudKind, CloudModel, CloudParts, Placement, Tensor};
use promenade_core::{Bands, StftGrid};
use settings::Settings;
use std::collections::BTreeMap;
use std::path::Path;
use weights::Stored;

/// A checkpoint that became a model.
#[derive(Clone, Debug, PartialEq)]
pub struct Imported {
    /// Weights and anchors.
    pub model: CloudModel,
    /// The transform that the model's masks belong to.
    pub grid: StftGrid,
    /// Notes to the user: a placement that was assumed, weights that do nothing, features that look wrong.
    pub notes: Vec<String>,
}

/// Imports what the exporter has written: weights, settings and anchors, the positions `(N, 3)` and the features `(N, 150)`,
/// harmonics of the colours `(c - 0.5) / 0.2821`. `anchors` is a `.safetensors` with others. `placement` says where the cloud
/// lies in the scene; without it a unit of the cloud is a metre.
///
/// # Errors
/// Files that are damaged, too large or of another kind, settings out of range; weights and anchors that do not fit to each
/// other or to the transform. The message names the file, what was expected and what was found.
pub fn import(checkpoint: &Path, anchors: Option<&Path>, placement: Option<Placement>) -> Result<Imported, BakeError> {
    let Stored { mut weights, metadata, converted, .. } = Stored::read(checkpoint)?;
    let Settings { kind, max_norm, grid, heads, convention } = Settings::of(checkpoint, &metadata)?;
    let mut notes = Vec::new();
    if placement.is_none() {
        notes.push(
            "no placement is given: one unit of the cloud is taken as a metre, its axes as the scene's (z up)".to_owned(),
        );
    }
    let inside = Anchors::take(checkpoint, &mut weights)?;
    let anchors_at = anchors.unwrap_or(checkpoint);
    let anchors = match (anchors, inside) {
        (None, Some(inside)) => inside,
        (Some(path), inside) => {
            if inside.is_some() {
                notes.push("the anchors are those of the file given, not those beside the weights".to_owned());
            }
            Anchors::read(path)?.0
        }
        (None, None) => {
            let expected = "the scene's anchors beside the weights, or in a file of their own";
            return Err(BakeError::content(checkpoint, expected, "neither"));
        }
    };
    if converted > 0 {
        notes.push(format!("{converted} arrays were not of 32-bit floats and were converted"));
    }
    notes.extend(anchors.doubt());
    check_anchors(checkpoint, anchors_at, &weights, &anchors)?;
    check_bins(checkpoint, &weights, &grid)?;
    if kind == CloudKind::Full {
        notes.extend(drop_dead_network(&mut weights));
    }
    let centres_hz = (0..grid.bins()).map(|k| grid.bin_hz(k) as f32).collect();
    let frequencies = Bands::new(centres_hz)
        .ok_or_else(|| BakeError::content(checkpoint, "a transform with two bins or more", format!("{grid:?}")))?;
    let parts = CloudParts {
        kind,
        heads,
        max_norm,
        convention,
        placement: placement.unwrap_or(Placement::IDENTITY),
        frequencies,
        anchors: anchors.positions,
        features: anchors.features,
        weights,
    };
    let model = CloudModel::new(parts).map_err(BakeError::at(checkpoint, "no anchor-cloud model"))?;
    Ok(Imported { model, grid, notes })
}

/// Anchors alone, and the metadata of a safetensors file.
pub(crate) fn read_anchors(path: &Path) -> Result<(Anchors, BTreeMap<String, String>), BakeError> {
    Anchors::read(path)
}

/// Whether the anchors, which lie in the file `at`, are as many and have as many features as the weights of `checkpoint` ask
/// for.
fn check_anchors(checkpoint: &Path, at: &Path, weights: &BTreeMap<String, Tensor>, anchors: &Anchors) -> Result<(), BakeError> {
    let count = anchors.positions.len();
    let features = anchors.features.len().checked_div(count).unwrap_or(0);
    let asked =
        [("anchors", "_audio_features_f", 0, count), ("features of an anchor", "pcd_av_proj.0.proj.weight", 1, features)];
    for (what, name, axis, found) in asked {
        if let Some(wanted) = weights.get(name).and_then(|t| t.shape.get(axis)).filter(|wanted| **wanted != found) {
            let expected = format!("{wanted}, as weights '{name}' of {} have", checkpoint.display());
            return Err(BakeError::entry(at, what, expected, format!("{found}: the anchors of another scene?")));
        }
    }
    Ok(())
}

/// Weights that have a row for each bin tell the transform's length.
fn check_bins(path: &Path, weights: &BTreeMap<String, Tensor>, grid: &StftGrid) -> Result<(), BakeError> {
    for (name, axis) in [("freq_weights", 0), ("time_weights", 0), ("time_freq_weights", 1)] {
        if let Some(bins) = weights.get(name).and_then(|t| t.shape.get(axis)).filter(|b| **b != grid.bins()) {
            let expected = format!("{} frequencies, as a transform of {} samples has", grid.bins(), grid.n_fft);
            let found = format!("{bins}, as one of {} has", 2 * bins.saturating_sub(1));
            return Err(BakeError::entry(path, format!("weights '{name}'"), expected, found));
        }
    }
    Ok(())
}

/// Replaces the network that makes time-filter kernels by the one kernel that it makes, where its first layer is zero.
///
/// Published training starts that layer at zero before a rectifier, whose gradient is zero there, so it stays: the kernel is
/// the last layer's bias whatever the pose and frequency.
fn drop_dead_network(weights: &mut BTreeMap<String, Tensor>) -> Option<String> {
    const NETWORK: [&str; 4] = ["0.weight", "0.bias", "2.weight", "2.bias"];
    let [first, first_bias, second, kernel] = NETWORK.map(|n| weights.get(&format!("post_process.weight_model.{n}")));
    let (first, first_bias, second, kernel) = (first?, first_bias?, second?, kernel?);
    let frames = *weights.get("post_process.bias_model.2.bias")?.shape.first()?;
    let dead = first.values.iter().chain(&first_bias.values).all(|v| *v == 0.0);
    // Of another size it is left for the model's own check to refuse.
    if !dead || frames.checked_mul(frames).and_then(|n| n.checked_mul(3)) != Some(kernel.values.len()) {
        return None;
    }
    let inert = first.values.len() + first_bias.values.len() + second.values.len();
    let learned = weights.iter().filter(|(k, _)| !k.ends_with(".freqs"));
    let learned: usize = learned.map(|(_, t)| t.values.len()).sum();
    let kernel = Tensor { shape: vec![3 * frames, frames], values: kernel.values.clone() };
    for n in NETWORK {
        weights.remove(&format!("post_process.weight_model.{n}"));
    }
    weights.insert("post_process.kernel".to_owned(), kernel);
    Some(format!(
        "the network that should make the time filter's kernels has a first layer of zeros, as published training leaves it: \
         {inert} of {learned} weights ({:.0} %) do nothing; its one kernel is kept",
        100.0 * inert as f64 / learned as f64
    ))
}
