//! A scene on another grid has another latency, and hosts are told.

// The engine's own test scenes; this crate needs one whose hop is not that of the factory scenes.

use promenade_testing::scenes;
use promenade_tests::signal::{impulse, peak_index};
use promenade_tests::{Host, Setup, edit_state, in_both_formats, render};
use serde_json::json;

in_both_formats!(the_latency_follows_the_scene, a_new_latency_is_told_when_a_host_may_hear_it);

const AT: usize = 9600;

/// Plays and then chooses a scene of another latency.
fn another_scene<H: Host>(name: &str) -> H {
    // Whole samples make a hop of 39 at this rate, 4.88 ms, where the usual one is 5 ms.
    let scene = scenes::room(7_990.0, 0.3, 0.05);
    let file = std::env::temp_dir().join(format!("promenade-{name}-{}-{}.promenade", H::FORMAT, std::process::id()));
    std::fs::write(&file, scene.to_bytes().unwrap()).unwrap();

    let mut host = H::open(Setup::default());
    host.set("mix", 0.0);
    let silence = vec![0.0; 4800];
    render(&mut host, &[&silence, &silence], &[480]);
    let mut state = host.state();
    state["params"]["scene"] = json!({ "string": "library" });
    assert!(host.load(&edit_state(&state, "scene", &json!({ "absolute": file }))));
    std::fs::remove_file(&file).unwrap();
    host
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
