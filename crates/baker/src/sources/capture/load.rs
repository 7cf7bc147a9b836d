//! From a manifest and its files to a capture.

use super::cut::{Cut, SplitRule};
use super::manifest::{ClipEntry, CutEntry, Manifest, TrackEntry};
use super::sift::sift;
use super::{Capture, Clip, Emitter, Split, Track, Voice, mean};
use crate::{BakeError, file, sound};
use promenade_core::glam::Vec3;
use promenade_core::{CameraPath, Keyframe};
use promenade_paths::{ImportOptions, MAX_FILE_BYTES};
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// Files of a track that should be of one length may differ by this, seconds, besides the offset between them.
const LENGTH_SLACK_S: f64 = 0.1;
/// Offsets that are believed, seconds.
const MAX_OFFSET_S: f64 = 3600.0;

pub(super) fn load(path: &Path) -> Result<Capture, BakeError> {
    let manifest = Manifest::read(path)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut defects = Vec::new();
    if manifest.tracks.is_empty() {
        defects.push("expected at least one track, found none".to_owned());
    }
    let emitters = emitters(&manifest, &mut defects);
    let mut notes = manifest.notes.clone();
    let mut tracks = Vec::new();
    let mut names = HashSet::new();
    for entry in &manifest.tracks {
        if !names.insert(&entry.name) {
            defects.push(format!("track {}: its name is there twice", entry.name));
        }
        let loader = TrackLoader { folder, rate_hz: manifest.sample_rate_hz, entry, emitters: &emitters };
        match loader.load(&mut notes) {
            Ok(track) => tracks.push(track),
            Err(wrong) => defects.extend(wrong.into_iter().map(|w| format!("track {}: {w}", entry.name))),
        }
    }
    let rate = f64::from(manifest.sample_rate_hz);
    let whole = defects.is_empty();
    let clips = match (&manifest.clips, &manifest.cut) {
        (Some(_), Some(_)) => Err(vec!["expected \"clips\" or \"cut\", found both".to_owned()]),
        // Where tracks are missing, what clips say of them cannot be judged.
        _ if !whole => Ok(Vec::new()),
        (Some(clips), None) => listed(clips, &tracks),
        (None, cut) => rule(cut.as_ref()).map(|rule| cut_all(&tracks, rate, &rule)),
    };
    let clips = match clips {
        Ok(clips) => clips,
        Err(wrong) => {
            defects.extend(wrong);
            Vec::new()
        }
    };
    if !defects.is_empty() {
        return Err(BakeError::new(format!("{}: {}", path.display(), defects.join("; "))));
    }
    let (tracks, first_dry): (Vec<Track>, Vec<usize>) = tracks.into_iter().map(|t| (t.track, t.first_dry)).unzip();
    let mut capture = Capture {
        title: manifest.title,
        credit: manifest.credit,
        licence: manifest.licence,
        sample_rate_hz: rate,
        emitters,
        tracks,
        clips,
        notes,
    };
    sift(&mut capture, &first_dry);
    if capture.clips.is_empty() {
        let why = capture.notes.join("; ");
        let found = if why.is_empty() { "tracks shorter than a clip".to_owned() } else { why };
        return Err(BakeError::content(path, "at least one clip with sound and a pose", found));
    }
    Ok(capture)
}

/// The emitters of a manifest, with one defect for each thing that is wrong with them.
fn emitters(manifest: &Manifest, defects: &mut Vec<String>) -> Vec<Emitter> {
    let unnamed = manifest.emitter.map(|position| Emitter::at(Vec3::from_array(position)));
    let named = manifest.emitters.iter().map(|e| Emitter {
        name: e.name.clone(),
        position: Vec3::from_array(e.position),
        facing_deg: e.facing,
    });
    if unnamed.is_some() && !manifest.emitters.is_empty() {
        defects.push("expected \"emitter\" or \"emitters\", found both".to_owned());
    }
    let mut names = HashSet::new();
    for entry in &manifest.emitters {
        if entry.name.is_empty() || !names.insert(&entry.name) {
            defects.push(format!("emitters: expected a different name for each, found \"{}\" again or no name", entry.name));
        }
    }
    let all: Vec<Emitter> = unnamed.into_iter().chain(named).collect();
    for emitter in &all {
        if !(emitter.position.is_finite() && emitter.facing_deg.iter().flatten().all(|v| v.is_finite())) {
            defects.push(format!("emitter \"{}\": expected a finite position and facing", emitter.name));
        }
    }
    all
}

/// A track with what is known of it while it is loaded.
struct Loaded {
    track: Track,
    /// First sample at which there is dry sound.
    first_dry: usize,
}

struct TrackLoader<'a> {
    folder: &'a Path,
    rate_hz: u32,
    entry: &'a TrackEntry,
    emitters: &'a [Emitter],
}

impl TrackLoader<'_> {
    /// The track, or all that is wrong with it.
    fn load(&self, notes: &mut Vec<String>) -> Result<Loaded, Vec<String>> {
        let mut wrong = Vec::new();
        let playing = self.playing().map_err(|w| wrong.push(w)).ok();
        let voices = playing.as_ref().map_or(1, Vec::len);
        let mut kept = |what: Result<_, String>| what.map_err(|w| wrong.push(w)).ok();
        let dry = kept(self.sound(&self.entry.dry, voices));
        let binaural = kept(self.sound(&self.entry.binaural, 2));
        let path = self.path(notes).map_err(|w| wrong.push(w)).ok();
        for (name, value) in [("dry_offset_s", self.entry.dry_offset_s), ("pose_offset_s", self.entry.pose_offset_s)] {
            if !(-MAX_OFFSET_S..=MAX_OFFSET_S).contains(&value) {
                wrong.push(format!("{name}: expected at most {MAX_OFFSET_S} s, found {value}"));
            }
        }
        let (Some(playing), Some(dry), Some(binaural), Some(path)) = (playing, dry, binaural, path) else { return Err(wrong) };
        if !wrong.is_empty() {
            return Err(wrong);
        }
        self.align((playing, dry), binaural, path).map_err(|w| vec![w])
    }

    /// The numbers of the emitters that play in the track: one for each channel of its dry sound.
    fn playing(&self) -> Result<Vec<Option<usize>>, String> {
        let names = || self.emitters.iter().map(|e| e.name.as_str()).collect::<Vec<_>>().join(", ");
        match (&self.entry.emitters[..], self.emitters) {
            ([], []) => Ok(vec![None]),
            ([], [_]) => Ok(vec![Some(0)]),
            ([], _) => Err(format!("expected the names of the emitters that play, of {}, found none", names())),
            (wanted, _) => wanted
                .iter()
                .map(|name| match self.emitters.iter().position(|e| e.name == *name) {
                    Some(number) => Ok(Some(number)),
                    None => Err(format!("expected an emitter of {}, found \"{name}\"", names())),
                })
                .collect(),
        }
    }

    /// A file's channels: as many as are wanted, or for a dry track the mean of all.
    fn sound(&self, name: &str, channels: usize) -> Result<Vec<Vec<f32>>, String> {
        let file: PathBuf = self.folder.join(name);
        let (shown, rate_hz) = (file.display(), self.rate_hz);
        let sound = sound::read(&file).map_err(|e| with_cause(&e))?;
        if sound.sample_rate_hz != rate_hz {
            return Err(format!("{shown}: expected {rate_hz} Hz as the manifest says, found {} Hz", sound.sample_rate_hz));
        }
        match sound.channels.len() {
            count if count == channels => Ok(sound.channels),
            _ if channels == 1 => Ok(vec![mean(&sound.channels)]),
            count => Err(format!("{shown}: expected {channels} channels, found {count}")),
        }
    }

    fn path(&self, notes: &mut Vec<String>) -> Result<CameraPath, String> {
        let keyframes = match (&self.entry.path, &self.entry.poses) {
            (Some(name), None) => {
                let file = self.folder.join(name);
                let bytes = file::open(&file)
                    .and_then(|mut file| promenade_paths::bytes_of(&mut file))
                    .map_err(|e| format!("{}: cannot be read: {e}", file.display()))?;
                let folder = file.parent().unwrap_or(Path::new(""));
                let mut beside = |uri: &str| file::read(&folder.join(uri), MAX_FILE_BYTES);
                let shown = file.display().to_string();
                let imported = promenade_paths::read(&shown, &bytes, &ImportOptions::default(), &mut beside);
                let imported = imported.map_err(|e| with_cause(&e))?;
                notes.extend(imported.notes.iter().map(|n| format!("track {}: {n}", self.entry.name)));
                imported.path.keyframes().to_vec()
            }
            (None, Some(entries)) => {
                let keyframes = entries.iter().enumerate().map(|(i, e)| e.to_keyframe(i));
                keyframes.collect::<Result<_, _>>().map_err(|e| e.to_string())?
            }
            (both, _) => {
                let found = if both.is_some() { "both" } else { "neither" };
                return Err(format!("expected \"path\" or \"poses\", found {found}"));
            }
        };
        let later = |k: Keyframe| Keyframe { t_s: k.t_s + self.entry.pose_offset_s, ..k };
        CameraPath::new(keyframes.into_iter().map(later).collect()).map_err(|e| e.to_string())
    }

    /// Shifts the dry sound and cuts both to where both are.
    fn align(
        &self,
        (playing, mut dry): (Vec<Option<usize>>, Vec<Vec<f32>>),
        binaural: Vec<Vec<f32>>,
        path: CameraPath,
    ) -> Result<Loaded, String> {
        let rate = f64::from(self.rate_hz);
        let (dry_len, heard_len) = (dry[0].len(), binaural[0].len());
        let apart = dry_len.abs_diff(heard_len) as f64 / rate;
        if apart > LENGTH_SLACK_S + self.entry.dry_offset_s.abs() {
            let [dry_s, heard_s] = [dry_len, heard_len].map(|len| len as f64 / rate);
            return Err(format!("expected dry and binaural sound of one length, found {dry_s:.3} s and {heard_s:.3} s"));
        }
        let shift = (self.entry.dry_offset_s * rate).round() as i64;
        let by = usize::try_from(shift.unsigned_abs()).unwrap_or(usize::MAX);
        let first_dry = if shift > 0 { by } else { 0 };
        for voice in &mut dry {
            if shift > 0 {
                voice.splice(0..0, std::iter::repeat_n(0.0, by));
            } else {
                voice.drain(..by.min(voice.len()));
            }
        }
        let len = dry[0].len().min(heard_len);
        if len <= first_dry {
            return Err(format!(
                "expected dry and binaural sound at the same time, found none with an offset of {shift} samples"
            ));
        }
        dry.iter_mut().for_each(|voice| voice.truncate(len));
        let Ok([mut left, mut right]) = <[Vec<f32>; 2]>::try_from(binaural) else {
            return Err("expected two ears".to_owned());
        };
        left.truncate(len);
        right.truncate(len);
        let voices = playing.into_iter().zip(dry).map(|(emitter, dry)| Voice { emitter, dry }).collect();
        let track = Track { name: self.entry.name.clone(), voices, binaural: [left, right], path };
        Ok(Loaded { track, first_dry })
    }
}

/// An error with its cause, in one line.
fn with_cause(error: &dyn std::error::Error) -> String {
    error.source().map_or_else(|| error.to_string(), |cause| format!("{error}: {cause}"))
}

fn listed(entries: &[ClipEntry], tracks: &[Loaded]) -> Result<Vec<Clip>, Vec<String>> {
    let mut wrong = Vec::new();
    let mut clips = Vec::new();
    let mut names = HashSet::new();
    for entry in entries {
        let mut say = |what: String| wrong.push(format!("clip {}: {what}", entry.name));
        if !names.insert(&entry.name) {
            say("its name is there twice".to_owned());
        }
        let Some(track) = tracks.iter().position(|t| t.track.name == entry.track) else {
            say(format!("expected the name of a track, found \"{}\"", entry.track));
            continue;
        };
        let whole = tracks[track].track.samples();
        if entry.len == 0 || entry.start.checked_add(entry.len).is_none_or(|end| end > whole) {
            say(format!("expected samples of the {whole} in track {}, found {} from {}", entry.track, entry.len, entry.start));
            continue;
        }
        // Its pose comes when all clips are known.
        let pose = promenade_core::Pose::IDENTITY;
        clips.push(Clip { name: entry.name.clone(), track, start: entry.start, len: entry.len, pose, split: entry.split });
    }
    if wrong.is_empty() { Ok(clips) } else { Err(wrong) }
}

fn rule(entry: Option<&CutEntry>) -> Result<Cut, Vec<String>> {
    let Some(entry) = entry else { return Ok(Cut::default()) };
    let wrong = |what: String| Err(vec![format!("cut: {what}")]);
    if !(0.01..=3600.0).contains(&entry.clip_s) {
        return wrong(format!("expected clips of 0.01 to 3600 s, found {}", entry.clip_s));
    }
    let split = match (entry.every, entry.test_share) {
        (Some(_), Some(_)) => return wrong("expected \"every\" or \"test_share\", found both".to_owned()),
        (Some(every), None) if every < 2 => return wrong(format!("expected every 2 clips or more, found {every}")),
        (Some(every), None) => SplitRule::Every(every),
        (None, Some(test)) if (0.0..=1.0).contains(&test) => SplitRule::Share { test, seed: entry.seed.unwrap_or(1) },
        (None, Some(test)) => return wrong(format!("expected a share from 0 to 1, found {test}")),
        (None, None) => SplitRule::default(),
    };
    Ok(Cut { clip_s: entry.clip_s, split })
}

/// All clips of all tracks by a rule; the rule counts on from track to track.
fn cut_all(tracks: &[Loaded], rate: f64, cut: &Cut) -> Vec<Clip> {
    let len = ((cut.clip_s * rate).round() as usize).max(1);
    let mut clips = Vec::new();
    for (track, Loaded { track: t, first_dry }) in tracks.iter().enumerate() {
        for (number, start) in (0..(t.samples() / len)).map(|n| n * len).enumerate().filter(|(_, s)| s >= first_dry) {
            let name = format!("{}-{:05}", t.name, number + 1);
            clips.push(Clip { name, track, start, len, pose: promenade_core::Pose::IDENTITY, split: Split::Train });
        }
    }
    let splits = cut.split.splits(clips.len());
    clips.iter_mut().zip(splits).for_each(|(clip, split)| clip.split = split);
    clips
}
