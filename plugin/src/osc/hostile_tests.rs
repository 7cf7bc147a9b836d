//! Packets that nobody should send.

use super::input::{Message, OscInput};
use super::packet::{bundled, encoded, messages};
use crate::listener::inbox::Inbox;
use crate::parameter::Parameter;
use crate::project::{adm_config::AdmConfig, osc_config::OscConfig, params::PromenadeParams};
use crate::tracker::custom::{CustomArguments, CustomTracker};
use crate::tracker::format::TrackerFormat;
use promenade_testing::fuzz::{Input, Search};
use rosc::{OscArray, OscBundle, OscMessage, OscPacket, OscTime, OscType};
use std::cell::OnceCell;
use std::sync::Arc;

/// Packets with every address there is, by the number of their arguments.
fn seeds() -> Vec<Input> {
    let numbers = |count: usize| (0..count).map(|i| OscType::Float(0.25 * i as f32 - 0.5)).collect::<Vec<_>>();
    let mut sent: Vec<(String, Vec<OscType>)> = Vec::new();
    for (address, count) in [
        ("pose", 7),
        ("*/position", 3),
        ("Lead/ypr", 3),
        ("quaternion", 4),
        ("xyzypr", 6),
        ("recenter", 1),
        ("path", 1),
        ("room/size", 3),
        ("room/emitter", 3),
    ] {
        sent.push((format!("/promenade/{address}"), numbers(count)));
    }
    sent.push(("/promenade/head".to_owned(), vec![OscType::String("head.sofa".to_owned())]));
    sent.push(("/promenade/headphones".to_owned(), vec![OscType::String("mine.txt".to_owned())]));
    let materials = ["carpet_thin", "0.3:0.4", "0.1", "plasterboard", "marble_floor", "0.5"];
    let materials = materials.map(|name| OscType::String(name.to_owned())).to_vec();
    sent.push(("/promenade/room/materials".to_owned(), materials));
    sent.extend(Parameter::ALL.map(|p| (format!("/promenade/param/{}", p.id()), numbers(1))));
    for (part, count) in [("x", 1), ("xyz", 3), ("azim", 1), ("aed", 3), ("gain", 1), ("mute", 1), ("dmax", 1)] {
        sent.push((format!("/adm/obj/1/{part}"), numbers(count)));
        sent.push((format!("/adm/obj/*/{part}"), Vec::new()));
    }
    sent.push(("/adm/lis/ypr".to_owned(), numbers(3)));
    for format in TrackerFormat::ALL {
        sent.extend(format.forms().iter().map(|form| (form.address.to_owned(), numbers(7))));
    }
    sent.push((
        "/custom".to_owned(),
        vec![
            OscType::Double(1.0),
            OscType::Long(4),
            OscType::Inf,
            OscType::Bool(true),
            OscType::Blob(vec![1, 2, 3]),
            OscType::Array(OscArray { content: numbers(2) }),
        ],
    ));
    let packets = sent.chunks(5).map(|several| {
        let message = |(address, args): &(String, Vec<OscType>)| {
            OscPacket::Message(OscMessage { addr: address.clone(), args: args.clone() })
        };
        let inner =
            OscBundle { timetag: OscTime { seconds: 0, fractional: 1 }, content: several.iter().map(message).collect() };
        bundled(OscBundle { content: vec![OscPacket::Bundle(inner)], timetag: OscTime { seconds: 0, fractional: 1 } })
    });
    let alone = sent.iter().map(|(address, args)| encoded(address, args.clone()));
    packets.chain(alone).map(|bytes| Input::new("packet", bytes)).collect()
}

#[test]
fn packets_that_nobody_should_send_are_refused_or_obeyed() {
    let params = Arc::new(PromenadeParams::default());
    let instance = |(format, object): (TrackerFormat, u32)| {
        let inbox = Arc::<Inbox>::default();
        let receiver = OscInput::new(Arc::clone(&params), Arc::default(), Arc::clone(&inbox));
        let custom = CustomTracker { address: "/custom".to_owned(), arguments: CustomArguments::ALL[0] };
        let adm = AdmConfig { object, ..AdmConfig::default() };
        receiver.open(&OscConfig { format, custom, adm, name: "Lead".to_owned(), ..OscConfig::default() });
        (receiver, inbox)
    };
    // A long number has many ways to fit a pattern.
    let instances = TrackerFormat::ALL.map(|format| (format, 1)).into_iter().chain([(TrackerFormat::Promenade, 4_000_000_000)]);
    let instances: Vec<_> = instances.map(instance).collect();
    Search { name: "osc", cases: 3000, most_bytes: 1 << 22 }.run(seeds(), |input, _| {
        let mut taken = Vec::new();
        let result = messages(&input.bytes, &mut |address, bytes| {
            let message = Message { source: ([127, 0, 0, 1], 9).into(), address, bytes, arguments: OnceCell::new() };
            instances.iter().for_each(|(receiver, _)| receiver.take(&message));
            taken.push(address.to_owned());
        });
        for (receiver, inbox) in &instances {
            receiver.commit();
            assert!(inbox.tracked().is_none_or(|pose| pose.is_valid()), "{taken:?}: no pose");
        }
        for parameter in Parameter::ALL {
            let value = params.remote.latest(parameter, params.hosted(parameter));
            assert!(value.is_finite() && parameter.clamp(value) == value, "{taken:?}: {} is {value}", parameter.id());
        }
        let room = params.room.get().0;
        assert!(room.is_none_or(|room| room.check().is_ok()), "{taken:?}: a room that cannot be");
        result.map_err(str::to_owned)
    });
}
