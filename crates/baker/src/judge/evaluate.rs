//! A scene against recordings that it was not made from, beside baselines. `docs/measuring.md` defines each figure and each
//! baseline.

mod baselines;
mod figure;
mod hrtf;
mod nearest;

pub use figure::{Figure, Figures};

use crate::capture::{DIRECT_PRE_ROLL_S, Emitter};
use crate::{BakeError, Capture, Clip, Responses, Split};
use baselines::baselines;
use promenade_core::Scene;
use promenade_core::glam::Vec3;
use promenade_player::{Ears, Player, Playing};
use std::sync::Arc;

/// Dry sound that is played before a clip, seconds, at least; as long as the scene's room sounds where that is more.
const PRE_ROLL_S: f64 = 1.0;
/// The most dry sound that is played before a clip, seconds.
const LONGEST_PRE_ROLL_S: f64 = 10.0;
/// Training clips that levels are fitted on, spread over all.
const FIT_CLIPS: usize = 64;
/// Emitters farther from each other than this, metres, are two.
const ANOTHER_EMITTER_M: f32 = 0.1;

/// Where the listener is while a clip of a capture is played.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Poses {
    /// Where the clip's middle was, for the whole clip and before it: as the published models take it.
    #[default]
    Fixed,
    /// On the track's path.
    Path,
}

/// How a scene is evaluated.
#[derive(Clone, Debug, Default)]
pub struct EvaluateOptions {
    /// How the scene is played.
    pub playing: Playing,
    /// Where the listener is while a clip is rendered.
    pub poses: Poses,
    /// Scale the scene by the one gain that gives the training clips their energy: for a scene whose level is not the
    /// capture's.
    pub fit_level: bool,
    /// Evaluate the baselines too.
    pub baselines: bool,
    /// Responses without a room, for the baseline of distance and HRTF; where they are not given, those of a rigid sphere.
    pub head: Option<Responses>,
}

/// Something that predicts what ears hear during a clip.
trait Method {
    /// Name in tables and files.
    fn name(&self) -> &'static str;
    /// What of the predicted recording it is given, besides the listener's pose and the dry sound.
    fn note(&self) -> &'static str {
        ""
    }
    /// Both ears, each as long as the clip or a little shorter.
    fn predict(&mut self, capture: &Capture, clip: &Clip) -> Result<Ears, BakeError>;
}

/// How well one method does on one capture.
#[derive(Clone, Debug, PartialEq)]
pub struct MethodResult {
    /// Name in tables and files; the scene's is "scene".
    pub name: String,
    /// What of the predicted recording the method is given; empty where nothing is.
    pub note: String,
    /// Figures of each test clip, by its name.
    pub clips: Vec<(String, Figures)>,
    /// Means over the clips that have a value.
    pub mean: Figures,
}

/// A scene on a capture.
#[derive(Clone, Debug, PartialEq)]
pub struct Evaluation {
    /// The scene's title.
    pub scene: String,
    /// The capture's title.
    pub capture: String,
    /// How the scene was played.
    pub playing: Playing,
    /// Samples per second of clips and figures.
    pub sample_rate_hz: f64,
    /// The scene, then the baselines.
    pub methods: Vec<MethodResult>,
    /// Levels that were fitted, baselines that were left out.
    pub notes: Vec<String>,
}

/// One method's prediction of one clip, beside the recording.
#[derive(Clone, Copy, Debug)]
pub struct ClipPair<'a> {
    /// Name of the method.
    pub method: &'a str,
    /// The clip.
    pub clip: &'a Clip,
    /// Left and right ear as the method predicts them.
    pub predicted: [&'a [f32]; 2],
    /// Left and right ear as they were recorded.
    pub recorded: [&'a [f32]; 2],
}

/// Compares a scene, and baselines where they are wanted, with the test clips of a capture.
///
/// Every clip is rendered by [`Player`] with at least a second of the dry sound before it, where the track has it.
///
/// # Errors
/// A capture without test clips, a scene without clips where they are wanted, or a rate that cannot be rendered.
pub fn evaluate(scene: &Arc<Scene>, capture: &Capture, options: &EvaluateOptions) -> Result<Evaluation, BakeError> {
    evaluate_each(scene, capture, options, &mut |_| Ok(()))
}

/// Compares a scene as [`evaluate`] does, and gives `each` everything that is compared, to be kept or shown.
///
/// # Errors
/// Those of [`evaluate`], and those of `each`.
pub fn evaluate_each(
    scene: &Arc<Scene>,
    capture: &Capture,
    options: &EvaluateOptions,
    each: &mut dyn FnMut(ClipPair<'_>) -> Result<(), BakeError>,
) -> Result<Evaluation, BakeError> {
    let tests: Vec<&Clip> = capture.split(Split::Test).collect();
    if tests.is_empty() {
        let found = format!("none among the {} of {}", capture.clips.len(), capture.title);
        return Err(BakeError::argument("capture", "at least one clip for testing", found));
    }
    let mut notes = Vec::new();
    let mut method = SceneMethod::new(scene, capture, options)?;
    let playing = method.players[0].playing();
    if method.players.len() == 1 {
        notes.extend(other_emitters(scene, capture, &tests));
    }
    let fit = fit_clips(capture);
    if options.fit_level {
        method.gain = fitted_gain(&mut method, capture, &fit)?;
        let gain_db = 20.0 * method.gain.log10();
        notes.push(format!("the scene's level was fitted on {} training clips: {gain_db:+.2} dB", fit.len()));
    }
    let mut methods: Vec<Box<dyn Method>> = vec![Box::new(method)];
    if options.baselines {
        methods.extend(baselines(capture, &fit, options.head.as_ref(), &mut notes)?);
    }
    let mut results = Vec::with_capacity(methods.len());
    for method in &mut methods {
        let mut clips = Vec::with_capacity(tests.len());
        for clip in &tests {
            let predicted = method.predict(capture, clip)?;
            let predicted = [&predicted[0][..], &predicted[1][..]];
            // Clips of the published model end with their last whole hop.
            let recorded = capture.binaural(clip).map(|ear| &ear[..predicted[0].len()]);
            each(ClipPair { method: method.name(), clip, predicted, recorded })?;
            let pre_roll = (DIRECT_PRE_ROLL_S * capture.sample_rate_hz) as usize;
            // Of a mix no response can be found.
            let dry = (!capture.is_mix(clip)).then(|| capture.dry(clip, pre_roll));
            let dry = dry.as_deref().map(|dry| (dry, pre_roll));
            clips.push((clip.name.clone(), Figures::of(predicted, recorded, dry, capture.sample_rate_hz)));
        }
        let mean = Figures::mean(clips.iter().map(|(_, f)| f));
        results.push(MethodResult { name: method.name().to_owned(), note: method.note().to_owned(), clips, mean });
    }
    Ok(Evaluation {
        scene: scene.title().to_owned(),
        capture: capture.title.clone(),
        playing,
        sample_rate_hz: capture.sample_rate_hz,
        methods: results,
        notes,
    })
}

/// Means over several evaluations, each counting once, of the methods that all of them have.
#[must_use]
pub fn overall(evaluations: &[Evaluation]) -> Vec<(String, Figures)> {
    let Some(first) = evaluations.first() else { return Vec::new() };
    let of = |e: &Evaluation, name: &str| e.methods.iter().find(|m| m.name == name).map(|m| m.mean);
    let all = |name: &str| evaluations.iter().map(|e| of(e, name)).collect::<Option<Vec<Figures>>>();
    first.methods.iter().filter_map(|m| Some((m.name.clone(), Figures::mean(all(&m.name)?.iter())))).collect()
}

/// A note for each emitter of test clips that is not the scene's.
fn other_emitters(scene: &Scene, capture: &Capture, tests: &[&Clip]) -> Vec<String> {
    let Some(own) = scene.emitter() else { return Vec::new() };
    let at = |p: Vec3| format!("{:.2}, {:.2}, {:.2}", p.x, p.y, p.z);
    let plays = |clip: &Clip, number| capture.tracks[clip.track].voices.iter().any(|voice| voice.emitter == Some(number));
    let of = |(number, emitter): (usize, &Emitter)| {
        let (heard, apart) = (emitter.position, own.distance(emitter.position));
        let clips = tests.iter().filter(|clip| plays(clip, number)).count();
        (apart > ANOTHER_EMITTER_M && clips > 0).then(|| {
            let (own, heard) = (at(own), at(heard));
            let judged = format!("in {clips} of {} test clips the scene is judged by another emitter's sound", tests.len());
            format!("the scene's emitter, at {own}, is {apart:.2} m from the capture's, at {heard}: {judged}")
        })
    };
    capture.emitters.iter().enumerate().filter_map(of).collect()
}

/// The scene itself.
struct SceneMethod {
    /// One, or one for each emitter of the capture where the scene's emitter can be moved there.
    players: Vec<Player>,
    poses: Poses,
    gain: f32,
}

impl SceneMethod {
    fn new(scene: &Arc<Scene>, capture: &Capture, options: &EvaluateOptions) -> Result<Self, BakeError> {
        let mut players = Vec::new();
        let all_known = capture.tracks.iter().flat_map(|t| &t.voices).all(|voice| voice.emitter.is_some());
        for emitter in capture.emitters.iter().filter(|_| all_known) {
            if let Some(moved) = scene.with_emitter(emitter.position)? {
                players.push(Player::new(&Arc::new(moved), capture.sample_rate_hz, options.playing)?);
            }
        }
        if players.is_empty() {
            players.push(Player::new(scene, capture.sample_rate_hz, options.playing)?);
        }
        Ok(Self { players, poses: options.poses, gain: 1.0 })
    }
}

impl Method for SceneMethod {
    fn name(&self) -> &'static str {
        "scene"
    }

    fn predict(&mut self, capture: &Capture, clip: &Clip) -> Result<Ears, BakeError> {
        let voices = &capture.tracks[clip.track].voices;
        let mut ears = match &mut self.players[..] {
            [only] => heard(only, capture, clip, self.poses, |pre_roll| capture.dry(clip, pre_roll))?,
            players => {
                let mut sum: Ears = [vec![0.0; clip.len], vec![0.0; clip.len]];
                for voice in voices {
                    let player = &mut players[voice.emitter.unwrap_or(0)];
                    let dry = |pre_roll| clip.stretch(&voice.dry, pre_roll);
                    add(&mut sum, heard(player, capture, clip, self.poses, dry)?);
                }
                sum
            }
        };
        ears.iter_mut().flatten().for_each(|v| *v *= self.gain);
        Ok(ears)
    }
}

/// Both ears of a clip of a capture that `dry` gives the sound of, after so many samples before it. A stream's are as long as
/// the clip, and the dry sound before it is heard too; those of the published model end with the clip's last whole hop.
fn heard(
    player: &mut Player,
    capture: &Capture,
    clip: &Clip,
    poses: Poses,
    dry: impl Fn(usize) -> Vec<f32>,
) -> Result<Ears, BakeError> {
    if player.playing() == Playing::Clips {
        let ears = player.render_clip(&dry(0), &clip.pose);
        let expected = "one that the published model plays";
        return ears.map_err(|e| BakeError::argument("clip", expected, format!("'{}': {e}", clip.name)));
    }
    let rate_hz = capture.sample_rate_hz;
    let pre_roll = (player.tail_s().clamp(PRE_ROLL_S, LONGEST_PRE_ROLL_S) * rate_hz).ceil() as usize;
    let began_s = (clip.start as f64 - pre_roll as f64) / rate_hz;
    let path = &capture.tracks[clip.track].path;
    let ears = player.render(&dry(pre_roll), &mut |seconds| match poses {
        Poses::Fixed => clip.pose,
        Poses::Path => path.pose_at(began_s + seconds),
    })?;
    Ok(ears.map(|mut ear| ear.split_off(pre_roll)))
}

/// Training clips spread over all of them.
fn fit_clips(capture: &Capture) -> Vec<&Clip> {
    let train: Vec<&Clip> = capture.split(Split::Train).collect();
    let step = train.len().div_ceil(FIT_CLIPS).max(1);
    train.into_iter().step_by(step).collect()
}

/// Adds what another source gives both ears; both end with the shorter.
fn add(sum: &mut Ears, more: Ears) {
    for (sum, more) in sum.iter_mut().zip(more) {
        sum.truncate(more.len());
        sum.iter_mut().zip(more).for_each(|(sum, x)| *sum += x);
    }
}

fn energy(ears: [&[f32]; 2]) -> f64 {
    ears.into_iter().flatten().map(|&v| f64::from(v) * f64::from(v)).sum()
}

/// The gain that gives a method the energy of the recordings, all clips and both ears together; 1 where there is nothing to
/// fit.
fn fitted_gain(method: &mut dyn Method, capture: &Capture, clips: &[&Clip]) -> Result<f32, BakeError> {
    let (mut wanted, mut given) = (0.0, 0.0);
    for clip in clips {
        let predicted = method.predict(capture, clip)?;
        given += energy([&predicted[0], &predicted[1]]);
        wanted += energy(capture.binaural(clip));
    }
    let gain = (wanted / given).sqrt() as f32;
    Ok(if gain.is_finite() && gain > 0.0 { gain } else { 1.0 })
}
