//! AV-Cloud's render head over a batch of clips: renders, compares, and gives the derivatives back to the network.

use crate::head::{Example, LossGradient, Prediction, for_each_clip};
use crate::settings::{LossSettings, TrainSettings};
use crate::spectral_loss::SpectralLoss;
use crate::weights::Arrays;
use promenade_core::StftGrid;
use promenade_core::gradient::{PublishedAdjoint, PublishedGradient};
use promenade_core::network::CONV_LAYERS;
use promenade_core::published::{ClipSource, ConvWeights, PublishedClip, PublishedError, PublishedInput};
use std::collections::BTreeMap;

/// What a thread works with.
struct Worker {
    clip: PublishedClip,
    adjoint: PublishedAdjoint,
    source: ClipSource,
    by: PublishedGradient,
    out: [Vec<f32>; 2],
    by_samples: [Vec<f32>; 2],
    /// The output of a time filter that is not there.
    nothing: Vec<f32>,
    loss: SpectralLoss,
}

/// AV-Cloud's render head in training: the engine's own clip by clip, with its adjoint.
pub(crate) struct PublishedHead {
    workers: Vec<Worker>,
    filtered: bool,
}

impl Worker {
    fn new(grid: StftGrid, frames: usize, loss: &LossSettings) -> Result<Self, PublishedError> {
        let clip = PublishedClip::new(grid, frames)?;
        let (adjoint, samples) = (PublishedAdjoint::new(&clip), vec![0.0; clip.out_samples()]);
        Ok(Self {
            source: clip.source(),
            by: adjoint.gradient(),
            out: [samples.clone(), samples.clone()],
            by_samples: [samples.clone(), samples],
            nothing: vec![0.0; frames * grid.bins()],
            loss: SpectralLoss::new(loss),
            clip,
            adjoint,
        })
    }

    /// Renders a clip into `out`.
    fn render(
        &mut self,
        example: &Example<'_>,
        prediction: &Prediction,
        conv: Option<&ConvWeights>,
    ) -> Result<(), PublishedError> {
        self.clip.analyse(clip(example), &mut self.source)?;
        let [left, right] = &mut self.out;
        self.clip.render(&self.source, input(prediction, conv, &self.nothing), [left, right])
    }

    /// Renders a clip, and leaves the derivatives of its loss, times `share`, in `by`.
    fn loss(
        &mut self,
        example: &Example<'_>,
        prediction: &Prediction,
        conv: Option<&ConvWeights>,
        share: f32,
    ) -> Result<f64, PublishedError> {
        self.render(example, prediction, conv)?;
        let [left, right] = &self.out;
        let wanted = example.binaural.map(|ear| &ear[..left.len()]);
        let loss = self.loss.of([left, right], wanted, share, &mut self.by_samples);
        self.by.clear();
        let by_samples = self.by_samples.each_ref().map(Vec::as_slice);
        let input = input(prediction, conv, &self.nothing);
        self.adjoint.add(&mut self.clip, &self.source, input, by_samples, &mut self.by)?;
        Ok(loss)
    }
}

/// The clip itself: this head has no memory of what was before, and hears one voice.
fn clip<'a>(example: &'a Example<'_>) -> &'a [f32] {
    &example.voices[0].dry[example.pre_roll..]
}

fn input<'a>(prediction: &'a Prediction, conv: Option<&'a ConvWeights>, nothing: &'a [f32]) -> PublishedInput<'a> {
    let mix = if prediction.room.is_empty() { nothing } else { &prediction.room };
    PublishedInput { mixture: &prediction.mixture, difference: &prediction.difference, mix, conv }
}

/// The convolution layers of weights by name, if there are some.
fn conv_weights(weights: &Arrays) -> Option<ConvWeights> {
    ConvWeights::by_name(|name| Some(&weights.get(name)?.values))
}

impl PublishedHead {
    /// One set of everything per thread.
    ///
    /// # Errors
    /// Clips that cannot be transformed.
    pub(crate) fn new(settings: &TrainSettings, grid: StftGrid, frames: usize, threads: usize) -> Result<Self, PublishedError> {
        let workers = (0..threads.max(1)).map(|_| Worker::new(grid, frames, &settings.loss)).collect::<Result<_, _>>()?;
        Ok(Self { workers, filtered: settings.network.taps > 0 })
    }

    /// Magnitudes of the clips' dry sound, `[clip][frame][bin]`.
    pub(crate) fn magnitudes(&mut self, examples: &[Example<'_>]) -> Vec<f32> {
        let worker = &mut self.workers[0];
        let mut out = Vec::new();
        for example in examples {
            fits(worker.clip.analyse(clip(example), &mut worker.source));
            out.extend(worker.source.magnitudes());
        }
        out
    }

    /// Renders clips, in order; they end with their last whole hop.
    pub(crate) fn render(
        &mut self,
        examples: &[Example<'_>],
        predictions: &[Prediction],
        weights: &Arrays,
    ) -> Vec<[Vec<f32>; 2]> {
        let conv = conv_weights(weights);
        for_each_clip(&mut self.workers, examples, predictions, |worker, example, prediction| {
            fits(worker.render(example, &prediction[0], conv.as_ref()));
            worker.out.clone()
        })
    }

    /// Renders clips, and gives the derivatives of their mean loss.
    pub(crate) fn loss(&mut self, examples: &[Example<'_>], predictions: &[Prediction], weights: &Arrays) -> LossGradient {
        let conv = conv_weights(weights);
        let (filtered, share) = (self.filtered, 1.0 / examples.len().max(1) as f32);
        let parts = for_each_clip(&mut self.workers, examples, predictions, |worker, example, prediction| {
            let loss = fits(worker.loss(example, &prediction[0], conv.as_ref(), share));
            (loss, worker.by.clone())
        });
        let mut out = LossGradient::default();
        let mut by_layers: BTreeMap<String, Vec<f32>> = BTreeMap::new();
        for (loss, by) in parts {
            out.loss += loss;
            let room = if filtered { by.mix } else { Vec::new() };
            out.predictions.push(Prediction { mixture: by.mixture, difference: by.difference, room });
            for ((stem, _), layer) in CONV_LAYERS.into_iter().zip(by.conv.layers).filter(|_| conv.is_some()) {
                for (name, by) in [("weight", layer.weight), ("bias", layer.bias)] {
                    let sum = by_layers.entry(format!("{stem}.{name}")).or_insert_with(|| vec![0.0; by.len()]);
                    sum.iter_mut().zip(by).for_each(|(s, b)| *s += b);
                }
            }
        }
        out.weights = by_layers;
        out
    }
}

/// What has been given the sizes that it expects.
///
/// # Panics
/// If it has not: lengths of clips, masks and weights were fixed when the training began.
fn fits<T>(result: Result<T, PublishedError>) -> T {
    result.unwrap_or_else(|e| panic!("a render head of another size: {e}"))
}
