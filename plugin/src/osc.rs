//! Open Sound Control: head trackers and remote control in, the listener's pose out.
//!
//! One socket per port and process, with a thread that reads it, finds out which instances a message is for, and hands poses to the audio thread by an
//! [`Inbox`] and parameters by [`crate::remote::Remote`]. One thread sends the poses of all instances. `docs/osc.md` has the addresses.

mod address;
mod axes;
mod batch;
pub mod config;
pub mod custom;
pub mod format;
pub mod inbox;
mod outlet;
mod packet;
mod port;
pub mod reading;
mod receiver;
pub mod status;
mod tracker;
mod value;

#[cfg(test)]
mod docs_tests;
#[cfg(test)]
mod format_tests;
#[cfg(test)]
mod net_tests;

pub use address::KEYWORDS;
pub use axes::AxisMap;
pub use config::{Interface, OscConfig, OscOut, Recenter};
pub use custom::{CustomArguments, CustomTracker};
pub use format::TrackerFormat;
pub use inbox::Inbox;
pub use status::{Counts, Listening, OscStatus, PortStatus, Sending};

use crate::lock::lock;
use crate::params::PromenadeParams;
use crate::telemetry::Telemetry;
use outlet::Outlet;
use port::Subscription;
use receiver::Receiver;
use std::sync::{Arc, Mutex};

/// One instance's Open Sound Control. Its methods are for threads that may wait.
pub struct Osc {
    params: Arc<PromenadeParams>,
    telemetry: Arc<Telemetry>,
    receiver: Arc<Receiver>,
    applied: Mutex<Applied>,
}

/// What the settings have been made into.
#[derive(Default)]
struct Applied {
    active: bool,
    /// The settings that are in force.
    config: Option<OscConfig>,
    /// Or why it could not be made.
    subscription: Option<Result<Subscription, String>>,
    /// Or why it could not be made.
    outlet: Option<Result<Outlet, String>>,
}

impl Osc {
    /// Opens nothing yet. Restored settings are taken at once, from the first activation on.
    #[must_use]
    pub fn new(params: Arc<PromenadeParams>, inbox: Arc<Inbox>, telemetry: Arc<Telemetry>) -> Arc<Self> {
        let receiver = Receiver::new(Arc::clone(&params), inbox);
        let osc = Arc::new(Self { params, telemetry, receiver, applied: Mutex::default() });
        osc.params.osc.on_restore(&osc, Self::apply);
        osc
    }

    /// The host has activated the plugin: sockets and threads may be opened.
    pub fn activate(&self) {
        lock(&self.applied).active = true;
        self.apply();
    }

    /// Takes the settings that `params.osc` has. The editor calls it when it has changed them.
    pub fn apply(&self) {
        let mut applied = lock(&self.applied);
        let (config, _) = self.params.osc.get();
        if !applied.active || applied.config.as_ref() == Some(&config) {
            return;
        }
        let before = applied.config.replace(config.clone());
        let changed = |part: fn(&OscConfig, &OscConfig) -> bool| before.as_ref().is_none_or(|before| part(before, &config));
        if changed(|a, b| (a.on, a.port, a.interface) != (b.on, b.port, b.interface)) {
            self.receiver.close();
            applied.subscription = None;
        }
        if config.on {
            self.receiver.open(&config);
            if !matches!(applied.subscription, Some(Ok(_))) {
                let subscription = Subscription::new(config.port, config.interface, Arc::clone(&self.receiver));
                applied.subscription = Some(subscription.map_err(|error| format!("no thread to listen with: {error}")));
            }
        }
        if changed(|a, b| a.out != b.out || a.address_name() != b.address_name()) {
            applied.outlet = None;
            if config.out.on {
                let outlet = Outlet::new(&config, Arc::clone(&self.telemetry), Arc::clone(&self.receiver));
                applied.outlet = Some(outlet.map_err(|error| format!("no thread to send with: {error}")));
            }
        }
    }

    /// Makes the tracker's present pose the origin; `None` recentres what the settings choose.
    pub fn recenter(&self, how: Option<Recenter>) {
        self.receiver.recenter(how);
    }

    /// What has come in and gone out.
    #[must_use]
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
        OscStatus { port, counts, tracker_s, sending, sent, note: note(&self.params.osc.get().0) }
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
