//! The plugin as hosts call it: activation, blocks, parameters and editor.

use super::guard::{Fuse, guard};
use super::{further_input, input::Input, kind::Kind};
use crate::budget::Spender;
use crate::editor::{Instance, PromenadeEditor};
use crate::export::pages::{self, InModules};
use crate::listener::clock::{BlockTime, Clock};
use crate::listener::ramp::{self, Ramps, Stretch};
use crate::listener::{HeardPose, ListenerSources, inbox::Inbox, snapshot::Snapshot, source_paths::SourcePaths};
use crate::osc::{Osc, Switch};
use crate::parameter::cast::narrow;
use crate::parameter::{Parameter, choices::AccuracyChoice};
use crate::playing::{Playing, loader::Loader, monitor::Monitor, output::Output};
use crate::project::{host_values::Arrived, params::PromenadeParams};
use crate::telemetry::{Telemetry, host_side::HostSide, members};
use nice_plug::prelude::*;
use nice_plug::util::permit_alloc;
use promenade_core::{Spatializer, Voice};
use std::sync::Arc;
use std::time::Instant;

/// Samples in which one pair of output channels is rendered after the other.
const STRETCH: usize = 256;
/// Fainter samples are taken as silence, as the engine does: -240 dBFS.
const SILENCE: f32 = 1e-12;

/// The plugin, with so many further sources in its room. The audio thread owns it once the host has activated it.
pub struct Promenade<const FURTHER: usize = 0> {
    /// Lives as long as the plugin; goes first, so that an editor that is still open writes nothing any more.
    _alive: Arc<()>,
    params: Arc<PromenadeParams>,
    /// What the editor is given of this instance.
    instance: Instance,
    playing: Playing,
    listener: ListenerSources,
    osc: Switch,
    spender: Spender,
    input: Input,
    timing: Timing,
    monitor: Monitor<FURTHER>,
    ramps: Ramps<FURTHER>,
    fuse: Fuse,
}

/// The time of blocks.
#[derive(Default)]
struct Timing {
    sample_rate_hz: f64,
    clock: Clock,
    /// The latency that was reported to the host, samples.
    latency: u32,
    /// How often an activation has asked for another one.
    asked: u32,
    /// Samples since the input was last heard, or since the start.
    quiet: usize,
}

/// The parameters of a new instance; the standalone program has its camera path and its latency.
fn first_params() -> PromenadeParams {
    #[cfg(feature = "standalone")]
    if let Some(player) = crate::playing::player::player() {
        return PromenadeParams::beginning_on(player.walk()).beginning_at(player.latency());
    }
    PromenadeParams::default()
}

impl<const FURTHER: usize> Default for Promenade<FURTHER> {
    /// Hosts build plugins to list them: no file, thread or large buffer here.
    fn default() -> Self {
        let params = Arc::new(first_params().with_further(FURTHER));
        let (inbox, telemetry) = (Arc::<Inbox>::default(), Telemetry::new());
        let loader = Loader::new(Arc::clone(&params));
        let osc = Osc::new(Arc::clone(&params), Arc::clone(&loader.exchange), Arc::clone(&inbox), Arc::clone(&telemetry));
        let repaint = loader.repaint.clone();
        let host_side = Arc::new(HostSide::new(repaint.clone(), Arc::clone(&params)));
        host_side.introduce();
        let theirs = Arc::downgrade(&loader);
        host_side.prepare_by(move |rate_hz, live_block| {
            let loader = theirs.upgrade().filter(|_| rate_hz.is_finite() && rate_hz >= 1.0)?;
            loader.play_live(live_block);
            loader.activate(rate_hz, loader.output());
            loader.delays().map(|delays| delays.map(samples))
        });
        let alive = Arc::new(());
        let account = Arc::clone(&loader.account);
        Self {
            playing: Playing::new(Arc::clone(&loader)),
            listener: ListenerSources::new(inbox),
            osc: Switch::new(Arc::clone(&osc)),
            spender: Spender::new(Arc::clone(&account)),
            input: Input::default(),
            timing: Timing::default(),
            ramps: Ramps::default(),
            fuse: Fuse::default(),
            monitor: Monitor::new(Arc::clone(&telemetry), repaint.clone()),
            instance: Instance {
                params: Arc::clone(&params),
                loader,
                telemetry,
                osc,
                repaint,
                host_side,
                account,
                session: Arc::default(),
                plugin: Arc::downgrade(&alive),
            },
            _alive: alive,
            params,
        }
    }
}

impl<const FURTHER: usize> Promenade<FURTHER> {
    /// The time of a block, by the host's transport, or by the file that the standalone program plays in place of the input.
    fn follow_transport(&mut self, buffer: &mut Buffer, transport: &Transport, arrived: Arrived) -> BlockTime {
        // The framework moves the position on where it splits a block, whether the transport runs or not.
        let is_held = !transport.playing && arrived.at > 0;
        let position_s = if is_held { self.timing.clock.reported_s() } else { transport.pos_seconds() };
        let host = (position_s, transport.playing);
        let (position_s, playing) = self.input.play_file(buffer).map_or(host, |(file_s, playing)| (Some(file_s), playing));
        self.timing.clock.advance(position_s, playing, buffer.samples(), self.timing.sample_rate_hz)
    }

    /// The parameters of a block; a missing scene passes the dry sound at its level, and decodes are waited for offline.
    fn snapshot(&mut self, offline: bool) -> Snapshot<FURTHER> {
        let mut snapshot = Snapshot::of(&self.params, self.playing.frame().as_ref());
        snapshot.block.live.wait = offline;
        if let Some(gain) = self.playing.dry {
            (snapshot.block.mix, snapshot.block.wet_solo) = (0.0, false);
            snapshot.block.gain *= gain;
        }
        if !self.playing.is_binaural() {
            // Width is what both ears differ by.
            snapshot.block.trim.width = 1.0;
        }
        snapshot
    }

    /// Renders a block in place, pose by pose. `None` before activation, or without two output channels.
    /// Where the block's values are moved to over the block, `from` has those that it begins with.
    fn render(
        &mut self,
        buffer: &mut Buffer,
        further: &mut [Buffer],
        snapshot: &Snapshot<FURTHER>,
        from: Option<&Snapshot<FURTHER>>,
        time: &BlockTime,
    ) -> Option<HeardPose> {
        let total = buffer.samples();
        let (walk, leader) = (self.playing.walk.as_deref(), self.playing.leader.as_deref());
        let paths = SourcePaths::new(self.playing.source_walks.as_deref(), self.playing.emitter());
        let mut listener = self.listener.of_block(snapshot, from, (walk, leader, paths), time, self.timing.sample_rate_hz);
        let is_binaural = self.playing.is_binaural();
        let (spatializers, outputs) = (&mut self.playing.spatializers, buffer.as_slice());
        if outputs.len() < 2 {
            return None;
        }
        if time.moved {
            spatializers.iter_mut().for_each(Spatializer::jump);
        }
        if self.spender.waits() {
            self.timing.quiet = if self.spender.quiet { self.timing.quiet.saturating_add(total) } else { 0 };
            outputs.iter_mut().for_each(|output| output.fill(0.0));
            return Some(listener.end(total, time.end_s()));
        }
        if self.spender.wakes(spatializers.first()?.latency_samples(), self.timing.sample_rate_hz) {
            spatializers.iter_mut().for_each(Spatializer::reset);
            self.playing.headphones.reset();
        }
        self.input.take(outputs, snapshot.first_gain, self.timing.sample_rate_hz);
        let others = further.iter_mut().flat_map(|input| input.as_slice().iter_mut().map(|channel| &mut **channel));
        let inputs = outputs.iter_mut().map(|channel| &mut **channel).chain(others);
        self.spender.fade_in(inputs, total, self.timing.sample_rate_hz);
        // One pass for both ears, unless a host breaks its own promise on the block size.
        let longest = if is_binaural { self.input.longest() } else { self.input.longest().min(STRETCH) };
        let longest = if from.is_some() { longest.min(ramp::STRETCH) } else { longest };
        let mut start = 0;
        while start < total {
            let most = if listener.moves_sources() { longest.min(samples_to_pose(spatializers)) } else { longest };
            let span = start..total.min(start + most);
            let share = narrow(span.end as f64 / total as f64);
            let mut block = from.map_or(snapshot.block, |from| ramp::at(&from.block, &snapshot.block, share));
            block.emitters.offset += listener.source_offset(0, span.end - 1);
            let channels = self.input.channels;
            let (input, nowhere) = self.input.copied(outputs, span.clone());
            self.monitor.measure_input(input, channels == 2);
            let on_path = |further| listener.source_offset(1 + further, span.end - 1);
            let others: [Voice; FURTHER] = further_input::of_span(further, snapshot, from, span.clone(), share, on_path);
            self.monitor.measure_further(&others);
            let all = input[..channels].iter().copied().chain(others.iter().filter(|o| o.level > 0.0).map(|other| other.input));
            let sounds = all.flatten().any(|sample| sample.abs() >= SILENCE);
            self.timing.quiet = if sounds { 0 } else { self.timing.quiet.saturating_add(span.len()) };
            for (spatializer, pair) in spatializers.iter_mut().zip(outputs.chunks_mut(2)) {
                let pair = match pair {
                    [first, second, ..] => [&mut first[span.clone()], &mut second[span.clone()]],
                    [last] => [&mut last[span.clone()], &mut *nowhere],
                    [] => continue,
                };
                spatializer.process(&input[..channels], &others, pair, &block, |i| listener.pose(start + i));
            }
            if let (true, [left, right]) = (is_binaural, &mut *outputs) {
                self.playing.headphones.process([&mut left[span.clone()], &mut right[span.clone()]], !snapshot.block.bypass);
            }
            start = span.end;
        }
        self.spender.fade(outputs, self.timing.sample_rate_hz);
        Some(listener.end(total, time.end_s()))
    }

    /// How far the listener is from the emitter, metres; 1 where the scene has none.
    fn distance_m(&self, heard: &HeardPose, snapshot: &Snapshot<FURTHER>) -> f32 {
        let offset = heard.source_offset + snapshot.block.emitters.offset;
        self.playing.emitter().map_or(1.0, |emitter| heard.pose.position.distance(emitter + offset))
    }

    /// Reports latency and tail, and that nothing sounds any more.
    ///
    /// Only CLAP has a status for the latter; to VST3 it would mean that there is no tail.
    fn report(&mut self, silent: bool, snapshot: &Snapshot<FURTHER>, context: &mut impl ProcessContext<Self>) -> ProcessStatus {
        let Some((latency, tail)) = self.delays(snapshot) else { return ProcessStatus::Normal };
        let host = &self.instance.host_side;
        host.change_tail(tail);
        if latency != self.timing.latency {
            self.timing.latency = latency;
            if context.plugin_api() != PluginApi::Clap {
                // There hosts ask for it whenever they are told; CLAP's changes with an activation only.
                host.set_latency(latency);
            }
            permit_alloc(|| context.request_restart());
        }
        // A leader's pose, an editor's picture and a pose that is sent go on in silence.
        let needed = self.listener.member.leads() || self.instance.telemetry.is_followed();
        if silent && !needed && samples(self.timing.quiet) > tail && context.plugin_api() == PluginApi::Clap {
            return ProcessStatus::Normal;
        }
        ProcessStatus::Tail(tail)
    }

    /// Samples by which the sound is late, and for which it goes on after its input.
    fn delays(&self, snapshot: &Snapshot<FURTHER>) -> Option<(u32, u32)> {
        let spatializer = self.playing.spatializer()?;
        let latency = samples(spatializer.latency_samples());
        let tail = spatializer.renderer().map_or(0, |renderer| renderer.tail_samples_with(&snapshot.block.trim));
        Some((latency, latency.saturating_add(samples(tail))))
    }

    /// Does something, unless anything has panicked before: the instance is silent then.
    fn fused<T>(&mut self, done: impl FnOnce(&mut Self) -> T) -> Option<T> {
        let mut fuse = std::mem::take(&mut self.fuse);
        let done = fuse.run(|| done(self));
        self.fuse = fuse;
        done
    }

    /// Makes everything ready for blocks of a layout; says whether it could.
    fn start(&mut self, layout: &AudioIOLayout, config: &BufferConfig, context: &mut impl ActivateContext<Self>) -> bool {
        let sample_rate_hz = f64::from(config.sample_rate);
        if !(sample_rate_hz.is_finite() && sample_rate_hz >= 1.0) {
            nice_error!("the host's sample rate is {sample_rate_hz} Hz, expected a positive number");
            return false;
        }
        self.timing.sample_rate_hz = sample_rate_hz;
        if context.plugin_api() != PluginApi::Vst3 {
            // There the framework hands on the mode of the activation before.
            self.instance.host_side.announce(config.process_mode == ProcessMode::Offline);
        }
        let channels = layout.main_input_channels.map_or(0, NonZeroU32::get);
        self.input.resize(channels as usize, (config.max_buffer_size as usize).max(1));
        #[cfg(feature = "standalone")]
        if let Some(Err(error)) = crate::playing::player::player().map(|player| player.set_rate(sample_rate_hz)) {
            nice_error!("{error}");
        }
        members::join(&self.params, &self.instance.host_side, &self.instance.account);
        self.spender.activate();
        let output = Output::of_channels(layout.main_output_channels.map_or(0, NonZeroU32::get) as usize);
        self.instance.loader.play_live(if self.instance.host_side.is_offline() { 0 } else { config.max_buffer_size });
        self.playing.activate(sample_rate_hz, output, self.instance.loader.choices());
        self.osc.activate(&self.params);
        // Hosts ask for both after an activation, before there is any block.
        let (latency, tail) = self.delays(&Snapshot::of(&self.params, None)).unwrap_or_default();
        self.timing.latency = latency;
        self.instance.host_side.set_latency(latency);
        self.instance.host_side.set_tail(tail);
        if self.instance.host_side.is_mistaken() {
            self.timing.asked += 1;
            // Any other number makes the framework ask the host for another activation; what the host reads is ours.
            context.set_latency_samples(self.timing.asked);
        }
        true
    }

    /// What has sounded is heard no more.
    fn forget_sound(&mut self) {
        self.playing.reset();
        self.listener.glide.jump();
        self.ramps = Ramps::default();
        self.input.reset();
        self.timing.quiet = 0;
        self.timing.clock = Clock::default();
    }

    /// Plays a block in place.
    fn play(
        &mut self,
        buffer: &mut Buffer,
        aux: &mut AuxiliaryBuffers,
        arrived: Arrived,
        context: &mut impl ProcessContext<Self>,
    ) -> ProcessStatus {
        let began = Instant::now();
        self.osc.follow(&self.params);
        let time = self.follow_transport(buffer, context.transport(), arrived);
        let offline = self.instance.host_side.is_offline();
        self.playing.update(self.instance.loader.choices(), offline);
        let snapshot = self.snapshot(offline);
        let power = || further_input::power(ears(buffer), aux.inputs);
        let watch = self.spender.begin(power, offline, snapshot.leads || snapshot.block.bypass);
        let stretch = Stretch { len: buffer.samples(), jumps: time.moved, arrived };
        let from = self.ramps.follow(&snapshot, stretch, self.timing.sample_rate_hz);
        let Some(heard) = self.render(buffer, aux.inputs, &snapshot, from.as_ref(), &time) else {
            return ProcessStatus::Error("not activated, or less than two output channels");
        };
        if let Some(watch) = &watch {
            let away_m = self.distance_m(&heard, &snapshot);
            let most = AccuracyChoice::from_index(self.params.index(Parameter::Accuracy));
            self.spender.end(watch, ears(buffer), away_m, most, time.length_s);
        }
        self.playing.fade(buffer.as_slice());
        self.monitor.show(&snapshot, &time, &heard, &self.playing, ears(buffer), began.elapsed());
        let silent = ears(buffer).into_iter().flatten().all(|sample| *sample == 0.0);
        self.report(silent, &snapshot, context)
    }
}

impl<const FURTHER: usize> Plugin for Promenade<FURTHER> {
    const NAME: &'static str = Kind::of(FURTHER).name;
    const VENDOR: &'static str = "Promenade";
    const URL: &'static str = "";
    const EMAIL: &'static str = "";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");

    const AUDIO_IO_LAYOUTS: &'static [AudioIOLayout] = Kind::of(FURTHER).layouts;

    const SAMPLE_ACCURATE_AUTOMATION: bool = true;

    type Editor = PromenadeEditor;
    type SysExMessage = ();
    /// A mark: the framework's queue is used for nothing else here.
    type BackgroundTask = u64;

    fn params(&self) -> Arc<dyn Params> {
        Arc::new(InModules(Arc::clone(&self.params)))
    }

    fn task_executor(&mut self) -> TaskExecutor<Self> {
        let side = Arc::clone(&self.instance.host_side);
        Box::new(move |mark| side.marks.come_back(mark))
    }

    fn editor(&mut self, async_executor: AsyncExecutor<Self>) -> Option<PromenadeEditor> {
        self.instance.host_side.marks.post_by(move |mark| async_executor.execute_background(mark));
        Some(PromenadeEditor::new(self.instance.clone()))
    }

    fn filter_state(state: &mut PluginState) {
        guard((), || {
            crate::project::state::keep_former_scene(state);
            crate::project::state::migrate(state);
        });
    }

    fn activate(&mut self, layout: &AudioIOLayout, config: &BufferConfig, context: &mut impl ActivateContext<Self>) -> bool {
        self.instance.host_side.activated();
        self.fused(|plugin| plugin.start(layout, config, context)).unwrap_or(false)
    }

    fn reset(&mut self) {
        if !self.instance.host_side.is_resuming() {
            self.fused(Self::forget_sound);
        }
    }

    fn deactivate(&mut self) {
        self.fused(|plugin| plugin.listener.member.leave());
    }

    fn process(
        &mut self,
        buffer: &mut Buffer,
        aux: &mut AuxiliaryBuffers,
        context: &mut impl ProcessContext<Self>,
    ) -> ProcessStatus {
        let arrived = self.instance.host_side.values.advance(buffer.samples());
        let played = self.fused(|plugin| plugin.play(buffer, aux, arrived, context));
        played.unwrap_or_else(|| {
            buffer.as_slice().iter_mut().for_each(|channel| channel.fill(0.0));
            ProcessStatus::Normal
        })
    }
}

impl<const FURTHER: usize> ClapPlugin for Promenade<FURTHER> {
    const CLAP_ID: &'static str = Kind::of(FURTHER).clap_id;
    const CLAP_DESCRIPTION: Option<&'static str> = Some(Kind::of(FURTHER).description);
    const CLAP_MANUAL_URL: Option<&'static str> = None;
    const CLAP_SUPPORT_URL: Option<&'static str> = None;
    const CLAP_FEATURES: &'static [ClapFeature] = &[
        ClapFeature::AudioEffect,
        ClapFeature::Stereo,
        ClapFeature::Mono,
        ClapFeature::Ambisonic,
        ClapFeature::Reverb,
        ClapFeature::Custom("promenade:spatial"),
    ];

    fn remote_controls(&self, context: &mut impl RemoteControlsContext) {
        pages::remote_controls(&self.params, context);
    }
}

impl<const FURTHER: usize> Vst3Plugin for Promenade<FURTHER> {
    const VST3_CLASS_ID: [u8; 16] = Kind::of(FURTHER).vst3_class;
    const VST3_SUBCATEGORIES: &'static [Vst3SubCategory] = &[Vst3SubCategory::Fx, Vst3SubCategory::Spatial];
}

/// Both ears, or the first two channels of Ambisonics; empty without them.
fn ears<'a>(buffer: &'a mut Buffer) -> [&'a [f32]; 2] {
    match buffer.as_slice() {
        [left, right, ..] => [left, right],
        _ => [&[], &[]],
    }
}

/// Samples until one of the renderers asks for a pose next.
fn samples_to_pose(spatializers: &[Spatializer]) -> usize {
    spatializers.iter().map(Spatializer::samples_to_pose).min().unwrap_or(usize::MAX)
}

/// A number of samples as hosts take it.
fn samples(count: usize) -> u32 {
    u32::try_from(count).unwrap_or(u32::MAX)
}
