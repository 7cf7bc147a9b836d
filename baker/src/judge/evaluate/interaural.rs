//! Differences between the ears in running sound.

use realfft::RealFftPlanner;
use realfft::num_complex::Complex64;

/// Upper edge of the band in which people localise by time, hertz.
const TIME_TOP_HZ: f64 = 1500.0;
/// No head is wider than this, seconds.
const LARGEST_LAG_S: f64 = 1e-3;
/// Middle of the lowest octave, hertz, and the number of octaves.
const LOWEST_HZ: f64 = 125.0;
const OCTAVES: usize = 7;
/// Octaves further below the loudest do not count, dB.
const AUDIBLE_DB: f64 = 40.0;
/// Level differences are limited to this, dB: a silent ear has no other.
const LARGEST_DB: f64 = 60.0;

/// Interaural time difference of running sound, seconds, positive when the left ear is later: the maximum within 1 ms of the ears'
/// cross-correlation below 1.5 kHz over the whole clip, between samples by a parabola. `None` where an ear is silent.
///
/// The whole clip counts, reflections too: in a reverberant place it is not that of the direct sound.
#[must_use]
pub fn running_itd_s([left, right]: [&[f32]; 2], sample_rate_hz: f64) -> Option<f64> {
    if left.is_empty() || sample_rate_hz <= 0.0 {
        return None;
    }
    let length = (2 * left.len().max(right.len())).next_power_of_two();
    let (l, r) = (spectrum(left, length), spectrum(right, length));
    let mut cross: Vec<Complex64> = l
        .iter()
        .zip(&r)
        .enumerate()
        .map(|(bin, (l, r))| {
            let inside = bin > 0 && bin < length / 2 && bin as f64 * sample_rate_hz / length as f64 <= TIME_TOP_HZ;
            if inside { l * r.conj() } else { Complex64::default() }
        })
        .collect();
    let plan = RealFftPlanner::<f64>::new().plan_fft_inverse(length);
    let mut correlation = plan.make_output_vec();
    plan.process(&mut cross, &mut correlation).ok()?;
    #[expect(clippy::cast_possible_truncation, reason = "a millisecond in samples")]
    let reach = (LARGEST_LAG_S * sample_rate_hz) as i64;
    let length = i64::try_from(length).ok()?;
    let at = |lag: i64| usize::try_from(lag.rem_euclid(length)).ok().and_then(|i| correlation.get(i)).copied().unwrap_or(0.0);
    let best = (-reach..=reach).max_by(|a, b| at(*a).total_cmp(&at(*b)))?;
    if at(best) <= 0.0 {
        return None;
    }
    let (before, peak, after) = (at(best - 1), at(best), at(best + 1));
    let bend = before - 2.0 * peak + after;
    let part = if bend < 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 };
    Some((best as f64 + part) / sample_rate_hz)
}

/// Mean over octaves from 125 Hz to 8 kHz, as far as the rate holds them, of the absolute difference between two sounds' interaural
/// level differences, dB. Octaves count where the second sound, the recording, is within 40 dB of its loudest octave. `None` where
/// none does.
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

/// Power of a signal between frequencies, hertz; no unit but the same for all signals of one length.
pub(super) fn band_powers(x: &[f32], sample_rate_hz: f64, bands: &[(f64, f64)]) -> Vec<f64> {
    if x.is_empty() {
        return vec![0.0; bands.len()];
    }
    let length = x.len().next_power_of_two().max(2);
    let spectrum = spectrum(x, length);
    let bin = |hz: f64| {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a bin")]
        let bin = (hz * length as f64 / sample_rate_hz).ceil().max(0.0) as usize;
        bin.min(spectrum.len())
    };
    bands
        .iter()
        .map(|&(low, high)| spectrum[bin(low)..bin(high)].iter().map(|v| v.norm_sqr()).sum::<f64>() / length as f64)
        .collect()
}

fn spectrum(x: &[f32], length: usize) -> Vec<Complex64> {
    let plan = RealFftPlanner::<f64>::new().plan_fft_forward(length);
    let mut time = plan.make_input_vec();
    time.iter_mut().zip(x).for_each(|(to, from)| *to = f64::from(*from));
    let mut out = plan.make_output_vec();
    // The lengths come from the plan itself, the only thing that the transform checks.
    let done = plan.process(&mut time, &mut out);
    debug_assert!(done.is_ok());
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(count: usize) -> Vec<f32> {
        let mut state = 3_u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / 8_388_608.0 - 1.0
        };
        (0..count).map(|_| 0.3 * next()).collect()
    }

    #[test]
    fn a_later_left_ear_is_positive() {
        let x = noise(16_000);
        let [at_once, late] = crate::signal::convolve::shape(&x, 16_000.0, |hz| {
            let turn = -std::f64::consts::TAU * hz * 312e-6;
            [1.0_f32.into(), realfft::num_complex::Complex32::from_polar(0.5, turn as f32)]
        });
        let itd = running_itd_s([&late, &at_once], 16_000.0).unwrap();
        assert!((itd - 312e-6).abs() < 5e-6, "{itd}");
        let itd = running_itd_s([&at_once, &late], 16_000.0).unwrap();
        assert!((itd + 312e-6).abs() < 5e-6, "{itd}");
        assert_eq!(running_itd_s([&at_once, &vec![0.0; 16_000]], 16_000.0), None);
    }

    #[test]
    fn a_gain_on_one_ear_is_its_error() {
        let x = noise(16_000);
        let half: Vec<f32> = x.iter().map(|v| 0.5 * v).collect();
        let error = band_ild_error_db([&x, &half], [&x, &x], 16_000.0).unwrap();
        assert!((error - 20.0 * 2.0_f64.log10()).abs() < 1e-6, "{error}");
        assert_eq!(band_ild_error_db([&x, &x], [&[0.0; 8], &[0.0; 8]], 16_000.0), None);
        assert_eq!(octave_powers(&x, 16_000.0).len(), 6, "up to 5.7 kHz; the octave around 8 kHz is beyond");
    }
}
