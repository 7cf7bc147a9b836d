//! Open Sound Control in a host: a project that listens is turned by what comes in.

use promenade_core::Scene;
use promenade_core::glam::{Quat, Vec3};
use promenade_tests::signal::{difference_db, noise, rms};
use promenade_tests::{Host, Setup, edit_state, in_both_formats, render};
use serde_json::{Value, json};
use std::net::UdpSocket;
use std::time::{Duration, Instant};

in_both_formats!(
    a_tracker_turns_the_head,
    what_osc_has_set_is_saved,
    a_parameter_switches_osc_on,
    objects_of_adm_osc_move_further_sources,
);

/// Elsewhere 127.0.0.2 is no address of the machine.
#[cfg(target_os = "linux")]
mod this_machine {
    use super::*;
    in_both_formats!(a_project_opens_no_port_to_networks_by_itself);
}

const BLOCK: usize = 512;
/// Longest wait for a message to be heard; nothing is timed by it.
const PATIENCE: Duration = Duration::from_secs(20);

/// Numbers at an address, as Open Sound Control has them.
fn message<const N: usize>(address: &str, values: [f32; N]) -> Vec<u8> {
    let padded = |text: &str| {
        let mut bytes = text.as_bytes().to_vec();
        bytes.resize(bytes.len() / 4 * 4 + 4, 0);
        bytes
    };
    let numbers = values.map(f32::to_be_bytes).concat();
    [padded(address), padded(&format!(",{}", "f".repeat(N))), numbers].concat()
}

fn free_port() -> u16 {
    UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
}

/// A sender to a port of this machine.
fn sender(port: u16) -> UdpSocket {
    let to = UdpSocket::bind("127.0.0.1:0").unwrap();
    to.connect(("127.0.0.1", port)).unwrap();
    to
}

/// How much louder the left ear is than the right, dB, once a head that is told to turn has turned.
fn after_turning<H: Host>(host: &mut H, to: &UdpSocket, yaw_deg: f32, is_so: impl Fn(f64) -> bool) -> f64 {
    let signal = noise(BLOCK);
    let started = Instant::now();
    loop {
        // The socket opens on a thread of its own; before, the system may say that nobody listens.
        let _refused = to.send(&message("/promenade/ypr", [yaw_deg, 0.0, 0.0]));
        let mut ears = [0.0; 2];
        for _ in 0..40 {
            let out = host.process(&[&signal, &signal]);
            ears = [0, 1].map(|ear| rms(&out[ear]));
        }
        let ild_db = 20.0 * (ears[0] / ears[1]).log10();
        if is_so(ild_db) || started.elapsed() > PATIENCE {
            return ild_db;
        }
    }
}

fn a_tracker_turns_the_head<H: Host>() {
    let port = free_port();
    let mut host = H::open(Setup { block: BLOCK, ..Setup::default() });
    let off = host.state();
    // As earlier versions saved it, in the settings.
    let state = edit_state(&off, "osc", &json!({ "on": true, "port": port, "format": "of-tomorrow" }));
    assert!(host.load(&state));
    assert_eq!(host.value("osc"), 1.0);
    let saved: Value = serde_json::from_str(host.state()["fields"]["osc"].as_str().unwrap()).unwrap();
    assert_eq!((&saved["port"], &saved["format"]), (&json!(port), &json!("promenade")));
    let to = sender(port);
    // The source is ahead: at the right ear of a head that is turned to the left.
    let left = after_turning(&mut host, &to, 60.0, |ild_db| ild_db < -3.0);
    assert!(left < -3.0, "turned to the left, the left ear is {left:.1} dB louder");
    let right = after_turning(&mut host, &to, -60.0, |ild_db| ild_db > 3.0);
    assert!(right > 3.0, "turned to the right, the left ear is {right:.1} dB louder");
    // Switched off by another state, the head looks ahead again and the port is free.
    assert!(host.load(&off.to_string().into_bytes()));
    UdpSocket::bind(("127.0.0.1", port)).expect("the port is free");
}

fn what_osc_has_set_is_saved<H: Host>() {
    let port = free_port();
    let mut host = H::open(Setup { block: BLOCK, ..Setup::default() });
    let fresh = host.state();
    assert!(host.load(&edit_state(&fresh, "osc", &json!({ "on": true, "port": port }))));
    let to = sender(port);
    let signal = noise(BLOCK);
    let started = Instant::now();
    let saved = loop {
        // The scene of room B at -12 dB.
        for (id, value) in [("gain", -12.0), ("scene", 1.0)] {
            let _refused = to.send(&message(&format!("/promenade/param/{id}"), [value]));
        }
        host.process(&[&signal, &signal]);
        let saved = host.save();
        let state: Value = serde_json::from_slice(&saved).unwrap();
        let remote = state["fields"]["remote"].to_string();
        if ["gain", "scene"].iter().all(|id| remote.contains(id)) || started.elapsed() > PATIENCE {
            break saved;
        }
    };
    let mut wanted = H::open(Setup { block: BLOCK, ..Setup::default() });
    wanted.set("scene", 0.5);
    wanted.set("gain", 48.0 / 72.0);
    wanted.instance().settle().unwrap();
    let mut again = H::open(Setup { block: BLOCK, ..Setup::default() });
    assert!(again.load(&saved));
    again.instance().settle().unwrap();
    for (id, value) in [("scene", 0.5), ("gain", 48.0 / 72.0)] {
        assert!((again.value(id) - value).abs() < 1e-6, "{id} is saved as {}, heard as {value}", again.value(id));
    }
    let signal = noise(12_000);
    let sound = |host: &mut H| {
        host.reopen(Setup { block: BLOCK, ..Setup::default() });
        render(host, &[&signal, &signal], &[BLOCK])
    };
    let wanted = sound(&mut wanted);
    for (name, host) in [("saved", &mut again), ("heard", &mut host)] {
        let found = sound(host);
        assert!(difference_db(&wanted, &found) < -80.0, "the sound that is {name}: {:.1} dB", difference_db(&wanted, &found));
    }
    // A state replaces what has come over Open Sound Control, also where the host has had the same value all along.
    assert!(host.load(&fresh.to_string().into_bytes()));
    host.instance().settle().unwrap();
    assert_eq!(host.state(), fresh);
}

fn a_parameter_switches_osc_on<H: Host>() {
    let port = free_port();
    let mut host = H::open(Setup { block: BLOCK, ..Setup::default() });
    let state = edit_state(&host.state(), "osc", &json!({ "port": port }));
    assert!(host.load(&state));
    let to = sender(port);
    host.set("osc", 1.0);
    let left = after_turning(&mut host, &to, 60.0, |ild_db| ild_db < -3.0);
    assert!(left < -3.0, "turned to the left, the left ear is {left:.1} dB louder");
    host.set("osc", 0.0);
    let ahead = after_turning(&mut host, &to, 60.0, |ild_db| ild_db.abs() < 1.0);
    assert!(ahead.abs() < 1.0, "switched off, the left ear is {ahead:.1} dB louder");
    let started = Instant::now();
    while UdpSocket::bind(("127.0.0.1", port)).is_err() {
        assert!(started.elapsed() < PATIENCE, "the port is not free");
    }
}

fn objects_of_adm_osc_move_further_sources<H: Host>() {
    let port = free_port();
    let mut host = H::open_many(Setup { block: BLOCK, ..Setup::default() });
    let config = json!({ "on": true, "port": port, "adm": { "object": 5, "metres": 4.0 } });
    let state = edit_state(&host.state(), "osc", &config);
    assert!(host.load(&state));
    let to = sender(port);
    let started = Instant::now();
    // Whatever stays as the host has it is not told.
    let wanted = ["ex3", "ey3", "level3", "level2"];
    let told = loop {
        let _refused = to.send(&message("/adm/obj/7/xyz", [0.25, 0.5, 0.0]));
        let _refused = to.send(&message("/adm/obj/7/gain", [0.1]));
        let _refused = to.send(&message("/promenade/param/level2", [-6.0]));
        host.process(&[&[0.0; BLOCK]]);
        let state = host.state();
        let told: Value = serde_json::from_str(state["fields"]["remote"].as_str().unwrap()).unwrap();
        if wanted.iter().all(|id| told[id].is_number()) || started.elapsed() > PATIENCE {
            break told;
        }
    };
    // 2 m ahead of where the listener begins in the scene of a new instance, and 1 m to the right.
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/../presets/scenes/loft.promenade");
    let scene = Scene::from_bytes(&std::fs::read(scene).unwrap()).unwrap();
    let start = scene.start_pose();
    let there = start.position + Quat::from_rotation_z(start.ypr().0) * Vec3::new(2.0, -1.0, 0.0);
    let offset = there - scene.emitter().unwrap();
    let places = [offset.x, offset.y, -20.0, -6.0];
    for (id, place) in wanted.into_iter().zip(places) {
        assert!((told[id].as_f64().unwrap_or(f64::NAN) - f64::from(place)).abs() < 1e-3, "{id} is {told}, not {place}");
    }
}

#[cfg(target_os = "linux")]
fn a_project_opens_no_port_to_networks_by_itself<H: Host>() {
    let port = free_port();
    let mut host = H::open(Setup { block: BLOCK, ..Setup::default() });
    for permit in ["", "0123456789abcdef0123456789abcdef"] {
        let state = json!({ "on": true, "port": port, "interface": "any", "permit": permit });
        let state = edit_state(&host.state(), "osc", &state);
        assert!(host.load(&state));
        let left = after_turning(&mut host, &sender(port), 60.0, |ild_db| ild_db < -3.0);
        assert!(left < -3.0, "this machine is heard");
        // Taken, if the port were open to all networks of the machine.
        UdpSocket::bind(("127.0.0.2", port)).expect("the port is open to this machine only");
        // What the project asks for is not forgotten.
        let saved: Value = serde_json::from_str(host.state()["fields"]["osc"].as_str().unwrap()).unwrap();
        assert_eq!(saved["interface"], "any");
    }
}
