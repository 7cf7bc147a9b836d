//! Sound that is the same on every machine.

use promenade_core::random::Random;
use promenade_core::{AnchorCloud, StftGrid};
use std::f32::consts::{PI, TAU};

/// From one burst or click to the next, seconds.
const EVERY_S: f64 = 0.125;
/// Length of a noise burst, seconds.
const BURST_S: f64 = 0.06;
/// Time in which a click falls by 60 dB, seconds.
const CLICK_T60_S: f32 = 0.05;
/// Frequencies of the clicks as shares of the sample rate, one after the other.
const CLICKS: [f32; 5] = [0.01, 0.02, 0.04, 0.08, 0.16];

/// The sound that streams are compared on unless there is another: bursts and clicks of 3 s, or of 3 clips where those are
/// longer.
#[must_use]
pub fn test_sound(grid: &StftGrid, cloud: &AnchorCloud) -> Vec<f32> {
    let clip_s = cloud.model.sizes().frames as f64 * grid.hop_s();
    bursts_and_clicks(grid.sample_rate_hz, 3.0_f64.max(3.0 * clip_s))
}

/// Bursts of white noise and clicks of decaying tones in turn, full scale 0.5.
#[must_use]
pub fn bursts_and_clicks(sample_rate_hz: f64, seconds: f64) -> Vec<f32> {
    let samples = |s: f64| ((s * sample_rate_hz) as usize).max(1);
    let (every, burst) = (samples(EVERY_S), samples(BURST_S));
    let fall = 6.91 / (CLICK_T60_S * sample_rate_hz as f32);
    let mut random = Random::new(1);
    let at = |i: usize, random: &mut Random| {
        let (event, n) = (i / every, i % every);
        if event.is_multiple_of(2) {
            let noise = random.uniform() - 0.5;
            if n < burst { noise * (PI * (n as f32 + 0.5) / burst as f32).sin().powi(2) } else { 0.0 }
        } else {
            let share = CLICKS[event / 2 % CLICKS.len()];
            0.5 * (-fall * n as f32).exp() * (TAU * share * n as f32).sin()
        }
    };
    (0..samples(seconds)).map(|i| at(i, &mut random)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sound_has_all_its_seconds_and_pauses() {
        let x = bursts_and_clicks(8000.0, 2.0);
        assert_eq!(x.len(), 16_000);
        assert!(x.iter().all(|v| v.abs() <= 0.5));
        let level = |from: usize, to: usize| x[from..to].iter().map(|v| v * v).sum::<f32>();
        assert!(level(0, 480) > 0.1 && level(480, 1000) == 0.0 && level(1000, 1200) > 0.1);
    }
}
