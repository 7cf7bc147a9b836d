//! Where a listener points: a Bayesian model of what ears tell about a direction.
//!
//! Delay and level between the ears and the spectra at each, with noise, are compared with those that the listener knows, and
//! weighed by a prior for the horizon (Barumerli, Majdak, Geronazzo, Meijer, Avanzini and Baumgartner, "A Bayesian model for
//! human directional localization of broadband static sound sources", Acta Acustica 7:12, 2023). Parameters are the means over
//! listeners that its authors give with their toolbox.

use crate::{MetricError, ild_db, itd_s, onset};
use promenade_fourier::num_complex::Complex64;
use promenade_fourier::{signal, spectrum};
use std::f64::consts::PI;

/// Threshold of a delay between the ears, seconds, and how it grows with the delay.
const DELAY_S: f64 = 32.5e-6;
const DELAY_GROWTH: f64 = 0.095;
/// Standard deviations of the noise: of a delay in such thresholds, of a level difference and of a band's level, dB.
const NOISE: [f64; 3] = [0.569, 1.0, 10.4];
/// Cues between the ears, which come before the levels.
const CUES_BETWEEN: usize = 2;
/// Width of the prior, degrees of elevation.
const PRIOR_DEG: f64 = 69.0;
/// Bands, Hz, one equivalent rectangular bandwidth apart (Glasberg and Moore 1990), and the highest as a share of the rate.
const BANDS_HZ: (f64, f64) = (700.0, 18_000.0);
const HIGHEST: f64 = 0.45;
/// The direct sound begins so long before the earlier onset, is whole until and has faded out by so long after it, seconds.
const DIRECT_S: [f64; 3] = [0.001, 0.0025, 0.0035];
/// Length of a band's response, seconds.
const RINGS_S: f64 = 0.04;

/// What ears tell about the direction of a direct sound.
#[derive(Clone, Debug, PartialEq)]
pub struct Cues {
    /// Delay in thresholds, level difference and levels by band, each over the standard deviation of its noise.
    values: Vec<f64>,
}

impl Cues {
    /// Of the direct sound of a response.
    ///
    /// # Errors
    /// As [`itd_s`] and [`ild_db`].
    pub fn of(left: &[f32], right: &[f32], sample_rate_hz: f64) -> Result<Self, MetricError> {
        let first = onset(left).unwrap_or(0).min(onset(right).unwrap_or(0));
        let direct = [left, right].map(|ear| direct(ear, first, sample_rate_hz));
        let itd_s = itd_s(&direct[0], &direct[1], sample_rate_hz)?;
        let itd = itd_s.signum() * (1.0 + DELAY_GROWTH * itd_s.abs() / DELAY_S).ln() / DELAY_GROWTH;
        let mut values = vec![itd / NOISE[0], ild_db(&direct[0], &direct[1])? / NOISE[1]];
        for ear in &direct {
            values.extend(band_levels_db(ear, sample_rate_hz).into_iter().map(|level| level / NOISE[2]));
        }
        Ok(Self { values })
    }

    /// Mean level of all bands of both ears, dB.
    #[must_use]
    pub fn level_db(&self) -> f64 {
        let levels = self.values.get(CUES_BETWEEN..).unwrap_or(&[]);
        NOISE[2] * levels.iter().sum::<f64>() / levels.len().max(1) as f64
    }

    /// The same heard louder.
    #[must_use]
    pub fn raised(mut self, db: f64) -> Self {
        self.values.iter_mut().skip(CUES_BETWEEN).for_each(|level| *level += db / NOISE[2]);
        self
    }

    /// Numbers in it: how long draws of noise must be.
    #[must_use]
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }
}

/// Directions that a listener points at, one for each draw of noise: those of what is known that is most probable. `known` has
/// unit vectors (forward, left, up) with the cues that the listener knows from there; `noise` standard normal numbers.
#[must_use]
pub fn pointed(heard: &Cues, known: &[([f64; 3], Cues)], noise: &[Vec<f64>]) -> Vec<[f64; 3]> {
    let point = |draw: &Vec<f64>| {
        let probable = |(direction, cues): &([f64; 3], Cues)| -> f64 {
            let parts = heard.values.iter().zip(draw).zip(&cues.values);
            let distance: f64 = parts.map(|((heard, noise), known)| (heard + noise - known).powi(2)).sum();
            let elevation = direction[2].clamp(-1.0, 1.0).asin().to_degrees();
            -0.5 * (distance + (elevation / PRIOR_DEG).powi(2))
        };
        let best = known.iter().max_by(|a, b| probable(a).total_cmp(&probable(b)));
        best.map_or([1.0, 0.0, 0.0], |known| known.0)
    };
    noise.iter().map(point).collect()
}

/// The lateral angle of a direction, degrees, positive to the left.
#[must_use]
pub fn lateral_deg(direction: [f64; 3]) -> f64 {
    direction[1].clamp(-1.0, 1.0).asin().to_degrees()
}

/// The direct sound of an ear.
fn direct(ear: &[f32], first: usize, rate: f64) -> Vec<f32> {
    let [before, whole, end] = DIRECT_S.map(|s| (s * rate) as usize);
    let from = first.saturating_sub(before);
    let fade = |i: usize| {
        let along = (i as f64 - (first + whole) as f64) / (end - whole).max(1) as f64;
        0.5 + 0.5 * (PI * along.clamp(0.0, 1.0)).cos()
    };
    (from..(first + end).min(ear.len())).map(|i| (f64::from(ear[i]) * fade(i)) as f32).collect()
}

/// Mean of each band's sound, rectified, dB: gammatone filters of fourth order (Patterson, Holdsworth, Nimmo-Smith and Rice
/// 1987), whose response about their centre is that of a low-pass.
fn band_levels_db(ear: &[f32], rate: f64) -> Vec<f64> {
    let erbs = |hz: f64| 21.4 * (1.0 + 0.00437 * hz).log10();
    let highest = erbs(BANDS_HZ.1.min(HIGHEST * rate));
    let lowest = erbs(BANDS_HZ.0);
    let n_fft = ((RINGS_S * rate) as usize + ear.len()).next_power_of_two();
    let heard = spectrum(ear.iter().map(|v| f64::from(*v)), n_fft);
    let level = |band: u32| {
        let hz = (10.0_f64.powf((lowest + f64::from(band)) / 21.4) - 1.0) / 0.00437;
        let width = 1.019 * 24.7 * (1.0 + 0.00437 * hz);
        let filtered = heard.iter().enumerate().map(|(k, x)| {
            let beside = (k as f64 * rate / n_fft as f64 - hz) / width;
            x * Complex64::new(1.0, beside).powi(-4)
        });
        let sound = signal(filtered.collect(), n_fft);
        10.0 * (sound.iter().map(|x: &f64| x.max(0.0)).sum::<f64>() / n_fft as f64).max(1e-12).log10()
    };
    (0..=(highest - lowest).max(0.0) as u32).map(level).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_signals::noise;

    const RATE: f64 = 48_000.0;

    /// A click that is earlier and louder at the ear of its side.
    fn cues(lateral_deg: f64) -> Cues {
        let side = lateral_deg.to_radians().sin();
        let ear = |sign: f64| -> Vec<f32> {
            let at = 60.0 - sign * 14.0 * side;
            let pulse = |i: usize| (-((i as f64 - at) / 2.0).powi(2)).exp() * 10.0_f64.powf(0.4 * sign * side);
            (0..512).map(|i| pulse(i) as f32).collect()
        };
        Cues::of(&ear(1.0), &ear(-1.0), RATE).unwrap()
    }

    #[test]
    fn a_listener_points_to_where_the_cues_are_known_from_and_is_wrong_by_what_they_differ() {
        let direction = |deg: f64| [deg.to_radians().cos(), deg.to_radians().sin(), 0.0];
        let known: Vec<_> = (-18..=18).map(|i| 5.0 * f64::from(i)).map(|deg| (direction(deg), cues(deg))).collect();
        let draws: Vec<Vec<f64>> = (0..40).map(|seed| noise(seed, known[0].1.len())).collect();
        let mean = |heard: f64| {
            let points = pointed(&cues(heard), &known, &draws);
            points.iter().map(|d| lateral_deg(*d)).sum::<f64>() / points.len() as f64
        };
        for deg in [-40.0, 0.0, 25.0] {
            assert!((mean(deg) - deg).abs() < 3.0, "{deg}: {}", mean(deg));
        }
        assert!((mean(20.0) - mean(10.0) - 10.0).abs() < 3.0, "{} {}", mean(20.0), mean(10.0));
    }
}
