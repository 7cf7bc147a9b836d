//! `promenade eval`: scenes against captures, beside baselines.

use crate::args::{EvalArgs, HoldOutArgs, PosesArg};
use crate::{plot, report, scene};
use anyhow::{Context, Result, bail};
use promenade_baker::evaluate::{ClipPair, EvaluateOptions, Evaluation, Figure, Figures, Poses, evaluate_each, overall};
use promenade_baker::wav::{self, Format};
use promenade_baker::{BakeError, Capture, FileError, LoadOptions, Responses, Split, atomic};
use promenade_player::Playing;
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};

pub(crate) fn run(args: &EvalArgs) -> Result<()> {
    let pairs = pairs(&args.subjects)?;
    let head = args.head.as_deref().map(|path| Responses::load(path, &LoadOptions::default())).transpose()?;
    let options = EvaluateOptions {
        playing: if args.clips { Playing::Clips } else { Playing::Stream },
        poses: match args.poses {
            PosesArg::Fixed => Poses::Fixed,
            PosesArg::Path => Poses::Path,
        },
        fit_level: args.fit_level,
        baselines: !args.no_baselines,
        head,
    };
    let mut evaluations = Vec::new();
    for (number, (scene_path, capture_path)) in pairs.iter().enumerate() {
        let scene = scene::read(scene_path)?;
        let mut capture = Capture::load(capture_path)?;
        let HoldOutArgs { test_emitter, test_track } = &args.hold_out;
        capture.hold_out(test_emitter, test_track).with_context(|| format!("{}", capture_path.display()))?;
        if let Some(name) = &args.emitter {
            capture.judge_by(name).with_context(|| format!("{}", capture_path.display()))?;
        }
        for note in &capture.notes {
            report::note(format_args!("{}: {note}", capture_path.display()));
        }
        let rate = capture.sample_rate_hz;
        let whole: f64 = capture.split(Split::Test).map(|c| c.len as f64 / rate).sum();
        let mut bar = report::Bar::new("judging", whole);
        let folder = args.wavs.as_ref().map(|f| f.join(format!("{:02}-{}", number + 1, plain(&capture.title))));
        let (mut method, mut done) = (String::new(), 0.0);
        let evaluation = evaluate_each(&scene, &capture, &options, &mut |heard| {
            if method != heard.method {
                heard.method.clone_into(&mut method);
                (bar, done) = (report::Bar::new(format!("judging {method}"), whole), 0.0);
            }
            done += heard.clip.len as f64 / rate;
            bar.at(done);
            folder.as_deref().map_or(Ok(()), |f| keep(f, &heard, rate))
        })
        .with_context(|| format!("{} on {}", scene_path.display(), capture_path.display()))?;
        drop(bar);
        evaluations.push(evaluation);
    }
    let table = |markdown| tables(&evaluations, markdown);
    report::figures(&args.files, &as_json(&evaluations), table, |folder| {
        Figure::ALL.into_iter().try_for_each(|figure| {
            let plot = plot::boxes(figure.heading(), &values(&evaluations, figure))?;
            Ok(atomic::write(&folder.join(format!("{}.svg", figure.name())), plot.as_bytes())?)
        })
    })
}

/// The values of a figure over the clips of all evaluations, rising, by method.
fn values(evaluations: &[Evaluation], figure: Figure) -> Vec<(&str, Vec<f64>)> {
    let mut rows: Vec<(&str, Vec<f64>)> = Vec::new();
    for method in evaluations.iter().flat_map(|e| &e.methods) {
        let values = method.clips.iter().filter_map(|(_, figures)| figures.get(figure));
        match rows.iter_mut().find(|(name, _)| *name == method.name) {
            Some((_, row)) => row.extend(values),
            None => rows.push((&method.name, values.collect())),
        }
    }
    rows.iter_mut().for_each(|(_, row)| row.sort_by(f64::total_cmp));
    rows
}

/// Each capture with the scene before it.
fn pairs(subjects: &[PathBuf]) -> Result<Vec<(PathBuf, PathBuf)>> {
    let mut pairs = Vec::new();
    let mut scene: Option<(&PathBuf, usize)> = None;
    for path in subjects {
        let is_capture = path.is_dir() || path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
        match &mut scene {
            Some((scene, used)) if is_capture => {
                *used += 1;
                pairs.push(((*scene).clone(), path.clone()));
            }
            Some((scene, 0)) => bail!("{}: expected a capture after it, found {}", scene.display(), path.display()),
            None if is_capture => bail!("{}: expected a scene first, found a capture", path.display()),
            _ => scene = Some((path, 0)),
        }
    }
    match scene {
        Some((scene, 0)) => bail!("{}: expected a capture after it, found none", scene.display()),
        _ => Ok(pairs),
    }
}

/// A name that a file may have.
fn plain(name: &str) -> String {
    let text: String = name.chars().map(|c| if c.is_ascii_alphanumeric() || "-_".contains(c) { c } else { '_' }).collect();
    text.chars().take(80).collect()
}

/// Writes one clip of one method, and the recording beside it.
fn keep(folder: &Path, heard: &ClipPair<'_>, rate: f64) -> Result<(), BakeError> {
    std::fs::create_dir_all(folder).map_err(FileError::write(folder))?;
    let rate = rate.round() as u32;
    let name = plain(&heard.clip.name);
    let recorded = folder.join(format!("{name}.recorded.wav"));
    if !recorded.exists() {
        wav::write(&recorded, rate, &heard.recorded, Format::Float32)?;
    }
    wav::write(&folder.join(format!("{name}.{}.wav", heard.method)), rate, &heard.predicted, Format::Float32)?;
    Ok(())
}

fn tables(evaluations: &[Evaluation], markdown: bool) -> String {
    let mut text = String::new();
    for e in evaluations {
        let clips = e.methods.first().map_or(0, |m| m.clips.len());
        let rate = e.sample_rate_hz;
        let head = format!("{} on {}: {clips} test clips at {rate} Hz, {}", e.scene, e.capture, e.playing.name());
        text += &if markdown { format!("## {head}\n\n") } else { format!("{head}\n") };
        let rows = e.methods.iter().map(|m| (m.name.clone(), m.mean, m.note.clone()));
        text += &table(rows, markdown);
        text += &legend(e);
        for note in &e.notes {
            text += &format!("{}{note}\n", if markdown { "\n" } else { "" });
        }
        text.push('\n');
    }
    if evaluations.len() > 1 {
        let head = format!("Mean over {} captures", evaluations.len());
        text += &if markdown { format!("## {head}\n\n") } else { format!("{head}\n") };
        let notes =
            |name: &str| evaluations[0].methods.iter().find(|m| m.name == name).map_or(String::new(), |m| m.note.clone());
        text += &table(overall(evaluations).into_iter().map(|(name, mean)| (name.clone(), mean, notes(&name))), markdown);
    }
    text.trim_end().to_owned() + "\n"
}

fn table(rows: impl Iterator<Item = (String, Figures, String)>, markdown: bool) -> String {
    let mut cells = vec![vec!["method".to_owned()]];
    cells[0].extend(Figure::ALL.iter().map(|f| f.heading().to_owned()));
    for (name, mean, note) in rows {
        let mut row = vec![if note.is_empty() { name } else { format!("{name} *") }];
        let value = |f: Figure| mean.get(f).map_or("-".to_owned(), |v| format!("{v:.*}", f.digits()));
        row.extend(Figure::ALL.into_iter().map(value));
        cells.push(row);
    }
    report::table(&cells, markdown)
}

/// What the methods with a star are given.
fn legend(e: &Evaluation) -> String {
    let all: Vec<String> = e.methods.iter().filter(|m| !m.note.is_empty()).map(|m| format!("{} {}", m.name, m.note)).collect();
    if all.is_empty() { String::new() } else { format!("\n* {}\n", all.join("; ")) }
}

fn as_json(evaluations: &[Evaluation]) -> Value {
    let all: Vec<Value> = evaluations
        .iter()
        .map(|e| {
            let methods: Vec<Value> = e
                .methods
                .iter()
                .map(|m| {
                    let clips: Vec<Value> =
                        m.clips.iter().map(|(name, f)| json!({ "name": name, "figures": figures(f) })).collect();
                    json!({ "name": m.name, "note": m.note, "mean": figures(&m.mean), "clips": clips })
                })
                .collect();
            json!({
                "scene": e.scene, "capture": e.capture, "playing": e.playing.name(), "sample_rate_hz": e.sample_rate_hz,
                "methods": methods, "notes": e.notes,
            })
        })
        .collect();
    let means: Vec<Value> =
        overall(evaluations).iter().map(|(name, mean)| json!({ "name": name, "mean": figures(mean) })).collect();
    json!({ "evaluations": all, "overall": means })
}

fn figures(all: &Figures) -> Value {
    Value::Object(Figure::ALL.iter().map(|f| (f.name().to_owned(), json!(all.get(*f)))).collect::<Map<_, _>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn captures_go_with_the_scene_before_them() {
        let paths = |names: &[&str]| names.iter().map(PathBuf::from).collect::<Vec<_>>();
        let found = pairs(&paths(&["a.promenade", "1.json", "2.json", "b.promenade", "3.json"])).unwrap();
        let found: Vec<_> = found.iter().map(|(s, c)| (s.to_str().unwrap(), c.to_str().unwrap())).collect();
        assert_eq!(found, [("a.promenade", "1.json"), ("a.promenade", "2.json"), ("b.promenade", "3.json")]);
        for wrong in
            [&["1.json", "a.promenade"][..], &["a.promenade", "b.promenade"], &["a.promenade", "1.json", "b.promenade"]]
        {
            assert!(pairs(&paths(wrong)).is_err(), "{wrong:?}");
        }
    }
}
