//! The plugin as CLAP, through clack.

use crate::bundle;
use crate::host::{Host, Knob, Setup, host_id};
use clack_extensions::audio_ports_config::{AudioPortsConfigBuffer, PluginAudioPortsConfig};
use clack_extensions::latency::PluginLatency;
use clack_extensions::params::{ParamInfoBuffer, ParamInfoFlags, PluginParams};
use clack_extensions::render::{PluginRender, RenderMode};
use clack_extensions::state::PluginState;
use clack_extensions::tail::{PluginTail, TailLength};
use clack_host::events::EventFlags;
use clack_host::events::event_types::{ParamValueEvent, TransportEvent, TransportFlags};
use clack_host::prelude::*;
use clack_host::utils::{BeatTime, SecondsTime};
use std::sync::atomic::{AtomicBool, Ordering};

/// Requests of the plugin.
#[derive(Default)]
struct Shared {
    callback: AtomicBool,
}

impl<'a> SharedHandler<'a> for Shared {
    fn request_restart(&self) {}
    fn request_process(&self) {}
    fn request_callback(&self) {
        self.callback.store(true, Ordering::Release);
    }
}

struct Handlers;

impl HostHandlers for Handlers {
    type Shared<'a> = Shared;
    type MainThread<'a> = ();
    type AudioProcessor<'a> = ();
}

/// A running CLAP instance.
pub struct ClapHost {
    // The processor goes first: it must not outlive the instance's activation.
    processor: Option<StartedPluginAudioProcessor<Handlers>>,
    instance: PluginInstance<Handlers>,
    setup: Setup,
    events: EventBuffer,
    seconds: Option<f64>,
}

impl ClapHost {
    fn extension<E: clack_host::extensions::Extension<ExtensionSide = clack_host::extensions::PluginExtensionSide>>(
        &mut self,
    ) -> E {
        self.instance.plugin_handle().get_extension().expect("the plugin has the extension")
    }

    fn start(&mut self) {
        let mode = if self.setup.offline { RenderMode::Offline } else { RenderMode::Realtime };
        self.extension::<PluginRender>().set(&self.instance.plugin_handle(), mode).expect("the plugin takes the mode");
        let config = PluginAudioConfiguration {
            sample_rate: self.setup.rate,
            min_frames_count: 1,
            max_frames_count: u32::try_from(self.setup.block).expect("a block is no longer than that"),
        };
        let stopped = self.instance.activate(|_, _| (), config).expect("the plugin activates");
        self.processor = Some(stopped.start_processing().expect("the plugin starts"));
        self.serve();
    }

    /// Does what the plugin has asked the main thread for.
    fn serve(&mut self) {
        if self.instance.access_shared_handler(|shared| shared.callback.swap(false, Ordering::AcqRel)) {
            self.instance.call_on_main_thread_callback();
        }
    }

    /// The greatest CLAP value of a parameter: 1, or the number of its steps.
    fn scale(&mut self, id: ClapId) -> f64 {
        let params = self.extension::<PluginParams>();
        let handle = self.instance.plugin_handle();
        let mut buffer = ParamInfoBuffer::new();
        let found = (0..params.count(&handle)).find_map(|index| {
            let info = params.get_info(&handle, index, &mut buffer)?;
            (info.id == id).then_some(info.max_value)
        });
        found.unwrap_or_else(|| panic!("there is no parameter {id:?}"))
    }

    /// The reported tail, samples. (The VST3 host asks for it only before there is one.)
    pub fn tail(&mut self) -> usize {
        let tail = self.extension::<PluginTail>();
        let processor = self.processor.as_mut().expect("an open instance has a processor");
        match tail.get(&processor.plugin_handle()) {
            TailLength::Finite(samples) => samples as usize,
            TailLength::Infinite => usize::MAX,
        }
    }

    /// Restores bytes as they are, without the frame that the plugin puts around its JSON.
    pub fn load_raw(&mut self, mut bytes: &[u8]) -> bool {
        let state = self.extension::<PluginState>();
        let taken = state.load(&self.instance.plugin_handle(), &mut bytes).is_ok();
        self.serve();
        taken
    }
}

impl Drop for ClapHost {
    fn drop(&mut self) {
        if let Some(processor) = self.processor.take() {
            self.instance.deactivate(processor.stop_processing());
        }
    }
}

impl Host for ClapHost {
    const FORMAT: &'static str = "clap";

    fn open(setup: Setup) -> Self {
        #[expect(unsafe_code, reason = "loading a shared library runs its code")]
        // SAFETY: it is the library built from this workspace.
        let entry = unsafe { PluginEntry::load(bundle::clap()) }.expect("the CLAP library loads");
        let factory = entry.get_plugin_factory().expect("the library has a plugin factory");
        let descriptor = factory.plugin_descriptors().next().expect("the factory lists a plugin");
        let info = HostInfo::new("Promenade tests", "Promenade", "", "1").expect("the texts have no zero byte");
        let id = descriptor.id().expect("the plugin has an id");
        let instance = PluginInstance::new(|_| Shared::default(), |_| (), &entry, id, &info).expect("the plugin is made");
        let mut host = Self { processor: None, instance, setup, events: EventBuffer::new(), seconds: None };
        let configs = host.extension::<PluginAudioPortsConfig>();
        let handle = host.instance.plugin_handle();
        let mut buffer = AudioPortsConfigBuffer::new();
        let layout = (0..configs.count(&handle)).find_map(|index| {
            let config = configs.get(&handle, index, &mut buffer)?;
            let inputs = config.main_input.map_or(0, |port| port.channel_count);
            (inputs as usize == setup.inputs).then_some(config.id)
        });
        configs.select(&handle, layout.expect("the plugin has the layout")).expect("the plugin takes the layout");
        host.start();
        host
    }

    fn reopen(&mut self, setup: Setup) {
        let processor = self.processor.take().expect("an open instance has a processor");
        self.instance.deactivate(processor.stop_processing());
        self.setup = setup;
        self.start();
    }

    fn knobs(&mut self) -> Vec<Knob> {
        let params = self.extension::<PluginParams>();
        let handle = self.instance.plugin_handle();
        let mut buffer = ParamInfoBuffer::new();
        let mut text = [0; 256];
        let mut knobs = Vec::new();
        for index in 0..params.count(&handle) {
            let info = params.get_info(&handle, index, &mut buffer).expect("every index has a parameter");
            let default = params.value_to_text(&handle, info.id, info.default_value, &mut text).expect("a default has a text");
            knobs.push(Knob {
                host_id: info.id.get(),
                name: String::from_utf8_lossy(info.name).into_owned(),
                default: String::from_utf8_lossy(default).into_owned(),
                automatable: info.flags.contains(ParamInfoFlags::IS_AUTOMATABLE),
            });
        }
        knobs
    }

    fn set_at(&mut self, id: &str, normalized: f64, offset: usize) {
        let id = ClapId::new(host_id(id));
        let value = normalized * self.scale(id);
        let offset = u32::try_from(offset).expect("a block is no longer than that");
        self.events.push(&ParamValueEvent::new(offset, id, Pckn::match_all(), value));
    }

    fn value(&mut self, id: &str) -> f64 {
        let id = ClapId::new(host_id(id));
        let scale = self.scale(id);
        let params = self.extension::<PluginParams>();
        params.get_value(&self.instance.plugin_handle(), id).expect("the parameter has a value") / scale
    }

    fn play_from(&mut self, seconds: f64) {
        self.seconds = Some(seconds);
    }

    fn process(&mut self, input: &[&[f32]]) -> [Vec<f32>; 2] {
        let len = input[0].len();
        let mut input = input.iter().map(|channel| channel.to_vec()).collect::<Vec<_>>();
        let mut output = [vec![0.0; len], vec![0.0; len]];
        let (mut inputs, mut outputs) = (AudioPorts::with_capacity(2, 1), AudioPorts::with_capacity(2, 1));
        let inputs = inputs.with_input_buffers([AudioPortBuffer {
            latency: 0,
            channels: AudioPortBufferType::f32_input_only(input.iter_mut().map(InputChannel::variable)),
        }]);
        let mut outputs = outputs.with_output_buffers([AudioPortBuffer {
            latency: 0,
            channels: AudioPortBufferType::f32_output_only(output.iter_mut().map(Vec::as_mut_slice)),
        }]);
        let transport = self.seconds.map(transport_at);
        let mut events_out = EventBuffer::new();
        self.events.sort();
        let processor = self.processor.as_mut().expect("an open instance has a processor");
        let result = processor.process(
            &inputs,
            &mut outputs,
            &self.events.as_input(),
            &mut events_out.as_output(),
            None,
            transport.as_ref(),
        );
        result.expect("the plugin processes");
        self.events.clear();
        self.seconds = self.seconds.map(|seconds| seconds + len as f64 / self.setup.rate);
        self.serve();
        output
    }

    fn latency(&mut self) -> usize {
        let latency = self.extension::<PluginLatency>();
        latency.get(&self.instance.plugin_handle()) as usize
    }

    fn save(&mut self) -> Vec<u8> {
        let state = self.extension::<PluginState>();
        let mut bytes = Vec::new();
        state.save(&self.instance.plugin_handle(), &mut bytes).expect("the plugin saves");
        bytes.split_off(size_of::<u64>())
    }

    fn load(&mut self, json: &[u8]) -> bool {
        let mut bytes = (json.len() as u64).to_le_bytes().to_vec();
        bytes.extend(json);
        self.load_raw(&bytes)
    }
}

/// A transport without a tempo, as hosts that play by the clock have it.
fn transport_at(seconds: f64) -> TransportEvent {
    TransportEvent {
        header: EventHeader::new_core(0, EventFlags::empty()),
        flags: TransportFlags::HAS_SECONDS_TIMELINE | TransportFlags::IS_PLAYING,
        song_pos_beats: BeatTime::from_float(0.0),
        song_pos_seconds: SecondsTime::from_float(seconds),
        tempo: 0.0,
        tempo_inc: 0.0,
        loop_start_beats: BeatTime::from_float(0.0),
        loop_end_beats: BeatTime::from_float(0.0),
        loop_start_seconds: SecondsTime::from_float(0.0),
        loop_end_seconds: SecondsTime::from_float(0.0),
        bar_start: BeatTime::from_float(0.0),
        bar_number: 0,
        time_signature_numerator: 4,
        time_signature_denominator: 4,
    }
}
