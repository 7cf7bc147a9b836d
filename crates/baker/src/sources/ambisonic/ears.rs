//! What a head makes of a direction, as impulse responses.

use crate::sources::simulation::Hrtf;
use promenade_core::glam::Vec3;
use promenade_fourier::num_complex::Complex32;
use promenade_fourier::signal;

/// Samples that all impulse responses begin before the sound is at the head's centre, seconds: the near ear is earlier, and
/// filters ring.
const LEAD_S: f64 = 0.0015;
/// How long impulse responses are after that, seconds, ...
const LENGTH_S: f64 = 0.012;
/// ... where many are convolved at once ...
const SHORT_S: f64 = 0.003;
/// ... and how long they fade out.
const FADE_S: f64 = 0.001;

/// Impulse responses of one length, which begin one lead before the sound is at the head's centre.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    /// Samples of the lead.
    pub(super) lead: usize,
    /// Samples of all.
    pub(super) length: usize,
    fade: usize,
    n_fft: usize,
}

impl Frame {
    pub(super) fn of(hrtf: &Hrtf) -> Self {
        Self::lasting(LENGTH_S, hrtf)
    }

    /// For filters of many channels: a head's own response is over by then, its room's is not asked for.
    pub(super) fn short(hrtf: &Hrtf) -> Self {
        Self::lasting(SHORT_S, hrtf)
    }

    fn lasting(length_s: f64, hrtf: &Hrtf) -> Self {
        let samples = |s: f64| (s * f64::from(hrtf.sample_rate_hz())).round() as usize;
        let lead = samples(LEAD_S);
        Self { lead, length: lead + samples(length_s), fade: samples(FADE_S), n_fft: hrtf.bins.n_fft }
    }

    /// The impulse response of a spectrum about the moment at which the sound is at the head's centre.
    pub(super) fn impulse(&self, mut spectrum: Vec<Complex32>) -> Vec<f32> {
        delay(&mut spectrum, self.lead as f32, self.n_fft);
        if let [first, .., last] = &mut spectrum[..] {
            (first.im, last.im) = (0.0, 0.0);
        }
        let mut time = signal(spectrum, self.n_fft);
        time.truncate(self.length);
        let ramp = |i: usize, of: usize| (0.5 * std::f32::consts::PI * (i as f32 + 0.5) / of as f32).sin().powi(2);
        let rise = self.lead / 4;
        time.iter_mut().take(rise).enumerate().for_each(|(i, v)| *v *= ramp(i, rise));
        time.iter_mut().rev().take(self.fade).enumerate().for_each(|(i, v)| *v *= ramp(i, self.fade));
        time
    }

    /// Both ears' impulse responses to a direction of unit length: forward, left, up.
    pub(super) fn heard(&self, hrtf: &Hrtf, direction: Vec3) -> [Vec<f32>; 2] {
        spectra(hrtf, direction).map(|spectrum| self.impulse(spectrum))
    }
}

/// Spectra of both ears with their delays after the head's centre.
pub(super) fn spectra(hrtf: &Hrtf, direction: Vec3) -> [Vec<Complex32>; 2] {
    let near = hrtf.near(direction);
    [0, 1].map(|ear| {
        let mut spectrum = vec![Complex32::default(); hrtf.bins.count()];
        near.spectrum(ear, &mut spectrum);
        delay(&mut spectrum, near.delay(ear), hrtf.bins.n_fft);
        spectrum
    })
}

fn delay(spectrum: &mut [Complex32], samples: f32, n_fft: usize) {
    for (k, s) in spectrum.iter_mut().enumerate() {
        *s *= Complex32::cis(-std::f32::consts::TAU * k as f32 * samples / n_fft as f32);
    }
}
