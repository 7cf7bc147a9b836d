//! Layouts of published sets whose responses do not come with this repository; read as their authors describe them.

use super::npy;
use super::set::{Clock, LoadOptions, MOST_SAMPLES, Measurement, Measurements, Place};
use crate::error::FitError;
use promenade_acoustics::Air;
use promenade_audio::{FileError, sound};
use std::fs;
use std::path::{Path, PathBuf};

/// The rate of responses whose files do not state one, hertz.
const RATE_HZ: u32 = 48_000;

fn title(folder: &Path) -> String {
    folder.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default()
}

fn exact(at_m: [f64; 3], sd_m: f64) -> Place {
    Place { at_m, sd_m, facing: None }
}

fn samples(values: &[f64]) -> Vec<f32> {
    values.iter().map(|v| *v as f32).collect()
}

/// Hearing Anything Anywhere (Wang et al. 2024): `RIRs.npy`, a row for each microphone, and `xyzs.npy`. The source's place is
/// not in the data, but in its authors' programs.
pub(super) fn hearing_anything_anywhere(folder: &Path, options: &LoadOptions) -> Result<Measurements, FitError> {
    let responses = npy::read(&folder.join("RIRs.npy"))?;
    let places = npy::places(&folder.join("xyzs.npy"))?;
    let Some(source) = options.source_m else {
        return Err(FitError::content(folder, "the source's place, which this layout does not have", "none given"));
    };
    let [rows, frames] = responses.shape[..] else {
        return Err(FitError::content(&folder.join("RIRs.npy"), "a row for each microphone", format!("{:?}", responses.shape)));
    };
    if rows != places.len() || frames == 0 {
        let found = format!("{rows} of {frames} samples");
        return Err(FitError::content(&folder.join("RIRs.npy"), format!("{} rows, as xyzs.npy has", places.len()), found));
    }
    let one = |(number, (row, at)): (usize, (&[f64], &[f64; 3]))| Measurement {
        name: format!("{number:05}"),
        source: exact(source, options.sd_m),
        microphone: exact(*at, options.sd_m),
        clock: Clock::Known,
        samples: samples(row),
    };
    let all = responses.values.chunks_exact(frames).zip(&places).enumerate().map(one).collect();
    Ok(Measurements { title: title(folder), sample_rate_hz: RATE_HZ, all, notes: Vec::new(), air: Air::default() })
}

/// MeshRIR (Koyama et al. 2021): `pos_mic.npy`, `pos_src.npy`, and `ir_N.npy` for each microphone with a row for each source.
pub(super) fn mesh_rir(folder: &Path, options: &LoadOptions) -> Result<Measurements, FitError> {
    let microphones = npy::places(&folder.join("pos_mic.npy"))?;
    let sources = npy::places(&folder.join("pos_src.npy"))?;
    let about = folder.join("data.json");
    let rate = match fs::read_to_string(&about) {
        Ok(text) => {
            let value: serde_json::Value = serde_json::from_str(&text).map_err(|e| FitError::content(&about, "JSON", e))?;
            let stated = ["samplerate", "sample_rate", "fs"].iter().find_map(|k| value.get(k)?.as_u64());
            stated.and_then(|r| u32::try_from(r).ok()).unwrap_or(RATE_HZ)
        }
        Err(_) => RATE_HZ,
    };
    let (mut all, mut held) = (Vec::new(), 0);
    for (m, at) in microphones.iter().enumerate() {
        let path = folder.join(format!("ir_{m}.npy"));
        let array = npy::read(&path)?;
        held += array.values.len();
        let fits = array.shape.first() == Some(&sources.len()) && array.shape.len() == 2 && held <= MOST_SAMPLES;
        if !fits {
            let expected = format!("a row for each of {} sources and at most {MOST_SAMPLES} samples in all", sources.len());
            return Err(FitError::content(&path, expected, format!("{:?}", array.shape)));
        }
        let rows = array.values.chunks_exact(array.shape[1].max(1)).zip(&sources).enumerate();
        let chosen = rows.filter(|(s, _)| options.source_number.is_none_or(|n| n == *s));
        all.extend(chosen.map(|(s, (row, source))| Measurement {
            name: format!("source {s:03} microphone {m:05}"),
            source: exact(*source, options.sd_m),
            microphone: exact(*at, options.sd_m),
            clock: Clock::Known,
            samples: samples(row),
        }));
    }
    Ok(Measurements { title: title(folder), sample_rate_hz: rate, all, notes: Vec::new(), air: Air::default() })
}

/// The folders of Real Acoustic Fields: one for each response.
fn raf_folders(folder: &Path) -> Vec<PathBuf> {
    let inside = |folder: &Path| {
        let entries = fs::read_dir(folder).into_iter().flatten().flatten().map(|e| e.path());
        let mut all: Vec<PathBuf> = entries.filter(|p| p.join("rir.wav").is_file() && p.join("rx_pos.txt").is_file()).collect();
        all.sort();
        all
    };
    let here = inside(folder);
    if here.is_empty() { inside(&folder.join("data")) } else { here }
}

pub(super) fn is_raf(folder: &Path) -> bool {
    !raf_folders(folder).is_empty()
}

/// Real Acoustic Fields (Chen et al. 2024): a folder for each response with `rir.wav`, `rx_pos.txt` and `tx_pos.txt`, of which
/// the last three numbers are the place.
pub(super) fn raf(folder: &Path, options: &LoadOptions) -> Result<Measurements, FitError> {
    let place = |path: &Path| {
        let text = fs::read_to_string(path).map_err(FileError::read(path))?;
        let numbers = text.split(|c: char| c == ',' || c.is_whitespace()).filter(|s| !s.is_empty());
        let numbers: Vec<f64> = numbers.map_while(|s| s.parse().ok()).collect();
        let last = numbers.last_chunk::<3>().copied();
        last.map(|at| exact(at, options.sd_m)).ok_or_else(|| FitError::content(path, "3 numbers", text.trim().to_owned()))
    };
    let (mut all, mut rate, mut held) = (Vec::new(), None, 0);
    for one in raf_folders(folder) {
        let file = one.join("rir.wav");
        let mut wav = sound::read(&file)?;
        let first = *rate.get_or_insert(wav.sample_rate_hz);
        held += wav.frames();
        if first != wav.sample_rate_hz || held > MOST_SAMPLES {
            let expected = format!("{first} Hz and at most {MOST_SAMPLES} samples in all");
            return Err(FitError::content(&file, expected, format!("{} Hz", wav.sample_rate_hz)));
        }
        all.push(Measurement {
            name: title(&one),
            source: place(&one.join("tx_pos.txt"))?,
            microphone: place(&one.join("rx_pos.txt"))?,
            clock: Clock::Known,
            samples: wav.channels.swap_remove(0),
        });
    }
    Ok(Measurements {
        title: title(folder),
        sample_rate_hz: rate.unwrap_or(RATE_HZ),
        all,
        notes: Vec::new(),
        air: Air::default(),
    })
}
