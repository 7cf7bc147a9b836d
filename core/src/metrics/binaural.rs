//! The five figures of a binaural room response.

use super::{DecayRange, MetricError, c50_db, decay_time_s, ild_db, itd_s};
use thiserror::Error;

/// What two ears hear of a room from one source: direction, decay and clarity.
///
/// ITD and ILD compare the ears; T20, EDT and C50 are means over both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Binaural {
    /// Interaural time difference, seconds; positive when the left ear is later. See [`itd_s`].
    pub itd_s: f64,
    /// Interaural level difference, dB; positive when the left ear is louder. See [`ild_db`].
    pub ild_db: f64,
    /// Reverberation time from the decay between -5 and -25 dB, seconds; none where the response does not decay so far.
    pub t20_s: Option<f64>,
    /// Early decay time from the first 10 dB, seconds.
    pub edt_s: Option<f64>,
    /// Clarity, dB; none of a response that ends within 50 ms of its onset, as an anechoic one does. See [`c50_db`].
    pub c50_db: Option<f64>,
}

/// Which measure of a binaural response has no value, and why.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("no {measure} from this response: {source}")]
pub struct BinauralError {
    /// Name of the measure.
    pub measure: &'static str,
    /// Why it has no value.
    pub source: MetricError,
}

impl Binaural {
    /// Measures a response of two ears.
    ///
    /// # Errors
    /// Ears of different lengths, silence, a sample that is not finite, or a bad rate: nothing can be measured then.
    pub fn of_response(left: &[f32], right: &[f32], sample_rate_hz: f64) -> Result<Self, BinauralError> {
        let named = |measure| move |source| BinauralError { measure, source };
        let mean = |of: &dyn Fn(&[f32]) -> Result<f64, MetricError>| Some(0.5 * (of(left).ok()? + of(right).ok()?));
        Ok(Self {
            itd_s: itd_s(left, right, sample_rate_hz).map_err(named("ITD"))?,
            ild_db: ild_db(left, right).map_err(named("ILD"))?,
            t20_s: mean(&|h| decay_time_s(h, sample_rate_hz, DecayRange::T20)),
            edt_s: mean(&|h| decay_time_s(h, sample_rate_hz, DecayRange::EDT)),
            c50_db: mean(&|h| c50_db(h, sample_rate_hz)),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_signals::decaying_noise;
    use super::*;

    #[test]
    fn mirrors_when_the_ears_are_swapped() {
        let left = decaying_noise(3, 0.4, 0.8, 48_000.0);
        // The right ear hears the same 10 samples later and 6 dB softer.
        let right: Vec<f32> = std::iter::repeat_n(0.0, 10).chain(left.iter().map(|v| 0.5 * v)).take(left.len()).collect();
        let (a, b) =
            (Binaural::of_response(&left, &right, 48_000.0).unwrap(), Binaural::of_response(&right, &left, 48_000.0).unwrap());
        // The cut after 10 ms weighs the ears a little differently: a step of the grid to each side.
        assert!((a.itd_s + 10.0 / 48_000.0).abs() < 1.01 / 16.0 / 48_000.0, "the left ear leads: {}", a.itd_s);
        assert!((a.itd_s + b.itd_s).abs() < 1e-12 && (a.ild_db + b.ild_db).abs() < 1e-12);
        assert!((a.ild_db - 6.02).abs() < 0.01);
        assert_eq!((a.t20_s, a.edt_s, a.c50_db), (b.t20_s, b.edt_s, b.c50_db));
    }

    #[test]
    fn an_anechoic_response_has_direction_but_no_clarity() {
        let click = |at: usize| (0..512).map(|i| if i == at { 1.0 } else { 0.0 }).collect::<Vec<f32>>();
        let b = Binaural::of_response(&click(40), &click(44), 44_100.0).unwrap();
        assert!((b.itd_s + 4.0 / 44_100.0).abs() < 1e-5 && b.ild_db.abs() < 1e-9);
        assert_eq!(b.c50_db, None);
    }

    #[test]
    fn names_the_measure_that_fails() {
        let error = Binaural::of_response(&[0.0; 64], &[0.0; 64], 48_000.0).unwrap_err();
        assert!(error.to_string().contains("ITD"), "{error}");
    }
}
