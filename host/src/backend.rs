//! What the formats have in common.

use crate::HostError;
use crate::bundle::PluginInfo;
use crate::editor::Editor;
use crate::parameter::{Edit, Parameter};
use crate::setup::{Position, Setup};
use std::path::Path;

/// One plugin of one format, playing from its opening on.
pub(crate) trait Backend {
    fn info(&self) -> &PluginInfo;

    /// Deactivates it and activates it with another setup.
    fn restart(&mut self, setup: Setup) -> Result<(), HostError>;

    fn parameters(&mut self) -> Result<Vec<Parameter>, HostError>;

    /// Queues a value for a sample of the next block.
    fn set_at(&mut self, parameter: &Parameter, normalized: f64, offset: u32) -> Result<(), HostError>;

    /// Hands the queued values over without sound.
    fn flush(&mut self) -> Result<(), HostError>;

    fn value(&mut self, parameter: &Parameter) -> Result<f64, HostError>;

    /// A value as the plugin writes it, with its unit.
    fn text(&mut self, parameter: &Parameter, normalized: f64) -> Result<String, HostError>;

    /// The value of a text, `None` where the plugin does not understand it.
    fn parse(&mut self, parameter: &Parameter, text: &str) -> Result<Option<f64>, HostError>;

    /// Plays a block with what was queued; the buffers are of one length, at most that of the setup.
    fn process(&mut self, input: &[&[f32]], output: [&mut [f32]; 2], position: Option<Position>) -> Result<(), HostError>;

    fn latency(&mut self) -> Result<usize, HostError>;

    fn tail(&mut self) -> Option<usize>;

    fn save(&mut self) -> Result<Vec<u8>, HostError>;

    fn load(&mut self, state: &[u8]) -> Result<(), HostError>;

    /// A preset in a file of the format's own.
    fn load_file(&mut self, path: &Path) -> Result<(), HostError>;

    fn serve(&mut self) -> Result<(), HostError>;

    /// Says whether the parameters must be listed again, once.
    fn relisted(&mut self) -> bool;

    fn take_edits(&mut self, parameters: &[Parameter]) -> Vec<Edit>;

    fn editor(&mut self) -> Option<&mut dyn Editor>;
}
