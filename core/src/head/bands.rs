//! The bands of a head: half an equivalent rectangular bandwidth apart, as finely as the ear resolves them (Breebaart and
//! Kohlrausch 2001).

use crate::number::{single, whole};

/// Bands that the levels of a head are kept in.
pub const HEAD_BANDS: usize = 80;
/// The first band and the distance between two, on the scale of equivalent rectangular bandwidths: 55 Hz to 19.7 kHz.
const FIRST: f64 = 2.0;
const STEP: f64 = 0.5;

/// Centre of a band, Hz (Glasberg and Moore 1990, equation 4).
#[must_use]
pub fn head_band_hz(band: usize) -> f64 {
    (10.0_f64.powf((FIRST + STEP * band as f64) / 21.4) - 1.0) / 0.004_37
}

/// The band below a frequency, and how far it lies towards the next, 0 to 1.
pub(super) fn place(hz: f64) -> (usize, f32) {
    let along = (21.4 * (1.0 + 0.004_37 * hz.max(0.0)).log10() - FIRST) / STEP;
    let along = along.clamp(0.0, (HEAD_BANDS - 1) as f64);
    let band = whole(along).min(HEAD_BANDS - 2);
    (band, single(along - band as f64))
}
