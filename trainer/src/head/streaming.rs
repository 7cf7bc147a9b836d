//! The streaming head of a batch of clips: renders, compares, and gives the derivatives back to the network.

use crate::head::{Example, LossGradient, Prediction, for_each_clip};
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
    emitter: Option<CloudEmitter>,
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
        emitter: Option<CloudEmitter>,
        threads: usize,
    ) -> Self {
        let shapes = if network.taps > 0 { network.tap_shapes } else { 0 };
        let worker = || Worker { head: ClipRender::new(grid, bands, tail, network.taps), loss: SpectralLoss::new(loss) };
        let workers: Vec<_> = (0..threads.max(1)).map(|_| worker()).collect();
        Self {
            taps: Readout::new(queries, grid, bands, network.taps, shapes),
            blank: workers[0].head.shape().silent(),
            emitter,
            response: ResponseLoss::new(loss, grid, bands, tail),
            workers,
        }
    }
}

impl StreamingHead {
    /// The transfer function of a pose.
    pub(crate) fn transfer(&self, pose: &Pose, prediction: &Prediction, weights: &Arrays) -> TransferFunction {
        transfer(&self.taps, shaped(self.emitter, weights), &self.blank, pose, &query_values(prediction), &shapes(weights))
    }

    /// Renders clips as the engine will, in order.
    pub(crate) fn render(
        &mut self,
        examples: &[Example<'_>],
        predictions: &[Prediction],
        weights: &Arrays,
    ) -> Vec<[Vec<f32>; 2]> {
        let shapes = shapes(weights);
        let (taps, emitter, blank) = (&self.taps, shaped(self.emitter, weights), &self.blank);
        for_each_clip(&mut self.workers, examples, predictions, |worker, example, prediction| {
            let transfer = transfer(taps, emitter, blank, &example.pose, &query_values(prediction), &shapes);
            let input = worker.head.analyse(&example.dry, example.pre_roll);
            worker.head.render(&input, &transfer)
        })
    }

    /// Renders clips, and gives the derivatives of their mean loss.
    pub(crate) fn loss(&mut self, examples: &[Example<'_>], predictions: &[Prediction], weights: &Arrays) -> LossGradient {
        let shapes = shapes(weights);
        let (taps, emitter, blank, response) = (&self.taps, shaped(self.emitter, weights), &self.blank, &self.response);
        let share = 1.0 / examples.len().max(1) as f32;
        let parts = for_each_clip(&mut self.workers, examples, predictions, |worker, example, prediction| {
            let values = query_values(prediction);
            let transfer = transfer(taps, emitter, blank, &example.pose, &values, &shapes);
            let input = worker.head.analyse(&example.dry, example.pre_roll);
            let [left, right] = worker.head.render(&input, &transfer);
            let mut by_samples = [Vec::new(), Vec::new()];
            let mut loss = worker.loss.of([&left, &right], example.binaural, share, &mut by_samples);
            let mut by = blank.clone();
            worker.head.adjoint(&input, &transfer, by_samples.each_ref().map(Vec::as_slice), &mut by);
            if let Some(wanted) = &example.response {
                loss += response.of(wanted, &transfer, share, &mut by);
            }
            let (mut by_values, mut by_shapes) = (taps.values(), vec![0.0; shapes.len()]);
            let gain = emitter.map_or(1.0, |e| e.gain(&example.pose));
            taps.adjoint(&values, &shapes, gain, &by, &mut by_values, &mut by_shapes);
            let by_delay = emitter.map(|e| e.delay_shapes(&example.pose).map(|shape| 1e-3 * by.delay_s * shape));
            (loss, by_values, by_shapes, by_delay)
        });
        let mut out = LossGradient::default();
        let mut by_logs = vec![0.0; shapes.len()];
        let mut by_head = self.emitter.map(|_| vec![0.0; DELAY_SHAPES]);
        for (loss, by_values, by_shapes, by_delay) in parts {
            out.loss += loss;
            let QueryValues { mixture, difference, coefficients } = by_values;
            out.predictions.push(Prediction { mixture, difference, room: coefficients });
            by_head.iter_mut().flatten().zip(by_delay.iter().flatten()).for_each(|(sum, by)| *sum += by);
            // By a logarithm: the derivative by the value, times the value.
            by_logs.iter_mut().zip(by_shapes.iter().zip(&shapes)).for_each(|(g, (b, s))| *g += b * s);
        }
        if !by_logs.is_empty() {
            out.weights.insert(SHAPES.to_owned(), by_logs);
        }
        out.weights.extend(by_head.map(|by| (DELAY.to_owned(), by)));
        out
    }
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

fn transfer(
    taps: &Readout,
    emitter: Option<CloudEmitter>,
    blank: &TransferFunction,
    pose: &Pose,
    values: &QueryValues,
    shapes: &[f32],
) -> TransferFunction {
    let mut transfer = blank.clone();
    taps.transfer(values, shapes, emitter.map_or(1.0, |e| e.gain(pose)), &mut transfer);
    transfer.delay_s = emitter.map_or(0.0, |e| e.delay_s(pose));
    transfer
}
