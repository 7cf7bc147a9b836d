//! How far off a listener points in a baked scene.

use promenade_baker::listener::listened;
use promenade_baker::{BakeOptions, Response, Responses, bake_responses};
use promenade_core::glam::Vec3;
use promenade_core::random::Random;
use promenade_core::{Head, Pose};
use promenade_fourier::num_complex::Complex32;
use promenade_fourier::signal;
use std::sync::Arc;

const RATE: f64 = 24_000.0;

/// A ring of sources every 10 degrees before a head in a small room.
fn ring() -> Responses {
    let head = Head::from_bytes(include_bytes!("../data/kemar.head")).unwrap();
    let (n_fft, lead) = (512, 60);
    let response = |azimuth: i32| {
        let direction = Vec3::new((azimuth as f32).to_radians().cos(), (azimuth as f32).to_radians().sin(), 0.0);
        let mut random = Random::new((azimuth + 200) as u64);
        let [left, right] = head.ears(direction).spectra(n_fft, RATE).map(|mut spectrum| {
            for (k, x) in spectrum.iter_mut().enumerate() {
                *x *= Complex32::from_polar(1.0, -std::f32::consts::TAU * (k * lead) as f32 / n_fft as f32);
            }
            let mut ear: Vec<f32> = signal(spectrum, n_fft)[..256].to_vec();
            ear.resize(6_000, 0.0);
            for (i, x) in ear.iter_mut().enumerate().skip(200) {
                *x += 0.02 * random.normal() * 10.0_f32.powf(-3.0 * i as f32 / (0.25 * RATE as f32));
            }
            ear
        });
        Response { listener: Pose::IDENTITY, source: 1.5 * direction, left, right, name: format!("at {azimuth}") }
    };
    let responses = (-8..=8).map(|i| response(10 * i)).collect();
    Responses { sample_rate_hz: RATE, responses, ..Responses::default() }
}

#[test]
fn a_listener_points_nearer_with_the_scene_than_with_the_nearest_measurement() {
    let set = ring();
    let scene = Arc::new(bake_responses(&set, |_, i| i % 2 == 1, &BakeOptions::default()).unwrap());
    let found = listened(&scene, &set).unwrap();
    println!("{found:?}");
    assert_eq!(found.poses, 8);
    assert!(found.scene.lateral_deg < 2.5 && found.nearest.lateral_deg > 5.0, "{found:?}");
    assert!(found.other_head.lateral_deg < 2.5, "the set's head is KEMAR: {found:?}");
    assert_eq!((found.scene.elevation_deg, found.scene.confused), (None, None), "all level and ahead");
    let other = Responses { sample_rate_hz: 48_000.0, ..set.clone() };
    assert!(listened(&scene, &other).unwrap_err().to_string().contains("the scene's 24000 Hz"));
    let renamed = set.responses.iter().map(|r| Response { name: format!("{} again", r.name), ..r.clone() }).collect();
    let error = listened(&scene, &Responses { responses: renamed, ..set }).unwrap_err().to_string();
    assert!(error.contains("baked and held out from"), "{error}");
}
