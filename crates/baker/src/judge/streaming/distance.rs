//! How far a stream is from the clips that it stands for.

use promenade_core::StftGrid;
use promenade_metrics::{MetricError, Spectrogram, Window, audible_lsd_db, avcloud};
use promenade_player::Ears;

/// Clips whose energy lies further below the loudest clip's than this are silence, as a share.
const SILENT_CLIP: f64 = 1e-4;
/// The lowest level difference that is reported, dB.
const LOWEST_DB: f64 = -120.0;

/// Distances to the clip path.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Distance {
    /// MAG of [`avcloud::mag`], mean over clips.
    pub mag: f64,
    /// Log-spectral distance of [`audible_lsd_db`] on the scene's own transform with a Hann window, dB.
    pub lsd_db: f64,
    /// LRE of [`avcloud::lre_db`], mean over clips, dB.
    pub lre_db: f64,
    /// Energy of both ears in all clips over the clip path's, dB; positive: the stream is louder.
    pub level_db: f64,
}

impl Distance {
    /// Compares the stretches of one recording; those where the clips are silent do not count.
    pub(super) fn between(rendered: &[Ears], clips: &[Ears], grid: &StftGrid) -> Result<Self, MetricError> {
        let own = Spectrogram { n_fft: grid.n_fft, hop: grid.hop, window_length: grid.n_fft, window: Window::Hann };
        let lsd_db = audible_lsd_db(rendered, clips, own)?;
        let loudest = clips.iter().map(energy).fold(0.0, f64::max);
        let heard: Vec<_> = rendered.iter().zip(clips).filter(|(_, c)| energy(c) >= SILENT_CLIP * loudest).collect();
        let (mut mag, mut lre_db) = (0.0, 0.0);
        for ([left, right], [clip_left, clip_right]) in &heard {
            let (stream, clip) = ([&left[..], &right[..]], [&clip_left[..], &clip_right[..]]);
            mag += avcloud::mag(stream, clip)?;
            lre_db += avcloud::lre_db(stream, clip)?;
        }
        let sum = |of: &dyn Fn(&(&Ears, &Ears)) -> f64| heard.iter().map(of).sum::<f64>();
        let ratio = sum(&|(stream, _)| energy(stream)) / sum(&|(_, clip)| energy(clip));
        let count = heard.len() as f64;
        Ok(Self { mag: mag / count, lsd_db, lre_db: lre_db / count, level_db: (10.0 * ratio.log10()).max(LOWEST_DB) })
    }

    /// Mean distances; `None` where there are none.
    pub(super) fn mean(all: &[Self]) -> Option<Self> {
        let mean = |of: fn(&Self) -> f64| all.iter().map(of).sum::<f64>() / all.len() as f64;
        (!all.is_empty()).then(|| Self {
            mag: mean(|d| d.mag),
            lsd_db: mean(|d| d.lsd_db),
            lre_db: mean(|d| d.lre_db),
            level_db: mean(|d| d.level_db),
        })
    }
}

fn energy(ears: &Ears) -> f64 {
    ears.iter().flatten().map(|v| f64::from(*v).powi(2)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_core::random::Random;

    const GRID: StftGrid = StftGrid { sample_rate_hz: 8000.0, n_fft: 128, hop: 32 };

    fn clips(gain: [f32; 2]) -> Vec<Ears> {
        let mut random = Random::new(5);
        (0..3).map(|_| gain.map(|g| (0..2000).map(|_| g * (random.uniform() - 0.5)).collect())).collect()
    }

    #[test]
    fn the_clips_themselves_are_at_no_distance() {
        assert_eq!(Distance::between(&clips([1.0, 1.0]), &clips([1.0, 1.0]), &GRID), Ok(Distance::default()));
    }

    #[test]
    fn a_gain_is_a_level_and_a_gain_of_one_ear_a_ratio() {
        let six = 20.0 * 2.0_f64.log10();
        let d = Distance::between(&clips([0.5, 0.5]), &clips([1.0, 1.0]), &GRID).unwrap();
        assert!((d.level_db + six).abs() < 1e-5 && (d.lsd_db - six).abs() < 0.01 && d.lre_db < 1e-5, "{d:?}");
        let d = Distance::between(&clips([2.0, 1.0]), &clips([1.0, 1.0]), &GRID).unwrap();
        // The ears' energies are 4 + 1 instead of 1 + 1; the generator's differ a little.
        assert!((d.lre_db - six).abs() < 1e-3 && (d.level_db - 10.0 * 2.5_f64.log10()).abs() < 0.1, "{d:?}");
        assert!(d.mag > 0.0);
    }

    #[test]
    fn clips_that_are_silent_do_not_count() {
        let (mut quiet, mut other) = (clips([1.0, 1.0]), clips([0.5, 0.5]));
        quiet.push([vec![0.0; 2000], vec![0.0; 2000]]);
        other.push([vec![0.3; 2000], vec![0.0; 2000]]);
        let without = Distance::between(&clips([0.5, 0.5]), &clips([1.0, 1.0]), &GRID).unwrap();
        assert_eq!(Distance::between(&other, &quiet, &GRID), Ok(without));
        let silent = vec![[vec![0.0; 2000], vec![0.0; 2000]]];
        assert_eq!(Distance::between(&silent, &silent, &GRID), Err(MetricError::Silent));
        let lost = Distance::between(&silent, &clips([1.0, 1.0])[..1], &GRID).unwrap();
        assert_eq!(lost.level_db, LOWEST_DB);
    }

    #[test]
    fn means_are_over_all() {
        let (a, b) =
            (Distance { mag: 1.0, ..Distance::default() }, Distance { mag: 2.0, level_db: 3.0, ..Distance::default() });
        assert_eq!(Distance::mean(&[a, b]), Some(Distance { mag: 1.5, level_db: 1.5, ..Distance::default() }));
        assert_eq!(Distance::mean(&[]), None);
    }
}
