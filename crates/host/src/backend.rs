//! What both formats do for an instance.

use crate::Fault;
use crate::editor::Editor;
use crate::error::missing;
use crate::info::PluginInfo;
use crate::mark::{Mark, Track};
use crate::menu::MenuAction;
use crate::parameter::{Edit, Parameter};
use crate::preset::Preset;
use crate::remote_page::RemotePage;
use crate::setup::{Position, Setup};
use std::path::Path;

/// One plugin of one format, playing from its opening on.
pub(crate) trait Backend {
    fn info(&self) -> &PluginInfo;

    /// Deactivates it and activates it with another setup.
    fn restart(&mut self, setup: Setup) -> Result<(), Fault>;

    fn parameters(&mut self) -> Result<Vec<Parameter>, Fault>;

    /// Queues a value for a sample of the next block.
    fn set_at(&mut self, parameter: &Parameter, normalized: f64, offset: u32) -> Result<(), Fault>;

    /// Hands the queued values over without sound.
    fn flush(&mut self) -> Result<(), Fault>;

    fn value(&mut self, parameter: &Parameter) -> Result<f64, Fault>;

    /// A value as the plugin writes it, with its unit.
    fn text(&mut self, parameter: &Parameter, normalized: f64) -> Result<String, Fault>;

    /// The value of a text, `None` where the plugin does not understand it.
    fn parse(&mut self, parameter: &Parameter, text: &str) -> Result<Option<f64>, Fault>;

    /// Plays a block with what was queued; the buffers are of one length, at most that of the setup.
    fn process(&mut self, input: &[&[f32]], output: &mut [&mut [f32]], position: Option<Position>) -> Result<(), Fault>;

    /// What the plugin calls its main output.
    fn main_output(&mut self) -> String;

    /// How many inputs the plugin has after its main one.
    fn further_inputs(&mut self) -> usize;

    fn latency(&mut self) -> Result<usize, Fault>;

    /// How often the plugin has asked for another activation.
    fn restarts(&self) -> usize;

    fn tail(&mut self) -> Option<usize>;

    /// Whether the last block's status lets a host stop playing it while its input is silent; `None` where the format has no
    /// such status.
    fn may_sleep(&self) -> Option<bool> {
        None
    }

    fn save(&mut self) -> Result<Vec<u8>, Fault>;

    fn load(&mut self, state: &[u8]) -> Result<(), Fault>;

    /// A state in a file, or a preset of the format's own.
    fn load_file(&mut self, _path: &Path, bytes: &[u8]) -> Result<(), Fault> {
        self.load(bytes)
    }

    /// A preset that the bundle lists.
    fn load_preset(&mut self, preset: &Preset) -> Result<(), Fault>;

    fn serve(&mut self) -> Result<(), Fault>;

    /// Pages of remote controls; none where the format has no such thing.
    fn remote_pages(&mut self) -> Vec<RemotePage> {
        Vec::new()
    }

    /// Marks a parameter in the plugin's editor.
    fn mark(&mut self, _id: u32, _mark: &Mark) -> Result<(), Fault> {
        Err(missing(&self.info().name, "marks on parameters"))
    }

    /// Tells the plugin of the track that it is on.
    fn set_track(&mut self, _track: Track) -> Result<(), Fault> {
        Err(missing(&self.info().name, "interest in its track"))
    }

    /// What was chosen in the host's menus.
    fn take_chosen(&mut self) -> Vec<(u32, MenuAction)> {
        Vec::new()
    }

    /// Says whether the parameters must be listed again, once.
    fn relisted(&mut self) -> bool {
        false
    }

    fn take_edits(&mut self, parameters: &[Parameter]) -> Vec<Edit>;

    fn editor(&mut self) -> Option<&mut dyn Editor>;
}

/// Whether a track can be connected to a main input and output of so many channels.
pub(crate) fn check_channels(plugin: &str, setup: &Setup, (input, output): (usize, usize)) -> Result<(), Fault> {
    let (expected, found) = match (input, output) {
        (1, _) if setup.inputs > 1 => ("a main input of 2 channels for a track of 2".to_owned(), input),
        (3.., _) => ("a main input of 1 or 2 channels".to_owned(), input),
        // An instrument has no input.
        (_, 1 | 2) if setup.outputs == 2 => return Ok(()),
        _ if setup.outputs == 2 => ("a main output of 1 or 2 channels".to_owned(), output),
        _ if setup.outputs == output => return Ok(()),
        _ => (format!("a main output of {} channels", setup.outputs), output),
    };
    Err(Fault::argument(plugin, expected, found))
}

/// Whether a plugin has inputs for all further tracks beside its main one.
pub(crate) fn check_further(plugin: &str, setup: &Setup, inputs: usize) -> Result<(), Fault> {
    if setup.further <= inputs {
        return Ok(());
    }
    let expected = match setup.further {
        1 => "an input after the main one".to_owned(),
        further => format!("{further} inputs after the main one"),
    };
    Err(Fault::argument(plugin, expected, inputs))
}

/// Copies a block of the main output; a single channel goes to all.
pub(crate) fn copy_out(main: &[Vec<f32>], output: &mut [&mut [f32]]) {
    for (number, to) in output.iter_mut().enumerate() {
        if let Some(channel) = main.get(number).or(main.last()) {
            to.copy_from_slice(&channel[..to.len()]);
        }
    }
}
