//! Captures: what a listener's two ears heard of a known dry sound while walking through a place, cut into clips.
//!
//! On disk a capture is a folder with a `capture.json` and sound files, WAV or FLAC; `docs/captures.md` has the format. In
//! memory all tracks have one sample rate, the dry and the binaural sound of a track are aligned, and every clip has something
//! to hear in it: clips that are silent, clipped or without a pose are left out when a capture is loaded, with a note that
//! names them.

mod cut;
mod defects;
mod direct;
mod emitter;
mod emitters;
mod from_responses;
mod import;
mod load;
mod manifest;
mod reverberation;
mod rwavs;
mod sift;
mod write;

pub use crate::sources::Split;
pub use cut::{Cut, SplitRule};
pub use defects::{CLIPPED_RUN, SILENT_DBFS, is_clipped, is_silent, level_dbfs};
pub use direct::{DIRECT_PRE_ROLL_S, direct_sound};
pub use emitter::{EmitterEstimate, locate_emitter};
pub use emitters::{Emitter, Voice};
pub use from_responses::{DrySound, FromResponses, from_responses};
pub use import::{ImportCapture, mean};
pub use reverberation::reverberation_times;
pub use rwavs::import_rwavs;

use crate::BakeError;
use promenade_core::glam::Vec3;
use promenade_core::{CameraPath, Pose};
use std::path::{Path, PathBuf};

/// Recordings of one place. Loaded from a folder, or made of responses; training and evaluation read it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Capture {
    /// Name of the place.
    pub title: String,
    /// Who recorded it.
    pub credit: String,
    /// Terms of the data.
    pub licence: String,
    /// Samples per second of all tracks.
    pub sample_rate_hz: f64,
    /// Where the sound came from, as far as it is known.
    pub emitters: Vec<Emitter>,
    /// The recordings.
    pub tracks: Vec<Track>,
    /// The parts of the recordings that are used; none is silent or clipped.
    pub clips: Vec<Clip>,
    /// Notes to the user: what was left out, what was assumed.
    pub notes: Vec<String>,
}

/// One continuous recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// Name, different from that of every other track.
    pub name: String,
    /// What was played: one dry sound, or those of several sources that are heard together; all of one length.
    pub voices: Vec<Voice>,
    /// What the left and the right ear heard, each as long as the dry sounds and aligned with them.
    pub binaural: [Vec<f32>; 2],
    /// The listener over the track's seconds; one keyframe is a listener who stands still.
    pub path: CameraPath,
}

/// A part of a track.
#[derive(Clone, Debug, PartialEq)]
pub struct Clip {
    /// Name, different from that of every other clip.
    pub name: String,
    /// Number of its track.
    pub track: usize,
    /// First sample of the track.
    pub start: usize,
    /// Samples, at least 1; they end within the track.
    pub len: usize,
    /// The listener at the clip's middle.
    pub pose: Pose,
    /// What it is for.
    pub split: Split,
}

impl Track {
    /// Length of the recording.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.binaural[0].len()
    }
}

impl Clip {
    /// `pre_roll` samples of a track's sound before the clip, zeros before its start, then the clip's own.
    pub(crate) fn stretch(&self, sound: &[f32], pre_roll: usize) -> Vec<f32> {
        let before = pre_roll.min(self.start);
        let zeros = std::iter::repeat_n(0.0, pre_roll - before);
        zeros.chain(sound[self.start - before..self.start + self.len].iter().copied()).collect()
    }
}

impl Capture {
    /// Loads a folder with a `capture.json`, or such a file of any name ending in `.json`.
    ///
    /// Silent and clipped clips, and clips at times that the path does not cover, are left out; a note names them.
    ///
    /// # Errors
    /// One error that lists all that is wrong, by track and clip: files that are missing, damaged, of another rate or length
    /// than the others, samples that are not finite, paths that cannot be read, clips beyond their track. A manifest of another
    /// version or with unknown fields, and a capture of which no clip is left.
    pub fn load(path: &Path) -> Result<Self, BakeError> {
        load::load(&manifest_at(path)?)
    }

    /// Whether there is a capture at a path: a folder with a `capture.json`, or that file.
    #[must_use]
    pub fn is_one(path: &Path) -> bool {
        path.join(manifest::NAME).is_file() || path.file_name().is_some_and(|name| name == manifest::NAME)
    }

    /// Writes `capture.json` and 32-bit float WAV files into a folder, which is made where it does not exist.
    ///
    /// Each file is there whole or not at all, and the manifest comes last: an interrupted write leaves no capture, or the old
    /// one.
    ///
    /// # Errors
    /// A folder that cannot be written to, a rate that is no whole number of hertz, or samples that are not finite.
    pub fn write(&self, folder: &Path) -> Result<(), BakeError> {
        write::write(self, folder)
    }

    /// Puts an emitter's position, world metres, into the manifest of a capture on disk, whole or not at all; all else in it
    /// stays as it is.
    ///
    /// # Errors
    /// A manifest that cannot be read or written, or that has an emitter already, unless it is to be replaced.
    pub fn write_emitter(path: &Path, emitter: Vec3, replace: bool) -> Result<(), BakeError> {
        write::write_emitter(&manifest_at(path)?, emitter, replace)
    }

    /// The clips of one split, in order.
    pub fn split(&self, split: Split) -> impl Iterator<Item = &Clip> {
        self.clips.iter().filter(move |c| c.split == split)
    }

    /// `pre_roll` samples of dry sound before the clip, zeros before the track's start, then the clip's own; of a mix the sum
    /// of all voices.
    ///
    /// # Panics
    /// When the clip is not one of this capture.
    #[must_use]
    pub fn dry(&self, clip: &Clip, pre_roll: usize) -> Vec<f32> {
        let mut voices = self.tracks[clip.track].voices.iter().map(|voice| clip.stretch(&voice.dry, pre_roll));
        let mut sum = voices.next().unwrap_or_default();
        voices.for_each(|dry| sum.iter_mut().zip(dry).for_each(|(sum, x)| *sum += x));
        sum
    }

    /// What the ears heard during the clip.
    ///
    /// # Panics
    /// When the clip is not one of this capture.
    #[must_use]
    pub fn binaural(&self, clip: &Clip) -> [&[f32]; 2] {
        self.tracks[clip.track].binaural.each_ref().map(|ear| &ear[clip.start..clip.start + clip.len])
    }

    /// Seconds of the clip's middle on its track.
    #[must_use]
    pub fn middle_s(&self, clip: &Clip) -> f64 {
        (clip.start as f64 + 0.5 * clip.len as f64) / self.sample_rate_hz
    }

    /// The clip of the same length that begins so many samples later, earlier where negative, with what the ears heard then and
    /// the listener of its own middle: the augmentation of pi-AVAS (section 3.3), which shifts by up to 1 s.
    ///
    /// It stays within its track and reaches into no clip for testing that it does not reach into already; where nothing can be
    /// learnt from it, as where it is silent, it is the clip itself.
    ///
    /// # Panics
    /// When the clip is not one of this capture.
    #[must_use]
    pub fn shifted(&self, clip: &Clip, samples: isize) -> Clip {
        let tests = || self.split(Split::Test).filter(|test| test.track == clip.track);
        let end = clip.start + clip.len;
        let low = tests().map(|test| test.start + test.len).filter(|end| *end <= clip.start).max().unwrap_or(0);
        let high = tests().map(|test| test.start).filter(|start| *start >= end).min();
        let latest = high.unwrap_or(self.tracks[clip.track].samples()) - clip.len;
        let start = clip.start.saturating_add_signed(samples).clamp(low, latest);
        let shifted = Clip { name: format!("{}@{start}", clip.name), start, ..clip.clone() };
        if start == clip.start || !sift::is_useful(self, &shifted) {
            return clip.clone();
        }
        let pose = self.tracks[clip.track].path.pose_at(self.middle_s(&shifted));
        Clip { pose, ..shifted }
    }
}

/// The manifest of a folder, or the file itself.
fn manifest_at(path: &Path) -> Result<PathBuf, BakeError> {
    let meta = std::fs::metadata(path).map_err(BakeError::read(path))?;
    Ok(if meta.is_dir() { path.join(manifest::NAME) } else { path.to_path_buf() })
}
