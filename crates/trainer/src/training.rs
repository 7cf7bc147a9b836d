//! The loop: clips in, better weights out.

use crate::checkpoint::{Checkpoint, CurvePoint};
use crate::head::streaming::StreamingHead;
use crate::head::{Example, ExampleVoice, LossGradient, Prediction};
use crate::network::{Decoded, Graph, Query};
use crate::responses::{ClipResponses, clip_responses, grid};
use crate::scene::scene;
use crate::settings::TrainSettings;
use crate::setup::{Setup, fingerprint, in_cloud};
use crate::simulated::{Level, Simulate, SimulatedClips, Simulation};
use crate::weights::{AdamW, Arrays, start};
use burn::tensor::{Device, Tensor, TensorData};
use promenade_baker::BakeError;
use promenade_baker::anchors::AnchorSet;
use promenade_baker::capture::{Capture, Clip, Split, Voice};
use promenade_baker::evaluate::{EvaluateOptions, Figure, Figures, evaluate};
use promenade_core::glam::Vec3;
use promenade_core::network::{CloudEmitter, HEAD_RADIUS_M};
use promenade_core::random::Random;
use promenade_core::{Bands, Pose, Provenance, Scene, SceneError, TransferFunction};
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

/// Seconds of dry sound before a clip whose reverberation reaches into it.
const PRE_ROLL_S: f64 = 0.5;
/// Shifts of a clip along its path, where clips are shifted: few enough that each one's response is found before training
/// begins.
const SHIFTS: usize = 8;

/// Result of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepReport {
    /// Steps done.
    pub step: usize,
    /// Mean loss of the step's clips.
    pub loss: f64,
    /// Norm of the gradient before it was limited.
    pub gradient_norm: f32,
    /// Learning rate.
    pub rate: f32,
}

/// A training under way.
///
/// Made of a capture and anchors. One thread owns it and steps; [`Self::checkpoint`] is what a later one resumes from, and
/// [`Self::scene`] what is played.
pub struct Trainer<'a> {
    capture: &'a Capture,
    /// The training clips, each with what it may be shifted to.
    clips: Vec<Vec<Clip>>,
    settings: TrainSettings,
    setup: Setup,
    responses: Arc<ClipResponses>,
    /// What a simulated room gives for each clip's voices, where that is corrected.
    simulated: SimulatedClips,
    simulation: Option<Simulation>,
    device: Device,
    head: StreamingHead,
    weights: Arrays,
    optimiser: AdamW,
    curve: Vec<CurvePoint>,
    /// Losses since the last point of the curve.
    losses: Vec<f64>,
    fingerprint: u64,
}

impl<'a> Trainer<'a> {
    /// Begins with weights drawn from the seed, `threads` clips at a time.
    ///
    /// # Errors
    /// Settings out of range, a capture without clips to train on or to judge by.
    pub fn new(
        capture: &'a Capture,
        anchors: &AnchorSet,
        settings: TrainSettings,
        device: Device,
        threads: usize,
    ) -> Result<Self, BakeError> {
        settings.check()?;
        for split in [Split::Train, Split::Test] {
            if capture.split(split).next().is_none() {
                let what = "clips of the capture";
                return Err(BakeError::argument(what, format!("some to {}", split.name()), "none"));
            }
        }
        let responses = responses(capture, &settings);
        let setup = Setup::new(capture, &responses, anchors, &settings);
        let weights = start(&settings, &setup);
        let known = (&setup.grid, &setup.bands, &setup.tail);
        let head = StreamingHead::new(&settings.network, &settings.loss, &setup.queries, known, threads);
        Ok(Self {
            fingerprint: fingerprint(capture, &setup),
            responses,
            simulated: SimulatedClips { clips: HashMap::new(), level: Level::default() },
            simulation: None,
            clips: shifted_clips(capture, &settings),
            capture,
            settings,
            setup,
            device: device.autodiff(),
            head,
            weights,
            optimiser: AdamW::default(),
            curve: Vec::new(),
            losses: Vec::new(),
        })
    }

    /// Training of a network that corrects a simulated room: the settings' `simulated` is set.
    ///
    /// # Errors
    /// What [`Self::new`] refuses; a clip whose emitter is not known, and what simulating meets.
    pub fn on_simulation(
        capture: &'a Capture,
        anchors: &AnchorSet,
        mut settings: TrainSettings,
        device: Device,
        threads: usize,
        simulate: &Simulate<'_>,
    ) -> Result<Self, BakeError> {
        settings.network.simulated = true;
        let mut trainer = Self::new(capture, anchors, settings, device, threads)?;
        let Setup { grid, bands, tail, queries, .. } = &trainer.setup;
        let simulation = Simulation::new(grid, bands, tail, queries, trainer.settings.network.taps);
        let clips = || capture.split(Split::Test).chain(trainer.clips.iter().flatten());
        trainer.simulated = simulation.of_clips(capture, clips(), &trainer.responses, simulate)?;
        trainer.simulation = Some(simulation);
        Ok(trainer)
    }

    /// Goes on from where a training was.
    ///
    /// # Errors
    /// A training of another capture, other anchors or other settings; only the number of steps may differ.
    pub fn resume(&mut self, checkpoint: Checkpoint) -> Result<(), BakeError> {
        let settings = TrainSettings { steps: self.settings.steps, ..checkpoint.settings };
        let other = |what: &'static str| {
            BakeError::argument(
                "training to go on with",
                format!("one of the same {what} (begin anew with --restart)"),
                "one of another",
            )
        };
        if settings != self.settings {
            return Err(other("settings"));
        }
        if checkpoint.capture != self.fingerprint {
            return Err(other("capture and anchors"));
        }
        (self.weights, self.optimiser, self.curve) = (checkpoint.weights, checkpoint.optimiser, checkpoint.curve);
        self.losses = checkpoint.losses;
        Ok(())
    }

    /// All that is needed to go on later.
    #[must_use]
    pub fn checkpoint(&self) -> Checkpoint {
        Checkpoint {
            settings: self.settings.clone(),
            weights: self.weights.clone(),
            optimiser: self.optimiser.clone(),
            curve: self.curve.clone(),
            losses: self.losses.clone(),
            capture: self.fingerprint,
        }
    }

    /// What was seen on the way.
    #[must_use]
    pub fn curve(&self) -> &[CurvePoint] {
        &self.curve
    }

    /// Looks at the test clips and adds a point to the curve.
    ///
    /// # Errors
    /// Weights that make no scene, and a rate that cannot be rendered.
    pub fn note(&mut self) -> Result<CurvePoint, BakeError> {
        let test = self.look()?;
        let loss = self.losses.iter().sum::<f64>() / self.losses.len().max(1) as f64;
        self.losses.clear();
        let point = CurvePoint { step: self.optimiser.steps, loss, test };
        self.curve.push(point);
        Ok(point)
    }

    /// The scene of the weights as they are, of the capture's first emitter.
    ///
    /// # Errors
    /// Weights that are not finite or do not fit together; a network that corrects a simulation, which is no scene by itself.
    pub fn scene(&self, provenance: Provenance) -> Result<Scene, SceneError> {
        let poses: Vec<Pose> = self.capture.clips.iter().map(|c| c.pose).collect();
        scene(&self.setup, &self.settings, &self.weights, provenance, &poses)
    }

    /// What is trained, with what the render head and the capture fix.
    #[must_use]
    pub fn settings(&self) -> &TrainSettings {
        &self.settings
    }

    /// Weights by name; tap shapes as logarithms.
    #[must_use]
    pub fn weights(&self) -> &Arrays {
        &self.weights
    }

    /// Steps done.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.optimiser.steps
    }

    /// Takes one batch.
    pub fn step(&mut self) -> StepReport {
        let step = self.optimiser.steps;
        let (loss, gradients) = self.loss(&self.batch(step));
        let rate = self.settings.rate_at(step);
        let gradient_norm = self.optimiser.step(&mut self.weights, &gradients, rate, &self.settings);
        self.losses.push(loss);
        StepReport { step: self.optimiser.steps, loss, gradient_norm, rate }
    }

    /// The mean loss of examples, and its derivatives by all weights.
    fn loss(&mut self, examples: &[Example<'_>]) -> (f64, BTreeMap<String, Vec<f32>>) {
        let graph = Graph::new(&self.weights, &self.device);
        let parts = self.decode(&graph, examples);
        let gradient = self.head.loss(examples, &predictions(&parts), &self.weights);
        let mut gradients = graph.gradients(&surrogate(&parts, &gradient, &self.device).backward());
        gradients.extend(gradient.weights);
        (gradient.loss, gradients)
    }

    /// The transfer function that the network predicts for a pose and an emitter of the capture, as the engine's render head
    /// takes it.
    #[must_use]
    pub fn transfer(&mut self, pose: &Pose, emitter: Option<usize>) -> TransferFunction {
        let emitter = emitter.and_then(|number| self.setup.emitters.get(number)).copied();
        self.filters(pose, ExampleVoice { dry: Vec::new(), emitter, simulated: None })
    }

    fn filters(&mut self, pose: &Pose, voice: ExampleVoice) -> TransferFunction {
        let example = Example { voices: vec![voice], pre_roll: 0, binaural: [&[], &[]], pose: *pose, response: None };
        let parts = self.decode(&Graph::new(&self.weights, &self.device), std::slice::from_ref(&example));
        self.head.transfer(pose, &example.voices[0], &predictions(&parts)[0], &self.weights)
    }

    /// A simulated response of both ears to an emitter anywhere, world metres, as the network corrects it, with the level of
    /// the capture; `None` of a training that corrects no simulation.
    #[must_use]
    pub fn refined(&mut self, pose: &Pose, emitter: Vec3, ears: &[Vec<f32>; 2]) -> Option<[Vec<f32>; 2]> {
        let simulation = self.simulation.as_ref()?;
        let level = self.simulated.level.clone();
        let (own, centre) = simulation.of(ears, &level);
        let (own, emitter) = (Arc::new(own), CloudEmitter::with_sphere(emitter, HEAD_RADIUS_M));
        let voice = ExampleVoice { dry: Vec::new(), emitter: Some(emitter), simulated: Some(own.clone()) };
        let corrected = self.filters(pose, voice);
        Some(own.reshaped(ears, centre, &level, &corrected, (&self.setup.grid, &self.setup.bands)))
    }

    /// MAG, LRE and ENV of the test clips as [`evaluate`] has them: of the scene as it is played, or of what a network makes of
    /// a simulation, which its scene is baked from.
    ///
    /// # Errors
    /// Those of [`Self::scene`] and of [`evaluate`].
    fn look(&mut self) -> Result<[f64; 3], BakeError> {
        let mean = if self.simulation.is_none() {
            let scene = Arc::new(self.scene(Provenance::default())?);
            evaluate(&scene, self.capture, &EvaluateOptions::default())?.methods[0].mean
        } else {
            let clips: Vec<&Clip> = self.capture.split(Split::Test).collect();
            let mut all = Vec::new();
            for clips in clips.chunks(self.settings.batch.max(1)) {
                let examples: Vec<_> = clips.iter().map(|clip| self.example(clip)).collect();
                let heard = self.render(&examples);
                let of = |([left, right], example): (&[Vec<f32>; 2], &Example<'_>)| {
                    Figures::of([left, right], example.binaural, None, self.capture.sample_rate_hz)
                };
                all.extend(heard.iter().zip(&examples).map(of));
            }
            Figures::mean(all.iter())
        };
        Ok([Figure::AvcloudMag, Figure::AvcloudLre, Figure::AvcloudEnv].map(|figure| mean.get(figure).unwrap_or(f64::NAN)))
    }

    /// Both ears' sound of examples.
    #[must_use]
    pub fn render(&mut self, examples: &[Example<'_>]) -> Vec<[Vec<f32>; 2]> {
        let graph = Graph::new(&self.weights, &self.device);
        let predictions = predictions(&self.decode(&graph, examples));
        self.head.render(examples, &predictions, &self.weights)
    }

    /// A clip as an example.
    #[must_use]
    pub fn example(&self, clip: &Clip) -> Example<'a> {
        let pre_roll = (PRE_ROLL_S * self.capture.sample_rate_hz) as usize;
        let response = self.responses.get(&clip.name).cloned();
        // The engine has no sound that travels: the dry sound is as late as the direct sound is in the recording.
        let late = response.as_ref().map_or(0, |r| r.late);
        let before = pre_roll.saturating_add_signed(late as isize);
        let voice = |Voice { emitter, mut dry }: Voice| {
            dry.resize(pre_roll + clip.len, 0.0);
            let simulated = emitter.and_then(|number| self.simulated.clips.get(&(clip.name.clone(), number))).cloned();
            let emitter = emitter.and_then(|number| self.setup.emitters.get(number)).copied();
            ExampleVoice { dry, emitter, simulated }
        };
        let voices = self.capture.voices(clip, before).into_iter().map(voice).collect();
        Example { voices, pre_roll, binaural: self.capture.binaural(clip), pose: clip.pose, response }
    }

    /// The clips of a step, each shifted along the path at random: all of the capture's in an order that the seed and the epoch
    /// give, then all in another.
    fn batch(&self, step: usize) -> Vec<Example<'a>> {
        let count = self.clips.len();
        let batch = self.settings.batch.min(count).max(1);
        let per_epoch = count / batch;
        let (epoch, at) = (step / per_epoch, step % per_epoch);
        let seed = self.settings.seed.wrapping_mul(0x9E37_79B9_7F4A_7C15);
        let order = Random::new(seed.wrapping_add(epoch as u64)).order(count);
        let mut shifts = Random::new(seed ^ (step as u64).wrapping_mul(0xD134_2543_DE82_EF95));
        let mut pick = |shifted: &[Clip]| (shifts.uniform() * shifted.len() as f32) as usize % shifted.len();
        order[at * batch..(at + 1) * batch].iter().map(|i| self.example(&self.clips[*i][pick(&self.clips[*i])])).collect()
    }

    /// Predictions for the examples' listeners, `[listener][value]`: mixture mask, difference mask and, where there is one,
    /// room.
    fn decode(&self, graph: &Graph, examples: &[Example<'_>]) -> Vec<Tensor<2>> {
        let network = &self.settings.network;
        let placement = &self.setup.placement;
        let factors = ["vec_embedder.freqs", "freq_embedder.freqs"].map(|name| &self.weights[name].values[..]);
        let mut heard: Vec<Query<'_>> = Vec::new();
        for example in examples {
            let listener = placement.listener(&example.pose);
            heard.extend(example.voices.iter().map(|voice| Query {
                listener,
                emitter: voice.emitter.map(|e| in_cloud(placement, e.position)),
                simulated: voice.simulated.as_ref().map(|s| s.features()),
            }));
        }
        let Decoded { mixture, difference, embedding } = graph.decode(&self.setup.cloud, &heard, network, factors);
        let room = (network.taps > 0).then(|| graph.coefficients(&embedding));
        [mixture, difference].into_iter().chain(room).collect()
    }
}

/// The training clips, each shifted along its path by [`SHIFTS`] times that lie evenly within what the settings allow, or as it
/// is where they allow none.
fn shifted_clips(capture: &Capture, settings: &TrainSettings) -> Vec<Vec<Clip>> {
    let most = f64::from(settings.shift_s) * capture.sample_rate_hz;
    let count = if most > 0.0 { SHIFTS } else { 1 };
    let samples = |i: usize| (most * ((2 * i + 1) as f64 / count as f64 - 1.0)).round() as isize;
    let of = |clip: &Clip| (0..count).map(|i| capture.shifted(clip, samples(i))).collect();
    capture.split(Split::Train).map(of).collect()
}

/// The responses of a capture's clips and of what they are shifted to, for the head that learns from them.
fn responses(capture: &Capture, settings: &TrainSettings) -> Arc<ClipResponses> {
    let (rate, grid) = (capture.sample_rate_hz, grid(capture.sample_rate_hz));
    let shifted = shifted_clips(capture, settings).into_iter().flatten();
    let clips: Vec<Clip> = capture.split(Split::Test).cloned().chain(shifted).collect();
    Arc::new(clip_responses(capture, &clips, &grid, &Bands::for_rate(rate)))
}

/// The parts as numbers, listener by listener.
fn predictions(parts: &[Tensor<2>]) -> Vec<Prediction> {
    let numbers: Vec<Vec<f32>> = parts.iter().map(|p| p.clone().into_data().try_into_vec().unwrap_or_default()).collect();
    let count = parts.first().map_or(0, |p| p.dims()[0]);
    let row = |part: usize, i: usize| {
        numbers.get(part).map_or_else(Vec::new, |n| n[i * n.len() / count..(i + 1) * n.len() / count].to_vec())
    };
    (0..count).map(|i| Prediction { mixture: row(0, i), difference: row(1, i), room: row(2, i) }).collect()
}

/// A number whose derivatives are those of the loss: the values, weighted with the loss's derivatives by them.
fn surrogate(parts: &[Tensor<2>], gradient: &LossGradient, device: &Device) -> Tensor<1> {
    let pick: [fn(&Prediction) -> &Vec<f32>; 3] = [|a| &a.mixture, |a| &a.difference, |a| &a.room];
    let sums = parts.iter().zip(pick).map(|(part, pick)| {
        let by: Vec<f32> = gradient.predictions.iter().flat_map(|a| pick(a).iter().copied()).collect();
        let by = Tensor::<2>::from_data(TensorData::new(by, part.dims()), device);
        (part.clone() * by).sum()
    });
    sums.reduce(|a, b| a + b).unwrap_or_else(|| Tensor::zeros([1], device))
}

#[cfg(test)]
mod tests;
