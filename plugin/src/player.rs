//! The standalone program's dry track: a file that is played in place of the live input.

use crate::cast::{narrow, whole};
use crate::lock::lock;
use crossbeam_queue::ArrayQueue;
use promenade_audio::{FileError, resample, wav};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::sync::{Mutex, OnceLock};

/// The fade at a start or a stop, seconds.
const FADE_S: f64 = 0.005;
/// Longer files are refused, samples of all channels: an hour of stereo at 48 kHz.
const LONGEST: u64 = 2 * 48_000 * 3_600;
/// No seek is pending: the bits of no finite number.
const NOWHERE: u64 = u64::MAX;

static PLAYER: OnceLock<Player> = OnceLock::new();

/// The process's player, if it was set up: in the standalone program only.
#[must_use]
pub fn player() -> Option<&'static Player> {
    PLAYER.get()
}

/// Sets up the process's player.
pub fn set_up() -> &'static Player {
    PLAYER.get_or_init(Player::new)
}

/// A file as it is on disk.
struct Source {
    path: PathBuf,
    sample_rate_hz: u32,
    channels: Vec<Vec<f32>>,
}

/// A file at the rate of the sound card.
pub struct Track {
    channels: [Vec<f32>; 2],
    sample_rate_hz: f64,
}

/// What is played, and how. The window and the loader set it, the audio thread reads it.
pub struct Player {
    source: Mutex<Option<Source>>,
    sample_rate_hz: AtomicU32,
    fresh: ArrayQueue<Box<Track>>,
    retired: ArrayQueue<Box<Track>>,
    playing: AtomicBool,
    looping: AtomicBool,
    seek: AtomicU64,
    position_s: AtomicU64,
}

impl Player {
    fn new() -> Self {
        Self {
            source: Mutex::new(None),
            sample_rate_hz: AtomicU32::new(0),
            fresh: ArrayQueue::new(1),
            retired: ArrayQueue::new(4),
            playing: AtomicBool::new(false),
            looping: AtomicBool::new(true),
            seek: AtomicU64::new(NOWHERE),
            position_s: AtomicU64::new(0),
        }
    }

    /// Reads a WAV file of one or two channels and plays it from its start.
    ///
    /// # Errors
    /// The file cannot be read, has more than two channels, or is longer than an hour of stereo at 48 kHz.
    pub fn open(&self, path: &Path) -> Result<(), FileError> {
        let wav = wav::read_limited(path, LONGEST)?;
        if wav.channels.len() > 2 {
            return Err(FileError::content(path, "one or two channels", wav.channels.len().to_string()));
        }
        let source = Source { path: path.to_owned(), sample_rate_hz: wav.sample_rate_hz, channels: wav.channels };
        *lock(&self.source) = Some(source);
        self.prepare()?;
        self.seek_s(0.0);
        self.play(true);
        Ok(())
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

    /// The file that is played, and its length, seconds.
    pub fn file(&self) -> Option<(PathBuf, f64)> {
        let source = lock(&self.source);
        let length = |s: &Source| s.channels.first().map_or(0, Vec::len) as f64 / f64::from(s.sample_rate_hz);
        source.as_ref().map(|s| (s.path.clone(), length(s)))
    }

    /// Plays or stops.
    pub fn play(&self, playing: bool) {
        self.playing.store(playing, Ordering::Relaxed);
    }

    /// Whether it plays.
    pub fn is_playing(&self) -> bool {
        self.playing.load(Ordering::Relaxed)
    }

    /// Whether it begins anew at the end, or stops there.
    pub fn set_looping(&self, looping: bool) {
        self.looping.store(looping, Ordering::Relaxed);
    }

    /// Whether it begins anew at the end.
    pub fn is_looping(&self) -> bool {
        self.looping.load(Ordering::Relaxed)
    }

    /// Goes to a place, seconds from the start.
    pub fn seek_s(&self, position_s: f64) {
        if position_s.is_finite() {
            self.seek.store(position_s.max(0.0).to_bits(), Ordering::Release);
        }
    }

    /// Where it is, seconds from the start.
    pub fn position_s(&self) -> f64 {
        f64::from_bits(self.position_s.load(Ordering::Relaxed))
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
    /// Replaces a block of live input by the file. Returns the file's time at its first sample, seconds, and whether it plays; `None` without a
    /// file, when the input stays as it is.
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
        let seek = player.seek.swap(NOWHERE, Ordering::AcqRel);
        if seek != NOWHERE {
            self.at = first.len().min(whole(f64::from_bits(seek) * track.sample_rate_hz) as usize);
        }
        let playing = player.is_playing();
        let seconds = |at: usize| at as f64 / track.sample_rate_hz;
        let start_s = seconds(self.at);
        let step = narrow(1.0 / (FADE_S * track.sample_rate_hz));
        for (l, r) in left.iter_mut().zip(right) {
            if self.at >= first.len() {
                if player.is_looping() {
                    self.at = 0;
                } else {
                    player.play(false);
                    self.gain = 0.0;
                }
            }
            self.gain = if playing { (self.gain + step).min(1.0) } else { (self.gain - step).max(0.0) };
            let runs = self.gain > 0.0;
            let sample = |channel: &[f32]| if runs { channel.get(self.at).copied().unwrap_or(0.0) * self.gain } else { 0.0 };
            (*l, *r) = (sample(first), sample(second));
            self.at += usize::from(runs);
        }
        player.position_s.store(seconds(self.at).to_bits(), Ordering::Relaxed);
        Some((start_s, playing))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_audio::wav::Format;

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
    fn a_file_is_played_looped_sought_and_stopped() {
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
        player.seek_s(900.0 / 48_000.0);
        player.set_looping(false);
        let (out, _) = block(&mut playhead, &player, 600);
        assert!((out[50] * 65_536.0 - 950.0).abs() < 0.1 && out[200] == 0.0);
        assert!(!player.is_playing(), "it stops at the end");
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
    fn a_missing_file_is_named() {
        let error = Player::new().open(Path::new("no/such.wav")).unwrap_err().to_string();
        assert!(error.contains("such.wav"), "{error}");
    }
}
