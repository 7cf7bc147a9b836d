//! How loud sounds are, and what brings those of an item to one loudness (EBU R 128).

use ebur128::{EbuR128, Mode};

/// What is left above peaks, dB.
const HEADROOM_DB: f64 = 1.0;

/// Loudness and peak of a sound.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Loudness {
    /// Integrated, LUFS; not finite for what is silent or shorter than 0.4 s.
    pub(crate) integrated: f64,
    /// Largest sample, dB of full scale.
    pub(crate) peak_db: f64,
}

impl Loudness {
    /// Of one or two channels; of more the first two.
    pub(crate) fn new(channels: &[Vec<f32>], rate_hz: u32) -> Self {
        let used: Vec<&[f32]> = channels.iter().take(2).map(|c| &c[..]).collect();
        let measure = || {
            let mut meter = EbuR128::new(u32::try_from(used.len()).ok()?, rate_hz, Mode::I).ok()?;
            meter.add_frames_planar_f32(&used).ok()?;
            meter.loudness_global().ok()
        };
        let peak = used.iter().flat_map(|c| c.iter()).fold(0.0_f32, |most, v| most.max(v.abs()));
        Self { integrated: measure().unwrap_or(f64::NEG_INFINITY), peak_db: 20.0 * f64::from(peak).log10() }
    }
}

/// Gains that bring all to one loudness, the greatest at which none has a peak above -1 dB of full scale; 1 for each where one
/// has no loudness.
pub(crate) fn matching(all: &[Loudness]) -> Option<Vec<f64>> {
    let room = |l: &Loudness| l.integrated - l.peak_db - HEADROOM_DB;
    // No louder than the loudest was.
    let loudest = all.iter().map(|l| l.integrated).fold(f64::NEG_INFINITY, f64::max);
    let target = all.iter().map(room).fold(loudest, f64::min);
    let gains: Vec<f64> = all.iter().map(|l| 10.0_f64.powf((target - l.integrated) / 20.0)).collect();
    gains.iter().all(|gain| gain.is_finite()).then_some(gains)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tone(level: f32) -> Vec<f32> {
        (0..48_000_u16).map(|i| level * (std::f32::consts::TAU * 997.0 * f32::from(i) / 48_000.0).sin()).collect()
    }

    #[test]
    fn gains_make_one_loudness_without_clipping() {
        // A tone in one channel of full scale has -3 LUFS (EBU Tech 3341).
        let sounds = [vec![tone(0.1), tone(0.1)], vec![tone(0.4), tone(0.4)], vec![tone(0.9)]];
        let all: Vec<Loudness> = sounds.iter().map(|s| Loudness::new(s, 48_000)).collect();
        assert!((all[0].integrated + 20.0).abs() < 0.2 && (all[2].integrated + 3.9).abs() < 0.2, "{all:?}");
        let gains = matching(&all).unwrap();
        let after = |i: usize| all[i].integrated + 20.0 * gains[i].log10();
        assert!((after(0) - after(1)).abs() < 1e-9 && (after(1) - after(2)).abs() < 1e-9, "{gains:?}");
        assert!(all.iter().zip(&gains).all(|(l, g)| l.peak_db + 20.0 * g.log10() <= -0.99), "{gains:?}");
        assert!(matching(&[all[0], Loudness::new(&[vec![0.0; 48_000]], 48_000)]).is_none());
    }
}
