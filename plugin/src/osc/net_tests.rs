//! Instances on real sockets of this machine.

use super::{Listening, Osc, OscStatus, Sending, port};
use super::{packet::encoded, permit::Permits};
use crate::listener::inbox::Inbox;
use crate::parameter::Parameter;
use crate::project::osc_config::{Interface, OscConfig, OscOut};
use crate::project::{adm_config::AdmConfig, params::PromenadeParams};
use crate::telemetry::Telemetry;
use crate::tracker::format::TrackerFormat;
use crate::worker::lock::lock;
use nice_plug::params::persist::deserialize_field;
use promenade_core::Pose;
use promenade_core::glam::Vec3;
use rosc::OscType;
use std::net::UdpSocket;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread;
use std::time::{Duration, Instant};

/// Longest wait for what another thread does; nothing is timed by it.
const PATIENCE: Duration = Duration::from_secs(20);

/// The ports of the process belong to one test at a time.
fn alone() -> MutexGuard<'static, ()> {
    static ALONE: Mutex<()> = Mutex::new(());
    lock(&ALONE)
}

struct Instance {
    params: Arc<PromenadeParams>,
    inbox: Arc<Inbox>,
    telemetry: Arc<Telemetry>,
    osc: Arc<Osc>,
}

impl Instance {
    fn new(config: OscConfig) -> Self {
        Self::with_permits(config, Permits::in_file("/nowhere".into()))
    }

    fn with_permits(config: OscConfig, permits: Permits) -> Self {
        let (params, inbox, telemetry) = (Arc::new(PromenadeParams::default()), Arc::<Inbox>::default(), Telemetry::new());
        let osc = Osc::with_permits(Arc::clone(&params), Arc::default(), Arc::clone(&inbox), Arc::clone(&telemetry), permits);
        params.osc.restore(config);
        osc.activate();
        Self { params, inbox, telemetry, osc }
    }

    fn listening(config: OscConfig) -> Self {
        let instance = Self::new(config);
        instance.switch(true);
        instance
    }

    fn switch(&self, on: bool) {
        self.params.remote.set(Parameter::Osc, f32::from(u8::from(on)), self.params.hosted(Parameter::Osc));
        self.osc.apply();
    }

    fn at(port: u16, name: &str) -> Self {
        Self::listening(OscConfig { port, name: name.to_owned(), format: TrackerFormat::Supperware, ..OscConfig::default() })
    }

    fn change(&self, change: impl FnOnce(&mut OscConfig)) {
        let mut config = self.params.osc.get().0;
        change(&mut config);
        self.params.osc.restore(config);
    }

    fn status_that(&self, is_so: impl Fn(&OscStatus) -> bool) -> OscStatus {
        let status = || self.osc.status();
        until(|| Some(status()).filter(&is_so), || format!("{:?}", status()))
    }

    fn listens(&self) -> &Self {
        self.status_that(|status| matches!(status.port.listening, Listening::At(_)));
        self
    }

    fn yaw_deg(&self) -> Option<f32> {
        self.inbox.tracked().map(|pose| pose.ypr().0.to_degrees())
    }

    fn faces(&self, degrees: f32) {
        let near = |yaw: f32| (yaw - degrees).abs() < 1e-3;
        until(|| self.yaw_deg().filter(|yaw| near(*yaw)), || format!("{:?}, not {degrees}", self.yaw_deg()));
    }
}

fn until<T>(mut get: impl FnMut() -> Option<T>, last: impl Fn() -> String) -> T {
    let started = Instant::now();
    loop {
        if let Some(found) = get() {
            return found;
        }
        assert!(started.elapsed() < PATIENCE, "waited in vain: {}", last());
        thread::sleep(Duration::from_millis(5));
    }
}

fn free_port() -> u16 {
    UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
}

fn ypr(address: &str, yaw_deg: f32) -> Vec<u8> {
    encoded(address, vec![OscType::Float(yaw_deg), OscType::Float(0.0), OscType::Float(0.0)])
}

fn sender(port: u16) -> UdpSocket {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    socket.connect(("127.0.0.1", port)).unwrap();
    socket
}

#[test]
fn two_instances_share_a_port_and_names_tell_them_apart() {
    let _alone = alone();
    let port = free_port();
    let (first, second) = (Instance::at(port, "Lead"), Instance::at(port, "Choir"));
    first.listens();
    second.listens();
    assert_eq!(port::numbers(), [port]);
    let to = sender(port);
    to.send(&ypr("/ypr", 30.0)).unwrap();
    first.faces(30.0);
    second.faces(30.0);
    to.send(&ypr("/promenade/Choir/ypr", -60.0)).unwrap();
    second.faces(-60.0);
    to.send(&ypr("/promenade/*/ypr", 45.0)).unwrap();
    first.faces(45.0);
    second.faces(45.0);
    to.send(&encoded("/promenade/Lead/param/gain", vec![OscType::String("-6 dB".to_owned())])).unwrap();
    to.send(&encoded("/promenade/param/mix", vec![OscType::Int(25)])).unwrap();
    to.send(&encoded("/promenade/path", vec![OscType::Double(0.75)])).unwrap();
    let heard = |instance: &Instance, parameter| instance.params.heard(parameter);
    until(|| (heard(&second, Parameter::Path) == 0.75).then_some(()), || format!("{}", heard(&second, Parameter::Path)));
    assert_eq!((heard(&first, Parameter::Gain), heard(&second, Parameter::Gain)), (-6.0, 0.0));
    assert_eq!((heard(&first, Parameter::Mix), heard(&second, Parameter::Mix)), (0.25, 0.25));
    // The one that stays keeps the socket.
    drop(first);
    to.send(&ypr("/ypr", 10.0)).unwrap();
    second.faces(10.0);
    drop(second);
    assert!(port::numbers().is_empty(), "the port stays open");
    UdpSocket::bind(("127.0.0.1", port)).expect("the port is free again");
}

#[test]
fn a_port_of_another_program_is_said_to_be_and_taken_when_it_is_free() {
    let _alone = alone();
    let other = UdpSocket::bind("127.0.0.1:0").unwrap();
    let port = other.local_addr().unwrap().port();
    let instance = Instance::at(port, "");
    let status = instance.status_that(|status| matches!(status.port.listening, Listening::Failed(_)));
    assert_eq!(status.port.listening, Listening::Failed(format!("port {port} is in use by another program")));
    drop(other);
    instance.listens();
    sender(port).send(&ypr("/ypr", 20.0)).unwrap();
    instance.faces(20.0);
}

#[test]
fn nothing_is_open_before_activation_or_when_it_is_off() {
    let _alone = alone();
    let (params, port) = (Arc::new(PromenadeParams::default()), free_port());
    let osc = Osc::new(Arc::clone(&params), Arc::default(), Arc::default(), Telemetry::new());
    let switch = |on| params.remote.set(Parameter::Osc, on, params.hosted(Parameter::Osc));
    switch(1.0);
    params.osc.restore(OscConfig { port, ..OscConfig::default() });
    assert!(port::numbers().is_empty());
    assert_eq!(osc.status(), OscStatus::default());
    osc.activate();
    assert_eq!(port::numbers(), [port]);
    switch(0.0);
    osc.apply();
    assert!(port::numbers().is_empty());
    assert_eq!(osc.status().port.listening, Listening::Off);
    switch(1.0);
    params.osc.restore(OscConfig { port: 0, ..OscConfig::default() });
    until(
        || matches!(&osc.status().port.listening, Listening::Failed(words) if words.contains("1 to 65535")).then_some(()),
        || format!("{:?}", osc.status()),
    );
}

#[test]
fn settings_that_change_are_taken_at_once() {
    let _alone = alone();
    let (one, two) = (free_port(), free_port());
    let instance = Instance::at(one, "");
    instance.listens();
    sender(one).send(&ypr("/ypr", 30.0)).unwrap();
    instance.faces(30.0);
    instance.change(|config| config.axes.invert[0] = true);
    instance.faces(-30.0);
    instance.change(|config| config.port = two);
    assert_eq!(instance.inbox.tracked(), None, "the tracker of the other port is there yet");
    instance.listens();
    assert_eq!(port::numbers(), [two]);
    // Another instance opens the port to every network; this one does not notice.
    let folder = tempfile::tempdir().unwrap();
    let permits = Permits::in_file(folder.path().join("permits"));
    let permit = permits.give().unwrap();
    let wide = Instance::with_permits(OscConfig { port: two, interface: Interface::Any, ..OscConfig::default() }, permits);
    wide.switch(true);
    let confined = wide.status_that(|status| matches!(status.port.listening, Listening::At(at) if at.ip().is_loopback()));
    assert!(confined.confined, "the user has not been asked");
    wide.change(|config| config.permit = permit);
    assert!(!wide.osc.status().confined);
    wide.status_that(|status| matches!(status.port.listening, Listening::At(at) if at.ip().is_unspecified()));
    sender(two).send(&ypr("/ypr", 50.0)).unwrap();
    instance.faces(-50.0);
    drop(wide);
    // And closed to the networks again.
    instance.status_that(|status| matches!(status.port.listening, Listening::At(at) if at.ip().is_loopback()));
}

#[test]
fn settings_of_a_later_version_are_noted_until_they_are_changed() {
    let _alone = alone();
    let port = free_port();
    let saved = format!(r#"{{"port": {port}, "format": "of-tomorrow", "name": "Lead"}}"#);
    let instance = Instance::listening(deserialize_field(&saved).unwrap());
    instance.listens();
    assert!(instance.osc.status().note.contains("\"of-tomorrow\""), "{}", instance.osc.status().note);
    // What was understood is in force.
    sender(port).send(&ypr("/promenade/Lead/ypr", 25.0)).unwrap();
    instance.faces(25.0);
    assert!(instance.osc.status().note.contains("\"of-tomorrow\""), "the note is lost");
    instance.params.osc.restore(OscConfig { port, ..OscConfig::default() });
    assert_eq!(instance.osc.status().note, "");
}

#[test]
fn garbage_is_counted_with_its_reason() {
    let _alone = alone();
    let port = free_port();
    let instance = Instance::at(port, "pose");
    instance.listens();
    let to = sender(port);
    to.send(b"no packet").unwrap();
    assert!(instance.status_that(|status| status.counts.garbage == 1).counts.last_garbage.contains("neither"));
    to.send(&encoded("/ypr", vec![OscType::String("left".to_owned())])).unwrap();
    let status = instance.status_that(|status| status.counts.garbage == 2);
    assert_eq!(
        (status.counts.last_garbage.as_str(), status.port.last_address.as_str()),
        ("/ypr: expected a number, found \"left\"", "/ypr")
    );
    to.send(&encoded("/promenade/param/volume", vec![OscType::Float(1.0)])).unwrap();
    instance.status_that(|status| status.counts.last_garbage == "/promenade/param/volume: there is no such parameter");
    to.send(&encoded("/promenade/param/gain", vec![OscType::Float(40.0)])).unwrap();
    instance.status_that(|status| status.counts.clamped == 1);
    to.send(&ypr("/SceneRotator/ypr", 3.0)).unwrap();
    let status = instance.status_that(|status| status.counts.unknown == 1);
    assert_eq!((status.counts.garbage, status.port.messages, status.tracker_s), (3, 4, None));
    assert!(status.note.contains("pose means something else"), "{}", status.note);
    instance.change(|config| {
        (config.name, config.format) = (String::new(), TrackerFormat::Custom);
        config.custom.address = "head".to_owned();
    });
    assert!(instance.osc.status().note.contains("slash"), "{}", instance.osc.status().note);
    instance.change(|config| config.format = TrackerFormat::Supperware);
    assert_eq!(instance.osc.status().note, "");
    to.send(&ypr("/ypr", 3.0)).unwrap();
    assert!(instance.status_that(|status| status.tracker_s.is_some()).tracker_s < Some(20.0));
}

#[test]
fn a_flood_leaves_the_newest_pose_and_a_reader_that_never_waits() {
    let _alone = alone();
    let port = free_port();
    let instance = Instance::at(port, "");
    instance.listens();
    let to = sender(port);
    to.send(&ypr("/ypr", 1.0)).unwrap();
    instance.faces(1.0);
    let (inbox, done) = (Arc::clone(&instance.inbox), Arc::new(AtomicBool::new(false)));
    let ends = Arc::clone(&done);
    // What an audio thread does.
    let reader = thread::spawn(move || {
        let mut reads = 0_u64;
        while !ends.load(Ordering::Acquire) {
            let pose = inbox.tracked().expect("the tracker is there all the time");
            assert!(pose.is_valid(), "{pose:?}");
            reads += 1;
        }
        reads
    });
    for number in 0..200_000_u32 {
        let sent = match number % 4 {
            0 => ypr("/yaw", 1.0),
            1 => encoded("/promenade/param/gain", vec![OscType::Float((number % 7) as f32)]),
            _ => ypr("/ypr", (number % 180) as f32),
        };
        // The system may be out of room for it.
        let _lost = to.send(&sent);
    }
    // The system drops what does not fit: the last is sent until it is there.
    until(
        || {
            to.send(&ypr("/ypr", -77.0)).unwrap();
            instance.yaw_deg().filter(|yaw| (yaw + 77.0).abs() < 1e-3)
        },
        || format!("{:?}", instance.yaw_deg()),
    );
    done.store(true, Ordering::Release);
    assert!(reader.join().expect("the reader was well") > 0);
    let status = instance.osc.status();
    assert!(status.port.messages > 1000, "{status:?}");
}

#[test]
fn one_instance_leads_another() {
    let _alone = alone();
    let port = free_port();
    let follower = Instance::at(port, "Choir");
    follower.listens();
    let out = OscOut { on: true, host: "localhost".to_owned(), port, rate_hz: 100.0, adm: false };
    let leader = Instance::new(OscConfig { name: "Choir".to_owned(), out, ..OscConfig::default() });
    for yaw in [0.5_f32, -1.0] {
        let pose = Pose::from_ypr(Vec3::new(1.0, -2.0, 0.5), yaw, 0.2, -0.1);
        leader.telemetry.pose.write(0.0, &pose);
        let near = |found: Pose| {
            (found.position - pose.position).length() < 1e-6 && found.orientation.dot(pose.orientation).abs() > 1.0 - 1e-6
        };
        until(|| follower.inbox.tracked().filter(|found| near(*found)), || format!("{:?}", follower.inbox.tracked()));
    }
    let status = leader.osc.status();
    assert_eq!(status.sending, Sending::To(([127, 0, 0, 1], port).into()));
    assert!(status.sent >= 2 && leader.inbox.tracked().is_none());
    leader.change(|config| config.out.on = false);
    assert_eq!(leader.osc.status().sending, Sending::Off);
}

#[test]
fn an_object_and_a_listener_go_from_instance_to_instance_as_adm_osc() {
    let _alone = alone();
    let port = free_port();
    let adm = AdmConfig { object: 2, metres: 5.0 };
    let [hears, deaf] =
        [2, 3].map(|object| Instance::listening(OscConfig { port, adm: AdmConfig { object, ..adm }, ..OscConfig::default() }));
    hears.listens();
    deaf.listens();
    let out = OscOut { on: true, host: "localhost".to_owned(), port, rate_hz: 100.0, adm: true };
    let sends = Instance::new(OscConfig { out, adm, ..OscConfig::default() });
    let set = |parameter, value| sends.params.remote.set(parameter, value, sends.params.hosted(parameter));
    for (ex, ey, ez, gain) in [(2.0, -1.5, 0.5, -6.0), (-3.0, 4.0, 0.0, 3.0)] {
        for (parameter, value) in [(Parameter::Ex, ex), (Parameter::Ey, ey), (Parameter::Ez, ez), (Parameter::Gain, gain)] {
            set(parameter, value);
        }
        sends.telemetry.pose.write(0.0, &Pose::from_ypr(Vec3::new(1.0, -2.0, 0.5), 0.5, 0.25, -0.125));
        let heard = |of: &Instance| {
            let wanted = [
                (Parameter::Ex, ex),
                (Parameter::Ey, ey),
                (Parameter::Ez, ez),
                (Parameter::Gain, gain),
                (Parameter::X, 1.0),
                (Parameter::Y, -2.0),
                (Parameter::Yaw, 0.5_f32.to_degrees()),
                (Parameter::Pitch, 0.25_f32.to_degrees()),
                (Parameter::Roll, -0.125_f32.to_degrees()),
            ];
            wanted.into_iter().find(|(parameter, value)| (of.params.heard(*parameter) - value).abs() > 1e-3)
        };
        until(|| heard(&hears).is_none().then_some(()), || format!("{:?}", heard(&hears)));
    }
    // Of another number the object stays, and the listener is the same for all.
    assert_eq!((deaf.params.heard(Parameter::Ex), deaf.params.heard(Parameter::X)), (0.0, 1.0));
    assert_eq!(hears.osc.status().counts.unknown, 0);
}

#[test]
fn an_instance_does_not_lead_itself() {
    let _alone = alone();
    let port = free_port();
    let (own, other) = (Instance::at(port, "Lead"), Instance::at(port, "Lead"));
    own.listens();
    other.listens();
    own.telemetry.pose.write(0.0, &Pose::from_ypr(Vec3::ZERO, 0.5, 0.0, 0.0));
    own.change(|config| config.out = OscOut { on: true, host: "127.0.0.1".to_owned(), port, rate_hz: 200.0, adm: false });
    other.faces(0.5_f32.to_degrees());
    until(|| (own.osc.status().sent > 3).then_some(()), || format!("{:?}", own.osc.status()));
    assert_eq!(own.inbox.tracked(), None, "it follows itself");
    // Others may lead it all the same.
    sender(port).send(&ypr("/promenade/Lead/ypr", 12.0)).unwrap();
    own.faces(12.0);
}

#[test]
fn an_unknown_host_is_said_to_be_unknown() {
    let _alone = alone();
    let out = OscOut { on: true, host: "no-such-host.invalid".to_owned(), ..OscOut::default() };
    let instance = Instance::new(OscConfig { out, ..OscConfig::default() });
    let status = instance.status_that(|status| matches!(status.sending, Sending::Failed(_)));
    assert!(matches!(&status.sending, Sending::Failed(words) if words.contains("no-such-host.invalid")), "{status:?}");
    for (host, port, words) in [("", 9000, "no host"), ("127.0.0.1", 0, "1 to 65535")] {
        instance.change(|config| config.out = OscOut { on: true, host: host.to_owned(), port, ..OscOut::default() });
        let sending = instance.osc.status().sending;
        assert!(matches!(&sending, Sending::Failed(found) if found.contains(words)), "{sending:?}");
    }
    // Nobody listens there: that is no error, it may start later.
    let port = free_port();
    instance.telemetry.pose.write(0.0, &Pose::IDENTITY);
    instance.change(|config| config.out = OscOut { on: true, port, ..OscOut::default() });
    until(|| (instance.osc.status().sent > 0).then_some(()), || format!("{:?}", instance.osc.status()));
    assert_eq!(instance.osc.status().sending, Sending::To(([127, 0, 0, 1], port).into()));
}
