//! The streaming head of a batch of clips: renders, judges, and gives the derivatives back to the network.

use crate::settings::{LossSettings, NetworkSettings};
use crate::spectral_loss::SpectralLoss;
use promenade_core::cloud::{CloudEmitter, QueryValues, TapHead};
use promenade_core::{Bands, ClipHead, Pose, StftGrid, TailModel, TransferFunction};

/// A clip in training.
#[derive(Clone, Debug, PartialEq)]
pub struct Example<'a> {
    /// Dry sound, `pre_roll` samples before the clip and the clip.
    pub dry: Vec<f32>,
    /// Samples before the clip.
    pub pre_roll: usize,
    /// What the ears heard.
    pub binaural: [&'a [f32]; 2],
    /// The listener.
    pub pose: Pose,
}

/// Derivatives of a batch.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct BatchGradient {
    /// Mean loss of the clips.
    pub(crate) loss: f64,
    /// By the values of each clip's queries.
    pub(crate) values: Vec<QueryValues>,
    /// By the logarithms of the tap shapes.
    pub(crate) log_shapes: Vec<f32>,
}

/// What a thread works with.
struct Bench {
    head: ClipHead,
    loss: SpectralLoss,
}

/// The render head of training, the engine's own.
pub(crate) struct StreamingHead {
    taps: TapHead,
    blank: TransferFunction,
    emitter: Option<CloudEmitter>,
    benches: Vec<Bench>,
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
        let bench = || Bench { head: ClipHead::new(grid, bands, tail, network.taps), loss: SpectralLoss::new(loss) };
        let benches: Vec<_> = (0..threads.max(1)).map(|_| bench()).collect();
        Self {
            taps: TapHead::new(queries, grid, bands, network.taps, shapes),
            blank: benches[0].head.shape().silent(),
            emitter,
            benches,
        }
    }
}

impl StreamingHead {
    /// The transfer function of a pose's values.
    pub(crate) fn transfer(&self, pose: &Pose, values: &QueryValues, log_shapes: &[f32]) -> TransferFunction {
        transfer(&self.taps, self.emitter, &self.blank, pose, values, &exponentials(log_shapes))
    }

    /// Renders clips as the engine will, in order.
    #[must_use]
    pub(crate) fn render(
        &mut self,
        examples: &[Example<'_>],
        values: &[QueryValues],
        log_shapes: &[f32],
    ) -> Vec<[Vec<f32>; 2]> {
        let shapes = exponentials(log_shapes);
        let (taps, emitter, blank) = (&self.taps, self.emitter, &self.blank);
        spread(&mut self.benches, examples, values, |bench, example, values| {
            let transfer = transfer(taps, emitter, blank, &example.pose, values, &shapes);
            let input = bench.head.analyse(&example.dry, example.pre_roll);
            bench.head.render(&input, &transfer)
        })
    }

    /// Renders clips, and gives the derivatives of their mean loss.
    #[must_use]
    pub(crate) fn judge(&mut self, examples: &[Example<'_>], values: &[QueryValues], log_shapes: &[f32]) -> BatchGradient {
        let shapes = exponentials(log_shapes);
        let (taps, emitter, blank) = (&self.taps, self.emitter, &self.blank);
        let share = 1.0 / examples.len().max(1) as f32;
        let parts = spread(&mut self.benches, examples, values, |bench, example, values| {
            let transfer = transfer(taps, emitter, blank, &example.pose, values, &shapes);
            let input = bench.head.analyse(&example.dry, example.pre_roll);
            let [left, right] = bench.head.render(&input, &transfer);
            let mut by_samples = [Vec::new(), Vec::new()];
            let loss = bench.loss.of([&left, &right], example.binaural, &mut by_samples);
            by_samples.iter_mut().flatten().for_each(|g| *g *= share);
            let mut by = blank.clone();
            bench.head.adjoint(&input, &transfer, by_samples.each_ref().map(Vec::as_slice), &mut by);
            let (mut by_values, mut by_shapes) = (taps.values(), vec![0.0; shapes.len()]);
            let gain = emitter.map_or(1.0, |e| e.gain(&example.pose));
            taps.adjoint(values, &shapes, gain, &by, &mut by_values, &mut by_shapes);
            (loss, by_values, by_shapes)
        });
        let mut out = BatchGradient { log_shapes: vec![0.0; shapes.len()], ..BatchGradient::default() };
        for (loss, by_values, by_shapes) in parts {
            out.loss += f64::from(share) * loss;
            out.values.push(by_values);
            // By a logarithm: the derivative by the value, times the value.
            out.log_shapes.iter_mut().zip(by_shapes.iter().zip(&shapes)).for_each(|(g, (b, s))| *g += b * s);
        }
        out
    }
}

/// The tap shapes of their logarithms.
pub(crate) fn exponentials(logs: &[f32]) -> Vec<f32> {
    logs.iter().map(|l| l.exp()).collect()
}

fn transfer(
    taps: &TapHead,
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

/// Does something for every clip, on as many threads as there are benches; the answers are in the clips' order.
fn spread<B: Send, T: Send>(
    benches: &mut [B],
    examples: &[Example<'_>],
    values: &[QueryValues],
    work: impl Fn(&mut B, &Example<'_>, &QueryValues) -> T + Sync,
) -> Vec<T> {
    let count = benches.len();
    let mut lanes: Vec<std::vec::IntoIter<T>> = std::thread::scope(|scope| {
        let mut threads = Vec::with_capacity(count);
        for (lane, bench) in benches.iter_mut().enumerate() {
            let work = &work;
            threads.push(scope.spawn(move || {
                let mine = examples.iter().zip(values).skip(lane).step_by(count);
                mine.map(|(e, v)| work(bench, e, v)).collect::<Vec<_>>()
            }));
        }
        let join =
            |t: std::thread::ScopedJoinHandle<'_, Vec<T>>| t.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        threads.into_iter().map(|t| join(t).into_iter()).collect()
    });
    (0..examples.len()).filter_map(|i| lanes[i % count].next()).collect()
}
