//! `promenade train`: a capture and anchors in, a scene out.

mod learn;

pub(crate) use learn::run as run_learn;

use crate::args::{MAX_THREADS, TrainArgs};
use crate::simulate::places::Places;
use crate::{plot, report, scene};
use anyhow::{Context, Result};
use promenade_baker::anchors::AnchorSet;
use promenade_baker::evaluate::{EvaluateOptions, Evaluation, Figure, evaluate};
use promenade_baker::{Capture, Split, atomic, file};
use promenade_core::{Pose, Provenance, Scene};
use promenade_trainer::{Checkpoint, CurvePoint, Device, TrainSettings, Trainer};
use std::path::Path;
use std::sync::Arc;

/// Ending of the file that a training is kept in beside its scene until it is done.
pub(crate) const KEPT: &str = "training";
/// Bytes that a file of settings may have.
const MAX_SETTINGS_BYTES: u64 = 1 << 20;

/// What a training needs.
pub(crate) struct Prepared<'a> {
    pub(crate) args: &'a TrainArgs,
    pub(crate) capture: Capture,
    pub(crate) places: Option<Places>,
    pub(crate) settings: TrainSettings,
    emitter: Option<usize>,
    anchors: AnchorSet,
    device: Device,
    threads: usize,
}

pub(crate) fn run(args: &TrainArgs) -> Result<()> {
    let prepared = Prepared::of(args)?;
    let kept = args.output.with_extension(KEPT);
    let mut trainer = prepared.trainer(&prepared.capture, prepared.settings.clone(), &kept)?;
    learn(&mut trainer, args, |trainer| Ok(trainer.checkpoint().save(&kept)?))?;
    let made = prepared.scene(&mut trainer)?;
    report::print(&format!("{}: {} steps\n", args.output.display(), trainer.steps()))?;
    if prepared.places.is_some() { prepared.judge(made, false).map(|_| ()) } else { Ok(()) }
}

impl<'a> Prepared<'a> {
    pub(crate) fn of(args: &'a TrainArgs) -> Result<Self> {
        scene::check_name(&args.output)?;
        let capture = capture(args)?;
        let emitter = args.emitter.as_ref().map(|name| capture.number_of(name)).transpose()?;
        let settings = settings(args)?;
        if args.simulation.simulate.is_some() && args.simulation.head.is_none() {
            anyhow::bail!("--simulate: expected --head with the ears that heard the recordings, found none");
        }
        let places = Places::of(&args.simulation, &capture.emitters, capture.sample_rate_hz, settings.seed)?;
        let anchors = anchors(args, &capture, places.as_ref())?;
        let device = if args.gpu { gpu()? } else { Device::flex() };
        let cores = || std::thread::available_parallelism().map_or(1, usize::from).min(MAX_THREADS);
        Ok(Self { threads: args.threads.unwrap_or_else(cores), args, capture, places, settings, emitter, anchors, device })
    }

    /// A training with a capture, which goes on from where it was kept.
    pub(crate) fn trainer<'c>(&self, capture: &'c Capture, settings: TrainSettings, kept: &Path) -> Result<Trainer<'c>> {
        let before = if kept.exists() && !self.args.restart { Some(Checkpoint::load(kept)?) } else { None };
        let bar = report::Bar::new("preparing", 1.0);
        let device = self.device.clone();
        let mut trainer = match &self.places {
            None => Trainer::new(capture, &self.anchors, settings, device, self.threads)?,
            Some(places) => {
                let folder = self.args.output.with_extension("simulated");
                let simulate = |emitter: usize, poses: &[Pose]| {
                    report::line(format_args!("simulating {} poses of emitter {}", poses.len(), emitter + 1));
                    places.kept_ears(&folder, emitter, poses, |share| bar.at(share))
                };
                Trainer::on_simulation(capture, &self.anchors, settings, device, self.threads, &simulate)?
            }
        };
        if let Some(before) = before {
            trainer.resume(before).with_context(|| format!("{}", kept.display()))?;
            report::note(format_args!("{}: goes on from step {}", kept.display(), trainer.steps()));
        }
        Ok(trainer)
    }

    /// Writes the scene of what was trained.
    pub(crate) fn scene(&self, trainer: &mut Trainer<'_>) -> Result<Scene> {
        let provenance = provenance(&self.capture, trainer.settings(), self.args);
        let scene = match &self.places {
            None => at_emitter(trainer.scene(provenance)?, &self.capture, self.emitter)?,
            Some(places) => {
                let _bar = report::Bar::new("baking", 1.0);
                let number = self.emitter.unwrap_or(0);
                let at = self.capture.emitters[number].position;
                let seed = trainer.settings().seed;
                let listeners: Vec<_> = self.capture.clips.iter().map(|clip| clip.pose.position).collect();
                places.scene((number, &listeners), provenance, (seed, true), |pose, ears| {
                    trainer
                        .refined(pose, at, ears)
                        .context("--simulate: expected settings that correct a simulation, found others")
                })?
            }
        };
        let bytes = scene::kept(&self.args.output, scene, self.args.less)?.to_bytes()?;
        atomic::write(&self.args.output, &bytes)?;
        Ok(Scene::from_bytes(&bytes)?)
    }

    /// The scene of a simulated room on the test clips of its emitter, where there are some, as `eval` judges it.
    pub(crate) fn judge(&self, scene: Scene, baselines: bool) -> Result<Option<Evaluation>> {
        let number = self.emitter.unwrap_or(0);
        let mut capture = self.capture.clone();
        capture.judge_by(&capture.emitters[number].name.clone())?;
        if capture.split(Split::Test).next().is_none() {
            report::note("there is no test clip of the scene's emitter alone, so that it is not judged");
            return Ok(None);
        }
        let judged = evaluate(&Arc::new(scene), &capture, &EvaluateOptions { baselines, ..EvaluateOptions::default() })?;
        let of = |figure| judged.methods[0].mean.get(figure).unwrap_or(f64::NAN);
        report::line(format_args!(
            "scene: test MAG {:.4}, LRE {:.3} dB, ENV {:.4}",
            of(Figure::AvcloudMag),
            of(Figure::AvcloudLre),
            of(Figure::AvcloudEnv)
        ));
        Ok(Some(judged))
    }
}

/// The captures as one, with what is held out of it.
fn capture(args: &TrainArgs) -> Result<Capture> {
    let mut captures = Vec::new();
    for path in &args.captures {
        let capture = Capture::load(path)?;
        for note in &capture.notes {
            report::note(format_args!("{}: {note}", path.display()));
        }
        captures.push(capture);
    }
    let mut capture = Capture::join(captures)?;
    capture.hold_out(&args.hold_out.test_emitter, &args.hold_out.test_track)?;
    Ok(capture)
}

/// The anchors; those that lie apart from the clips are told.
fn anchors(args: &TrainArgs, capture: &Capture, places: Option<&Places>) -> Result<AnchorSet> {
    let Some(file) = &args.anchors else {
        return places.context("expected --anchors, found none")?.anchors();
    };
    let set = AnchorSet::load(file)?;
    let places: Vec<_> = capture.clips.iter().map(|clip| clip.pose.position).collect();
    if let Some(odd) = set.apart_from(&places) {
        report::note(format_args!("{}: {odd}", file.display()));
    }
    Ok(set)
}

/// Takes the steps that are left, tells how it goes, and keeps the training now and then and at the end.
pub(crate) fn learn<'a>(trainer: &mut Trainer<'a>, args: &TrainArgs, keep: impl Fn(&Trainer<'a>) -> Result<()>) -> Result<()> {
    let TrainSettings { steps, look_every, .. } = *trainer.settings();
    let from = trainer.steps();
    let bar = report::Bar::new("training", (steps - from.min(steps)) as f64);
    while trainer.steps() < steps {
        let step = trainer.step();
        if !step.gradient_norm.is_finite() {
            anyhow::bail!("step {}: expected a finite loss, found none; a lower learning rate may help", step.step + 1);
        }
        let done = trainer.steps();
        bar.at((done - from) as f64);
        if done.is_multiple_of(look_every) || done == steps {
            let point = trainer.note()?;
            let [mag, lre, env] = point.test;
            let loss = point.loss;
            report::line(format_args!(
                "step {done} of {steps}: loss {loss:.4}; test MAG {mag:.4}, LRE {lre:.3} dB, ENV {env:.4}"
            ));
            if let Some(file) = &args.curve {
                atomic::write(file, course(trainer.curve())?.as_bytes())?;
            }
        }
        if done.is_multiple_of(args.keep_every.get()) {
            keep(trainer)?;
        }
    }
    keep(trainer)
}

/// A scene with its sound coming from another emitter of the capture.
fn at_emitter(scene: Scene, capture: &Capture, emitter: Option<usize>) -> Result<Scene> {
    let Some(number) = emitter.filter(|number| *number > 0) else { return Ok(scene) };
    let moved = scene.with_emitter(capture.emitters[number].position)?;
    moved.context("--emitter: expected settings with `emitter`, found a network that does not know where the sound comes from")
}

fn settings(args: &TrainArgs) -> Result<TrainSettings> {
    let mut settings = match &args.settings {
        None => TrainSettings::default(),
        Some(path) => {
            let json = file::read(path, MAX_SETTINGS_BYTES).with_context(|| format!("{}: cannot be read", path.display()))?;
            serde_json::from_slice(&json).with_context(|| format!("{}: expected the settings of a training", path.display()))?
        }
    };
    if let Some(steps) = args.steps {
        settings.steps = steps;
    }
    if let Some(seed) = args.seed {
        settings.seed = seed;
    }
    Ok(settings)
}

#[cfg(feature = "gpu")]
#[expect(clippy::unnecessary_wraps, reason = "without the feature it fails")]
fn gpu() -> Result<Device> {
    Ok(promenade_trainer::gpu())
}

#[cfg(not(feature = "gpu"))]
fn gpu() -> Result<Device> {
    anyhow::bail!("--gpu: this program was built without the feature 'gpu'")
}

fn provenance(capture: &Capture, settings: &TrainSettings, args: &TrainArgs) -> Provenance {
    let mut notes = capture.notes.clone();
    let settings_text = serde_json::to_string(settings).unwrap_or_default();
    notes.push(format!("trained by promenade {} with {settings_text}", env!("CARGO_PKG_VERSION")));
    Provenance {
        title: args.title.clone().unwrap_or_else(|| capture.title.clone()),
        credit: capture.credit.clone(),
        licence: capture.licence.clone(),
        recipe: format!(
            "promenade train {}{} -o {} --steps {} --seed {}{}",
            args.captures.iter().map(|path| report::file_name(path)).collect::<Vec<_>>().join(" "),
            args.anchors.as_ref().map_or(String::new(), |anchors| format!(" --anchors {}", report::file_name(anchors))),
            report::file_name(&args.output),
            settings.steps,
            settings.seed,
            args.simulation.simulate.as_ref().map_or(String::new(), |room| format!(" --simulate {}", report::file_name(room)))
        ),
        notes,
    }
}

/// Loss, MAG, LRE and ENV over steps, as SVG.
fn course(curve: &[CurvePoint]) -> Result<String> {
    let panel = |value: fn(&CurvePoint) -> f64| curve.iter().map(|p| (p.step as f64, value(p))).collect();
    let panels = [
        ("loss, training", panel(|p| p.loss)),
        ("MAG, test", panel(|p| p.test[0])),
        ("LRE, test, dB", panel(|p| p.test[1])),
        ("ENV, test", panel(|p| p.test[2])),
    ];
    plot::curves("steps", &panels)
}
