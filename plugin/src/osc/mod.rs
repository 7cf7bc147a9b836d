//! Open Sound Control: head trackers and remote control in, the listener's pose out.
//!
//! One socket per port and process, with a thread that reads it, finds out which instances a message is for, and hands poses to
//! the audio thread by an [`Inbox`](crate::listener::inbox::Inbox) and parameters by [`crate::parameter::remote::Remote`]. One
//! thread sends the poses of all instances. `docs/osc.md` has the addresses.

mod address;
mod adm;
mod batch;
mod foreign;
mod input;
mod outlet;
mod packet;
mod permit;
mod port;
pub mod status;
mod switch;
mod value;

#[cfg(test)]
mod docs_tests;
#[cfg(test)]
mod format_tests;
#[cfg(test)]
mod hostile_tests;
#[cfg(test)]
mod net_tests;

pub use address::KEYWORDS;
pub use status::{Counts, Listening, OscStatus, PortStatus, Sending};
pub use switch::Switch;

use crate::listener::inbox::Inbox;
use crate::project::osc_config::{Interface, OscConfig};
use crate::project::{exchange::Exchange, params::PromenadeParams};
use crate::telemetry::Telemetry;
use crate::tracker::{Recenter, format::TrackerFormat};
use crate::worker::{Task, lock::lock};
use input::OscInput;
use outlet::Outlet;
use permit::Permits;
use port::Subscription;
use std::io;
use std::sync::{Arc, Mutex};
use std::time::Instant;

/// One instance's Open Sound Control. Its methods are for threads that may wait.
pub struct Osc {
    params: Arc<PromenadeParams>,
    telemetry: Arc<Telemetry>,
    receiver: Arc<OscInput>,
    permits: Permits,
    applied: Mutex<Applied>,
}

/// What the settings have been made into.
#[derive(Default)]
struct Applied {
    active: bool,
    /// What the settings were made of.
    wanted: Option<Wanted>,
    /// Whether the project asks for the networks without a permit.
    confined: bool,
    /// Or why it could not be made.
    subscription: Option<Result<Subscription, String>>,
    /// Or why it could not be made.
    outlet: Option<Result<Outlet, String>>,
}

/// What a project asks for.
#[derive(Clone, PartialEq)]
struct Wanted {
    on: bool,
    config: OscConfig,
}

impl Task for Osc {
    fn run(&self) -> Option<Instant> {
        self.apply();
        None
    }
}

impl Osc {
    /// Opens nothing yet. Restored settings are taken at once, from the first activation on.
    pub fn new(
        params: Arc<PromenadeParams>,
        exchange: Arc<Exchange>,
        inbox: Arc<Inbox>,
        telemetry: Arc<Telemetry>,
    ) -> Arc<Self> {
        Self::with_permits(params, exchange, inbox, telemetry, Permits::of_this_machine())
    }

    fn with_permits(
        params: Arc<PromenadeParams>,
        exchange: Arc<Exchange>,
        inbox: Arc<Inbox>,
        telemetry: Arc<Telemetry>,
        permits: Permits,
    ) -> Arc<Self> {
        let host = Arc::downgrade(&params);
        params.remote.save_beside(move |parameter| host.upgrade().map_or(0.0, |params| params.hosted(parameter)));
        let receiver = OscInput::new(Arc::clone(&params), exchange, inbox);
        let osc = Arc::new(Self { params, telemetry, receiver, permits, applied: Mutex::default() });
        osc.params.osc.on_restore(&osc, Self::apply);
        osc
    }

    /// The host has activated the plugin: sockets and threads may be opened.
    pub fn activate(&self) {
        lock(&self.applied).active = true;
        self.apply();
    }

    /// Takes the switch and the settings that the parameters have. The editor calls it when it has changed them.
    pub fn apply(&self) {
        let mut applied = lock(&self.applied);
        let wanted = Wanted { on: self.params.receives_osc(), config: self.params.osc.get().0 };
        if !applied.active || applied.wanted.as_ref() == Some(&wanted) {
            return;
        }
        let before = applied.wanted.replace(wanted.clone()).map(|before| (before.on, before.config));
        let Wanted { on, mut config } = wanted;
        applied.confined = config.interface == Interface::Any && !self.permits.include(&config.permit);
        let changed =
            |part: fn(&OscConfig, &OscConfig) -> bool| before.as_ref().is_none_or(|(_, before)| part(before, &config));
        let switched = before.as_ref().is_none_or(|(before, _)| *before != on);
        if switched || changed(|a, b| (a.port, a.interface, &a.permit) != (b.port, b.interface, &b.permit)) {
            self.receiver.close();
            applied.subscription = None;
        }
        let out = changed(|a, b| (&a.out, a.adm) != (&b.out, b.adm) || a.address_name() != b.address_name());
        if applied.confined {
            config.interface = Interface::Loopback;
        }
        if on {
            self.receiver.open(&config);
            if !matches!(applied.subscription, Some(Ok(_))) {
                let subscription = Subscription::new(config.port, config.interface, Arc::clone(&self.receiver));
                applied.subscription = Some(subscription.map_err(|error| format!("no thread to listen with: {error}")));
            }
        }
        self.telemetry.sent.set(config.out.on);
        if out {
            applied.outlet = None;
            if config.out.on {
                let outlet = Outlet::new(&config, Arc::clone(&self.telemetry), Arc::clone(&self.receiver));
                applied.outlet = Some(outlet.map_err(|error| format!("no thread to send with: {error}")));
            }
        }
    }

    /// A permit to listen to networks, from the user of this machine.
    ///
    /// # Errors
    /// It cannot be noted down.
    pub fn permit(&self) -> io::Result<String> {
        self.permits.give()
    }

    /// Makes the tracker's present pose the origin; `None` recentres what the settings choose.
    pub fn recenter(&self, how: Option<Recenter>) {
        self.receiver.recenter(how);
    }

    /// What has come in and gone out.
    pub fn status(&self) -> OscStatus {
        let applied = lock(&self.applied);
        let (counts, heard) = self.receiver.report();
        let port = match &applied.subscription {
            Some(Ok(subscription)) => subscription.state(),
            Some(Err(reason)) => PortStatus { listening: Listening::Failed(reason.clone()), ..PortStatus::default() },
            None => PortStatus::default(),
        };
        let (sending, sent) = match &applied.outlet {
            Some(Ok(outlet)) => outlet.report(),
            Some(Err(reason)) => (Sending::Failed(reason.clone()), 0),
            None => (Sending::Off, 0),
        };
        let tracker_s = heard.map(|at| at.elapsed().as_secs_f32());
        let note = note(&self.params.osc.get().0);
        OscStatus { port, confined: applied.confined, counts, tracker_s, sending, sent, note }
    }
}

/// Remarks on settings that cannot work as they are.
fn note(config: &OscConfig) -> String {
    let mut notes =
        config.notes.iter().map(|note| format!("The project's settings were not all understood: {note}.")).collect::<Vec<_>>();
    let name = config.address_name();
    if KEYWORDS.contains(&name.as_str()) {
        notes.push(format!("The name {name} means something else in addresses: this instance cannot be addressed by it."));
    }
    if config.format == TrackerFormat::Custom && !config.custom.address.starts_with('/') {
        notes.push("The custom address does not begin with a slash: no message has it.".to_owned());
    }
    notes.join(" ")
}
