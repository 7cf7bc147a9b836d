//! Whether a model's weights are complete, known, finite and of shapes that fit together.

use super::{CloudError, CloudKind, CloudParts, CloudSizes, MAX_ANCHORS};
use crate::network::shapes::{CONV_LAYERS, FREQUENCY_TAPS, TAP_SHAPES, harmonic_degree};
use crate::simd::TILE;
use std::collections::BTreeMap;

/// The largest sizes that are taken, checked before anything is computed with them.
const MAX_WIDTH: usize = 1024;
const MAX_FRAMES: usize = 1024;
const MAX_LAYERS: usize = 16;

/// Collects what a kind of decoder asks of its weights.
struct Wanted<'a> {
    parts: &'a CloudParts,
    shapes: BTreeMap<String, Vec<usize>>,
    missing: Vec<String>,
}

impl Wanted<'_> {
    /// One size of a tensor that the others are measured by; notes the tensor as missing if it is.
    fn size(&mut self, name: &str, axis: usize) -> usize {
        match self.parts.weights.get(name) {
            Some(t) => t.shape.get(axis).copied().unwrap_or(0),
            None => {
                self.missing.push(name.to_owned());
                0
            }
        }
    }

    fn has(&self, name: &str) -> bool {
        self.parts.weights.contains_key(name)
    }

    fn want(&mut self, name: impl Into<String>, shape: &[usize]) {
        self.shapes.insert(name.into(), shape.to_vec());
    }

    /// Weight and bias of a linear layer, `[outputs][inputs]` with ones after them.
    fn linear(&mut self, stem: &str, shape: &[usize]) {
        self.want(format!("{stem}.weight"), shape);
        self.want(format!("{stem}.bias"), &shape[..1]);
    }
}

pub(super) fn check(parts: &CloudParts) -> Result<CloudSizes, CloudError> {
    let (n, bands) = (parts.anchors.len(), parts.frequencies.count());
    within("number of anchors", n, 1, MAX_ANCHORS)?;
    let mut w = Wanted { parts, shapes: BTreeMap::new(), missing: Vec::new() };
    let width = w.size("vec_proj.2.proj.weight", 0);
    let features = w.size("pcd_av_proj.0.proj.weight", 1);
    let octaves = w.size("vec_embedder.freqs", 0);
    let mut sizes = CloudSizes {
        anchors: n,
        features,
        width,
        bands,
        frames: 0,
        harmonics: 0,
        octaves,
        layers: 0,
        feed_forward: 0,
        hyper: 0,
        hyper_bias: 0,
        // The convolution layers belong to the published head.
        conv: parts.kind != CloudKind::Taps && w.has("out.0.weight"),
        tap_shapes: 0,
        tap_hops: 0,
        tap_bands: 0,
    };
    for (stem, inputs) in [("pcd_av_proj", features), ("vec_proj", 3 * (1 + 2 * octaves))] {
        w.linear(&format!("{stem}.0.proj"), &[width, inputs]);
        w.want(format!("{stem}.1.weight"), &[1]);
        w.linear(&format!("{stem}.2.proj"), &[width, width]);
    }
    w.want("vec_embedder.freqs", &[octaves]);
    w.want("_audio_features_f", &[n, width, 1]);
    w.linear("mix_prj", &[1, width]);
    w.linear("diff_prj", &[1, width]);
    match parts.kind {
        CloudKind::SimpleSh => w.want("freq_weights", &[bands, width]),
        CloudKind::Full | CloudKind::Sh | CloudKind::Taps => want_transformer(&mut w, &mut sizes),
    }
    want_filters(&mut w, &mut sizes);
    if sizes.conv {
        CONV_LAYERS.iter().for_each(|(stem, shape)| w.linear(stem, shape));
    }
    let shapes = named(w)?;
    within("width", width, TILE, MAX_WIDTH)?;
    within("frames", sizes.frames, 0, MAX_FRAMES)?;
    within("transformer layers", sizes.layers, 0, MAX_LAYERS)?;
    let harmonic = sizes.frames > 0 && matches!(parts.kind, CloudKind::Sh | CloudKind::SimpleSh);
    if harmonic && harmonic_degree(sizes.harmonics).is_none() {
        return Err(value("spherical harmonics", "1, 4, 9 or 16", sizes.harmonics));
    }
    check_shapes(shapes, parts)?;
    check_multiples(parts, &sizes)?;
    check_place(parts, features)?;
    Ok(sizes)
}

/// What turns masks into time filters, by the kind of network.
fn want_filters(w: &mut Wanted<'_>, sizes: &mut CloudSizes) {
    let (n, bands, width) = (sizes.anchors, sizes.bands, sizes.width);
    match w.parts.kind {
        CloudKind::Full => want_hyper_network(w, sizes),
        CloudKind::Sh | CloudKind::SimpleSh => {
            let filtered = ["time_weights", "time_freq_weights", "_acoustic_features_t"].iter().any(|k| w.has(k));
            if filtered {
                sizes.frames = w.size("time_weights", 1);
                sizes.harmonics = w.size("time_freq_weights", 2);
                w.want("time_weights", &[bands, sizes.frames]);
                w.want("time_freq_weights", &[n, bands, sizes.harmonics]);
                w.want("_acoustic_features_t", &[n, 2 * sizes.frames]);
            }
        }
        CloudKind::Taps => {
            if w.has(TAP_SHAPES) {
                [sizes.tap_shapes, sizes.tap_hops, sizes.tap_bands] = [0, 1, 2].map(|axis| w.size(TAP_SHAPES, axis));
                w.want(TAP_SHAPES, &[sizes.tap_shapes, sizes.tap_hops, sizes.tap_bands]);
                w.linear("tap_prj", &[2 * sizes.tap_shapes, width]);
            }
        }
    }
}

/// The shapes of all weights by name; none is missing, and none is unknown.
fn named(w: Wanted<'_>) -> Result<BTreeMap<String, Vec<usize>>, CloudError> {
    let Wanted { parts, shapes, mut missing } = w;
    let kind = parts.kind.name();
    missing.extend(shapes.keys().filter(|k| !parts.weights.contains_key(*k)).cloned());
    missing.sort();
    missing.dedup();
    if !missing.is_empty() {
        return Err(CloudError::Missing { kind, missing });
    }
    let unknown: Vec<_> = parts.weights.keys().filter(|k| !shapes.contains_key(*k)).cloned().collect();
    if !unknown.is_empty() {
        return Err(CloudError::Unknown { kind, unknown });
    }
    Ok(shapes)
}

fn check_shapes(shapes: BTreeMap<String, Vec<usize>>, parts: &CloudParts) -> Result<(), CloudError> {
    for (name, expected) in shapes {
        let found = &parts.weights[&name];
        let fits = found.shape == expected && found.values.len() == expected.iter().product::<usize>();
        if !fits {
            return Err(CloudError::Shape { name, expected, found: found.shape.clone() });
        }
        finite(&format!("weights '{name}'"), &found.values)?;
    }
    Ok(())
}

/// Widths that fill the vectors of the network's products.
fn check_multiples(parts: &CloudParts, sizes: &CloudSizes) -> Result<(), CloudError> {
    let width = sizes.width;
    if sizes.layers > 0 {
        let multiple = parts.heads * TILE;
        if parts.heads == 0 || !width.is_multiple_of(multiple) || !sizes.feed_forward.is_multiple_of(TILE) {
            let expected = format!("a width divisible by {multiple} for {} heads, a feed-forward width by {TILE}", parts.heads);
            return Err(value("width", expected, format!("{width} and {}", sizes.feed_forward)));
        }
    } else if !width.is_multiple_of(TILE) {
        return Err(value("width", format!("a multiple of {TILE}"), width));
    }
    Ok(())
}

fn check_place(parts: &CloudParts, features: usize) -> Result<(), CloudError> {
    let n = parts.anchors.len();
    if parts.features.len() != n * features {
        return Err(value("number of features", format!("{n} x {features}"), parts.features.len()));
    }
    finite("features", &parts.features)?;
    for a in &parts.anchors {
        finite("anchor position", &a.to_array())?;
    }
    if !(parts.max_norm.is_finite() && parts.max_norm > 0.0) {
        return Err(value("max_norm", "a finite number above 0", parts.max_norm));
    }
    if !parts.placement.is_valid() {
        let expected = "a scale above 0, a unit quaternion and a finite origin";
        return Err(value("placement", expected, format!("{:?}", parts.placement)));
    }
    Ok(())
}

fn want_transformer(w: &mut Wanted<'_>, sizes: &mut CloudSizes) {
    let c = sizes.width;
    sizes.layers = (0..).take_while(|l| w.has(&format!("decoder.layers.{l}.linear1.weight"))).count().max(1);
    sizes.feed_forward = w.size("decoder.layers.0.linear1.weight", 0);
    for l in 0..sizes.layers {
        let stem = format!("decoder.layers.{l}");
        for attention in ["self_attn", "multihead_attn"] {
            w.want(format!("{stem}.{attention}.in_proj_weight"), &[3 * c, c]);
            w.want(format!("{stem}.{attention}.in_proj_bias"), &[3 * c]);
            w.linear(&format!("{stem}.{attention}.out_proj"), &[c, c]);
        }
        w.linear(&format!("{stem}.linear1"), &[sizes.feed_forward, c]);
        w.linear(&format!("{stem}.linear2"), &[c, sizes.feed_forward]);
        for norm in 1..=3 {
            w.linear(&format!("{stem}.norm{norm}"), &[c]);
        }
    }
    w.linear("decoder.norm", &[c]);
    let query_octaves = w.size("freq_embedder.freqs", 0);
    w.want("freq_embedder.freqs", &[query_octaves]);
    w.linear("query_prj.0", &[c, 1 + 2 * query_octaves]);
}

fn want_hyper_network(w: &mut Wanted<'_>, sizes: &mut CloudSizes) {
    if !w.parts.weights.keys().any(|k| k.starts_with("post_process.")) {
        return;
    }
    let (c, t) = (sizes.width, w.size("post_process.bias_model.2.bias", 0));
    sizes.frames = t;
    sizes.hyper_bias = w.size("post_process.bias_model.0.bias", 0);
    w.linear("post_process.bias_model.0", &[sizes.hyper_bias, c, 1]);
    w.linear("post_process.bias_model.2", &[t, sizes.hyper_bias, 1]);
    if w.has("post_process.kernel") {
        w.want("post_process.kernel", &[FREQUENCY_TAPS * t, t]);
    } else {
        sizes.hyper = w.size("post_process.weight_model.0.bias", 0);
        w.linear("post_process.weight_model.0", &[sizes.hyper, c, 1]);
        w.linear("post_process.weight_model.2", &[FREQUENCY_TAPS * t * t, sizes.hyper, 1]);
    }
}

fn value(what: &str, expected: impl ToString, found: impl ToString) -> CloudError {
    CloudError::Value { what: what.to_owned(), expected: expected.to_string(), found: found.to_string() }
}

fn within(what: &str, found: usize, low: usize, high: usize) -> Result<(), CloudError> {
    if (low..=high).contains(&found) { Ok(()) } else { Err(value(what, format!("{low} to {high}"), found)) }
}

fn finite(what: &str, values: &[f32]) -> Result<(), CloudError> {
    match values.iter().find(|v| !(-1e9..=1e9).contains(*v)) {
        None => Ok(()),
        Some(found) => Err(value(what, "finite, at most 1e9 in magnitude", found)),
    }
}
