//! The host against a plugin of this program: one input and output, a sidechain before its main port, a parameter that it moves
//! by itself, latency, and refusals.

use crate::{Bundle, EditKind, Fault, Instance, Lane, Point, Setup, bounce};
use clack_extensions::audio_ports::{
    AudioPortFlags, AudioPortInfo, AudioPortInfoWriter, AudioPortType, PluginAudioPorts, PluginAudioPortsImpl,
};
use clack_extensions::latency::{PluginLatency, PluginLatencyImpl};
use clack_extensions::params::{
    HostParams, ParamDisplayWriter, ParamInfo, ParamInfoFlags, ParamInfoWriter, PluginAudioProcessorParams,
    PluginMainThreadParams, PluginParams,
};
use clack_extensions::thread_check::HostThreadCheck;
use clack_host::prelude::PluginEntry;
use clack_plugin::events::event_types::{ParamGestureBeginEvent, ParamGestureEndEvent, ParamValueEvent};
use clack_plugin::events::spaces::CoreEventSpace;
use clack_plugin::prelude::*;
use std::ffi::CStr;
use std::fmt::Write;
use std::sync::atomic::{AtomicU64, Ordering};

/// Samples by which the plugin is late.
const LATENCY: usize = 100;
/// Input beyond this makes it fail.
const TOO_LOUD: f32 = 4.0;

struct Odd;

/// Gain, -60 to 12, in thousandths; the audio thread sets it.
struct Shared {
    gain: AtomicU64,
}

impl Shared {
    fn gain(&self) -> f64 {
        f64::from_bits(self.gain.load(Ordering::Relaxed))
    }

    fn hear(&self, event: &UnknownEvent) {
        if let Some(CoreEventSpace::ParamValue(event)) = event.as_core_event() {
            self.gain.store(event.value().to_bits(), Ordering::Relaxed);
        }
    }
}

impl PluginShared<'_> for Shared {}

struct Main<'a> {
    shared: &'a Shared,
    host: HostMainThreadHandle<'a>,
}

impl<'a> PluginMainThread<'a, Shared> for Main<'a> {}

struct Audio<'a> {
    shared: &'a Shared,
    host: HostAudioProcessorHandle<'a>,
    line: Vec<f32>,
}

impl Plugin for Odd {
    type AudioProcessor<'a> = Audio<'a>;
    type Shared<'a> = Shared;
    type MainThread<'a> = Main<'a>;

    fn declare_extensions(builder: &mut PluginExtensions<Self>, _shared: Option<&Shared>) {
        builder.register::<PluginAudioPorts>().register::<PluginLatency>().register::<PluginParams>();
    }
}

impl DefaultPluginFactory for Odd {
    fn get_descriptor() -> PluginDescriptor {
        PluginDescriptor::new("test.odd", "Odd").with_vendor("Nobody").with_version("1.2")
    }

    fn new_shared(_host: HostSharedHandle<'_>) -> Result<Shared, PluginError> {
        Ok(Shared { gain: AtomicU64::new(0.0_f64.to_bits()) })
    }

    fn new_main_thread<'a>(host: HostMainThreadHandle<'a>, shared: &'a Shared) -> Result<Main<'a>, PluginError> {
        Ok(Main { shared, host })
    }
}

impl<'a> PluginAudioProcessor<'a, Shared, Main<'a>> for Audio<'a> {
    fn activate(
        host: HostAudioProcessorHandle<'a>,
        _main: &Main<'a>,
        shared: &'a Shared,
        config: PluginAudioConfiguration,
    ) -> Result<Self, PluginError> {
        if config.sample_rate == 12_345.0 {
            return Err(PluginError::Message("not at this rate"));
        }
        Ok(Self { shared, host, line: vec![0.0; LATENCY] })
    }

    fn process(
        &mut self,
        _process: Process,
        mut audio: clack_plugin::prelude::Audio,
        events: Events,
    ) -> Result<ProcessStatus, PluginError> {
        let check = self.host.get_extension::<HostThreadCheck>().ok_or(PluginError::Message("no thread check"))?;
        if check.is_audio_thread(&self.host.shared()) != Some(true) {
            return Err(PluginError::Message("this is not the audio thread"));
        }
        let input = audio.input_port(1).ok_or(PluginError::Message("no main input"))?;
        let channels = input.channels()?.into_f32().ok_or(PluginError::Message("no floats"))?;
        let dry = channels.channel(0).ok_or(PluginError::Message("no channel"))?.to_vec();
        if dry.iter().any(|s| s.abs() > TOO_LOUD) {
            return Err(PluginError::Message("too loud"));
        }
        let mut wet = Vec::with_capacity(dry.len());
        for batch in events.input.batch() {
            batch.events().for_each(|event| self.shared.hear(event));
            let gain = 10_f64.powf(self.shared.gain() / 20.0) as f32;
            let end = batch.next_batch_first_sample().unwrap_or(dry.len());
            wet.extend(dry[batch.first_sample()..end].iter().map(|s| s * gain));
        }
        self.line.extend(wet);
        let mut output = audio.output_port(0).ok_or(PluginError::Message("no main output"))?;
        let mut channels = output.channels()?.into_f32().ok_or(PluginError::Message("no floats"))?;
        let channel = channels.channel_mut(0).ok_or(PluginError::Message("no channel"))?;
        channel.copy_from_slice(&self.line[..channel.len()]);
        self.line.drain(..dry.len());
        // A hand that turns the knob to -24 dB.
        let (id, sample) = (ClapId::new(3), 0);
        let _ = events.output.try_push(ParamGestureBeginEvent::new(sample, id));
        let _ = events.output.try_push(ParamValueEvent::new(sample, id, Pckn::match_all(), -24.0));
        let _ = events.output.try_push(ParamGestureEndEvent::new(sample, id));
        Ok(ProcessStatus::Continue)
    }
}

impl PluginAudioPortsImpl for Main<'_> {
    fn count(&self, is_input: bool) -> u32 {
        if is_input { 2 } else { 1 }
    }

    fn get(&self, index: u32, is_input: bool, writer: &mut AudioPortInfoWriter) {
        let main = !is_input || index == 1;
        writer.set(&AudioPortInfo {
            id: ClapId::new(index),
            name: b"port",
            channel_count: if main { 1 } else { 2 },
            flags: if main { AudioPortFlags::IS_MAIN } else { AudioPortFlags::empty() },
            port_type: Some(if main { AudioPortType::MONO } else { AudioPortType::STEREO }),
            in_place_pair: None,
        });
    }
}

impl PluginLatencyImpl for Main<'_> {
    fn get(&self) -> u32 {
        u32::try_from(LATENCY).unwrap()
    }
}

impl PluginMainThreadParams for Main<'_> {
    fn count(&self) -> u32 {
        // Asks for a flush each time, from the main thread as it should.
        if let Some(params) = self.host.get_extension::<HostParams>() {
            params.request_flush(&self.host.shared());
        }
        2
    }

    fn get_info(&self, index: u32, info: &mut ParamInfoWriter) {
        // The list has a hole: index 0 is no parameter.
        if index == 1 {
            info.set(&ParamInfo {
                id: ClapId::new(3),
                flags: ParamInfoFlags::IS_AUTOMATABLE,
                cookie: Default::default(),
                name: b"Gain",
                module: b"",
                min_value: -60.0,
                max_value: 12.0,
                default_value: 0.0,
            });
        }
    }

    fn get_value(&self, id: ClapId) -> Option<f64> {
        (id == 3).then(|| self.shared.gain())
    }

    fn value_to_text(&self, _id: ClapId, value: f64, writer: &mut ParamDisplayWriter) -> std::fmt::Result {
        write!(writer, "{value:.1} dB")
    }

    fn text_to_value(&self, _id: ClapId, text: &CStr) -> Option<f64> {
        text.to_str().ok()?.trim_end_matches("dB").trim().parse().ok()
    }

    fn flush(&self, input: &InputEvents, _output: &mut OutputEvents) {
        input.iter().for_each(|event| self.shared.hear(event));
    }
}

impl PluginAudioProcessorParams for Audio<'_> {
    fn flush(&mut self, input: &InputEvents, output: &mut OutputEvents) {
        input.iter().for_each(|event| self.shared.hear(event));
        let _ = output.try_push(ParamGestureBeginEvent::new(0, ClapId::new(3)));
    }
}

fn bundle() -> Bundle {
    let entry = PluginEntry::load_from_clack::<SinglePluginEntry<Odd>>(c"/inside/odd.clap").unwrap();
    Bundle::of_clap(entry)
}

fn mono() -> Instance {
    bundle().open(Setup { inputs: 1, ..Setup::default() }).unwrap()
}

/// Fails unless something was refused in these words.
#[track_caller]
fn says<T>(result: Result<T, Fault>, words: &str) {
    let error = result.err().expect("it is refused").to_string();
    assert!(error.contains(words), "{error}");
}

#[test]
fn lists_what_there_is_and_skips_holes() {
    let bundle = bundle();
    let info = &bundle.plugins()[0];
    assert_eq!(
        (info.id.as_str(), info.name.as_str(), info.vendor.as_str(), info.version.as_str()),
        ("test.odd", "Odd", "Nobody", "1.2")
    );
    assert!(bundle.find("Odd").is_ok() && bundle.find("test.odd").is_ok());
    assert!(bundle.find("Even").unwrap_err().to_string().ends_with("expected a plugin \"Even\", found Odd"));
    let mut odd = mono();
    let gain = odd.parameter("Gain").unwrap().clone();
    assert_eq!((gain.id, gain.unit.as_str(), gain.default_text.as_str(), gain.steps), (3, "dB", "0.0 dB", 0));
    assert_eq!(odd.parameters().len(), 1);
    assert!((gain.default - 60.0 / 72.0).abs() < 1e-12);
    assert_eq!(odd.from_text(3, "-24 dB").unwrap(), 0.5);
    assert_eq!(odd.text(3, 0.5).unwrap(), "-24.0 dB");
    says(odd.from_text(3, "loud"), "a value that");
    says(odd.from_text(3, "lo\0ud"), "a value that");
    says(odd.save(), "has no");
    assert!(odd.editor().is_err());
}

#[test]
fn the_track_is_on_the_main_port_and_one_output_on_both_ears() {
    let mut odd = mono();
    let [left, right] = odd.process(&[&[0.5; 300]]).unwrap();
    assert_eq!(left, right);
    assert_eq!(left, [vec![0.0; LATENCY], vec![0.5; 200]].concat());
    // Two channels do not go into one.
    says(bundle().open(Setup::default()), "expected");
}

#[test]
fn values_land_on_their_sample_and_late_ones_on_the_last() {
    let mut odd = mono();
    let half = odd.from_text(3, "-6.020599913").unwrap();
    odd.set_at(3, half, 150).unwrap();
    odd.set_at(3, odd.parameters()[0].default, 400).unwrap();
    // The block ends before the second.
    let mut out = odd.process(&[&[1.0; 200]]).unwrap()[0].clone();
    out.extend_from_slice(&odd.process(&[&[1.0; 200]]).unwrap()[0]);
    let near = |value: f32, wanted: f32| (value - wanted).abs() < 1e-6;
    assert!(out[100..250].iter().all(|&s| s == 1.0));
    assert!(out[250..299].iter().all(|&s| near(s, 0.5)), "{:?}", &out[250..299]);
    assert!(out[299..].iter().all(|&s| near(s, 1.0)));
    assert!(odd.set_at(4, 0.0, 0).is_err() && odd.set_at(3, 1.5, 0).is_err() && odd.set_at(3, 0.0, 512).is_err());
}

#[test]
fn a_rendering_is_in_time_with_its_input() {
    let mut odd = mono();
    let mut click = vec![0.0; 1500];
    click[700] = 1.0;
    let gain = odd.parameter("Gain").unwrap().clone();
    let points =
        [Point { seconds: 0.0, value: gain.default, hold: false }, Point { seconds: 1.0, value: gain.default, hold: false }];
    let lanes = [Lane::new(&gain, &points, 48_000.0).unwrap()];
    let out = bounce(&mut odd, &[&click], &lanes, 30).unwrap();
    assert_eq!(out[0], [click, vec![0.0; 30]].concat());
}

#[test]
fn gestures_and_values_of_its_own_are_heard() {
    let mut odd = mono();
    odd.take_edits();
    odd.process(&[&[0.0; 8]]).unwrap();
    let kinds: Vec<_> = odd.take_edits().into_iter().map(|edit| (edit.id, edit.kind)).collect();
    assert_eq!(kinds, [(3, EditKind::Begin), (3, EditKind::Value(0.5)), (3, EditKind::End)]);
    assert!(odd.take_edits().is_empty());
}

#[test]
fn a_flush_that_was_asked_for_comes_without_sound() {
    let mut odd = mono();
    // Listing the parameters made the plugin ask.
    odd.serve().unwrap();
    let kinds: Vec<_> = odd.take_edits().into_iter().map(|edit| edit.kind).collect();
    assert_eq!(kinds, [EditKind::Begin]);
    odd.serve().unwrap();
    assert!(odd.take_edits().is_empty(), "it was asked for once");
}

#[test]
fn what_was_set_is_there_once_it_has_settled() {
    let mut odd = mono();
    odd.set_at(3, 0.5, 17).unwrap();
    odd.settle().unwrap();
    assert_eq!(odd.value(3).unwrap(), 0.5);
    let wanted = 10_f32.powf(-24.0 / 20.0);
    assert!(odd.process(&[&[1.0; 200]]).unwrap()[0][100..].iter().all(|s| (s - wanted).abs() < 1e-6));
}

#[test]
fn refusals_are_errors() {
    let mut odd = mono();
    says(odd.process(&[&[2.0 * TOO_LOUD; 8]]), "fails to");
    says(odd.process(&[&[0.0; 513]]), "expected");
    says(odd.process(&[&[0.0; 8], &[0.0; 8]]), "expected");
    let unlucky = Setup { rate: 12_345.0, inputs: 1, ..Setup::default() };
    says(odd.restart(unlucky), "fails to");
    // It is not active any more, and says so until it is.
    says(odd.process(&[&[0.0; 8]]), "fails to");
    odd.restart(Setup { inputs: 1, ..Setup::default() }).unwrap();
    odd.process(&[&[0.0; 8]]).unwrap();
    assert!(bundle().open(unlucky).is_err());
}

#[test]
fn what_is_no_plugin_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let text = folder.path().join("text.clap");
    std::fs::write(&text, "no library").unwrap();
    says(Bundle::load(&text), "cannot be loaded");
    says(Bundle::load(&folder.path().join("none.vst3")), "cannot be loaded");
    std::fs::create_dir(folder.path().join("empty.vst3")).unwrap();
    says(Bundle::load(&folder.path().join("empty.vst3")), "cannot be loaded");
    says(Bundle::load(&folder.path().join("text.dll")), "ends in .clap or .vst3");
}
