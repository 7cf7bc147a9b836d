//! The measures of a binaural room response, and their errors over poses.

use promenade_core::{OCTAVES_HZ, ResponseMeasures, Scene};
use promenade_fourier::num_complex::Complex64;
use promenade_fourier::spectrum;
use promenade_metrics::{DecayRange, MetricError, c50_db, decay_time_s, ild_db, itd_s};
use std::f64::consts::SQRT_2;
use std::ops::RangeInclusive;
use thiserror::Error;

/// Lengths of rendered responses, seconds.
pub const RESPONSE_S: RangeInclusive<f64> = 0.25..=60.0;

/// Which measure of a response has no value, and why.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("no {measure} from this response: {source}")]
pub struct Unmeasurable {
    /// Name of the measure.
    pub measure: &'static str,
    /// Why it has no value.
    pub source: MetricError,
}

/// Measures a response of two ears.
///
/// # Errors
/// Ears of different lengths, silence, a sample that is not finite, or a bad rate: nothing can be measured then.
pub fn response_measures(left: &[f32], right: &[f32], sample_rate_hz: f64) -> Result<ResponseMeasures, Unmeasurable> {
    let named = |measure| move |source| Unmeasurable { measure, source };
    let mean = |of: &dyn Fn(&[f32]) -> Result<f64, MetricError>| Some(0.5 * (of(left).ok()? + of(right).ok()?));
    Ok(ResponseMeasures {
        itd_s: itd_s(left, right, sample_rate_hz).map_err(named("ITD"))?,
        ild_db: ild_db(left, right).map_err(named("ILD"))?,
        t20_s: mean(&|h| decay_time_s(h, sample_rate_hz, DecayRange::T20)),
        edt_s: mean(&|h| decay_time_s(h, sample_rate_hz, DecayRange::EDT)),
        c50_db: mean(&|h| c50_db(h, sample_rate_hz)),
    })
}

/// Energy of a response over both ears, dB: of the whole band, then of each octave from 125 Hz on whose upper edge the rate
/// has.
#[must_use]
pub fn response_levels_db(left: &[f32], right: &[f32], sample_rate_hz: f64) -> Vec<f64> {
    let length = left.len().max(right.len()).next_power_of_two().max(2);
    let spectra = [left, right].map(|ear| spectrum(ear.iter().map(|v| f64::from(*v)), length));
    let energy = |from_hz: f64, to_hz: f64| -> f64 {
        let place = |hz: f64| ((hz * length as f64 / sample_rate_hz).ceil() as usize).min(length / 2 + 1);
        let energy = |x: &[Complex64]| x[place(from_hz)..place(to_hz)].iter().map(Complex64::norm_sqr).sum::<f64>();
        2.0 * spectra.iter().map(|ear| energy(ear)).sum::<f64>() / length as f64
    };
    let octaves = OCTAVES_HZ.iter().map(|hz| (f64::from(*hz) / SQRT_2, f64::from(*hz) * SQRT_2));
    let octaves = octaves.filter(|(_, high)| *high < 0.5 * sample_rate_hz);
    let bands = std::iter::once((0.0, sample_rate_hz)).chain(octaves);
    bands.map(|(low, high)| 10.0 * energy(low, high).max(1e-30).log10()).collect()
}

/// Mean absolute errors of the levels over comparisons, dB, as [`response_levels_db`]; empty where none has any.
#[must_use]
pub fn mean_level_errors_db(comparisons: &[Comparison]) -> Vec<f64> {
    let known: Vec<&[Vec<f64>; 2]> = comparisons.iter().map(|c| &c.levels_db).filter(|l| !l[0].is_empty()).collect();
    let bands = known.iter().map(|[a, b]| a.len().min(b.len())).min().unwrap_or(0);
    let mean = |band: usize| known.iter().map(|[a, b]| (b[band] - a[band]).abs()).sum::<f64>() / known.len() as f64;
    (0..bands).map(mean).collect()
}

/// The length of response in which a scene's decays can be measured, seconds: one and a half times the longest reverberation
/// time.
#[must_use]
pub fn response_s(scene: &Scene) -> f64 {
    (1.5 * f64::from(scene.tail().longest_t60_s())).clamp(*RESPONSE_S.start(), *RESPONSE_S.end())
}

/// One pose: what was measured there and what the render head makes of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// Name of the measurement.
    pub name: String,
    /// Measures of the room.
    pub measured: ResponseMeasures,
    /// Measures of the rendered response.
    pub rendered: ResponseMeasures,
    /// Levels of both as [`response_levels_db`] has them; empty where they are not known.
    pub levels_db: [Vec<f64>; 2],
}

/// Mean absolute errors over poses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeanErrors {
    /// Interaural time difference, seconds.
    pub itd_s: f64,
    /// Interaural level difference, dB.
    pub ild_db: f64,
    /// Reverberation time T20, as a share of the measured one; `None` where no pose has one.
    pub t20: Option<f64>,
    /// Early decay time, as a share of the measured one.
    pub edt: Option<f64>,
    /// Clarity C50, dB.
    pub c50_db: Option<f64>,
}

impl MeanErrors {
    /// Means over comparisons; `None` if there are none.
    #[must_use]
    pub fn of(comparisons: &[Comparison]) -> Option<Self> {
        let mean = |of: fn(&Comparison) -> Option<f64>| {
            let errors: Vec<f64> = comparisons.iter().filter_map(of).map(f64::abs).collect();
            (!errors.is_empty()).then(|| errors.iter().sum::<f64>() / errors.len() as f64)
        };
        Some(Self {
            itd_s: mean(|c| Some(c.rendered.itd_s - c.measured.itd_s))?,
            ild_db: mean(|c| Some(c.rendered.ild_db - c.measured.ild_db))?,
            t20: mean(|c| Some(c.rendered.t20_s? / c.measured.t20_s? - 1.0)),
            edt: mean(|c| Some(c.rendered.edt_s? / c.measured.edt_s? - 1.0)),
            c50_db: mean(|c| Some(c.rendered.c50_db? - c.measured.c50_db?)),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_core::random::Random;

    #[test]
    fn mirrors_when_the_ears_are_swapped() {
        // Noise that decays by 60 dB in 0.4 s.
        let mut random = Random::new(3);
        let left: Vec<f32> = (0..38_400).map(|i| random.normal() * 10.0_f32.powf(-3.0 * i as f32 / 19_200.0)).collect();
        // The right ear hears the same 10 samples later and 6 dB softer.
        let right: Vec<f32> = std::iter::repeat_n(0.0, 10).chain(left.iter().map(|v| 0.5 * v)).take(left.len()).collect();
        let (a, b) = (response_measures(&left, &right, 48_000.0).unwrap(), response_measures(&right, &left, 48_000.0).unwrap());
        // The cut after 10 ms weighs the ears a little differently: a step of the grid to each side.
        assert!((a.itd_s + 10.0 / 48_000.0).abs() < 1.01 / 16.0 / 48_000.0, "the left ear leads: {}", a.itd_s);
        assert!((a.itd_s + b.itd_s).abs() < 1e-12 && (a.ild_db + b.ild_db).abs() < 1e-12);
        assert!((a.ild_db - 6.02).abs() < 0.01);
        assert_eq!((a.t20_s, a.edt_s, a.c50_db), (b.t20_s, b.edt_s, b.c50_db));
    }

    #[test]
    fn levels_are_those_of_octaves_and_add_up_over_both_ears() {
        let tone =
            |hz: f32| (0..48_000).map(|i| (std::f32::consts::TAU * hz * i as f32 / 48_000.0).sin()).collect::<Vec<f32>>();
        let (left, right) = (tone(250.0), tone(4_000.0));
        let levels = response_levels_db(&left, &right, 48_000.0);
        // Of each a power of a half for a second.
        let one = 10.0 * 24_000.0_f64.log10();
        assert_eq!(levels.len(), 8);
        assert!((levels[0] - one - 3.01).abs() < 0.05, "{levels:?}");
        for (band, level) in levels[1..].iter().enumerate() {
            let expected = if band == 1 || band == 5 { (level - one).abs() < 0.1 } else { *level < one - 20.0 };
            assert!(expected, "octave {band}: {level}");
        }
        assert_eq!(response_levels_db(&left, &right, 16_000.0).len(), 7, "no octave beyond the rate");
    }

    #[test]
    fn an_anechoic_response_has_direction_but_no_clarity() {
        let click = |at: usize| (0..512).map(|i| if i == at { 1.0 } else { 0.0 }).collect::<Vec<f32>>();
        let b = response_measures(&click(40), &click(44), 44_100.0).unwrap();
        assert!((b.itd_s + 4.0 / 44_100.0).abs() < 1e-5 && b.ild_db.abs() < 1e-9);
        assert_eq!(b.c50_db, None);
    }

    #[test]
    fn names_the_measure_that_fails() {
        let error = response_measures(&[0.0; 64], &[0.0; 64], 48_000.0).unwrap_err();
        assert!(error.to_string().contains("ITD"), "{error}");
    }
}
