//! A listener turned by automation is heard where it is, whatever the blocks; the engine by itself turns in the same way.

use promenade_core::glam::Vec3;
use promenade_core::{BlockParams, Pose, Renderer, Scene, Spatializer};
use promenade_host::{Lane, Point, bounce};
use promenade_tests::signal::{difference_db, noise, peak};
use promenade_tests::{Host, Setup, in_both_formats};
use std::sync::Arc;

in_both_formats!(
    long_blocks_move_as_finely_as_short_ones,
    odd_blocks_move_as_even_ones,
    steps_turn_the_listener_as_in_the_engine
);

/// Far below what can be heard; the blocks make no difference to the bit.
const SAME_DB: f32 = -100.0;
const LEN: usize = 40_000;

/// Half a turn to and fro, in steps of 32 samples, and up by a metre.
fn ramps<H: Host>(host: &mut H) -> Vec<Lane> {
    let rate = host.instance().setup().rate;
    let mut lane = |name: &str, values: &[&str]| {
        let parameter = host.instance().parameter(name).unwrap().clone();
        let value = |text: &&str| host.instance().from_text(parameter.id, text).unwrap();
        let values: Vec<f64> = values.iter().map(value).collect();
        let point = |(number, value)| Point { seconds: 0.2 * number as f64, value, hold: false };
        Lane::new(&parameter, &values.into_iter().enumerate().map(point).collect::<Vec<_>>(), rate).unwrap()
    };
    vec![lane("Yaw", &["-90 deg", "90 deg", "0 deg", "60 deg"]), lane("Listener Z", &["0", "1 m"])]
}

fn turned<H: Host>(block: usize) -> [Vec<f32>; 2] {
    let mut host = H::open(Setup { block, ..Setup::default() });
    let lanes = ramps(&mut host);
    let signal = noise(LEN);
    bounce(host.instance(), &[&signal, &signal], &lanes, 0).unwrap()
}

fn long_blocks_move_as_finely_as_short_ones<H: Host>() {
    let fine = turned::<H>(32);
    let coarse = turned::<H>(8192);
    let difference = difference_db(&fine, &coarse);
    assert!(difference < SAME_DB, "blocks of 8192 differ from blocks of 32 by {difference} dB");
    let mut still = H::open(Setup::default());
    let signal = noise(LEN);
    let unmoved = bounce(still.instance(), &[&signal, &signal], &[], 0).unwrap();
    assert!(peak(&fine[0]) > 0.01 && difference_db(&fine, &unmoved) > -40.0, "the automation moves nothing");
}

fn odd_blocks_move_as_even_ones<H: Host>() {
    let reference = turned::<H>(1024);
    for block in [1, 7, 256 * 7] {
        let difference = difference_db(&reference, &turned::<H>(block));
        assert!(difference < SAME_DB, "blocks of {block} differ by {difference} dB");
    }
}

fn steps_turn_the_listener_as_in_the_engine<H: Host>() {
    // Degrees that parameters hold exactly.
    let steps = [(0_usize, 45.0_f32), (4_801, -90.0), (9_990, -22.5), (20_000, 67.5), (20_001, 0.0)];
    let rate = 48_000.0;
    let mut host = H::open(Setup { offline: true, ..Setup::default() });
    let yaw = host.instance().parameter("Yaw").unwrap().clone();
    let point = |&(at, degrees): &(usize, f32)| Point {
        seconds: at as f64 / rate,
        value: 0.5 + f64::from(degrees) / 360.0,
        hold: true,
    };
    let lanes = [Lane::new(&yaw, &steps.iter().map(point).collect::<Vec<_>>(), rate).unwrap()];
    let signal = noise(LEN);
    let heard = bounce(host.instance(), &[&signal, &signal], &lanes, 0).unwrap();

    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/../presets/scenes/iosr-room-a.promenade");
    let scene = Arc::new(Scene::from_bytes(&std::fs::read(scene).unwrap()).unwrap());
    let mut engine = Spatializer::new(rate);
    engine.install(Box::new(Renderer::new(scene, rate).unwrap()));
    let late = engine.latency_samples();
    let padded = [&signal[..], &vec![0.0; late]].concat();
    let mut wanted = [vec![0.0; padded.len()], vec![0.0; padded.len()]];
    let pose = |sample: usize| {
        let now = steps.iter().rev().find(|(at, _)| *at <= sample).map_or(0.0, |(_, degrees)| *degrees);
        Pose::from_ypr(Vec3::ZERO, now.to_radians(), 0.0, 0.0)
    };
    let [left, right] = &mut wanted;
    engine.process(&[&padded], [left, right], &BlockParams::default(), pose);
    let wanted = wanted.map(|ear| ear[late..].to_vec());
    assert!(peak(&wanted[0]) > 0.01);
    let difference = difference_db(&wanted, &heard);
    assert!(difference < -120.0, "{difference} dB from the engine by itself");
}
