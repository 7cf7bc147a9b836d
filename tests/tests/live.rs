//! Anchor clouds decoded live, on a thread that all instances share.

use promenade_core::glam::Vec3;
use promenade_core::network::CloudKind;
use promenade_core::published::{ConvMode, Projection};
use promenade_core::{AnchorCloud, Bands, BlockParams, LiveParams, Pose, Scene, SceneParts, Spatializer, StftGrid, TailModel};
use promenade_testing::golden;
#[cfg(target_os = "linux")]
use promenade_tests::bare::{Bare, BareVst3, Plugin};
#[cfg(target_os = "linux")]
use promenade_tests::host_id;
use promenade_tests::signal::{difference_db, noise, peak};
use promenade_tests::{Host, Setup, in_both_formats, in_library, render};
use std::path::Path;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

in_both_formats!(offline_waits_for_every_decode, instances_in_real_time_settle_to_the_same_sound);

const SCENE: &str = "cloud.promenade";

fn fill(folder: &Path) {
    let rate = 22_050.0;
    let bands = Bands::for_rate(rate);
    let tail = TailModel { seed: 3, t60_s: vec![0.1; bands.count()], coherence: vec![0.0; bands.count()], by_phase: false };
    let scene = Scene::new(SceneParts {
        taps: 16,
        cloud: Some(AnchorCloud {
            model: golden::slice(CloudKind::Sh).model,
            conv: ConvMode::Off,
            projection: Projection::Diagonal,
            emitter: None,
        }),
        top_hz: 10_000.0,
        bounds: (Vec3::splat(-1.0), Vec3::ONE),
        ..SceneParts::new(StftGrid { sample_rate_hz: rate, n_fft: 512, hop: 127 }, bands, tail)
    });
    std::fs::write(folder.join(SCENE), scene.unwrap().to_bytes().unwrap()).unwrap();
}

fn opened<H: Host>(offline: bool) -> H {
    let mut host = H::open(Setup::default());
    host.set("scene", 1.0);
    host.set("slot", 1.0 / 64.0);
    host.process(&[&[0.0; 64], &[0.0; 64]]);
    host.reopen(Setup { offline, ..Setup::default() });
    host
}

/// Yaw of a block, 0 to 1 over a turn; exact in degrees.
fn turn(block: usize) -> f64 {
    0.5 + (block / 8 % 16) as f64 / 64.0
}

/// Plays blocks of a signal, each with its turn.
fn turned<H: Host>(host: &mut H, signal: &[f32]) -> [Vec<f32>; 2] {
    let mut heard = [Vec::new(), Vec::new()];
    for (number, block) in signal.chunks(512).enumerate() {
        host.set("yaw", turn(number));
        heard.iter_mut().zip(host.process(&[block, block])).for_each(|(all, new)| all.extend(new));
    }
    heard
}

/// What the engine plays of the signal while it waits for every decode.
fn waited_for(folder: &Path, signal: &[f32]) -> [Vec<f32>; 2] {
    let scene = Arc::new(Scene::from_bytes(&std::fs::read(folder.join(SCENE)).unwrap()).unwrap());
    let mut spatializer = Spatializer::new(48_000.0);
    spatializer.install(Box::new(promenade_testing::scenes::live_renderer(&scene, 48_000.0)));
    let live = LiveParams { wait: true, ..LiveParams::default() };
    let params = BlockParams { live, ..BlockParams::default() };
    let mut wanted = [vec![0.0; signal.len()], vec![0.0; signal.len()]];
    for (number, block) in signal.chunks(512).enumerate() {
        let yaw_deg = -180.0 + 360.0 * turn(number) as f32;
        let pose = Pose::from_ypr(Vec3::ZERO, yaw_deg.to_radians(), 0.0, 0.0);
        let [left, right] = &mut wanted;
        let span = number * 512..(number + 1) * 512;
        spatializer.process(&[block], &[], [&mut left[span.clone()], &mut right[span]], &params, |_| pose);
    }
    assert!(peak(&wanted[0]) > 1e-3);
    wanted
}

fn offline_waits_for_every_decode<H: Host>() {
    in_library(fill, |folder| {
        let signal = noise(40 * 512);
        let heard = turned(&mut opened::<H>(true), &signal);
        let difference = difference_db(&waited_for(folder, &signal), &heard);
        assert!(difference < -120.0, "{difference} dB from the engine by itself");
    });
}

/// VST3 hosts say how they render with the setup, with each block or with both, and may change it from block to block.
#[cfg(target_os = "linux")]
#[test]
fn a_bounce_is_one_however_a_host_says_so() {
    in_library(fill, |folder| {
        let signal = noise(40 * 512);
        let wanted = waited_for(folder, &signal);
        let from_engine = |of_setup: bool, of_blocks: [bool; 2]| {
            let mut bare = BareVst3::make(Plugin::One);
            for (id, value) in [("scene", 1.0), ("slot", 1.0 / 64.0)] {
                bare.set(host_id(id), value);
            }
            bare.setup_is_offline = of_setup;
            bare.activate();
            bare.play(true);
            let halves = of_blocks.iter().zip(signal.chunks(signal.len() / 2)).enumerate();
            let mut heard = [Vec::new(), Vec::new()];
            for (half, (is_offline, signal)) in halves {
                bare.blocks_are_offline = *is_offline;
                for (number, block) in signal.chunks(512).enumerate() {
                    let now = bare.block(block, &[(host_id("yaw"), 0, turn(20 * half + number))]);
                    heard.iter_mut().zip(now).for_each(|(all, new)| all.extend(new));
                }
            }
            difference_db(&wanted, &heard)
        };
        for (of_setup, of_blocks) in [(true, [false; 2]), (false, [true; 2]), (true, [true; 2])] {
            let difference = from_engine(of_setup, of_blocks);
            assert!(difference < -120.0, "setup {of_setup}, blocks {of_blocks:?}: {difference} dB from the engine by itself");
        }
        // Blocks come much faster than decodes.
        for (of_setup, of_blocks) in [(false, [false; 2]), (false, [true, false]), (true, [true, false])] {
            let difference = from_engine(of_setup, of_blocks);
            assert!(difference > -60.0, "setup {of_setup}, blocks {of_blocks:?}: live, and waits: {difference} dB");
        }
    });
}

fn instances_in_real_time_settle_to_the_same_sound<H: Host>() {
    in_library(fill, |_| {
        let signal = noise(4800);
        let mut steady = opened::<H>(true);
        steady.set("yaw", 0.75);
        let wanted = (0..10).map(|_| render(&mut steady, &[&signal, &signal], &[480])).last().unwrap();
        let mut hosts = [0, 1, 2].map(|_| opened::<H>(false));
        for (number, host) in hosts.iter_mut().enumerate() {
            // They come from different sides.
            host.set("yaw", number as f64 / 4.0);
            render(host, &[&signal, &signal], &[480]);
            host.set("yaw", 0.75);
        }
        let started = Instant::now();
        let mut left = f32::MAX;
        while started.elapsed() < Duration::from_secs(20) && left > -80.0 {
            thread::sleep(Duration::from_millis(30));
            let differences = hosts.each_mut().map(|h| difference_db(&wanted, &render(h, &[&signal, &signal], &[480])));
            left = differences.into_iter().fold(f32::MIN, f32::max);
        }
        assert!(left < -80.0, "after {:?} an instance is still {left} dB away", started.elapsed());
    });
}
