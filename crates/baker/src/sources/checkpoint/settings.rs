//! What is not among the weights: given by the user, stated by the file, or as in the published code.

use super::ImportOptions;
use crate::BakeError;
use promenade_core::StftGrid;
use promenade_core::network::{CloudKind, Placement, PoseConvention};
use std::collections::BTreeMap;
use std::fmt::Display;
use std::path::Path;
use std::str::FromStr;

/// Rates that are believed, Hz.
const SAMPLE_RATES_HZ: std::ops::RangeInclusive<f64> = 1_000.0..=768_000.0;
/// Lengths of transforms that are believed, samples.
const TRANSFORMS: std::ops::RangeInclusive<usize> = 4..=16_384;

/// Everything settled.
#[derive(Debug)]
pub(super) struct Settings {
    /// Not known until the weights are looked at where nobody says it.
    pub(super) kind: Option<CloudKind>,
    /// There is no published value for all scenes.
    pub(super) max_norm: Option<f32>,
    pub(super) grid: StftGrid,
    pub(super) heads: usize,
    pub(super) convention: PoseConvention,
    pub(super) placement: Placement,
    pub(super) notes: Vec<String>,
}

impl Settings {
    pub(super) fn new(path: &Path, metadata: &BTreeMap<String, String>, options: &ImportOptions) -> Result<Self, BakeError> {
        let mut sources = Sources { path, metadata, assumed: Vec::new(), notes: Vec::new() };
        let kind = sources.named("kind", CloudKind::from_name, "full, sh or simple-sh")?;
        let kind = sources.either("kind", options.kind, kind, |k| k.name().to_owned());
        let convention = sources.named("convention", PoseConvention::from_name, "published or physical")?;
        let convention = sources.either("convention", options.convention, convention, |c| c.name().to_owned());
        let max_norm = sources.number("max_norm", options.max_norm)?;
        let sample_rate_hz = sources.published("sample_rate", options.sample_rate_hz, 22_050.0)?;
        let n_fft = sources.published("n_fft", options.n_fft, 512)?;
        let hop = sources.published("hop", options.hop, 127)?;
        let heads = sources.published("heads", options.heads, 4)?;
        let Sources { assumed, mut notes, .. } = sources;
        if !assumed.is_empty() {
            notes.push(format!("taken as in the published code: {}", assumed.join(", ")));
        }
        if options.placement.is_none() {
            notes.push(
                "no placement is given: one unit of the cloud is taken as a metre, its axes as the scene's (z up)".to_owned(),
            );
        }
        let wrong = |what: &str, expected: &str, found: &dyn Display| Err(BakeError::entry(path, what, expected, found));
        if let Some(m) = max_norm.filter(|m| !(m.is_finite() && *m > 0.0)) {
            return wrong("max_norm", "a finite number above 0", &m);
        }
        if !SAMPLE_RATES_HZ.contains(&sample_rate_hz) {
            let expected = format!("{} to {} Hz", SAMPLE_RATES_HZ.start(), SAMPLE_RATES_HZ.end());
            return wrong("sample rate", &expected, &sample_rate_hz);
        }
        if !TRANSFORMS.contains(&n_fft) || !n_fft.is_multiple_of(2) {
            let expected = format!("an even number of samples from {} to {}", TRANSFORMS.start(), TRANSFORMS.end());
            return wrong("n_fft", &expected, &n_fft);
        }
        if !(1..=n_fft / 2).contains(&hop) {
            return wrong("hop", &format!("1 to {} samples", n_fft / 2), &hop);
        }
        if !(1..=64).contains(&heads) {
            return wrong("heads", "1 to 64", &heads);
        }
        Ok(Self {
            kind,
            max_norm,
            grid: StftGrid { sample_rate_hz, n_fft, hop },
            heads,
            convention: convention.unwrap_or(PoseConvention::Published),
            placement: options.placement.unwrap_or(Placement::IDENTITY),
            notes,
        })
    }
}

/// Where a value may come from, and what came of it.
struct Sources<'a> {
    path: &'a Path,
    metadata: &'a BTreeMap<String, String>,
    /// Values that nobody gave.
    assumed: Vec<String>,
    notes: Vec<String>,
}

impl Sources<'_> {
    /// What the user says before what the file says.
    fn either<T: PartialEq>(
        &mut self,
        key: &str,
        given: Option<T>,
        stated: Option<T>,
        text: impl Fn(&T) -> String,
    ) -> Option<T> {
        if let (Some(g), Some(s)) = (&given, &stated)
            && g != s
        {
            self.notes.push(format!("{key} is {} as given, not {} as the file says", text(g), text(s)));
        }
        given.or(stated)
    }

    fn number<T: FromStr + PartialEq + Display>(&mut self, key: &str, given: Option<T>) -> Result<Option<T>, BakeError> {
        let stated = match self.metadata.get(key) {
            None => None,
            Some(text) => Some(text.parse().map_err(|_| self.wrong(key, "a number", text))?),
        };
        Ok(self.either(key, given, stated, ToString::to_string))
    }

    fn published<T: FromStr + PartialEq + Display>(&mut self, key: &str, given: Option<T>, value: T) -> Result<T, BakeError> {
        let known = self.number(key, given)?;
        if known.is_none() {
            self.assumed.push(format!("{key} {value}"));
        }
        Ok(known.unwrap_or(value))
    }

    fn named<T>(&self, key: &str, from: fn(&str) -> Option<T>, names: &str) -> Result<Option<T>, BakeError> {
        let Some(text) = self.metadata.get(key) else { return Ok(None) };
        from(text).map(Some).ok_or_else(|| self.wrong(key, names, text))
    }

    fn wrong(&self, key: &str, expected: &str, found: &str) -> BakeError {
        BakeError::entry(self.path, format!("metadata '{key}'"), expected, format!("'{found}'"))
    }
}
