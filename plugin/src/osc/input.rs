//! Messages applied to one instance.

use super::address::{self, RoomPart, Verb};
use super::adm::{self, ANSWER_PORT, AdmObject, Values};
use super::{packet, status::Counts, value};
use crate::budget::limit::set_limit_percent;
use crate::listener::inbox::Inbox;
use crate::parameter::{Parameter, cast::narrow};
use crate::project::osc_config::{Interface, OscConfig};
use crate::project::{adm_config::AdmConfig, exchange::Exchange, params::PromenadeParams};
use crate::tracker::reading::{Argument, Reading};
use crate::tracker::{Recenter, Tracker};
use crate::worker::lock::lock;
use promenade_core::Pose;
use rosc::OscType;
use std::cell::OnceCell;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, UdpSocket};
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Instant;

/// A message that has come in; its arguments are read when the first instance needs them.
pub(super) struct Message<'a> {
    pub(super) source: SocketAddr,
    pub(super) address: &'a str,
    pub(super) bytes: &'a [u8],
    pub(super) arguments: OnceCell<Result<Vec<OscType>, String>>,
}

impl Message<'_> {
    fn arguments(&self) -> Result<&[OscType], String> {
        self.arguments.get_or_init(|| packet::arguments(self.bytes)).as_deref().map_err(Clone::clone)
    }
}

/// One instance's side of what comes in. The audio thread never touches it.
pub(super) struct OscInput {
    params: Arc<PromenadeParams>,
    exchange: Arc<Exchange>,
    inbox: Arc<Inbox>,
    state: Mutex<State>,
}

struct State {
    open: bool,
    config: OscConfig,
    /// The name as it stands in addresses.
    name: String,
    tracker: Tracker,
    /// Whether the tracker has a newer pose than the inbox.
    moved: bool,
    /// Where this instance's own packets come from.
    own: Option<SocketAddr>,
    /// One for each source.
    adm: Vec<AdmObject>,
    counts: Counts,
}

impl OscInput {
    pub(super) fn new(params: Arc<PromenadeParams>, exchange: Arc<Exchange>, inbox: Arc<Inbox>) -> Arc<Self> {
        let config = OscConfig::default();
        let state = State {
            open: false,
            name: String::new(),
            tracker: Tracker::new(config.axes, config.position_axes),
            config,
            moved: false,
            own: None,
            adm: AdmObject::all(params.further()),
            counts: Counts::default(),
        };
        Arc::new(Self { params, exchange, inbox, state: Mutex::new(state) })
    }

    /// Takes settings; the tracker's state stays, unless its format changes.
    pub(super) fn open(&self, config: &OscConfig) {
        let mut state = lock(&self.state);
        if !state.open || state.config.format != config.format || state.config.custom != config.custom {
            state.tracker = Tracker::new(config.axes, config.position_axes);
            self.inbox.lose();
        } else if state.tracker.heard.is_some() {
            state.moved = true;
        }
        state.tracker.remap(config.axes, config.position_axes);
        state.open = true;
        state.name = config.address_name();
        state.config = config.clone();
        drop(state);
        self.commit();
    }

    /// Ignores messages from now on.
    pub(super) fn close(&self) {
        let mut state = lock(&self.state);
        state.open = false;
        state.moved = false;
        state.tracker.heard = None;
        self.inbox.lose();
    }

    /// Sets where this instance's own packets come from, so that they are ignored.
    pub(super) fn set_own_address(&self, own: Option<SocketAddr>) {
        lock(&self.state).own = own;
    }

    /// Takes a message, if it is for this instance.
    pub(super) fn take(&self, message: &Message) {
        let state = &mut *lock(&self.state);
        if !state.open || !state.config.interface.admits(message.source) || state.own == Some(message.source) {
            return;
        }
        if message.address.starts_with("/adm/") && state.config.adm.object > 0 {
            self.take_adm(state, message);
            return;
        }
        let (verb, mapped) = match address::parse(message.address) {
            Some((addressee, _)) if !addressee.means(&state.name) => return,
            Some((_, verb)) => (Some(verb), false),
            None => (state.config.format.arguments(message.address, &state.config.custom).map(Verb::Track), true),
        };
        let Some(verb) = verb else {
            state.counts.unknown += 1;
            return;
        };
        match message.arguments().and_then(|arguments| self.apply(state, verb, arguments, mapped, message.source)) {
            Ok(clamped) => state.counts.clamped += u64::from(clamped),
            Err(reason) => state.counts.reject(format!("{}: {reason}", message.address)),
        }
    }

    /// Takes a message of ADM-OSC, and answers one without arguments.
    fn take_adm(&self, state: &mut State, message: &Message) {
        let State { adm, config, counts, .. } = state;
        let values = Values { params: &self.params, exchange: &self.exchange, config: config.adm };
        let several = adm.len() > 1;
        for object in adm {
            let number = object.number(config.adm.object);
            // Those of other objects are no concern of this one.
            let Some(part) = adm::parse(message.address, number) else { continue };
            let result = match message.arguments() {
                Ok([]) => object.answer(&values, part).map_or(Ok(false), |answer| {
                    let address = if several { adm::address_of(message.address, number) } else { message.address.to_owned() };
                    reply(message.source, &packet::encoded(&address, answer)).map(|()| false)
                }),
                Ok(arguments) => object.apply(&values, part, arguments),
                Err(reason) => Err(reason),
            };
            match result {
                Ok(clamped) => counts.clamped += u64::from(clamped),
                Err(reason) => counts.reject(format!("{}: {reason}", message.address)),
            }
            if !part.is_of_object() {
                // What is not an object's is taken once.
                break;
            }
        }
    }

    /// Listener and object as a packet of ADM-OSC.
    pub(super) fn adm_packet(&self, config: AdmConfig, pose: &Pose) -> Vec<u8> {
        let state = lock(&self.state);
        adm::packet_of(&state.adm, &Values { params: &self.params, exchange: &self.exchange, config }, pose)
    }

    /// Changes a part of the drawn room, of one about the origin where there is none.
    fn draw(&self, part: RoomPart, arguments: &[OscType]) -> Result<(), String> {
        let (drawn, restores) = self.params.room.get();
        let mut room = drawn.unwrap_or_default();
        if part == RoomPart::Materials {
            let name = |argument: &OscType| match argument {
                OscType::String(name) => Ok(name.clone()),
                other => Err(format!("expected the names of 6 materials, found {other:?}")),
            };
            let names = arguments.iter().map(name).collect::<Result<Vec<String>, String>>()?;
            room.materials = names.try_into().map_err(|n: Vec<String>| format!("expected 6 materials, found {}", n.len()))?;
        } else {
            let numbers = value::numbers(arguments)?;
            let [x, y, z] = numbers[..] else { return Err(format!("expected 3 values, found {}", numbers.len())) };
            let values = [x, y, z].map(narrow);
            if part == RoomPart::Emitter {
                room.set_emitter(values.into());
            } else {
                values.into_iter().enumerate().for_each(|(axis, length)| room.set_length(axis, length));
            }
        }
        room.check().map_err(|error| error.to_string())?;
        self.params.room.replace(Some(room), restores);
        Ok(())
    }

    /// Applies a message; returns whether a value has been clamped.
    fn apply(
        &self,
        state: &mut State,
        verb: Verb,
        arguments: &[OscType],
        mapped: bool,
        source: SocketAddr,
    ) -> Result<bool, String> {
        match verb {
            Verb::Track(form) => {
                let words = form.iter().filter(|argument| **argument == Argument::Word).count();
                let reading = Reading::new(form, &value::numbers(arguments.get(words..).unwrap_or_default())?)?;
                state.tracker.take(&reading, mapped, Instant::now());
                state.moved = true;
                Ok(reading.clamped)
            }
            Verb::Recenter => {
                if let Some(how) = recenter(arguments, state.config.recenter)? {
                    state.tracker.recenter(how);
                    state.moved = state.tracker.heard.is_some();
                }
                Ok(false)
            }
            Verb::Path => {
                let [share] = value::numbers(arguments)?[..] else {
                    return Err(format!("expected 1 value, found {}", arguments.len()));
                };
                self.set(Parameter::Path, &[OscType::Double(share * 100.0)])
            }
            Verb::Head => {
                self.exchange.head_wish.ask(file_of(arguments, source, "a SOFA file")?);
                Ok(false)
            }
            Verb::Headphones => {
                self.exchange.headphones_wish.ask(file_of(arguments, source, "a file of headphones")?);
                Ok(false)
            }
            Verb::Budget => {
                let [percent] = value::numbers(arguments)?[..] else {
                    return Err(format!("expected 1 value, found {}", arguments.len()));
                };
                set_limit_percent(Some(narrow(percent)));
                Ok(false)
            }
            Verb::Room(part) => self.draw(part, arguments).map(|()| false),
            Verb::Param(id) => {
                let parameter = Parameter::of_id(id).filter(|parameter| self.params.has(*parameter));
                let parameter = parameter.ok_or_else(|| "there is no such parameter".to_owned())?;
                self.set(parameter, arguments)
            }
        }
    }

    fn set(&self, parameter: Parameter, arguments: &[OscType]) -> Result<bool, String> {
        let (value, clamped) = value::plain(parameter, arguments)?;
        self.params.remote.set(parameter, value, self.params.hosted(parameter));
        Ok(clamped)
    }

    /// Counts a packet that could not be parsed.
    pub(super) fn reject(&self, source: SocketAddr, reason: &str) {
        let mut state = lock(&self.state);
        if state.open && state.config.interface.admits(source) {
            state.counts.reject(reason.to_owned());
        }
    }

    /// Hands the tracker's newest pose to the audio thread.
    pub(super) fn commit(&self) {
        let mut state = lock(&self.state);
        if state.open && std::mem::take(&mut state.moved) {
            self.inbox.track(&state.tracker.pose());
        }
    }

    /// Makes the tracker's present pose the origin.
    pub(super) fn recenter(&self, how: Option<Recenter>) {
        let mut state = lock(&self.state);
        let how = how.unwrap_or(state.config.recenter);
        state.tracker.recenter(how);
        state.moved = state.tracker.heard.is_some();
        drop(state);
        self.commit();
    }

    /// The counts, and the time of the tracker's last message.
    pub(super) fn report(&self) -> (Counts, Option<Instant>) {
        let state = lock(&self.state);
        (state.counts.clone(), state.tracker.heard)
    }
}

/// Answers where programs of ADM-OSC expect it.
fn reply(source: SocketAddr, packet: &[u8]) -> Result<(), String> {
    let any = if source.is_ipv4() { IpAddr::V4(Ipv4Addr::UNSPECIFIED) } else { IpAddr::V6(Ipv6Addr::UNSPECIFIED) };
    let sent = UdpSocket::bind((any, 0)).and_then(|socket| socket.send_to(packet, (source.ip(), ANSWER_PORT)));
    sent.map(drop).map_err(|error| format!("the answer cannot be sent: {error}"))
}

impl Counts {
    fn reject(&mut self, reason: String) {
        self.garbage += 1;
        self.last_garbage = reason;
    }
}

impl Interface {
    /// Whether a packet from an address is accepted.
    fn admits(self, source: SocketAddr) -> bool {
        self == Self::Any || source.ip().is_loopback()
    }
}

/// The file that a message names.
fn file_of<'a>(arguments: &'a [OscType], source: SocketAddr, kind: &str) -> Result<&'a str, String> {
    let [OscType::String(file)] = arguments else { return Err(format!("expected the name of {kind}")) };
    // Other machines have no business with this one's files, but for those of the library.
    if !source.ip().is_loopback() && Path::new(file.trim()).components().nth(1).is_some() {
        return Err("expected the name of a file in the library, found one in another folder".to_owned());
    }
    Ok(file)
}

/// What to recentre, if anything: a button sends 0 when it is released.
fn recenter(arguments: &[OscType], usual: Recenter) -> Result<Option<Recenter>, String> {
    match arguments {
        [] => Ok(Some(usual)),
        [OscType::String(text)] => {
            serde_json::from_value(text.as_str().into()).map(Some).map_err(|_| "expected yaw, full or off".to_owned())
        }
        one => Ok((value::numbers(one)?.iter().any(|value| *value != 0.0)).then_some(usual)),
    }
}
