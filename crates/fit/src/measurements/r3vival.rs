//! R3VIVAL (Amengual Gari et al. 2023): a room whose walls are changed, loudspeakers about an array.

use super::recorded::unit;
use super::set::{Clock, LoadOptions, MOST_SAMPLES, Measurement, Measurements, Place};
use crate::error::FitError;
use promenade_acoustics::Air;
use promenade_audio::{FileError, sound};
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// The table of places beside the responses.
pub(super) const POSITIONS: &str = "positions_derived.csv";
/// The array, metres, with the room's corner at the origin; its height is inferred from the echoes of floor and ceiling.
const ARRAY_M: [f64; 3] = [6.20, 2.75, 1.31];
/// The array's middle, counted from 1.
const MIDDLE: usize = 7;
/// The places come from a plan's picture.
const SD_M: f64 = 0.05;

/// Reads the loudspeakers of one setting that have a place. Responses are shifted in time, each by an amount of its own.
pub(super) fn load(folder: &Path, options: &LoadOptions) -> Result<Measurements, FitError> {
    let table = folder.join(POSITIONS);
    let text = fs::read_to_string(&table).map_err(FileError::read(&table))?;
    let mut settings = BTreeSet::new();
    let (mut all, mut rate, mut without, mut samples) = (Vec::new(), 0, 0, 0);
    for (number, line) in text.lines().enumerate().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        let [name, setting, _, _, _, _, x, y, z, _] = fields[..] else {
            return Err(FitError::entry(&table, format!("line {}", number + 1), "10 fields", fields.len()));
        };
        settings.insert(setting);
        if options.setting.as_deref() != Some(setting) {
            continue;
        }
        let (Ok(x), Ok(y), Ok(z)) = (x.parse(), y.parse(), z.parse()) else {
            without += 1;
            continue;
        };
        let at_m = [x, y, z];
        let file = folder.join("RIRs_flac24").join(name);
        let mut wav = sound::read(&file)?;
        let channel = options.channel.unwrap_or(MIDDLE);
        if !(1..=wav.channels.len()).contains(&channel) {
            return Err(FitError::content(&file, format!("a channel number of 1 to {}", wav.channels.len()), channel));
        }
        rate = wav.sample_rate_hz;
        samples += wav.frames();
        if samples > MOST_SAMPLES {
            return Err(FitError::content(&table, format!("at most {MOST_SAMPLES} samples of all responses"), "more"));
        }
        let facing = unit(std::array::from_fn(|a| ARRAY_M[a] - at_m[a]));
        all.push(Measurement {
            name: name.trim_end_matches(".flac").to_owned(),
            source: Place { at_m, sd_m: SD_M, facing },
            microphone: Place { at_m: ARRAY_M, sd_m: SD_M, facing: None },
            clock: Clock::Free,
            samples: wav.channels.swap_remove(channel - 1),
        });
    }
    if all.is_empty() {
        let found = options.setting.as_deref().unwrap_or("none chosen").to_owned();
        return Err(FitError::content(
            &table,
            format!("one of its settings: {}", settings.into_iter().collect::<Vec<_>>().join(", ")),
            found,
        ));
    }
    let notes = vec![format!(
        "R3VIVAL, setting {}: {without} sources without a stated place are left out",
        options.setting.as_deref().unwrap_or("")
    )];
    let title = format!("R3VIVAL {}", options.setting.as_deref().unwrap_or(""));
    Ok(Measurements { title, sample_rate_hz: rate, all, notes, air: Air::default() })
}
