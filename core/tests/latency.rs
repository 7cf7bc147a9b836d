//! What is heard with a short latency is what is heard with the frame.

use promenade_core::glam::Vec3;
use promenade_core::{BlockParams, Carriers, Latency, Pose, Renderer, Scene, Spatializer, Trim};
use promenade_metrics::tone_cleanliness;
use promenade_testing::hostile::one_transfer;
use promenade_testing::noise;
use promenade_testing::scenes::{DIRECT, render, room, room_with_images, walk};
use promenade_testing::signal::{difference_db, first_difference, impulse, peak_index};
use std::sync::Arc;

const RATE: f64 = 48_000.0;
/// A lead at this rate, samples.
const LEAD: usize = 60;
const FRAME: usize = 780;

fn spatializer(scene: &Arc<Scene>, rate: f64, latency: Latency) -> Spatializer {
    let carriers = Arc::new(Carriers::with_latency(scene, rate, latency));
    assert_eq!(carriers.latency(), latency);
    let mut s = Spatializer::new(rate);
    s.install(Box::new(Renderer::new(Arc::clone(scene), (rate, carriers)).unwrap()));
    s
}

/// Both ears from some sample on.
fn from(ears: &[Vec<f32>; 2], at: usize, len: usize) -> [Vec<f32>; 2] {
    ears.each_ref().map(|ear| ear[at..at + len].to_vec())
}

/// By how much a standing listener's sound differs from that with the frame, dB.
fn difference(scene: &Arc<Scene>, params: &BlockParams, pose: Pose) -> f32 {
    let input = noise(5, 30_000);
    let mut frame = spatializer(scene, RATE, Latency::Frame);
    let tail = frame.tail_samples();
    assert_eq!(frame.latency_samples(), FRAME);
    let wanted = render(&mut frame, &input, &[512], params, |_| pose);
    let mut worst = f32::MIN;
    for (latency, stated, lag) in [(Latency::Samples64, 64, 64), (Latency::None, 0, LEAD)] {
        let mut s = spatializer(scene, RATE, latency);
        assert_eq!(s.latency_samples(), stated);
        // What comes later than is stated belongs to the tail; that of a field of waves has the frame's latency within it.
        let longest = tail + lag - stated;
        assert!((longest - if scene.bass().is_some() { 2 * FRAME } else { 0 }..=longest).contains(&s.tail_samples()));
        let found = render(&mut s, &input, &[512, 31, 100], params, |_| pose);
        let len = input.len() - FRAME;
        worst = worst.max(difference_db(&from(&wanted, FRAME, len), &from(&found, lag, len)));
    }
    worst
}

fn ahead(yaw_deg: f32) -> Pose {
    Pose::from_ypr(Vec3::new(0.3, 0.2, 0.0), yaw_deg.to_radians(), 0.0, 0.0)
}

#[test]
fn a_room_of_noise_sounds_as_with_the_frame() {
    let scene = room(16_000.0, 0.4, 0.1);
    let trimmed = Trim { direct: 0.6, early: 1.4, late: 0.7, decay: 0.8, width: 0.5, ..Trim::NEUTRAL };
    for trim in [Trim::NEUTRAL, trimmed, DIRECT] {
        let params = BlockParams { trim, ..BlockParams::default() };
        let found = difference(&scene, &params, ahead(40.0));
        assert!(found < -35.0, "{trim:?}: {found} dB");
    }
}

/// One measured, one of noise, 60 images and the bass of waves. What begins more than a lead before its time cannot be played
/// at once: of measured rooms, what a direct sound rings before its onset; of waves, what their filters do.
#[test]
fn scenes_of_the_factory_sound_as_with_the_frame() {
    for (name, bar) in [("iosr-room-a", -25.0), ("loft", -36.0)] {
        let file = format!("{}/../presets/scenes/{name}.promenade", env!("CARGO_MANIFEST_DIR"));
        let scene = Arc::new(Scene::from_bytes(&std::fs::read(file).unwrap()).unwrap());
        for trim in [Trim::NEUTRAL, DIRECT] {
            let found = difference(&scene, &BlockParams { trim, ..BlockParams::default() }, scene.start_pose());
            assert!(found < bar, "{name} {trim:?}: {found} dB");
        }
    }
}

#[test]
fn an_impulse_comes_when_it_is_stated() {
    let scene = one_transfer(48_000.0, 1.0, 40, 0.3);
    for rate in [44_100.0, 48_000.0, 96_000.0] {
        let stated = |latency| spatializer(&scene, rate, latency).latency_samples();
        assert_eq!(stated(Latency::Samples64), if rate < 90_000.0 { 64 } else { 128 });
        let mut s = spatializer(&scene, rate, Latency::Samples64);
        let sound = impulse(1_000, 4_000);
        let ears = render(&mut s, &sound, &[1, 64, 200], &BlockParams::default(), |_| Pose::IDENTITY);
        assert_eq!(peak_index(&ears[0]) - 1_000, s.latency_samples(), "{rate}");
        let dry = BlockParams { mix: 0.0, ..BlockParams::default() };
        for latency in Latency::ALL {
            let mut s = spatializer(&scene, rate, latency);
            let ears = render(&mut s, &sound, &[128], &dry, |_| Pose::IDENTITY);
            assert_eq!(peak_index(&ears[0]) - 1_000, s.latency_samples(), "{rate} {latency:?}");
        }
    }
}

#[test]
fn blocks_of_any_length_make_the_same_sound_and_a_reset_is_as_new() {
    let scene = room_with_images(16_000.0, 0.4, 0.1, 12);
    let input = noise(6, 20_000);
    let mut s = spatializer(&scene, RATE, Latency::Samples64);
    let play = |s: &mut Spatializer, sizes: &[usize]| render(s, &input, sizes, &BlockParams::default(), walk(RATE));
    let wanted = play(&mut s, &[512]);
    s.reset();
    assert_eq!(first_difference(&play(&mut s, &[512]), &wanted), None);
    s.reset();
    let found = difference_db(&wanted, &play(&mut s, &[1, 17, 240, 60]));
    assert!(found < -120.0, "{found} dB");
}

/// Power outside 20 % of a tone that circles at 90 degrees a second, in the median and in the worst frame, the worse ear.
#[test]
fn a_circling_tone_is_nearly_as_clean_as_with_the_frame() {
    let tone: Vec<f32> = (0..5 * 48_000).map(|i| 0.5 * (std::f32::consts::TAU * (i % 48) as f32 / 48.0).sin()).collect();
    let circle = |i: usize| Pose::from_ypr(Vec3::ZERO, i as f32 / RATE as f32 * std::f32::consts::FRAC_PI_2, 0.0, 0.0);
    for name in ["iosr-room-a", "iosr-room-b"] {
        let file = format!("{}/../presets/scenes/{name}.promenade", env!("CARGO_MANIFEST_DIR"));
        let scene = Arc::new(Scene::from_bytes(&std::fs::read(file).unwrap()).unwrap());
        let found = |latency| {
            let out = render(&mut spatializer(&scene, RATE, latency), &tone, &[512], &BlockParams::default(), circle);
            let [left, right] = out.map(|ear| tone_cleanliness(&ear[24_000..216_000], RATE, 1000.0).unwrap());
            [left.outside_median_db.max(right.outside_median_db), left.outside_worst_db.max(right.outside_worst_db)]
        };
        let (frame, short) = (found(Latency::Frame), found(Latency::Samples64));
        println!("{name}: frame {frame:?} dB, 64 samples {short:?} dB");
        assert!(short[0] < frame[0] + 8.0 && short[1] < frame[1] + 13.0, "{name}: {short:?} dB, frame {frame:?} dB");
    }
}

#[test]
fn a_walk_is_nearly_that_of_the_frame() {
    let scene = room(16_000.0, 0.4, 0.1);
    let input = noise(7, 48_000);
    let mut frame = spatializer(&scene, RATE, Latency::Frame);
    let wanted = render(&mut frame, &input, &[512], &BlockParams::default(), walk(RATE));
    let mut s = spatializer(&scene, RATE, Latency::None);
    // Poses come a hop later, and those of the frame have their own time.
    let found = render(&mut s, &input, &[512], &BlockParams::default(), walk(RATE));
    let len = input.len() - FRAME;
    let difference = difference_db(&from(&wanted, FRAME, len), &from(&found, LEAD, len));
    assert!(difference < -10.0, "{difference} dB");
}
