//! Scenes that carry measured responses.

use promenade_core::glam::Vec3;
use promenade_core::{BlockParams, Pose, Renderer, Scene, Spatializer};
use promenade_testing::scenes::{RESPONSE_HOPS as HOPS, RESPONSE_TAPS as TAPS, room_of_responses};
use std::sync::Arc;

/// The response at a yaw and the sample at which the direct sound would be heard.
fn response(scene: &Arc<Scene>, rate: f64, yaw: f32) -> ([Vec<f32>; 2], usize) {
    let mut engine = Spatializer::new(rate);
    let renderer = Renderer::new(Arc::clone(scene), rate).unwrap();
    let (start, len) = (64, 2 * HOPS * renderer.grid().hop + 4096);
    let latency = renderer.latency_samples();
    engine.install(Box::new(renderer));
    let mut x = vec![0.0; len];
    x[start] = 1.0;
    let [mut left, mut right] = [vec![0.0; len], vec![0.0; len]];
    let pose = Pose::from_ypr(Vec3::ZERO, yaw, 0.0, 0.0);
    engine.process(&[&x], &[], [&mut left, &mut right], &BlockParams::default(), |_| pose);
    ([left, right], start + latency)
}

#[test]
fn where_a_response_was_measured_it_is_played_as_it_is() {
    let rate = 16_000.0;
    let (scene, samples) = room_of_responses(rate);
    let hop = scene.grid().hop;
    // The head turned to the left has the emitter on its right: the first node.
    for (measured, yaw) in [(0, std::f32::consts::FRAC_PI_2), (1, -std::f32::consts::FRAC_PI_2)] {
        let (ears, origin) = response(&scene, rate, yaw);
        for (ear, heard) in ears.iter().enumerate() {
            let want = &samples[(2 * measured + ear) * HOPS * hop..][..(TAPS + 1) * hop];
            let start = origin - hop / 4;
            let error: f32 = want.iter().zip(&heard[start..]).map(|(w, h)| (w - h).powi(2)).sum();
            let energy: f32 = want.iter().map(|w| w * w).sum();
            // What is left are edges of the bass that goes on after the taps.
            assert!(error < 3e-3 * energy, "{measured} {ear}: {} dB", 10.0 * (error / energy).log10());
            let before: f32 = heard[..start].iter().map(|h| h * h).sum();
            assert!(before < 1e-3 * energy, "{measured} {ear}: {} dB early", 10.0 * (before / energy).log10());
        }
    }
}

#[test]
fn the_bass_goes_on_after_the_taps_and_then_all_is_silent() {
    let rate = 16_000.0;
    let (scene, _) = room_of_responses(rate);
    let hop = scene.grid().hop;
    let (ears, origin) = response(&scene, rate, 0.3);
    let energy = |from: usize, to: usize| ears[0][origin + from * hop..origin + to * hop].iter().map(|v| v * v).sum::<f32>();
    let (within, after) = (energy(0, TAPS), energy(TAPS + 2, HOPS - 1));
    // Sixteen of 161 bins are a tenth of the energy.
    assert!((0.03..0.4).contains(&(after / within * TAPS as f32 / (HOPS - TAPS - 3) as f32)), "{after} {within}");
    assert!(ears.iter().all(|ear| ear[origin + (HOPS + 6) * hop..].iter().all(|v| *v == 0.0)));
}

#[test]
fn a_host_of_another_rate_hears_the_same_below_the_highest_frequency() {
    let (scene, _) = room_of_responses(16_000.0);
    let energy_below = |rate: f64, hz: f64| {
        let (ears, origin) = response(&scene, rate, 0.3);
        let len = (0.045 * rate) as usize;
        let piece: Vec<f64> = ears[0][origin..origin + len].iter().map(|v| f64::from(*v)).collect();
        let n = (2.0 * rate) as usize;
        let spectrum = promenade_fourier::spectrum(piece, n);
        let bins = (hz * n as f64 / rate) as usize;
        spectrum[..bins].iter().map(|x| x.norm_sqr()).sum::<f64>()
    };
    for rate in [44_100.0, 48_000.0, 96_000.0] {
        let db = 10.0 * (energy_below(rate, 5_000.0) / energy_below(16_000.0, 5_000.0)).log10();
        assert!(db.abs() < 0.3, "{rate}: {db} dB");
    }
}

#[test]
fn between_two_measurements_the_energy_is_the_mean_of_theirs() {
    let (scene, _) = room_of_responses(16_000.0);
    let hop = scene.grid().hop;
    let energy = |degrees: f32| {
        let (ears, origin) = response(&scene, 16_000.0, degrees.to_radians());
        let within = origin + hop..origin + TAPS * hop;
        ears.map(|ear| ear[within.clone()].iter().map(|v| v * v).sum::<f32>())
    };
    let ends = [energy(90.0), energy(-90.0)];
    for (degrees, share) in [(0.0, 0.5), (45.0, 0.85)] {
        for (ear, found) in energy(degrees).into_iter().enumerate() {
            let wanted = share * ends[0][ear] + (1.0 - share) * ends[1][ear];
            // Noise has nothing in common: without gains half of it would be lost.
            let db = 10.0 * (found / wanted).log10();
            assert!(db.abs() < 0.7, "{degrees} degrees, ear {ear}: {db} dB");
        }
    }
}
