//! What is not among the weights, as the exporter states it.

use crate::BakeError;
use promenade_core::StftGrid;
use promenade_core::network::{CloudKind, PoseConvention};
use std::collections::BTreeMap;
use std::fmt::Display;
use std::path::Path;
use std::str::FromStr;

/// Rates that are believed, Hz.
const SAMPLE_RATES_HZ: std::ops::RangeInclusive<f64> = 1_000.0..=768_000.0;
/// Lengths of transforms that are believed, samples.
const TRANSFORMS: std::ops::RangeInclusive<usize> = 4..=16_384;

/// The settings of a file.
#[derive(Debug)]
pub(super) struct Settings {
    pub(super) kind: CloudKind,
    /// Distance that relative vectors were divided by, cloud units.
    pub(super) max_norm: f32,
    pub(super) grid: StftGrid,
    /// Attention heads.
    pub(super) heads: usize,
    pub(super) convention: PoseConvention,
}

impl Settings {
    /// Of the metadata of a file.
    pub(super) fn of(path: &Path, metadata: &BTreeMap<String, String>) -> Result<Self, BakeError> {
        let stated = Stated { path, metadata };
        let kind = stated.value("kind", "full, sh or simple-sh", CloudKind::from_name)?;
        let convention = stated.value("convention", "published or physical", PoseConvention::from_name)?;
        let max_norm: f32 = stated.number("max_norm")?;
        let sample_rate_hz: f64 = stated.number("sample_rate")?;
        let (n_fft, hop, heads): (usize, usize, usize) =
            (stated.number("n_fft")?, stated.number("hop")?, stated.number("heads")?);
        let wrong = |what: &str, expected: &str, found: &dyn Display| Err(BakeError::entry(path, what, expected, found));
        if !(max_norm.is_finite() && max_norm > 0.0) {
            return wrong("max_norm", "a finite number above 0", &max_norm);
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
        Ok(Self { kind, max_norm, grid: StftGrid { sample_rate_hz, n_fft, hop }, heads, convention })
    }
}

/// The metadata of a file.
struct Stated<'a> {
    path: &'a Path,
    metadata: &'a BTreeMap<String, String>,
}

impl Stated<'_> {
    fn value<T>(&self, key: &str, expected: &str, from: impl Fn(&str) -> Option<T>) -> Result<T, BakeError> {
        let text = self.metadata.get(key).map_or("", String::as_str);
        let wrong = || BakeError::entry(self.path, format!("metadata '{key}'"), expected, format!("'{text}'"));
        from(text).ok_or_else(wrong)
    }

    fn number<T: FromStr>(&self, key: &str) -> Result<T, BakeError> {
        self.value(key, "a number", |text| text.parse().ok())
    }
}
