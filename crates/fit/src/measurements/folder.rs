//! Folders of sound files with a `measurements.json`.

use super::recorded::{NO_HEAD, Recorded, unit};
use super::set::{Clock, LoadOptions, MOST_SAMPLES, Measurements, Place};
use crate::error::FitError;
use promenade_acoustics::Air;
use promenade_audio::{file, sound};
use serde::Deserialize;
use std::io::Read;
use std::path::Path;

/// The file beside the sounds.
pub(super) const MANIFEST: &str = "measurements.json";
/// Bytes that it may have.
const MAX_BYTES: u64 = 64 << 20;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Manifest {
    title: Option<String>,
    /// Of places that have none of their own, metres.
    sd_m: Option<f64>,
    /// Of responses that have none of their own.
    clock: Option<ClockEntry>,
    responses: Vec<Entry>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum ClockEntry {
    Known,
    Free,
}

#[derive(Clone, Copy, Default, Deserialize, PartialEq)]
#[serde(rename_all = "lowercase")]
enum KindEntry {
    #[default]
    Mono,
    Binaural,
    Ambix,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PlaceEntry {
    at: [f64; 3],
    sd_m: Option<f64>,
    facing: Option<[f64; 3]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    file: String,
    #[serde(default)]
    kind: KindEntry,
    /// Counted from 1.
    channel: Option<usize>,
    clock: Option<ClockEntry>,
    source: PlaceEntry,
    microphone: PlaceEntry,
}

pub(super) fn load(folder: &Path, options: &LoadOptions) -> Result<Measurements, FitError> {
    let path = folder.join(MANIFEST);
    let mut text = String::new();
    let read = file::open(&path).and_then(|f| f.take(MAX_BYTES).read_to_string(&mut text));
    read.map_err(promenade_audio::FileError::read(&path))?;
    let manifest: Manifest =
        serde_json::from_str(&text).map_err(|e| FitError::content(&path, "a description of measurements", e))?;
    let place = |entry: &PlaceEntry| Place {
        at_m: entry.at,
        sd_m: entry.sd_m.or(manifest.sd_m).unwrap_or(options.sd_m),
        facing: entry.facing.and_then(unit),
    };
    let (mut all, mut rate, mut samples) = (Vec::new(), None, 0);
    for (number, entry) in manifest.responses.iter().enumerate() {
        let file = folder.join(&entry.file);
        let wav = sound::read(&file)?;
        samples += wav.channels.len() * wav.frames();
        if samples > MOST_SAMPLES {
            return Err(FitError::content(&path, format!("at most {MOST_SAMPLES} samples of all responses"), "more"));
        }
        let first = *rate.get_or_insert(wav.sample_rate_hz);
        if first != wav.sample_rate_hz {
            return Err(FitError::content(&file, format!("{first} Hz, as other files have"), wav.sample_rate_hz));
        }
        let count = wav.channels.len();
        let channel = match (entry.kind, entry.channel) {
            (KindEntry::Binaural, None) => return Err(FitError::entry(&path, entry.file.clone(), NO_HEAD, "two ears")),
            (KindEntry::Ambix, None) => 0,
            (KindEntry::Mono, Some(n)) if (1..=count).contains(&n) => n - 1,
            (KindEntry::Mono, None) if count == 1 => 0,
            (_, channel) => {
                let found = channel.map_or(format!("{count} and none chosen"), |n| format!("channel {n} of {count}"));
                return Err(FitError::entry(
                    &path,
                    entry.file.clone(),
                    "one channel, or the number of one of a mono response",
                    found,
                ));
            }
        };
        let microphone = place(&entry.microphone);
        let recorded = Recorded {
            // In the order of the file, which the order of names then is.
            name: format!("{number:05} {}", entry.file),
            source: place(&entry.source),
            microphone,
            clock: match entry.clock.or(manifest.clock).unwrap_or(ClockEntry::Known) {
                ClockEntry::Known => Clock::Known,
                ClockEntry::Free => Clock::Free,
            },
            channels: wav.channels,
        };
        all.push(recorded.channel(channel)?);
    }
    let title =
        manifest.title.unwrap_or_else(|| folder.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default());
    Ok(Measurements { title, sample_rate_hz: rate.unwrap_or(0), all, notes: Vec::new(), air: Air::default() })
}
