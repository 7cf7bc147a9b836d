//! The plugin as VST3, through vst3-host.

use crate::bundle;
use crate::host::{Host, Knob, Setup, host_id};
use vst3_host::Vst3Host;
use vst3_host::audio::{AudioBuffers, SpeakerArrangement};
use vst3_host::plugin::{Plugin, ProcessMode, TransportPosition};

/// A running VST3 instance.
pub struct Vst3 {
    plugin: Plugin,
    setup: Setup,
    seconds: Option<f64>,
}

impl Vst3 {
    fn start(&mut self) {
        let mode = if self.setup.offline { ProcessMode::Offline } else { ProcessMode::Realtime };
        self.plugin.set_process_mode(mode).expect("the plugin takes the mode");
        self.plugin.start_processing().expect("the plugin starts");
        self.serve();
    }

    /// Does what the plugin has asked the host for, such as reading its latency again.
    fn serve(&mut self) {
        self.plugin.service_host_requests().expect("the host serves the plugin");
    }
}

impl Host for Vst3 {
    const FORMAT: &'static str = "vst3";

    fn open(setup: Setup) -> Self {
        let host = Vst3Host::builder().sample_rate(setup.rate).block_size(setup.block).build();
        let plugin = host.and_then(|mut host| host.load_plugin(bundle::vst3())).expect("the VST3 bundle loads");
        let mut this = Self { plugin, setup, seconds: None };
        let input = if setup.inputs == 1 { SpeakerArrangement::MONO } else { SpeakerArrangement::STEREO };
        this.plugin.set_bus_arrangements(&[input], &[SpeakerArrangement::STEREO]).expect("the plugin takes the layout");
        this.start();
        this
    }

    fn reopen(&mut self, setup: Setup) {
        self.plugin.stop_processing().expect("the plugin stops");
        self.setup = setup;
        self.plugin.reconfigure(setup.rate, setup.block).expect("the plugin takes the setup");
        self.start();
    }

    fn knobs(&mut self) -> Vec<Knob> {
        let parameters = self.plugin.get_parameters().expect("the plugin lists its parameters");
        let knob = |p: vst3_host::parameters::Parameter| Knob {
            host_id: p.id,
            default: format!("{}{}", self.plugin.format_parameter(p.id, p.default).expect("a default has a text"), p.unit),
            name: p.name,
            automatable: p.can_automate,
        };
        parameters.into_iter().map(knob).collect()
    }

    fn set_at(&mut self, id: &str, normalized: f64, offset: usize) {
        let offset = i32::try_from(offset).expect("a block is no longer than that");
        self.plugin.set_parameter_at(host_id(id), normalized, offset).expect("the plugin has the parameter");
    }

    fn value(&mut self, id: &str) -> f64 {
        self.plugin.get_parameter(host_id(id)).expect("the plugin has the parameter")
    }

    fn play_from(&mut self, seconds: f64) {
        self.seconds = Some(seconds);
        self.plugin.set_playing(true).expect("the host plays");
    }

    fn process(&mut self, input: &[&[f32]]) -> [Vec<f32>; 2] {
        let len = input[0].len();
        if let Some(seconds) = self.seconds {
            #[expect(clippy::cast_possible_truncation, reason = "seconds in samples")]
            let samples = (seconds * self.setup.rate).round() as i64;
            let position = TransportPosition { samples, quarter_notes: seconds * 2.0 };
            self.plugin.set_transport_position(position).expect("the host has a position");
            self.seconds = Some(seconds + len as f64 / self.setup.rate);
        }
        let mut buffers = AudioBuffers::new(input.len(), 2, len, self.setup.rate);
        for (mine, theirs) in buffers.inputs.iter_mut().zip(input) {
            mine.copy_from_slice(theirs);
        }
        self.plugin.process_audio(&mut buffers).expect("the plugin processes");
        let [left, right] = <[Vec<f32>; 2]>::try_from(buffers.outputs).expect("there are two output channels");
        [left, right]
    }

    fn latency(&mut self) -> usize {
        self.serve();
        self.plugin.latency_samples() as usize
    }

    fn save(&mut self) -> Vec<u8> {
        let bytes = self.plugin.save_state().expect("the plugin saves");
        // The host puts a header before the component's state.
        let start = bytes.windows(10).position(|w| w == b"{\"version\"").expect("the state is JSON");
        bytes[start..].to_vec()
    }

    fn load(&mut self, json: &[u8]) -> bool {
        self.plugin.load_state(json).is_ok()
    }
}
