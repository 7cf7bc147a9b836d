//! How many messages a second a port takes, from a sender that never rests.

use promenade_plugin::listener::inbox::Inbox;
use promenade_plugin::osc::{Listening, Osc};
use promenade_plugin::parameter::Parameter;
use promenade_plugin::project::osc_config::OscConfig;
use promenade_plugin::project::params::PromenadeParams;
use promenade_plugin::telemetry::Telemetry;
use promenade_plugin::tracker::format::TrackerFormat;
use std::net::UdpSocket;
use std::sync::Arc;
use std::time::{Duration, Instant};

const TIME: Duration = Duration::from_secs(3);
/// Messages that a bundle brings.
const BUNDLED: usize = 32;

/// `/ypr` with three numbers, or a bundle of them.
fn packet(bundled: bool) -> Vec<u8> {
    let numbers = [30.0_f32, 0.0, 0.0].map(f32::to_be_bytes).concat();
    let message = [b"/ypr\0\0\0\0,fff\0\0\0\0".to_vec(), numbers].concat();
    if !bundled {
        return message;
    }
    let size = u32::try_from(message.len()).expect("a short message").to_be_bytes();
    let element = [size.to_vec(), message].concat();
    [b"#bundle\0\0\0\0\0\0\0\0\x01".to_vec(), element.repeat(BUNDLED)].concat()
}

fn main() {
    let port = UdpSocket::bind("127.0.0.1:0").and_then(|socket| socket.local_addr()).expect("a free port").port();
    let (params, inbox) = (Arc::new(PromenadeParams::default()), Arc::<Inbox>::default());
    params.osc.restore(OscConfig { port, format: TrackerFormat::Sparta, ..OscConfig::default() });
    let osc = Osc::new(Arc::clone(&params), Arc::default(), Arc::clone(&inbox), Telemetry::new());
    params.remote.set(Parameter::Osc, 1.0, params.hosted(Parameter::Osc));
    osc.activate();
    while !matches!(osc.status().port.listening, Listening::At(_)) {
        std::thread::sleep(Duration::from_millis(5));
    }
    let to = UdpSocket::bind("127.0.0.1:0").expect("a socket");
    to.connect(("127.0.0.1", port)).expect("this machine");
    for bundled in [false, true] {
        let packet = packet(bundled);
        let (before, started) = (osc.status().port.messages, Instant::now());
        let mut sent = 0_u64;
        while started.elapsed() < TIME {
            sent += u64::from(to.send(&packet).is_ok()) * if bundled { BUNDLED as u64 } else { 1 };
        }
        std::thread::sleep(Duration::from_millis(200));
        let taken = osc.status().port.messages - before;
        let per_s = |count: u64| count as f64 / TIME.as_secs_f64();
        let what = if bundled { "bundles of 32" } else { "single messages" };
        println!("{what}: {:.0} messages/s sent, {:.0} taken", per_s(sent), per_s(taken));
        assert!(inbox.tracked().is_some(), "the tracker is not there");
    }
}
