//! Refinement of simulated responses by measured ones (pi-AVAS, section 3.2), offline, over levels by hop and band. What is
//! refined keeps its waveform: its levels are changed, and images and carriers stay what they were. A regression is beside the
//! paper's flow, which is no better in decay, clarity and level between the ears together.

mod gated;
mod levels;
mod score;

pub use score::{Score, score};

use crate::network::Graph;
use crate::settings::TrainSettings;
use crate::weights::{AdamW, Arrays};
use burn::tensor::{Device, Tensor, TensorData};
use gated::{Gated, Sizes};
use levels::LevelGrid;
use promenade_baker::BakeError;
use promenade_core::random::Random;
use std::collections::BTreeMap;

/// What a refinement is trained with.
#[derive(Clone, Debug, PartialEq)]
pub struct RefineSettings {
    /// The flow of pi-AVAS (equations 3 to 6) instead of a regression on the difference of levels: a path with constant noise,
    /// whose velocity is predicted.
    pub flow: bool,
    /// Steps.
    pub steps: usize,
    /// Responses of a step.
    pub batch: usize,
    /// Highest learning rate.
    pub rate: f32,
    /// Channels of the network.
    pub width: usize,
    /// Seed of weights, order and a flow's noise.
    pub seed: u64,
}

impl Default for RefineSettings {
    fn default() -> Self {
        Self { flow: false, steps: 350, batch: 16, rate: 2e-3, width: 64, seed: 1 }
    }
}

/// A simulated response: one channel per ear or microphone, all of one length, and what the network is told of its places.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulatedResponse {
    /// Sound pressure, `[channel][sample]`.
    pub channels: Vec<Vec<f32>>,
    /// Coordinates of source and listener, metres, and whatever else tells responses apart: as many numbers in all responses.
    pub places: Vec<f32>,
}

/// A simulated response and the measured one of the same places.
#[derive(Clone, Debug, PartialEq)]
pub struct Pair {
    /// What is refined.
    pub simulated: SimulatedResponse,
    /// What it should be, `[channel][sample]`.
    pub measured: Vec<Vec<f32>>,
    /// Variance of what a hop of it has in a band, mean per bin, `[channel][band]` of [`promenade_core::Bands::for_rate`];
    /// empty where nothing is known of it.
    pub noise: Vec<f32>,
}

/// A refinement that was trained.
pub struct Refiner {
    /// Whether it is a flow, and the seed of what is drawn of it.
    flow: Option<u64>,
    grid: LevelGrid,
    network: Gated,
    weights: Arrays,
    device: Device,
    /// Mean and deviation of each number of the places.
    places: Vec<(f32, f32)>,
    /// Gain that gives simulated responses the level of measured ones, dB.
    level_db: f32,
}

/// One pair as numbers.
struct Example {
    simulated: Vec<f32>,
    measured: Vec<f32>,
    /// How sure the measured response's level is: 1 without noise, 0 where it has sunk into it.
    counts: Vec<f32>,
    places: Vec<f32>,
}

impl Refiner {
    /// Trains on pairs; `each` is told the step and its loss.
    ///
    /// # Errors
    /// Fewer than two pairs, or pairs whose channels or places differ in number.
    pub fn train(
        pairs: &[Pair],
        sample_rate_hz: f64,
        settings: &RefineSettings,
        device: Device,
        each: &mut dyn FnMut(usize, f64),
    ) -> Result<Self, BakeError> {
        let shape = |pair: &Pair| (pair.simulated.channels.len(), pair.measured.len(), pair.simulated.places.len());
        let Some(first) = pairs.first().map(shape).filter(|_| pairs.len() > 1) else {
            let found = pairs.len().to_string();
            return Err(BakeError::argument("pairs of responses", "at least 2", found));
        };
        if let Some(other) = pairs.iter().map(shape).find(|other| *other != first || first.0 != first.1 || first.0 == 0) {
            let expected = format!("{first:?} channels simulated and measured, and places, in all");
            return Err(BakeError::argument("pairs of responses", expected, format!("{other:?}")));
        }
        let grid = LevelGrid::new(sample_rate_hz, first.0);
        let level_db = grid.level_db(pairs);
        let places = spread(pairs);
        let examples: Vec<Example> = pairs.iter().map(|pair| grid.example(pair, level_db, &places)).collect();
        let sizes = Sizes { features: grid.features(), places: places.len(), width: settings.width };
        let network = Gated::new(sizes);
        let mut refiner = Self {
            weights: network.start(settings.seed),
            flow: settings.flow.then_some(settings.seed),
            grid,
            network,
            device: device.autodiff(),
            places,
            level_db,
        };
        let mut optimiser = AdamW::default();
        let mut random = Random::new(settings.seed.wrapping_mul(0x9E37_79B9_7F4A_7C15));
        let course = TrainSettings { steps: settings.steps, rate: settings.rate, ..TrainSettings::default() };
        for step in 0..settings.steps {
            let batch: Vec<&Example> = (0..settings.batch)
                .map(|_| &examples[(random.uniform() * examples.len() as f32) as usize % examples.len()])
                .collect();
            let (loss, gradients) = refiner.loss(&batch, &mut random);
            optimiser.step(&mut refiner.weights, &gradients, course.rate_at(step), &course);
            each(step + 1, loss);
        }
        Ok(refiner)
    }

    /// Mean square of what the network is off, and its derivatives.
    fn loss(&self, batch: &[&Example], random: &mut Random) -> (f64, BTreeMap<String, Vec<f32>>) {
        let (mut at, mut wanted, mut counts) = (Vec::new(), Vec::new(), Vec::new());
        let (mut simulated, mut places, mut times) = (Vec::new(), Vec::new(), Vec::new());
        for example in batch {
            let t = if self.flow.is_some() { random.uniform() } else { 0.0 };
            let difference = || example.simulated.iter().zip(&example.measured).map(|(from, to)| to - from);
            at.extend(self.on_the_way(example.simulated.iter().zip(difference()).map(|(from, by)| from + t * by), random));
            wanted.extend(difference());
            counts.extend(&example.counts);
            simulated.extend(&example.simulated);
            places.extend(&example.places);
            times.push(t);
        }
        let graph = Graph::new(&self.weights, &self.device);
        let found = self.network.forward(&graph, [&at, &simulated], &places, &times, &self.device);
        let tensor = |values: Vec<f32>| Tensor::<2>::from_data(TensorData::new(values, found.dims()), &self.device);
        let share = 1.0 / counts.iter().sum::<f32>().max(1.0);
        let off = (found.clone() - tensor(wanted)) * tensor(counts);
        let loss = (off.clone() * off).sum() * share;
        let value = loss.clone().into_data().try_into_vec::<f32>().map_or(f64::NAN, |v| f64::from(v[0]));
        (value, graph.gradients(&loss.backward()))
    }

    /// A simulated response with refined levels, `[channel][sample]`.
    ///
    /// # Errors
    /// Levels that cannot be read from the device.
    pub fn refined(&self, simulated: &SimulatedResponse) -> Result<Vec<Vec<f32>>, BakeError> {
        let own = self.own(simulated);
        Ok(self.with_levels(simulated, [&own, &self.levels(simulated, &own)?]))
    }

    /// A simulated response with other levels than its own, both in the network's terms.
    fn with_levels(&self, simulated: &SimulatedResponse, levels: [&[f32]; 2]) -> Vec<Vec<f32>> {
        self.grid.reshaped(&simulated.channels, self.level_db, levels)
    }

    /// A simulated response brought to the level of what is measured.
    pub(crate) fn unrefined(&self, simulated: &SimulatedResponse) -> Vec<Vec<f32>> {
        let gain = 10.0_f32.powf(self.level_db / 20.0);
        simulated.channels.iter().map(|x| x.iter().map(|v| gain * v).collect()).collect()
    }

    /// Levels of a response, and whether each is above the response's noise.
    #[must_use]
    pub fn levels_of(&self, channels: &[Vec<f32>]) -> (Vec<f32>, Vec<bool>) {
        self.grid.told(channels)
    }

    /// Levels of the simulation, brought to the level of what is measured, in the network's terms.
    fn own(&self, simulated: &SimulatedResponse) -> Vec<f32> {
        self.grid.levels(&simulated.channels, self.level_db)
    }

    /// Levels on the way of a flow, with its noise; of a regression as they are.
    fn on_the_way(&self, levels: impl Iterator<Item = f32>, random: &mut Random) -> Vec<f32> {
        levels.map(|x| if self.flow.is_some() { x + SIGMA * random.normal() } else { x }).collect()
    }

    /// Levels of the simulation as they are refined, from its own, in the network's terms: of a flow by Euler's method.
    fn levels(&self, simulated: &SimulatedResponse, own: &[f32]) -> Result<Vec<f32>, BakeError> {
        let places = scaled(&simulated.places, &self.places);
        let graph = Graph::new(&self.weights, &self.device);
        let mut x = self.on_the_way(own.iter().copied(), &mut Random::new(self.flow.unwrap_or(0) ^ 0x0F10_77ED));
        let steps = if self.flow.is_some() { FLOW_STEPS } else { 1 };
        for step in 0..steps {
            let t = step as f32 / steps as f32;
            let found = self.network.forward(&graph, [&x, own], &places, &[t], &self.device).into_data().try_into_vec::<f32>();
            let found = found.map_err(|e| {
                BakeError::argument("levels of a refinement", "numbers in single precision from the device", format!("{e:?}"))
            })?;
            x.iter_mut().zip(found).for_each(|(x, velocity)| *x += velocity / steps as f32);
        }
        Ok(x)
    }
}

/// Standard deviation of a flow's noise, in 20 dB, and the steps that it is followed in.
const SIGMA: f32 = 0.1;
const FLOW_STEPS: usize = 4;

/// Mean and deviation of each number of the places, so that those that are all alike say nothing.
fn spread(pairs: &[Pair]) -> Vec<(f32, f32)> {
    let count = pairs.len() as f32;
    (0..pairs[0].simulated.places.len())
        .map(|i| {
            let mean = pairs.iter().map(|p| p.simulated.places[i]).sum::<f32>() / count;
            let square = pairs.iter().map(|p| (p.simulated.places[i] - mean).powi(2)).sum::<f32>() / count;
            (mean, square.sqrt())
        })
        .collect()
}

/// Places in deviations from their means.
fn scaled(places: &[f32], by: &[(f32, f32)]) -> Vec<f32> {
    places.iter().zip(by).map(|(x, (mean, deviation))| if *deviation > 1e-3 { (x - mean) / deviation } else { 0.0 }).collect()
}
