//! What both ears make of one direction.

use super::{HEAD_BANDS, at_hz};
use crate::number::single;
use promenade_fourier::minimum_phase_log;
use promenade_fourier::num_complex::{Complex32, Complex64};
use std::f64::consts::TAU;

/// Upper edge of the band in which people localise by time, Hz.
const LOW_PASS_HZ: f64 = 1500.0;
/// The longest lag that is looked for, seconds, and the steps.
const LONGEST_LAG_S: f64 = 0.0015;
const LAG_STEPS: i32 = 150;
/// Nepers of a decibel.
const NEPERS_PER_DB: f64 = std::f64::consts::LN_10 / 20.0;
/// Oversampling of the frequencies, against the cepstrum's folding onto itself.
const OVERSAMPLING: usize = 4;

/// Levels and delays of both ears in one direction.
#[derive(Clone, Debug, PartialEq)]
pub struct Ears {
    /// Delay of the left and the right ear below 1.5 kHz after the sound would have reached the head's centre, seconds.
    pub delays_s: [f32; 2],
    /// Level of the left and the right ear by band, dB against a diffuse field.
    pub levels_db: [[f32; HEAD_BANDS]; 2],
}

impl Ears {
    /// Interaural time difference below 1.5 kHz, seconds, positive when the left ear is later.
    #[must_use]
    pub fn itd_s(&self) -> f32 {
        self.delays_s[0] - self.delays_s[1]
    }

    /// Spectra of both ears about the moment at which the sound would have reached the head's centre, by bin of a transform of
    /// `n_fft` samples from 0 to half the sample rate: the levels with their minimum phase, and delays that leave each ear as
    /// late as it was measured below 1.5 kHz.
    #[must_use]
    pub fn spectra(&self, n_fft: usize, sample_rate_hz: f64) -> [Vec<Complex32>; 2] {
        let fine = OVERSAMPLING * n_fft;
        let hz = |bin: usize| bin as f64 * sample_rate_hz / n_fft as f64;
        let filters = self.levels_db.each_ref().map(|levels| {
            let log = |k: usize| NEPERS_PER_DB * f64::from(at_hz(levels, k as f64 * sample_rate_hz / fine as f64));
            let logs = minimum_phase_log((0..=fine / 2).map(log), fine);
            logs.into_iter().step_by(OVERSAMPLING).map(Complex64::exp).collect::<Vec<Complex64>>()
        });
        let weighed = |k: usize, x: Complex64| (hz(k), low_pass_power(hz(k)) * x);
        let single_ear = |ear: &[Complex64]| lag_s(ear.iter().enumerate().map(|(k, x)| weighed(k, *x)));
        let pair = filters[0].iter().zip(&filters[1]).enumerate();
        let apart_s = lag_s(pair.map(|(k, (l, r))| weighed(k, l * r.conj())));
        let mean_s = 0.5 * (single_ear(&filters[0]) + single_ear(&filters[1]));
        let wanted = self.delays_s.map(f64::from);
        let own = [mean_s + 0.5 * apart_s, mean_s - 0.5 * apart_s];
        let mut delays = wanted.iter().zip(own).map(|(wanted, own)| wanted - own);
        filters.map(|filter| {
            let delay_s = delays.next().unwrap_or(0.0);
            let turned = filter.iter().enumerate().map(|(k, x)| x * Complex64::from_polar(1.0, -TAU * hz(k) * delay_s));
            turned.map(|x| Complex32::new(single(x.re), single(x.im))).collect()
        })
    }
}

/// What a low-pass of 1.5 kHz (Butterworth, 4th order) leaves of the energy at a frequency.
#[must_use]
pub fn low_pass_power(hz: f64) -> f64 {
    (1.0 + (hz / LOW_PASS_HZ).powi(8)).recip()
}

/// The lag at which a spectrum's signal is highest, seconds, within 1.5 ms. Of a cross-spectrum, left times the conjugate of
/// right, it is the delay of the left ear against the right. The bins are pairs of a frequency in Hz, rising in even steps from
/// 0, and a value.
#[must_use]
pub fn lag_s(bins: impl Iterator<Item = (f64, Complex64)>) -> f64 {
    let bins: Vec<(f64, Complex64)> = bins.take_while(|(hz, _)| *hz < 4.0 * LOW_PASS_HZ).collect();
    let step_hz = bins.get(1).map_or(0.0, |b| b.0);
    let height = |lag_s: f64| -> f64 {
        let turn = Complex64::from_polar(1.0, TAU * step_hz * lag_s);
        let mut phasor = Complex64::from(1.0);
        let terms = bins.iter().map(|(_, x)| {
            let term = (x * phasor).re;
            phasor *= turn;
            term
        });
        terms.sum()
    };
    let step_s = LONGEST_LAG_S / f64::from(LAG_STEPS);
    let at = |i: i32| height(f64::from(i) * step_s);
    // Nothing that a low-pass leaves has two peaks within a coarse step.
    let mut coarse: Vec<(i32, f64)> = (-LAG_STEPS..=LAG_STEPS).step_by(5).map(|i| (i, at(i))).collect();
    coarse.sort_by(|a, b| b.1.total_cmp(&a.1));
    let fine = coarse.iter().take(3).flat_map(|(middle, _)| middle - 4..=middle + 4).filter(|i| i.abs() <= LAG_STEPS);
    let best = fine.map(|i| (i, at(i))).max_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
    let Some((best, peak)) = best else { return 0.0 };
    let beside = |i: i32| if i.abs() <= LAG_STEPS { at(i) } else { peak };
    let (before, after) = (beside(best - 1), beside(best + 1));
    let bend = before - 2.0 * peak + after;
    let part = if bend < 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 };
    (f64::from(best) + part) * step_s
}
