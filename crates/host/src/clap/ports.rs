//! A track connected to a CLAP plugin's ports.

use super::handlers::Handlers;
use crate::backend::{check_channels, check_further, copy_out};
use crate::{Fault, Setup};
use clack_extensions::ambisonic::PluginAmbisonic;
use clack_extensions::audio_ports::{AudioPortFlags, AudioPortInfoBuffer, AudioPortType, PluginAudioPorts};
use clack_extensions::audio_ports_config::{AudioPortsConfigBuffer, PluginAudioPortsConfig};
use clack_host::prelude::*;
use clack_host::process::audio_buffers::{InputAudioBuffers, OutputAudioBuffers};

/// More ports or channels than any plugin has that a track can be connected to.
const MOST: u32 = 256;

/// Buffers of all ports, and which of them the tracks use; the others are fed silence and not listened to.
pub(crate) struct Ports {
    inputs: Side,
    outputs: Side,
    /// Channels of the track on the main input; further tracks follow.
    track: usize,
}

/// The ports of one direction.
struct Side {
    /// Samples of each channel of each port.
    buffers: Vec<Vec<Vec<f32>>>,
    main: usize,
    lists: AudioPorts,
}

impl Default for Ports {
    fn default() -> Self {
        Self { inputs: Side::new(&[], 0), outputs: Side::new(&[], 0), track: 1 }
    }
}

impl Side {
    fn new(channels: &[usize], main: usize) -> Self {
        let buffers = channels.iter().map(|&count| vec![Vec::new(); count]).collect();
        Self { buffers, main, lists: AudioPorts::with_capacity(channels.iter().sum(), channels.len()) }
    }

    fn main(&self) -> &[Vec<f32>] {
        self.buffers.get(self.main).map_or(&[], Vec::as_slice)
    }

    /// How many ports there are beside the main one.
    fn further(&self) -> usize {
        self.buffers.len().saturating_sub(1)
    }

    fn fit(&mut self, block: usize) {
        self.buffers.iter_mut().flatten().for_each(|channel| channel.resize(block, 0.0));
    }
}

impl Ports {
    /// Selects the layout for a track where the plugin has several, and finds the main ports.
    pub(crate) fn choose(instance: &mut PluginInstance<Handlers>, plugin: &str, setup: &Setup) -> Result<Self, Fault> {
        select(instance, setup);
        let inputs = side(instance, true);
        let outputs = side(instance, false);
        check_channels(plugin, setup, (inputs.main().len(), outputs.main().len()))?;
        check_further(plugin, setup, inputs.further())?;
        Ok(Self { inputs, outputs, track: setup.inputs })
    }

    /// How many inputs there are after the main one.
    pub(crate) fn further_inputs(&self) -> usize {
        self.inputs.further()
    }

    /// What the plugin calls its main output.
    pub(crate) fn main_output(&self, instance: &mut PluginInstance<Handlers>) -> String {
        let Ok(index) = u32::try_from(self.outputs.main) else { return String::new() };
        let handle = instance.plugin_handle();
        let mut buffer = AudioPortInfoBuffer::new();
        let ports = handle.get_extension::<PluginAudioPorts>();
        let kind = ports.and_then(|ports| ports.get(&handle, index, false, &mut buffer)).and_then(|port| port.port_type);
        let kind = kind.map_or_else(String::new, |AudioPortType(name)| name.to_string_lossy().into_owned());
        let config = handle.get_extension::<PluginAmbisonic>().and_then(|kinds| kinds.get_config(&handle, false, index));
        match config.map(|config| (config.ordering(), config.normalization())) {
            Some((Some(ordering), Some(normalization))) => format!("{kind}, {ordering:?}, {normalization:?}"),
            _ => kind,
        }
    }

    /// Makes room for blocks of that length.
    pub(crate) fn fit(&mut self, block: usize) {
        self.inputs.fit(block);
        self.outputs.fit(block);
    }

    /// The buffers of a block, with the track on the main input and further tracks on those that follow.
    pub(crate) fn connect(&mut self, tracks: &[&[f32]], len: usize) -> (InputAudioBuffers<'_>, OutputAudioBuffers<'_>) {
        let (track, further) = tracks.split_at(self.track.min(tracks.len()));
        let mut further = further.iter();
        for (number, port) in self.inputs.buffers.iter_mut().enumerate() {
            let on_main = number == self.inputs.main;
            let other = if on_main { None } else { further.next() };
            for (index, channel) in port.iter_mut().enumerate() {
                match track.get(index).or(track.last()).filter(|_| on_main).or(other) {
                    Some(from) => channel[..len].copy_from_slice(from),
                    // A plugin may have scribbled over its input.
                    None => channel[..len].fill(0.0),
                }
            }
        }
        self.outputs.buffers.iter_mut().flatten().for_each(|channel| channel[..len].fill(0.0));
        let inputs = self.inputs.lists.with_input_buffers(self.inputs.buffers.iter_mut().map(|port| AudioPortBuffer {
            latency: 0,
            channels: AudioPortBufferType::f32_input_only(port.iter_mut().map(|c| InputChannel::variable(&mut c[..len]))),
        }));
        let outputs = self.outputs.lists.with_output_buffers(self.outputs.buffers.iter_mut().map(|port| AudioPortBuffer {
            latency: 0,
            channels: AudioPortBufferType::f32_output_only(port.iter_mut().map(|c| &mut c[..len])),
        }));
        (inputs, outputs)
    }

    /// What the main output has of the block; one channel goes to all.
    pub(crate) fn copy_out(&self, output: &mut [&mut [f32]]) {
        copy_out(self.outputs.main(), output);
    }
}

/// Selects the first layout with the setup's inputs, and its outputs if there is one such.
fn select(instance: &mut PluginInstance<Handlers>, setup: &Setup) {
    let Some(configs) = instance.plugin_handle().get_extension::<PluginAudioPortsConfig>() else { return };
    let handle = instance.plugin_handle();
    let mut buffer = AudioPortsConfigBuffer::new();
    let mut fitting = Vec::new();
    for index in 0..configs.count(&handle).min(MOST) {
        let Some(config) = configs.get(&handle, index, &mut buffer) else { continue };
        let inputs = config.main_input.map_or(0, |port| port.channel_count);
        let outputs = config.main_output.map_or(0, |port| port.channel_count);
        if inputs as usize == setup.inputs {
            fitting.push((outputs, config.id));
        }
    }
    let best = fitting.iter().find(|(outputs, _)| *outputs as usize == setup.outputs).or(fitting.first());
    if let Some((_, id)) = best {
        // Who declines keeps the layout that is looked at next.
        let _ = configs.select(&handle, *id);
    }
}

fn side(instance: &mut PluginInstance<Handlers>, is_input: bool) -> Side {
    let Some(ports) = instance.plugin_handle().get_extension::<PluginAudioPorts>() else { return Side::new(&[], 0) };
    let handle = instance.plugin_handle();
    let mut buffer = AudioPortInfoBuffer::new();
    let (mut channels, mut main) = (Vec::new(), 0);
    for index in 0..ports.count(&handle, is_input).min(MOST) {
        let Some(info) = ports.get(&handle, index, is_input, &mut buffer) else { continue };
        if info.flags.contains(AudioPortFlags::IS_MAIN) {
            main = channels.len();
        }
        channels.push(info.channel_count.min(MOST) as usize);
    }
    Side::new(&channels, main)
}
