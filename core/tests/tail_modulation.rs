//! Buzz of a tail at the hop rate, and what measures it.

use promenade_core::{BlockParams, Pose};
use promenade_fourier::spectrum;
use promenade_metrics::envelope;
use promenade_metrics::statistics::median;
use promenade_testing::noise;
use promenade_testing::scenes::{render, room, spatializer};
use std::f64::consts::PI;

const RATE: f64 = 48_000.0;
/// Where a tail is looked at, seconds.
const TAIL_S: std::ops::Range<f64> = 0.5..0.9;
/// Samples over which the decay is averaged out.
const SMOOTHING: usize = 4096;
/// Band whose median the line is compared with, hertz.
const COMPARED_HZ: (f64, f64) = (50.0, 400.0);

/// How far the envelope of a decaying tail is modulated at `hop_hz`, dB over the median between 50 and 400 Hz.
///
/// The envelope is divided by its running mean over 4096 samples, and the largest of the seven spectral lines around `hop_hz`
/// (Hann window) is compared. A noise-like room tail gives about 13 dB, an audible buzz 60 dB.
fn tail_modulation_db(samples: &[f32], hop_hz: f64) -> f64 {
    let envelope = envelope(&samples[(TAIL_S.start * RATE) as usize..(TAIL_S.end * RATE) as usize]);
    let flat: Vec<f64> = envelope.iter().zip(running_mean(&envelope)).map(|(e, m)| e / m).collect();
    let mean = flat.iter().sum::<f64>() / flat.len() as f64;
    let last = (flat.len() - 1) as f64;
    let windowed = flat.iter().enumerate().map(|(i, v)| (v - mean) * (0.5 - 0.5 * (2.0 * PI * i as f64 / last).cos()));
    let lines: Vec<f64> = spectrum(windowed, flat.len()).iter().map(|c| c.norm()).collect();
    let spacing_hz = RATE / flat.len() as f64;
    let hop_line = (hop_hz / spacing_hz).round() as usize;
    let around = &lines[hop_line - 3..hop_line + 4];
    let inside = |i: usize| (i as f64 * spacing_hz) > COMPARED_HZ.0 && (i as f64 * spacing_hz) < COMPARED_HZ.1;
    let compared = lines.iter().enumerate().filter(|(i, _)| inside(*i)).map(|(_, &v)| v);
    let peak = around.iter().fold(0.0_f64, |m, &v| m.max(v));
    20.0 * (peak / median(compared).unwrap()).log10()
}

/// Mean over the 4096 samples around each one, the signal being zero beyond its ends.
fn running_mean(x: &[f64]) -> Vec<f64> {
    let sums: Vec<f64> = std::iter::once(0.0)
        .chain(x.iter().scan(0.0, |sum, v| {
            *sum += v;
            Some(*sum)
        }))
        .collect();
    (0..x.len())
        .map(|i| (sums[(i + SMOOTHING / 2).min(x.len())] - sums[i.saturating_sub(SMOOTHING / 2)]) / SMOOTHING as f64)
        .collect()
}

#[test]
fn a_tail_after_a_burst_is_not_modulated_at_the_hop_rate() {
    let scene = room(48_000.0, 0.8, 0.05);
    let mut s = spatializer(&scene, RATE);
    let hop_hz = 1.0 / scene.grid().hop_s();
    let mut burst = noise(6, 4_800);
    burst.resize(96_000, 0.0);
    let out = render(&mut s, &burst, &[512], &BlockParams::default(), |_| Pose::IDENTITY);
    for ear in &out {
        let db = tail_modulation_db(ear, hop_hz);
        println!("hop-rate modulation {db:.1} dB");
        assert!(db <= 15.0, "{db}");
    }
}

#[test]
fn a_modulated_tail_stands_out_and_a_plain_one_does_not() {
    let decay = -3.0 * std::f64::consts::LN_10 / (0.8 * RATE);
    let plain: Vec<f32> = noise(17, 48_000).iter().zip(0_u32..).map(|(v, i)| v * (decay * f64::from(i)).exp() as f32).collect();
    let hop_hz = RATE / 256.0;
    let buzz = |i: u32| (1.0 + 0.5 * (2.0 * PI * hop_hz * f64::from(i) / RATE).cos()) as f32;
    let buzzing: Vec<f32> = plain.iter().zip(0_u32..).map(|(v, i)| v * buzz(i)).collect();
    let (quiet, loud) = (tail_modulation_db(&plain, hop_hz), tail_modulation_db(&buzzing, hop_hz));
    assert!(quiet < 15.0 && loud > quiet + 15.0, "{quiet} dB plain, {loud} dB buzzing");
}
