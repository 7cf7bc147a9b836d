//! One scene at one host rate: mono in, or several sources, both ears out.

use crate::decode::InlineWorker;
use crate::decode::follow::Follower;
use crate::further::{FurtherSources, Others, Together, moved};
use crate::number::whole;
use crate::published::tier::Reference;
use crate::render::at_once::{AtOnce, Hop};
use crate::render::carriers::Carriers;
use crate::render::head::RenderHead;
use crate::render::images::ImageRenderer;
use crate::render::waves::WaveBass;
use crate::scene::{Cost, TooCostly};
use crate::source::{Source, heard_at};
use crate::stft::{Spectrum, Synthesis};
use crate::{DecodeWorker, Further, Latency, Pose, Quality, Scene, StftGrid, Tier, TransferFunction, Trim};
use glam::Vec3;
use promenade_fourier::num_complex::Complex32;
use std::sync::Arc;
use thiserror::Error;

/// Hops over which the room fades when the tier changes.
const TIER_FADE_HOPS: f32 = 8.0;

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
    /// Further sources were asked of a renderer whose direct sound does not wait for a frame.
    #[error("further sources need the latency of a frame")]
    FurtherLatency,
    /// Further sources were asked of a scene that has no table to look their poses up in.
    #[error("further sources need a scene with a field, and this one has a cloud alone")]
    FurtherField,
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
    /// Speed against accuracy.
    pub quality: Quality,
    /// What the user changes about the scene's sound.
    pub trim: Trim,
}

impl<Q: Into<Quality>> From<Q> for RenderParams {
    fn from(quality: Q) -> Self {
        Self { quality: quality.into(), trim: Trim::NEUTRAL }
    }
}

/// Renders a mono stream through one scene at one sample rate, and further ones in the same room.
///
/// Made off the audio thread for a scene and a rate, moved to the audio thread, which owns it, and dropped elsewhere when the
/// scene is changed.
pub struct Renderer {
    scene: Arc<Scene>,
    grid: StftGrid,
    source: Source,
    further: Option<FurtherSources>,
    synthesis: Synthesis,
    head: RenderHead,
    spectrum: Spectrum,
    ears: [Spectrum; 2],
    ready: [Vec<f32>; 2],
    /// Samples of the current hop taken in so far.
    filled: usize,
    follower: Follower,
    /// Level of everything but the direct sound, 0 to 1.
    room_gain: f32,
    /// What the user changes, as it is heard now.
    trim: Trim,
    reference: Option<Reference>,
    images: Option<ImageRenderer>,
    waves: Option<WaveBass>,
    at_once: Option<AtOnce>,
    /// Samples that a host is told that it lags behind.
    stated: usize,
    /// Samples by which what is rendered comes later than that.
    unstated: usize,
    /// Sample of a hop at which the pose is asked for, so that the source's oldest belongs to the centre of the newest frame,
    /// or to its end where the first hops do not wait for it.
    pose_phase: usize,
    /// Hops for which a pose waits until it is rendered.
    pose_hops: usize,
    /// The next pose is jumped to: nothing has been heard yet, or the transport was moved.
    fresh: bool,
}

impl Renderer {
    /// Prepares a scene for a host sample rate.
    ///
    /// # Errors
    /// The scene cannot be played at the sample rate ([`Scene::playable_at`]).
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn new(scene: Arc<Scene>, sample_rate_hz: f64) -> Result<Self, RenderError> {
        Self::with_latency(scene, sample_rate_hz, Latency::Frame)
    }

    /// A renderer with a chosen latency, where the scene has it ([`Latency::played_by`]).
    ///
    /// # Errors
    /// The scene cannot be played at the sample rate ([`Scene::playable_at`]).
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    fn with_latency(scene: Arc<Scene>, sample_rate_hz: f64, latency: Latency) -> Result<Self, RenderError> {
        scene.playable_at(sample_rate_hz)?;
        let carriers = Arc::new(Carriers::with_latency(&scene, sample_rate_hz, latency));
        Self::with_carriers(scene, sample_rate_hz, carriers)
    }

    /// A renderer on carriers that were drawn before, of the scene and rate.
    ///
    /// # Errors
    /// The scene cannot be played at the sample rate ([`Scene::playable_at`]).
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn with_carriers(scene: Arc<Scene>, sample_rate_hz: f64, carriers: Arc<Carriers>) -> Result<Self, RenderError> {
        scene.playable_at(sample_rate_hz)?;
        let grid = scene.grid().at_rate(sample_rate_hz);
        let shape = scene.shape();
        let pace = carriers.pace;
        let images = carriers.images.as_ref().and_then(|filters| ImageRenderer::new(&scene, &grid, filters, &carriers.curve));
        let waves = carriers.waves.as_ref().and_then(|filters| WaveBass::new(&scene, &grid, filters));
        let head = RenderHead::new(grid, scene.grid(), shape, scene.tail(), carriers);
        let spectrum = || vec![Complex32::default(); grid.bins()];
        // A frame is rendered with the pose at its centre. What does not wait for it has the newest there is.
        let centre = if pace.is_short() { 0 } else { grid.window_len() / 2 };
        let reference = if pace.is_short() { None } else { Reference::new(&scene, &grid) };
        Ok(Self {
            stated: reference.as_ref().map_or(pace.latency.stated(&grid), Reference::latency_samples),
            unstated: if pace.latency == Latency::None { grid.lead() } else { 0 },
            at_once: if pace.is_short() { Some(AtOnce::new(&grid, &pace)) } else { None },
            grid,
            source: Source::new(grid, centre / grid.hop),
            further: None,
            synthesis: Synthesis::new(grid),
            follower: Follower::new(&scene, head.filter_hops()),
            head,
            spectrum: spectrum(),
            ears: [spectrum(), spectrum()],
            ready: [vec![0.0; grid.hop], vec![0.0; grid.hop]],
            filled: 0,
            room_gain: 1.0,
            trim: Trim::NEUTRAL,
            reference,
            images,
            waves,
            pose_phase: grid.hop - centre % grid.hop,
            pose_hops: centre / grid.hop,
            fresh: true,
            scene,
        })
    }

    /// A renderer for one tier, with a decoder on the thread that renders where the tier needs one.
    ///
    /// # Errors
    /// The scene cannot be played at the sample rate ([`Scene::playable_at`]).
    ///
    /// # Real-time
    /// Not real-time safe, nor is the processing of the tiers High and Reference: decodes where it stands.
    pub fn for_tier(scene: &Arc<Scene>, sample_rate_hz: f64, tier: Tier) -> Result<Self, RenderError> {
        Self::for_tier_with(scene, sample_rate_hz, tier, Latency::Frame)
    }

    /// A renderer with a chosen latency, where the scene has it ([`Latency::played_by`]).
    ///
    /// # Errors
    /// The scene cannot be played at the sample rate ([`Scene::playable_at`]).
    ///
    /// # Real-time
    /// Not real-time safe, nor is the processing of the tiers High and Reference: decodes where it stands.
    pub fn for_tier_with(scene: &Arc<Scene>, sample_rate_hz: f64, tier: Tier, latency: Latency) -> Result<Self, RenderError> {
        let renderer = Self::with_latency(Arc::clone(scene), sample_rate_hz, latency)?;
        let decoder = if tier >= Tier::High { InlineWorker::new(scene) } else { None };
        Ok(match decoder {
            Some(decoder) => renderer.with_worker(Box::new(decoder)),
            None => renderer,
        })
    }

    /// Adds what decodes poses for the tiers High and Reference; without one they are played as the best tier below.
    ///
    /// # Real-time
    /// Not real-time safe: decodes the scene's start pose.
    #[must_use]
    pub fn with_worker(mut self, worker: Box<dyn DecodeWorker>) -> Self {
        self.follower.set_live(worker, &self.scene, self.grid.hop_s());
        self
    }

    /// Whether further sources can be added.
    ///
    /// # Errors
    /// A renderer with a short latency; a scene without a field.
    pub fn takes_further(&self) -> Result<(), RenderError> {
        if self.at_once.is_some() {
            return Err(RenderError::FurtherLatency);
        }
        if self.scene.field().is_none() {
            return Err(RenderError::FurtherField);
        }
        Ok(())
    }

    /// Adds further sources, [`MOST_FURTHER`](crate::MOST_FURTHER) at most. Each has its own direct sound and early
    /// reflections; what comes later is the room of the first source, which hears each of them as loud as by itself. They are
    /// played in the tiers Draft and Standard.
    ///
    /// # Errors
    /// The scene or the latency allows no further sources ([`Renderer::takes_further`]).
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn with_further(mut self, count: usize) -> Result<Self, RenderError> {
        self.takes_further()?;
        let sources = FurtherSources::new(count, &self.scene, &self.grid, &self.head.carriers(), self.pose_hops);
        self.further = Some(sources).filter(|_| count > 0);
        if self.further.is_some() {
            self.head.wait_for_others();
        }
        Ok(self)
    }

    /// How many further sources there are.
    #[must_use]
    pub fn further(&self) -> usize {
        self.further.as_ref().map_or(0, FurtherSources::count)
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

    /// What the newest pose does to the source, on the scene's grid; time filters may follow a few hops later.
    #[must_use]
    pub fn heard(&self) -> &TransferFunction {
        self.follower.transfer()
    }

    /// What taps are made of, shared by all renderers of the scene at this rate.
    pub(crate) fn carriers(&self) -> Arc<Carriers> {
        self.head.carriers()
    }

    /// Samples by which the output lags the input, the same for all tiers.
    #[must_use]
    pub fn latency_samples(&self) -> usize {
        self.stated
    }

    /// The tier that is played for a wanted one: as [`Scene::played_tier`], but High needs a decoder, and Reference the scene's
    /// own sample rate besides.
    #[must_use]
    pub fn played_tier(&self, wanted: Tier) -> Tier {
        let most = match (self.follower.has_live(), &self.reference) {
            (true, Some(_)) => Tier::Reference,
            (true, None) => Tier::High,
            (false, _) => Tier::Standard,
        };
        self.scene.played_tier(wanted.min(most))
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
        let images = self.images.as_ref().map_or(0, ImageRenderer::tail_samples);
        let waves = self.waves.as_ref().map_or(0, WaveBass::tail_samples);
        let late_s = f64::from(self.scene.tail().longest_t60_s()) * f64::from(trim.bounded().decay);
        let taps = images.max(waves).max(self.head.filter_hops() * self.grid.hop);
        self.unstated + taps + whole(late_s * self.grid.sample_rate_hz)
    }

    /// Bytes of this instance, without the shared scene.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let reference = self.reference.as_ref().map_or(0, Reference::memory_bytes);
        let images = self.images.as_ref().map_or(0, ImageRenderer::memory_bytes);
        let waves = self.waves.as_ref().map_or(0, WaveBass::memory_bytes);
        let at_once = self.at_once.as_ref().map_or(0, AtOnce::memory_bytes);
        let further = self.further.as_ref().map_or(0, FurtherSources::memory_bytes);
        reference
            + images
            + waves
            + at_once
            + further
            + self.head.memory_bytes()
            + (self.grid.bins() * 3 * 8)
            + self.grid.n_fft * 5 * 4
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
        self.source.reset();
        self.synthesis.reset();
        self.head.reset();
        self.follower.reset();
        if let Some(further) = &mut self.further {
            further.reset();
        }
        if let Some(reference) = &mut self.reference {
            reference.reset();
        }
        if let Some(images) = &mut self.images {
            images.reset();
        }
        if let Some(waves) = &mut self.waves {
            waves.reset();
        }
        if let Some(at_once) = &mut self.at_once {
            at_once.reset();
        }
        self.ready.iter_mut().for_each(|r| r.fill(0.0));
        self.filled = 0;
        self.jump();
    }

    /// Renders `input` into both ears, all of one length. `pose_at(i)` is the pose at sample `i`; it is asked at hops only.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn process(
        &mut self,
        input: &[f32],
        ears: [&mut [f32]; 2],
        params: impl Into<RenderParams>,
        pose_at: &mut impl FnMut(usize) -> Pose,
    ) {
        self.process_all((input, Vec3::ZERO), Others::NONE, ears, params.into(), pose_at);
    }

    /// Renders a block with what further sources play ([`Renderer::with_further`]), in their order. Sources without a sound are
    /// silent, and sounds without a source are not heard.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn process_further(
        &mut self,
        input: &[f32],
        further: &[Further<'_>],
        ears: [&mut [f32]; 2],
        params: impl Into<RenderParams>,
        pose_at: &mut impl FnMut(usize) -> Pose,
    ) {
        self.process_all((input, Vec3::ZERO), Others { all: further, start: 0 }, ears, params.into(), pose_at);
    }

    /// Renders a block with an emitter that is moved by an offset, metres.
    pub(crate) fn process_all(
        &mut self,
        (input, offset): (&[f32], Vec3),
        others: Others<'_>,
        [left, right]: [&mut [f32]; 2],
        RenderParams { quality, trim }: RenderParams,
        pose_at: &mut impl FnMut(usize) -> Pose,
    ) {
        let trim = trim.bounded();
        self.source.aim(trim.low_cut_hz, self.fresh);
        if let Some(further) = &mut self.further {
            further.aim(trim.low_cut_hz, self.fresh);
        }
        debug_assert!(input.len() == left.len() && input.len() == right.len());
        if self.fresh && !input.is_empty() {
            let listener = pose_at(0);
            let pose = self.source.jump(moved(listener, offset));
            if let Some(further) = &mut self.further {
                further.jump(&others, listener);
            }
            let tier = self.follow(pose, &quality, &trim, true);
            if let Some(reference) = &mut self.reference {
                reference.jump(tier == Tier::Reference);
            }
            if self.at_once.as_ref().is_some_and(|at_once| !at_once.has_begun()) {
                self.begin_hop(pose, tier, &heard_at(&self.trim, &self.scene, &pose));
            }
            self.fresh = false;
        }
        let mut done = 0;
        while done < input.len() {
            let stop = if self.filled < self.pose_phase { self.pose_phase } else { self.grid.hop };
            let room = self.at_once.as_ref().map_or(usize::MAX, AtOnce::room);
            let count = (stop - self.filled).min(input.len() - done).min(room);
            let (span, block) = (self.filled..self.filled + count, done..done + count);
            self.source.take(span.clone(), &input[block.clone()]);
            if let Some(further) = &mut self.further {
                further.take(span.clone(), &others, block.clone());
            }
            for (out, ready) in [&mut *left, &mut *right].into_iter().zip(&self.ready) {
                out[block.clone()].copy_from_slice(&ready[span.clone()]);
            }
            if let Some(at_once) = &mut self.at_once {
                let ears = [&mut left[block.clone()], &mut right[block]];
                at_once.take(self.source.newest(), span, self.waves.as_mut(), self.images.as_mut(), ears);
            }
            done += count;
            self.filled += count;
            if self.filled == self.pose_phase {
                let listener = pose_at(done - 1);
                self.source.note_pose(moved(listener, offset));
                if let Some(further) = &mut self.further {
                    further.note_pose(&others, listener);
                }
            }
            if self.filled == self.grid.hop {
                self.filled = 0;
                self.hop(&quality, &trim);
            }
        }
    }

    /// Brings the head to a pose and to what the user changes, and fades its room in or out; `whole` leaves nothing for the
    /// hops to come. Says what is played.
    fn follow(&mut self, pose: Pose, wanted: &Quality, trim: &Trim, whole: bool) -> Tier {
        if whole {
            self.trim = *trim;
        } else {
            self.trim.follow(trim);
        }
        if self.head.set_decay(self.trim.decay) {
            self.follower.refresh();
        }
        let quality = Quality { tier: self.played_tier(wanted.tier), ..*wanted };
        let change = self.follower.follow(&pose, &quality, whole, self.room_gain > 0.0);
        let room = quality.tier != Tier::Draft;
        self.head.face(pose.orientation, whole);
        self.head.update(self.follower.transfer(), &change, room);
        let step = if whole { 1.0 } else { 1.0 / TIER_FADE_HOPS };
        if room && self.room_gain == 0.0 {
            // The late part stood still meanwhile: what is left in it belongs to another time.
            self.head.forget_late();
        }
        self.room_gain += (if room { 1.0 } else { 0.0 } - self.room_gain).clamp(-step, step);
        quality.tier
    }

    /// Begins a hop of what does not wait for a frame.
    fn begin_hop(&mut self, from: Pose, tier: Tier, trim: &Trim) {
        let Some(at_once) = &mut self.at_once else { return };
        let hop = Hop { from, to: self.source.pose(), trim: *trim, draft: tier == Tier::Draft };
        at_once.begin(hop, self.head.joined(self.room_gain, trim), self.waves.as_mut());
    }

    fn hop(&mut self, quality: &Quality, trim: &Trim) {
        let (before, pose) = (self.source.step(), self.source.pose());
        let tier = self.follow(pose, quality, trim, false);
        if let Some(reference) = &mut self.reference {
            reference.note_input(self.source.newest());
        }
        let trim = heard_at(&self.trim, &self.scene, &pose);
        let waits = self.at_once.is_none();
        // What is given out with a frame is that of the frame before, nearly: its images belong to the pose of that time.
        let newest = self.source.newest();
        if let Some(waves) = self.waves.as_mut().filter(|_| waits) {
            waves.begin(&before, &trim);
            waves.take(newest, 0);
        }
        if let Some(images) = self.images.as_mut().filter(|_| waits) {
            images.take(newest, &before, tier == Tier::Draft, &trim);
        }
        self.source.analyse(&mut self.spectrum);
        let together =
            Together { scene: &self.scene, quality: Quality { tier, ..*quality }, trim: &self.trim, room_gain: self.room_gain };
        let shared = self.follower.transfer();
        let others = self.further.as_mut().and_then(|all| all.hop(together, &mut self.head, shared, self.images.as_mut()));
        let [left, right] = &mut self.ears;
        if self.head.render(&self.spectrum, self.room_gain, &trim, others, [left, right]).is_some() {
            for (ear, (spectrum, ready)) in self.ears.iter_mut().zip(&mut self.ready).enumerate() {
                self.synthesis.synthesise(ear, spectrum, ready);
            }
        } else {
            for (ear, ready) in self.ready.iter_mut().enumerate() {
                self.synthesis.give_out(ear, ready);
            }
        }
        if let Some(images) = self.images.as_mut().filter(|_| waits) {
            images.add_to(&mut self.ready);
        }
        if let Some(waves) = self.waves.as_ref().filter(|_| waits) {
            waves.add_to(0, self.ready.each_mut().map(|ear| &mut ear[..]));
        }
        if let Some(further) = &self.further {
            further.add_waves(&mut self.ready);
        }
        self.begin_hop(before, tier, &trim);
        if let Some(reference) = &mut self.reference {
            let frame = self.follower.decoded().and_then(|d| d.published.as_ref());
            reference.finish(tier == Tier::Reference, 1.0 / TIER_FADE_HOPS, frame, &mut self.ready);
        }
    }
}
