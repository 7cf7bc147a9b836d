//! The shell: what hosts call, on which thread.

use crate::clock::Clock;
use crate::editor::{Instance, PromenadeEditor};
use crate::group::Member;
use crate::listener::{Glide, Listener};
use crate::loader::{Loader, Retired, Stage};
use crate::osc::{Inbox, Osc};
use crate::pace::Pace;
use crate::params::{Choices, PromenadeParams, Snapshot};
use crate::telemetry::{Frame, Telemetry};
use crate::walk::Walk;
use crate::worker::{Desk, LOADER};
use nice_plug::prelude::*;
use promenade_core::{Pose, Spatializer};
use std::sync::Arc;
use std::time::Instant;

/// Time between two pictures when only levels or the time change, seconds.
const LEVELS_S: f64 = 1.0 / 30.0;

/// The plugin. The audio thread owns it once the host has activated it.
pub struct Promenade {
    params: Arc<PromenadeParams>,
    loader: Arc<Loader>,
    /// From the first activation on.
    desk: Option<Desk>,
    sample_rate_hz: f64,
    input_channels: usize,
    /// A copy of the input, because hosts hand the same buffer for input and output.
    input: [Vec<f32>; 2],
    spatializer: Option<Spatializer>,
    walk: Option<Arc<Walk>>,
    /// Whether the wanted scene is missing, so that the dry sound passes.
    dry: bool,
    /// What could not be handed back yet, because the loader has fallen behind.
    held: Option<Retired>,
    choices: Option<Choices>,
    clock: Clock,
    /// The latency that the host knows of, samples.
    latency: u32,
    pace: Pace,
    inbox: Arc<Inbox>,
    osc: Arc<Osc>,
    glide: Glide,
    member: Member,
    telemetry: Arc<Telemetry>,
    frame: Frame,
    #[cfg(feature = "standalone")]
    deck: crate::player::Deck,
    /// What an open editor was last asked to show.
    told: Frame,
    told_snapshot: Option<Snapshot>,
    since_told_s: f64,
}

impl Default for Promenade {
    /// Hosts build plugins to list them: no file, thread or large buffer here.
    fn default() -> Self {
        let params = Arc::new(PromenadeParams::default());
        let (inbox, telemetry) = (Arc::<Inbox>::default(), Telemetry::new());
        Self {
            osc: Osc::new(Arc::clone(&params), Arc::clone(&inbox), Arc::clone(&telemetry)),
            loader: Loader::new(Arc::clone(&params)),
            params,
            desk: None,
            sample_rate_hz: 0.0,
            input_channels: 2,
            input: [Vec::new(), Vec::new()],
            spatializer: None,
            walk: None,
            dry: false,
            held: None,
            choices: None,
            clock: Clock::default(),
            latency: 0,
            pace: Pace::default(),
            inbox,
            glide: Glide::default(),
            member: Member::default(),
            telemetry,
            frame: Frame::default(),
            #[cfg(feature = "standalone")]
            deck: crate::player::Deck::default(),
            told: Frame::default(),
            told_snapshot: None,
            since_told_s: 0.0,
        }
    }
}

impl Promenade {
    /// Ends a running cross-fade and forgets the past.
    fn jump(&mut self) {
        self.glide.jump();
        if let Some(spatializer) = &mut self.spatializer {
            spatializer.reset();
        }
    }

    /// Plays the standalone program's file in place of the input, and by its time.
    #[cfg(feature = "standalone")]
    fn play_file(&mut self, buffer: &mut Buffer) -> Option<(f64, bool)> {
        let [left, right] = buffer.as_slice() else { return None };
        self.deck.play(crate::player::player()?, left, right)
    }

    #[cfg(not(feature = "standalone"))]
    #[expect(clippy::unused_self, reason = "hosts have their own files")]
    fn play_file(&mut self, _buffer: &mut Buffer) -> Option<(f64, bool)> {
        None
    }

    /// Begins the cross-fade to what the loader has ready. Says whether the loader has something to drop.
    fn fetch(&mut self) -> bool {
        let Some(spatializer) = &mut self.spatializer else { return false };
        let mut hands_back = self.held.is_some();
        let retire = |loader: &Loader, held: &mut Option<Retired>, item: Retired| {
            // Nothing new is fetched while something is held, so the place is free.
            *held = loader.retired.push(item).err();
        };
        if let Some(item) = self.held.take() {
            retire(&self.loader, &mut self.held, item);
        }
        if self.held.is_none()
            && let Some(renderer) = spatializer.take_retired()
        {
            hands_back = true;
            retire(&self.loader, &mut self.held, Retired::Scene(Stage::Scene(renderer)));
        }
        if self.held.is_none()
            && let Some(stage) = self.loader.stages.pop()
        {
            self.dry = matches!(stage, Stage::Dry);
            if let Stage::Scene(renderer) = stage
                && let Err(renderer) = spatializer.swap_in(renderer)
            {
                // A fade is running: come back for it, unless the loader has a newer one by then.
                if let Err(stage) = self.loader.stages.push(Stage::Scene(renderer)) {
                    hands_back = true;
                    retire(&self.loader, &mut self.held, Retired::Scene(stage));
                }
            }
        }
        if self.held.is_none()
            && let Some(walk) = self.loader.walks.pop()
            && let Some(old) = std::mem::replace(&mut self.walk, walk)
        {
            hands_back = true;
            retire(&self.loader, &mut self.held, Retired::Walk(old));
        }
        hands_back
    }
}

impl Plugin for Promenade {
    const NAME: &'static str = "Promenade";
    const VENDOR: &'static str = "Promenade";
    const URL: &'static str = "";
    const EMAIL: &'static str = "";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");

    const AUDIO_IO_LAYOUTS: &'static [AudioIOLayout] = &[
        AudioIOLayout {
            main_input_channels: NonZeroU32::new(2),
            main_output_channels: NonZeroU32::new(2),
            names: PortNames { layout: Some("Stereo to binaural"), ..PortNames::const_default() },
            ..AudioIOLayout::const_default()
        },
        AudioIOLayout {
            main_input_channels: NonZeroU32::new(1),
            main_output_channels: NonZeroU32::new(2),
            names: PortNames { layout: Some("Mono to binaural"), ..PortNames::const_default() },
            ..AudioIOLayout::const_default()
        },
    ];

    const SAMPLE_ACCURATE_AUTOMATION: bool = true;

    type Editor = PromenadeEditor;
    type SysExMessage = ();
    type BackgroundTask = ();

    fn params(&self) -> Arc<dyn Params> {
        Arc::clone(&self.params) as Arc<dyn Params>
    }

    fn editor(&mut self, _async_executor: AsyncExecutor<Self>) -> Option<PromenadeEditor> {
        Some(PromenadeEditor::new(Instance {
            params: Arc::clone(&self.params),
            loader: Arc::clone(&self.loader),
            telemetry: Arc::clone(&self.telemetry),
            osc: Arc::clone(&self.osc),
            repaint: self.loader.repaint.clone(),
        }))
    }

    fn filter_state(state: &mut PluginState) {
        crate::state::migrate(state);
    }

    fn activate(&mut self, layout: &AudioIOLayout, config: &BufferConfig, context: &mut impl ActivateContext<Self>) -> bool {
        let sample_rate_hz = f64::from(config.sample_rate);
        if !(sample_rate_hz.is_finite() && sample_rate_hz >= 1.0) {
            nice_error!("the host's sample rate is {sample_rate_hz} Hz, expected a positive number");
            return false;
        }
        let trusted = context.plugin_api() != PluginApi::Vst3;
        self.pace = Pace::new(config.process_mode == ProcessMode::Offline, trusted);
        self.input_channels = layout.main_input_channels.map_or(0, NonZeroU32::get) as usize;
        let block = (config.max_buffer_size as usize).max(1);
        self.input.iter_mut().for_each(|channel| channel.resize(block, 0.0));
        self.choices = Some(self.params.choices());
        // Hosts activate several times in a row; only another sample rate makes all that was prepared useless.
        if self.spatializer.is_none() || self.sample_rate_hz != sample_rate_hz {
            self.sample_rate_hz = sample_rate_hz;
            self.spatializer = Some(Spatializer::new(sample_rate_hz));
        }
        if self.desk.is_none() {
            match Desk::new(&LOADER, self.loader.clone()) {
                Ok(desk) => self.desk = Some(desk),
                Err(error) => nice_error!("no thread to load scenes while playing: {error}"),
            }
        }
        #[cfg(feature = "standalone")]
        if let Some(Err(error)) = crate::player::player().map(|player| player.set_rate(sample_rate_hz)) {
            nice_error!("{error}");
        }
        self.loader.activate(sample_rate_hz);
        self.osc.activate();
        if let Some(spatializer) = &mut self.spatializer {
            // The sound begins with the scene, not with a fade to it: a bounce starts here.
            match self.loader.stages.pop() {
                Some(Stage::Scene(renderer)) => {
                    spatializer.install(renderer);
                    self.dry = false;
                }
                Some(Stage::Dry) => self.dry = true,
                None => (),
            }
            self.latency = samples(spatializer.latency_samples());
            context.set_latency_samples(self.latency);
        }
        self.fetch();
        true
    }

    fn reset(&mut self) {
        self.jump();
        self.fetch();
        self.jump();
        self.clock = Clock::default();
    }

    fn deactivate(&mut self) {
        self.member.leave();
    }

    fn process(
        &mut self,
        buffer: &mut Buffer,
        _aux: &mut AuxiliaryBuffers,
        context: &mut impl ProcessContext<Self>,
    ) -> ProcessStatus {
        let began = Instant::now();
        let choices = self.params.choices();
        if (self.fetch() | (self.choices != Some(choices)))
            && let Some(desk) = &self.desk
        {
            self.choices = Some(choices);
            desk.call();
        }
        let snapshot = self.params.snapshot();
        let total = buffer.samples();
        let transport = context.transport();
        let (position_s, playing) = match self.play_file(buffer) {
            Some((position_s, playing)) => (Some(position_s), playing),
            None => (transport.pos_seconds(), transport.playing),
        };
        let start_s = self.clock.advance(position_s, playing, total, self.sample_rate_hz);
        self.frame.transport_s = start_s;
        self.frame.playing = playing;
        #[expect(clippy::cast_precision_loss, reason = "a block's length is exact")]
        let block_s = total as f64 / self.sample_rate_hz;
        let mut block = snapshot.block;
        block.live.wait = self.pace.advance(began, block_s);
        if self.dry {
            block.mix = 0.0;
        }
        let moved = self.clock.moved();
        if moved {
            self.glide.jump();
        }
        let leads = self.member.lead(snapshot.group.filter(|_| snapshot.leads));
        let following = match snapshot.group {
            Some(group) if !leads => self.member.follow(group, start_s + block_s, moved),
            _ => None,
        };
        let mut listener = Listener {
            sources: snapshot.sources,
            walk: self.walk.as_deref(),
            tracked: self.inbox.tracked(),
            glide: &mut self.glide,
            following,
            start_s,
            sample_s: self.sample_rate_hz.recip(),
            asked: 0,
        };
        let (Some(spatializer), [left, right]) = (&mut self.spatializer, buffer.as_slice()) else {
            return ProcessStatus::Error("not activated, or not two output channels");
        };
        if moved {
            spatializer.jump();
        }
        let watched = self.telemetry.is_watched();
        // One pass, unless a host breaks its own promise on the block size.
        let longest = self.input[0].len().max(1);
        for start in (0..total).step_by(longest) {
            let span = start..total.min(start + longest);
            let [first, second] = &mut self.input;
            let (first, second) = (&mut first[..span.len()], &mut second[..span.len()]);
            first.copy_from_slice(&left[span.clone()]);
            second.copy_from_slice(&right[span.clone()]);
            if watched {
                louder(&mut self.frame.input_peak, [first, second]);
            }
            let (mono, stereo) = ([&*first], [&*first, &*second]);
            let input: &[&[f32]] = if self.input_channels == 1 { &mono } else { &stereo };
            let output = [&mut left[span.clone()], &mut right[span]];
            spatializer.process(input, output, &block, |i| {
                let pose = listener.pose(start + i);
                self.member.publish(listener.time_s(start + i), &pose);
                Pose { position: pose.position - snapshot.emitter_offset, ..pose }
            });
        }
        let pose = listener.pose(total);
        self.member.publish(start_s + block_s, &pose);
        self.telemetry.pose.write(start_s + block_s, &pose);
        if watched {
            louder(&mut self.frame.output_peak, [left, right]);
            let frame = &mut self.frame;
            (frame.pose, frame.base, frame.tracked) = (pose, listener.base(), listener.is_tracked());
            (frame.leads, frame.dry, frame.offline) = (leads, self.dry, block.live.wait);
            if let Some(renderer) = spatializer.renderer() {
                frame.tier = renderer.played_tier(block.tier);
                frame.show(renderer);
            }
            #[expect(clippy::cast_possible_truncation, reason = "a share of a block's time")]
            frame.add_load((began.elapsed().as_secs_f64() / block_s.max(1e-9)) as f32, block_s as f32);
            // Levels and time alone are shown less often; none is lost, peaks wait for the next picture.
            self.since_told_s += block_s;
            let runs = frame.is_loud() || (frame.playing && self.telemetry.shows_time());
            if (runs && self.since_told_s >= LEVELS_S) || frame.differs_from(&self.told) || self.told_snapshot != Some(snapshot)
            {
                self.told.clone_from(frame);
                (self.told_snapshot, self.since_told_s) = (Some(snapshot), 0.0);
                self.loader.repaint.request_repaint();
            }
            self.telemetry.publish(frame);
            (frame.input_peak, frame.output_peak) = ([0.0; 2], [0.0; 2]);
        }
        let latency = samples(spatializer.latency_samples());
        if latency != self.latency {
            self.latency = latency;
            context.set_latency_samples(latency);
        }
        ProcessStatus::Tail(latency.saturating_add(samples(spatializer.tail_samples())))
    }
}

impl ClapPlugin for Promenade {
    const CLAP_ID: &'static str = "audio.promenade.promenade";
    const CLAP_DESCRIPTION: Option<&'static str> =
        Some("Places a dry track in a captured room, for a listener who walks and turns");
    const CLAP_MANUAL_URL: Option<&'static str> = None;
    const CLAP_SUPPORT_URL: Option<&'static str> = None;
    const CLAP_FEATURES: &'static [ClapFeature] = &[
        ClapFeature::AudioEffect,
        ClapFeature::Stereo,
        ClapFeature::Mono,
        ClapFeature::Reverb,
        ClapFeature::Custom("promenade:spatial"),
    ];
}

impl Vst3Plugin for Promenade {
    const VST3_CLASS_ID: [u8; 16] = *b"PromenadeSpatial";
    const VST3_SUBCATEGORIES: &'static [Vst3SubCategory] = &[Vst3SubCategory::Fx, Vst3SubCategory::Spatial];
}

/// Raises peaks to those of a block.
fn louder(peaks: &mut [f32; 2], channels: [&[f32]; 2]) {
    for (peak, channel) in peaks.iter_mut().zip(channels) {
        *peak = channel.iter().fold(*peak, |most, sample| most.max(sample.abs()));
    }
}

/// A number of samples as hosts take it.
fn samples(count: usize) -> u32 {
    u32::try_from(count).unwrap_or(u32::MAX)
}
