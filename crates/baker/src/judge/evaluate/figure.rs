//! The figures of one clip, and their means.

use crate::capture::direct_sound;
use promenade_metrics::{audible_lsd_db, avcloud, band_ild_error_db, lsd_db, rwavs};

/// How far a recording's direct sound has to stand out for its interaural time difference to count, dB.
const CLEAR_DB: f64 = 10.0;

/// A distance between a rendering and a recording; smaller is better, 0 is equal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Figure {
    /// MAG as AV-Cloud defines it: [`avcloud::mag`].
    AvcloudMag,
    /// LRE as AV-Cloud defines it, dB: [`avcloud::lre_db`].
    AvcloudLre,
    /// ENV as AV-Cloud defines it, and as published with RWAVS: [`avcloud::env`].
    AvcloudEnv,
    /// MAG as published with RWAVS: [`rwavs::mag`].
    RwavsMag,
    /// Log-spectral distance, dB, on RWAVS's spectrogram, mean of both ears: [`lsd_db`].
    Lsd,
    /// Log-spectral distance where the recording is audible, dB, on the same spectrogram: [`audible_lsd_db`].
    AudibleLsd,
    /// Difference of the direct sounds' interaural time differences, microseconds: [`direct_sound`].
    Itd,
    /// Difference of interaural level differences, dB, mean over octaves: [`band_ild_error_db`].
    Ild,
}

impl Figure {
    /// All of them, in the order of tables.
    pub const ALL: [Self; 8] = [
        Self::AvcloudMag,
        Self::AvcloudLre,
        Self::AvcloudEnv,
        Self::RwavsMag,
        Self::Lsd,
        Self::AudibleLsd,
        Self::Itd,
        Self::Ild,
    ];

    /// Name in JSON, with convention and unit.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.shown().0
    }

    /// Head of its column.
    #[must_use]
    pub fn heading(self) -> &'static str {
        self.shown().1
    }

    /// Digits after the point in tables.
    #[must_use]
    pub fn digits(self) -> usize {
        self.shown().2
    }

    fn shown(self) -> (&'static str, &'static str, usize) {
        match self {
            Self::AvcloudMag => ("avcloud_mag", "MAG (AV-Cloud)", 4),
            Self::AvcloudLre => ("avcloud_lre_db", "LRE (AV-Cloud) dB", 2),
            Self::AvcloudEnv => ("avcloud_env", "ENV", 4),
            Self::RwavsMag => ("rwavs_mag", "MAG (RWAVS)", 4),
            Self::Lsd => ("lsd_db_512_128_hann_1e-5", "LSD dB", 2),
            Self::AudibleLsd => ("audible_lsd_db_512_128_hann", "audible LSD dB", 2),
            Self::Itd => ("itd_us", "ITD us", 0),
            Self::Ild => ("octave_ild_db", "ILD dB", 2),
        }
    }
}

/// A value for each [`Figure`] that has one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Figures([Option<f64>; Figure::ALL.len()]);

impl Figures {
    /// Measures what was predicted against what was recorded; of the longer one, the end does not count. `dry` is the sound
    /// that both are of, from some samples before them on, as many as the second says; none of a mix.
    #[must_use]
    pub fn of(predicted: [&[f32]; 2], recorded: [&[f32]; 2], dry: Option<(&[f32], usize)>, sample_rate_hz: f64) -> Self {
        let len = predicted.iter().chain(&recorded).map(|ear| ear.len()).min().unwrap_or(0);
        let (p, r) = (predicted.map(|ear| &ear[..len]), recorded.map(|ear| &ear[..len]));
        let mean = |of: &dyn Fn(usize) -> Option<f64>| Some(0.5 * (of(0)? + of(1)?));
        let one = |figure: Figure| match figure {
            Figure::AvcloudMag => avcloud::mag(p, r).ok(),
            Figure::AvcloudLre => avcloud::lre_db(p, r).ok(),
            Figure::AvcloudEnv => avcloud::env(p, r).ok(),
            Figure::RwavsMag => rwavs::mag(p, r).ok(),
            Figure::Lsd => mean(&|ear| lsd_db(p[ear], r[ear], rwavs::SPECTROGRAM).ok()),
            Figure::AudibleLsd => {
                let owned = |ears: [&[f32]; 2]| [ears.map(<[f32]>::to_vec)];
                audible_lsd_db(&owned(p), &owned(r), rwavs::SPECTROGRAM).ok()
            }
            Figure::Itd => {
                let (dry, pre_roll) = dry?;
                let of = |ears| direct_sound(dry, pre_roll, ears, sample_rate_hz);
                // Where the recording has none that stands out, there is nothing to compare with.
                let wanted = of(r).filter(|direct| direct.clarity_db >= CLEAR_DB)?;
                Some(1e6 * (of(p)?.delay_s - wanted.delay_s).abs())
            }
            Figure::Ild => band_ild_error_db(p, r, sample_rate_hz),
        };
        Self(Figure::ALL.map(|figure| one(figure).filter(|v| v.is_finite())))
    }

    /// The value of a figure, where it has one.
    #[must_use]
    pub fn get(&self, figure: Figure) -> Option<f64> {
        Figure::ALL.iter().position(|f| *f == figure).and_then(|i| self.0[i])
    }

    /// Means over those that have a value.
    #[must_use]
    pub fn mean<'a>(all: impl Iterator<Item = &'a Self>) -> Self {
        let mut sums = [(0.0, 0_u32); Figure::ALL.len()];
        for figures in all {
            for ((sum, count), value) in sums.iter_mut().zip(figures.0) {
                *sum += value.unwrap_or(0.0);
                *count += u32::from(value.is_some());
            }
        }
        Self(sums.map(|(sum, count)| (count > 0).then(|| sum / f64::from(count))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::convolve::convolve;

    #[test]
    fn a_perfect_prediction_has_no_error() {
        let rate = 16_000.0_f32;
        let mut noise = promenade_testing::Noise::new(1);
        // Bursts that decay, so that all figures have a value.
        let dry: Vec<f32> = (0..16_000).map(|i| (-(i % 5000) as f32 / (0.05 * rate)).exp() * noise.value()).collect();
        let ear = |gain: f32, later: usize| -> Vec<f32> {
            std::iter::repeat_n(0.0, later).chain(dry.iter().map(|x| gain * x)).take(dry.len()).collect()
        };
        let (left, right) = (ear(0.5, 20), ear(0.2, 25));
        let of = |predicted, recorded| Figures::of(predicted, recorded, Some((&dry, 0)), f64::from(rate));
        let figures = of([&left, &right], [&left, &right]);
        for figure in Figure::ALL {
            assert_eq!(figures.get(figure), Some(0.0), "{figure:?}");
        }
        let swapped = of([&right, &left], [&left, &right]);
        assert!((swapped.get(Figure::Itd).unwrap() - 2.0 * 5e6 / 16_000.0).abs() < 5.0, "{swapped:?}");
        for figure in Figure::ALL {
            assert!(swapped.get(figure).unwrap() > 1e-3, "{figure:?}: {swapped:?}");
        }
        let mean = Figures::mean([figures, swapped].iter());
        assert_eq!(mean.get(Figure::Ild), swapped.get(Figure::Ild).map(|v| 0.5 * v));
        assert_eq!(Figures::mean([].iter()), Figures::default());
    }

    #[test]
    fn the_direct_sound_decides_on_the_delay_and_not_the_room() {
        let rate = 16_000.0;
        let noise = |seed: u64, count: usize| promenade_testing::noise(seed, count);
        let dry: Vec<f32> = noise(1, 24_000).iter().enumerate().map(|(i, x)| if i % 5000 < 3000 { *x } else { 0.0 }).collect();
        // A direct sound that is `later` at the left ear, in a room as loud, by its seeds another one at each ear.
        let heard = |later: usize, seeds: [u64; 2]| {
            let ear = |direct: usize, seed: u64| -> Vec<f32> {
                let mut h: Vec<f32> =
                    noise(seed, 4000).iter().enumerate().map(|(i, x)| 0.08 * x * (-(i as f32) / 600.0).exp()).collect();
                h[..60].fill(0.0);
                h[direct] = 1.0;
                h
            };
            let (left, right) = (ear(20 + later, seeds[0]), ear(20, seeds[1]));
            convolve(&dry, [&left[..], &right[..]]).map(|ear| ear[8000..24_000].to_vec())
        };
        let recorded = heard(5, [2, 3]);
        let error = |predicted: [Vec<f32>; 2]| {
            let [p, r] = [&predicted, &recorded].map(|ears| ears.each_ref().map(Vec::as_slice));
            Figures::of(p, r, Some((&dry, 8000)), rate).get(Figure::Itd).unwrap()
        };
        assert!(error(heard(5, [4, 5])) < 10.0);
        let step_us = 1e6 / rate;
        assert!((error(heard(4, [2, 3])) - step_us).abs() < 10.0);
    }
}
