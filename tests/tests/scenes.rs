//! Scenes change and listeners walk while the sound goes on.

use promenade_tests::signal::{difference_db, largest_step, noise, peak, sine};
use promenade_tests::{Host, Setup, edit_state, in_both_formats, render};
use serde_json::json;
use std::time::{Duration, Instant};

in_both_formats!(
    a_scene_changes_without_a_click_and_then_sounds_as_if_it_had_always_been_there,
    the_path_position_walks_the_camera_path,
    parameters_and_camera_paths_have_the_same_units,
    the_transport_walks_the_camera_path,
    a_transport_that_is_located_jumps,
    a_bounce_is_of_all_of_a_scene,
    a_transport_without_a_tempo_walks_the_same,
    what_is_no_number_does_not_stay,
);

const RATE: f64 = 48_000.0;

/// Plays a looped second of `signal` until a change is heard, at most ten seconds; returns what was heard.
fn until_heard<H: Host>(host: &mut H, signal: &[f32], heard: impl Fn(&[f32]) -> bool) -> Vec<f32> {
    let mut all = Vec::new();
    let started = Instant::now();
    while started.elapsed() < Duration::from_secs(10) {
        let out = render(host, &[signal, signal], &[480]);
        all.extend_from_slice(&out[0]);
        if heard(&out[0]) {
            return all;
        }
        // The loader works in real time, this host faster.
        std::thread::sleep(Duration::from_millis(20));
    }
    panic!("the change is not heard within ten seconds");
}

fn a_scene_changes_without_a_click_and_then_sounds_as_if_it_had_always_been_there<H: Host>() {
    // A whole number of periods, so that repeats join.
    let signal = sine(200.0, RATE, 4800);
    let steady = |scene: f64| {
        let mut host = H::open(Setup::default());
        host.set("scene", scene);
        host.process(&[&[0.0; 480], &[0.0; 480]]);
        host.reopen(Setup::default());
        let out = render(&mut host, &[&signal.repeat(20), &signal.repeat(20)], &[480]);
        out[0][out[0].len() - signal.len()..].to_vec()
    };
    let (room_a, room_b) = (steady(0.0), steady(0.5));
    let distance = |a: &[f32], b: &[f32]| a.iter().zip(b).fold(0.0_f32, |most, (a, b)| most.max((a - b).abs()));
    assert!(distance(&room_a, &room_b) > 0.01, "the two rooms sound alike");

    let mut host = H::open(Setup::default());
    host.set("scene", 0.0);
    until_heard(&mut host, &signal, |out| distance(out, &room_a) < 1e-3);
    host.set("scene", 0.5);
    let is_room_b = |out: &[f32]| distance(out, &room_b) < 1e-3;
    let heard = until_heard(&mut host, &signal, is_room_b);
    assert!(heard.iter().all(|s| s.is_finite()));
    let steady_step = largest_step(&room_a).max(largest_step(&room_b));
    let step = largest_step(&heard);
    assert!(step < 1.5 * steady_step, "a step of {step}, steady at most {steady_step}");
}

/// A quarter turn to the left in two seconds.
fn turning<H: Host>() -> H {
    let mut host = H::open(Setup::default());
    let walk = json!({ "keyframes": [
        { "t": 10.0, "position": [0.0, 0.0, 0.0], "ypr": [0.0, 0.0, 0.0] },
        { "t": 12.0, "position": [0.0, 0.0, 0.0], "ypr": [90.0, 0.0, 0.0] },
    ]});
    let state = edit_state(&host.state(), "walk", &walk);
    assert!(host.load(&state));
    host
}

fn turned<H: Host>(yaw_deg: f64) -> [Vec<f32>; 2] {
    let mut host = H::open(Setup::default());
    host.set("yaw", 0.5 + yaw_deg / 360.0);
    settled(&mut host)
}

/// The sound once the pose of the first block has long been reached.
fn settled<H: Host>(host: &mut H) -> [Vec<f32>; 2] {
    let signal = noise(9600);
    let out = render(host, &[&signal, &signal], &[480]);
    out.map(|ear| ear[4800..].to_vec())
}

fn the_path_position_walks_the_camera_path<H: Host>() {
    for (share, yaw_deg) in [(0.0, 0.0), (0.5, 45.0), (1.0, 90.0)] {
        let mut host = turning::<H>();
        host.set("follow", 0.5);
        host.set("path", share);
        let difference = difference_db(&settled(&mut host), &turned::<H>(yaw_deg));
        assert!(difference < -60.0, "at {share} of the path: {difference} dB");
    }
    assert!(difference_db(&turned::<H>(0.0), &turned::<H>(90.0)) > -40.0, "turning changes nothing");
}

fn parameters_and_camera_paths_have_the_same_units<H: Host>() {
    let pose = json!({ "keyframes": [{ "t": 0.0, "position": [0.5, -0.4, 0.3], "ypr": [30.0, 20.0, -10.0] }] });
    let mut walked = H::open(Setup::default());
    let state = edit_state(&walked.state(), "walk", &pose);
    assert!(walked.load(&state));
    walked.set("follow", 0.5);
    let expected = settled(&mut walked);
    let mut host = H::open(Setup::default());
    let knobs = [
        ("x", 0.505),
        ("y", 0.496),
        ("z", 0.503),
        ("yaw", 0.5 + 30.0 / 360.0),
        ("pitch", 0.5 + 20.0 / 180.0),
        ("roll", 0.5 - 10.0 / 360.0),
    ];
    for (id, value) in knobs {
        host.set(id, value);
    }
    let difference = difference_db(&settled(&mut host), &expected);
    assert!(difference < -60.0, "{difference} dB");
}

fn the_transport_walks_the_camera_path<H: Host>() {
    let mut host = turning::<H>();
    host.set("follow", 1.0);
    // Past the end the path stays at its last pose.
    host.play_from(5.0);
    let difference = difference_db(&settled(&mut host), &turned::<H>(90.0));
    assert!(difference < -60.0, "after the end: {difference} dB");
    let mut host = turning::<H>();
    host.set("follow", 1.0);
    host.play_from(-5.0);
    let difference = difference_db(&settled(&mut host), &turned::<H>(0.0));
    assert!(difference < -60.0, "before the start: {difference} dB");
    let mut host = turning::<H>();
    host.set("follow", 1.0);
    host.play_from(0.0);
    let walking = settled(&mut host);
    assert!(difference_db(&walking, &turned::<H>(0.0)) > -60.0, "the transport does not move the listener");
    assert!(difference_db(&walking, &turned::<H>(90.0)) > -60.0, "the listener jumps to the end");
}

fn a_bounce_is_of_all_of_a_scene<H: Host>() {
    let signal = noise(9_600);
    let [all, less] = [0.0, 1.0].map(|accuracy| {
        let mut host = H::open(Setup { offline: true, ..Setup::default() });
        host.set("accuracy", accuracy);
        render(&mut host, &[&signal, &signal], &[480]);
        render(&mut host, &[&signal, &signal], &[480])
    });
    assert!(peak(&all[0]) > 0.01 && all == less);
}

fn a_transport_that_is_located_jumps<H: Host>() {
    // After the latency, samples.
    const SOUNDS_ON: usize = 57_600;
    // Without a room, of which the waves of the bass sound on nevertheless.
    let draft = || {
        let mut host = turning::<H>();
        host.set("early", 0.0);
        host.set("late", 0.0);
        host.set("follow", 1.0);
        host
    };
    let signal = noise(72_000);
    let block = 480;
    let located = |to_s: f64| {
        let mut host = draft();
        host.play_from(0.0);
        render(&mut host, &[&signal, &signal], &[block]);
        host.play_from(to_s);
        let sounds_on = host.latency() + SOUNDS_ON;
        render(&mut host, &[&signal, &signal], &[block]).map(|ear| ear[sounds_on..].to_vec())
    };
    let mut there = draft();
    there.play_from(50.0);
    let wanted = render(&mut there, &[&signal, &signal], &[block]);
    let wanted = wanted.map(|ear| ear[there.latency() + SOUNDS_ON..].to_vec());
    let difference = difference_db(&located(50.0), &wanted);
    assert!(difference < -60.0, "after the jump the listener is {difference} dB away");
    let difference = difference_db(&located(-5.0), &wanted);
    assert!(difference > -40.0, "before the turn it sounds the same but for {difference} dB");
}

fn a_transport_without_a_tempo_walks_the_same<H: Host>() {
    let walked = |tempo: Option<f64>| {
        let mut host = turning::<H>();
        host.set("follow", 1.0);
        host.reopen(Setup { tempo, ..Setup::default() });
        let signal = noise(48_000);
        let mut out = [Vec::new(), Vec::new()];
        host.play_from(0.0);
        for (number, block) in signal.chunks(512).enumerate() {
            // Changes cut the block; wrappers then repeat its position where there is no tempo to move it by.
            for offset in (0..block.len()).step_by(100) {
                host.set_at("gain", 0.8 + 0.01 * ((number + offset) % 3) as f64, offset);
            }
            out.iter_mut().zip(host.process(&[block, block])).for_each(|(all, new)| all.extend(new));
        }
        out
    };
    let difference = difference_db(&walked(Some(120.0)), &walked(None));
    assert!(difference < -80.0, "{difference} dB");
}

fn what_is_no_number_does_not_stay<H: Host>() {
    let mut host = H::open(Setup::default());
    let mut bad = noise(512);
    bad[17] = f32::NAN;
    bad[18] = f32::INFINITY;
    host.process(&[&bad, &bad]);
    let signal = noise(48_000);
    let out = render(&mut host, &[&signal, &signal], &[512]);
    assert!(out.iter().flatten().all(|s| s.is_finite()));
    assert!(peak(&out[0]) > 0.01);
}
