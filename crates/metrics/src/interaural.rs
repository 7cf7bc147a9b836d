//! Differences between the ears: time below 1.5 kHz, level over the whole band.

use crate::{MetricError, check_finite, check_pair, check_rate, energy, onset, samples_in};
use promenade_fourier::num_complex::Complex64;
use promenade_fourier::{signal, spectrum};
use std::f64::consts::PI;

/// Upper edge of the band in which people localise by time, hertz.
const CUTOFF_HZ: f64 = 1500.0;
/// No head is wider than this, seconds.
const LARGEST_LAG_S: f64 = 1e-3;
/// A maximum of the cross-correlation that has this share of the highest may be heard in its place.
const NEARLY: f64 = 0.9;
/// The lag of responses is found on a grid this much finer than the samples.
const OVERSAMPLING: usize = 16;
/// Samples of a response kept before the earlier onset.
const LEAD: usize = 8;
/// Time of a response kept after the earlier onset, seconds: the direct sound, before most reflections.
const DIRECT_S: f64 = 0.010;
/// Bins of running sound's spectra are at most this wide, hertz, so that the band's upper edge is where it should be.
const WIDEST_BIN_HZ: f64 = 32.0;

/// Interaural time difference of a response, seconds; positive when the left ear is later.
///
/// Both ears are low-passed (4th-order Butterworth, 1.5 kHz), cut from 8 samples before the earlier onset to 10 ms after it,
/// and oversampled 16 times; the lag of the cross-correlation's maximum within 1 ms is the ITD, on a grid of 1/16 sample.
///
/// # Errors
/// Ears of different lengths, a silent ear, a sample that is not finite, or a rate that does not hold 1.5 kHz.
pub fn itd_s(left: &[f32], right: &[f32], sample_rate_hz: f64) -> Result<f64, MetricError> {
    let (lags, reach, rate) = direct_lags(left, right, sample_rate_hz)?;
    Ok(lags.strongest(reach) as f64 / rate)
}

/// The interaural time differences that a response may have, seconds, as [`itd_s`]: that of the highest maximum of the
/// cross-correlation, and those of others within 1 ms that have at least nine tenths of it.
///
/// # Errors
/// Those of [`itd_s`].
pub fn itds_s(left: &[f32], right: &[f32], sample_rate_hz: f64) -> Result<Vec<f64>, MetricError> {
    let (lags, reach, rate) = direct_lags(left, right, sample_rate_hz)?;
    let (strongest, reach) = (lags.strongest(reach), reach as i64);
    let is_high = |lag: i64| lags.at(lag) >= NEARLY * lags.at(strongest);
    let is_top = |lag: i64| lags.at(lag) >= lags.at(lag - 1) && lags.at(lag) > lags.at(lag + 1);
    let all = (-reach..=reach).filter(|lag| *lag == strongest || (is_high(*lag) && is_top(*lag)));
    Ok(all.map(|lag| lag as f64 / rate).collect())
}

/// The cross-correlation of the direct sound's ears, the lags within 1 ms, and how many a second has.
fn direct_lags(left: &[f32], right: &[f32], sample_rate_hz: f64) -> Result<(Lags, usize, f64), MetricError> {
    check_rate(sample_rate_hz)?;
    check_pair(left, right)?;
    if sample_rate_hz <= 2.0 * CUTOFF_HZ {
        return Err(MetricError::Frequency { found: CUTOFF_HZ, limit: sample_rate_hz / 2.0 });
    }
    let earlier = onset(left).ok_or(MetricError::Silent)?.min(onset(right).ok_or(MetricError::Silent)?);
    let start = earlier.saturating_sub(LEAD);
    let stop = (start + LEAD).saturating_add(samples_in(DIRECT_S, sample_rate_hz)).min(left.len());
    let direct = |ear: &[f32]| oversample(&low_pass(&ear[..stop], sample_rate_hz)[start..]);
    let (left, right) = (direct(left), direct(right));
    let rate = sample_rate_hz * OVERSAMPLING as f64;
    let lags = Lags::new(&left, &right, 2 * left.len(), |_| true);
    Ok((lags, samples_in(LARGEST_LAG_S, rate).min(left.len() - 1), rate))
}

/// Interaural time difference of running sound, seconds, positive when the left ear is later: the maximum within 1 ms of the
/// ears' cross-correlation below 1.5 kHz (Knapp and Carter 1976), between samples by a parabola. `None` where an ear is silent.
///
/// All that is given counts, reflections too: in a reverberant place it is not that of the direct sound.
#[must_use]
pub fn running_itd_s<T: Copy + Into<f64>>([left, right]: [&[T]; 2], sample_rate_hz: f64) -> Option<f64> {
    if left.is_empty() || sample_rate_hz <= 0.0 {
        return None;
    }
    let length = (2 * left.len().max(right.len())).max((sample_rate_hz / WIDEST_BIN_HZ) as usize).next_power_of_two();
    let inside = |bin: usize| bin > 0 && bin < length / 2 && bin as f64 * sample_rate_hz / length as f64 <= CUTOFF_HZ;
    let lags = Lags::new(left, right, length, inside);
    let best = lags.strongest(samples_in(LARGEST_LAG_S, sample_rate_hz));
    let [before, peak, after] = [-1, 0, 1].map(|i| lags.at(best + i));
    if peak <= 0.0 {
        return None;
    }
    let bend = before - 2.0 * peak + after;
    let part = if bend < 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 };
    Some((best as f64 + part) / sample_rate_hz)
}

/// Interaural cross-correlation coefficient, 0 to 1: the maximum within 1 ms of the cross-correlation over the root of the
/// product of their energies (ISO 3382-1:2009, annex B). `None` where an ear is silent.
#[must_use]
pub fn interaural_coherence([left, right]: [&[f32]; 2], sample_rate_hz: f64) -> Option<f64> {
    let energies = energy(left) * energy(right);
    if energies.is_nan() || energies <= 0.0 || sample_rate_hz <= 0.0 {
        return None;
    }
    let lags = Lags::new(left, right, 2 * left.len().max(right.len()), |_| true);
    Some(lags.at(lags.strongest(samples_in(LARGEST_LAG_S, sample_rate_hz))) / energies.sqrt())
}

/// The cross-correlation of two ears by lag; positive when the left ear is later.
struct Lags(Vec<f64>);

impl Lags {
    /// Of the frequency bins that are `inside`, by a transform of at least `length` samples.
    fn new<T: Copy + Into<f64>>(left: &[T], right: &[T], length: usize, inside: impl Fn(usize) -> bool) -> Self {
        let length = length.next_power_of_two();
        let [left, right] = [left, right].map(|ear| spectrum(ear.iter().map(|&v| v.into()), length));
        let bins = left.iter().zip(&right).enumerate();
        let cross = bins.map(|(k, (l, r))| if inside(k) { l * r.conj() } else { Complex64::default() });
        Self(signal(cross.collect(), length))
    }

    fn at(&self, lag: i64) -> f64 {
        self.0[lag.rem_euclid(self.0.len() as i64) as usize]
    }

    /// The lag of the maximum within `reach`; of equal maxima the one where the left ear is earliest.
    fn strongest(&self, reach: usize) -> i64 {
        let reach = reach as i64;
        (-reach..=reach).rev().max_by(|a, b| self.at(*a).total_cmp(&self.at(*b))).unwrap_or(0)
    }
}

/// Interaural level difference: broadband energy of the left ear over that of the right, dB; positive when the left is louder.
///
/// # Errors
/// A silent ear or a sample that is not finite.
pub fn ild_db(left: &[f32], right: &[f32]) -> Result<f64, MetricError> {
    check_finite(left)?;
    check_finite(right)?;
    let (l, r) = (energy(left), energy(right));
    if l > 0.0 && r > 0.0 { Ok(10.0 * (l / r).log10()) } else { Err(MetricError::Silent) }
}

/// Butterworth low-pass of 4th order by the bilinear transform with a prewarped cutoff: two second-order sections.
fn low_pass(x: &[f32], sample_rate_hz: f64) -> Vec<f64> {
    let mut y: Vec<f64> = x.iter().map(|&v| f64::from(v)).collect();
    let k = (PI * CUTOFF_HZ / sample_rate_hz).tan();
    for angle in [PI / 8.0, 3.0 * PI / 8.0] {
        // H(s) = 1 / (s^2 + 2 cos(angle) s + 1), s = (1 - z^-1) / (k (1 + z^-1)).
        let damping = 2.0 * angle.cos();
        let scale = 1.0 / (1.0 + damping * k + k * k);
        let (b0, a1, a2) = (k * k * scale, 2.0 * (k * k - 1.0) * scale, (1.0 - damping * k + k * k) * scale);
        let (mut s1, mut s2) = (0.0, 0.0);
        for v in &mut y {
            let out = b0 * *v + s1;
            s1 = 2.0 * b0 * *v - a1 * out + s2;
            s2 = b0 * *v - a2 * out;
            *v = out;
        }
    }
    y
}

/// Band-limited interpolation by a windowed sinc of 10 samples to each side, Kaiser window with beta 5: the default design of
/// the common polyphase resamplers, so that lags agree with tools built on them.
fn oversample(x: &[f64]) -> Vec<f64> {
    const REACH: usize = 10 * OVERSAMPLING;
    let mut taps: Vec<f64> = (0..=2 * REACH)
        .map(|i| {
            let t = i as f64 - REACH as f64;
            let phase = PI * t / OVERSAMPLING as f64;
            let sinc = if i == REACH { 1.0 } else { phase.sin() / phase };
            sinc * bessel_i0(5.0 * (1.0 - (t / REACH as f64).powi(2)).max(0.0).sqrt())
        })
        .collect();
    let gain = OVERSAMPLING as f64 / taps.iter().sum::<f64>();
    taps.iter_mut().for_each(|t| *t *= gain);
    let mut y = vec![0.0; x.len() * OVERSAMPLING];
    for (m, out) in y.iter_mut().enumerate() {
        // out[m] = sum over k of x[k] taps[m + REACH - 16 k], taps outside their range being zero.
        let first = m.saturating_sub(REACH).div_ceil(OVERSAMPLING);
        let last = ((m + REACH) / OVERSAMPLING).min(x.len() - 1);
        *out = (first..=last).map(|k| x[k] * taps[m + REACH - OVERSAMPLING * k]).sum();
    }
    y
}

/// Modified Bessel function of the first kind, order 0 (Abramowitz and Stegun 1964, 9.6.12).
fn bessel_i0(x: f64) -> f64 {
    let quarter = x * x / 4.0;
    let (mut term, mut sum, mut k) = (1.0, 1.0, 1.0);
    while term > 1e-17 * sum {
        term *= quarter / (k * k);
        sum += term;
        k += 1.0;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_signals::{noise, pulse};

    #[test]
    fn coherence_is_what_two_ears_have_in_common_at_some_lag() {
        // Two parts of one sequence: the generator's sequences of neighbouring seeds correlate by -.2.
        let drawn: Vec<f32> = noise(1, 96_000).iter().map(|v| *v as f32).collect();
        let (common, own) = drawn.split_at(48_000);
        let (rate, later) = (48_000.0, |samples: usize| [&vec![0.0; samples], common].concat());
        let near = |a: Option<f64>, b: f64| assert!((a.unwrap() - b).abs() < 0.02, "{a:?}, not {b}");
        near(interaural_coherence([common, common], rate), 1.0);
        near(interaural_coherence([common, &later(20)], rate), 1.0);
        near(interaural_coherence([common, own], rate), 0.0);
        let mixed: Vec<f32> = common.iter().zip(own).map(|(a, b)| 0.6 * a + 0.8 * b).collect();
        near(interaural_coherence([common, &mixed], rate), 0.6);
        assert_eq!(interaural_coherence([common, &[0.0; 9]], rate), None);
    }

    #[test]
    fn two_delays_that_are_nearly_as_strong_are_both_heard() {
        let rate = 48_000.0;
        let left = pulse(100.0, 400);
        let right =
            |second: f32| -> Vec<f32> { pulse(80.0, 400).iter().zip(pulse(130.0, 400)).map(|(a, b)| a + second * b).collect() };
        let found = |second: f32| itds_s(&left, &right(second), rate).unwrap();
        let [both, one] = [0.97, 0.5].map(found);
        assert!(both.len() == 2 && (both[0] + 30.0 / rate).abs() < 4e-5 && (both[1] - 20.0 / rate).abs() < 4e-5, "{both:?}");
        assert_eq!(one, [itd_s(&left, &right(0.5), rate).unwrap()]);
    }

    #[test]
    fn a_delayed_pair_has_its_delay() {
        for &rate in &[16_000.0, 44_100.0, 48_000.0, 96_000.0] {
            for &samples in &[0.0, 3.25, 7.5, 12.0, -9.0, -0.5] {
                let (left, right) = (pulse(200.0 + samples, 2048), pulse(200.0, 2048));
                let expected = samples / rate;
                let measured = itd_s(&left, &right, rate).unwrap();
                // Half a step of the grid.
                assert!((measured - expected).abs() <= 0.51 / 16.0 / rate, "{samples} samples at {rate} Hz: {measured} s");
            }
        }
    }

    #[test]
    fn the_louder_left_ear_is_positive() {
        let h = pulse(100.0, 512);
        let half: Vec<f32> = h.iter().map(|v| 0.5 * v).collect();
        assert!((ild_db(&h, &half).unwrap() - 20.0 * 2.0_f64.log10()).abs() < 1e-6);
        assert!((ild_db(&half, &h).unwrap() + 20.0 * 2.0_f64.log10()).abs() < 1e-6);
    }

    #[test]
    fn says_why_there_is_no_value() {
        let h = pulse(100.0, 512);
        assert_eq!(itd_s(&h, &vec![0.0; 512], 48_000.0), Err(MetricError::Silent));
        assert_eq!(ild_db(&h, &[0.0; 512]), Err(MetricError::Silent));
        assert!(matches!(itd_s(&h, &h[1..], 48_000.0), Err(MetricError::Lengths { .. })));
        assert!(matches!(itd_s(&h, &h, 2_000.0), Err(MetricError::Frequency { .. })));
        assert_eq!(itd_s(&[], &[], 48_000.0), Err(MetricError::Silent));
    }

    #[test]
    fn bessel_matches_the_table() {
        // Abramowitz and Stegun 1964, table 9.8: I0(1), I0(5).
        assert!((bessel_i0(1.0) - 1.266_065_877_752_008_4).abs() < 1e-14);
        assert!((bessel_i0(5.0) - 27.239_871_823_604_44).abs() < 1e-12);
    }

    #[test]
    fn running_sound_is_later_at_the_far_ear() {
        let x = noise(3, 16_000);
        let at_once: Vec<f32> = x.iter().map(|v| 0.3 * *v as f32).collect();
        // 312 us, not a whole number of samples, and 6 dB softer.
        let spectrum = spectrum(x.iter().map(|v| 0.15 * v), 32_768);
        let turn = |k: usize| Complex64::from_polar(1.0, -2.0 * PI * k as f64 * 16_000.0 / 32_768.0 * 312e-6);
        let late = signal(spectrum.iter().enumerate().map(|(k, v)| v * turn(k)).collect(), 32_768);
        let late: Vec<f32> = late[..16_000].iter().map(|v| *v as f32).collect();
        let itd = running_itd_s([&late, &at_once], 16_000.0).unwrap();
        assert!((itd - 312e-6).abs() < 5e-6, "{itd}");
        let itd = running_itd_s([&at_once, &late], 16_000.0).unwrap();
        assert!((itd + 312e-6).abs() < 5e-6, "{itd}");
        assert_eq!(running_itd_s([&at_once, &vec![0.0; 16_000]], 16_000.0), None);
    }
}
