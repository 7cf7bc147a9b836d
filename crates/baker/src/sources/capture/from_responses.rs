//! Captures of measured or simulated rooms: dry sound convolved with responses.

use super::sift::sift;
use super::{Capture, Clip, Emitter, Split, SplitRule, Track, Voice, level_dbfs};
use crate::bake::layout::{Layout, SAME_PLACE_M};
use crate::signal::convolve::convolve;
use crate::{BakeError, Responses, resample};
use promenade_core::random::Random;
use promenade_core::{CameraPath, Keyframe, Pose};
use std::collections::HashMap;

/// Stretches that are tried for each response before a quiet one is taken.
const TRIES: usize = 64;
/// A stretch is worth taking where its clips are at most this far below the whole sound, dB.
const QUIET_DB: f64 = 12.0;

/// A dry sound that is convolved.
#[derive(Clone, Debug, PartialEq)]
pub struct DrySound {
    /// Name, for the notes.
    pub name: String,
    /// Samples per second.
    pub sample_rate_hz: u32,
    /// The sound, full scale 1.
    pub samples: Vec<f32>,
}

/// Choices of [`from_responses`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FromResponses {
    /// Samples per second of the capture; without it the responses' own.
    pub sample_rate_hz: Option<u32>,
    /// Length of a clip, seconds.
    pub clip_s: f64,
    /// Clips of each response, one after another in one track.
    pub clips: usize,
    /// Dry sound before the first clip of a track, seconds: at least this, and at least as long as a response.
    pub pre_roll_s: f64,
    /// Share of the responses whose clips are for testing, in [0, 1], of those for which the data set does not say it.
    pub test_share: f64,
    /// Seed of the choice of stretches and of the split.
    pub seed: u64,
}

impl Default for FromResponses {
    fn default() -> Self {
        Self { sample_rate_hz: None, clip_s: 1.0, clips: 1, pre_roll_s: 1.0, test_share: 0.2, seed: 1 }
    }
}

/// Makes a capture of responses: each is convolved with a stretch of dry sound that is chosen by the seed, and becomes a track
/// with one pose. The room's answer to what came before the stretch is in it.
///
/// Emitter and poses are those of the scene that [`crate::bake_responses`] makes of the same responses; several sources around
/// several listeners are as many emitters. The level is that of such a scene too: the loudest ear has unit energy. Test
/// clips are at poses of which there is no training clip. Where the data set has a split, that is kept.
///
/// # Errors
/// Options out of range, a dry sound shorter than a clip, a listener in the place of a source, or nothing but silence.
pub fn from_responses(responses: &Responses, dry: &[DrySound], options: &FromResponses) -> Result<Capture, BakeError> {
    check(options)?;
    let placed = Placed::of(responses)?;
    let from_hz = whole_rate(responses.sample_rate_hz)?;
    let rate_hz = options.sample_rate_hz.unwrap_or(from_hz);
    let rate = f64::from(rate_hz);
    let clip = in_samples(options.clip_s, rate).max(1);
    let sounds = sounds(dry, options, rate_hz, clip)?;
    let level = unit_level(responses);
    let (splits, kept) = splits(responses, options);
    let mut chooser = Chooser { sounds: &sounds, clip, clips: options.clips, random: Random::new(options.seed ^ 0x5EED) };
    let mut names = HashMap::<String, usize>::new();
    let (mut tracks, mut clips) = (Vec::new(), Vec::new());
    let places = placed.poses.iter().zip(&placed.numbers);
    for ((response, (pose, number)), split) in responses.responses.iter().zip(places).zip(splits) {
        let ears = resample::response(&[response.left.clone(), response.right.clone()], from_hz, rate_hz)?;
        let [left, right] = [&ears[0], &ears[1]];
        let (sound, start) = chooser.stretch();
        let pre_roll = in_samples(options.pre_roll_s, rate).max(left.len()).min(start);
        let end = start + clip * options.clips;
        // What sounds in the track but began before it.
        let past = left.len().min(start - pre_roll);
        let wet = convolve(&sound[start - pre_roll - past..end], [left, right]);
        let binaural = wet.map(|ear| ear[past..past + end - (start - pre_roll)].iter().map(|v| level * v).collect());
        let count = names.entry(response.name.clone()).or_default();
        *count += 1;
        let name = if *count == 1 { response.name.clone() } else { format!("{} ({count})", response.name) };
        for number in 0..options.clips {
            let name = format!("{name}-{:02}", number + 1);
            clips.push(Clip { name, track: tracks.len(), start: pre_roll + number * clip, len: clip, pose: *pose, split });
        }
        let path = CameraPath::new(vec![Keyframe { t_s: 0.0, pose: *pose }])
            .map_err(|e| BakeError::argument("pose of a response", "a finite pose", e))?;
        let voices = vec![Voice { emitter: Some(*number), dry: sound[start - pre_roll..end].to_vec() }];
        tracks.push(Track { name, voices, binaural, path });
    }
    let names: Vec<&str> = dry.iter().map(|d| d.name.as_str()).collect();
    let mut notes = responses.notes.clone();
    notes.extend(placed.notes);
    if kept > 0 {
        notes.push(format!("{kept} of {} responses are split as the data set has it", responses.responses.len()));
    }
    notes.push(format!("made of {} responses and dry sound: {}", responses.responses.len(), names.join(", ")));
    let mut capture = Capture {
        title: responses.title.clone(),
        credit: responses.credit.clone(),
        licence: responses.licence.clone(),
        sample_rate_hz: rate,
        emitters: placed.emitters,
        tracks,
        clips,
        notes,
    };
    sift(&mut capture, &[]);
    if capture.clips.is_empty() {
        return Err(BakeError::argument("dry sound and responses", "at least one clip with sound", capture.notes.join("; ")));
    }
    Ok(capture)
}

/// The gain with which the loudest ear has unit energy, at the responses' own rate, where the baker takes the level of its
/// scene.
fn unit_level(responses: &Responses) -> f32 {
    let ears = responses.responses.iter().flat_map(|r| [&r.left, &r.right]);
    let energy = ears.map(|h| h.iter().map(|&v| f64::from(v) * f64::from(v)).sum::<f64>()).fold(0.0, f64::max);
    (1.0 / energy.max(1e-30).sqrt()) as f32
}

/// Dry sounds at a rate, each as long as the clips of `clip` samples that one response has.
fn sounds(dry: &[DrySound], options: &FromResponses, rate_hz: u32, clip: usize) -> Result<Vec<Vec<f32>>, BakeError> {
    if dry.is_empty() {
        return Err(BakeError::argument("dry sound", "at least one", "none"));
    }
    let converted = dry.iter().map(|sound| {
        let converted = resample::signal(std::slice::from_ref(&sound.samples), sound.sample_rate_hz, rate_hz)?;
        let samples = converted.into_iter().next().unwrap_or_default();
        if samples.len() < clip * options.clips {
            let seconds = samples.len() as f64 / f64::from(rate_hz);
            let expected = format!("at least {} s, the clips of one response", options.clip_s * options.clips as f64);
            return Err(BakeError::argument("dry sound", expected, format!("{seconds:.3} s in {}", sound.name)));
        }
        Ok(samples)
    });
    converted.collect()
}

/// Emitters and listeners of responses.
struct Placed {
    emitters: Vec<Emitter>,
    /// Of each response: the listener, and the number of its emitter.
    poses: Vec<Pose>,
    numbers: Vec<usize>,
    notes: Vec<String>,
}

impl Placed {
    fn of(responses: &Responses) -> Result<Self, BakeError> {
        let all = &responses.responses;
        let mut sources: Vec<Emitter> = Vec::new();
        let numbers: Vec<usize> = all.iter().map(|r| Emitter::numbered(&mut sources, r.source)).collect();
        let moves = all.iter().any(|r| r.listener.position.distance(all[0].listener.position) >= SAME_PLACE_M);
        if sources.len() < 2 || !moves {
            let Layout { emitter, poses, notes, .. } = Layout::of(responses)?;
            return Ok(Self { emitters: vec![Emitter::at(emitter)], numbers: vec![0; poses.len()], poses, notes });
        }
        Ok(Self {
            notes: vec![format!("{} sources, each an emitter of its own", sources.len())],
            poses: all.iter().map(|r| r.listener).collect(),
            emitters: sources,
            numbers,
        })
    }
}

/// The data set's own split where it has one, else by choice; and for how many it has.
fn splits(responses: &Responses, options: &FromResponses) -> (Vec<Split>, usize) {
    let own: Vec<Option<Split>> = responses.responses.iter().map(|r| responses.splits.get(&r.name).copied()).collect();
    let open = own.iter().filter(|split| split.is_none()).count();
    let mut chosen = SplitRule::Share { test: options.test_share, seed: options.seed }.splits(open).into_iter();
    let kept = own.len() - open;
    (own.into_iter().map(|split| split.or_else(|| chosen.next()).unwrap_or(Split::Train)).collect(), kept)
}

/// Chooses stretches of dry sound.
struct Chooser<'a> {
    sounds: &'a [Vec<f32>],
    clip: usize,
    clips: usize,
    random: Random,
}

impl Chooser<'_> {
    /// A sound and the first sample of a stretch none of whose clips is quiet, if there is one to be found. Long sounds are
    /// chosen as much more often as they are longer.
    fn stretch(&mut self) -> (&[f32], usize) {
        let len = self.clip * self.clips;
        let places: Vec<usize> = self.sounds.iter().map(|s| s.len() - len + 1).collect();
        let all: usize = places.iter().sum();
        let mut best = (f64::NEG_INFINITY, 0, 0);
        for _ in 0..TRIES {
            // Two draws: one has 24 bits only.
            let fraction = f64::from(self.random.uniform()) + f64::from(self.random.uniform()) / 16_777_216.0;
            let mut place = ((fraction * all as f64) as usize).min(all - 1);
            let mut number = 0;
            while place >= places[number] {
                place -= places[number];
                number += 1;
            }
            let sound = &self.sounds[number];
            let quietest = sound[place..place + len].chunks(self.clip).map(level_dbfs).fold(f64::INFINITY, f64::min);
            let below = quietest - level_dbfs(sound);
            if below > best.0 {
                best = (below, number, place);
            }
            if below >= -QUIET_DB {
                break;
            }
        }
        (&self.sounds[best.1], best.2)
    }
}

fn check(options: &FromResponses) -> Result<(), BakeError> {
    if let Some(rate) = options.sample_rate_hz
        && !crate::sound::SAMPLE_RATES_HZ.contains(&rate)
    {
        return Err(BakeError::argument("sample rate", "1000 to 1000000 Hz", rate));
    }
    for (what, value, low, high) in [
        ("length of a clip, seconds", options.clip_s, 0.01, 600.0),
        ("pre-roll, seconds", options.pre_roll_s, 0.0, 60.0),
        ("share of test clips", options.test_share, 0.0, 1.0),
    ] {
        if !(low..=high).contains(&value) {
            return Err(BakeError::argument(what, format!("{low} to {high}"), value));
        }
    }
    if !(1..=10_000).contains(&options.clips) {
        return Err(BakeError::argument("clips of a response", "1 to 10000", options.clips));
    }
    Ok(())
}

/// A rate that files can have.
fn whole_rate(rate: f64) -> Result<u32, BakeError> {
    let whole = Some(rate as u32).filter(|whole| f64::from(*whole) == rate && *whole > 0);
    whole.ok_or_else(|| BakeError::argument("sample rate", "a whole number of hertz", rate))
}

fn in_samples(seconds: f64, rate: f64) -> usize {
    (seconds * rate).round() as usize
}
