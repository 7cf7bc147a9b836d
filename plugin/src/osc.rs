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
pub use outlet::Sending;
pub use status::{Listening, OscStatus};

use crate::lock::lock;
use crate::params::PromenadeParams;
use crate::telemetry::Telemetry;
use outlet::Outlet;
use port::Subscription;
use receiver::Receiver;
use std::sync::{Arc, Mutex, MutexGuard};

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
    subscription: Option<Subscription>,
    outlet: Option<Outlet>,
    /// Why the subscription or the outlet could not be made; else empty.
    listening_failed: String,
    sending_failed: String,
}

impl Osc {
    /// Opens nothing yet. Restored settings are taken at once, from the first activation on.
    #[must_use]
    pub fn new(params: Arc<PromenadeParams>, inbox: Arc<Inbox>, telemetry: Arc<Telemetry>) -> Arc<Self> {
        let receiver = Receiver::new(Arc::clone(&params), inbox);
        let osc = Arc::new(Self { params, telemetry, receiver, applied: Mutex::default() });
        let restored = Arc::downgrade(&osc);
        osc.params.osc.on_restore(move || {
            if let Some(osc) = restored.upgrade() {
                osc.apply();
            }
        });
        osc
    }

    /// The host has activated the plugin: sockets and threads may be opened.
    pub fn activate(&self) {
        self.lock().active = true;
        self.apply();
    }

    /// Takes the settings that `params.osc` has. The editor calls it when it has changed them.
    pub fn apply(&self) {
        let mut applied = self.lock();
        let (config, _) = self.params.osc.get();
        if !applied.active || applied.config.as_ref() == Some(&config) {
            return;
        }
        let before = applied.config.replace(config.clone());
        let changed = |part: fn(&OscConfig, &OscConfig) -> bool| before.as_ref().is_none_or(|before| part(before, &config));
        if changed(|a, b| (a.on, a.port, a.interface) != (b.on, b.port, b.interface)) {
            self.receiver.close();
            applied.subscription = None;
            applied.listening_failed.clear();
        }
        if config.on {
            self.receiver.open(&config);
            if applied.subscription.is_none() {
                match Subscription::new(config.port, config.interface, Arc::clone(&self.receiver)) {
                    Ok(subscription) => applied.subscription = Some(subscription),
                    Err(error) => applied.listening_failed = format!("no thread to listen with: {error}"),
                }
            }
        }
        if changed(|a, b| a.out != b.out || a.address_name() != b.address_name()) {
            applied.outlet = None;
            applied.sending_failed.clear();
            if config.out.on {
                match Outlet::new(&config, Arc::clone(&self.telemetry), Arc::clone(&self.receiver)) {
                    Ok(outlet) => applied.outlet = Some(outlet),
                    Err(error) => applied.sending_failed = format!("no thread to send with: {error}"),
                }
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
        let applied = self.lock();
        let (counts, tracked, recentred) = self.receiver.report();
        let mut status = OscStatus {
            unknown: counts.unknown,
            garbage: counts.garbage,
            last_garbage: counts.last_garbage,
            clamped: counts.clamped,
            tracker_s: tracked.map(|at| at.elapsed().as_secs_f32()),
            recentred,
            ..OscStatus::default()
        };
        if let Some(subscription) = &applied.subscription {
            let port = subscription.state();
            (status.listening, status.messages_per_s) = (port.listening, port.messages_per_s);
            (status.last_address, status.messages) = (port.last_address, subscription.messages());
        } else if !applied.listening_failed.is_empty() {
            status.listening = Listening::Failed(applied.listening_failed.clone());
        }
        if let Some(outlet) = &applied.outlet {
            (status.sending, status.sent) = outlet.report();
        } else if !applied.sending_failed.is_empty() {
            status.sending = Sending::Failed(applied.sending_failed.clone());
        }
        status.note = note(&self.params.osc.get().0);
        status
    }

    fn lock(&self) -> MutexGuard<'_, Applied> {
        lock(&self.applied)
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
