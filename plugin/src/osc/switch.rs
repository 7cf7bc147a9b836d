//! The parameter that switches Open Sound Control on, as the audio thread follows it.

use super::Osc;
use crate::project::params::PromenadeParams;
use crate::worker::{LOADER, TaskHandle};
use nice_plug::nice_error;
use std::sync::Arc;

/// Wakes a thread that opens or closes the socket when the parameter has changed.
pub struct Switch {
    osc: Arc<Osc>,
    /// From the first activation on.
    task: Option<TaskHandle>,
    on: bool,
}

impl Switch {
    /// Opens nothing yet.
    pub fn new(osc: Arc<Osc>) -> Self {
        Self { osc, task: None, on: false }
    }

    /// The host has activated the plugin.
    pub fn activate(&mut self, params: &PromenadeParams) {
        self.on = params.receives_osc();
        if self.task.is_none() {
            let task = LOADER.add(self.osc.clone());
            self.task = task.inspect_err(|error| nice_error!("no thread to switch Open Sound Control with: {error}")).ok();
        }
        self.osc.activate();
    }

    /// Follows the parameter.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O. May wake a thread.
    pub fn follow(&mut self, params: &PromenadeParams) {
        let on = params.receives_osc();
        if std::mem::replace(&mut self.on, on) != on
            && let Some(task) = &self.task
        {
            task.schedule();
        }
    }
}
