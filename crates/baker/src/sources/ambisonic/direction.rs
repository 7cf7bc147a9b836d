//! Where the sound of an Ambisonic response comes from, sample by sample: the active intensity (Tervo et al., "Spatial
//! decomposition method for room impulse responses", J. Audio Eng. Soc. 61 (2013), with the intensity of the first order as in
//! Zaunschirm et al., "Binaural rendering with measured room responses", Applied Sciences 10 (2020)).

use promenade_core::glam::Vec3;
use promenade_fourier::{signal, spectrum};
use std::ops::Range;

/// Window that the intensity is averaged over, and the mean over which directions are smoothed after that, seconds: 62 and 16
/// samples at 48 kHz, as in BinauralSDM (Amengual Gari et al. 2021).
const WINDOW_S: f64 = 62.0 / 48_000.0;
const SMOOTHING_S: f64 = 16.0 / 48_000.0;
/// Frequencies that directions are taken from, hertz: above, the capsules of most microphones lie too far apart.
const BAND_HZ: (f64, f64) = (200.0, 5_000.0);

/// The channels of the first order in the band that directions are taken from.
pub(super) struct FirstOrder {
    omni: Vec<f32>,
    /// Forward, left, up.
    dipoles: Vec<Vec3>,
    sample_rate_hz: f64,
}

impl FirstOrder {
    /// Of four channels in the order of AmbiX with unit gain in their own direction (SN3D).
    pub(super) fn of(channels: [&[f32]; 4], sample_rate_hz: f64) -> Self {
        let [omni, y, z, x] = channels.map(|channel| band_limited(channel, sample_rate_hz));
        let dipoles = (0..omni.len()).map(|i| Vec3::new(x[i], y[i], z[i])).collect();
        Self { omni, dipoles, sample_rate_hz }
    }

    /// Intensities, `[sample]`. They point to where the sound comes from.
    pub(super) fn intensities(&self) -> Vec<Vec3> {
        let raw: Vec<Vec3> = self.omni.iter().zip(&self.dipoles).map(|(w, v)| *w * *v).collect();
        let samples = |s: f64| (s * self.sample_rate_hz).round().max(1.0) as usize;
        let window = samples(WINDOW_S);
        let hann = |i: usize| (std::f32::consts::PI * (i as f32 + 0.5) / window as f32).sin().powi(2);
        let weights: Vec<f32> = (0..window).map(hann).collect();
        let averaged = smoothed(&raw, &weights);
        smoothed(&averaged, &vec![1.0; samples(SMOOTHING_S)])
    }

    /// How much louder the dipoles together are than the omnidirectional channel over some samples, dB; 0 for one plane wave.
    pub(super) fn dipoles_db(&self, samples: Range<usize>) -> f64 {
        let sum = |values: &mut dyn Iterator<Item = f32>| values.map(f64::from).sum::<f64>();
        let dipoles = sum(&mut self.dipoles[samples.clone()].iter().map(|v| v.length_squared()));
        let omni = sum(&mut self.omni[samples].iter().map(|w| w * w));
        10.0 * (dipoles / omni.max(1e-30)).max(1e-30).log10()
    }
}

/// The mean direction of some samples; none of silence.
pub(super) fn mean(intensities: &[Vec3]) -> Option<Vec3> {
    intensities.iter().sum::<Vec3>().try_normalize()
}

fn smoothed(values: &[Vec3], weights: &[f32]) -> Vec<Vec3> {
    let half = weights.len() / 2;
    let sum = |i: usize| {
        let terms = weights.iter().enumerate().filter_map(|(k, w)| Some(*values.get((i + k).checked_sub(half)?)? * *w));
        terms.sum::<Vec3>()
    };
    (0..values.len()).map(sum).collect()
}

fn band_limited(channel: &[f32], sample_rate_hz: f64) -> Vec<f32> {
    let length = (2 * channel.len()).next_power_of_two().max(2);
    let mut bins = spectrum(channel.iter().copied(), length);
    let octave = |hz: f64, edge: f64| (hz / edge).max(1e-9).log2().clamp(0.0, 1.0);
    for (k, bin) in bins.iter_mut().enumerate() {
        let hz = k as f64 * sample_rate_hz / length as f64;
        // An octave of fade outside either end.
        let share = octave(hz, 0.5 * BAND_HZ.0) * (1.0 - octave(hz, BAND_HZ.1));
        *bin *= (0.5 * std::f64::consts::PI * share).sin().powi(2) as f32;
    }
    let mut band = signal(bins, length);
    band.truncate(channel.len());
    band
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pulses_point_to_where_they_come_from() {
        let (ahead, left) = (Vec3::X, Vec3::new(-0.6, 0.64, 0.48));
        let mut channels = vec![vec![0.0_f32; 1024]; 4];
        for (at, gain, d) in [(200, 1.0, ahead), (500, -0.3, left)] {
            for (channel, v) in channels.iter_mut().zip([1.0, d.y, d.z, d.x]) {
                channel[at] += gain * v;
            }
        }
        let first = FirstOrder::of([&channels[0], &channels[1], &channels[2], &channels[3]], 48_000.0);
        assert!(first.dipoles_db(100..800).abs() < 0.1, "{}", first.dipoles_db(100..800));
        let found = first.intensities();
        for (at, direction) in [(200, ahead), (185, ahead), (220, ahead), (500, left), (515, left)] {
            assert!(found[at].normalize().dot(direction) > 0.99, "at {at}: {}", found[at].normalize());
        }
        assert!(mean(&found[150..250]).unwrap().dot(ahead) > 0.999);
        assert!(mean(&[Vec3::ZERO; 4]).is_none());
    }
}
