//! Reverberation of running sound, estimated without knowing what was played.

use crate::slope;
use std::ops::Range;

/// Frames over which power is averaged, and their step, seconds.
const WINDOW_S: f64 = 0.020;
const STEP_S: f64 = 0.005;
/// A decay is given up where the level has risen by this over its lowest, dB.
const RISE_DB: f64 = 2.0;
/// Skipped below the peak before the fit, and the depth to which it goes, dB.
const SKIPPED_DB: f64 = 2.0;
const DEPTH_DB: f64 = 30.0;
/// A decay counts from this drop, dB, and this length, seconds, on.
const LEAST_DROP_DB: f64 = 10.0;
const LEAST_S: f64 = 0.060;
/// Levels within this of a clip's lowest are noise, dB.
const NOISE_DB: f64 = 3.0;
/// The longest time that is returned, also for what does not fall.
const LONGEST_S: f64 = 5.0;

/// Time for 60 dB of decay of a signal, seconds, from what follows its offsets, or `None` where no offset shows enough of a
/// decay.
///
/// Where the power of `guide` (20 ms frames every 5 ms) falls by at least 10 dB over at least 60 ms without rising by 2 dB on
/// the way, a line is fitted to the levels of `signal`, from 2 dB below the peak to 30 dB below it; the estimate is the median
/// of the slopes' times, each counting as long as it lasts. With the recording as the guide, a rendering is measured at the
/// same offsets.
///
/// It takes the sound's own decays for the room's: it cannot tell a room that is drier than what is played in it, is too long
/// for sound that dies away slowly, and has no bands. Two sounds with the same source compare better than either
/// alone is known. It is not the learnt estimator of published RTE figures.
#[must_use]
pub fn blind_decay_time_s(signal: &[f32], guide: &[f32], sample_rate_hz: f64) -> Option<f64> {
    let levels = levels_db(signal, sample_rate_hz);
    let mut times: Vec<(f64, usize)> = decays(&levels_db(guide, sample_rate_hz))
        .into_iter()
        .filter(|range| range.end <= levels.len())
        .map(|range| {
            let points: Vec<(f64, f64)> = levels[range.clone()].iter().zip(0_u32..).map(|(l, i)| (f64::from(i), *l)).collect();
            let slope = slope(&points).map_or(0.0, |s| s / STEP_S);
            let time = if slope < -60.0 / LONGEST_S { -60.0 / slope } else { LONGEST_S };
            (time, range.len())
        })
        .collect();
    times.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = times.iter().map(|t| t.1).sum::<usize>().div_ceil(2);
    let mut passed = 0;
    times
        .into_iter()
        .find(|(_, weight)| {
            passed += weight;
            passed >= half
        })
        .map(|(time, _)| time)
}

/// Mean power of each frame, dB.
fn levels_db(x: &[f32], sample_rate_hz: f64) -> Vec<f64> {
    let samples = |seconds: f64| ((seconds * sample_rate_hz).round() as usize).max(1);
    let (window, step) = (samples(WINDOW_S), samples(STEP_S));
    let power = |frame: &[f32]| frame.iter().map(|&v| f64::from(v) * f64::from(v)).sum::<f64>() / window as f64;
    x.windows(window).step_by(step).map(|frame| 10.0 * (power(frame) + 1e-14).log10()).collect()
}

/// Frames in which a level falls.
fn decays(levels: &[f64]) -> Vec<Range<usize>> {
    let least = (LEAST_S / STEP_S) as usize;
    let noise = levels.iter().fold(f64::INFINITY, |m, v| m.min(*v)) + NOISE_DB;
    let mut found = Vec::new();
    let mut at = 0;
    while at + 1 < levels.len() {
        if levels[at + 1] > levels[at] {
            at += 1;
            continue;
        }
        let (mut lowest, mut next) = (at, at + 1);
        while next < levels.len() && levels[next] < levels[lowest] + RISE_DB && levels[next] > noise {
            if levels[next] < levels[lowest] {
                lowest = next;
            }
            next += 1;
        }
        let peak = levels[at];
        let start = (at..=lowest).find(|&i| levels[i] <= peak - SKIPPED_DB).unwrap_or(lowest);
        let end = (start..lowest).find(|&i| levels[i] < peak - DEPTH_DB).unwrap_or(lowest) + 1;
        if end - start >= least && levels[start] - levels[end - 1] >= LEAST_DROP_DB - SKIPPED_DB {
            found.push(start..end);
        }
        at = next;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_signals::noise;

    /// Bursts of noise, 30 ms long, that decay by 60 dB in `t60_s`.
    fn bursts(t60_s: f64) -> Vec<f32> {
        let decay = |t: f64| if t < 0.03 { 1.0 } else { 10.0_f64.powf(-3.0 * (t - 0.03) / t60_s) };
        noise(7, 32_000).iter().enumerate().map(|(i, v)| (0.3 * decay((i % 8000) as f64 / 16_000.0) * v) as f32).collect()
    }

    #[test]
    fn bursts_have_their_decay_time() {
        for t60 in [0.2, 0.5, 1.0] {
            let x = bursts(t60);
            let found = blind_decay_time_s(&x, &x, 16_000.0).unwrap();
            assert!((found / t60 - 1.0).abs() < 0.15, "{found} s for {t60} s");
        }
        let (dry, wet) = (bursts(0.3), bursts(0.8));
        let dry_time = blind_decay_time_s(&dry, &wet, 16_000.0).unwrap();
        assert!(dry_time < 0.45, "the signal's decay, at the guide's offsets: {dry_time}");
    }

    #[test]
    fn what_does_not_decay_has_no_time() {
        let tone: Vec<f32> = (0..16_000).map(|i| (i as f32 * 0.3).sin()).collect();
        assert_eq!(blind_decay_time_s(&tone, &tone, 16_000.0), None);
        assert_eq!(blind_decay_time_s(&[], &[], 16_000.0), None);
        let bursts = bursts(0.5);
        assert_eq!(
            blind_decay_time_s(&tone, &bursts[..16_000], 16_000.0),
            Some(LONGEST_S),
            "where the guide decays, a tone does not"
        );
    }
}
