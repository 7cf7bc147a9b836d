//! One scene at one host rate: the sounds of some voices in, both ears out.

use crate::decode::InlineWorker;
use crate::latency::Pace;
use crate::number::whole;
use crate::published::head::PublishedHead;
use crate::render::carriers::Carriers;
use crate::render::early::first_hops::Undelayed;
use crate::render::early::images::{ImageFilters, ImageVoices};
use crate::render::head::bus::AmbisonicBus;
use crate::render::low::wave_field::WaveBass;
use crate::render::part::{Heard, Part};
use crate::render::room::Room;
use crate::render::voice_filters::Plan;
use crate::scene::{Cost, TooCostly};
use crate::stft::{Spectrum, Synthesis};
use crate::voice::{MOST_VOICES, Together, VOICE_PORTIONS, Voice, VoiceState, own_taps};
use crate::{DecodeWorker, Latency, LiveParams, Pose, Scene, StftGrid, TransferFunction, Trim};
use promenade_fourier::num_complex::Complex32;
use std::sync::Arc;
use thiserror::Error;

/// One part of so many of a hop after a frame is free of work for the next.
const FREE: usize = 4;

/// Host rates that are supported, Hz.
pub const SAMPLE_RATES_HZ: std::ops::RangeInclusive<f64> = 2_000.0..=768_000.0;

/// Why a scene cannot be rendered.
#[derive(Debug, Error, PartialEq)]
pub enum RenderError {
    /// The host's sample rate is outside [`SAMPLE_RATES_HZ`].
    #[error(
        "a sample rate of {found} Hz is not supported, expected {} to {} Hz",
        SAMPLE_RATES_HZ.start(),
        SAMPLE_RATES_HZ.end()
    )]
    SampleRate {
        /// The rate asked for, Hz.
        found: f64,
    },
    /// It would take too much at that rate.
    #[error(transparent)]
    Cost(#[from] TooCostly),
    /// Several voices were asked of a scene that has no table to look their poses up in, and not all of them have a decoder.
    #[error("several voices need a scene with a field, and this one has a cloud alone")]
    Voices,
}

impl Scene {
    /// Whether it can be played at a host's sample rate, from its sizes alone.
    ///
    /// # Errors
    /// A rate outside [`SAMPLE_RATES_HZ`]; a scene that would take too much memory or work there.
    pub fn playable_at(&self, sample_rate_hz: f64) -> Result<(), RenderError> {
        if !SAMPLE_RATES_HZ.contains(&sample_rate_hz) {
            return Err(RenderError::SampleRate { found: sample_rate_hz });
        }
        let grid = self.grid().at_rate(sample_rate_hz);
        Ok(Cost::new(self.parts(), &grid).check(&grid)?)
    }
}

/// How a stream is rendered.
///
/// Made by the caller for each block and passed by reference; nothing keeps it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RenderParams {
    /// How often a live decoder is asked.
    pub live: LiveParams,
    /// What the user changes about the scene's sound.
    pub trim: Trim,
}

impl From<LiveParams> for RenderParams {
    fn from(live: LiveParams) -> Self {
        Self { live, trim: Trim::NEUTRAL }
    }
}

/// What a renderer is made of besides its scene. A sample rate alone, Hz, is one of one voice, whose latency is a frame.
pub struct RendererConfig {
    /// Of the host, Hz.
    pub sample_rate_hz: f64,
    /// How late it is, where the scene can be played so ([`Latency::played_by`]) and `carriers` do not say it.
    pub latency: Latency,
    /// Of the scene and rate, where other renderers have them already; they have a latency of their own.
    pub carriers: Option<Arc<Carriers>>,
    /// How many voices there are, 1 to [`MOST_VOICES`].
    pub voices: usize,
    /// What decodes the poses of a scene with an anchor cloud, for the first voice and the next. A voice without one is played
    /// from the scene's table.
    pub workers: Vec<Box<dyn DecodeWorker>>,
    /// Samples of a hop that have passed when it begins. Renderers that play side by side in real time, each with another, do
    /// not all have a frame to render in the same block.
    pub phase: usize,
}

impl From<f64> for RendererConfig {
    fn from(sample_rate_hz: f64) -> Self {
        Self { sample_rate_hz, latency: Latency::Frame, carriers: None, voices: 1, workers: Vec::new(), phase: 0 }
    }
}

impl RendererConfig {
    /// Of some voices, each with a decoder on the thread that renders where the scene has a cloud.
    #[must_use]
    pub fn inline(scene: &Arc<Scene>, sample_rate_hz: f64, voices: usize) -> Self {
        Self { voices, workers: InlineWorker::several(scene, voices), ..sample_rate_hz.into() }
    }
}

impl From<(f64, Arc<Carriers>)> for RendererConfig {
    /// On carriers that were drawn before, of the scene and rate.
    fn from((sample_rate_hz, carriers): (f64, Arc<Carriers>)) -> Self {
        Self { carriers: Some(carriers), ..sample_rate_hz.into() }
    }
}

/// Renders the sounds of voices through one scene at one sample rate.
///
/// Each voice has its own direct sound and early reflections. What comes later is one room for all of them, which hears each as
/// loud as by itself; it is heard from the place of the first voice.
///
/// Made off the audio thread for a scene and a rate, moved to the audio thread, which owns it, and dropped elsewhere when the
/// scene is changed.
pub struct Renderer {
    scene: Arc<Scene>,
    grid: StftGrid,
    pace: Pace,
    voices: Vec<VoiceState>,
    room: Room,
    images: AmbisonicBus,
    synthesis: Synthesis,
    spectrum: Spectrum,
    ears: [Spectrum; 2],
    ready: [Vec<f32>; 2],
    /// What parts of voices that wait for a frame are heard as.
    parts: [Vec<f32>; 2],
    /// What comes out so many samples later, and where.
    waiting: Vec<[f32; 2]>,
    waiting_at: usize,
    /// Samples of the current hop taken in so far, and when it begins.
    filled: usize,
    phase: usize,
    /// What the user changes, as it is heard now.
    trim: Trim,
    /// Hops since all filters were brought to a pose.
    share: usize,
    /// Samples that a host is told that it lags behind.
    stated: usize,
    /// Samples by which what is rendered comes later than that.
    unstated: usize,
    /// Sample of a hop at which the pose is asked for, so that the source's oldest belongs to the centre of the newest frame,
    /// or to its end where the first hops do not wait for it.
    pose_phase: usize,
    /// A hop has begun since it was new.
    has_begun: bool,
    /// Portions of the hop that is taken in that have been worked out.
    prepared: usize,
    /// The next pose is jumped to: nothing has been heard yet, or the transport was moved.
    fresh: bool,
}

impl Renderer {
    /// Prepares a scene.
    ///
    /// # Errors
    /// The scene cannot be played at the sample rate ([`Scene::playable_at`]), or not with as many voices.
    ///
    /// # Real-time
    /// Not real-time safe: allocates, and decodes the scene's start pose for each decoder.
    pub fn new(scene: Arc<Scene>, config: impl Into<RendererConfig>) -> Result<Self, RenderError> {
        let RendererConfig { sample_rate_hz, latency, carriers, voices: count, workers, phase } = config.into();
        scene.playable_at(sample_rate_hz)?;
        let count = count.clamp(1, MOST_VOICES);
        if count > workers.len().max(1) && scene.field().is_none() {
            return Err(RenderError::Voices);
        }
        let carriers = carriers.unwrap_or_else(|| Arc::new(Carriers::with_latency(&scene, sample_rate_hz, latency)));
        let grid = scene.grid().at_rate(sample_rate_hz);
        let (shape, pace) = (scene.shape(), carriers.pace);
        let own_taps = own_taps(count, &shape);
        let plan = Plan { grid: &grid, scene_grid: scene.grid(), shape, tail: scene.tail(), carriers: &carriers, own_taps };
        // A frame is rendered with the pose at its centre. What does not wait for it has the newest there is.
        let centre = if pace.is_short() { 0 } else { grid.window_len() / 2 };
        let decoders = workers.len();
        let published = |number: usize| {
            let has_one = !pace.is_short() && number < decoders;
            if has_one { PublishedHead::new(&scene, &grid, number == 0) } else { None }
        };
        let stated = published(0).as_ref().map_or(pace.latency.stated(&grid), PublishedHead::latency_samples);
        let voice = |number: usize| {
            // Waves leave the others the upper half of what they take.
            let waves = carriers.waves.as_ref().and_then(|filters| WaveBass::new(&scene, &grid, filters));
            let images = carriers.images.as_ref();
            let images = images.and_then(|filters| ImageVoices::new(&scene, &grid, filters, &carriers.curve));
            let early = if pace.is_short() { Some(Undelayed::new(&grid, &pace)) } else { None };
            let parts = [boxed(published(number)), boxed(waves), boxed(early), boxed(images)];
            VoiceState::new(&plan, &scene, parts.into_iter().flatten().collect(), centre / grid.hop, number == 0)
        };
        let mut voices: Vec<_> = (0..count).map(voice).collect();
        for (voice, worker) in voices.iter_mut().zip(workers) {
            voice.set_worker(worker, &scene, grid.hop_s());
        }
        let spectrum = || vec![Complex32::default(); grid.bins()];
        let hop = || [vec![0.0; grid.hop], vec![0.0; grid.hop]];
        let waits = if pace.is_short() { pace.latency.stated(&grid).saturating_sub(grid.lead()) } else { 0 };
        Ok(Self {
            voices,
            room: Room::new(&plan),
            images: ImageFilters::bus(carriers.images.as_deref().filter(|_| scene.emitter().is_some())),
            synthesis: Synthesis::new(grid),
            spectrum: spectrum(),
            ears: [spectrum(), spectrum()],
            ready: hop(),
            parts: hop(),
            waiting: vec![[0.0; 2]; waits],
            waiting_at: 0,
            filled: phase % grid.hop,
            phase: phase % grid.hop,
            trim: Trim::NEUTRAL,
            share: 0,
            stated,
            unstated: if pace.latency == Latency::None { grid.lead() } else { 0 },
            pose_phase: grid.hop - centre % grid.hop,
            has_begun: false,
            prepared: 0,
            fresh: true,
            pace,
            grid,
            scene,
        })
    }

    /// How many voices there are.
    #[must_use]
    pub fn voices(&self) -> usize {
        self.voices.len()
    }

    /// The scene that is played.
    #[must_use]
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// The grid at the host's rate.
    #[must_use]
    pub fn grid(&self) -> &StftGrid {
        &self.grid
    }

    /// What taps are made of, shared by all renderers of the scene at this rate.
    #[must_use]
    pub fn carriers(&self) -> &Arc<Carriers> {
        self.room.carriers()
    }

    /// The voice that is always there, from whose place the room is heard.
    fn first(&self) -> &VoiceState {
        &self.voices[0]
    }

    /// What the newest pose does to the first voice, on the scene's grid; time filters may follow a few hops later.
    #[must_use]
    pub fn heard(&self) -> &TransferFunction {
        self.first().follower().transfer()
    }

    /// Samples by which the output lags the input.
    #[must_use]
    pub fn latency_samples(&self) -> usize {
        self.stated
    }

    /// Samples for which the room sounds on after the input has ended, down to -60 dB and beyond the explicit taps, with the
    /// decay that was heard last.
    #[must_use]
    pub fn tail_samples(&self) -> usize {
        self.tail_samples_with(&self.trim)
    }

    /// Samples that sound goes on after its end, with the decay of a trim.
    #[must_use]
    pub fn tail_samples_with(&self, trim: &Trim) -> usize {
        let late_s = f64::from(self.scene.tail().longest_t60_s()) * f64::from(trim.bounded().decay);
        let taps = self.first().tail_samples().max(self.room.filter_hops(self.first().as_ref()) * self.grid.hop);
        self.unstated + taps + whole(late_s * self.grid.sample_rate_hz)
    }

    /// Bytes of this instance, without the shared scene.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        self.voices.iter().map(VoiceState::memory_bytes).sum::<usize>()
            + self.room.memory_bytes()
            + self.images.memory_bytes()
            + size_of_val(&*self.waiting)
            + self.grid.bins() * 3 * 8
            + self.grid.n_fft * 7 * 4
    }

    /// Takes the next pose at once instead of following to it; what sounds goes on.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn jump(&mut self) {
        self.fresh = true;
    }

    /// Samples that are still to come in before the next pose is asked for, that of the last of them: 1 at least. Who moves
    /// emitters renders no more at a time, and has them where they are at that sample.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    #[must_use]
    pub fn samples_to_pose(&self) -> usize {
        if self.fresh {
            // The first sample's pose is asked for too.
            return 1;
        }
        let next = if self.filled < self.pose_phase { self.pose_phase } else { self.grid.hop + self.pose_phase };
        next - self.filled
    }

    /// Is as new again: the same sound and poses give the same samples.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn reset(&mut self) {
        self.voices.iter_mut().for_each(VoiceState::reset);
        self.room.reset();
        self.images.reset();
        self.synthesis.reset();
        self.ready.iter_mut().for_each(|r| r.fill(0.0));
        self.waiting.fill([0.0; 2]);
        self.images.forget_prepared();
        (self.waiting_at, self.filled, self.share, self.has_begun) = (0, self.phase, 0, false);
        self.prepared = 0;
        self.jump();
    }

    /// Renders a block of what voices play, in their order, into both ears of one length. `pose_at(i)` is the pose at sample
    /// `i`; it is asked at hops only. Voices without a sound are silent, and sounds without a voice are not heard.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn process(
        &mut self,
        sounds: &[Voice<'_>],
        [left, right]: [&mut [f32]; 2],
        params: impl Into<RenderParams>,
        pose_at: &mut dyn FnMut(usize) -> Pose,
    ) {
        let RenderParams { live, trim } = params.into();
        let (trim, len) = (trim.bounded(), left.len().min(right.len()));
        let sound = |number: usize| sounds.get(number).copied().unwrap_or_default();
        if self.fresh && len > 0 {
            self.arrive(sounds, pose_at(0), &live, &trim);
        }
        let mut done = 0;
        while done < len {
            let stop = if self.filled < self.pose_phase { self.pose_phase } else { self.grid.hop };
            let count = (stop - self.filled).min(len - done).min(self.pace.block - self.filled % self.pace.block);
            let (span, block) = (self.filled..self.filled + count, done..done + count);
            for (number, voice) in self.voices.iter_mut().enumerate() {
                voice.take(span.clone(), &sound(number).span(block.clone()), trim.low_cut_hz);
            }
            for (out, ready) in [&mut *left, &mut *right].into_iter().zip(&self.ready) {
                out[block.clone()].copy_from_slice(&ready[span.clone()]);
            }
            if self.pace.is_short() {
                self.play(span, [&mut left[block.clone()], &mut right[block]], &live);
            }
            done += count;
            self.filled += count;
            if self.filled == self.pose_phase {
                let listener = pose_at(done - 1);
                for (number, voice) in self.voices.iter_mut().enumerate() {
                    voice.note_pose(sound(number).moved(listener));
                }
            }
            if self.filled == self.grid.hop {
                self.filled = 0;
                self.hop(&live, &trim);
            }
        }
        // In blocks as long as a hop each has its share of the work already.
        if len < self.grid.hop && !self.pace.is_short() {
            self.prepare(&live, &trim);
        }
    }

    /// Works out so much of the frame to come as the hop has of its samples, of what needs none of them: short blocks have an
    /// equal share of the work, but for those just after a frame.
    fn prepare(&mut self, live: &LiveParams, trim: &Trim) {
        let rest = self.grid.hop - self.grid.hop / FREE;
        let taken = (self.filled + rest).saturating_sub(self.grid.hop);
        let portions = 2 + self.voices.len() * VOICE_PORTIONS;
        if self.first().next_pose().is_none() {
            return;
        }
        while self.prepared < portions * taken / rest {
            self.prepared += 1;
            let Some(portion) = self.prepared.checked_sub(2) else {
                self.follow(live, trim, false);
                continue;
            };
            let together = together(&self.scene, live, &self.trim, self.share);
            match self.voices.get_mut(portion / VOICE_PORTIONS) {
                Some(voice) => {
                    let [left, right] = &mut self.parts;
                    let mut heard = Heard { ears: [left, right], images: &mut self.images };
                    voice.prepare(portion % VOICE_PORTIONS, &together, &mut heard);
                }
                None => self.images.end_early(self.trim.width),
            }
        }
    }

    /// Is at a pose of the listener at once.
    fn arrive(&mut self, sounds: &[Voice<'_>], listener: Pose, live: &LiveParams, trim: &Trim) {
        for (number, voice) in self.voices.iter_mut().enumerate() {
            voice.jump(sounds.get(number).copied().unwrap_or_default().moved(listener));
        }
        self.images.forget_prepared();
        self.prepared = 0;
        self.follow(live, trim, true);
        let first = &mut self.voices[0];
        if self.pace.is_short() && !std::mem::replace(&mut self.has_begun, true) {
            first.begin(Some(first.pose()));
        }
        self.fresh = false;
    }

    /// Brings the first voice and the room to the pose and to what the user changes; `whole` leaves nothing for the hops to
    /// come.
    fn follow(&mut self, live: &LiveParams, trim: &Trim, whole: bool) {
        if whole {
            self.trim = *trim;
        } else {
            self.trim.follow(trim);
        }
        let first = &mut self.voices[0];
        let together = together(&self.scene, live, &self.trim, self.share);
        let change = first.follow(&together, whole);
        self.share = if whole { 0 } else { self.share };
        self.room.set_decay(self.trim.decay);
        self.room.face(first.next_pose().unwrap_or(first.pose()).orientation, whole);
        self.room.update(first.follower().transfer(), &change);
    }

    /// Plays samples of the hop that do not wait for a frame.
    fn play(&mut self, span: std::ops::Range<usize>, [left, right]: [&mut [f32]; 2], live: &LiveParams) {
        let together = together(&self.scene, live, &self.trim, self.share);
        for voice in &mut self.voices {
            let mut heard = Heard { ears: [&mut *left, &mut *right], images: &mut self.images };
            voice.play(span.clone(), &together, &mut heard);
        }
        self.images.add_to(span.start % self.pace.block, [&mut *left, &mut *right]);
        if span.end.is_multiple_of(self.pace.block) {
            self.images.end_block(self.trim.width);
        }
        if self.waiting.is_empty() {
            return;
        }
        for (left, right) in left.iter_mut().zip(right) {
            let waited = std::mem::replace(&mut self.waiting[self.waiting_at], [*left, *right]);
            [*left, *right] = waited;
            self.waiting_at = (self.waiting_at + 1) % self.waiting.len();
        }
    }

    /// Renders the frame that ends with the hop that is taken in.
    fn hop(&mut self, live: &LiveParams, trim: &Trim) {
        if std::mem::take(&mut self.prepared) == 0 {
            self.follow(live, trim, false);
        }
        let together = together(&self.scene, live, &self.trim, self.share);
        self.parts.iter_mut().for_each(|ear| ear.fill(0.0));
        let (mut silent, mut changed) = (true, false);
        for number in 0..self.voices.len() {
            let (before, voices) = self.voices.split_at_mut(number);
            let [left, right] = &mut self.parts;
            let mut heard = Heard { ears: [left, right], images: &mut self.images };
            let waits = if self.pace.is_short() { None } else { Some(&mut heard) };
            let shared = before.first().map(|first| first.follower().transfer());
            if let Some(voice) = voices.first_mut() {
                changed |= voice.end_hop(&together, shared, waits, &mut self.spectrum);
                silent &= !voice.as_ref().is_heard || self.spectrum.iter().all(|x| x.re == 0.0 && x.im == 0.0);
            }
        }
        self.share = self.share.wrapping_add(1);
        if changed {
            self.room.forget_ahead();
        }
        let ears = self.ears.each_mut().map(|ear| &mut ear[..]);
        let sounds = self.room.render(&mut self.voices, silent, &self.trim, ears).is_some();
        for (ear, (spectrum, ready)) in self.ears.iter_mut().zip(&mut self.ready).enumerate() {
            match sounds {
                true => self.synthesis.synthesise(ear, spectrum, ready),
                false => self.synthesis.give_out(ear, ready),
            }
        }
        if self.pace.is_short() {
            for voice in self.voices.iter_mut().filter(|voice| voice.as_ref().is_heard) {
                voice.begin(None);
            }
            return;
        }
        self.images.end_block(self.trim.width);
        self.images.add_to(0, self.ready.each_mut().map(|ear| &mut ear[..]));
        for (ready, parts) in self.ready.iter_mut().zip(&self.parts) {
            ready.iter_mut().zip(parts).for_each(|(ready, x)| *ready += x);
        }
        self.voices.iter_mut().for_each(|voice| voice.finish(&mut self.ready));
    }
}

fn boxed<'a>(part: Option<impl Part + 'a>) -> Option<Box<dyn Part + 'a>> {
    part.map(|part| Box::new(part) as Box<dyn Part>)
}

/// What holds for all voices at a hop.
fn together<'a>(scene: &'a Scene, live: &LiveParams, trim: &'a Trim, share: usize) -> Together<'a> {
    Together { scene, live: *live, trim, share }
}
