//! The measured responses of a scene, and where they were measured.

use super::Lifted;
use crate::number::{single, whole};
use crate::render::low::lowest_bins::LOWEST_BINS;
use crate::{Bands, StftGrid};
use glam::Vec3;

/// Samples of the bass for each period of its highest frequency.
const LOW_SAMPLES: f64 = 4.2;
/// Length of the bass's low pass, periods of its highest frequency, to either side.
const LOW_REACH: f64 = 2.5;

/// Where a response was measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Site {
    /// Unit vector from the head towards the emitter, head axes.
    pub direction: Vec3,
    /// Listener position, metres.
    pub position: Vec3,
    /// Number of the response: two sites have the same where one is the mirror image of the other.
    pub response: u32,
}

/// Binaural responses of a room, which carry its time filters instead of noise, and where each was measured.
///
/// Made by the baker or read from a scene file; a part of its scene, immutable, which the audio thread reads.
///
/// Each is cut into hops, the first from a quarter of a hop before the sound's arrival at the head's centre on, and is without
/// what the direct sound's filter plays at its site. The filters of a pose are the hops of the responses measured around it,
/// mixed, with the energy of their mean in every band; at a site its own response alone.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeasuredRoom {
    /// Where they were measured, at least once each.
    pub sites: Vec<Site>,
    /// Samples at the scene's rate, `[response][ear][hop * sample]`, a hop more than there are taps. The first hop is at a
    /// distance of 1 m.
    pub samples: Vec<f32>,
    /// The bass of the whole responses, below the frequency of the [`LOWEST_BINS`]th bin: every `low_step`th sample,
    /// `[response][ear][sample]`. It is heard after the taps.
    pub low: Vec<f32>,
    /// Samples of the scene's rate from one sample of the bass to the next, at least 1.
    pub low_step: usize,
    /// Hops of the bass, those of direct sound and taps among them.
    pub low_hops: usize,
    /// Amplitude of the late part one hop after the last tap, linear, `[response][ear][band]`.
    pub late: Vec<f32>,
    /// Energy density that the late part has at each ear before that hop, for an amplitude of 1, over the last taps,
    /// `[tap][ear][band]`.
    pub late_before: Vec<f32>,
    /// Gains of time filters and late part, linear, `[ear][band]`: 1 but for another head than the measured one.
    pub gains: Vec<f32>,
    /// What they lose where image sources play their early reflections.
    pub lifted: Option<Lifted>,
}

impl MeasuredRoom {
    /// Number of responses of a scene with so many bands.
    #[must_use]
    pub fn count(&self, bands: &Bands) -> usize {
        self.late.len() / (2 * bands.count())
    }

    /// Samples of the bass of one ear.
    #[must_use]
    pub fn low_len(hops: usize, grid: &StftGrid, step: usize) -> usize {
        (hops * grid.hop).div_ceil(step.max(1))
    }

    /// Samples of the scene's rate from one of the bass to the next.
    #[must_use]
    pub fn step_of(grid: &StftGrid) -> usize {
        let low_hz = grid.bin_hz(LOWEST_BINS.min(grid.bins() - 1));
        whole(grid.sample_rate_hz / (LOW_SAMPLES * low_hz)).max(1)
    }

    /// The bass of one ear's samples, which begin with the first hop: every `step`th after a low pass (a sinc under a Hann
    /// window).
    #[must_use]
    pub fn bass_of(samples: &[f32], step: usize, grid: &StftGrid, hops: usize) -> Vec<f32> {
        let len = Self::low_len(hops, grid, step);
        if step == 1 {
            return (0..len).map(|i| *samples.get(i).unwrap_or(&0.0)).collect();
        }
        // Half of the amplitude is left midway between the highest frequency and the lowest that its sampling mirrors there.
        let cut = 0.5 / step as f64;
        let reach = whole((LOW_REACH * LOW_SAMPLES * step as f64).ceil());
        let window: Vec<f64> = (0..=2 * reach)
            .map(|i| {
                let x = std::f64::consts::PI * (i as f64 - reach as f64);
                let sinc = if i == reach { 2.0 * cut } else { (2.0 * cut * x).sin() / x };
                sinc * (0.5 + 0.5 * (x / (reach + 1) as f64).cos())
            })
            .collect();
        let sum: f64 = window.iter().sum();
        let at = |i: usize| f64::from(*samples.get(i.wrapping_sub(reach)).unwrap_or(&0.0));
        let one = |m: usize| window.iter().enumerate().map(|(k, w)| w * at(m * step + k)).sum::<f64>() / sum;
        (0..len).map(|m| single(one(m))).collect()
    }

    /// Amplitudes of the late part of a mix, whose energy is the mean of its parts'.
    pub(crate) fn late_of(&self, shares: &[(u32, f32)], out: &mut [f32]) {
        out.fill(0.0);
        for (response, share) in shares {
            let row = self.late.chunks_exact(out.len()).nth(whole((*response).into())).unwrap_or(&[]);
            out.iter_mut().zip(row).for_each(|(energy, late)| *energy += share * late * late);
        }
        out.iter_mut().zip(&self.gains).for_each(|(late, gain)| *late = gain * late.sqrt());
    }

    /// Hops of the samples.
    pub(crate) fn hops(&self, bands: &Bands, grid: &StftGrid) -> usize {
        self.samples.len() / (2 * self.count(bands) * grid.hop).max(1)
    }

    /// Hops that reflections are lifted out of.
    pub(crate) fn lifted_hops(&self, bands: &Bands, grid: &StftGrid) -> usize {
        self.lifted.as_ref().map_or(0, |lifted| lifted.samples.len() / (2 * self.count(bands) * grid.hop).max(1))
    }

    /// One hop of one ear of a response that has so many hops.
    pub(crate) fn hop(&self, grid: &StftGrid, hops: usize, response: usize, ear: usize, hop: usize) -> &[f32] {
        hop_of(&self.samples, grid, hops, response, ear, hop)
    }

    /// What it loses of one hop, of so many that it loses anything of.
    pub(crate) fn lifted_hop(&self, grid: &StftGrid, hops: usize, response: usize, ear: usize, hop: usize) -> &[f32] {
        self.lifted.as_ref().map_or(&[], |lifted| hop_of(&lifted.samples, grid, hops, response, ear, hop))
    }

    /// The bass of one hop of one ear: samples, and the time of each after the first of the hop, samples of the scene's rate.
    pub(crate) fn low_hop(
        &self,
        grid: &StftGrid,
        response: usize,
        ear: usize,
        hop: usize,
    ) -> impl Iterator<Item = (usize, f32)> + '_ {
        let (step, start) = (self.low_step, hop * grid.hop);
        let len = Self::low_len(self.low_hops, grid, step);
        let row = &self.low[(2 * response + ear) * len..][..len];
        let (first, end) = (start.div_ceil(step), (start + grid.hop).div_ceil(step).min(len));
        (first..end).map(move |m| (m * step - start, row[m]))
    }

    /// Keeps the first `taps` taps. The late part begins where they end, louder by `rise`, `[ear][band]`.
    #[must_use]
    pub fn with_taps(&self, taps: usize, bands: &Bands, grid: &StftGrid, rise: &[f32]) -> Self {
        let hops = self.hops(bands, grid);
        let samples = self.samples.chunks_exact(hops * grid.hop).flat_map(|ear| &ear[..(taps + 1) * grid.hop]);
        let late = self.late.chunks_exact(2 * bands.count()).flat_map(|row| row.iter().zip(rise).map(|(g, r)| g * r));
        let row = 2 * bands.count();
        let before = &self.late_before[self.late_before.len().saturating_sub(taps * row)..];
        let lifted = self.lifted.as_ref().map(|lifted| {
            let ears = lifted.samples.chunks_exact(self.lifted_hops(bands, grid) * grid.hop);
            let samples = ears.flat_map(|ear| &ear[..ear.len().min((taps + 1) * grid.hop)]).copied().collect();
            Lifted { samples, ..lifted.clone() }
        });
        let (samples, late_before) = (samples.copied().collect(), before.to_vec());
        Self { samples, late: late.collect(), late_before, lifted, ..self.clone() }
    }

    /// Bytes in memory.
    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(&*self.sites)
            + size_of_val(&*self.samples)
            + size_of_val(&*self.low)
            + size_of_val(&*self.late)
            + size_of_val(&*self.late_before)
            + self.lifted.as_ref().map_or(0, |lifted| size_of_val(&*lifted.samples))
    }
}

/// One hop of samples, `[response][ear][hop * sample]`, of so many hops.
fn hop_of<'a>(samples: &'a [f32], grid: &StftGrid, hops: usize, response: usize, ear: usize, hop: usize) -> &'a [f32] {
    let start = ((2 * response + ear) * hops + hop) * grid.hop;
    &samples[start..start + grid.hop]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn the_bass_has_the_low_frequencies_of_the_samples_and_no_others() {
        let grid = StftGrid { sample_rate_hz: 48_000.0, n_fft: 960, hop: 240 };
        let step = MeasuredRoom::step_of(&grid);
        assert_eq!(step, 14);
        let tone = |hz: f64| (0..4_800).map(|i| (TAU * hz * f64::from(i) / 48_000.0).sin() as f32).collect::<Vec<f32>>();
        let level_db = |hz: f64| {
            let bass = MeasuredRoom::bass_of(&tone(hz), step, &grid, 20);
            let middle = &bass[80..251];
            10.0 * (middle.iter().map(|v| v * v).sum::<f32>() / middle.len() as f32 * 2.0).log10()
        };
        for hz in [60.0, 200.0, 500.0, 800.0] {
            assert!(level_db(hz).abs() < 0.1, "{hz} Hz: {} dB", level_db(hz));
        }
        // What would be mirrored into the bass.
        for hz in [2_650.0, 3_000.0, 3_400.0] {
            assert!(level_db(hz) < -60.0, "{hz} Hz: {} dB", level_db(hz));
        }
    }
}
