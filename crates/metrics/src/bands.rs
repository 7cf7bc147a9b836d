//! Power by frequency band, and the level difference between the ears by octave.

use promenade_fourier::spectrum;

/// Middle of the lowest octave, hertz, and the number of octaves.
const LOWEST_HZ: f64 = 125.0;
const OCTAVES: usize = 7;
/// Octaves further below the loudest do not count, dB.
const AUDIBLE_DB: f64 = 40.0;
/// Level differences are limited to this, dB: a silent ear has no other.
const LARGEST_DB: f64 = 60.0;

/// Mean over octaves from 125 Hz to 8 kHz, as far as the rate holds them, of the absolute difference between two sounds'
/// interaural level differences, dB.
///
/// Octaves count where the second sound, the recording, is within 40 dB of its loudest octave; `None` where none does.
#[must_use]
pub fn band_ild_error_db(predicted: [&[f32]; 2], recorded: [&[f32]; 2], sample_rate_hz: f64) -> Option<f64> {
    let powers = |ears: [&[f32]; 2]| ears.map(|ear| octave_powers(ear, sample_rate_hz));
    let ([pl, pr], [rl, rr]) = (powers(predicted), powers(recorded));
    let loudest = rl.iter().zip(&rr).map(|(l, r)| l + r).fold(0.0, f64::max);
    if loudest <= 0.0 {
        return None;
    }
    let ild = |l: f64, r: f64| (10.0 * ((l + 1e-20) / (r + 1e-20)).log10()).clamp(-LARGEST_DB, LARGEST_DB);
    let errors: Vec<f64> = (0..rl.len())
        .filter(|&b| rl[b] + rr[b] >= loudest * 10.0_f64.powf(-AUDIBLE_DB / 10.0))
        .map(|b| (ild(pl[b], pr[b]) - ild(rl[b], rr[b])).abs())
        .collect();
    Some(errors.iter().sum::<f64>() / errors.len() as f64)
}

/// Power in octaves that lie below half of the sample rate.
fn octave_powers(x: &[f32], sample_rate_hz: f64) -> Vec<f64> {
    let edges =
        (0..OCTAVES).map(|o| LOWEST_HZ * 2.0_f64.powf(o as f64 - 0.5)).take_while(|low| 2.0 * low <= sample_rate_hz / 2.0);
    band_powers(x, sample_rate_hz, &edges.map(|low| (low, 2.0 * low)).collect::<Vec<_>>())
}

/// Power of a signal in bands given by their edges in hertz. It has no unit, but is comparable between signals of one length.
#[must_use]
pub fn band_powers(x: &[f32], sample_rate_hz: f64, bands: &[(f64, f64)]) -> Vec<f64> {
    if x.is_empty() {
        return vec![0.0; bands.len()];
    }
    let length = x.len().next_power_of_two().max(2);
    let spectrum = spectrum(x.iter().map(|&v| f64::from(v)), length);
    let bin = |hz: f64| ((hz * length as f64 / sample_rate_hz).ceil().max(0.0) as usize).min(spectrum.len());
    bands
        .iter()
        .map(|&(low, high)| spectrum[bin(low)..bin(high)].iter().map(|v| v.norm_sqr()).sum::<f64>() / length as f64)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_signals::noise;

    #[test]
    fn a_gain_on_one_ear_is_its_error() {
        let x: Vec<f32> = noise(3, 16_000).iter().map(|v| 0.3 * *v as f32).collect();
        let half: Vec<f32> = x.iter().map(|v| 0.5 * v).collect();
        let error = band_ild_error_db([&x, &half], [&x, &x], 16_000.0).unwrap();
        assert!((error - 20.0 * 2.0_f64.log10()).abs() < 1e-6, "{error}");
        assert_eq!(band_ild_error_db([&x, &x], [&[0.0; 8], &[0.0; 8]], 16_000.0), None);
        assert_eq!(octave_powers(&x, 16_000.0).len(), 6, "up to 5.7 kHz; the octave around 8 kHz is beyond");
    }
}
