//! The sources of a capture, and what they played.

use super::{Capture, Clip, Split, defects};
use crate::BakeError;
use crate::bake::layout::SAME_PLACE_M;
use promenade_core::glam::Vec3;

/// A source of sound.
#[derive(Clone, Debug, PartialEq)]
pub struct Emitter {
    /// Name, different from that of every other; empty where a capture has one emitter and does not name it.
    pub name: String,
    /// Position, world metres.
    pub position: Vec3,
    /// Yaw and pitch of where it faces, degrees, positive to the left and up, where that is known.
    pub facing_deg: Option<[f32; 2]>,
}

impl Emitter {
    /// An emitter without a name.
    #[must_use]
    pub fn at(position: Vec3) -> Self {
        Self { name: String::new(), position, facing_deg: None }
    }

    /// The number of the source at a place, world metres, which is added by the name of its number where it is a new one.
    pub fn numbered(sources: &mut Vec<Self>, at: Vec3) -> usize {
        sources.iter().position(|s| s.position.distance(at) < SAME_PLACE_M).unwrap_or_else(|| {
            sources.push(Self { name: format!("source {}", sources.len() + 1), ..Self::at(at) });
            sources.len() - 1
        })
    }
}

/// What one source played throughout a track.
#[derive(Clone, Debug, PartialEq)]
pub struct Voice {
    /// Number of the emitter, where it is known which one it was.
    pub emitter: Option<usize>,
    /// Its dry sound, full scale 1.
    pub dry: Vec<f32>,
}

impl Capture {
    /// Where the sound came from, world metres, where there is one emitter and it is known.
    #[must_use]
    pub fn emitter(&self) -> Option<Vec3> {
        if let [only] = &self.emitters[..] { Some(only.position) } else { None }
    }

    /// The number of the emitter that a clip is of; `None` where it is not known, and for a mix.
    ///
    /// # Panics
    /// When the clip is not one of this capture.
    #[must_use]
    pub fn emitter_of(&self, clip: &Clip) -> Option<usize> {
        if let [only] = &self.tracks[clip.track].voices[..] { only.emitter } else { None }
    }

    /// Whether several sources play in a clip's track.
    ///
    /// # Panics
    /// When the clip is not one of this capture.
    #[must_use]
    pub fn is_mix(&self, clip: &Clip) -> bool {
        self.tracks[clip.track].voices.len() > 1
    }

    /// What each source that sounds played during a clip and `pre_roll` samples before it, as [`Self::dry`] has it.
    ///
    /// # Panics
    /// When the clip is not one of this capture.
    #[must_use]
    pub fn voices(&self, clip: &Clip, pre_roll: usize) -> Vec<Voice> {
        let of = |voice: &Voice| Voice { emitter: voice.emitter, dry: clip.stretch(&voice.dry, pre_roll) };
        self.tracks[clip.track].voices.iter().map(of).filter(|voice| !defects::is_silent(&voice.dry)).collect()
    }

    /// Keeps clips for testing: all clips that one of these emitters plays in, and all of these tracks.
    ///
    /// # Errors
    /// Names that no emitter or track has, with those that there are.
    pub fn hold_out(&mut self, emitters: &[String], tracks: &[String]) -> Result<(), BakeError> {
        emitters.iter().try_for_each(|name| self.number_of(name).map(|_| ()))?;
        if let Some(found) = tracks.iter().find(|name| self.tracks.iter().all(|t| t.name != **name)) {
            let names: Vec<&String> = self.tracks.iter().map(|t| &t.name).collect();
            return Err(BakeError::argument("track", format!("one of {names:?}"), format!("{found:?}")));
        }
        let is_out = |track: &super::Track| {
            let played = |voice: &Voice| voice.emitter.is_some_and(|number| emitters.contains(&self.emitters[number].name));
            tracks.contains(&track.name) || track.voices.iter().any(played)
        };
        let out: Vec<bool> = self.tracks.iter().map(is_out).collect();
        self.clips.iter_mut().filter(|clip| out[clip.track]).for_each(|clip| clip.split = Split::Test);
        Ok(())
    }

    /// Leaves out the clips for testing that another emitter than one plays in.
    ///
    /// # Errors
    /// A name that no emitter has, with those that there are.
    pub fn judge_by(&mut self, emitter: &str) -> Result<(), BakeError> {
        let number = self.number_of(emitter)?;
        let alone: Vec<bool> = self.tracks.iter().map(|t| t.voices.iter().all(|v| v.emitter == Some(number))).collect();
        self.clips.retain(|clip| clip.split == Split::Train || alone[clip.track]);
        Ok(())
    }

    /// The number of the emitter of a name.
    ///
    /// # Errors
    /// A name that no emitter has, with those that there are.
    pub fn number_of(&self, emitter: &str) -> Result<usize, BakeError> {
        let names: Vec<&String> = self.emitters.iter().map(|e| &e.name).collect();
        let number = names.iter().position(|name| *name == emitter);
        number.ok_or_else(|| BakeError::argument("emitter", format!("one of {names:?}"), format!("{emitter:?}")))
    }

    /// Several captures of one place as one. An emitter of the same name and place is one emitter. Names of emitters, tracks
    /// and clips are told apart by their captures' titles where they have to be.
    ///
    /// # Errors
    /// No capture, captures of different sample rates, or emitters of one name at several places.
    pub fn join(captures: Vec<Self>) -> Result<Self, BakeError> {
        let mut captures = captures.into_iter();
        let Some(mut whole) = captures.next() else {
            return Err(BakeError::argument("captures", "at least one", "none"));
        };
        for next in captures {
            whole.append(next)?;
        }
        Ok(whole)
    }

    fn append(&mut self, next: Self) -> Result<(), BakeError> {
        if next.sample_rate_hz != self.sample_rate_hz {
            let expected = format!("the {} Hz of {}", self.sample_rate_hz, self.title);
            let found = format!("{} Hz in {}", next.sample_rate_hz, next.title);
            return Err(BakeError::argument("sample rate of a capture", expected, found));
        }
        let numbers = next.emitters.iter().map(|emitter| self.take(emitter, &next.title)).collect::<Result<Vec<_>, _>>()?;
        let apart = |taken: bool, name: String| if taken { format!("{} {name}", next.title) } else { name };
        let first = self.tracks.len();
        for track in next.tracks {
            let voice = |v: Voice| Voice { emitter: v.emitter.map(|number| numbers[number]), ..v };
            let voices = track.voices.into_iter().map(voice).collect();
            let name = apart(self.tracks.iter().any(|t| t.name == track.name), track.name);
            self.tracks.push(super::Track { name, voices, ..track });
        }
        for clip in next.clips {
            let name = apart(self.clips.iter().any(|c| c.name == clip.name), clip.name);
            self.clips.push(Clip { name, track: first + clip.track, ..clip });
        }
        self.notes.extend(next.notes);
        for (all, more) in [(&mut self.credit, next.credit), (&mut self.licence, next.licence)] {
            if !all.contains(&more) {
                *all = format!("{all}; {more}");
            }
        }
        Ok(())
    }

    /// The number of an emitter of another capture, which is added where there is none such.
    fn take(&mut self, emitter: &Emitter, title: &str) -> Result<usize, BakeError> {
        if let Some(same) = self.emitters.iter().position(|e| e.position == emitter.position && e.name == emitter.name) {
            return Ok(same);
        }
        let name = if emitter.name.is_empty() { title.to_owned() } else { emitter.name.clone() };
        if self.emitters.iter().any(|e| e.name == name) {
            let found = format!("{name:?} at several places");
            return Err(BakeError::argument("emitters of captures", "a name for each place", found));
        }
        self.emitters.push(Emitter { name, ..emitter.clone() });
        Ok(self.emitters.len() - 1)
    }
}
