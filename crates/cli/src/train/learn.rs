//! `promenade learn`: a walk's recordings and a coarse room in, a scene out.
//!
//! The recordings' decays give the room its absorption; what is simulated in it is brought to the recordings' level and decay;
//! a network corrects the rest, for as many steps as clips support that it is not told of.

use super::{KEPT, Prepared, learn};
use crate::args::TrainArgs;
use crate::report;
use anyhow::{Context, Result};
use promenade_baker::evaluate::{Evaluation, Figure};
use promenade_baker::{Capture, Split, atomic};
use promenade_room::T20_S;
use promenade_trainer::{CurvePoint, TrainSettings, recorded_decays};

/// Of the training clips of one emitter every one of so many is for validation.
const VALIDATE_EVERY: usize = 5;
/// What validation has to gain, as a share of what it was, for a network to be used.
const GAIN: f64 = 0.02;

pub(crate) fn run(args: &TrainArgs) -> Result<()> {
    let mut prepared = Prepared::of(args)?;
    let decays = fit_room(&mut prepared)?;
    let (steps, course) = supported_steps(&prepared)?;
    let kept = args.output.with_extension(KEPT);
    let settings = TrainSettings { steps: steps.max(1), ..prepared.settings.clone() };
    let mut trainer = prepared.trainer(&prepared.capture, settings, &kept)?;
    if steps > 0 {
        learn(&mut trainer, args, |trainer| Ok(trainer.checkpoint().save(&kept)?))?;
    }
    let made = prepared.scene(&mut trainer)?;
    report::line(format_args!("{}: the fitted room and {steps} steps", args.output.display()));
    let title = made.title().to_owned();
    let judged = prepared.judge(made, true)?.map(|judged| figures(&judged)).unwrap_or_default();
    let text = format!(
        "# {title}\n\nWhat recordings gave a coarse room.\n\n## Decays\n\n{}\n## Validation\n\nClips that the network was not \
         told of; {steps} of {} steps are used.\n\n{}\n## Test clips\n\n{}",
        report::table(&decays, true),
        prepared.settings.steps,
        report::table(&course, true),
        report::table(&judged, true)
    );
    let file = args.output.with_extension("report.md");
    atomic::write(&file, text.as_bytes())?;
    report::print(&report::table(&judged, false))?;
    report::line(file.display());
    Ok(())
}

/// Gives the room the absorption that the recordings' decays ask for, and writes it beside the scene. Says the decays.
fn fit_room(prepared: &mut Prepared<'_>) -> Result<Vec<Vec<String>>> {
    let told = recorded_decays(&prepared.capture);
    // An octave that nothing sounds in is taken to decay as the nearest that something does.
    let nearest = |b: usize| (0..7_usize).filter_map(|o| Some((o.abs_diff(b), told[o]?))).min_by_key(|(apart, _)| *apart);
    let wanted = std::array::from_fn(|b| nearest(b).map(|(_, d)| d.time_s.clamp(T20_S.0, T20_S.1)));
    let places = prepared.places.as_mut().context("expected --room with the mesh of a coarse room, found none")?;
    let listeners: Vec<_> = prepared.capture.split(Split::Train).map(|clip| clip.pose.position).collect();
    let row = |name: &str, cell: &dyn Fn(usize) -> String| std::iter::once(name.to_owned()).chain((0..7).map(cell)).collect();
    let mut rows: Vec<Vec<String>> = vec![row("octave, Hz", &|b| format!("{}", 125 << b))];
    rows.push(row("recordings, s", &|b| told[b].map_or("-".to_owned(), |d| format!("{:.2} ±{:.2}", d.time_s, d.sd_s))));
    if wanted.iter().all(Option::is_none) {
        report::note("no decay stands out of the recordings: the room's materials stay as they are");
        return Ok(rows);
    }
    let matched = places.match_decays(&wanted, &listeners)?;
    matched.missed.iter().for_each(report::note);
    rows.push(row("fitted room, s", &|b| matched.t20_s[b].map_or("-".to_owned(), |t| format!("{t:.2}"))));
    rows.push(row("absorption exponents times", &|b| format!("{:.2}", matched.factors[b])));
    report::line(report::table(&rows, false).trim_end());
    let (mesh, beside) = places.files(&format!("learn, promenade {}", env!("CARGO_PKG_VERSION")));
    let room = prepared.args.output.with_extension("room.obj");
    atomic::write(&room, mesh.as_bytes())?;
    atomic::write(&room.with_extension("materials.json"), (serde_json::to_string_pretty(&beside)? + "\n").as_bytes())?;
    Ok(rows)
}

/// The steps after which the network does best on clips that it is not told of: those of an emitter where there are several,
/// else every fifth. None where it gains less than a fiftieth. And how it went.
fn supported_steps(prepared: &Prepared<'_>) -> Result<(usize, Vec<Vec<String>>)> {
    let validation = validation(&prepared.capture);
    let kept = prepared.args.output.with_extension(format!("validation.{KEPT}"));
    let mut trainer = prepared.trainer(&validation, prepared.settings.clone(), &kept)?;
    if trainer.curve().is_empty() {
        trainer.note()?;
    }
    learn(&mut trainer, prepared.args, |trainer| Ok(trainer.checkpoint().save(&kept)?))?;
    let first = trainer.curve()[0];
    let off = |point: &CurvePoint| point.test.iter().zip(first.test).map(|(now, then)| now / then).sum::<f64>() / 3.0;
    let best = trainer.curve().iter().min_by(|a, b| off(a).total_cmp(&off(b))).filter(|best| off(best) < 1.0 - GAIN);
    let mut rows = vec![["steps", "MAG", "LRE, dB", "ENV", "of the first"].map(str::to_owned).to_vec()];
    let row = |p: &CurvePoint| {
        let figures = p.test.map(|value| format!("{value:.4}")).to_vec();
        [vec![p.step.to_string()], figures, vec![format!("{:.3}", off(p))]].concat()
    };
    rows.extend(trainer.curve().iter().map(row));
    Ok((best.map_or(0, |best| best.step), rows))
}

/// The training clips alone, some of which are to judge by.
fn validation(capture: &Capture) -> Capture {
    let mut out = capture.clone();
    out.clips.retain(|clip| clip.split == Split::Train);
    let of: Vec<Option<usize>> = out.clips.iter().map(|clip| out.emitter_of(clip)).collect();
    let mut all: Vec<Option<usize>> = of.clone();
    all.sort_unstable();
    all.dedup();
    let held = (all.len() > 1).then(|| all[all.len() / 2]);
    for (number, (clip, emitter)) in out.clips.iter_mut().zip(of).enumerate() {
        let is_held = held.map_or(number % VALIDATE_EVERY == VALIDATE_EVERY - 1, |held| emitter == held);
        clip.split = if is_held { Split::Test } else { Split::Train };
    }
    out
}

/// A row for each method.
fn figures(judged: &Evaluation) -> Vec<Vec<String>> {
    let head = std::iter::once("method").chain(Figure::ALL.iter().map(|f| f.heading())).map(str::to_owned).collect();
    let value = |mean: &promenade_baker::evaluate::Figures, f: Figure| {
        mean.get(f).map_or("-".to_owned(), |v| format!("{v:.*}", f.digits()))
    };
    let row = |m: &promenade_baker::evaluate::MethodResult| {
        std::iter::once(m.name.clone()).chain(Figure::ALL.into_iter().map(|f| value(&m.mean, f))).collect()
    };
    std::iter::once(head).chain(judged.methods.iter().map(row)).collect()
}
