//! The network's weights by name, how they start, and how a step changes them.

use crate::settings::{NetworkSettings, TrainSettings};
use crate::setup::Setup;
use crate::simulated::FEATURES;
use promenade_core::network::{DELAY_SHAPES, Tensor};
use promenade_core::random::Random;
use std::collections::BTreeMap;

/// The array of what the head adds to a sphere's delay, milliseconds.
pub(crate) const DELAY: &str = "delay_shape";

/// Arrays of numbers by the names that scenes store them under.
pub type Arrays = BTreeMap<String, Tensor>;

/// Octaves of the queries' encoding, and its highest factor, as published.
const QUERY_OCTAVES: usize = 10;
const QUERY_HIGHEST: f32 = 1024.0;

/// How large the weights of gains that correct a simulation are at the start.
const QUIET: f32 = 0.02;

/// Factors of a positional encoding, from 1 to `highest` in even ratios.
fn factors(octaves: usize, highest: f32) -> Vec<f32> {
    (0..octaves).map(|k| highest.powf(k as f32 / (octaves.max(2) - 1) as f32)).collect()
}

/// Draws starting weights.
pub(crate) struct Start {
    pub(crate) random: Random,
    pub(crate) arrays: Arrays,
}

impl Start {
    fn put(&mut self, name: &str, shape: &[usize], values: Vec<f32>) {
        self.arrays.insert(name.to_owned(), Tensor { shape: shape.to_vec(), values });
    }

    fn fill(&mut self, name: &str, shape: &[usize], value: f32) {
        self.put(name, shape, vec![value; shape.iter().product()]);
    }

    fn uniform(&mut self, name: &str, shape: &[usize], bound: f32) {
        let values = (0..shape.iter().product()).map(|_| bound * (2.0 * self.random.uniform() - 1.0)).collect();
        self.put(name, shape, values);
    }

    pub(crate) fn normal(&mut self, name: &str, shape: &[usize], deviation: f32) {
        let values = (0..shape.iter().product()).map(|_| deviation * self.random.normal()).collect();
        self.put(name, shape, values);
    }

    /// A layer with weights `[output][input]` and biases, up to one over the root of what an output sums over.
    pub(crate) fn linear(&mut self, stem: &str, outputs: usize, inputs: usize) {
        let bound = 1.0 / (inputs as f32).sqrt();
        self.uniform(&format!("{stem}.weight"), &[outputs, inputs], bound);
        self.uniform(&format!("{stem}.bias"), &[outputs], bound);
    }

    fn norm(&mut self, stem: &str, width: usize) {
        self.fill(&format!("{stem}.weight"), &[width], 1.0);
        self.fill(&format!("{stem}.bias"), &[width], 0.0);
    }

    /// Two linear layers with a PReLU between them.
    fn projection(&mut self, stem: &str, width: usize, inputs: usize) {
        self.linear(&format!("{stem}.0.proj"), width, inputs);
        self.fill(&format!("{stem}.1.weight"), &[1], 0.25);
        self.linear(&format!("{stem}.2.proj"), width, width);
    }
}

/// Starting weights of a network.
#[must_use]
pub(crate) fn start(settings: &TrainSettings, setup: &Setup) -> Arrays {
    let NetworkSettings { width, layers, feed_forward, octaves, .. } = settings.network;
    let anchors = setup.cloud.anchors.len();
    let features = setup.cloud.features.len() / anchors;
    let mut s = Start { random: Random::new(settings.seed), arrays: Arrays::new() };
    s.put("vec_embedder.freqs", &[octaves], factors(octaves, settings.network.highest));
    s.put("freq_embedder.freqs", &[QUERY_OCTAVES], factors(QUERY_OCTAVES, QUERY_HIGHEST));
    s.projection("pcd_av_proj", width, features);
    s.projection("vec_proj", width, 3 * (1 + 2 * octaves));
    s.linear("query_prj.0", width, 1 + 2 * QUERY_OCTAVES);
    for layer in 0..layers {
        let stem = format!("decoder.layers.{layer}");
        for attention in ["self_attn", "multihead_attn"] {
            // As Glorot and Bengio (2010), for the three projections as one.
            let bound = (6.0 / (4 * width) as f32).sqrt();
            s.uniform(&format!("{stem}.{attention}.in_proj_weight"), &[3 * width, width], bound);
            s.fill(&format!("{stem}.{attention}.in_proj_bias"), &[3 * width], 0.0);
            s.linear(&format!("{stem}.{attention}.out_proj"), width, width);
        }
        s.linear(&format!("{stem}.linear1"), feed_forward, width);
        s.linear(&format!("{stem}.linear2"), width, feed_forward);
        (1..=3).for_each(|norm| s.norm(&format!("{stem}.norm{norm}"), width));
    }
    s.norm("decoder.norm", width);
    s.normal("_audio_features_f", &[anchors, width, 1], 1.0);
    s.linear("mix_prj", 1, width);
    // What is corrected begins as it is.
    s.fill("mix_prj.bias", &[1], if settings.network.simulated { 1.0 } else { 0.6 });
    if settings.network.simulated {
        s.linear("sim_prj", width, FEATURES);
    }
    s.linear("diff_prj", 1, width);
    s.fill("diff_prj.bias", &[1], 0.0);
    if settings.network.simulated {
        for name in ["mix_prj.weight", "diff_prj.weight"] {
            s.arrays.entry(name.to_owned()).and_modify(|t| t.values.iter_mut().for_each(|w| *w *= QUIET));
        }
    }
    if !setup.emitters.is_empty() && !settings.network.simulated {
        s.fill(DELAY, &[DELAY_SHAPES], 0.0);
    }
    s.room(settings, setup);
    s.arrays
}

impl Start {
    /// The render head's own weights.
    fn room(&mut self, settings: &TrainSettings, setup: &Setup) {
        let NetworkSettings { width, taps, tap_shapes, .. } = settings.network;
        if taps == 0 {
            return;
        }
        self.linear("tap_prj", 2 * tap_shapes, width);
        let counts = [tap_shapes, taps + 1, setup.bands.count()];
        if settings.network.simulated {
            self.arrays.entry("tap_prj.weight".to_owned()).and_modify(|t| t.values.iter_mut().for_each(|w| *w *= QUIET));
            self.fill("tap_prj.bias", &[2 * tap_shapes], -(tap_shapes as f32).ln());
            self.fill("tap_shapes", &counts, 0.0);
            return;
        }
        self.fill("tap_prj.bias", &[2 * tap_shapes], 0.0);
        let shapes = tap_shapes_at(taps, tap_shapes, setup.bands.count(), setup.grid.hop_s());
        self.put("tap_shapes", &counts, shapes);
    }
}

/// Exponential decays of 0.15 s to 0.6 s, quiet beside the direct sound; stored as logarithms while training. The first tap is
/// that of the hop after the direct sound.
fn tap_shapes_at(taps: usize, shapes: usize, bands: usize, hop_s: f64) -> Vec<f32> {
    let mut out = Vec::with_capacity(shapes * (taps + 1) * bands);
    for shape in 0..shapes {
        let t60 = 0.15 * 4.0_f64.powf(if shapes > 1 { shape as f64 / (shapes - 1) as f64 } else { 0.5 });
        for hop in 0..=taps {
            let decayed = -3.0 * std::f64::consts::LN_10 * hop_s * hop as f64 / t60 - 2.5;
            out.extend(std::iter::repeat_n(decayed as f32, bands));
        }
    }
    out
}

/// Whether an array is given, not learnt.
#[must_use]
pub(crate) fn is_fixed(name: &str) -> bool {
    name.ends_with(".freqs")
}

/// AdamW (Loshchilov and Hutter 2019), with all of its state in arrays, so that a training that was stopped goes on as if it
/// had not been.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AdamW {
    /// Mean of the gradients, and of their squares, by name.
    pub moments: [Arrays; 2],
    /// Steps done.
    pub steps: usize,
}

impl AdamW {
    const BETAS: [f32; 2] = [0.9, 0.98];
    const EPS: f32 = 1e-8;

    /// Changes weights by one step; gradients that are not finite change nothing. Says the gradient's norm.
    pub fn step(
        &mut self,
        weights: &mut Arrays,
        gradients: &BTreeMap<String, Vec<f32>>,
        rate: f32,
        settings: &TrainSettings,
    ) -> f32 {
        let squares: f64 = gradients.values().flatten().map(|g| f64::from(*g) * f64::from(*g)).sum();
        let norm = squares.sqrt() as f32;
        if !norm.is_finite() {
            return norm;
        }
        self.steps += 1;
        let shrink = (settings.clip_norm / norm.max(1e-12)).min(1.0);
        let correction = Self::BETAS.map(|b| 1.0 - b.powi(self.steps as i32));
        for (name, gradient) in gradients {
            let Some(weight) = weights.get_mut(name) else { continue };
            let [first, second] = &mut self.moments;
            let blank = || Tensor { shape: weight.shape.clone(), values: vec![0.0; weight.values.len()] };
            let m = first.entry(name.clone()).or_insert_with(blank);
            let v = second.entry(name.clone()).or_insert_with(blank);
            // Norms, biases and the room's shapes are left to lie where they do.
            let decay = if weight.shape.len() == 2 { settings.decay } else { 0.0 };
            let moments = m.values.iter_mut().zip(&mut v.values);
            for ((w, g), (m, v)) in weight.values.iter_mut().zip(gradient).zip(moments) {
                let g = shrink * g;
                *m += (1.0 - Self::BETAS[0]) * (g - *m);
                *v += (1.0 - Self::BETAS[1]) * (g * g - *v);
                let direction = (*m / correction[0]) / ((*v / correction[1]).sqrt() + Self::EPS);
                *w -= rate * (direction + decay * *w);
            }
        }
        norm
    }
}
