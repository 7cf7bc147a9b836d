//! The loop: clips in, better weights out.

use crate::checkpoint::{Checkpoint, CurvePoint};
use crate::network::{Graph, Place};
use crate::scene::scene;
use crate::settings::TrainSettings;
use crate::streaming::{BatchGradient, Example, StreamingHead};
use crate::weights::{AdamW, Arrays, start};
use burn::tensor::{Device, Tensor, TensorData};
use promenade_baker::BakeError;
use promenade_baker::anchors::AnchorSet;
use promenade_baker::capture::{Capture, Clip, Split};
use promenade_baker::random::Random;
use promenade_core::cloud::{Alignment, CloudEmitter, Listener, QueryValues};
use promenade_core::glam::Vec3;
use promenade_core::metrics::avcloud;
use promenade_core::{Bands, Pose, Provenance, Scene, SceneError, StftGrid, TailModel, TransferFunction};
use std::collections::BTreeMap;

/// Seconds of dry sound before a clip that its room still answers to.
const PRE_ROLL_S: f64 = 0.5;
/// Share of the steps over which the learning rate rises.
const WARM_UP: f32 = 0.05;
/// The learning rate at the end, as a share of the highest.
const LAST_RATE: f32 = 0.02;
/// Mean radius of a head, metres.
const HEAD_RADIUS_M: f32 = 0.0875;

/// What a step came to.
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

/// Mean distances of clips from their recordings, as AV-Cloud defines them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Scores {
    /// MAG, linear magnitudes.
    pub mag: f64,
    /// LRE, dB.
    pub lre_db: f64,
    /// ENV.
    pub env: f64,
}

/// Everything around the weights that does not change.
pub struct Stage {
    /// Transform of the masks.
    pub grid: StftGrid,
    /// Bands of the taps.
    pub bands: Bands,
    /// Reverberation of the late part.
    pub tail: TailModel,
    /// Query frequencies.
    pub queries: Bands,
    /// Anchors as the network sees them.
    pub place: Place,
    /// Where they lie in the scene.
    pub alignment: Alignment,
    /// The emitter, where it is known and used.
    pub emitter: Option<CloudEmitter>,
}

/// A training under way.
pub struct Trainer<'a> {
    capture: &'a Capture,
    settings: TrainSettings,
    stage: Stage,
    device: Device,
    head: StreamingHead,
    weights: Arrays,
    optimiser: AdamW,
    curve: Vec<CurvePoint>,
    /// Losses since the last point of the curve.
    losses: Vec<f64>,
    fingerprint: u64,
}

impl Stage {
    /// For a capture and anchors: a grid of four hops of about 5.8 ms, masks at `bands` frequencies as the ear spaces them.
    #[must_use]
    pub fn new(capture: &Capture, anchors: &AnchorSet, settings: &TrainSettings) -> Self {
        let rate = capture.sample_rate_hz;
        let grid = StftGrid::four_hops(rate, 128.0 * rate / 22_050.0);
        let bands = Bands::for_rate(rate);
        let tail = TailModel { seed: settings.seed, t60_s: vec![0.4; bands.count()], coherence: diffuse_coherence(&bands) };
        let network = &settings.network;
        let centre = anchors.positions.iter().sum::<Vec3>() / anchors.positions.len().max(1) as f32;
        let farthest = anchors.positions.iter().map(|p| p.distance(centre)).fold(0.0_f32, f32::max);
        let features = if network.colour { anchors.features.clone() } else { vec![0.0; anchors.features.len()] };
        Self {
            queries: queries(&grid, network.bands),
            place: Place { anchors: anchors.positions.clone(), features, max_norm: farthest.max(1e-3) },
            alignment: anchors.alignment,
            emitter: (capture.emitter.filter(|_| network.emitter))
                .map(|position| CloudEmitter { position, head_radius_m: HEAD_RADIUS_M }),
            grid,
            bands,
            tail,
        }
    }
}

/// Query frequencies: all bins, or fewer, evenly spaced in ERB numbers (Glasberg and Moore 1990).
fn queries(grid: &StftGrid, count: usize) -> Bands {
    let nyquist = 0.5 * grid.sample_rate_hz;
    let number = |hz: f64| 21.4 * (1.0 + 0.00437 * hz).log10();
    let hz = |number: f64| (10.0_f64.powf(number / 21.4) - 1.0) / 0.00437;
    #[expect(clippy::cast_possible_truncation, reason = "a frequency in Hz")]
    let centres = (0..count).map(|i| {
        let share = i as f64 / (count.max(2) - 1) as f64;
        if count >= grid.bins() { (share * nyquist) as f32 } else { hz(share * number(nyquist)) as f32 }
    });
    let centres: Vec<f32> = centres.collect();
    Bands::new(centres).unwrap_or_else(|| Bands::for_rate(grid.sample_rate_hz))
}

/// Interaural coherence of a diffuse field about a head (Lindevald and Benade 1986), real.
fn diffuse_coherence(bands: &Bands) -> Vec<f32> {
    let of = |hz: f32| {
        let kd = std::f32::consts::TAU * hz / 343.0 * 0.15;
        let x = 2.2 * kd;
        let sinc = if x > 1e-6 { x.sin() / x } else { 1.0 };
        sinc / (1.0 + (0.5 * kd).powi(4)).sqrt()
    };
    bands.centres_hz().iter().map(|hz| of(*hz)).collect()
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
                return Err(BakeError::Argument {
                    what,
                    expected: format!("some to {}", split.name()),
                    found: "none".to_owned(),
                });
            }
        }
        let stage = Stage::new(capture, anchors, &settings);
        let features = stage.place.features.len() / stage.place.anchors.len();
        let weights = start(&settings, stage.place.anchors.len(), features, stage.bands.count(), stage.grid.hop_s());
        let known = (&stage.grid, &stage.bands, &stage.tail);
        let head = StreamingHead::new(&settings.network, &settings.loss, &stage.queries, known, stage.emitter, threads);
        Ok(Self {
            fingerprint: fingerprint(capture, &stage),
            capture,
            settings,
            stage,
            device: device.autodiff(),
            head,
            weights,
            optimiser: AdamW::default(),
            curve: Vec::new(),
            losses: Vec::new(),
        })
    }

    /// Goes on from where a training was.
    ///
    /// # Errors
    /// A training of another capture, other anchors or other settings; only the number of steps may differ.
    pub fn resume(&mut self, checkpoint: Checkpoint) -> Result<(), BakeError> {
        let settings = TrainSettings { steps: self.settings.steps, ..checkpoint.settings };
        let other = |what: &'static str| BakeError::Argument {
            what: "training to go on with",
            expected: format!("one of the same {what} (begin anew with --restart)"),
            found: "one of another".to_owned(),
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
            anchors: 0,
            notes: Vec::new(),
        }
    }

    /// What was seen on the way.
    #[must_use]
    pub fn curve(&self) -> &[CurvePoint] {
        &self.curve
    }

    /// Looks at the test clips and adds a point to the curve.
    pub fn note(&mut self) -> CurvePoint {
        let Scores { mag, lre_db, env } = self.look(Split::Test);
        let loss = self.losses.iter().sum::<f64>() / self.losses.len().max(1) as f64;
        self.losses.clear();
        let point = CurvePoint { step: self.optimiser.steps, loss, test: [mag, lre_db, env] };
        self.curve.push(point);
        point
    }

    /// The scene of the weights as they are.
    ///
    /// # Errors
    /// As [`crate::scene()`].
    pub fn scene(&self, provenance: Provenance) -> Result<Scene, SceneError> {
        let poses: Vec<Pose> = self.capture.clips.iter().map(|c| c.pose).collect();
        scene(&self.stage, &self.settings, &self.weights, provenance, &poses)
    }

    /// Weights by name; tap shapes as logarithms.
    #[must_use]
    pub fn weights(&self) -> &Arrays {
        &self.weights
    }

    /// What does not change.
    #[must_use]
    pub fn stage(&self) -> &Stage {
        &self.stage
    }

    /// How it is trained.
    #[must_use]
    pub fn settings(&self) -> &TrainSettings {
        &self.settings
    }

    /// Steps done.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.optimiser.steps
    }

    /// Takes one batch.
    pub fn step(&mut self) -> StepReport {
        let step = self.optimiser.steps;
        let (loss, gradients) = self.judge(&self.batch(step));
        let rate = self.rate(step);
        let gradient_norm = self.optimiser.step(&mut self.weights, &gradients, rate, &self.settings);
        self.losses.push(loss);
        StepReport { step: self.optimiser.steps, loss, gradient_norm, rate }
    }

    /// The mean loss of examples, and its derivatives by all weights.
    fn judge(&mut self, examples: &[Example<'_>]) -> (f64, BTreeMap<String, Vec<f32>>) {
        let graph = Graph::new(&self.weights, &self.device);
        let (values, parts) = self.decode(&graph, examples);
        let shapes = self.log_shapes().to_vec();
        let judged = self.head.judge(examples, &values, &shapes);
        let mut gradients = graph.gradients(&surrogate(&parts, &judged, &self.device).backward());
        if !shapes.is_empty() {
            gradients.insert("tap_shapes".to_owned(), judged.log_shapes);
        }
        (judged.loss, gradients)
    }

    /// What the network says of a pose, as the render head takes it.
    #[must_use]
    pub fn transfer(&self, pose: &Pose) -> TransferFunction {
        let example = Example { dry: Vec::new(), pre_roll: 0, binaural: [&[], &[]], pose: *pose };
        let (values, _) = self.decode(&Graph::new(&self.weights, &self.device), std::slice::from_ref(&example));
        self.head.transfer(pose, &values[0], self.log_shapes())
    }

    /// Renders clips of a split with the weights as they are, and compares.
    #[must_use]
    pub fn look(&mut self, split: Split) -> Scores {
        let clips: Vec<&Clip> = self.capture.split(split).collect();
        let mut sum = Scores::default();
        let mut count = 0.0;
        for clips in clips.chunks(self.settings.batch.max(1)) {
            let examples: Vec<_> = clips.iter().map(|c| self.example(c, 0.0)).collect();
            for ([left, right], example) in self.render(&examples).iter().zip(&examples) {
                let (got, want) = ([&left[..], &right[..]], example.binaural);
                let of = (avcloud::mag(got, want), avcloud::lre_db(got, want), avcloud::env(got, want));
                if let (Ok(mag), Ok(lre), Ok(env)) = of {
                    (sum.mag, sum.lre_db, sum.env) = (sum.mag + mag, sum.lre_db + lre, sum.env + env);
                    count += 1.0;
                }
            }
        }
        Scores { mag: sum.mag / count, lre_db: sum.lre_db / count, env: sum.env / count }
    }

    /// Both ears' sound of examples.
    #[must_use]
    pub fn render(&mut self, examples: &[Example<'_>]) -> Vec<[Vec<f32>; 2]> {
        let graph = Graph::new(&self.weights, &self.device);
        let (values, _) = self.decode(&graph, examples);
        let shapes = self.log_shapes().to_vec();
        self.head.render(examples, &values, &shapes)
    }

    /// A clip as an example, its pose shifted along the path.
    #[must_use]
    pub fn example(&self, clip: &Clip, shift_s: f64) -> Example<'a> {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count of samples")]
        let pre_roll = (PRE_ROLL_S * self.capture.sample_rate_hz) as usize;
        let pose = if shift_s == 0.0 { clip.pose } else { self.capture.pose_near(clip, shift_s) };
        Example { dry: self.capture.dry(clip, pre_roll), pre_roll, binaural: self.capture.binaural(clip), pose }
    }

    fn log_shapes(&self) -> &[f32] {
        self.weights.get("tap_shapes").map_or(&[], |t| &t.values)
    }

    /// The clips of a step: all of the capture's in an order that the seed and the epoch give, then all in another.
    fn batch(&self, step: usize) -> Vec<Example<'a>> {
        let clips: Vec<&Clip> = self.capture.split(Split::Train).collect();
        let batch = self.settings.batch.min(clips.len()).max(1);
        let per_epoch = clips.len() / batch;
        let (epoch, at) = (step / per_epoch, step % per_epoch);
        let seed = self.settings.seed.wrapping_mul(0x9E37_79B9_7F4A_7C15);
        let order = Random::new(seed.wrapping_add(epoch as u64)).order(clips.len());
        let mut shifts = Random::new(seed ^ (step as u64).wrapping_mul(0xD134_2543_DE82_EF95));
        let shift = |shifts: &mut Random| f64::from(self.settings.shift_s * (2.0 * shifts.uniform() - 1.0));
        order[at * batch..(at + 1) * batch].iter().map(|i| self.example(clips[*i], shift(&mut shifts))).collect()
    }

    fn rate(&self, step: usize) -> f32 {
        let along = (step as f32 + 1.0) / self.settings.steps.max(1) as f32;
        let fall = 0.5 + 0.5 * (std::f32::consts::PI * along.min(1.0)).cos();
        self.settings.rate * (along / WARM_UP).min(1.0) * (LAST_RATE + (1.0 - LAST_RATE) * fall)
    }

    /// What the network says of the examples' listeners, as numbers and as parts of the graph.
    fn decode(&self, graph: &Graph, examples: &[Example<'_>]) -> (Vec<QueryValues>, Vec<Tensor<2>>) {
        let listeners: Vec<Listener> = examples.iter().map(|e| self.listener(&e.pose)).collect();
        let factors = ["vec_embedder.freqs", "freq_embedder.freqs"].map(|name| &self.weights[name].values[..]);
        let decoded = graph.decode(&self.stage.place, &listeners, &self.settings.network, factors);
        let mut parts = vec![decoded.mixture, decoded.difference];
        if self.settings.network.taps > 0 {
            parts.push(graph.coefficients(&decoded.embedding));
        }
        let numbers: Vec<Vec<f32>> = parts.iter().map(|p| p.clone().into_data().try_into_vec().unwrap_or_default()).collect();
        let count = examples.len();
        let row = |part: usize, i: usize| {
            numbers.get(part).map_or_else(Vec::new, |n| n[i * n.len() / count..(i + 1) * n.len() / count].to_vec())
        };
        let values =
            (0..count).map(|i| QueryValues { mixture: row(0, i), difference: row(1, i), coefficients: row(2, i) }).collect();
        (values, parts)
    }

    fn listener(&self, pose: &Pose) -> Listener {
        self.stage.alignment.listener(pose)
    }
}

/// A number whose derivatives are those of the loss: the values, weighted with the loss's derivatives by them.
fn surrogate(parts: &[Tensor<2>], judged: &BatchGradient, device: &Device) -> Tensor<1> {
    let pick: [fn(&QueryValues) -> &Vec<f32>; 3] = [|v| &v.mixture, |v| &v.difference, |v| &v.coefficients];
    let sums = parts.iter().zip(pick).map(|(part, pick)| {
        let by: Vec<f32> = judged.values.iter().flat_map(|v| pick(v).iter().copied()).collect();
        let by = Tensor::<2>::from_data(TensorData::new(by, part.dims()), device);
        (part.clone() * by).sum()
    });
    sums.reduce(|a, b| a + b).unwrap_or_else(|| Tensor::zeros([1], device))
}

/// Tells captures and anchors apart (FNV-1a over what is learnt from).
fn fingerprint(capture: &Capture, stage: &Stage) -> u64 {
    let mut hash = 0xCBF2_9CE4_8422_2325_u64;
    let mut mix = |value: u32| hash = (hash ^ u64::from(value)).wrapping_mul(0x0100_0000_01B3);
    for track in &capture.tracks {
        let samples = track.dry.iter().chain(track.binaural.iter().flatten());
        samples.for_each(|x| mix(x.to_bits()));
    }
    for clip in &capture.clips {
        #[expect(clippy::cast_possible_truncation, reason = "a hash")]
        [clip.track, clip.start, clip.len, clip.split as usize].iter().for_each(|v| mix(*v as u32));
        clip.pose.position.to_array().iter().chain(&clip.pose.orientation.to_array()).for_each(|x| mix(x.to_bits()));
    }
    let place = stage.place.anchors.iter().flat_map(|a| a.to_array());
    place.chain(stage.place.features.iter().copied()).for_each(|x| mix(x.to_bits()));
    hash
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::{LossSettings, NetworkSettings};
    use crate::weights::is_fixed;
    use promenade_baker::capture::Track;
    use promenade_core::cloud::PoseDecoder;
    use promenade_core::{CameraPath, Keyframe, LiveParams, Quality, Renderer, Tier};
    use std::sync::Arc;

    const RATE: f64 = 8000.0;

    fn settings() -> TrainSettings {
        let network = NetworkSettings {
            width: 16,
            heads: 2,
            layers: 2,
            feed_forward: 32,
            bands: 12,
            octaves: 3,
            highest: 4.0,
            taps: 5,
            ..NetworkSettings::default()
        };
        let loss = LossSettings { n_fft: vec![64, 128], ..LossSettings::default() };
        TrainSettings {
            network,
            loss,
            steps: 40,
            batch: 3,
            rate: 3e-3,
            shift_s: 0.5,
            look_every: 20,
            ..TrainSettings::default()
        }
    }

    /// A listener who walks round an emitter: softer far away, louder on its side, with an echo.
    fn capture() -> Capture {
        let (clip, clips) = (1600, 10);
        let mut random = Random::new(7);
        let emitter = Vec3::new(1.0, 2.0, 1.5);
        let dry: Vec<f32> = (0..clip * clips).map(|_| 0.3 * random.normal()).collect();
        let pose = |i: usize| {
            let at = i as f32;
            Pose::from_ypr(Vec3::new((0.7 * at).sin(), -0.2 * at, 1.5), 0.6 * at, 0.0, 0.0)
        };
        let mut binaural = [vec![0.0; dry.len()], vec![0.0; dry.len()]];
        for i in 0..dry.len() {
            let pose = pose(i / clip);
            let gain = 1.0 / pose.position.distance(emitter).max(0.25);
            let side = pose.to_head(emitter).normalize().y;
            for (ear, side) in binaural.iter_mut().zip([side, -side]) {
                ear[i] = gain * (1.0 + 0.6 * side) * dry[i] + 0.2 * dry[i.saturating_sub(150)];
            }
        }
        let seconds = |i: usize| (i * clip) as f64 / RATE;
        let keyframes = (0..clips).map(|i| Keyframe { t_s: seconds(i) + 0.1, pose: pose(i) }).collect();
        let clips = (0..clips).map(|i| Clip {
            name: format!("{i}"),
            track: 0,
            start: i * clip,
            len: clip,
            pose: pose(i),
            split: if i % 5 == 2 { Split::Test } else { Split::Train },
        });
        Capture {
            title: "Walk".to_owned(),
            credit: String::new(),
            licence: String::new(),
            sample_rate_hz: RATE,
            emitter: Some(emitter),
            clips: clips.collect(),
            tracks: vec![Track { name: "t".to_owned(), dry, binaural, path: CameraPath::new(keyframes).unwrap() }],
            notes: Vec::new(),
        }
    }

    fn anchors() -> AnchorSet {
        let mut random = Random::new(3);
        let mut spread = |count: usize, by: f32| -> Vec<f32> { (0..count).map(|_| by * random.normal()).collect() };
        let positions = spread(3 * 9, 2.0).chunks_exact(3).map(Vec3::from_slice).collect();
        AnchorSet { alignment: Alignment::IDENTITY, positions, features: spread(9 * 6, 1.0), neighbours: 2 }
    }

    fn trainer(capture: &Capture, settings: TrainSettings) -> Trainer<'_> {
        Trainer::new(capture, &anchors(), settings, Device::flex(), 2).unwrap()
    }

    #[test]
    fn every_gradient_is_the_derivative() {
        let capture = capture();
        let variants: [fn(&mut NetworkSettings); 4] =
            [|_| (), |n| n.audio_embedding = false, |n| (n.emitter, n.taps) = (false, 0), |n| n.two_masks = false];
        for (variant, change) in variants.into_iter().enumerate() {
            let mut settings = settings();
            change(&mut settings.network);
            let mut trainer = trainer(&capture, settings);
            let examples = trainer.batch(0);
            let gradients = trainer.judge(&examples).1;
            // What the variant leaves out has no gradient; all else has.
            let used = |name: &str| match name {
                "_audio_features_f" => variant != 1,
                "diff_prj.weight" | "diff_prj.bias" => variant != 3,
                _ => !is_fixed(name),
            };
            let names: Vec<String> = trainer.weights.keys().cloned().collect();
            for name in names {
                let gradient = gradients.get(&name).cloned().unwrap_or_default();
                let norm = gradient.iter().map(|g| g * g).sum::<f32>().sqrt();
                // The weights of a softmax do not change with a bias that all keys have.
                if !used(&name) || name == "pcd_av_proj.2.proj.bias" {
                    assert!(norm < 1e-7, "{name} of variant {variant} has a gradient of {norm}");
                    continue;
                }
                let whole = trainer.weights[&name].values.clone();
                let scale = (whole.iter().map(|w| w * w).sum::<f32>() / whole.len() as f32).sqrt().max(0.05);
                let mut value = |step: f32| {
                    let moved = trainer.weights.get_mut(&name).unwrap();
                    let along = whole.iter().zip(&gradient).map(|(w, g)| w + step * g / norm.max(1e-12));
                    moved.values = along.collect();
                    trainer.judge(&examples).0
                };
                let step = 2e-2 * scale;
                let slope = (value(step) - value(-step)) / (2.0 * f64::from(step));
                trainer.weights.get_mut(&name).unwrap().values = whole;
                // Single precision and the kinks of absolute values leave some percent.
                let off = (slope - f64::from(norm)).abs();
                assert!(off < 0.08 * f64::from(norm) + 2e-4, "{name} of variant {variant}: {norm} against {slope}");
                assert!(norm > 1e-7, "{name} of variant {variant} has no gradient");
            }
        }
    }

    #[test]
    fn the_scene_plays_what_was_trained() {
        let capture = capture();
        let mut trainer = trainer(&capture, settings());
        (0..5).for_each(|_| assert!(trainer.step().loss.is_finite()));
        let scene = Arc::new(trainer.scene(Provenance::default()).unwrap());
        let bytes = scene.to_bytes().unwrap();
        assert_eq!(Scene::from_bytes(&bytes).unwrap(), *scene);
        let mut decoder = PoseDecoder::new(&scene).unwrap();
        let mut decoded = decoder.blank();
        let clips: Vec<Clip> = capture.split(Split::Test).cloned().collect();
        for clip in &clips {
            decoder.decode(&clip.pose, &mut decoded);
            let trained = trainer.transfer(&clip.pose).to_row();
            let worst = decoded.transfer.to_row().iter().zip(&trained).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(worst < 1e-4, "transfer functions differ by {worst}");
            let example = trainer.example(clip, 0.0);
            let rendered = trainer.render(std::slice::from_ref(&example)).remove(0);
            let mut renderer = Renderer::for_tier(&scene, RATE, Tier::High).unwrap();
            let latency = renderer.latency_samples();
            let input: Vec<f32> = example.dry.iter().copied().chain(vec![0.0; latency]).collect();
            let mut out = [vec![0.0; input.len()], vec![0.0; input.len()]];
            let [left, right] = &mut out;
            let quality = Quality { tier: Tier::High, live: LiveParams { wait: true, ..LiveParams::default() } };
            renderer.process(&input, [left, right], quality, &mut |_| clip.pose);
            for (played, rendered) in out.iter().zip(&rendered) {
                let played = &played[example.pre_roll + latency..];
                let worst = played.iter().zip(rendered).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
                assert!(worst < 1e-4, "sounds differ by {worst}");
                assert!(rendered.iter().any(|x| x.abs() > 0.01));
            }
        }
    }

    #[test]
    fn goes_on_after_a_stop_as_if_it_had_not_stopped_and_learns() {
        let capture = capture();
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("walk.training");
        let mut whole = trainer(&capture, settings());
        let first = whole.note();
        for _ in 0..40 {
            whole.step();
            if whole.steps().is_multiple_of(20) {
                whole.note();
            }
        }
        let mut parts = trainer(&capture, settings());
        parts.note();
        (0..13).for_each(|_| assert!(parts.step().loss.is_finite()));
        parts.checkpoint().save(&file).unwrap();
        drop(parts);
        let mut parts = trainer(&capture, settings());
        parts.resume(Checkpoint::load(&file).unwrap()).unwrap();
        assert_eq!(parts.steps(), 13);
        for _ in 13..40 {
            parts.step();
            if parts.steps().is_multiple_of(20) {
                parts.note();
            }
        }
        assert_eq!(parts.weights(), whole.weights());
        for (a, b) in parts.curve().iter().zip(whole.curve()) {
            // Written as decimals on the way.
            assert!(a.step == b.step && (a.loss - b.loss).abs() < 1e-12 && (a.test[0] - b.test[0]).abs() < 1e-12);
        }
        assert_eq!(parts.curve().len(), 3);
        let last = whole.curve().last().unwrap();
        assert!(last.test[0] < 0.8 * first.test[0], "MAG from {} to {}", first.test[0], last.test[0]);

        let other = TrainSettings { seed: 2, ..settings() };
        let refused = trainer(&capture, other).resume(Checkpoint::load(&file).unwrap()).unwrap_err();
        assert!(refused.to_string().contains("settings"), "{refused}");
        let bytes = std::fs::read(&file).unwrap();
        for end in (0..bytes.len()).step_by(997) {
            std::fs::write(&file, &bytes[..end]).unwrap();
            let error = Checkpoint::load(&file).unwrap_err().to_string();
            assert!(error.contains("walk.training"), "{error}");
        }
    }
}
