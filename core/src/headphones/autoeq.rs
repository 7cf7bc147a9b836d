//! Texts by AutoEq (github.com/jaakkopasanen/AutoEq) and for Equalizer APO, whose forms these are (its configuration
//! reference).

use super::{Chain, Correction, EqFilter, EqKind, HeadphonesError, MOST_DB, headphone_point_hz};
use crate::number::single;

/// Bytes of a text, filters, and points of a curve, at most.
const MAX_BYTES: usize = 1 << 16;
pub(super) const MAX_FILTERS: usize = 64;
const MAX_POINTS: usize = 4096;
/// Frequencies, Hz, and qualities of filters.
pub(super) const HZ: std::ops::RangeInclusive<f64> = 1.0..=100_000.0;
pub(super) const QUALITIES: std::ops::RangeInclusive<f64> = 0.05..=100.0;
/// Bandwidths whose Q is one of these.
const OCTAVES: std::ops::RangeInclusive<f64> = 0.015..=8.5;

pub(super) fn refused(place: impl Into<String>, expected: impl Into<String>, found: impl Into<String>) -> HeadphonesError {
    HeadphonesError { place: place.into(), expected: expected.into(), found: found.into() }
}

/// Commands of Equalizer APO that choose where or when filters are heard, not how.
const WITHOUT_EFFECT: [&str; 2] = ["device", "stage"];
/// Slope of a shelf of which none is stated, and of the lower and upper limit of a passband of which no Q is (Equalizer APO's
/// reference).
const SHELF_SLOPE: f64 = 0.9;
const BUTTERWORTH: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Which ears the lines below are for.
fn ears(names: &str) -> [bool; 2] {
    let names = names.to_ascii_lowercase();
    let any = |wanted: [&str; 2]| names.split([' ', '\t', ',']).any(|name| name == "all" || wanted.contains(&name));
    [any(["l", "1"]), any(["r", "2"])]
}

pub(super) fn read(text: &str) -> Result<Correction, HeadphonesError> {
    if text.len() > MAX_BYTES {
        return Err(refused("text", format!("at most {MAX_BYTES} bytes"), text.len().to_string()));
    }
    let lines = text.trim_start_matches('\u{feff}').lines().enumerate();
    let lines = lines.map(|(i, line)| (i + 1, line.trim())).filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let (mut of, mut chains, mut curves) = ([true; 2], [Chain::default(), Chain::default()], [None, None]);
    for (number, line) in lines {
        let place = || format!("line {number}");
        let Some((head, rest)) = line.split_once(':') else {
            return Err(refused(place(), "\"Preamp:\", \"Filter N:\", \"GraphicEQ:\" or \"Channel:\"", quoted(line)));
        };
        let kind = head.split_whitespace().next().unwrap_or("").to_ascii_lowercase();
        let mine = || of.into_iter().enumerate().filter(|(_, on)| *on).map(|(ear, _)| ear);
        match kind.as_str() {
            "channel" => of = ears(rest),
            "preamp" => {
                let form = "\"Preamp: X dB\", at most 60 dB together";
                let db = words(rest, &["dB"]).ok_or_else(|| refused(place(), form, quoted(line)))?;
                let db = checked(db, &(-MOST_DB..=MOST_DB)).ok_or_else(|| refused(place(), form, quoted(line)))?;
                mine().for_each(|ear| chains[ear].preamp_db += db);
                if let Some(chain) = chains.iter().find(|chain| chain.preamp_db.abs() > MOST_DB) {
                    return Err(refused(place(), form, format!("{} dB", chain.preamp_db)));
                }
            }
            "filter" => {
                if let Some(filter) = filter(rest).map_err(|expected| refused(place(), expected, quoted(line)))? {
                    mine().for_each(|ear| chains[ear].filters.push(filter));
                }
            }
            "graphiceq" if mine().all(|ear| curves[ear].is_none()) => {
                let points = points(rest).map_err(|(e, f)| refused(place(), e, quoted(&f)))?;
                mine().for_each(|ear| curves[ear] = Some(points.clone()));
            }
            kind if WITHOUT_EFFECT.contains(&kind) => (),
            _ => {
                let expected = "\"Preamp:\", \"Filter N:\", \"Channel:\" or \"GraphicEQ:\", the last once for an ear";
                return Err(refused(place(), expected, quoted(line)));
            }
        }
        if chains.iter().any(|chain| chain.filters.len() > MAX_FILTERS) {
            return Err(refused(place(), format!("at most {MAX_FILTERS} filters"), "more"));
        }
    }
    let filters = chains.iter().any(|chain| !chain.filters.is_empty());
    if curves.iter().all(Option::is_none) {
        let expected = "lines such as \"Filter 1: ON PK Fc 105 Hz Gain 5.5 dB Q 0.70\"";
        return if filters { Ok(Correction::Equaliser(chains)) } else { Err(refused("text", expected, "none")) };
    }
    if filters {
        return Err(refused("text", "filters or a graphic equaliser", "both"));
    }
    let [left, right] = std::array::from_fn(|ear| {
        let level = |hz: f64| chains[ear].preamp_db + curves[ear].as_deref().map_or(0.0, |curve| along(curve, hz));
        std::array::from_fn(|i| single(level(headphone_point_hz(i))))
    });
    Ok(Correction::Levels(Box::new([left, right])))
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

/// "ON PK Fc 105 Hz Gain 5.5 dB Q 0.70" and its kin; `None` for a filter that is off or of no type.
///
/// Without a Q, a shelf has a slope, of 0.9 or as it is stated in dB an octave, and without a C in its type's name (centre)
/// its frequency is that where the shelf begins, from which the centre is 10^(gain / (80 slope)) away; limits of a passband
/// have a Q of 0.71.
fn filter(text: &str) -> Result<Option<EqFilter>, &'static str> {
    let form = "\"ON TYPE Fc X Hz Gain X dB Q X\", of the types PK, LS, LSC, HS, HSC, LP, LPQ, HP, HPQ, BP, NO or AP";
    let mut words = text.split_whitespace().peekable();
    let is = |word: Option<&str>, expected: &str| word.is_some_and(|word| word.eq_ignore_ascii_case(expected));
    match words.next() {
        Some(on) if on.eq_ignore_ascii_case("on") => (),
        Some(off) if off.eq_ignore_ascii_case("off") => return Ok(None),
        _ => return Err(form),
    }
    let Some(kind) = words.next().map(str::to_ascii_uppercase) else { return Err(form) };
    // An equaliser's slots without a filter.
    if kind == "NONE" {
        return Ok(None);
    }
    // "LSC 9 dB", "LS 6dB": the slope, dB an octave.
    let mut slope = None;
    if !is(words.peek().copied(), "fc") {
        let word = words.next().ok_or(form)?.to_ascii_lowercase();
        let number = word.strip_suffix("db");
        if number.is_none() && !is(words.next(), "db") {
            return Err(form);
        }
        slope = Some(checked(number.unwrap_or(&word), &(0.1..=48.0)).ok_or("a slope of 0.1 to 48 dB")? / 12.0);
    }
    let (mut hz, mut gain_db, mut q) = (None, None, None);
    while let Some(word) = words.next() {
        match word.to_ascii_lowercase().as_str() {
            "fc" => {
                hz = Some(checked(words.next().ok_or(form)?, &HZ).ok_or("a frequency of 1 to 100000 Hz")?);
                if !is(words.next(), "hz") {
                    return Err(form);
                }
            }
            "gain" => {
                gain_db = Some(checked(words.next().ok_or(form)?, &(-MOST_DB..=MOST_DB)).ok_or("a gain of at most 60 dB")?);
                if !is(words.next(), "db") {
                    return Err(form);
                }
            }
            "q" => q = Some(checked(words.next().ok_or(form)?, &QUALITIES).ok_or("a Q of 0.05 to 100")?),
            "bw" => {
                if !is(words.next(), "oct") {
                    return Err(form);
                }
                let octaves: f64 = checked(words.next().ok_or(form)?, &OCTAVES).ok_or("a bandwidth of 0.015 to 8.5 octaves")?;
                q = Some(octaves.exp2().sqrt() / (octaves.exp2() - 1.0));
            }
            _ => return Err(form),
        }
    }
    let mut hz = hz.ok_or(form)?;
    let (kind, has_gain) = match kind.as_str() {
        "PK" | "PEQ" | "MODAL" => (EqKind::Peak, true),
        "LS" | "LSC" => (EqKind::LowShelf, true),
        "HS" | "HSC" => (EqKind::HighShelf, true),
        "LP" | "LPQ" => (EqKind::LowPass, false),
        "HP" | "HPQ" => (EqKind::HighPass, false),
        "BP" => (EqKind::BandPass, false),
        "NO" => (EqKind::Notch, false),
        "AP" => (EqKind::AllPass, false),
        _ => return Err(form),
    };
    if has_gain != gain_db.is_some() || (slope.is_some() && !matches!(kind, EqKind::LowShelf | EqKind::HighShelf)) {
        return Err(form);
    }
    let gain_db = gain_db.unwrap_or(0.0);
    if let (EqKind::LowShelf | EqKind::HighShelf, None) = (kind, q) {
        let steep = slope.unwrap_or(SHELF_SLOPE);
        if text.split_whitespace().nth(1).is_none_or(|name| name.len() <= 2) {
            let shift = 10.0_f64.powf(gain_db.abs() / 80.0 / steep);
            hz = if kind == EqKind::LowShelf { hz * shift } else { hz / shift };
            hz = hz.clamp(*HZ.start(), *HZ.end());
        }
        q = Some(shelf_quality(gain_db, steep));
    }
    let q = match (kind, q) {
        (_, Some(q)) => q,
        (EqKind::LowPass | EqKind::HighPass | EqKind::BandPass | EqKind::AllPass, None) => BUTTERWORTH,
        (EqKind::Notch, None) => 30.0,
        (EqKind::Peak | EqKind::LowShelf | EqKind::HighShelf, None) => return Err(form),
    };
    Ok(Some(EqFilter { kind, hz, gain_db, q }))
}

/// The Q of a shelf of some slope, from 0 to 1 (R. Bristow-Johnson, Audio EQ Cookbook).
fn shelf_quality(gain_db: f64, slope: f64) -> f64 {
    let amplitude = 10.0_f64.powf(gain_db / 40.0);
    let square = (amplitude + amplitude.recip()) * (slope.recip() - 1.0) + 2.0;
    square.max(1e-4).sqrt().recip().clamp(*QUALITIES.start(), *QUALITIES.end())
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
