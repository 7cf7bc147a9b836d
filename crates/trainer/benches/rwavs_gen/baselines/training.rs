//! How a baseline is trained, stops, goes on, and is heard.

use super::layers::Graph;
use super::spectrogram::{BINS, magnitudes, with_gains};
use super::{Baseline, Heard};
use burn::tensor::{Device, Tensor};
use promenade_baker::BakeError;
use promenade_baker::capture::{Capture, Clip, Split};
use promenade_core::random::Random;
use promenade_trainer::{AdamW, Arrays, Checkpoint, TrainSettings};
use std::path::Path;

/// Highest learning rate, as AV-NeRF has it.
const RATE: f32 = 5e-4;

/// How long a baseline is trained, and when its state is kept.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Course {
    pub(crate) steps: usize,
    pub(crate) seed: u64,
    /// Steps after which it is kept.
    pub(crate) keep_every: usize,
}

/// A clip as the loss needs it. A gain `g` of the magnitudes `S` is off the recorded ones `R` by the sum of `(g S - R)^2`,
/// which is `g^2 S^2 - 2 g S R + R^2`, and so by sums over time.
struct Example {
    heard: Heard,
    /// `S^2` by bin.
    squares: Vec<f32>,
    /// `S R` by bin, of the left ear, the right one and the mean of both.
    products: [Vec<f32>; 3],
    /// `R^2` of all three, all bins.
    recorded: f32,
    frames: usize,
}

impl Example {
    fn new(capture: &Capture, clip: &Clip) -> Option<Self> {
        let heard = heard(capture, clip)?;
        let dry = magnitudes(&capture.dry(clip, 0));
        let [left, right] = capture.binaural(clip).map(magnitudes);
        let mut example = Self {
            heard,
            squares: vec![0.0; BINS],
            products: [(); 3].map(|()| vec![0.0; BINS]),
            recorded: 0.0,
            frames: dry.len(),
        };
        for ((dry, left), right) in dry.iter().zip(&left).zip(&right) {
            for k in 0..BINS {
                example.squares[k] += dry[k] * dry[k];
                for (sums, recorded) in example.products.iter_mut().zip([left[k], right[k], 0.5 * (left[k] + right[k])]) {
                    sums[k] += dry[k] * recorded;
                    example.recorded += recorded * recorded;
                }
            }
        }
        Some(example)
    }
}

/// Who hears a clip; `None` of mixes and of emitters that are not known.
fn heard(capture: &Capture, clip: &Clip) -> Option<Heard> {
    Some(Heard { listener: clip.pose, emitter: capture.emitters[capture.emitter_of(clip)?].position })
}

/// A baseline with its weights.
pub(crate) struct Learner<'b> {
    baseline: &'b dyn Baseline,
    weights: Arrays,
    optimiser: AdamW,
    device: Device,
}

impl<'b> Learner<'b> {
    /// Trains on the training clips, from where it was kept in a file, if it was; `until` says after how many steps to stop
    /// before the end.
    ///
    /// # Errors
    /// A file of another training, and what reading and writing it meets.
    pub(crate) fn train(
        baseline: &'b dyn Baseline,
        capture: &Capture,
        course: &Course,
        kept: &Path,
        until: usize,
    ) -> Result<Self, BakeError> {
        let settings = TrainSettings { steps: course.steps, rate: RATE, seed: course.seed, ..TrainSettings::default() };
        let examples: Vec<Example> = capture.split(Split::Train).filter_map(|clip| Example::new(capture, clip)).collect();
        let id = examples.iter().map(|e| u64::from(e.recorded.to_bits())).fold(0_u64, |a, b| a.rotate_left(5) ^ b);
        let device = Device::flex().autodiff();
        let mut learner = Self { baseline, weights: baseline.start(course.seed), optimiser: AdamW::default(), device };
        if kept.exists() {
            let before = Checkpoint::load(kept)?;
            let same = (&before.settings, before.capture) == (&settings, id);
            let shape =
                |arrays: &Arrays| arrays.iter().map(|(name, array)| (name.clone(), array.shape.clone())).collect::<Vec<_>>();
            if !same || shape(&before.weights) != shape(&learner.weights) {
                return Err(BakeError::content(kept, format!("a training of {} on these clips", baseline.name()), "another"));
            }
            (learner.weights, learner.optimiser) = (before.weights, before.optimiser);
        }
        while learner.optimiser.steps < course.steps.min(until) {
            let batch = batch(&examples, &settings, learner.optimiser.steps);
            let rate = RATE * 0.1_f32.powf(learner.optimiser.steps as f32 / course.steps as f32);
            learner.step(&batch, rate, &settings);
            let steps = learner.optimiser.steps;
            if steps.is_multiple_of(course.keep_every) || steps == course.steps {
                learner.checkpoint(&settings, id).save(kept)?;
            }
        }
        Ok(learner)
    }

    fn checkpoint(&self, settings: &TrainSettings, id: u64) -> Checkpoint {
        Checkpoint {
            settings: settings.clone(),
            weights: self.weights.clone(),
            optimiser: self.optimiser.clone(),
            curve: Vec::new(),
            losses: Vec::new(),
            capture: id,
        }
    }

    fn step(&mut self, batch: &[&Example], rate: f32, settings: &TrainSettings) {
        let graph = Graph::new(&self.weights, &self.device);
        let loss = self.loss(&graph, batch);
        self.optimiser.step(&mut self.weights, &graph.gradients(&loss), rate, settings);
    }

    /// Mean squares of what the magnitudes of both ears and of their mean are off (AV-NeRF, section 4.4).
    fn loss(&self, graph: &Graph, batch: &[&Example]) -> Tensor<1> {
        let [left, right] = self.baseline.gains(graph, &batch.iter().map(|e| e.heard).collect::<Vec<_>>());
        let mean = (left.clone() + right.clone()) * 0.5;
        let squares = graph.matrix(batch.iter().flat_map(|e| e.squares.iter().copied()).collect(), BINS);
        let recorded: f32 = batch.iter().map(|e| e.recorded).sum();
        let off = [left, right, mean].into_iter().enumerate().map(|(i, gains)| {
            let products = graph.matrix(batch.iter().flat_map(|e| e.products[i].iter().copied()).collect(), BINS);
            (gains.clone() * gains.clone() * squares.clone() - gains * products * 2.0).sum()
        });
        let count: usize = batch.iter().map(|e| e.frames * BINS).sum();
        off.reduce(|a, b| a + b).map_or_else(|| Tensor::zeros([1], &self.device), |off| (off + recorded) / count as f32)
    }

    /// Both ears of a clip, with the dry sound's phase; `None` of mixes and of emitters that are not known.
    pub(crate) fn ears(&self, capture: &Capture, clip: &Clip) -> Option<[Vec<f32>; 2]> {
        let graph = Graph::new(&self.weights, &self.device);
        let dry = capture.dry(clip, 0);
        let gains = self.baseline.gains(&graph, &[heard(capture, clip)?]);
        let ear = |gains: Tensor<2>| with_gains(&dry, &gains.into_data().try_into_vec::<f32>().unwrap_or_default());
        Some(gains.map(ear))
    }
}

#[allow(dead_code, reason = "tests look at it, the benchmark does not")]
impl Learner<'_> {
    /// The mean loss over the clips of a split.
    pub(crate) fn mean_loss(&self, capture: &Capture, split: Split) -> f64 {
        let examples: Vec<Example> = capture.split(split).filter_map(|clip| Example::new(capture, clip)).collect();
        let graph = Graph::new(&self.weights, &self.device);
        let loss = self.loss(&graph, &examples.iter().collect::<Vec<_>>());
        loss.into_data().try_into_vec::<f32>().map_or(f64::NAN, |loss| f64::from(loss[0]))
    }

    /// Steps done.
    pub(crate) fn steps(&self) -> usize {
        self.optimiser.steps
    }

    pub(crate) fn weights(&self) -> &Arrays {
        &self.weights
    }
}

/// The clips of a step: all in an order that the seed and the epoch give, then all in another.
fn batch<'e>(examples: &'e [Example], settings: &TrainSettings, step: usize) -> Vec<&'e Example> {
    let size = settings.batch.min(examples.len()).max(1);
    let per_epoch = (examples.len() / size).max(1);
    let epoch = Random::stream(settings.seed, (step / per_epoch) as u64).order(examples.len());
    epoch.iter().skip(step % per_epoch * size).take(size).map(|i| &examples[*i]).collect()
}
