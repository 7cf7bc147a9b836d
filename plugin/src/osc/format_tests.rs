//! Every format turns the head the right way.

use super::input::{Message, OscInput};
use super::packet::encoded;
use crate::listener::inbox::Inbox;
use crate::project::osc_config::{Interface, OscConfig};
use crate::project::{exchange::Exchange, params::PromenadeParams};
use crate::tracker::custom::{CustomArguments, CustomTracker};
use crate::tracker::{Recenter, axes::AxisMap, format::TrackerFormat};
use promenade_core::Pose;
use promenade_core::glam::Vec3;
use rosc::OscType;
use std::cell::OnceCell;
use std::f64::consts::TAU;
use std::sync::Arc;

type Sent = (&'static str, Vec<f64>);

struct Instance {
    receiver: Arc<OscInput>,
    inbox: Arc<Inbox>,
}

impl Instance {
    fn new(config: &OscConfig) -> Self {
        let inbox = Arc::<Inbox>::default();
        let receiver = OscInput::new(Arc::new(PromenadeParams::default()), Arc::default(), Arc::clone(&inbox));
        receiver.open(config);
        Self { receiver, inbox }
    }

    fn of(format: TrackerFormat) -> Self {
        Self::new(&OscConfig { format, ..OscConfig::default() })
    }

    fn hear(&self, sent: &Sent) -> &Self {
        self.hear_from([127, 0, 0, 1], sent)
    }

    fn hear_from(&self, ip: [u8; 4], (address, values): &Sent) -> &Self {
        #[expect(clippy::cast_possible_truncation, reason = "trackers send single precision")]
        let numbers = values.iter().map(|value| OscType::Float(*value as f32));
        let word = address.ends_with("/Head").then(|| OscType::String("Head".to_owned()));
        let args = word.into_iter().chain(numbers).collect();
        let bytes = encoded(address, args);
        let source = (ip, 9).into();
        self.receiver.take(&Message { source, address, bytes: &bytes, arguments: OnceCell::new() });
        self.receiver.commit();
        let (counts, _) = self.receiver.report();
        assert_eq!((counts.garbage, counts.unknown), (0, 0), "{address}: {counts:?}");
        self
    }

    fn pose(&self) -> Pose {
        self.inbox.tracked().expect("a tracker")
    }
}

fn check(what: &str, pose: Pose, degrees: [f32; 3]) {
    let [yaw, pitch, roll] = degrees.map(f32::to_radians);
    let wanted = Pose::from_ypr(Vec3::ZERO, yaw, pitch, roll).orientation;
    let (y, p, r) = pose.ypr();
    let found = [y, p, r].map(f32::to_degrees);
    assert!(pose.orientation.dot(wanted).abs() > 1.0 - 1e-6, "{what}: {found:?}, not {degrees:?}");
}

/// Sine and cosine of half an angle.
fn half(degrees: f64) -> (f64, f64) {
    (degrees.to_radians() / 2.0).sin_cos()
}

/// What each address of each format brings when a head is turned 30 degrees to the left, 20 up, or its right ear 10 degrees
/// down.
fn single_turns() -> Vec<(TrackerFormat, [Sent; 3])> {
    use TrackerFormat as F;
    let ((l, lc), (u, uc), (r, rc)) = (half(30.0), half(20.0), half(10.0));
    let all = |address, [left, up, right]: [Vec<f64>; 3]| [(address, left), (address, up), (address, right)];
    let angles = |address, left: f64, up: f64, right: f64| {
        all(address, [vec![left, 0.0, 0.0], vec![0.0, up, 0.0], vec![0.0, 0.0, right]])
    };
    let one =
        |[yaw, pitch, roll]: [&'static str; 3], left, up, right| [(yaw, vec![left]), (pitch, vec![up]), (roll, vec![right])];
    // The rotation of the scene, w x y z: x forward, y left, z up.
    let scene = [vec![lc, 0.0, 0.0, -l], vec![uc, 0.0, u, 0.0], vec![rc, -r, 0.0, 0.0]];
    let head = [vec![lc, 0.0, 0.0, l], vec![uc, 0.0, -u, 0.0], vec![rc, r, 0.0, 0.0]];
    // SPARTA counts the vector's parts from the vertical axis on.
    let sparta = scene.clone().map(|q| vec![q[0], q[3], q[2], q[1]]);
    let after = |first: [f64; 3], rest: &[Vec<f64>; 3]| rest.clone().map(|rest| [first.to_vec(), rest].concat());
    let ambix = [vec![0.0, 30.0, 0.0], vec![-20.0, 0.0, 0.0], vec![0.0, 0.0, -10.0]];
    let still = [0.0; 3];
    vec![
        (F::Sparta, angles("/ypr", 30.0, -20.0, 10.0)),
        (F::Sparta, one(["/yaw", "/pitch", "/roll"], 30.0, -20.0, 10.0)),
        (F::Sparta, all("/quaternion", sparta.clone())),
        (F::Sparta, all("/quat", sparta.clone())),
        (F::Sparta, all("/xyzquat", after(still, &sparta))),
        (
            F::Sparta,
            all(
                "/xyzypr",
                [
                    vec![0.0, 0.0, 0.0, 30.0, 0.0, 0.0],
                    vec![0.0, 0.0, 0.0, 0.0, -20.0, 0.0],
                    vec![0.0, 0.0, 0.0, 0.0, 0.0, 10.0],
                ],
            ),
        ),
        (F::Iem, all("/SceneRotator/quaternions", scene.clone())),
        (F::Iem, all("/scenerotator/QUATERNIONS", scene.clone())),
        (F::Iem, angles("/SceneRotator/ypr", -30.0, 20.0, -10.0)),
        (F::Iem, one(["/SceneRotator/yaw", "/SceneRotator/pitch", "/SceneRotator/roll"], -30.0, 20.0, -10.0)),
        (F::AmbixRotator, all("/rotation", ambix.clone())),
        (F::AmbixRotator, all("/quaternion", scene.clone())),
        (F::AmbixRotator, all("/head_pose", ambix.clone().map(|rest| [vec![1.0, 0.0, 0.0, 0.0], rest].concat()))),
        (F::AmbixMove, all("/rotation", ambix)),
        (F::AmbixMove, all("/quaternion", head.clone())),
        (F::AmbixMove, all("/6dof", after(still, &head))),
        // Unity: x right, y up, z forward, left-handed: to the left about -y, up about -x, right ear down about -z.
        (F::Unity, all("/quaternions", [vec![lc, 0.0, -l, 0.0], vec![uc, -u, 0.0, 0.0], vec![rc, 0.0, 0.0, -r]])),
        (F::AmbiHead, one(["/yaw", "/pitch", "/roll"], 0.5 + 30.0 / 360.0, 0.5 + 20.0 / 360.0, 0.5 - 10.0 / 360.0)),
        (F::Salte, all("/rendering/htrpy", [vec![0.0, 0.0, -30.0], vec![0.0, 20.0, 0.0], vec![10.0, 0.0, 0.0]])),
        (
            F::TuneIn,
            all(
                "/3DTI-OSC/receiver/pry",
                [vec![0.0, 0.0, -TAU / 12.0], vec![TAU / 18.0, 0.0, 0.0], vec![0.0, TAU / 36.0, 0.0]],
            ),
        ),
        (F::Mach1, angles("/orientation", -30.0, 20.0, 10.0)),
        (F::Supperware, angles("/ypr", 30.0, 20.0, 10.0)),
        (F::Supperware, one(["/yaw", "/pitch", "/roll"], 30.0, 20.0, 10.0)),
        // A telephone: x right, y forward, z up.
        (F::Sensors2Osc, all("/gamerotationvector", [vec![0.0, 0.0, l, lc], vec![u, 0.0, 0.0, uc], vec![0.0, r, 0.0, rc]])),
        (F::Sensors2Osc, all("/rotationvector", [vec![0.0, 0.0, l], vec![u, 0.0, 0.0, uc, 0.1], vec![0.0, r, 0.0]])),
        (
            F::OpenTrack,
            all(
                "/opentrack/pose",
                [[-30.0, 0.0, 0.0], [0.0, 20.0, 0.0], [0.0, 0.0, 10.0]].map(|turn| [&still[..], &turn].concat()),
            ),
        ),
        (F::FreePie, angles("/freepie/ypr", -TAU / 12.0, TAU / 18.0, TAU / 36.0)),
        // As Unity, w last.
        (
            F::Vmc,
            all(
                "/VMC/Ext/Bone/Pos/Head",
                [[0.0, -l, 0.0, lc], [-u, 0.0, 0.0, uc], [0.0, 0.0, -r, rc]].map(|turn| [&still[..], &turn].concat()),
            ),
        ),
        (F::Promenade, angles("/promenade/ypr", 30.0, 20.0, 10.0)),
        (F::Promenade, all("/promenade/quaternion", head.clone())),
        (F::Promenade, all("/promenade/pose", after(still, &head))),
    ]
}

#[test]
fn every_format_turns_left_looks_up_and_tilts_right() {
    let mut addresses = Vec::new();
    for (format, sent) in single_turns() {
        for (sent, wanted) in sent.iter().zip([[30.0, 0.0, 0.0], [0.0, 20.0, 0.0], [0.0, 0.0, 10.0]]) {
            let what = format!("{} {} {:?}", format.title(), sent.0, sent.1);
            check(&what, Instance::of(format).hear(sent).pose(), wanted);
            addresses.push((format, sent.0));
        }
    }
    for format in TrackerFormat::ALL {
        for form in format.forms() {
            let tested = addresses.contains(&(format, form.address))
                || PLACES.iter().any(|(f, a, _)| (*f, *a) == (format, form.address));
            assert!(tested, "{} {} is not tested", format.title(), form.address);
        }
    }
}

/// Addresses that have a place, with where 1 m ahead, 2 m to the left and 3 m up is.
const PLACES: [(TrackerFormat, &str, &[f64]); 7] = [
    (TrackerFormat::Sparta, "/xyz", &[1.0, 2.0, 3.0]),
    (TrackerFormat::Sparta, "/xyzypr", &[1.0, 2.0, 3.0, 0.0, 0.0, 0.0]),
    (TrackerFormat::AmbixMove, "/xyz", &[1.0, -2.0, 3.0]),
    (TrackerFormat::AmbixMove, "/translation", &[1.0, -2.0, 3.0]),
    (TrackerFormat::AmbixMove, "/6dof", &[1.0, -2.0, 3.0, 1.0, 0.0, 0.0, 0.0]),
    (TrackerFormat::OpenTrack, "/opentrack/pose", &[-2.0, 3.0, 1.0, 0.0, 0.0, 0.0]),
    (TrackerFormat::Promenade, "/promenade/position", &[1.0, 2.0, 3.0]),
];

#[test]
fn every_format_that_knows_a_place_stands_there() {
    for (format, address, values) in PLACES {
        let pose = Instance::of(format).hear(&(address, values.to_vec())).pose();
        assert_eq!(pose.position, Vec3::new(1.0, 2.0, 3.0), "{} {address}", format.title());
    }
}

#[test]
fn a_place_and_a_turn_that_come_apart_belong_together() {
    let instance = Instance::of(TrackerFormat::Sparta);
    instance.hear(&("/xyz", vec![1.0, 0.0, 0.0])).hear(&("/ypr", vec![30.0, 0.0, 0.0]));
    assert_eq!(instance.pose().position, Vec3::X);
    check("both", instance.pose(), [30.0, 0.0, 0.0]);
}

/// A product of quaternions w, x, y, z, which is the same in any axes.
fn product(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    let ([aw, ax, ay, az], [bw, bx, by, bz]) = (a, b);
    [
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    ]
}

#[test]
fn turns_about_several_axes_come_in_the_order_of_the_conventions() {
    let degrees = [30.0, 20.0, 10.0];
    let ((l, lc), (u, uc), (r, rc)) = (half(30.0), half(20.0), half(10.0));
    let to = |yaw, pitch, roll| product(product(yaw, pitch), roll).to_vec();
    let unity = to([lc, 0.0, -l, 0.0], [uc, -u, 0.0, 0.0], [rc, 0.0, 0.0, -r]);
    check("Unity", Instance::of(TrackerFormat::Unity).hear(&("/quaternions", unity)).pose(), degrees);
    let [w, x, y, z] = <[f64; 4]>::try_from(to([lc, 0.0, 0.0, l], [uc, u, 0.0, 0.0], [rc, 0.0, r, 0.0])).unwrap();
    let phone = Instance::of(TrackerFormat::Sensors2Osc);
    check("telephone", phone.hear(&("/gamerotationvector", vec![x, y, z, w])).pose(), degrees);
    let [w, x, y, z] = <[f64; 4]>::try_from(to([lc, 0.0, 0.0, l], [uc, 0.0, -u, 0.0], [rc, r, 0.0, 0.0])).unwrap();
    let scene = vec![w, -x, -y, -z];
    check("IEM", Instance::of(TrackerFormat::Iem).hear(&("/SceneRotator/quaternions", scene)).pose(), degrees);
    check("Mach1", Instance::of(TrackerFormat::Mach1).hear(&("/orientation", vec![-30.0, 20.0, 10.0])).pose(), degrees);
    let sparta = Instance::of(TrackerFormat::Sparta);
    for (address, value) in [("/yaw", 30.0), ("/pitch", -20.0), ("/roll", 10.0)] {
        sparta.hear(&(address, vec![value]));
    }
    check("SPARTA, one by one", sparta.pose(), degrees);
}

#[test]
fn a_custom_address_says_what_its_arguments_are() {
    let (s, c) = half(30.0);
    let of = |arguments, values: Vec<f64>| {
        let custom = CustomTracker { address: "/*/head".to_owned(), arguments };
        let instance = Instance::new(&OscConfig { format: TrackerFormat::Custom, custom, ..OscConfig::default() });
        instance.hear(&("/phone/head", values)).pose()
    };
    let degrees = [30.0, 0.0, 0.0];
    check("degrees", of(CustomArguments::YprDegrees, vec![30.0, 0.0, 0.0]), degrees);
    check("radians", of(CustomArguments::YprRadians, vec![TAU / 12.0, 0.0, 0.0]), degrees);
    check("w first", of(CustomArguments::QuaternionWxyz, vec![c, 0.0, 0.0, s]), degrees);
    check("w last", of(CustomArguments::QuaternionXyzw, vec![0.0, 0.0, s, c]), degrees);
    check("pose", of(CustomArguments::Pose, vec![1.0, 2.0, 3.0, c, 0.0, 0.0, s]), degrees);
    check("place and angles", of(CustomArguments::PositionYpr, vec![1.0, 2.0, 3.0, 30.0, 0.0, 0.0]), degrees);
    assert_eq!(of(CustomArguments::Position, vec![1.0, 2.0, 3.0]).position, Vec3::new(1.0, 2.0, 3.0));
}

#[test]
fn axes_are_mapped_on_top_of_the_format_but_not_of_our_own_addresses() {
    let axes = AxisMap { order: [0, 2, 1], invert: [true, false, false] };
    let position_axes = AxisMap { order: [1, 0, 2], invert: [false; 3] };
    let config = OscConfig { format: TrackerFormat::Sparta, axes, position_axes, ..OscConfig::default() };
    let instance = Instance::new(&config);
    check("angles", instance.hear(&("/ypr", vec![30.0, 0.0, 20.0])).pose(), [-30.0, 20.0, 0.0]);
    let (s, c) = half(20.0);
    // A roll of the scene to the left is a head's to the right, which is taken for its pitch.
    check("quaternion", instance.hear(&("/quaternion", vec![c, 0.0, 0.0, -s])).pose(), [0.0, 20.0, 0.0]);
    assert_eq!(instance.hear(&("/xyz", vec![1.0, 2.0, 3.0])).pose().position, Vec3::new(2.0, 1.0, 3.0));
    check("our own", instance.hear(&("/promenade/ypr", vec![30.0, 0.0, 20.0])).pose(), [30.0, 0.0, 20.0]);
}

#[test]
fn a_telephone_on_the_head_is_a_matter_of_axes() {
    // Device axes x right, y forward, z up, as docs/head-tracking.md says to map them.
    let axes = AxisMap { order: [0, 2, 1], invert: [false, false, true] };
    let custom = CustomTracker { address: "/*/quaternion".to_owned(), arguments: CustomArguments::QuaternionXyzw };
    let instance = Instance::new(&OscConfig { format: TrackerFormat::Custom, axes, custom, ..OscConfig::default() });
    let ((l, lc), (u, uc), (r, rc)) = (half(30.0), half(20.0), half(10.0));
    check("left", instance.hear(&("/7f/quaternion", vec![0.0, 0.0, l, lc])).pose(), [30.0, 0.0, 0.0]);
    check("up", instance.hear(&("/7f/quaternion", vec![u, 0.0, 0.0, uc])).pose(), [0.0, 20.0, 0.0]);
    check("right", instance.hear(&("/7f/quaternion", vec![0.0, r, 0.0, rc])).pose(), [0.0, 0.0, 10.0]);
}

#[test]
fn only_who_wants_networks_hears_them() {
    let (left, right) = (("/promenade/ypr", vec![30.0, 0.0, 0.0]), ("/promenade/ypr", vec![-30.0, 0.0, 0.0]));
    let instance = Instance::new(&OscConfig::default());
    check("not from a network", instance.hear(&left).hear_from([192, 168, 1, 7], &right).pose(), [30.0, 0.0, 0.0]);
    let wide = Instance::new(&OscConfig { interface: Interface::Any, ..OscConfig::default() });
    check("from a network", wide.hear(&left).hear_from([192, 168, 1, 7], &right).pose(), [-30.0, 0.0, 0.0]);
}

#[test]
fn the_origin_is_where_it_was_asked_for() {
    let instance = Instance::of(TrackerFormat::Supperware);
    instance.hear(&("/ypr", vec![50.0, 10.0, 0.0])).hear(&("/promenade/recenter", vec![]));
    check("recentred", instance.pose(), [0.0, 10.0, 0.0]);
    check("turned", instance.hear(&("/ypr", vec![80.0, 0.0, 0.0])).pose(), [30.0, 0.0, 0.0]);
    // A button that is let go.
    check("let go", instance.hear(&("/promenade/recenter", vec![0.0])).pose(), [30.0, 0.0, 0.0]);
    check("pressed", instance.hear(&("/promenade/recenter", vec![1.0])).pose(), [0.0; 3]);
    instance.receiver.recenter(Some(Recenter::Off));
    check("off", instance.pose(), [80.0, 0.0, 0.0]);
}

#[test]
fn a_head_is_asked_for_by_its_file_and_from_networks_only_in_the_library() {
    let (exchange, inbox) = (Arc::<Exchange>::default(), Arc::<Inbox>::default());
    let receiver = OscInput::new(Arc::new(PromenadeParams::default()), Arc::clone(&exchange), inbox);
    receiver.open(&OscConfig { interface: Interface::Any, ..OscConfig::default() });
    let hear = |ip: [u8; 4], arguments: Vec<OscType>| {
        let address = "/promenade/head";
        let (source, bytes) = ((ip, 9).into(), encoded(address, arguments));
        receiver.take(&Message { source, address, bytes: &bytes, arguments: OnceCell::new() });
        exchange.head_wish.take()
    };
    let file = |name: &str| vec![OscType::String(name.to_owned())];
    assert_eq!(hear([127, 0, 0, 1], file("/home/me/mine.sofa")).as_deref(), Some("/home/me/mine.sofa"));
    assert_eq!(hear([192, 168, 1, 2], file("mine.sofa")).as_deref(), Some("mine.sofa"));
    assert_eq!(hear([192, 168, 1, 2], file("")).as_deref(), Some(""), "the scene's own");
    for elsewhere in ["/home/me/mine.sofa", "../mine.sofa", "folder/mine.sofa"] {
        assert_eq!(hear([192, 168, 1, 2], file(elsewhere)), None, "{elsewhere}");
    }
    assert!(receiver.report().0.last_garbage.contains("expected the name of a file in the library"));
    assert_eq!(hear([127, 0, 0, 1], vec![OscType::Int(1)]), None);
    assert!(receiver.report().0.last_garbage.contains("expected the name of a SOFA file"));
}

#[test]
fn a_room_is_drawn_from_elsewhere_and_what_cannot_be_is_refused() {
    let (params, inbox) = (Arc::new(PromenadeParams::default()), Arc::<Inbox>::default());
    let receiver = OscInput::new(Arc::clone(&params), Arc::default(), inbox);
    receiver.open(&OscConfig::default());
    let hear = |part: &str, arguments: Vec<OscType>| {
        let address = format!("/promenade/room/{part}");
        let (source, bytes) = (([127, 0, 0, 1], 9).into(), encoded(&address, arguments));
        receiver.take(&Message { source, address: &address, bytes: &bytes, arguments: OnceCell::new() });
        params.room.get().0
    };
    let floats = |values: [f32; 3]| values.map(OscType::Float).to_vec();
    let texts = |name: &str| vec![OscType::String(name.to_owned()); 6];
    let changes = params.room.changes();
    let room = hear("size", floats([4.0, 5.0, 1e9])).unwrap();
    assert_eq!(room.size, [4.0, 5.0, 200.0]);
    assert_ne!(params.room.changes(), changes, "the loader is not woken");
    let room = hear("emitter", floats([0.5, 100.0, 0.25])).unwrap();
    assert!(room.emitter[0] == 0.5 && room.holds(room.emitter.into()), "{:?}", room.emitter);
    assert_eq!(hear("materials", texts("carpet_thin")).unwrap().materials[5], "carpet_thin");
    assert_eq!(hear("materials", texts("carpett")).unwrap().materials[5], "carpet_thin");
    assert!(receiver.report().0.last_garbage.contains("perhaps carpet"), "{}", receiver.report().0.last_garbage);
    assert_eq!(hear("size", vec![OscType::Float(1.0)]).unwrap().size, [4.0, 5.0, 200.0]);
    assert!(receiver.report().0.last_garbage.contains("expected 3 values, found 1"));
}
