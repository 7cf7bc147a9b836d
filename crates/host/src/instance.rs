//! One running plugin.

use crate::backend::Backend;
use crate::editor::Editor;
use crate::info::PluginInfo;
use crate::mark::{Mark, Track};
use crate::menu::MenuAction;
use crate::parameter::{Edit, Parameter, find};
use crate::preset::Preset;
use crate::remote_page::RemotePage;
use crate::setup::{Position, Setup};
use crate::{Fault, error, rounded};
use std::path::Path;

/// One running plugin: opened, activated and processing until it is dropped.
pub struct Instance {
    plugin: Box<dyn Backend>,
    setup: Setup,
    parameters: Vec<Parameter>,
    /// Where the transport was started, seconds, and the samples since.
    transport: Option<(f64, i64)>,
}

impl Instance {
    pub(crate) fn new(mut plugin: Box<dyn Backend>, setup: Setup) -> Result<Self, Fault> {
        let parameters = plugin.parameters()?;
        Ok(Self { plugin, setup, parameters, transport: None })
    }

    /// Which plugin it is.
    #[must_use]
    pub fn info(&self) -> &PluginInfo {
        self.plugin.info()
    }

    /// How it is played.
    #[must_use]
    pub fn setup(&self) -> Setup {
        self.setup
    }

    /// Stops and deactivates it, and starts it again with another setup of the same channels. The transport stands still again;
    /// what was set stays set for the next block.
    ///
    /// nice-plug's VST3 plugins learn of another mode one activation late: restart twice to be sure.
    ///
    /// # Errors
    /// A setup out of range or with other channels, or the plugin does not start.
    pub fn restart(&mut self, setup: Setup) -> Result<(), Fault> {
        setup.check()?;
        let channels = |setup: &Setup| format!("{} inputs and {} outputs", setup.inputs + setup.further, setup.outputs);
        if channels(&setup) != channels(&self.setup) {
            return Err(Fault::unexpected(format!("{}, as before", channels(&self.setup)), channels(&setup)));
        }
        self.plugin.restart(setup)?;
        self.setup = setup;
        self.transport = None;
        Ok(())
    }

    /// Hands over what was set, without sound, and starts again with it: what a plugin does only when it is activated, such as
    /// loading files that were chosen, is done, and the next block is the first.
    ///
    /// # Errors
    /// The plugin does not take the values or does not start.
    pub fn settle(&mut self) -> Result<(), Fault> {
        if !self.parameters.is_empty() {
            self.plugin.flush()?;
        }
        self.restart(self.setup)
    }

    /// All parameters in the plugin's order.
    #[must_use]
    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// The parameter of a name, or of a number as text where no name is so.
    ///
    /// # Errors
    /// There is none, or several have the name.
    pub fn parameter(&self, wanted: &str) -> Result<&Parameter, Fault> {
        find(&self.parameters, wanted, &self.plugin.info().name)
    }

    fn numbered(&self, id: u32) -> Result<usize, Fault> {
        self.parameters
            .iter()
            .position(|p| p.id == id)
            .ok_or_else(|| error::no_such(&self.plugin.info().name, (self.parameters.len(), "parameters"), &id.to_string(), ""))
    }

    /// Sets a parameter at a sample of the next block, 0 to 1. A sample beyond the block counts as its last.
    ///
    /// # Errors
    /// There is no such parameter, the value is not from 0 to 1, or the sample is beyond the longest block.
    pub fn set_at(&mut self, id: u32, normalized: f64, offset: usize) -> Result<(), Fault> {
        if !(0.0..=1.0).contains(&normalized) {
            return Err(Fault::unexpected("a value from 0 to 1", normalized));
        }
        let longest = self.setup.block;
        let offset = u32::try_from(offset).ok().filter(|&o| (o as usize) < longest);
        let offset = offset.ok_or_else(|| Fault::unexpected(format!("a sample below {longest}"), "a later one"))?;
        let index = self.numbered(id)?;
        self.plugin.set_at(&self.parameters[index], normalized, offset)
    }

    /// The value of a parameter as the plugin has it, 0 to 1.
    ///
    /// # Errors
    /// There is no such parameter, or the plugin does not report it.
    pub fn value(&mut self, id: u32) -> Result<f64, Fault> {
        let index = self.numbered(id)?;
        self.plugin.value(&self.parameters[index])
    }

    /// A value from 0 to 1 as the plugin writes it, with its unit.
    ///
    /// # Errors
    /// There is no such parameter, or the plugin does not report it.
    pub fn text(&mut self, id: u32, normalized: f64) -> Result<String, Fault> {
        let index = self.numbered(id)?;
        self.plugin.text(&self.parameters[index], normalized)
    }

    /// The value of a text as the plugin understands it, 0 to 1: a number in the plugin's own unit, with or without it, or a
    /// name.
    ///
    /// # Errors
    /// There is no such parameter, or the plugin does not understand the text.
    pub fn from_text(&mut self, id: u32, text: &str) -> Result<f64, Fault> {
        let index = self.numbered(id)?;
        let parameter = &self.parameters[index];
        let value = self.plugin.parse(parameter, text)?.filter(|v| (0.0..=1.0).contains(v));
        let plugin = &self.plugin.info().name;
        value.ok_or_else(|| {
            let expected = format!("a value that {plugin} understands, such as {:?}", parameter.default_text);
            Fault::argument(format_args!("parameter {:?}", parameter.name), expected, format_args!("{text:?}"))
        })
    }

    /// Puts a running transport at a position, seconds; it then moves with the blocks.
    pub fn play_from(&mut self, seconds: f64) {
        self.transport = Some((seconds, 0));
    }

    /// Plays a block: as many slices as the setup has inputs and further tracks, of one length up to the setup's block. Returns
    /// left and right; a plugin with one output is heard on both.
    ///
    /// # Errors
    /// A setup with other outputs than two, slices of another number or length, or the plugin fails.
    pub fn process(&mut self, input: &[&[f32]]) -> Result<[Vec<f32>; 2], Fault> {
        let len = input.first().map_or(0, |channel| channel.len());
        let (mut left, mut right) = (vec![0.0; len], vec![0.0; len]);
        self.process_into(input, &mut [&mut left, &mut right])?;
        Ok([left, right])
    }

    /// [`Instance::process`] into buffers of the same length.
    ///
    /// # Errors
    /// A block that [`Instance::process`] refuses.
    pub fn process_into(&mut self, input: &[&[f32]], output: &mut [&mut [f32]]) -> Result<(), Fault> {
        let len = output.first().map_or(0, |channel| channel.len());
        let tracks = self.setup.inputs + self.setup.further;
        let fits = input.len() == tracks && output.len() == self.setup.outputs && len <= self.setup.block;
        let alike =
            input.iter().map(|channel| channel.len()).chain(output.iter().map(|channel| channel.len())).all(|n| n == len);
        if !fits || !alike {
            let lengths = |all: &mut dyn Iterator<Item = usize>| all.map(|n| n.to_string()).collect::<Vec<_>>().join(" and ");
            let found = format!(
                "{} samples in, {} out",
                lengths(&mut input.iter().map(|c| c.len())),
                lengths(&mut output.iter().map(|c| c.len()))
            );
            let Setup { outputs, block, .. } = self.setup;
            let expected = format!("{tracks} inputs and {outputs} outputs of one length, at most {block}");
            return Err(Fault::unexpected(expected, found));
        }
        let position = self.transport.map(|(from, since)| {
            let seconds = from + since as f64 / self.setup.rate;
            let samples = rounded(from * self.setup.rate) + since;
            Position { seconds, samples }
        });
        self.plugin.process(input, output, position)?;
        if let Some((_, since)) = &mut self.transport {
            *since += i64::try_from(len).unwrap_or(0);
        }
        Ok(())
    }

    /// What the plugin calls its main output: "mono", "stereo", "ambisonic, ACN, SN3D", or else as the format has it.
    pub fn main_output(&mut self) -> String {
        self.plugin.main_output()
    }

    /// How many inputs the plugin has after its main one, which a [`Setup`] can have further tracks for.
    pub fn further_inputs(&mut self) -> usize {
        self.plugin.further_inputs()
    }

    /// The latency as the plugin reports it, samples. A VST3 plugin that has asked for it is restarted first, as hosts do.
    ///
    /// # Errors
    /// The restart fails.
    pub fn latency(&mut self) -> Result<usize, Fault> {
        self.plugin.latency()
    }

    /// How often the plugin has asked to be activated again since it was opened. VST3 plugins ask for several things at once,
    /// and those between two calls of [`Instance::latency`] count once.
    #[must_use]
    pub fn restarts(&self) -> usize {
        self.plugin.restarts()
    }

    /// How long the plugin sounds on after its input, samples, as it reports; `None` for ever.
    pub fn tail(&mut self) -> Option<usize> {
        self.plugin.tail()
    }

    /// Whether the plugin has said with the last block that it need not be played while its input and output are silent. `None`
    /// in VST3, which has no such status.
    #[must_use]
    pub fn may_sleep(&self) -> Option<bool> {
        self.plugin.may_sleep()
    }

    /// The state of the plugin, for [`Instance::load`] of the same plugin and format.
    ///
    /// # Errors
    /// The plugin keeps none, or fails.
    pub fn save(&mut self) -> Result<Vec<u8>, Fault> {
        self.plugin.save()
    }

    /// Restores a state: what [`Instance::save`] has made, or the plugin's own bytes.
    ///
    /// # Errors
    /// The plugin keeps none, or refuses this one.
    pub fn load(&mut self, state: &[u8]) -> Result<(), Fault> {
        self.plugin.load(state)?;
        self.relist()
    }

    /// Restores a state from a file: as [`Instance::load`], and for VST3 a preset (`.vstpreset`).
    ///
    /// # Errors
    /// The plugin refuses the state; the file cannot be read, or is a preset of another plugin.
    pub fn load_file(&mut self, path: &Path) -> Result<(), Fault> {
        let bytes = std::fs::read(path).map_err(|e| error::unloaded(path, e))?;
        self.plugin.load_file(path, &bytes)?;
        self.relist()
    }

    /// Loads a preset that [`crate::Bundle::presets`] lists, as a browser does.
    ///
    /// # Errors
    /// The plugin cannot load presets, refuses this one, or does not say that it has loaded it.
    pub fn load_preset(&mut self, preset: &Preset) -> Result<(), Fault> {
        self.plugin.load_preset(preset)?;
        self.relist()
    }

    /// Does what the plugin has asked for on the main thread. [`Instance::process`] does so after each block by itself; with an
    /// editor open, call it some thirty times a second.
    ///
    /// # Errors
    /// The plugin does not start again.
    pub fn serve(&mut self) -> Result<(), Fault> {
        self.plugin.serve()?;
        self.relist()
    }

    fn relist(&mut self) -> Result<(), Fault> {
        if self.plugin.relisted() {
            self.parameters = self.plugin.parameters()?;
        }
        Ok(())
    }

    /// The pages of remote controls that the plugin declares. VST3 has none.
    pub fn remote_pages(&mut self) -> Vec<RemotePage> {
        self.plugin.remote_pages()
    }

    /// Marks a parameter in the plugin's editor.
    ///
    /// # Errors
    /// There is no such parameter, or the plugin or its format has no marks.
    pub fn mark(&mut self, id: u32, mark: &Mark) -> Result<(), Fault> {
        self.numbered(id)?;
        self.plugin.mark(id, mark)
    }

    /// Tells the plugin of the track that it is on.
    ///
    /// # Errors
    /// The plugin does not ask for it, or this host cannot tell it in the format.
    pub fn set_track(&mut self, track: Track) -> Result<(), Fault> {
        self.plugin.set_track(track)
    }

    /// What was chosen since this was last called in this host's menu, which the plugin's editor shows, with the parameters'
    /// numbers.
    pub fn take_chosen(&mut self) -> Vec<(u32, MenuAction)> {
        self.plugin.take_chosen()
    }

    /// The plugin's own changes of its parameters since this was last called, in order: gestures in its editor, and values that
    /// it moves. This is what hosts record as automation.
    pub fn take_edits(&mut self) -> Vec<Edit> {
        self.plugin.take_edits(&self.parameters)
    }

    /// The plugin's editor.
    ///
    /// # Errors
    /// It has no editor that can be put into an X11 window.
    pub fn editor(&mut self) -> Result<&mut dyn Editor, Fault> {
        let plugin = self.plugin.info().name.clone();
        self.plugin.editor().ok_or_else(|| error::missing(&plugin, "editor for X11"))
    }
}
