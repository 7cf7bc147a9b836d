//! One recorded or rendered response, alone or against a reference, as JSON.

use crate::args::MeasureArgs;
use crate::report;
use anyhow::{Context, Result, bail};
use promenade_baker::sound;
use promenade_metrics::{
    DecayRange, MetricError, avcloud, c50_db, decay_time_s, ild_db, itd_s, lsd_db, rwavs, tone_cleanliness,
};
use serde_json::{Map, Value, json};
use std::path::Path;

/// Two ears and their rate.
struct Ears {
    left: Vec<f32>,
    right: Vec<f32>,
    sample_rate_hz: u32,
}

pub(crate) fn run(path: &Path, args: &MeasureArgs) -> Result<()> {
    let ears = read(path)?;
    let rate = f64::from(ears.sample_rate_hz);
    let mut out = json!({ "response": room(&ears) });
    if let Some(tone_hz) = args.tone_hz {
        let c = tone_cleanliness(&ears.left, rate, tone_hz).context("tone cleanliness")?;
        out["tone"] = json!({
            "outside_median_db": c.outside_median_db,
            "outside_worst_db": c.outside_worst_db,
            "high_median_db": c.high_median_db,
            "high_worst_db": c.high_worst_db,
        });
    }
    if let Some(reference_path) = &args.reference {
        let reference = read(reference_path)?;
        if reference.sample_rate_hz != ears.sample_rate_hz {
            let (expected, found) = (ears.sample_rate_hz, reference.sample_rate_hz);
            bail!("{}: expected {expected} Hz as in {}, found {found} Hz", reference_path.display(), path.display());
        }
        out["reference"] = room(&reference);
        out["distance"] = distance(&ears, &reference);
    }
    report::json_or(&args.json, &out, || format!("{out:#}\n"))
}

fn read(path: &Path) -> Result<Ears> {
    let wav = sound::read(path)?;
    let count = wav.channels.len();
    let Ok([left, right]) = <[Vec<f32>; 2]>::try_from(wav.channels) else {
        bail!("{}: expected the 2 channels of a binaural file, found {count}", path.display());
    };
    Ok(Ears { left, right, sample_rate_hz: wav.sample_rate_hz })
}

/// The figures of a response; one that has no value is null, with the reason under "missing".
fn room(ears: &Ears) -> Value {
    let rate = f64::from(ears.sample_rate_hz);
    let mean = |of: &dyn Fn(&[f32]) -> Result<f64, MetricError>| Ok(0.5 * (of(&ears.left)? + of(&ears.right)?));
    named(&[
        ("itd_us", itd_s(&ears.left, &ears.right, rate).map(|s| 1e6 * s)),
        ("ild_db", ild_db(&ears.left, &ears.right)),
        ("t20_s", mean(&|h| decay_time_s(h, rate, DecayRange::T20))),
        ("t30_s", mean(&|h| decay_time_s(h, rate, DecayRange::T30))),
        ("edt_s", mean(&|h| decay_time_s(h, rate, DecayRange::EDT))),
        ("c50_db", mean(&|h| c50_db(h, rate))),
    ])
}

/// Distances over the length of the shorter file.
fn distance(ears: &Ears, reference: &Ears) -> Value {
    let shorter = ears.left.len().min(reference.left.len());
    let (a, b) = ([&ears.left[..shorter], &ears.right[..shorter]], [&reference.left[..shorter], &reference.right[..shorter]]);
    let lsd = lsd_db(a[0], b[0], rwavs::SPECTROGRAM).and_then(|l| Ok(0.5 * (l + lsd_db(a[1], b[1], rwavs::SPECTROGRAM)?)));
    named(&[
        ("avcloud_mag", avcloud::mag(a, b)),
        ("avcloud_lre_db", avcloud::lre_db(a, b)),
        ("avcloud_env", avcloud::env(a, b)),
        ("rwavs_mag", rwavs::mag(a, b)),
        ("lsd_db_512_128_hann_1e-5", lsd),
    ])
}

fn named(measures: &[(&str, Result<f64, MetricError>)]) -> Value {
    let mut values = Map::new();
    let mut missing = Map::new();
    for (name, measure) in measures {
        match measure {
            Ok(value) => values.insert((*name).to_owned(), json!(value)),
            Err(reason) => {
                missing.insert((*name).to_owned(), json!(reason.to_string()));
                values.insert((*name).to_owned(), Value::Null)
            }
        };
    }
    if !missing.is_empty() {
        values.insert("missing".to_owned(), Value::Object(missing));
    }
    Value::Object(values)
}
