//! VST3, through vst3-host.

mod controller;
mod editor;
mod module;
mod presets;

use crate::backend::{Backend, check_channels, check_further, copy_out};
use crate::editor::Editor;
use crate::info::PluginInfo;
use crate::parameter::{Edit, EditKind, Parameter};
use crate::preset::{Preset, PresetPlace};
use crate::setup::{Position, Setup};
use crate::{Fault, error};
use controller::Controller;
pub(crate) use module::Module;
pub(crate) use presets::of as presets;
use std::fmt::Display;
use std::path::Path;
use std::sync::Arc;
use vst3_host::audio::{AudioBuffers, SpeakerArrangement};
use vst3_host::discovery::get_detailed_plugin_info;
use vst3_host::parameters::Parameter as ListedParameter;
use vst3_host::plugin::{ParameterEditKind, Plugin, ProcessMode, TransportPosition};
use vst3_host::{Error, Vst3Host};

/// Tempo of the transport where none is set, quarter notes a minute.
const USUAL_TEMPO: f64 = 120.0;
/// The category of classes that process sound.
const AUDIO_CLASS: &str = "Audio Module Class";
/// The first bytes of a preset file: its name and version.
const PRESET: &[u8] = b"VST3\x01\0\0\0";

/// The plugins of a bundle.
pub(crate) fn plugins(path: &Path) -> Result<Vec<PluginInfo>, Fault> {
    let detailed = get_detailed_plugin_info(path).map_err(|e| error::unloaded(path, e))?;
    let vendor = detailed.info.vendor;
    let classes = detailed.classes.into_iter().filter(|class| class.category == AUDIO_CLASS);
    let info = |class: vst3_host::ClassInfo| PluginInfo {
        id: class.class_id,
        name: class.name,
        vendor: vendor.clone(),
        version: if class.version.is_empty() { detailed.info.version.clone() } else { class.version },
    };
    Ok(classes.map(info).collect())
}

/// A running VST3 plugin.
pub(crate) struct Vst3Plugin {
    // Goes first: the plugin enters the module and leaves it.
    controller: Option<Controller>,
    plugin: Plugin,
    module: Arc<Module>,
    info: PluginInfo,
    setup: Setup,
    buffers: AudioBuffers,
    /// For each channel of the inputs after the main one, which of them it belongs to.
    others: Vec<usize>,
    tempo: f64,
    /// How often it has asked for another activation because of its latency.
    restarts: usize,
}

impl Vst3Plugin {
    pub(crate) fn open(module: &Arc<Module>, path: &Path, plugin: &PluginInfo, setup: Setup) -> Result<Self, Fault> {
        let failed = |e: Error| error::unloaded(path, e);
        let builder = Vst3Host::builder().sample_rate(setup.rate).block_size(setup.block);
        let mut host = builder.tempo(setup.tempo.unwrap_or(USUAL_TEMPO)).build().map_err(failed)?;
        let loaded = host.load_plugin_class(path, &plugin.id).map_err(failed)?;
        let mut opened = Self {
            controller: None,
            module: Arc::clone(module),
            plugin: loaded,
            info: plugin.clone(),
            setup,
            buffers: AudioBuffers::new(0, 0, 0, setup.rate),
            others: Vec::new(),
            tempo: setup.tempo.unwrap_or(USUAL_TEMPO),
            restarts: 0,
        };
        opened.arrange()?;
        opened.start()?;
        Ok(opened)
    }

    fn failed(&self, what: &'static str, reason: impl Display) -> Fault {
        error::failed(&self.info.name, what, reason)
    }

    /// Proposes the layout for the track, takes what the plugin has then, and makes buffers for it.
    fn arrange(&mut self) -> Result<(), Fault> {
        let own = self.plugin.bus_arrangements().map_err(|e| self.failed("report its inputs and outputs", e))?;
        let (mut inputs, mut outputs) = (own.inputs, own.outputs);
        let track = if self.setup.inputs == 1 { SpeakerArrangement::MONO } else { SpeakerArrangement::STEREO };
        inputs.iter_mut().take(1).for_each(|bus| *bus = track);
        outputs.iter_mut().take(1).for_each(|bus| *bus = speakers(self.setup.outputs));
        // Who declines keeps the layout that is looked at next.
        let _ = self.plugin.set_bus_arrangements(&inputs, &outputs);
        let taken = self.plugin.bus_arrangements().map_err(|e| self.failed("report its inputs and outputs", e))?;
        let channels = |buses: &[SpeakerArrangement]| buses.first().map_or(0, |bus| bus.channel_count());
        let (into, out) = (channels(&taken.inputs), channels(&taken.outputs));
        check_channels(&self.info.name, &self.setup, (into, out))?;
        check_further(&self.info.name, &self.setup, taken.inputs.len().saturating_sub(1))?;
        // Many hosts take only what they have asked for.
        if self.setup.outputs != 2 && taken.outputs.first() != outputs.first() {
            let name = |buses: &[SpeakerArrangement]| buses.first().map_or(0, |bus| bus.raw());
            let expected = format!("the arrangement of speakers {:#x} as its main output", name(&outputs));
            let found = format!("{:#x}", name(&taken.outputs));
            return Err(Fault::argument(&self.info.name, expected, found));
        }
        // The main buses come first; the outputs of others are unheard, and their inputs have the further tracks or silence.
        let others = taken.inputs.iter().enumerate().skip(1);
        self.others = others.flat_map(|(bus, speakers)| std::iter::repeat_n(bus - 1, speakers.channel_count())).collect();
        self.buffers = AudioBuffers::new(into + self.others.len(), out, self.setup.block, self.setup.rate);
        Ok(())
    }

    fn start(&mut self) -> Result<(), Fault> {
        let mode = if self.setup.offline { ProcessMode::Offline } else { ProcessMode::Realtime };
        self.plugin.set_process_mode(mode).map_err(|e| self.failed("take the mode", e))?;
        self.plugin.set_playing(false).map_err(|e| self.failed("take the transport", e))?;
        self.plugin.start_processing().map_err(|e| self.failed("start", e))?;
        self.serve_requests()
    }

    /// Reads again what the plugin reports as changed, with a restart where the format needs one.
    fn serve_requests(&mut self) -> Result<(), Fault> {
        let flags = self.plugin.service_host_requests().map_err(|e| self.failed("start again", e))?;
        self.restarts += usize::from(flags.latency_changed());
        Ok(())
    }

    /// The value of a text, asked of a controller that is made when the first text comes.
    fn value_of(&mut self, id: u32, text: &str) -> Result<Option<f64>, Fault> {
        let controller = match &mut self.controller {
            Some(controller) => controller,
            empty => {
                let made = Controller::of_loaded(Arc::clone(&self.module), &self.info.id);
                empty.insert(made.map_err(|e| error::failed(&self.info.name, "make a second controller", e))?)
            }
        };
        Ok(controller.value_of(id, text).filter(|v| v.is_finite()))
    }
}

/// Ambisonics of the first three orders, by ACN and SN3D: `kAmbi1stOrderACN` and its like.
const AMBISONICS: [u64; 3] = [0xf << 20, 0xf << 20 | 0x1f << 38, 0xf << 20 | 0xfff << 38];

/// Speakers of a main output: Ambisonics where there are as many channels, else any so many.
fn speakers(count: usize) -> SpeakerArrangement {
    match count {
        1 => SpeakerArrangement::MONO,
        2 => SpeakerArrangement::STEREO,
        64.. => SpeakerArrangement::from_raw(u64::MAX),
        other => {
            let ambisonic = AMBISONICS.into_iter().find(|speakers| speakers.count_ones() as usize == other);
            SpeakerArrangement::from_raw(ambisonic.unwrap_or((1 << other) - 1))
        }
    }
}

fn listed(plugin: &Plugin, parameter: ListedParameter) -> Parameter {
    let written = plugin.format_parameter(parameter.id, parameter.default).unwrap_or_default();
    Parameter {
        default_text: with_unit(&written, &parameter.unit),
        id: parameter.id,
        name: parameter.name,
        unit: parameter.unit.trim().to_owned(),
        default: parameter.default,
        steps: u32::try_from(parameter.step_count).unwrap_or(0),
        automatable: parameter.can_automate,
        module: String::new(),
        periodic: false,
        least: 0.0,
        greatest: 1.0,
    }
}

/// A text with its unit, which some plugins write themselves and others leave to the host.
fn with_unit(text: &str, unit: &str) -> String {
    let name = unit.trim();
    if name.is_empty() || text.trim_end().ends_with(name) {
        text.to_owned()
    } else if unit.starts_with(char::is_whitespace) {
        format!("{text}{unit}")
    } else {
        format!("{text} {unit}")
    }
}

impl Backend for Vst3Plugin {
    fn info(&self) -> &PluginInfo {
        &self.info
    }

    fn restart(&mut self, setup: Setup) -> Result<(), Fault> {
        self.plugin.stop_processing().map_err(|e| self.failed("stop", e))?;
        self.setup = setup;
        self.plugin.reconfigure(setup.rate, setup.block).map_err(|e| self.failed("take the setup", e))?;
        self.tempo = setup.tempo.unwrap_or(USUAL_TEMPO);
        self.plugin.set_tempo(self.tempo).map_err(|e| self.failed("take the tempo", e))?;
        self.start()
    }

    fn parameters(&mut self) -> Result<Vec<Parameter>, Fault> {
        let all = self.plugin.get_parameters().map_err(|e| self.failed("list its parameters", e))?;
        Ok(all.into_iter().map(|parameter| listed(&self.plugin, parameter)).collect())
    }

    fn set_at(&mut self, parameter: &Parameter, normalized: f64, offset: u32) -> Result<(), Fault> {
        let offset = i32::try_from(offset).unwrap_or(i32::MAX);
        let done = self.plugin.set_parameter_at(parameter.id, normalized, offset);
        done.map_err(|e| self.failed("take a parameter's value", e))
    }

    fn flush(&mut self) -> Result<(), Fault> {
        // A block of no samples is the format's way to do so.
        let mut nothing = AudioBuffers::new(self.buffers.inputs.len(), self.buffers.outputs.len(), 0, self.setup.rate);
        self.plugin.process_audio(&mut nothing).map_err(|e| self.failed("take values", e))
    }

    fn value(&mut self, parameter: &Parameter) -> Result<f64, Fault> {
        self.plugin.get_parameter(parameter.id).map_err(|e| self.failed("report a parameter's value", e))
    }

    fn text(&mut self, parameter: &Parameter, normalized: f64) -> Result<String, Fault> {
        let written = self.plugin.format_parameter(parameter.id, normalized);
        let text = written.map(|text| with_unit(&text, &format!(" {}", parameter.unit)));
        text.map_err(|e| self.failed("write a parameter's value", e))
    }

    fn parse(&mut self, parameter: &Parameter, text: &str) -> Result<Option<f64>, Fault> {
        self.value_of(parameter.id, text)
    }

    fn process(&mut self, input: &[&[f32]], output: &mut [&mut [f32]], position: Option<Position>) -> Result<(), Fault> {
        let len = output.first().map_or(0, |channel| channel.len());
        if let Some(position) = position {
            let quarter_notes = position.seconds * self.tempo / 60.0;
            let at = TransportPosition { samples: position.samples, quarter_notes };
            let taken = self.plugin.set_playing(true).and_then(|()| self.plugin.set_transport_position(at));
            taken.map_err(|e| self.failed("take the transport", e))?;
        }
        let (track, further) = input.split_at(self.setup.inputs);
        let count = self.buffers.inputs.len() - self.others.len();
        let (main, others) = self.buffers.inputs.split_at_mut(count);
        for (number, mine) in main.iter_mut().enumerate() {
            mine.clear();
            mine.extend_from_slice(track[number.min(track.len() - 1)]);
        }
        for (bus, mine) in self.others.iter().zip(others) {
            mine.clear();
            mine.extend_from_slice(further.get(*bus).copied().unwrap_or_default());
            mine.resize(len, 0.0);
        }
        self.buffers.outputs.iter_mut().for_each(|channel| {
            channel.clear();
            channel.resize(len, 0.0);
        });
        self.buffers.block_size = len;
        self.plugin.process_audio(&mut self.buffers).map_err(|e| self.failed("play", e))?;
        copy_out(&self.buffers.outputs, output);
        Ok(())
    }

    fn main_output(&mut self) -> String {
        let arrangements = self.plugin.bus_arrangements();
        let raw = arrangements.ok().and_then(|buses| buses.outputs.first().map(|bus| bus.raw())).unwrap_or(0);
        match raw {
            _ if raw == SpeakerArrangement::MONO.raw() => "mono".to_owned(),
            _ if raw == SpeakerArrangement::STEREO.raw() => "stereo".to_owned(),
            _ if AMBISONICS.contains(&raw) => "ambisonic, ACN, SN3D".to_owned(),
            _ => format!("{raw:#x}"),
        }
    }

    fn further_inputs(&mut self) -> usize {
        self.plugin.bus_arrangements().map_or(0, |buses| buses.inputs.len().saturating_sub(1))
    }

    fn latency(&mut self) -> Result<usize, Fault> {
        self.serve_requests()?;
        Ok(self.plugin.latency_samples() as usize)
    }

    fn restarts(&self) -> usize {
        self.restarts
    }

    fn tail(&mut self) -> Option<usize> {
        let samples = self.plugin.tail_samples();
        (samples != u32::MAX).then_some(samples as usize)
    }

    fn save(&mut self) -> Result<Vec<u8>, Fault> {
        self.plugin.save_state().map_err(|e| self.failed("save its state", e))
    }

    fn load(&mut self, state: &[u8]) -> Result<(), Fault> {
        self.plugin.load_state(state).map_err(|e| self.failed("load a state", e))
    }

    fn load_file(&mut self, path: &Path, bytes: &[u8]) -> Result<(), Fault> {
        if bytes.starts_with(PRESET) {
            self.plugin.load_vstpreset(path).map_err(|e| self.failed("load a preset", e))
        } else {
            self.load(bytes)
        }
    }

    fn load_preset(&mut self, preset: &Preset) -> Result<(), Fault> {
        let PresetPlace::File(path) = &preset.place else {
            return Err(self.failed("load a preset", "it is in no file"));
        };
        self.plugin.load_vstpreset(path).map_err(|e| self.failed("load a preset", e))
    }

    fn serve(&mut self) -> Result<(), Fault> {
        // Restarts wait until somebody asks for the latency: in the middle of a rendering they would cut the sound.
        self.plugin.service_run_loop();
        Ok(())
    }

    fn take_edits(&mut self, parameters: &[Parameter]) -> Vec<Edit> {
        let known = |id: u32| parameters.iter().any(|p| p.id == id);
        let mut edits = Vec::new();
        for edit in self.plugin.take_parameter_edits() {
            let kind = match edit.kind {
                ParameterEditKind::BeginGesture => EditKind::Begin,
                ParameterEditKind::EndGesture => EditKind::End,
                ParameterEditKind::ValueChange => EditKind::Value(edit.value.unwrap_or(0.0)),
            };
            edits.push(Edit { id: edit.id, kind });
        }
        // What the processor moves by itself; what the editor has moved is in here too.
        for (id, value) in self.plugin.get_parameter_changes() {
            let edit = Edit { id, kind: EditKind::Value(value) };
            if !edits.contains(&edit) {
                edits.push(edit);
            }
        }
        edits.retain(|edit| known(edit.id));
        edits
    }

    fn editor(&mut self) -> Option<&mut dyn Editor> {
        editor::of(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_have_their_unit_once() {
        assert_eq!(with_unit("0.00", " deg"), "0.00 deg");
        assert_eq!(with_unit("0.00", "dB"), "0.00 dB");
        assert_eq!(with_unit("-6 dB", "dB"), "-6 dB");
        assert_eq!(with_unit("Standard", ""), "Standard");
    }
}
