//! Scenes with image sources.

use promenade_core::{
    AMBISONIC_CHANNELS, AmbisonicHead, Axis, BlockParams, ImageSource, ImageSources, NEAREST_M, Pose, Renderer, Scene,
    SceneParts, Spatializer, glam::Vec3,
};
use promenade_testing::scenes::room;
use std::sync::Arc;

const RATE: f64 = 48_000.0;
const LEAD: usize = 12;
const EMITTER: Vec3 = Vec3::new(1.5, 0.0, 0.0);

/// A head that hears without a delay: the left ear louder from the left, the right ear from the right.
fn head() -> AmbisonicHead {
    let length = 2 * LEAD;
    let mut filters = vec![0.0; 2 * AMBISONIC_CHANNELS * length];
    let side = 0.5 / 3.0_f32.sqrt();
    for (channel, ears) in [(0, [1.0, 1.0]), (1, [side, -side])] {
        for (ear, gain) in ears.into_iter().enumerate() {
            filters[(2 * channel + ear) * length + LEAD] = gain;
        }
    }
    AmbisonicHead { sample_rate_hz: RATE, lead: LEAD, filters }
}

/// A room of images alone: no direct sound, no reverberation. The second half of the places, x >= 2, does not see the first
/// image.
fn scene(images: &[ImageSource], air_db_per_m: [f32; 7]) -> Arc<Scene> {
    let silent = room(RATE, 0.5, 0.0);
    let parts = silent.parts().clone();
    let (grid, bands, tail) = (parts.grid, parts.bands.clone(), parts.tail.clone());
    let nothing = Scene::of_transfer(&parts.shape().silent(), grid, bands, tail, parts.top_hz).unwrap();
    let mut seen = vec![1.0; 4 * images.len()];
    (seen[2 * images.len()], seen[3 * images.len()]) = (0.0, 0.0);
    let facing = parts.field.clone().map(|f| f.grid().facing.clone()).unwrap();
    let rows = nothing.field().map(|f| f.rows().clone()).unwrap();
    let promenade_core::Facing::Emitter { position, .. } = facing else { panic!("the room has an emitter") };
    let nodes = promenade_core::FieldGrid {
        position: [Axis::single(0.0), Axis::single(0.0), Axis::single(0.0)],
        facing: promenade_core::Facing::Emitter { position, elevation: Axis::single(0.0), azimuth: Axis::single(0.0) },
    };
    let field = promenade_core::Field::new(nodes, parts.shape(), rows);
    let images = ImageSources {
        images: images.to_vec(),
        air_db_per_m,
        places: [Axis::uniform(0.0, 1.0, 4), Axis::single(0.0), Axis::single(0.0)],
        seen,
        direct: vec![1.0; 4],
        head: head(),
        turning: None,
        emission: None,
    };
    Arc::new(Scene::new(SceneParts { field, images: Some(images), ..parts }).unwrap())
}

fn image(x: f32, y: f32) -> ImageSource {
    ImageSource::new(Vec3::new(x, y, 0.0), [1.0; 7])
}

/// What is heard of an input along poses by sample, from the latency on.
fn heard(scene: &Arc<Scene>, input: &[f32], pose_at: impl Fn(usize) -> Pose) -> [Vec<f32>; 2] {
    let mut engine = Spatializer::new(RATE);
    let renderer = Renderer::new(Arc::clone(scene), RATE).unwrap();
    let latency = renderer.latency_samples();
    engine.install(Box::new(renderer));
    let len = input.len() + latency;
    let padded: Vec<f32> = input.iter().copied().chain(std::iter::repeat_n(0.0, latency)).collect();
    let mut out = [vec![0.0; len], vec![0.0; len]];
    let [left, right] = &mut out;
    engine.process(&[&padded], &[], [left, right], &BlockParams::default(), pose_at);
    out.map(|ear| ear[latency..].to_vec())
}

/// A pulse with nothing above a sixth of the rate, about its sample.
fn pulse(len: usize, at: usize) -> Vec<f32> {
    (0..len).map(|n| (-((n as f32 - at as f32) / 6.0).powi(2)).exp()).collect()
}

/// Centre of gravity of a pulse and its sum.
fn moment(ear: &[f32]) -> (f64, f64) {
    let sum: f64 = ear.iter().map(|v| f64::from(*v)).sum();
    (ear.iter().enumerate().map(|(n, v)| n as f64 * f64::from(*v)).sum::<f64>() / sum, sum)
}

#[test]
fn an_image_is_heard_after_its_distance_from_its_direction() {
    let scene = scene(&[image(-3.0, 2.0)], [0.0; 7]);
    let (at, len) = (200, 4_000);
    let dry = pulse(len, at);
    let (_, dry_sum) = moment(&dry);
    for (position, yaw) in [(Vec3::ZERO, 0.0), (Vec3::new(0.4, 0.3, 0.2), 1.0), (Vec3::new(-1.0, -1.0, 0.0), -2.0)] {
        let pose = Pose::from_ypr(position, yaw, 0.1, 0.0);
        let ears = heard(&scene, &dry, |_| pose);
        let way = pose.to_head(Vec3::new(-3.0, 2.0, 0.0));
        let delay = f64::from(way.length() - position.distance(EMITTER)) / 343.0 * RATE;
        for (ear, sign) in ears.iter().zip([1.0, -1.0]) {
            let (centre, sum) = moment(ear);
            let gain = f64::from((1.0 + sign * 0.5 * way.y / way.length()) / way.length());
            assert!((centre - at as f64 - delay).abs() < 0.05, "{position}: {} samples, {delay}", centre - at as f64);
            assert!((sum / dry_sum / gain - 1.0).abs() < 2e-3, "{position}: {} of {gain}", sum / dry_sum);
        }
    }
}

#[test]
fn a_tone_glides_as_the_listener_walks() {
    let scene = scene(&[image(-3.0, 2.0)], [0.0; 7]);
    let hz = 1_000.0;
    let tone = |n: f64| (std::f64::consts::TAU * hz / RATE * n).sin();
    let dry: Vec<f32> = (0..24_000).map(|n| tone(f64::from(n)) as f32).collect();
    let pose_at = |n: usize| Pose::from_ypr(Vec3::new(0.0, n as f32 / RATE as f32, 0.0), 0.0, 0.0, 0.0);
    let [left, right] = heard(&scene, &dry, pose_at);
    // The mean of the ears hears every direction alike.
    let (mut error, mut energy) = (0.0, 0.0);
    for n in 4_000..22_000 {
        let pose = pose_at(n);
        let distance = pose.position.distance(Vec3::new(-3.0, 2.0, 0.0));
        let delay = f64::from(distance - pose.position.distance(EMITTER)) / 343.0 * RATE;
        let want = tone(n as f64 - delay) / f64::from(distance);
        let found = f64::from(left[n] + right[n]) / 2.0;
        error += (found - want).powi(2);
        energy += want * want;
    }
    let db = 10.0 * (error / energy).log10();
    // A millisecond of the walk is 3 us of delay.
    assert!(db < -30.0, "{db} dB");
}

#[test]
fn images_that_appear_and_vanish_do_not_click() {
    let scene = scene(&[image(-3.0, 2.0), image(2.0, 6.0)], [0.0; 7]);
    let dry: Vec<f32> = (0..48_000).map(|n| (std::f32::consts::TAU * 200.0 / 48_000.0 * n as f32).sin()).collect();
    let pose_at = |n: usize| Pose::from_ypr(Vec3::new(0.5 + 2.0 * n as f32 / 48_000.0, 0.0, 0.0), 0.0, 0.0, 0.0);
    let [left, _] = heard(&scene, &dry, pose_at);
    // The third difference of a slow sine is tiny, that of a step is not.
    let rough = |x: &[f32]| x.windows(4).map(|w| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs()).fold(0.0_f32, f32::max);
    let level = left[6_000..40_000].iter().fold(0.0_f32, |m, v| m.max(v.abs()));
    let steps = 20.0 * (rough(&left[6_000..40_000]) / level).log10();
    assert!(steps < -75.0, "{steps} dB");
}

#[test]
fn a_teleport_does_not_click() {
    let many: Vec<ImageSource> = (0..8).map(|i| image(-3.0 - i as f32, 2.0)).collect();
    let few = scene(&many, [0.0; 7]);
    let dry: Vec<f32> = (0..9_600).map(|n| (std::f32::consts::TAU * 200.0 / 48_000.0 * n as f32).sin()).collect();
    let jumps = |n: usize| Pose::from_ypr(if n < 4_800 { Vec3::ZERO } else { Vec3::new(0.0, 40.0, 0.0) }, 0.0, 0.0, 0.0);
    let [left, _] = heard(&few, &dry, jumps);
    let largest = left.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0_f32, f32::max);
    let level = left.iter().fold(0.0_f32, |m, v| m.max(v.abs()));
    // Crossing from one place to the other within a hop of 240 samples.
    assert!(largest < 0.06 * level, "{}", largest / level);
}

#[test]
fn walls_and_air_colour_an_image() {
    // A wall of panels, which give way at 63 Hz.
    let gains = [1.0, 1.0, 0.9, 0.8, 0.6, 0.4, 0.3];
    let dull = ImageSource { position: Vec3::new(-8.0, 0.0, 0.0), gains, gain_63: 0.8 };
    let air = [0.0, 0.0, 0.0, 0.0, 0.05, 0.1, 0.2];
    let scene = scene(&[dull], air);
    let octaves = [(250.0, 1), (1_000.0, 3), (4_000.0, 5)].map(|(hz, i)| (hz, dull.gains[i], air[i]));
    for (hz, gain, air) in octaves.into_iter().chain([(62.5, dull.gain_63, 0.0)]) {
        let dry: Vec<f32> = (0..9_600).map(|n| (std::f32::consts::TAU * hz / 48_000.0 * n as f32).sin()).collect();
        let [left, right] = heard(&scene, &dry, |_| Pose::IDENTITY);
        let power = |x: &[f32]| x[4_800..].iter().map(|v| f64::from(*v).powi(2)).sum::<f64>();
        let mean: Vec<f32> = left.iter().zip(&right).map(|(l, r)| 0.5 * (l + r)).collect();
        let found = 10.0 * (power(&mean) / power(&dry)).log10();
        let want = f64::from(20.0 * (gain / 8.0).log10() - 8.0 * air);
        assert!((found - want).abs() < 0.7, "{hz}: {found} dB, {want}");
    }
}

#[test]
fn close_images_do_not_grow_without_bound() {
    let scene = scene(&[image(0.0, 0.001)], [0.0; 7]);
    let [left, _] = heard(&scene, &pulse(2_000, 500), |_| Pose::IDENTITY);
    assert!(left.iter().all(|v| v.abs() < 2.0 / NEAREST_M));
}
