//! Open Sound Control in a host: a project that listens is turned by what comes in.

use promenade_tests::signal::{noise, rms};
use promenade_tests::{Host, Setup, edit_state, in_both_formats};
use serde_json::{Value, json};
use std::net::UdpSocket;
use std::time::{Duration, Instant};

in_both_formats!(a_tracker_turns_the_head);

const BLOCK: usize = 512;
/// Longest wait for a message to be heard; nothing is timed by it.
const PATIENCE: Duration = Duration::from_secs(20);

/// Three numbers at an address, as Open Sound Control has them.
fn message(address: &str, values: [f32; 3]) -> Vec<u8> {
    let padded = |text: &str| {
        let mut bytes = text.as_bytes().to_vec();
        bytes.resize(bytes.len() / 4 * 4 + 4, 0);
        bytes
    };
    let numbers = values.map(f32::to_be_bytes).concat();
    [padded(address), padded(",fff"), numbers].concat()
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
    let port = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let mut host = H::open(Setup { block: BLOCK, ..Setup::default() });
    let off = host.state();
    let state = edit_state(&off, "osc", &json!({ "on": true, "port": port, "format": "of-tomorrow" }));
    assert!(host.load(&state));
    let saved: Value = serde_json::from_str(host.state()["fields"]["osc"].as_str().unwrap()).unwrap();
    assert_eq!((&saved["on"], &saved["port"], &saved["format"]), (&json!(true), &json!(port), &json!("promenade")));
    let to = UdpSocket::bind("127.0.0.1:0").unwrap();
    to.connect(("127.0.0.1", port)).unwrap();
    // The source is ahead: at the right ear of a head that is turned to the left.
    let left = after_turning(&mut host, &to, 60.0, |ild_db| ild_db < -3.0);
    assert!(left < -3.0, "turned to the left, the left ear is {left:.1} dB louder");
    let right = after_turning(&mut host, &to, -60.0, |ild_db| ild_db > 3.0);
    assert!(right > 3.0, "turned to the right, the left ear is {right:.1} dB louder");
    // Switched off by another state, the head looks ahead again and the port is free.
    assert!(host.load(&off.to_string().into_bytes()));
    UdpSocket::bind(("127.0.0.1", port)).expect("the port is free");
}
