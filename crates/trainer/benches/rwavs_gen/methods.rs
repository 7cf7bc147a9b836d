//! What each method makes of a split.

use crate::baselines::{AvNerf, Baseline, Course, Inras, Learner, Naf, spectrogram::BINS};
use crate::house::DEFAULT_MATERIALS;
use crate::options::Options;
use crate::place::{POINTS, Place, Tool, words};
use crate::runs::{Found, Run};
use promenade_baker::capture::{Capture, Clip, Split};
use promenade_baker::evaluate::{EvaluateOptions, Figures, evaluate};
use promenade_baker::{BakeError, file};
use promenade_core::Scene;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// Dry sound before a clip that its direct sound is looked for with, seconds, and bytes that a scene may have.
const PRE_ROLL_S: f64 = 0.5;
const MAX_SCENE_BYTES: u64 = 1 << 30;

/// Both ears of a clip.
type Ears = [Vec<f32>; 2];

/// Runs one method on one split and judges it on clean clips of emitters that it was not trained with.
///
/// # Errors
/// What the command line and files meet.
pub(crate) fn run(run: &Run, place: &Place, options: &Options, tool: &Tool) -> Result<Found, BakeError> {
    let began = Instant::now();
    let heard = options.protocol.heard;
    let [_, tests] = place.split(run.split, heard);
    let recorded = Place::held_out(&place.recorded, &tests)?;
    let clean = Place::held_out(&place.clean, &tests)?;
    let all = match run.method.as_str() {
        "mono" => {
            let dry = |clip: &Clip| [recorded.dry(clip, 0), recorded.dry(clip, 0)];
            judged(&clean, scaled(&recorded, &dry))?
        }
        "simulation" => {
            let heard = |clip: &Clip| place.simulated.binaural(clip).map(<[f32]>::to_vec);
            judged(&clean, scaled(&recorded, &heard))?
        }
        "train" | "train-simulate" | "learn" => ours(run, place, options, tool, &tests)?,
        _ => {
            let kept = options.out.join(format!("{}.training", run.name()));
            let course = Course { steps: options.protocol.steps, seed: run.seed, keep_every: options.keep_every };
            let baseline = baseline(&run.method, place);
            let learner = Learner::train(&*baseline, &recorded, &course, &kept, usize::MAX)?;
            judged(&clean, |clip| learner.ears(&recorded, clip))?
        }
    };
    Ok(Found::new(&Figures::mean(all.iter()), began.elapsed().as_secs_f64()))
}

fn baseline(method: &str, place: &Place) -> Box<dyn Baseline> {
    let (bounds, bins) = (place.room.bounds(), BINS);
    match method {
        "naf" => Box::new(Naf { bounds, bins }),
        "inras" => Box::new(Inras { points: place.room.points(POINTS, 1), bounds, bins }),
        _ => Box::new(AvNerf { bounds, bins }),
    }
}

/// Figures of every clip for testing.
fn judged(clean: &Capture, predict: impl Fn(&Clip) -> Option<Ears>) -> Result<Vec<Figures>, BakeError> {
    let rate = clean.sample_rate_hz;
    let pre_roll = (PRE_ROLL_S * rate) as usize;
    let of = |clip: &Clip| {
        let unknown = || BakeError::argument(format!("clip '{}'", clip.name), "one emitter", "a mix or an unknown one");
        let [left, right] = predict(clip).ok_or_else(unknown)?;
        let dry = clean.dry(clip, pre_roll);
        Ok(Figures::of([&left, &right], clean.binaural(clip), Some((&dry, pre_roll)), rate))
    };
    clean.split(Split::Test).map(of).collect()
}

/// What is predicted, with the one gain that gives training clips their energy.
fn scaled<'p>(recorded: &Capture, predict: &'p dyn Fn(&Clip) -> Ears) -> impl Fn(&Clip) -> Option<Ears> + 'p {
    let energy = |ears: [&[f32]; 2]| ears.into_iter().flatten().map(|x| f64::from(x * x)).sum::<f64>();
    let (mut wanted, mut given) = (0.0, 0.0);
    for clip in recorded.split(Split::Train) {
        wanted += energy(recorded.binaural(clip));
        given += energy(predict(clip).each_ref().map(Vec::as_slice));
    }
    let gain = (wanted / given.max(f64::MIN_POSITIVE)).sqrt() as f32;
    move |clip| Some(predict(clip).map(|ear| ear.iter().map(|x| gain * x).collect()))
}

/// The command line's own ways. A scene of a room is made for each emitter that is judged, from one training.
fn ours(run: &Run, place: &Place, options: &Options, tool: &Tool, tests: &[String]) -> Result<Vec<Figures>, BakeError> {
    let folder = &place.folder;
    let name = run.name();
    let head = options.protocol.head.display().to_string();
    let mut command = words(&format!(
        "{} recorded -o {name}.promenade --steps {} --seed {} --keep-every {}",
        if run.method == "learn" { "learn" } else { "train" },
        options.protocol.steps,
        run.seed,
        options.keep_every
    ));
    tests.iter().for_each(|test| command.extend(["--test-emitter".to_owned(), test.clone()]));
    let scene = folder.join(format!("{name}.promenade"));
    if run.method == "train" {
        tool.run(folder, &[command, words("--anchors anchors.safetensors")].concat())?;
        return played(&scene, place, tests);
    }
    let room = if run.method == "learn" { "--room" } else { "--simulate" };
    command.extend(words(&format!("{room} scan.obj --materials {DEFAULT_MATERIALS}")));
    command.extend(["--head".to_owned(), head]);
    let mut all = Vec::new();
    for test in tests {
        tool.run(folder, &[command.clone(), vec!["--emitter".to_owned(), test.clone()]].concat())?;
        all.extend(played(&scene, place, std::slice::from_ref(test))?);
    }
    Ok(all)
}

/// Figures of a scene as it is played, on clean clips of emitters.
fn played(scene: &Path, place: &Place, tests: &[String]) -> Result<Vec<Figures>, BakeError> {
    let bytes = file::read(scene, MAX_SCENE_BYTES).map_err(BakeError::read(scene))?;
    let scene = Arc::new(Scene::from_bytes(&bytes).map_err(BakeError::read(scene))?);
    let clean = Place::held_out(&place.clean, tests)?;
    let judged = evaluate(&scene, &clean, &EvaluateOptions::default())?;
    Ok(judged.methods.into_iter().flat_map(|method| method.clips).map(|(_, figures)| figures).collect())
}
