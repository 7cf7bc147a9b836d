//! CLAP, through clack.

mod conventions;
mod editor;
mod handlers;
mod ports;
mod presets;
#[cfg(test)]
mod tests;
mod transport;

use crate::backend::Backend;
use crate::editor::Editor;
use crate::info::PluginInfo;
use crate::mark::{Mark, Track};
use crate::menu::MenuAction;
use crate::parameter::{Edit, EditKind, Parameter, unit_of};
use crate::preset::{Preset, PresetPlace};
use crate::remote_page::RemotePage;
use crate::setup::{Position, Setup};
use crate::{Fault, error, rounded};
use clack_extensions::latency::PluginLatency;
use clack_extensions::params::{ParamInfoBuffer, ParamInfoFlags, PluginParams};
use clack_extensions::preset_discovery::prelude::{Location, PluginPresetLoad};
use clack_extensions::render::{PluginRender, RenderMode};
use clack_extensions::state::PluginState;
use clack_extensions::tail::{PluginTail, TailLength};
use clack_host::events::event_types::ParamValueEvent;
use clack_host::events::spaces::CoreEventSpace;
use clack_host::extensions::{Extension, PluginExtensionSide};
use clack_host::plugin::PluginDescriptor;
use clack_host::prelude::*;
use handlers::{Handlers, Requests};
use libloading::Library;
use ports::Ports;
pub(crate) use presets::of as presets;
use std::ffi::{CStr, CString};
use std::fmt::Display;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// Keeps a loaded library loaded for good: threads that an editor has left behind may still run its code when the last instance
/// is gone.
fn stay(path: &Path) {
    #[expect(unsafe_code, reason = "loading a shared library runs its code")]
    // SAFETY: it is loaded already; this makes another handle to it. A bundle of macOS is no library itself, and is not kept.
    let handle = unsafe { Library::new(path) };
    handle.map(std::mem::forget).unwrap_or_default();
}

fn owned(text: Option<&CStr>) -> String {
    text.map(|t| t.to_string_lossy().into_owned()).unwrap_or_default()
}

/// This host, as plugins are told.
fn host_info() -> Result<HostInfo, std::ffi::NulError> {
    HostInfo::new("Promenade", "Promenade", "", env!("CARGO_PKG_VERSION"))
}

/// Loads a CLAP library.
pub(crate) fn load(path: &Path) -> Result<PluginEntry, Fault> {
    #[expect(unsafe_code, reason = "loading a shared library runs its code")]
    // SAFETY: the caller names the plugin whose code is to run.
    let entry = unsafe { PluginEntry::load(path) }.map_err(|e| error::unloaded(path, e))?;
    stay(path);
    Ok(entry)
}

/// The plugins of a library.
pub(crate) fn plugins(entry: &PluginEntry) -> Vec<PluginInfo> {
    let listed = entry.get_plugin_factory().into_iter().flat_map(|factory| factory.plugin_descriptors());
    let info = |d: &PluginDescriptor| {
        let (id, name) = (owned(d.id()), owned(d.name()));
        PluginInfo {
            name: if name.is_empty() { id.clone() } else { name },
            id,
            vendor: owned(d.vendor()),
            version: owned(d.version()),
        }
    };
    listed.filter(|d| d.id().is_some()).map(info).collect()
}

/// A running CLAP plugin.
pub(crate) struct ClapPlugin {
    // The processor goes first: it must not outlive the instance's activation.
    processor: Option<StartedPluginAudioProcessor<Handlers>>,
    instance: PluginInstance<Handlers>,
    editor_open: bool,
    info: PluginInfo,
    requests: Arc<Requests>,
    setup: Setup,
    ports: Ports,
    /// Values for the next block.
    pending: Vec<ParamValueEvent>,
    /// Values for the next block, in order of time.
    events: EventBuffer,
    /// The plugin's own events of a block.
    heard: EventBuffer,
    /// The plugin's own changes of its parameters in a block, in the plugin's own range.
    edits: Vec<Edit>,
    /// Samples since the activation.
    steady: u64,
    /// Whether the last block's status lets it sleep.
    may_sleep: bool,
}

impl ClapPlugin {
    pub(crate) fn open(entry: &PluginEntry, path: &Path, plugin: &PluginInfo, setup: Setup) -> Result<Self, Fault> {
        let info = host_info().map_err(|e| error::unloaded(path, e))?;
        let id = CString::new(plugin.id.as_str()).map_err(|e| error::unloaded(path, e))?;
        let requests = Arc::new(Requests::new(setup.editors));
        let theirs = Arc::clone(&requests);
        let instance = PluginInstance::new(
            |_| handlers::Shared(theirs),
            |shared: &handlers::Shared| handlers::Main(Arc::clone(&shared.0)),
            entry,
            &id,
            &info,
        )
        .map_err(|e| error::unloaded(path, e))?;
        let mut opened = Self {
            processor: None,
            instance,
            editor_open: false,
            info: plugin.clone(),
            requests,
            setup,
            ports: Ports::default(),
            pending: Vec::new(),
            events: EventBuffer::new(),
            heard: EventBuffer::new(),
            edits: Vec::new(),
            steady: 0,
            may_sleep: false,
        };
        opened.ports = Ports::choose(&mut opened.instance, &opened.info.name, &setup)?;
        opened.start()?;
        Ok(opened)
    }

    fn extension<E: Extension<ExtensionSide = PluginExtensionSide>>(&mut self, what: &'static str) -> Result<E, Fault> {
        let found = self.instance.plugin_handle().get_extension();
        found.ok_or_else(|| error::missing(&self.info.name, what))
    }

    fn failed(&self, what: &'static str, reason: impl Display) -> Fault {
        error::failed(&self.info.name, what, reason)
    }

    fn start(&mut self) -> Result<(), Fault> {
        if let Ok(render) = self.extension::<PluginRender>("modes") {
            let mode = if self.setup.offline { RenderMode::Offline } else { RenderMode::Realtime };
            // Who declines the mode plays in the other.
            let _ = render.set(&self.instance.plugin_handle(), mode);
        }
        let config = PluginAudioConfiguration {
            sample_rate: self.setup.rate,
            min_frames_count: 1,
            max_frames_count: u32::try_from(self.setup.block).unwrap_or(u32::MAX),
        };
        self.ports.fit(self.setup.block);
        (self.steady, self.may_sleep) = (0, false);
        self.requests.activating.store(true, Ordering::Release);
        let stopped = self.instance.activate(|_, _| (), config);
        self.requests.activating.store(false, Ordering::Release);
        let stopped = stopped.map_err(|e| self.failed("be activated", e))?;
        let started = self.requests.on_audio_thread(|| stopped.start_processing());
        self.processor = Some(started.map_err(|e| self.failed("start", e))?);
        self.serve()
    }

    fn stop(&mut self) {
        if let Some(processor) = self.processor.take() {
            let stopped = self.requests.on_audio_thread(|| processor.stop_processing());
            self.instance.deactivate(stopped);
        }
    }

    /// Keeps the plugin's own changes of its parameters.
    fn listen(&mut self) {
        for event in &self.heard {
            let edit = match event.as_core_event() {
                Some(CoreEventSpace::ParamValue(e)) => e.param_id().map(|id| (id, EditKind::Value(e.value()))),
                Some(CoreEventSpace::ParamGestureBegin(e)) => e.param_id().map(|id| (id, EditKind::Begin)),
                Some(CoreEventSpace::ParamGestureEnd(e)) => e.param_id().map(|id| (id, EditKind::End)),
                _ => None,
            };
            self.edits.extend(edit.map(|(id, kind)| Edit { id: id.get(), kind }));
        }
        self.heard.clear();
    }

    /// The values for the next block, in order of time, none beyond its last sample.
    fn queue(&mut self, last: u32) {
        self.events.clear();
        for event in self.pending.drain(..) {
            self.events.push(&event.with_time(event.time().min(last)));
        }
        self.events.sort();
    }
}

impl Drop for ClapPlugin {
    fn drop(&mut self) {
        self.destroy_editor();
        self.stop();
    }
}

impl Backend for ClapPlugin {
    fn info(&self) -> &PluginInfo {
        &self.info
    }

    fn restart(&mut self, setup: Setup) -> Result<(), Fault> {
        self.stop();
        // What the plugin has asked for may also come while it is not active.
        if Requests::take(&self.requests.callback) {
            self.instance.call_on_main_thread_callback();
        }
        self.setup = setup;
        self.start()
    }

    fn parameters(&mut self) -> Result<Vec<Parameter>, Fault> {
        let Ok(params) = self.extension::<PluginParams>("parameters") else { return Ok(Vec::new()) };
        let count = params.count(&self.instance.plugin_handle());
        let mut buffer = ParamInfoBuffer::new();
        let mut all = Vec::new();
        for index in 0..count {
            let handle = self.instance.plugin_handle();
            let Some(info) = params.get_info(&handle, index, &mut buffer) else { continue };
            let (least, greatest) = (info.min_value, info.max_value);
            let stepped = info.flags.contains(ParamInfoFlags::IS_STEPPED);
            let steps = if stepped { u32::try_from(rounded(greatest - least)).unwrap_or(0) } else { 0 };
            let mut parameter = Parameter {
                id: info.id.get(),
                name: String::from_utf8_lossy(info.name).into_owned(),
                unit: String::new(),
                default: 0.0,
                default_text: String::new(),
                steps,
                automatable: info.flags.contains(ParamInfoFlags::IS_AUTOMATABLE),
                least,
                greatest,
                module: String::from_utf8_lossy(info.module).into_owned(),
                periodic: info.flags.contains(ParamInfoFlags::IS_PERIODIC),
            };
            parameter.default = parameter.normalized(info.default_value);
            // A parameter without a text is listed without one.
            parameter.default_text = self.text(&parameter, parameter.default).unwrap_or_default();
            parameter.unit = unit_of(&parameter.default_text).to_owned();
            all.push(parameter);
        }
        Ok(all)
    }

    fn set_at(&mut self, parameter: &Parameter, normalized: f64, offset: u32) -> Result<(), Fault> {
        let value = parameter.plain(normalized);
        self.pending.push(ParamValueEvent::new(offset, ClapId::new(parameter.id), Pckn::match_all(), value));
        Ok(())
    }

    fn flush(&mut self) -> Result<(), Fault> {
        let params = self.extension::<PluginParams>("parameters")?;
        self.queue(0);
        let Some(processor) = &mut self.processor else { return Err(self.failed("take values", "it is not active")) };
        let (events, mut heard) = (self.events.as_input(), self.heard.as_output());
        self.requests.on_audio_thread(|| params.flush_active(&mut processor.plugin_handle(), &events, &mut heard));
        self.listen();
        Ok(())
    }

    fn value(&mut self, parameter: &Parameter) -> Result<f64, Fault> {
        let params = self.extension::<PluginParams>("parameters")?;
        let value = params.get_value(&self.instance.plugin_handle(), ClapId::new(parameter.id));
        value.map(|v| parameter.normalized(v)).ok_or_else(|| self.failed("report a parameter's value", &parameter.name))
    }

    fn text(&mut self, parameter: &Parameter, normalized: f64) -> Result<String, Fault> {
        let params = self.extension::<PluginParams>("parameters")?;
        let mut text = [0; 256];
        let (id, value) = (ClapId::new(parameter.id), parameter.plain(normalized));
        let written = params.value_to_text(&self.instance.plugin_handle(), id, value, &mut text);
        let text = written.map(|t| String::from_utf8_lossy(t).into_owned());
        text.map_err(|_| self.failed("write a parameter's value", &parameter.name))
    }

    fn parse(&mut self, parameter: &Parameter, text: &str) -> Result<Option<f64>, Fault> {
        let params = self.extension::<PluginParams>("parameters")?;
        let Ok(text) = CString::new(text) else { return Ok(None) };
        let value = params.text_to_value(&self.instance.plugin_handle(), ClapId::new(parameter.id), &text);
        Ok(value.filter(|v| v.is_finite()).map(|v| parameter.normalized(v)))
    }

    fn process(&mut self, input: &[&[f32]], output: &mut [&mut [f32]], position: Option<Position>) -> Result<(), Fault> {
        // What the last block has asked for: a host's main thread comes later than its audio thread. This block is the flush.
        Requests::take(&self.requests.flush);
        self.serve()?;
        let len = output.first().map_or(0, |channel| channel.len());
        // What was set for a sample that does not come is set at the last one.
        self.queue(u32::try_from(len.saturating_sub(1)).unwrap_or(u32::MAX));
        let Some(processor) = &mut self.processor else { return Err(self.failed("play", "it is not active")) };
        let transport = position.map(|position| transport::at(position, self.setup.tempo));
        let (inputs, mut outputs) = self.ports.connect(input, len);
        let (events, mut heard) = (self.events.as_input(), self.heard.as_output());
        let steady = Some(self.steady);
        let done = self
            .requests
            .on_audio_thread(|| processor.process(&inputs, &mut outputs, &events, &mut heard, steady, transport.as_ref()));
        let status = done.map_err(|e| self.failed("play", e))?;
        self.may_sleep = status != ProcessStatus::Continue;
        self.steady += len as u64;
        self.ports.copy_out(output);
        self.listen();
        // The block was the flush that the plugin may have asked for.
        Requests::take(&self.requests.flush);
        Ok(())
    }

    fn main_output(&mut self) -> String {
        self.ports.main_output(&mut self.instance)
    }

    fn further_inputs(&mut self) -> usize {
        self.ports.further_inputs()
    }

    fn latency(&mut self) -> Result<usize, Fault> {
        if Requests::take(&self.requests.restart) {
            self.restart(self.setup)?;
        }
        // A plugin without this extension has no latency.
        let Ok(latency) = self.extension::<PluginLatency>("latency") else { return Ok(0) };
        Ok(latency.get(&self.instance.plugin_handle()) as usize)
    }

    fn restarts(&self) -> usize {
        self.requests.restarts.load(Ordering::Acquire)
    }

    fn tail(&mut self) -> Option<usize> {
        let Ok(tail) = self.extension::<PluginTail>("tail") else { return Some(0) };
        match tail.get(&self.processor.as_mut()?.plugin_handle()) {
            TailLength::Finite(samples) => Some(samples as usize),
            TailLength::Infinite => None,
        }
    }

    fn may_sleep(&self) -> Option<bool> {
        Some(self.may_sleep)
    }

    fn save(&mut self) -> Result<Vec<u8>, Fault> {
        let state = self.extension::<PluginState>("state to save")?;
        let mut bytes = Vec::new();
        let saved = state.save(&self.instance.plugin_handle(), &mut bytes);
        saved.map(|()| bytes).map_err(|e| self.failed("save its state", e))
    }

    fn load(&mut self, mut bytes: &[u8]) -> Result<(), Fault> {
        let state = self.extension::<PluginState>("state to load")?;
        let loaded = state.load(&self.instance.plugin_handle(), &mut bytes);
        self.serve()?;
        loaded.map_err(|_| self.failed("load a state", "it does not take it"))
    }

    fn load_preset(&mut self, preset: &Preset) -> Result<(), Fault> {
        let loading = self.extension::<PluginPresetLoad>("presets that a host can load")?;
        let text = |text: &str| CString::new(text).map_err(|e| self.failed("load a preset", e));
        let file = match &preset.place {
            PresetPlace::Plugin => None,
            PresetPlace::File(path) => Some(text(&path.to_string_lossy())?),
        };
        let key = preset.key.as_deref().map(text).transpose()?;
        let location = file.as_ref().map_or(Location::Plugin, |path| Location::File { path });
        self.requests.preset.take();
        let loaded = loading.load_from_location(&self.instance.plugin_handle(), location, key.as_deref());
        let reported = self.requests.preset.take();
        self.serve()?;
        match (loaded, reported) {
            (Ok(()), Some(Ok(()))) => Ok(()),
            (_, Some(Err(reason))) => Err(self.failed("load a preset", reason)),
            (Ok(()), None) => Err(self.failed("load a preset", "it does not report to have done so")),
            (Err(error), _) => Err(self.failed("load a preset", error)),
        }
    }

    fn serve(&mut self) -> Result<(), Fault> {
        if Requests::take(&self.requests.callback) {
            self.instance.call_on_main_thread_callback();
        }
        if Requests::take(&self.requests.flush) {
            self.flush()?;
        }
        if Requests::take(&self.requests.closed) {
            self.destroy_editor();
        }
        if Requests::take(&self.requests.untimely) {
            return Err(self.failed("report its latency", "it has done so outside of its activation"));
        }
        Ok(())
    }

    fn remote_pages(&mut self) -> Vec<RemotePage> {
        self.declared_pages()
    }

    fn mark(&mut self, id: u32, mark: &Mark) -> Result<(), Fault> {
        self.show_mark(id, mark)
    }

    fn set_track(&mut self, track: Track) -> Result<(), Fault> {
        self.tell_track(track)
    }

    fn take_chosen(&mut self) -> Vec<(u32, MenuAction)> {
        self.chosen()
    }

    fn relisted(&mut self) -> bool {
        Requests::take(&self.requests.rescan)
    }

    fn take_edits(&mut self, parameters: &[Parameter]) -> Vec<Edit> {
        let normalized = |edit: Edit| {
            let EditKind::Value(plain) = edit.kind else { return Some(edit) };
            let parameter = parameters.iter().find(|p| p.id == edit.id)?;
            Some(Edit { kind: EditKind::Value(parameter.normalized(plain)), ..edit })
        };
        self.edits.drain(..).filter_map(normalized).collect()
    }

    fn editor(&mut self) -> Option<&mut dyn Editor> {
        editor::of(self)
    }
}
