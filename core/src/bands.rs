//! Frequency bands of the time filters: piecewise linear between centres.

use crate::number::single;

/// Band centres in rising order; a value per band is interpolated linearly in Hz between centres and held beyond the ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Bands {
    centres_hz: Vec<f32>,
}

/// A bin's place between two bands: `value = v[band] + fraction * (v[band + 1] - v[band])`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BandPlace {
    pub(crate) band: usize,
    pub(crate) fraction: f32,
}

impl Bands {
    /// Takes at least two finite centres in strictly rising order, Hz; `None` otherwise.
    #[must_use]
    pub fn new(centres_hz: Vec<f32>) -> Option<Self> {
        let rising = centres_hz.windows(2).all(|w| w[0] < w[1]);
        (centres_hz.len() >= 2 && rising && centres_hz.iter().all(|c| c.is_finite() && *c >= 0.0))
            .then_some(Self { centres_hz })
    }

    /// Bands for responses sampled at `sample_rate_hz`: 150 Hz apart at the bottom, a fifth of the frequency apart above 750
    /// Hz.
    ///
    /// The spacing follows the ear's critical bandwidth (Zwicker and Terhardt 1980) with a floor set by hops of some
    /// milliseconds.
    #[must_use]
    pub fn for_rate(sample_rate_hz: f64) -> Self {
        let nyquist = single(0.5 * sample_rate_hz);
        let mut centres_hz = vec![75.0_f32.min(0.25 * nyquist)];
        let mut c = centres_hz[0];
        loop {
            let step = (0.2 * c).max(150.0_f32.min(0.25 * nyquist));
            if c + 1.5 * step > nyquist {
                break;
            }
            c += step;
            centres_hz.push(c);
        }
        centres_hz.push(nyquist);
        Self { centres_hz }
    }

    /// Number of bands.
    #[must_use]
    pub fn count(&self) -> usize {
        self.centres_hz.len()
    }

    /// Band centres, Hz, rising.
    #[must_use]
    pub fn centres_hz(&self) -> &[f32] {
        &self.centres_hz
    }

    /// Where a frequency lies among the centres.
    pub(crate) fn place(&self, hz: f32) -> BandPlace {
        let last = self.centres_hz.len() - 2;
        let band = self.centres_hz.partition_point(|&c| c <= hz).saturating_sub(1).min(last);
        let (a, b) = (self.centres_hz[band], self.centres_hz[band + 1]);
        BandPlace { band, fraction: ((hz - a) / (b - a)).clamp(0.0, 1.0) }
    }

    /// How much of each band a frequency takes: weights that sum to 1, as `(band, weight)` of the two bands around it.
    #[must_use]
    pub fn weights(&self, hz: f32) -> [(usize, f32); 2] {
        let p = self.place(hz);
        [(p.band, 1.0 - p.fraction), (p.band + 1, p.fraction)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_sum_to_one_and_hold_beyond_the_ends() {
        let bands = Bands::for_rate(16_000.0);
        for hz in [0.0, 75.0, 100.0, 999.0, 8000.0, 20_000.0] {
            let w = bands.weights(hz);
            assert!((w[0].1 + w[1].1 - 1.0).abs() < 1e-6);
            assert!(w.iter().all(|(b, v)| *b < bands.count() && (0.0..=1.0).contains(v)));
        }
        assert!((bands.weights(8000.0)[1].1 - 1.0).abs() < 1e-6);
    }

    #[test]
    fn every_rate_has_rising_bands_up_to_nyquist() {
        for rate in [1000.0, 8000.0, 16_000.0, 44_100.0, 192_000.0] {
            let b = Bands::for_rate(rate);
            assert!(Bands::new(b.centres_hz().to_vec()).is_some(), "{rate}");
            assert!((f64::from(b.centres_hz()[b.count() - 1]) - rate / 2.0).abs() < 1.0);
        }
        assert!(Bands::new(vec![1.0, 1.0]).is_none());
    }
}
