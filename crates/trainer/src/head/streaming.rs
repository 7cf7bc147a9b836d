//! The streaming head of a batch of clips: renders, compares, and gives the derivatives back to the network.

use crate::head::{Example, ExampleVoice, LossGradient, Prediction, for_each_clip};
use crate::response_loss::ResponseLoss;
use crate::settings::{LossSettings, NetworkSettings};
use crate::spectral_loss::SpectralLoss;
use crate::weights::{Arrays, DELAY};
use promenade_core::decode::{QueryValues, Readout};
use promenade_core::gradient::ClipRender;
use promenade_core::network::{CloudEmitter, DELAY_SHAPES};
use promenade_core::{Bands, Pose, StftGrid, TailModel, TransferFunction};

/// The array of tap shapes' logarithms.
const SHAPES: &str = "tap_shapes";

/// What a thread works with.
struct Worker {
    head: ClipRender,
    loss: SpectralLoss,
}

/// The render head of training, the engine's own.
pub(crate) struct StreamingHead {
    taps: Readout,
    blank: TransferFunction,
    response: ResponseLoss,
    workers: Vec<Worker>,
}

impl StreamingHead {
    /// One set of everything per thread.
    #[must_use]
    pub(crate) fn new(
        network: &NetworkSettings,
        loss: &LossSettings,
        queries: &Bands,
        (grid, bands, tail): (&StftGrid, &Bands, &TailModel),
        threads: usize,
    ) -> Self {
        let shapes = if network.taps > 0 { network.tap_shapes } else { 0 };
        let worker = || Worker { head: ClipRender::new(grid, bands, tail, network.taps), loss: SpectralLoss::new(loss) };
        let workers: Vec<_> = (0..threads.max(1)).map(|_| worker()).collect();
        Self {
            taps: Readout::new(queries, grid, bands, network.taps, shapes),
            blank: workers[0].head.shape().silent(),
            response: ResponseLoss::new(loss, grid, bands, tail),
            workers,
        }
    }
}

impl StreamingHead {
    /// The transfer function of a pose and one voice.
    pub(crate) fn transfer(
        &self,
        pose: &Pose,
        voice: &ExampleVoice,
        prediction: &Prediction,
        weights: &Arrays,
    ) -> TransferFunction {
        self.filters(pose, voice, &query_values(prediction), weights, &shapes(weights)).1
    }

    /// Renders clips as the engine will, in order.
    pub(crate) fn render(
        &mut self,
        examples: &[Example<'_>],
        predictions: &[Prediction],
        weights: &Arrays,
    ) -> Vec<[Vec<f32>; 2]> {
        let shapes = shapes(weights);
        let mut workers = std::mem::take(&mut self.workers);
        let head = &*self;
        let rendered = for_each_clip(&mut workers, examples, predictions, |worker, example, predictions| {
            let voices = example.voices.iter().zip(predictions);
            let heard = voices.map(|(voice, prediction)| {
                let (_, transfer) = head.filters(&example.pose, voice, &query_values(prediction), weights, &shapes);
                let input = worker.head.analyse(&voice.dry, example.pre_roll, example.pose.orientation);
                worker.head.render(&input, &transfer)
            });
            heard.reduce(together).unwrap_or_default()
        });
        self.workers = workers;
        rendered
    }

    /// Renders clips, and gives the derivatives of their mean loss.
    pub(crate) fn loss(&mut self, examples: &[Example<'_>], predictions: &[Prediction], weights: &Arrays) -> LossGradient {
        let shapes = shapes(weights);
        let share = 1.0 / examples.len().max(1) as f32;
        let mut workers = std::mem::take(&mut self.workers);
        let head = &*self;
        let parts = for_each_clip(&mut workers, examples, predictions, |worker, example, predictions| {
            let voices: Vec<_> = (example.voices.iter().zip(predictions))
                .map(|(voice, prediction)| {
                    let values = query_values(prediction);
                    let (learnt, transfer) = head.filters(&example.pose, voice, &values, weights, &shapes);
                    (
                        voice,
                        values,
                        learnt,
                        transfer,
                        worker.head.analyse(&voice.dry, example.pre_roll, example.pose.orientation),
                    )
                })
                .collect();
            let heard = voices.iter().map(|(.., transfer, input)| worker.head.render(input, transfer));
            let [left, right] = heard.reduce(together).unwrap_or_default();
            let mut by_samples = [Vec::new(), Vec::new()];
            let mut loss = worker.loss.of([&left, &right], example.binaural, share, &mut by_samples);
            let by_voices: Vec<_> = voices
                .iter()
                .map(|(voice, values, learnt, transfer, input)| {
                    let mut by = head.blank.clone();
                    worker.head.adjoint(input, transfer, by_samples.each_ref().map(Vec::as_slice), &mut by);
                    if let Some(wanted) = &example.response {
                        loss += head.response.of(wanted, transfer, share, &mut by);
                    }
                    head.adjoint(&example.pose, voice, (values, learnt, &shapes), by)
                })
                .collect();
            (loss, by_voices)
        });
        self.workers = workers;
        let mut out = LossGradient::default();
        let mut by_logs = vec![0.0; shapes.len()];
        let mut by_head = weights.contains_key(DELAY).then(|| vec![0.0; DELAY_SHAPES]);
        for (loss, by_voices) in parts {
            out.loss += loss;
            for ByVoice { values, shapes: by_shapes, delay } in by_voices {
                let QueryValues { mixture, difference, coefficients } = values;
                out.predictions.push(Prediction { mixture, difference, room: coefficients });
                by_head.iter_mut().flatten().zip(delay.iter().flatten()).for_each(|(sum, by)| *sum += by);
                // By a logarithm: the derivative by the value, times the value.
                by_logs.iter_mut().zip(by_shapes.iter().zip(&shapes)).for_each(|(g, (b, s))| *g += b * s);
            }
        }
        if !by_logs.is_empty() {
            out.weights.insert(SHAPES.to_owned(), by_logs);
        }
        out.weights.extend(by_head.map(|by| (DELAY.to_owned(), by)));
        out
    }

    /// What the network says by itself, and what is heard of it: the same, or the simulation that it corrects.
    fn filters(
        &self,
        pose: &Pose,
        voice: &ExampleVoice,
        values: &QueryValues,
        weights: &Arrays,
        shapes: &[f32],
    ) -> (TransferFunction, TransferFunction) {
        let mut learnt = self.blank.clone();
        if let Some(simulated) = &voice.simulated {
            self.taps.transfer(values, shapes, 1.0, &mut learnt);
            let corrected = simulated.corrected(&learnt);
            return (learnt, corrected);
        }
        let emitter = shaped(voice.emitter, weights);
        self.taps.transfer(values, shapes, emitter.map_or(1.0, |e| e.gain(pose)), &mut learnt);
        learnt.delay_s = emitter.map_or(0.0, |e| e.delay_s(pose));
        (learnt.clone(), learnt)
    }

    /// Derivatives by what the network predicts for a voice, from those by its transfer function.
    fn adjoint(
        &self,
        pose: &Pose,
        voice: &ExampleVoice,
        (values, learnt, shapes): (&QueryValues, &TransferFunction, &[f32]),
        mut by: TransferFunction,
    ) -> ByVoice {
        let mut out = ByVoice { values: self.taps.values(), shapes: vec![0.0; shapes.len()], delay: None };
        let gain = if let Some(simulated) = &voice.simulated {
            simulated.adjoint(learnt, &mut by);
            1.0
        } else {
            let emitter = voice.emitter;
            out.delay = emitter.map(|e| e.delay_shapes(pose).map(|shape| 1e-3 * by.delay_s * shape));
            emitter.map_or(1.0, |e| e.gain(pose))
        };
        self.taps.adjoint(values, shapes, gain, &by, &mut out.values, &mut out.shapes);
        out
    }
}

/// Derivatives of the loss by what one voice is rendered with.
struct ByVoice {
    values: QueryValues,
    shapes: Vec<f32>,
    /// By the factors of the head's delay, where the emitter is known.
    delay: Option<[f32; DELAY_SHAPES]>,
}

/// Two voices in both ears.
fn together(mut sum: [Vec<f32>; 2], more: [Vec<f32>; 2]) -> [Vec<f32>; 2] {
    sum.iter_mut().flatten().zip(more.iter().flatten()).for_each(|(sum, x)| *sum += x);
    sum
}

fn query_values(prediction: &Prediction) -> QueryValues {
    let Prediction { mixture, difference, room } = prediction.clone();
    QueryValues { mixture, difference, coefficients: room }
}

/// The tap shapes, whose logarithms are learnt.
fn shapes(weights: &Arrays) -> Vec<f32> {
    weights.get(SHAPES).map_or_else(Vec::new, |logs| exponentials(&logs.values))
}

/// The emitter with the head's delay as it is learnt.
pub(crate) fn shaped(emitter: Option<CloudEmitter>, weights: &Arrays) -> Option<CloudEmitter> {
    let shape = weights.get(DELAY).and_then(|factors| <[f32; DELAY_SHAPES]>::try_from(&factors.values[..]).ok());
    emitter.map(|e| CloudEmitter { delay_shape_ms: shape.unwrap_or_default(), ..e })
}

/// The tap shapes of their logarithms.
pub(crate) fn exponentials(logs: &[f32]) -> Vec<f32> {
    logs.iter().map(|l| l.exp()).collect()
}
