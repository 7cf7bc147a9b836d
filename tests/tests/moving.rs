//! A listener turned by automation is heard where it is, whatever the blocks; the engine by itself turns in the same way.

use promenade_core::glam::Vec3;
use promenade_core::{BlockParams, Pose, Renderer, Scene, Spatializer};
use promenade_host::{Lane, Point, bounce};
use promenade_tests::signal::{difference_db, noise, peak, sine};
use promenade_tests::{Host, Setup, in_both_formats};
use std::f64::consts::TAU;
use std::sync::Arc;

in_both_formats!(
    long_blocks_move_as_finely_as_short_ones,
    odd_blocks_move_as_even_ones,
    steps_turn_the_listener_as_in_the_engine,
    one_value_a_block_makes_no_stairs,
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

/// Offline: live, instances that play short blocks have their frames apart.
fn turned<H: Host>(block: usize) -> [Vec<f32>; 2] {
    let mut host = H::open(Setup { block, offline: true, ..Setup::default() });
    let lanes = ramps(&mut host);
    let signal = noise(LEN);
    bounce(host.instance(), &[&signal, &signal], &lanes, 0).unwrap()
}

fn long_blocks_move_as_finely_as_short_ones<H: Host>() {
    let fine = turned::<H>(32);
    let coarse = turned::<H>(8192);
    let difference = difference_db(&fine, &coarse);
    assert!(difference < SAME_DB, "blocks of 8192 differ from blocks of 32 by {difference} dB");
    let mut still = H::open(Setup { offline: true, ..Setup::default() });
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

    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/../presets/scenes/loft.promenade");
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
    engine.process(&[&padded], &[], [left, right], &BlockParams::default(), pose);
    let wanted = wanted.map(|ear| ear[late..].to_vec());
    assert!(peak(&wanted[0]) > 0.01);
    let difference = difference_db(&wanted, &heard);
    assert!(difference < -120.0, "{difference} dB from the engine by itself");
}

/// Power of the lines that stairs of a block make beside a tone, over that of the tone, dB.
fn lines_db(signal: &[f32], tone_hz: f64, apart_hz: f64) -> f64 {
    const FRAME: usize = 16_384;
    let power = |frame: &[f32], hz: f64| {
        let turned = frame.iter().enumerate().map(|(i, sample)| {
            let window = 0.5 - 0.5 * (TAU * i as f64 / FRAME as f64).cos();
            let (sin, cos) = (TAU * hz * i as f64 / 48_000.0).sin_cos();
            (f64::from(*sample) * window * cos, f64::from(*sample) * window * sin)
        });
        let (re, im) = turned.fold((0.0, 0.0), |(re, im), (x, y)| (re + x, im + y));
        re * re + im * im
    };
    let frames = signal.chunks_exact(FRAME).skip(1);
    let (tone, lines) = frames.fold((0.0, 0.0), |(tone, lines), frame| {
        let beside = power(frame, tone_hz - apart_hz) + power(frame, tone_hz + apart_hz);
        (tone + power(frame, tone_hz), lines + beside)
    });
    10.0 * (lines / tone).log10()
}

/// The left ear of a head that turns at 45 degrees a second before a tone, with a value every `every` samples.
fn turning<H: Host>(every: usize) -> Vec<f32> {
    let mut host = H::open(Setup { block: 1024, ..Setup::default() });
    let tone = sine(1000.0, 48_000.0, 96 * 1024);
    let mut heard = Vec::new();
    for (number, block) in tone.chunks(1024).enumerate() {
        for offset in (0..1024).step_by(every) {
            let seconds = (number * 1024 + offset) as f64 / 48_000.0;
            host.set_at("yaw", 0.25 + 45.0 / 360.0 * seconds, offset);
        }
        heard.extend_from_slice(&host.process(&[block, block])[0]);
    }
    heard
}

fn one_value_a_block_makes_no_stairs<H: Host>() {
    let [fine, once] = [32, 1024].map(|every| lines_db(&turning::<H>(every), 1000.0, 48_000.0 / 1024.0));
    println!("{fine:.1} dB with a value every 32 samples, {once:.1} dB with one every 1024");
    assert!(once < fine + 6.0, "{once:.1} dB beside the tone, {fine:.1} dB with a value every 32 samples");
}
