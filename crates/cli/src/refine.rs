//! `promenade refine`: a simulated room, corrected by what was measured in it.

use crate::args::RefineArgs;
use crate::simulate::places::Places;
use crate::{report, scene};
use anyhow::{Context, Result, anyhow, bail};
use promenade_baker::capture::Emitter;
use promenade_baker::{Capture, LoadOptions, Responses, Split};
use promenade_core::glam::Vec3;
use promenade_core::{Pose, Provenance};
use promenade_fit::Measurements;
use promenade_trainer::Device;
use promenade_trainer::recorded_responses;
use promenade_trainer::refinement::{Pair, RefineSettings, Refiner, Score, SimulatedResponse, score};
use std::path::Path;

/// Measured responses by source: heads or groups of microphones that heard it.
struct Measured {
    sample_rate_hz: f64,
    sources: Vec<Emitter>,
    heard: Vec<Recording>,
    /// Whether channels are ears.
    is_head: bool,
    credit: String,
    licence: String,
}

struct Recording {
    source: usize,
    /// One listener whose ears are the channels, or a microphone for each channel.
    poses: Vec<Pose>,
    channels: Vec<Vec<f32>>,
    /// Variance of the channels' bands, where it is known.
    noise: Vec<f32>,
}

impl Measured {
    fn load(args: &RefineArgs) -> Result<Self> {
        match (&args.simulation.head, Capture::is_one(&args.measured)) {
            (Some(_), true) => Self::recorded(&args.measured),
            (Some(_), false) => Self::ears(&args.measured),
            (None, _) => Self::microphones(args),
        }
    }

    /// What the training clips of a capture give, each with its uncertainty.
    fn recorded(path: &Path) -> Result<Self> {
        let capture = Capture::load(path)?;
        report::notes(&capture.notes);
        let found = recorded_responses(&capture).into_iter().filter(|r| r.split == Split::Train);
        let heard: Vec<Recording> = found
            .filter_map(|r| {
                let (poses, channels) = (vec![r.listener], r.ears.to_vec());
                Some(Recording { source: r.emitter?, poses, channels, noise: r.noise })
            })
            .collect();
        let clips = capture.split(Split::Train).count();
        report::line(format_args!("{}: the responses of {} of {clips} clips stand out", path.display(), heard.len()));
        let Capture { sample_rate_hz, emitters: sources, credit, licence, .. } = capture;
        Ok(Self { sample_rate_hz, sources, heard, is_head: true, credit, licence })
    }

    fn ears(path: &Path) -> Result<Self> {
        let set = Responses::load(path, &LoadOptions::default())?;
        report::notes(&set.notes);
        let mut sources: Vec<Emitter> = Vec::new();
        let heard = set.responses.into_iter().map(|r| Recording {
            source: Emitter::numbered(&mut sources, r.source),
            poses: vec![r.listener],
            channels: vec![r.left, r.right],
            noise: Vec::new(),
        });
        let heard = heard.collect();
        Ok(Self { sample_rate_hz: set.sample_rate_hz, sources, heard, is_head: true, credit: set.credit, licence: set.licence })
    }

    /// All microphones that heard one source are the channels of one response.
    fn microphones(args: &RefineArgs) -> Result<Self> {
        let options = promenade_fit::LoadOptions {
            rate_hz: args.rate,
            setting: args.setting.clone(),
            air: args.simulation.air.air(),
            ..promenade_fit::LoadOptions::default()
        };
        let set = Measurements::load(&args.measured, &options)?;
        report::notes(&set.notes);
        let mut sources: Vec<Emitter> = Vec::new();
        let mut heard: Vec<Recording> = Vec::new();
        let point = |at: [f64; 3]| Vec3::from(at.map(|x| x as f32));
        for one in set.all {
            let source = Emitter::numbered(&mut sources, point(one.source.at_m));
            sources[source].facing_deg = one.source.facing.map(|f| {
                let [x, y, z] = f.map(|v| v as f32);
                [y.atan2(x).to_degrees(), z.atan2(x.hypot(y)).to_degrees()]
            });
            let pose = Pose { position: point(one.microphone.at_m), ..Pose::IDENTITY };
            match heard.iter_mut().find(|h| h.source == source) {
                Some(h) => {
                    h.poses.push(pose);
                    h.channels.push(one.samples);
                }
                None => heard.push(Recording { source, poses: vec![pose], channels: vec![one.samples], noise: Vec::new() }),
            }
        }
        for h in &mut heard {
            let longest = h.channels.iter().map(Vec::len).max().unwrap_or(0);
            h.channels.iter_mut().for_each(|x| x.resize(longest, 0.0));
        }
        Ok(Self {
            sample_rate_hz: f64::from(set.sample_rate_hz),
            sources,
            heard,
            is_head: false,
            credit: String::new(),
            licence: String::new(),
        })
    }

    /// Each measured response beside the simulated one, with the number of its source.
    fn pairs(&self, places: &Places, done: impl Fn(f64) + Sync) -> Result<Vec<(usize, Pair)>> {
        let mut pairs = Vec::with_capacity(self.heard.len());
        for (source, emitter) in self.sources.iter().enumerate() {
            let heard: Vec<&Recording> = self.heard.iter().filter(|h| h.source == source).collect();
            let poses: Vec<Pose> = heard.iter().flat_map(|h| h.poses.iter().copied()).collect();
            let mut made = places.ears(source, &poses, &done)?.into_iter();
            for h in heard {
                let simulated = self.simulated(emitter.position, &h.poses, made.by_ref().take(h.poses.len()).collect());
                pairs.push((source, Pair { simulated, measured: h.channels.clone(), noise: h.noise.clone() }));
            }
        }
        Ok(pairs)
    }

    fn simulated(&self, source: Vec3, poses: &[Pose], made: Vec<[Vec<f32>; 2]>) -> SimulatedResponse {
        let channels = if self.is_head {
            made.into_iter().flatten().collect()
        } else {
            // A head without ears hears the same with both.
            made.into_iter().map(|[left, _]| left).collect()
        };
        SimulatedResponse { channels, places: told(source, poses) }
    }
}

/// What a network is told of source and listener: both places, their distance and the source's direction seen from the head.
fn told(source: Vec3, poses: &[Pose]) -> Vec<f32> {
    let seen = poses[0].to_head(source);
    let numbers = [source, poses[0].position, seen.normalize_or_zero()].map(|v| v.to_array());
    numbers.concat().into_iter().chain([seen.length()]).collect()
}

pub(crate) fn run(args: &RefineArgs) -> Result<()> {
    let measured = Measured::load(args)?;
    let mut sources = measured.sources.clone();
    sources.extend(args.emitter.map(Emitter::at));
    let simulation = &args.simulation;
    let places = Places::of(simulation, &sources, measured.sample_rate_hz, args.seed)?;
    let places = places.context("expected --simulate with the mesh of a room to correct, found none")?;
    report::line(format_args!("simulating {} sources", measured.sources.len()));
    let bar = report::Bar::new("simulating", 1.0);
    let pairs = measured.pairs(&places, |share| bar.at(share))?;
    drop(bar);
    if args.evaluate {
        let judge = args.judge_by.as_deref().map(|path| Measured::ears(path)?.pairs(&places, |_| ())).transpose()?;
        evaluate(args, &measured, &pairs, judge.as_deref().unwrap_or(&pairs))?;
    }
    let (Some(output), Some(emitter)) = (&args.output, args.emitter) else { return Ok(()) };
    if !measured.is_head {
        bail!("{}: expected --head for a scene, found none", output.display());
    }
    let pairs: Vec<Pair> = pairs.into_iter().map(|(_, pair)| pair).collect();
    let refiner = trained(&pairs, measured.sample_rate_hz, &settings(args, args.flow, args.seed), "training")?;
    let title = report::file_name(&args.measured);
    let [x, y, z] = emitter.to_array();
    let room = simulation.simulate.as_deref().map(report::file_name).unwrap_or_default();
    let recipe = format!(
        "refine {title} --simulate {room} --emitter {x},{y},{z}{} --steps {} --seed {}",
        if args.flow { " --flow" } else { "" },
        args.steps,
        args.seed
    );
    let (credit, licence) = (measured.credit.clone(), measured.licence.clone());
    let about = Provenance { title, credit, licence, recipe, notes: Vec::new() };
    let _bar = report::Bar::new("baking", 1.0);
    let made = places.scene((sources.len() - 1, &[]), about, (args.seed, false), |pose, ears| {
        let simulated = measured.simulated(emitter, &[*pose], vec![ears.clone()]);
        let refined = refiner.refined(&simulated)?;
        refined.try_into().map_err(|found: Vec<_>| anyhow!("expected both ears, found {} channels", found.len()))
    })?;
    report::notes(&made.provenance().notes);
    let bytes = scene::write(output, &made)?;
    report::line(format_args!("{}: {} kB from {} measured responses", output.display(), bytes.div_ceil(1000), pairs.len()));
    Ok(())
}

fn settings(args: &RefineArgs, flow: bool, seed: u64) -> RefineSettings {
    RefineSettings { flow, steps: args.steps as usize, seed, ..RefineSettings::default() }
}

/// Trains a refinement, and tells how far that is, by a name for it.
fn trained(pairs: &[Pair], rate_hz: f64, settings: &RefineSettings, name: &str) -> Result<Refiner> {
    let bar = report::Bar::new(name, settings.steps as f64);
    Ok(Refiner::train(pairs, rate_hz, settings, Device::flex(), &mut |step, _| bar.at(step as f64))?)
}

/// Trains the regression and the flow on the sources that are not held out, and judges them on those that are.
fn evaluate(args: &RefineArgs, measured: &Measured, pairs: &[(usize, Pair)], judge: &[(usize, Pair)]) -> Result<()> {
    let is_far = |source: usize| {
        let heard = measured.heard.iter().find(|h| h.source == source);
        let distance = heard.map_or(0.0, |h| measured.sources[source].position.distance(h.poses[0].position));
        args.test_beyond.is_some_and(|beyond| distance > beyond)
    };
    let is_held = |source: usize| is_far(source) || args.test_source.contains(&(source + 1));
    let some = |of: &[(usize, Pair)], held: bool| -> Vec<Pair> {
        of.iter().filter(|(source, _)| is_held(*source) == held).map(|(_, pair)| pair.clone()).collect()
    };
    let (tests, pairs) = (some(judge, true), some(pairs, false));
    if tests.is_empty() || pairs.len() < 2 {
        let (held, kept) = (tests.len(), pairs.len());
        bail!("--test-emitter or --test-beyond: expected responses to learn from and to judge by, found {kept} and {held}");
    }
    report::line(format_args!("{} responses to learn from, {} of held-out sources", pairs.len(), tests.len()));
    let rate = measured.sample_rate_hz;
    let mut rows = vec![["method", "EDT ms", "C50 dB", "levels dB", "ILD dB"].map(str::to_owned).to_vec()];
    for (name, flow) in [("regression", false), ("flow", true)] {
        let of_seed = |i: u64| {
            let named = format!("{name}, seed {} of {}", i + 1, args.seeds);
            trained(&pairs, rate, &settings(args, flow, args.seed + i), &named)
        };
        let refiners = (0..args.seeds).map(of_seed).collect::<Result<Vec<_>>>()?;
        if !flow {
            rows.push(row("simulation alone", &[score(&refiners[0], false, &tests)?]));
        }
        rows.push(row(name, &refiners.iter().map(|refiner| score(refiner, true, &tests)).collect::<Result<Vec<_>, _>>()?));
    }
    report::print(&report::table(&rows, false))
}

/// Means over seeds, with standard deviations where there are several.
fn row(name: &str, scores: &[Score]) -> Vec<String> {
    let figures: [fn(&Score) -> f64; 4] = [|s| s.edt_ms, |s| s.c50_db, |s| s.level_db, |s| s.ild_db];
    let cell = |(i, of): (usize, fn(&Score) -> f64)| {
        let count = scores.len() as f64;
        let mean = scores.iter().map(of).sum::<f64>() / count;
        let deviation = (scores.iter().map(|s| (of(s) - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0)).sqrt();
        let digits = if i == 0 { 1 } else { 2 };
        if scores.len() > 1 { format!("{mean:.digits$} ±{deviation:.digits$}") } else { format!("{mean:.digits$}") }
    };
    std::iter::once(name.to_owned()).chain(figures.into_iter().enumerate().map(cell)).collect()
}
