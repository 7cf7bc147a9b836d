//! The frequencies at which a room is fitted: 16, evenly on a logarithmic scale, straight lines between them.

use super::octaves::FITTED_HZ;

/// How many bands there are.
pub const BANDS: usize = 16;
/// The lowest, hertz: an early window of 50 ms tells nothing below.
const LOWEST_HZ: f64 = 80.0;
/// The highest, as a share of the sample rate.
const HIGHEST: f64 = 0.475;

/// A number for each band.
pub type PerBand = [f64; BANDS];

/// Where the bands lie.
#[derive(Clone, Debug, PartialEq)]
pub struct Bands {
    /// Their middles, hertz.
    pub centres_hz: PerBand,
}

impl Bands {
    /// For a sample rate, hertz.
    #[must_use]
    pub fn new(sample_rate_hz: f64) -> Self {
        let ratio = HIGHEST * sample_rate_hz / LOWEST_HZ;
        Self { centres_hz: std::array::from_fn(|b| LOWEST_HZ * ratio.powf(b as f64 / (BANDS - 1) as f64)) }
    }

    /// The band below a frequency, and how far it is on the way to the next, 0 to 1.
    #[must_use]
    pub fn place(&self, hz: f64) -> (usize, f64) {
        let last = (BANDS - 1) as f64;
        let ratio = self.centres_hz[BANDS - 1] / LOWEST_HZ;
        let at = ((hz.max(1.0) / LOWEST_HZ).ln() / ratio.ln() * last).clamp(0.0, last);
        let below = (at as usize).min(BANDS - 2);
        (below, at - below as f64)
    }

    /// Values at the bands of values at octaves, straight lines between them on a logarithmic scale of frequency.
    #[must_use]
    pub fn from_octaves(&self, octaves: &[f64]) -> PerBand {
        self.centres_hz.map(|hz| {
            let last = octaves.len().saturating_sub(1);
            let at = (hz / FITTED_HZ[0]).log2().clamp(0.0, last as f64);
            let below = (at as usize).min(last.saturating_sub(1));
            let fraction = at - below as f64;
            octaves[below] * (1.0 - fraction) + octaves[(below + 1).min(last)] * fraction
        })
    }

    /// Values at the bands of values at seven octaves from 125 Hz, as materials have them.
    pub(crate) fn of_material_octaves(&self, octaves: &[f64; 7]) -> PerBand {
        self.from_octaves(&std::array::from_fn::<f64, 8, _>(|o| octaves[o.saturating_sub(1)]))
    }

    /// Octaves from one band to the next.
    pub(crate) fn octaves_apart(&self) -> f64 {
        (self.centres_hz[BANDS - 1] / self.centres_hz[0]).log2() / (BANDS - 1) as f64
    }

    /// Values at octaves of values at the bands: the means over each octave.
    #[must_use]
    pub fn to_octaves(&self, bands: &PerBand) -> [f64; 8] {
        const POINTS: usize = 9;
        std::array::from_fn(|o| {
            let hz = |i: usize| FITTED_HZ[o] * 2f64.powf(i as f64 / (POINTS - 1) as f64 - 0.5);
            let value = |i: usize| {
                let (below, fraction) = self.place(hz(i));
                bands[below] * (1.0 - fraction) + bands[below + 1] * fraction
            };
            (0..POINTS).map(value).sum::<f64>() / POINTS as f64
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slope_stays_a_slope_from_octaves_to_bands_and_back() {
        let bands = Bands::new(16_000.0);
        let octaves: Vec<f64> = (0..8).map(|o| 0.1 * f64::from(o)).collect();
        let back = bands.to_octaves(&bands.from_octaves(&octaves));
        for (a, b) in octaves[2..7].iter().zip(&back[2..7]) {
            assert!((a - b).abs() < 0.01, "{octaves:?} {back:?}");
        }
        assert_eq!(bands.place(80.0), (0, 0.0));
        assert_eq!(bands.place(1e5), (BANDS - 2, 1.0));
    }
}
