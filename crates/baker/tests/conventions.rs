//! What `docs/conventions.md` says of baking.

use promenade_baker::{BakeOptions, Response, Responses, bake_responses};
use promenade_core::glam::Vec3;
use promenade_core::{Pose, Scene};
use promenade_metrics::{ild_db, itd_s};
use promenade_player::render_response;
use promenade_testing::Noise;
use std::sync::Arc;

const RATE: f64 = 16_000.0;

/// A click per ear, later and softer on the far side, and a little decaying noise.
fn measured(azimuth_deg: f32) -> Response {
    let azimuth = azimuth_deg.to_radians();
    let side = azimuth.sin();
    let mut noise = Noise::new(1);
    let mut ear = |near: f32| {
        let delay = 40.0 - 5.0 * near;
        // The head's shadow: a first-order low-pass on the far side.
        let (shadow, mut memory) = (0.3 * (1.0 - near), 0.0);
        (0..6_000)
            .map(|i| {
                let t = i as f32 - delay;
                let click = if t.abs() < 1e-3 { 1.0 } else { (std::f32::consts::PI * t).sin() / (std::f32::consts::PI * t) };
                let click = if t.abs() < 16.0 { click * (0.2 * t).cos().max(0.0) } else { 0.0 };
                memory = shadow * memory + (1.0 - shadow) * click;
                (1.0 + 0.4 * near) * memory + if t > 80.0 { 0.02 * noise.value() * (-t / 900.0).exp() } else { 0.0 }
            })
            .collect::<Vec<f32>>()
    };
    let (left, right) = (ear(side), ear(-side));
    let source = Vec3::new(azimuth.cos(), azimuth.sin(), 0.0) * 2.0;
    Response { listener: Pose::IDENTITY, source, left, right, name: format!("{azimuth_deg}") }
}

fn bake(azimuths: &[f32]) -> Arc<Scene> {
    let set = Responses {
        title: "clicks".into(),
        credit: String::new(),
        licence: String::new(),
        sample_rate_hz: RATE,
        responses: azimuths.iter().map(|a| measured(*a)).collect(),
        ..Responses::default()
    };
    Arc::new(bake_responses(&set, |_, _| false, &BakeOptions::default()).unwrap())
}

fn turned(scene: &Arc<Scene>, yaw_deg: f32) -> [Vec<f32>; 2] {
    render_response(scene, Pose::from_ypr(Vec3::ZERO, yaw_deg.to_radians(), 0.0, 0.0), 400, 6_000).unwrap()
}

#[test]
fn sources_around_a_listener_become_one_emitter_ahead_of_the_origin() {
    let scene = bake(&[-60.0, -30.0, 0.0, 30.0, 60.0]);
    assert!((scene.emitter().unwrap() - Vec3::new(2.0, 0.0, 0.0)).length() < 1e-4);
    assert!(scene.start_pose().position.length() < 1e-4 && scene.start_pose().ypr().0.abs() < 1e-4);
    // A source on the left was measured; the listener hears it so after turning to the right.
    let [left, right] = turned(&scene, -60.0);
    assert!(itd_s(&left, &right, RATE).unwrap() < -200e-6 && ild_db(&left, &right).unwrap() > 2.0);
    assert!(scene.provenance().notes.iter().any(|n| n.contains("one emitter")));
}

#[test]
fn a_baked_pose_measures_as_the_room_did() {
    let azimuths = [-60.0, -30.0, 0.0, 30.0, 60.0];
    let scene = bake(&azimuths);
    for azimuth in azimuths {
        let (m, [left, right]) = (measured(azimuth), turned(&scene, -azimuth));
        let itd = itd_s(&left, &right, RATE).unwrap() - itd_s(&m.left, &m.right, RATE).unwrap();
        let ild = ild_db(&left, &right).unwrap() - ild_db(&m.left, &m.right).unwrap();
        assert!(itd.abs() < 5e-6 && ild.abs() < 0.1, "{azimuth}: {itd} s, {ild} dB");
    }
}

#[test]
fn an_unmeasured_rear_is_the_mirror_image_of_the_front() {
    let scene = bake(&[-90.0, -60.0, -30.0, 0.0, 30.0, 60.0, 90.0]);
    let ild = |yaw: f32| {
        let [left, right] = turned(&scene, yaw);
        ild_db(&left, &right).unwrap()
    };
    assert!((ild(150.0) - ild(30.0)).abs() < 0.2 && (ild(-120.0) - ild(-60.0)).abs() < 0.2);
    assert!(scene.provenance().notes.iter().any(|n| n.contains("mirror")));
}

#[test]
fn the_loudest_ear_has_unit_energy() {
    let scene = bake(&[-60.0, -30.0, 0.0, 30.0, 60.0]);
    let energy = |yaw: f32| turned(&scene, yaw).map(|ear| ear.iter().map(|v| v * v).sum::<f32>());
    let loudest = [-60.0, -30.0, 0.0, 30.0, 60.0].into_iter().flat_map(energy).fold(0.0, f32::max);
    assert!((loudest - 1.0).abs() < 0.1, "{loudest}");
}

#[test]
fn a_set_of_positions_around_one_source_is_walked_through() {
    let source = Vec3::new(2.0, 0.0, 0.0);
    let at = |x: f32, y: f32| {
        let position = Vec3::new(x, y, 0.0);
        let to = source - position;
        let level = 2.0 / to.length();
        let click = measured(to.y.atan2(to.x).to_degrees());
        let scaled = |ear: &[f32]| ear.iter().map(|v| v * level).collect::<Vec<f32>>();
        let listener = Pose { position, ..Pose::IDENTITY };
        Response { listener, source, left: scaled(&click.left), right: scaled(&click.right), name: format!("{x},{y}") }
    };
    let places: Vec<(f32, f32)> = (0..12).map(|i| ((i % 4) as f32 - 2.0, (i / 4) as f32 - 1.0)).collect();
    let set = Responses {
        title: "clicks".into(),
        credit: String::new(),
        licence: String::new(),
        sample_rate_hz: RATE,
        responses: places.iter().map(|&(x, y)| at(x, y)).collect(),
        ..Responses::default()
    };
    let scene = Arc::new(bake_responses(&set, |_, _| false, &BakeOptions::default()).unwrap());
    assert!((scene.emitter().unwrap() - source).length() < 1e-6);
    let (low, high) = scene.bounds();
    assert!((low - Vec3::new(-2.0, -1.0, 0.0)).length() < 1e-5 && (high - Vec3::new(1.0, 1.0, 0.0)).length() < 1e-5);
    let direct = |ears: &[Vec<f32>; 2], from: usize| ears.iter().flat_map(|e| &e[from..from + 40]).map(|v| v * v).sum::<f32>();
    let reference = direct(&render_response(&scene, set.responses[5].listener, 400, 6_000).unwrap(), 390);
    for r in &set.responses {
        let ears = render_response(&scene, r.listener, 400, 6_000).unwrap();
        let itd = itd_s(&ears[0], &ears[1], RATE).unwrap() - itd_s(&r.left, &r.right, RATE).unwrap();
        assert!(itd.abs() < 40e-6, "{}: {itd} s", r.name);
        let wanted = direct(&[r.left.clone(), r.right.clone()], 30)
            / direct(&[set.responses[5].left.clone(), set.responses[5].right.clone()], 30);
        let db = 10.0 * (direct(&ears, 390) / reference / wanted).log10();
        assert!(db.abs() < 1.0, "{}: {db} dB", r.name);
    }
}
