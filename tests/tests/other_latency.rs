//! A scene on another grid has another latency, and hosts are told.

// The engine's own test scenes; this crate needs one whose hop is not that of the factory scenes.

use promenade_testing::scenes;
use promenade_tests::signal::{impulse, largest_step, peak_index, sine};
use promenade_tests::{Host, Setup, edit_state, in_both_formats, render};
use serde_json::json;
use std::path::PathBuf;
use std::thread;
use std::time::{Duration, Instant};

in_both_formats!(
    the_latency_follows_the_scene,
    a_new_latency_is_told_when_a_host_may_hear_it,
    another_latency_asks_once_and_comes_after_silence,
    a_latency_is_chosen_and_reported,
);

const AT: usize = 9600;

/// Plays and then chooses a scene of another latency.
fn another_scene<H: Host>(name: &str) -> H {
    let mut host = H::open(Setup::default());
    host.set("mix", 0.0);
    let silence = vec![0.0; 4800];
    render(&mut host, &[&silence, &silence], &[480]);
    choose_another(&mut host, name);
    host
}

/// Chooses a scene of another latency.
fn choose_another<H: Host>(host: &mut H, name: &str) {
    let file = another_file::<H>(name);
    let mut state = host.state();
    state["params"]["scene"] = json!({ "string": "library" });
    assert!(host.load(&edit_state(&state, "scene", &json!({ "absolute": file }))));
    std::fs::remove_file(&file).unwrap();
}

/// The file of a scene of another latency.
fn another_file<H: Host>(name: &str) -> PathBuf {
    // Whole samples make a hop of 39 at this rate, 4.88 ms, where the usual one is 5 ms.
    let scene = scenes::room(7_990.0, 0.3, 0.05);
    let file = std::env::temp_dir().join(format!("promenade-{name}-{}-{}.promenade", H::FORMAT, std::process::id()));
    std::fs::write(&file, scene.to_bytes().unwrap()).unwrap();
    file
}

fn a_new_latency_is_told_when_a_host_may_hear_it<H: Host>() {
    let mut host = another_scene::<H>("told");
    let silence = vec![0.0; 480];
    // One block is played with the new scene, and the host deactivates before it serves anything: CLAP's latency changes with
    // an activation only.
    host.process(&[&silence, &silence]);
    host.reopen(Setup::default());
    host.process(&[&silence, &silence]);
}

fn the_latency_follows_the_scene<H: Host>() {
    let before = H::open(Setup::default()).latency();
    let mut host = another_scene::<H>("latency");
    // Long enough for the cross-fade to end before the impulse comes.
    let signal = impulse(AT, 2 * AT);
    let out = render(&mut host, &[&signal, &signal], &[480]);
    let after = host.latency();
    assert_ne!(after, before, "the scenes have the same latency");
    assert_eq!(peak_index(&out[0]) - AT, after);
}

fn a_latency_is_chosen_and_reported<H: Host>() {
    let mut host = H::open(Setup::default());
    let silence = vec![0.0; 480];
    let frame = host.latency();
    for (value, samples) in [(0.5, 64), (1.0, 0), (0.0, frame)] {
        let restarts = host.instance().restarts();
        host.set("latency", value);
        let began = Instant::now();
        while host.latency() != samples && began.elapsed() < Duration::from_secs(30) {
            host.process(&[&silence, &silence]);
            thread::sleep(Duration::from_millis(5));
        }
        assert_eq!(host.latency(), samples);
        assert_eq!(host.instance().restarts(), restarts + 1);
        // Dry and rendered sound are where the host expects them, but that without latency the rendered cannot be.
        for (bypass, at) in [(1.0, samples), (0.0, if samples == 0 { 60 } else { samples })] {
            host.set("bypass", bypass);
            let signal = impulse(AT, 2 * AT);
            let out = render(&mut host, &[&signal, &signal], &[480]);
            // Heads have a response of their own.
            let (late, longest) = (peak_index(&out[0]) - AT, if bypass == 1.0 { 0 } else { 48 });
            assert!((at..=at + longest).contains(&late), "{samples}, bypass {bypass}: {late}");
        }
    }
}

fn another_latency_asks_once_and_comes_after_silence<H: Host>() {
    let mut host = H::open(Setup::default());
    // The project's own scene is another than the one that is played: hosts stop a plugin while they load a state, but not
    // for a parameter.
    let file = another_file::<H>("silence");
    let mut state = host.state();
    state["params"]["scene"] = json!({ "string": "iosr-room-a" });
    assert!(host.load(&edit_state(&state, "scene", &json!({ "absolute": file }))));
    let before = host.latency();
    // A whole number of periods in each block.
    let block = sine(200.0, 48_000.0, 480);
    let play = |host: &mut H, blocks: usize| {
        let mut all = Vec::new();
        for _ in 0..blocks {
            all.extend_from_slice(&host.process(&[&block, &block])[0]);
            // A host's main thread comes between two blocks, and activates the plugin again where it was asked to.
            host.latency();
        }
        all
    };
    let steady = play(&mut host, 100);
    let restarts = host.instance().restarts();
    host.set("scene", 1.0);
    // The scene is loaded meanwhile, on a machine that may be busy.
    let (began, mut change) = (Instant::now(), Vec::new());
    while host.latency() == before && began.elapsed() < Duration::from_secs(30) {
        change.extend(play(&mut host, 10));
        thread::sleep(Duration::from_millis(5));
    }
    change.extend(play(&mut host, 200));
    assert_ne!(host.latency(), before);
    assert_eq!(host.instance().restarts(), restarts + 1);
    let end = &change[change.len() - 50 * 480..];
    let most = largest_step(&steady[50 * 480..]).max(largest_step(end));
    let step = largest_step(&[&steady[steady.len() - 1..], &change[..]].concat());
    assert!(step < 1.3 * most, "a step of {step}, steady at most {most}");
    assert!(change.chunks(480).any(|block| block.iter().all(|x| *x == 0.0)), "no silence");
    assert!(end.iter().any(|x| x.abs() > 1e-3), "the new scene is not heard");
    std::fs::remove_file(&file).unwrap();
}
