//! The standalone program's dry track: a file that is played in place of the live input.

use crate::parameter::cast::{narrow, whole};
use crate::parameter::choices::LatencyChoice;
use crate::project::walk::SavedWalk;
use crate::worker::{flag::Flag, lock::lock};
use crossbeam_queue::ArrayQueue;
use nice_plug::prelude::Enum;
use promenade_audio::sound::Sound;
use promenade_audio::{FileError, resample, sound};
use promenade_fault::Fault;
use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, OnceLock};

/// The fade at a start or a stop, seconds.
const FADE_S: f64 = 0.005;

/// What [`Player::begin_at`] takes.
pub const LATENCIES: &str = "frame, 64 or none";

static PLAYER: OnceLock<Player> = OnceLock::new();

/// The process's player, if it was set up: in the standalone program only.
pub fn player() -> Option<&'static Player> {
    PLAYER.get()
}

/// Sets up the process's player.
pub fn set_up() -> &'static Player {
    PLAYER.get_or_init(Player::new)
}

/// A file at the rate of the sound card.
pub struct Track {
    channels: [Vec<f32>; 2],
    sample_rate_hz: f64,
}

/// What is played, and how. The window and the loader set it, the audio thread reads it.
pub struct Player {
    /// The file as it is on disk.
    source: Mutex<Option<Sound>>,
    walk: OnceLock<SavedWalk>,
    latency: OnceLock<LatencyChoice>,
    sample_rate_hz: AtomicU32,
    fresh: ArrayQueue<Box<Track>>,
    retired: ArrayQueue<Box<Track>>,
    /// Whether it plays.
    pub playing: Flag,
    /// Whether it stops at the end, instead of beginning anew.
    pub once: Flag,
}

impl Player {
    fn new() -> Self {
        Self {
            source: Mutex::new(None),
            walk: OnceLock::new(),
            latency: OnceLock::new(),
            sample_rate_hz: AtomicU32::new(0),
            fresh: ArrayQueue::new(1),
            retired: ArrayQueue::new(4),
            playing: Flag::default(),
            once: Flag::default(),
        }
    }

    /// Reads a WAV or FLAC file of one or two channels and plays it from its start.
    ///
    /// # Errors
    /// The file cannot be read, has more than two channels, or is longer than [`sound::MAX_SAMPLES`].
    pub fn open(&self, path: &Path) -> Result<(), FileError> {
        let wav = sound::read(path)?;
        if wav.channels.len() > 2 {
            return Err(FileError::content(path, "one or two channels", wav.channels.len().to_string()));
        }
        *lock(&self.source) = Some(wav);
        self.prepare()?;
        self.playing.set(true);
        Ok(())
    }

    /// Reads a camera path, along which an instance that is made from now on begins to walk, with the file.
    ///
    /// # Errors
    /// The file cannot be read or holds no camera path.
    pub fn follow(&self, path: &Path) -> Result<(), Fault> {
        let (walk, _) = SavedWalk::from_file(path)?;
        walk.to_walk()?;
        self.walk.get_or_init(|| walk);
        Ok(())
    }

    /// The camera path that an instance begins with.
    pub fn walk(&self) -> Option<&SavedWalk> {
        self.walk.get()
    }

    /// Takes the latency, one of [`LATENCIES`], with which an instance that is made from now on begins. Says whether there is
    /// one of that name.
    pub fn begin_at(&self, latency: &str) -> bool {
        let index = LatencyChoice::ids().and_then(|ids| ids.iter().position(|id| *id == latency));
        index.map(|index| self.latency.get_or_init(|| LatencyChoice::from_index(index))).is_some()
    }

    /// The latency that an instance begins with.
    pub fn latency(&self) -> LatencyChoice {
        self.latency.get().copied().unwrap_or(LatencyChoice::Frame)
    }

    /// Takes the sound card's rate, and makes the file ready for it.
    ///
    /// # Errors
    /// There is no conversion to that rate.
    pub fn set_rate(&self, sample_rate_hz: f64) -> Result<(), FileError> {
        let rate = whole(sample_rate_hz.round());
        if self.sample_rate_hz.swap(rate, Ordering::AcqRel) == rate { Ok(()) } else { self.prepare() }
    }

    fn prepare(&self) -> Result<(), FileError> {
        while self.retired.pop().is_some() {}
        let rate = self.sample_rate_hz.load(Ordering::Acquire);
        let source = lock(&self.source);
        let Some(source) = source.as_ref().filter(|_| rate > 0) else { return Ok(()) };
        let mut channels = resample::signal(&source.channels, source.sample_rate_hz, rate)?;
        let left = channels.swap_remove(0);
        let right = channels.pop().unwrap_or_else(|| left.clone());
        drop(self.fresh.force_push(Box::new(Track { channels: [left, right], sample_rate_hz: f64::from(rate) })));
        Ok(())
    }
}

/// The audio thread's end of the player: where it is in the track.
#[derive(Default)]
pub struct Playhead {
    track: Option<Box<Track>>,
    at: usize,
    gain: f32,
}

impl Playhead {
    /// Replaces a block of live input by the file. Returns the file's time at its first sample, seconds, and whether it plays;
    /// `None` without a file, when the input stays as it is.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn play(&mut self, player: &Player, left: &mut [f32], right: &mut [f32]) -> Option<(f64, bool)> {
        if let Some(track) = player.fresh.pop() {
            // The loader empties this queue before it makes another track.
            if let Some(old) = self.track.replace(track) {
                drop(player.retired.force_push(old));
            }
            self.at = 0;
        }
        let track = self.track.as_ref()?;
        let [first, second] = &track.channels;
        let playing = player.playing.is_on();
        let start_s = self.at as f64 / track.sample_rate_hz;
        let step = narrow(1.0 / (FADE_S * track.sample_rate_hz));
        for (l, r) in left.iter_mut().zip(right) {
            if self.at >= first.len() {
                if player.once.is_on() {
                    player.playing.set(false);
                    self.gain = 0.0;
                } else {
                    self.at = 0;
                }
            }
            self.gain = if playing { (self.gain + step).min(1.0) } else { (self.gain - step).max(0.0) };
            let runs = self.gain > 0.0;
            let sample = |channel: &[f32]| if runs { channel.get(self.at).copied().unwrap_or(0.0) * self.gain } else { 0.0 };
            (*l, *r) = (sample(first), sample(second));
            self.at += usize::from(runs);
        }
        Some((start_s, playing))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_audio::wav::{self, Format};
    use std::path::PathBuf;

    fn ramp_file(folder: &Path, frames: u16) -> PathBuf {
        let path = folder.join("ramp.wav");
        let ramp = (0..frames).map(|i| f32::from(i) / 65_536.0).collect::<Vec<_>>();
        wav::write(&path, 48_000, &[&ramp], Format::Float32).unwrap();
        path
    }

    fn block(playhead: &mut Playhead, player: &Player, len: usize) -> (Vec<f32>, Option<(f64, bool)>) {
        let (mut left, mut right) = (vec![9.0; len], vec![9.0; len]);
        let time = playhead.play(player, &mut left, &mut right);
        if time.is_some() {
            assert_eq!(left, right);
        }
        (left, time)
    }

    #[test]
    fn a_file_is_played_looped_and_stopped() {
        let folder = tempfile::tempdir().unwrap();
        let player = Player::new();
        let mut playhead = Playhead::default();
        assert_eq!(block(&mut playhead, &player, 4), (vec![9.0; 4], None), "live input stays");
        player.set_rate(48_000.0).unwrap();
        player.open(&ramp_file(folder.path(), 1000)).unwrap();
        let (out, time) = block(&mut playhead, &player, 600);
        assert_eq!(time, Some((0.0, true)));
        assert!((out[500] * 65_536.0 - 500.0).abs() < 0.1);
        let (out, _) = block(&mut playhead, &player, 600);
        assert!((out[500] * 65_536.0 - 100.0).abs() < 0.1, "it begins anew");
        player.once.set(true);
        block(&mut playhead, &player, 700);
        let (out, _) = block(&mut playhead, &player, 600);
        assert!((out[50] * 65_536.0 - 950.0).abs() < 0.1 && out[200] == 0.0);
        assert!(!player.playing.is_on(), "it stops at the end");
    }

    #[test]
    fn a_file_is_converted_to_the_cards_rate() {
        let folder = tempfile::tempdir().unwrap();
        let player = Player::new();
        player.open(&ramp_file(folder.path(), 48_000)).unwrap();
        player.set_rate(24_000.0).unwrap();
        let mut playhead = Playhead::default();
        let (out, _) = block(&mut playhead, &player, 12_000);
        assert!((out[11_000] * 65_536.0 - 22_000.0).abs() < 5.0);
    }

    #[test]
    fn an_instance_walks_along_the_path_that_it_is_started_with() {
        use crate::parameter::{Parameter, choices::Follow};
        use crate::project::params::PromenadeParams;
        let player = Player::new();
        let still = PromenadeParams::beginning_on(player.walk());
        assert_eq!(still.index(Parameter::Follow), Follow::Off.to_index());
        player.follow(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../presets/paths/loft.json"))).unwrap();
        let walking = PromenadeParams::beginning_on(player.walk());
        assert_eq!(walking.index(Parameter::Follow), Follow::Transport.to_index());
        assert!(walking.saved_walk.get().0.keyframes.len() > 10);
        let error = player.follow(Path::new("no/such.json")).unwrap_err().to_string();
        assert!(error.contains("such.json"), "{error}");
    }

    #[test]
    fn an_instance_begins_with_the_latency_that_it_is_started_with() {
        use crate::parameter::Parameter;
        use crate::project::params::PromenadeParams;
        let begun = |player: &Player| PromenadeParams::default().beginning_at(player.latency()).index(Parameter::Latency);
        for (number, name) in LATENCIES.split([',', ' ']).filter(|word| !["", "or"].contains(word)).enumerate() {
            let player = Player::new();
            assert_eq!(begun(&player), LatencyChoice::Frame.to_index());
            assert!(player.begin_at(name), "{name}");
            assert_eq!(begun(&player), number);
        }
        assert!(!Player::new().begin_at("32"));
    }

    #[test]
    fn a_missing_file_is_named() {
        let error = Player::new().open(Path::new("no/such.wav")).unwrap_err().to_string();
        assert!(error.contains("such.wav"), "{error}");
    }
}
