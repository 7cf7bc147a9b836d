//! Texts by AutoEq (github.com/jaakkopasanen/AutoEq), in the forms of Equalizer APO.

use super::{Correction, EqFilter, EqKind, HeadphonesError, MOST_DB, headphone_point_hz};
use crate::number::single;

/// Bytes of a text, filters, and points of a curve, at most.
const MAX_BYTES: usize = 1 << 16;
pub(super) const MAX_FILTERS: usize = 64;
const MAX_POINTS: usize = 4096;
/// Frequencies, Hz, and qualities of filters.
pub(super) const HZ: std::ops::RangeInclusive<f64> = 1.0..=100_000.0;
pub(super) const QUALITIES: std::ops::RangeInclusive<f64> = 0.05..=100.0;

pub(super) fn refused(place: impl Into<String>, expected: impl Into<String>, found: impl Into<String>) -> HeadphonesError {
    HeadphonesError { place: place.into(), expected: expected.into(), found: found.into() }
}

pub(super) fn read(text: &str) -> Result<Correction, HeadphonesError> {
    if text.len() > MAX_BYTES {
        return Err(refused("text", format!("at most {MAX_BYTES} bytes"), text.len().to_string()));
    }
    let lines = text.trim_start_matches('\u{feff}').lines().enumerate();
    let lines = lines.map(|(i, line)| (i + 1, line.trim())).filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let (mut preamp_db, mut filters, mut curve) = (None, Vec::new(), None);
    for (number, line) in lines {
        let place = || format!("line {number}");
        let Some((head, rest)) = line.split_once(':') else {
            return Err(refused(place(), "\"Preamp:\", \"Filter N:\" or \"GraphicEQ:\"", quoted(line)));
        };
        let kind = head.split_whitespace().next().unwrap_or("");
        match kind.to_ascii_lowercase().as_str() {
            "preamp" if preamp_db.is_none() => {
                let form = "\"Preamp: X dB\", at most 60 dB, once";
                let db = words(rest, &["dB"]).ok_or_else(|| refused(place(), form, quoted(line)))?;
                preamp_db = Some(checked(db, &(-MOST_DB..=MOST_DB)).ok_or_else(|| refused(place(), form, quoted(line)))?);
            }
            "filter" => filters.extend(filter(rest).map_err(|expected| refused(place(), expected, quoted(line)))?),
            "graphiceq" if curve.is_none() => curve = Some(points(rest).map_err(|(e, f)| refused(place(), e, quoted(&f)))?),
            _ => return Err(refused(place(), "\"Preamp:\" once, \"Filter N:\" or \"GraphicEQ:\" once", quoted(line))),
        }
        if filters.len() > MAX_FILTERS {
            return Err(refused(place(), format!("at most {MAX_FILTERS} filters"), "more"));
        }
    }
    match curve {
        Some(curve) if filters.is_empty() => {
            let preamp = preamp_db.unwrap_or(0.0);
            let levels = std::array::from_fn(|i| single(preamp + along(&curve, headphone_point_hz(i))));
            Ok(Correction::Levels(Box::new([levels; 2])))
        }
        Some(_) => Err(refused("text", "filters or a graphic equaliser", "both")),
        None if filters.is_empty() => {
            Err(refused("text", "lines such as \"Filter 1: ON PK Fc 105 Hz Gain 5.5 dB Q 0.70\"", "none"))
        }
        None => Ok(Correction::Equaliser { preamp_db: preamp_db.unwrap_or(0.0), filters }),
    }
}

/// "X UNIT": the number before these words.
fn words<'a>(text: &'a str, units: &[&str]) -> Option<&'a str> {
    let mut parts = text.split_whitespace();
    let number = parts.next()?;
    let same = units.iter().all(|unit| parts.next().is_some_and(|part| part.eq_ignore_ascii_case(unit)));
    (same && parts.next().is_none()).then_some(number)
}

fn checked(text: &str, range: &std::ops::RangeInclusive<f64>) -> Option<f64> {
    text.parse().ok().filter(|value| range.contains(value))
}

/// "ON PK Fc 105 Hz Gain 5.5 dB Q 0.70"; `None` for a filter that is off.
fn filter(text: &str) -> Result<Option<EqFilter>, &'static str> {
    let form = "\"ON PK Fc X Hz Gain X dB Q X\", of the types PK, LSC or HSC";
    let parts: Vec<&str> = text.split_whitespace().collect();
    if parts.first().is_some_and(|on| on.eq_ignore_ascii_case("off")) {
        return Ok(None);
    }
    let [on, kind, fc, hz, hertz, gain, db, decibel, q, quality] = parts[..] else { return Err(form) };
    let same = [(on, "on"), (fc, "fc"), (hertz, "hz"), (gain, "gain"), (decibel, "db"), (q, "q")];
    if same.into_iter().any(|(found, expected)| !found.eq_ignore_ascii_case(expected)) {
        return Err(form);
    }
    let kind = match kind.to_ascii_uppercase().as_str() {
        "PK" => EqKind::Peak,
        "LSC" => EqKind::LowShelf,
        "HSC" => EqKind::HighShelf,
        _ => return Err(form),
    };
    let hz = checked(hz, &HZ).ok_or("a frequency of 1 to 100000 Hz")?;
    let gain_db = checked(db, &(-MOST_DB..=MOST_DB)).ok_or("a gain of at most 60 dB")?;
    let q = checked(quality, &QUALITIES).ok_or("a Q of 0.05 to 100")?;
    Ok(Some(EqFilter { kind, hz, gain_db, q }))
}

/// "20 -1.2; 21 -1.3; ...": frequencies that rise, with levels, dB.
fn points(text: &str) -> Result<Vec<(f64, f64)>, (&'static str, String)> {
    let mut points: Vec<(f64, f64)> = Vec::new();
    for pair in text.split(';').map(str::trim).filter(|pair| !pair.is_empty()) {
        let found = || ("rising frequencies with levels of at most 60 dB, \"20 -1.2; 21 -1.3; ...\"", pair.to_owned());
        let (hz, db) = pair.split_once(char::is_whitespace).ok_or_else(found)?;
        let hz = checked(hz, &HZ).filter(|hz| points.last().is_none_or(|last| *hz > last.0)).ok_or_else(found)?;
        points.push((hz, checked(db.trim(), &(-MOST_DB..=MOST_DB)).ok_or_else(found)?));
        if points.len() > MAX_POINTS {
            return Err(("at most 4096 points", "more".to_owned()));
        }
    }
    if points.len() < 2 { Err(("at least two points", text.to_owned())) } else { Ok(points) }
}

/// Level at a frequency: straight lines over octaves, the ends hold.
fn along(points: &[(f64, f64)], hz: f64) -> f64 {
    let after = points.partition_point(|point| point.0 < hz);
    match (after.checked_sub(1).and_then(|before| points.get(before)), points.get(after)) {
        (Some(a), Some(b)) => a.1 + (b.1 - a.1) * (hz / a.0).ln() / (b.0 / a.0).ln(),
        (Some(end), None) | (None, Some(end)) => end.1,
        (None, None) => 0.0,
    }
}

/// The beginning of a text in quotes.
fn quoted(text: &str) -> String {
    format!("\"{}\"", text.chars().take(60).collect::<String>())
}
