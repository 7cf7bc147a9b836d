//! ADM-OSC: an object's place and level, and the listener, as other programs tell and ask them.
//!
//! Source: ADM-OSC specification 1.0 (immersive-audio-live.github.io/ADM-OSC): x to the right, y ahead, z up, normalised;
//! azimuth in degrees to the left, elevation up, distance normalised.

mod address;
mod place;

pub(super) use self::address::{Part, address_of, parse};
use self::place::{cartesian, polar, turned, turned_back};
use super::packet;
use crate::listener::snapshot::{offset_of, pose_of};
use crate::parameter::source_knob::{Part as OfSource, SourceKnob};
use crate::parameter::{Parameter, cast::narrow};
use crate::project::adm_config::{AdmConfig, METRE_LIMITS};
use crate::project::{exchange::Exchange, params::PromenadeParams, scene_frame::SceneFrame};
use crate::worker::lock::lock;
use promenade_core::Pose;
use promenade_core::glam::Vec3;
use rosc::{OscBundle, OscMessage, OscPacket, OscTime, OscType};

/// The port at which programs expect answers.
pub(super) const ANSWER_PORT: u16 = 4002;

/// An instance's object, or that of one of its further sources.
#[derive(Default)]
pub(super) struct AdmObject {
    /// Which source it is, 0 for the first.
    source: usize,
    /// Where it was told to be in polar coordinates, with the emitter's offset that this became: a direction without a distance
    /// is kept.
    told: Option<(Vec3, [f32; 3])>,
    /// The gain to come back to, dB, while it is mute.
    muted: Option<f32>,
    /// What a distance of 1 is, metres, where a message has said so.
    metres: Option<f32>,
}

/// The parameters that are changed and asked for.
pub(super) struct Values<'a> {
    pub(super) params: &'a PromenadeParams,
    pub(super) exchange: &'a Exchange,
    pub(super) config: AdmConfig,
}

impl Values<'_> {
    fn set(&self, parameter: Parameter, value: f32) -> bool {
        let kept = parameter.clamp(value);
        self.params.remote.set(parameter, kept, self.params.hosted(parameter));
        kept != value
    }

    fn frame(&self) -> SceneFrame {
        *lock(&self.exchange.frame)
    }

    /// How far a source is from the scene's emitter, metres.
    fn offset(&self, source: usize) -> Vec3 {
        offset_of(source, |parameter| self.params.heard(parameter), Some(&self.frame()))
    }

    /// A place in the scene's world as ADM-OSC writes it, for a distance of 1 in metres.
    fn written(&self, world: Vec3, metres: f32) -> Vec3 {
        turned(self.frame().from_world(world) / metres)
    }

    fn world(&self, written: Vec3, metres: f32) -> Vec3 {
        self.frame().to_world(turned_back(written) * metres)
    }
}

/// The parameter of a source's level: of the first that of the output.
fn level_of(source: usize) -> Parameter {
    let of_further = |further| Parameter::Source(SourceKnob { further, part: OfSource::Level });
    source.checked_sub(1).map_or(Parameter::Gain, of_further)
}

impl AdmObject {
    /// Its number, where the first source's is `first`.
    pub(super) fn number(&self, first: u32) -> u32 {
        first.saturating_add(u32::try_from(self.source).unwrap_or(0))
    }

    /// Those of an instance with so many further sources.
    pub(super) fn all(further: usize) -> Vec<Self> {
        (0..=further).map(|source| Self { source, ..Self::default() }).collect()
    }

    fn metres(&self, config: AdmConfig) -> f32 {
        self.metres.unwrap_or_else(|| config.scale())
    }

    /// Where the object is, in polar coordinates.
    fn aed(&self, values: &Values) -> [f32; 3] {
        let offset = values.offset(self.source);
        match self.told {
            Some((then, aed)) if then == offset => aed,
            _ => polar(values.written(values.frame().emitter + offset, self.metres(values.config))),
        }
    }

    /// Moves the object; returns whether it cannot go so far.
    fn place(&mut self, values: &Values, aed: [f32; 3]) -> bool {
        let world = values.world(cartesian(aed), self.metres(values.config));
        let offset = world - values.frame().emitter;
        // What came last is heard.
        let mut clamped = values.set(Parameter::Place, 0.0);
        for (parameter, value) in Parameter::place_of(self.source).into_iter().zip(offset.to_array()) {
            clamped |= values.set(parameter, value);
        }
        self.told = Some((values.offset(self.source), aed));
        clamped
    }

    /// Applies a message; returns whether a value has been clamped.
    ///
    /// # Errors
    /// A message on arguments that are no such values.
    pub(super) fn apply(&mut self, values: &Values, part: Part, arguments: &[OscType]) -> Result<bool, String> {
        if part == Part::Ignored {
            return Ok(false);
        }
        let found = part.values(arguments)?;
        let mut clamped = false;
        let mut within = |value: f64, (least, most): (f32, f32)| {
            let value = narrow(value);
            clamped |= !(least..=most).contains(&value);
            value.clamp(least, most)
        };
        let aed = self.aed(values);
        match part {
            Part::Axis(_) | Part::Xy | Part::Xyz => {
                let first = if let Part::Axis(axis) = part { axis } else { 0 };
                let mut xyz = cartesian(aed).to_array();
                for (place, value) in xyz[first..].iter_mut().zip(&found) {
                    *place = within(*value, (-1.0, 1.0));
                }
                clamped |= self.place(values, polar(xyz.into()));
            }
            Part::Polar(_) | Part::Aed => {
                const LIMITS: [(f32, f32); 3] = [(-180.0, 180.0), (-90.0, 90.0), (0.0, 1.0)];
                let first = if let Part::Polar(axis) = part { axis } else { 0 };
                let mut aed = aed;
                for ((place, limits), value) in aed.iter_mut().zip(LIMITS).skip(first).zip(&found) {
                    *place = within(*value, limits);
                }
                clamped |= self.place(values, aed);
            }
            Part::Gain => clamped = self.set_gain(values, found[0]),
            Part::Mute => self.mute(values, found[0] != 0.0),
            Part::Dmax => {
                // The place as it is told stays, and is further away.
                self.metres = Some(within(found[0], METRE_LIMITS));
                clamped |= self.place(values, aed);
            }
            Part::ListenerXyz => {
                let [x, y, z] = [found[0], found[1], found[2]].map(|value| within(value, (-1.0, 1.0)));
                let world = values.world(Vec3::new(x, y, z), self.metres(values.config));
                for (parameter, value) in [Parameter::X, Parameter::Y, Parameter::Z].into_iter().zip(world.to_array()) {
                    clamped |= values.set(parameter, value);
                }
            }
            Part::ListenerYpr => {
                let [yaw, pitch, roll] = [found[0], found[1], found[2]].map(|value| within(value, (-180.0, 180.0)));
                let yaw = yaw + values.frame().yaw.to_degrees();
                values.set(Parameter::Yaw, (yaw + 180.0).rem_euclid(360.0) - 180.0);
                clamped |= values.set(Parameter::Pitch, pitch);
                values.set(Parameter::Roll, roll);
            }
            Part::Ignored => (),
        }
        Ok(clamped)
    }

    /// Sets its level from a linear gain; returns whether that has been clamped. While it is mute, it comes back with it.
    fn set_gain(&mut self, values: &Values, gain: f64) -> bool {
        let level = level_of(self.source);
        let (least, most) = level.limits();
        let gain_db = 20.0 * narrow(gain).max(0.0).log10();
        match &mut self.muted {
            Some(later) => *later = gain_db.clamp(least, most),
            None => drop(values.set(level, gain_db.clamp(least, most))),
        }
        gain_db > most || gain < 0.0
    }

    fn mute(&mut self, values: &Values, mute: bool) {
        let level = level_of(self.source);
        if mute {
            self.muted.get_or_insert_with(|| values.params.heard(level));
            values.set(level, level.limits().0);
        } else if let Some(gain_db) = self.muted.take() {
            values.set(level, gain_db);
        }
    }

    /// The answer to a message without arguments; none to what has no value here.
    pub(super) fn answer(&self, values: &Values, part: Part) -> Option<Vec<OscType>> {
        let aed = self.aed(values);
        let xyz = cartesian(aed).to_array();
        let floats = |all: &[f32]| Some(all.iter().copied().map(OscType::Float).collect());
        let gain_db = self.muted.unwrap_or_else(|| values.params.heard(level_of(self.source)));
        let pose = pose_of(|parameter| values.params.heard(parameter));
        match part {
            Part::Axis(axis) => floats(&[xyz[axis]]),
            Part::Xy => floats(&xyz[..2]),
            Part::Xyz => floats(&xyz),
            Part::Polar(axis) => floats(&[aed[axis]]),
            Part::Aed => floats(&aed),
            Part::Gain => floats(&[10_f32.powf(gain_db / 20.0)]),
            Part::Mute => Some(vec![OscType::Int(i32::from(self.muted.is_some()))]),
            Part::Dmax => floats(&[self.metres(values.config)]),
            Part::ListenerXyz => floats(&self.listener(values, &pose).0.to_array()),
            Part::ListenerYpr => floats(&self.listener(values, &pose).1),
            Part::Ignored => None,
        }
    }

    /// A listener as ADM-OSC writes it: place, and yaw, pitch and roll in degrees.
    fn listener(&self, values: &Values, pose: &Pose) -> (Vec3, [f32; 3]) {
        let place = values.written(pose.position, self.metres(values.config));
        let (yaw, pitch, roll) = pose.ypr();
        let yaw = (yaw - values.frame().yaw).to_degrees();
        (place, [(yaw + 180.0).rem_euclid(360.0) - 180.0, pitch.to_degrees(), roll.to_degrees()])
    }
}

/// The listener of a pose, and the objects of an instance if they have numbers, as a packet.
pub(super) fn packet_of(objects: &[AdmObject], values: &Values, pose: &Pose) -> Vec<u8> {
    let message = |addr: String, floats: &[f32]| {
        OscPacket::Message(OscMessage { addr, args: floats.iter().copied().map(OscType::Float).collect() })
    };
    let mut content = Vec::new();
    if let Some(first) = objects.first() {
        let (place, ypr) = first.listener(values, pose);
        content.extend([message("/adm/lis/xyz".to_owned(), &place.to_array()), message("/adm/lis/ypr".to_owned(), &ypr)]);
    }
    for object in objects.iter().filter(|_| values.config.object > 0) {
        let address = |part: &str| format!("/adm/obj/{}/{part}", object.number(values.config.object));
        let gain = 10_f32.powf(values.params.heard(level_of(object.source)) / 20.0);
        content.push(message(address("xyz"), &cartesian(object.aed(values)).to_array()));
        content.push(message(address("gain"), &[gain]));
    }
    // At once.
    let timetag = OscTime { seconds: 0, fractional: 1 };
    packet::bundled(OscBundle { timetag, content })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::osc::value::numbers;

    fn instance() -> (PromenadeParams, Exchange) {
        let exchange = Exchange::default();
        let frame =
            SceneFrame { origin: Vec3::new(2.0, 1.0, 1.5), yaw: 90_f32.to_radians(), emitter: Vec3::new(2.0, 2.5, 1.5) };
        *lock(&exchange.frame) = frame;
        (PromenadeParams::default(), exchange)
    }

    fn floats(values: &[f32]) -> Vec<OscType> {
        values.iter().copied().map(OscType::Float).collect()
    }

    #[test]
    fn addresses_mean_one_object_or_all() {
        assert_eq!(parse("/adm/obj/4/azim", 4), Some(Part::Polar(0)));
        assert_eq!(address_of("/adm/obj/*/azim", 4), "/adm/obj/4/azim");
        assert_eq!(address_of("/adm/lis/xyz", 4), "/adm/lis/xyz");
        assert_eq!(parse("/adm/obj/4/azim", 5), None);
        assert_eq!(parse("/adm/obj/*/gain", 17), Some(Part::Gain));
        assert_eq!((parse("/adm/obj/1?/mute", 12), parse("/adm/obj/1?/mute", 1)), (Some(Part::Mute), None));
        assert_eq!((parse("/adm/lis/ypr", 3), parse("/adm/env/change", 3)), (Some(Part::ListenerYpr), Some(Part::Ignored)));
        assert_eq!((parse("/adm/obj/4/fly", 4), parse("/adm/obj//x", 4), parse("/other", 4)), (None, None, None));
    }

    #[test]
    fn an_object_ahead_to_the_left_and_above_is_there() {
        let (params, exchange) = instance();
        let values = Values { params: &params, exchange: &exchange, config: AdmConfig { object: 1, metres: 4.0 } };
        let mut object = AdmObject::default();
        let world = |values: &Values| values.offset(0) + values.frame().emitter;
        let near = |a: Vec3, b: [f32; 3]| assert!((a - Vec3::from(b)).length() < 1e-4, "{a} for {b:?}");
        // The scene's listener begins facing along y: ahead is +y, right is +x, left -x.
        for (part, told, at) in [
            (Part::Xyz, vec![0.0, 1.0, 0.0], [2.0, 5.0, 1.5]),
            (Part::Xyz, vec![1.0, 0.0, 0.0], [6.0, 1.0, 1.5]),
            (Part::Xyz, vec![0.0, 0.0, 0.5], [2.0, 1.0, 3.5]),
            (Part::Aed, vec![90.0, 0.0, 0.5], [0.0, 1.0, 1.5]),
            (Part::Aed, vec![-90.0, 0.0, 0.5], [4.0, 1.0, 1.5]),
            (Part::Aed, vec![0.0, 90.0, 0.25], [2.0, 1.0, 2.5]),
        ] {
            assert_eq!(object.apply(&values, part, &floats(&told)), Ok(false), "{part:?} {told:?}");
            near(world(&values), at);
            let answered = numbers(&object.answer(&values, part).unwrap()).unwrap();
            assert!(answered.iter().zip(&told).all(|(a, b)| (narrow(*a) - b).abs() < 1e-4), "{answered:?} for {told:?}");
        }
        // A direction is kept while the distance is nothing, and one axis leaves the others.
        for (part, value) in [(Part::Polar(0), 90.0), (Part::Polar(1), 0.0), (Part::Polar(2), 0.0), (Part::Polar(2), 0.5)] {
            object.apply(&values, part, &floats(&[value])).unwrap();
        }
        near(world(&values), [0.0, 1.0, 1.5]);
        object.apply(&values, Part::Axis(1), &floats(&[0.25])).unwrap();
        near(world(&values), [0.0, 2.0, 1.5]);
        // What is moved otherwise is where that has moved it.
        params.remote.set(Parameter::Ex, 0.0, params.hosted(Parameter::Ex));
        let x = numbers(&object.answer(&values, Part::Axis(0)).unwrap()).unwrap()[0];
        assert!(x.abs() < 1e-6, "{x}");
        assert_eq!(object.apply(&values, Part::Xyz, &floats(&[0.0, 2.0, 0.0])), Ok(true), "out of range");
        near(world(&values), [2.0, 5.0, 1.5]);
        object.apply(&values, Part::Dmax, &floats(&[8.0])).unwrap();
        near(world(&values), [2.0, 9.0, 1.5]);
    }

    #[test]
    fn gain_and_mute_are_the_output_gain() {
        let (params, exchange) = instance();
        let values = Values { params: &params, exchange: &exchange, config: AdmConfig { object: 1, ..AdmConfig::default() } };
        let mut object = AdmObject::default();
        let gain = |params: &PromenadeParams| params.heard(Parameter::Gain);
        object.apply(&values, Part::Gain, &floats(&[0.5])).unwrap();
        assert!((gain(&params) + 6.0206).abs() < 1e-3);
        object.apply(&values, Part::Mute, &[OscType::Int(1)]).unwrap();
        assert_eq!(gain(&params), -60.0);
        object.apply(&values, Part::Gain, &floats(&[1.0])).unwrap();
        assert_eq!((gain(&params), object.answer(&values, Part::Mute)), (-60.0, Some(vec![OscType::Int(1)])));
        object.apply(&values, Part::Mute, &[OscType::Int(0)]).unwrap();
        assert_eq!(gain(&params), 0.0);
        assert_eq!(object.apply(&values, Part::Gain, &floats(&[100.0])), Ok(true));
        assert!(object.apply(&values, Part::Gain, &floats(&[])).unwrap_err().contains("expected 1 values"));
        assert!(object.apply(&values, Part::Xyz, &floats(&[f32::NAN, 0.0, 0.0])).unwrap_err().contains("finite"));
    }

    #[test]
    fn the_listener_goes_there_and_back() {
        let (params, exchange) = instance();
        let values = Values { params: &params, exchange: &exchange, config: AdmConfig { object: 3, metres: 2.0 } };
        let mut object = AdmObject::default();
        object.apply(&values, Part::ListenerXyz, &floats(&[0.5, 0.5, 0.0])).unwrap();
        object.apply(&values, Part::ListenerYpr, &floats(&[-45.0, 30.0, 5.0])).unwrap();
        let pose = pose_of(|parameter| params.heard(parameter));
        assert!((pose.position - Vec3::new(3.0, 2.0, 1.5)).length() < 1e-5, "{}", pose.position);
        assert!((params.heard(Parameter::Yaw) - 45.0).abs() < 1e-4 && (params.heard(Parameter::Pitch) - 30.0).abs() < 1e-4);
        let ypr = numbers(&object.answer(&values, Part::ListenerYpr).unwrap()).unwrap();
        assert!(ypr.iter().zip([-45.0, 30.0, 5.0]).all(|(a, b)| (a - b).abs() < 1e-3), "{ypr:?}");
        let OscPacket::Bundle(sent) = rosc::decoder::decode_udp(&packet_of(&[object], &values, &pose)).unwrap().1 else {
            panic!()
        };
        let address = |packet: &OscPacket| if let OscPacket::Message(m) = packet { m.addr.clone() } else { String::new() };
        let sent: Vec<_> = sent.content.iter().map(address).collect();
        assert_eq!(sent, ["/adm/lis/xyz", "/adm/lis/ypr", "/adm/obj/3/xyz", "/adm/obj/3/gain"]);
    }

    #[test]
    fn each_source_is_an_object_of_its_own() {
        let (params, exchange) = instance();
        let params = params.with_further(2);
        let values = Values { params: &params, exchange: &exchange, config: AdmConfig { object: 5, metres: 4.0 } };
        let mut objects = AdmObject::all(2);
        assert_eq!(objects.len(), 3);
        objects[2].apply(&values, Part::Xyz, &floats(&[0.0, 0.5, 0.0])).unwrap();
        objects[2].apply(&values, Part::Gain, &floats(&[0.1])).unwrap();
        // Ahead of the scene's listener by 2 m, whose emitter is 1.5 m ahead.
        assert!((values.offset(2) - Vec3::new(0.0, 0.5, 0.0)).length() < 1e-5, "{}", values.offset(2));
        assert_eq!((values.offset(0), values.offset(1)), (Vec3::ZERO, Vec3::new(-0.03, 0.29, 0.0)));
        assert!((params.heard(level_of(2)) + 20.0).abs() < 1e-3 && params.heard(Parameter::Gain) == 0.0);
        let packet = packet_of(&objects, &values, &Pose::IDENTITY);
        let OscPacket::Bundle(sent) = rosc::decoder::decode_udp(&packet).unwrap().1 else { panic!() };
        let last = sent.content.last();
        assert!(matches!(last, Some(OscPacket::Message(m)) if m.addr == "/adm/obj/7/gain" && m.args.len() == 1), "{last:?}");
        assert_eq!(sent.content.len(), 8);
    }
}
