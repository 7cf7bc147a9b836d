//! Which network a scene requires: parts are tried one after the other, and what does not pay is left out.

use crate::settings::TrainSettings;
use crate::training::{Scores, Trainer, responses};
use burn::tensor::Device;
use cpu_time::ThreadTime;
use promenade_baker::BakeError;
use promenade_baker::anchors::AnchorSet;
use promenade_baker::capture::{Capture, Split};
use promenade_core::Provenance;
use promenade_core::decode::CloudDecoder;
use std::sync::Arc;

/// A change has to lower the error by this share to be worth a cost, and may raise it by as much to save one.
pub const WORTH: f64 = 0.01;
/// Of the training clips one in so many judges the trials; the test clips are not looked at.
const KEPT_BACK: usize = 5;
/// Trials after which the search ends.
const MOST_TRIALS: usize = 24;
/// Poses that are decoded to measure the cost of a decode.
const DECODES: usize = 9;

/// One network that was tried.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// What is different from the best so far.
    pub change: String,
    /// Distances of the clips that were kept back.
    pub scores: Scores,
    /// Processor seconds of a decode.
    pub decode_s: f64,
    /// Error against the best so far, the mean ratio of MAG, LRE and ENV.
    pub error: f64,
    /// Whether it became the best.
    pub kept: bool,
}

/// A candidate of the search: settings, and which of the anchor sets.
#[derive(Clone, Debug, PartialEq)]
struct Candidate {
    settings: TrainSettings,
    anchors: usize,
}

/// Changes to try, each with its name; those that change nothing are left out.
fn changes(at: &Candidate, sets: &[AnchorSet]) -> Vec<(String, Candidate)> {
    let mut out = Vec::new();
    let mut add = |name: String, change: &dyn Fn(&mut Candidate)| {
        let mut next = at.clone();
        change(&mut next);
        if next != *at && next.settings.check().is_ok() {
            out.push((name, next));
        }
    };
    for (i, set) in sets.iter().enumerate() {
        add(format!("{} anchors", set.positions.len()), &|c| c.anchors = i);
    }
    for n in [1, 2, 3] {
        add(format!("{n} layers"), &|c| c.settings.network.layers = n);
    }
    for n in [32, 64, 128] {
        add(format!("width {n}"), &|c| (c.settings.network.width, c.settings.network.feed_forward) = (n, 4 * n));
    }
    for n in [32, 64, 128] {
        add(format!("{n} query frequencies"), &|c| c.settings.network.bands = n);
    }
    for n in [0, 16, 32, 48] {
        add(format!("{n} taps"), &|c| c.settings.network.taps = n);
    }
    for n in [1, 2, 4] {
        add(format!("{n} tap shapes"), &|c| c.settings.network.tap_shapes = n);
    }
    add("no colours".to_owned(), &|c| c.settings.network.colour = false);
    out
}

/// Tries changes of `settings`, each with as many steps, one kind after the other, on clips that are kept back from the
/// training clips.
///
/// Of two networks the cheaper to decode is kept unless the other's error is lower by more than [`WORTH`]. Returns the best
/// anchor set and settings; `settings.steps` are as before.
///
/// # Errors
/// A capture, anchors or settings that [`Trainer::new`] refuses; weights that make no scene.
pub fn search(
    capture: &Capture,
    sets: &[AnchorSet],
    settings: &TrainSettings,
    steps: usize,
    (device, threads): (&Device, usize),
    each: &mut dyn FnMut(&Trial),
) -> Result<(usize, TrainSettings, Vec<Trial>), BakeError> {
    let mut clips: Vec<_> = capture.split(Split::Train).cloned().collect();
    for (i, clip) in clips.iter_mut().enumerate() {
        clip.split = if i % KEPT_BACK == KEPT_BACK - 1 { Split::Test } else { Split::Train };
    }
    let capture = Capture { clips, ..capture.clone() };
    let mut best = Candidate { settings: TrainSettings { steps, ..settings.clone() }, anchors: 0 };
    let responses = responses(&capture, settings);
    let measure = |candidate: &Candidate| -> Result<(Scores, f64), BakeError> {
        let (anchors, settings) = (&sets[candidate.anchors], candidate.settings.clone());
        let mut trainer =
            Trainer::with_responses(&capture, Arc::clone(&responses), anchors, settings, device.clone(), threads)?;
        while trainer.steps() < steps {
            let step = trainer.step();
            if !step.gradient_norm.is_finite() {
                let bad = Scores { mag: f64::INFINITY, lre_db: f64::INFINITY, env: f64::INFINITY };
                return Ok((bad, f64::INFINITY));
            }
        }
        Ok((trainer.look(Split::Test), decode_s(&trainer)?))
    };
    let (mut score, mut cost) = measure(&best)?;
    let first = Trial { change: "as set".to_owned(), scores: score, decode_s: cost, error: 1.0, kept: true };
    each(&first);
    let mut trials = vec![first];
    let mut tried = vec![best.clone()];
    // The kinds of change in turn, each from the best of those before.
    while let Some((change, next)) =
        changes(&best, sets).into_iter().find(|(_, c)| !tried.contains(c)).filter(|_| trials.len() < MOST_TRIALS)
    {
        tried.push(next.clone());
        let (scores, decode_s) = measure(&next)?;
        let error = (scores.mag / score.mag + scores.lre_db / score.lre_db + scores.env / score.env) / 3.0;
        let kept = if decode_s < cost { error < 1.0 + WORTH } else { error < 1.0 - WORTH };
        let trial = Trial { change, scores, decode_s, error, kept };
        each(&trial);
        trials.push(trial);
        if kept {
            (best, score, cost) = (next, scores, decode_s);
        }
    }
    Ok((best.anchors, TrainSettings { steps: settings.steps, ..best.settings }, trials))
}

/// Median processor seconds of decoding a pose, as the plugin would.
fn decode_s(trainer: &Trainer<'_>) -> Result<f64, BakeError> {
    let scene = trainer.scene(Provenance::default()).map_err(|e| BakeError::argument("weights after a trial", "a scene", e))?;
    let scene = Arc::new(scene);
    let Some(mut decoder) = CloudDecoder::new(&scene) else { return Ok(0.0) };
    let mut answer = decoder.blank();
    let mut times = Vec::with_capacity(DECODES);
    for _ in 0..DECODES {
        let began = ThreadTime::now();
        decoder.decode(&scene.start_pose(), &mut answer);
        times.push(began.elapsed().as_secs_f64());
    }
    times.sort_by(f64::total_cmp);
    Ok(times[DECODES / 2])
}
