//! What a surface absorbs by its appearance: a small network, learnt where sound has met surfaces.
//!
//! One hidden layer, from features to a number by band, in several copies. Each copy is learnt without a part of the places and
//! judged there: how far it is off says how much a prediction is worth.

use crate::bands::{BANDS, PerBand};
use crate::numerics::{Adam, Random};
use rayon::prelude::*;

/// Copies, each without its part of the places.
const COPIES: usize = 5;
const HIDDEN: usize = 12;
const STEPS: usize = 400;
const RATE: f64 = 0.02;
/// Of weights, over the mean of squares of what is off.
const DECAY: f64 = 3e-3;
/// Least standard deviation of a prediction, of logits.
const LEAST: f64 = 0.15;
/// Examples at least.
pub(crate) const FEWEST: usize = 8;

/// What is learnt from.
pub(crate) struct Example<'a> {
    pub(crate) features: &'a [f64],
    pub(crate) value: PerBand,
    /// What each number counts; 0 of one that is not known.
    pub(crate) weight: PerBand,
    /// Examples of one part are left out together.
    pub(crate) part: u64,
}

/// One copy: weights of features and a constant to each hidden number, and of these and a constant to each band.
struct Network {
    weights: Vec<f64>,
    inputs: usize,
    adam: Adam,
}

/// All copies.
pub(crate) struct Regressor {
    networks: Vec<Network>,
    /// Mean and standard deviation of each feature.
    scale: Vec<(f64, f64)>,
    middle: PerBand,
    /// Parts of the places that were learnt from, in order: of each copy every fifth is left out.
    parts: Vec<u64>,
    /// How far predictions were off at places that were left out, of logits; infinite where none were.
    pub(crate) off: PerBand,
}

impl Network {
    fn hidden(&self, features: &[f64]) -> [f64; HIDDEN] {
        std::array::from_fn(|h| {
            let own = &self.weights[h * (self.inputs + 1)..][..=self.inputs];
            (own[self.inputs] + own.iter().zip(features).map(|(w, f)| w * f).sum::<f64>()).tanh()
        })
    }

    fn last(&self) -> usize {
        HIDDEN * (self.inputs + 1)
    }

    fn value(&self, hidden: &[f64; HIDDEN]) -> PerBand {
        std::array::from_fn(|b| {
            let own = &self.weights[self.last() + b * (HIDDEN + 1)..][..=HIDDEN];
            own[HIDDEN] + own.iter().zip(hidden).map(|(w, h)| w * h).sum::<f64>()
        })
    }

    fn step(&mut self, by: &[f64], rate: f64) {
        self.adam.step(&mut self.weights, by, &vec![rate; by.len()]);
    }

    /// Adds derivatives by all weights from those by its values.
    fn back(&self, features: &[f64], hidden: &[f64; HIDDEN], by_value: &PerBand, by: &mut [f64]) {
        let mut by_hidden = [0.0; HIDDEN];
        for (b, off) in by_value.iter().enumerate() {
            let own = self.last() + b * (HIDDEN + 1);
            by[own + HIDDEN] += off;
            for h in 0..HIDDEN {
                by[own + h] += off * hidden[h];
                by_hidden[h] += off * self.weights[own + h];
            }
        }
        for h in 0..HIDDEN {
            let grown = by_hidden[h] * (1.0 - hidden[h] * hidden[h]);
            let own = h * (self.inputs + 1);
            by[own + self.inputs] += grown;
            features.iter().zip(&mut by[own..]).for_each(|(f, slot)| *slot += grown * f);
        }
    }

    fn learn(inputs: usize, examples: &[(Vec<f64>, PerBand, PerBand)], seed: u64) -> Self {
        let mut random = Random::new(seed, 0x6775_6573);
        let count = HIDDEN * (inputs + 1) + BANDS * (HIDDEN + 1);
        let first = HIDDEN * (inputs + 1);
        let size = |i: usize| if i < first { 1.0 / (inputs as f64 + 1.0).sqrt() } else { 0.3 / (HIDDEN as f64).sqrt() };
        let mut network =
            Self { weights: (0..count).map(|i| size(i) * random.normal()).collect(), inputs, adam: Adam::new(count) };
        let all: f64 = examples.iter().flat_map(|e| e.2).sum::<f64>().max(1e-9);
        for step in 0..STEPS {
            let mut by: Vec<f64> = network.weights.iter().map(|w| DECAY * w).collect();
            for (features, value, weight) in examples {
                let hidden = network.hidden(features);
                let found = network.value(&hidden);
                let off = std::array::from_fn(|b| 2.0 * weight[b] * (found[b] - value[b]) * BANDS as f64 / all);
                network.back(features, &hidden, &off, &mut by);
            }
            let slow = 0.1_f64.powf(step as f64 / STEPS as f64);
            network.step(&by, RATE * slow);
        }
        network.adam = Adam::new(count);
        network
    }
}

impl Regressor {
    /// Learns from examples; none from fewer than [`FEWEST`], or if all are of one part.
    pub(crate) fn learn(examples: &[Example<'_>], seed: u64) -> Option<Self> {
        let inputs = examples.first()?.features.len();
        let mut parts: Vec<u64> = examples.iter().map(|e| e.part).collect();
        parts.sort_unstable();
        parts.dedup();
        if examples.len() < FEWEST || parts.len() < 2 {
            return None;
        }
        let copy_of = |part: u64| copy_without(&parts, part).unwrap_or(0);
        let count = examples.len() as f64;
        let scale: Vec<(f64, f64)> = (0..inputs)
            .map(|i| {
                let mean = examples.iter().map(|e| e.features[i]).sum::<f64>() / count;
                let square = examples.iter().map(|e| (e.features[i] - mean).powi(2)).sum::<f64>() / count;
                (mean, square.sqrt().max(1e-6))
            })
            .collect();
        let middle: PerBand = std::array::from_fn(|b| {
            let weight: f64 = examples.iter().map(|e| e.weight[b]).sum();
            examples.iter().map(|e| e.weight[b] * e.value[b]).sum::<f64>() / weight.max(1e-9)
        });
        let ready: Vec<(Vec<f64>, PerBand, PerBand)> = examples
            .iter()
            .map(|e| (scaled(&scale, e.features), std::array::from_fn(|b| e.value[b] - middle[b]), e.weight))
            .collect();
        let without = |copy: usize, inside: bool| -> Vec<(Vec<f64>, PerBand, PerBand)> {
            let of = ready.iter().zip(examples).filter(|(_, e)| (copy_of(e.part) == copy) == inside);
            of.map(|(ready, _)| ready.clone()).collect()
        };
        let copies: Vec<(Network, PerBand, PerBand)> = (0..COPIES.min(parts.len()))
            .into_par_iter()
            .map(|copy| {
                let network = Network::learn(inputs, &without(copy, false), seed.wrapping_add(copy as u64));
                let (mut off, mut weights) = ([0.0; BANDS], [0.0; BANDS]);
                for (features, value, weight) in without(copy, true) {
                    let found = network.value(&network.hidden(&features));
                    for b in 0..BANDS {
                        off[b] += weight[b] * (found[b] - value[b]).powi(2);
                        weights[b] += weight[b];
                    }
                }
                (network, off, weights)
            })
            .collect();
        let off = std::array::from_fn(|b| {
            let weights: f64 = copies.iter().map(|c| c.2[b]).sum();
            if weights > 0.0 { (copies.iter().map(|c| c.1[b]).sum::<f64>() / weights).sqrt().max(LEAST) } else { f64::INFINITY }
        });
        Some(Self { networks: copies.into_iter().map(|c| c.0).collect(), scale, middle, off, parts })
    }

    /// Moves all copies against derivatives of something by what they say of features; `weight` is that of what was known
    /// before, a deviation of 1 of each of their weights.
    pub(crate) fn step(&mut self, by_values: &[(&[f64], PerBand)], weight: f64, rate: f64) {
        let ready: Vec<(Vec<f64>, PerBand)> =
            by_values.iter().map(|(features, by)| (scaled(&self.scale, features), *by)).collect();
        let share = 1.0 / self.networks.len() as f64;
        self.networks.par_iter_mut().for_each(|network| {
            let mut by: Vec<f64> = network.weights.iter().map(|w| share * weight * w).collect();
            for (features, by_value) in &ready {
                let hidden = network.hidden(features);
                network.back(features, &hidden, &by_value.map(|v| share * v), &mut by);
            }
            network.step(&by, rate);
        });
    }

    /// What a copy says that has not learnt from a part of the places; of a part that none has learnt from, the mean over all.
    pub(crate) fn without(&self, features: &[f64], part: u64) -> PerBand {
        let Some(copy) = copy_without(&self.parts, part) else { return self.of(features).0 };
        let network = &self.networks[copy];
        let own = network.value(&network.hidden(&scaled(&self.scale, features)));
        std::array::from_fn(|b| self.middle[b] + own[b])
    }

    /// The mean over all copies, and the standard deviation of a prediction: what copies differ by, and how far they were off.
    pub(crate) fn of(&self, features: &[f64]) -> (PerBand, PerBand) {
        let own = scaled(&self.scale, features);
        let all: Vec<PerBand> = self.networks.iter().map(|n| n.value(&n.hidden(&own))).collect();
        let count = all.len() as f64;
        let mean: PerBand = std::array::from_fn(|b| all.iter().map(|v| v[b]).sum::<f64>() / count);
        let spread = |b: usize| all.iter().map(|v| (v[b] - mean[b]).powi(2)).sum::<f64>() / count;
        let sd = std::array::from_fn(|b| (self.off[b].powi(2) + spread(b)).sqrt());
        (std::array::from_fn(|b| self.middle[b] + mean[b]), sd)
    }
}

/// The copy that is learnt without a part.
fn copy_without(parts: &[u64], part: u64) -> Option<usize> {
    parts.binary_search(&part).ok().map(|i| i % COPIES)
}

/// Features beyond what was learnt from count as the ends of it.
fn scaled(scale: &[(f64, f64)], features: &[f64]) -> Vec<f64> {
    scale.iter().zip(features).map(|((mean, sd), f)| ((f - mean) / sd).clamp(-3.0, 3.0)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two appearances of known values, and a feature that says nothing.
    fn examples(random: &mut Random) -> Vec<(Vec<f64>, PerBand)> {
        (0..120)
            .map(|i| {
                let red = i % 2 == 0;
                let colour = if red { 0.8 } else { 0.2 } + 0.05 * random.normal();
                let value = std::array::from_fn(|b| if red { 1.0 } else { -2.0 + 0.1 * b as f64 } + 0.2 * random.normal());
                (vec![colour, random.normal()], value)
            })
            .collect()
    }

    #[test]
    fn appearance_tells_what_is_known_elsewhere_and_how_well() {
        let mut random = Random::new(3, 0);
        let known = examples(&mut random);
        let learn = |known: &[(Vec<f64>, PerBand)]| {
            let all: Vec<Example<'_>> = known
                .iter()
                .zip(0_u64..)
                .map(|((features, value), i)| Example { features, value: *value, weight: [1.0; BANDS], part: i / 6 })
                .collect();
            Regressor::learn(&all, 1)
        };
        let regressor = learn(&known).unwrap();
        let (red, sd) = regressor.of(&[0.8, 0.3]);
        let (blue, _) = regressor.of(&[0.2, -0.3]);
        assert!((red[4] - 1.0).abs() < 0.25 && (blue[4] + 1.6).abs() < 0.25, "{red:?} {blue:?}");
        assert!(sd.iter().all(|s| (0.15..0.5).contains(s)), "{sd:?}");
        let mut mixed = known.clone();
        for own in &mut mixed {
            own.0[0] = known[(120.0 * random.uniform()) as usize].0[0];
        }
        // Appearances that have nothing to do with it are worth nothing: half of the distance between the two.
        let worth = learn(&mixed).unwrap();
        assert!(worth.off[4] > 0.9, "{:?}", worth.off);
        assert!(learn(&known[..6]).is_none());
    }
}
