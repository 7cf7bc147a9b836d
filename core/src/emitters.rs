//! One scene played by one emitter, or by two that are given the channels of a stereo sound.

use crate::further::Others;
use crate::number::whole;
use crate::{Further, Pose, RenderError, RenderParams, Renderer, Scene};
use glam::{Quat, Vec3};

/// Samples that are worked on at a time.
const CHUNK: usize = 256;
/// Time in which the right channel goes over from the first emitter to the second or back, seconds.
const FADE_S: f64 = 0.05;

/// Where a scene's sound is played from.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EmitterParams {
    /// How far the emitter is moved from its place in the scene, metres. The room's response to it moves with it.
    pub offset: Vec3,
    /// Angle between the emitters of a stereo sound's channels, radians, 0 to pi; 0 plays the mean of the channels with one
    /// emitter.
    ///
    /// Each is the moved emitter turned by half of the angle about the vertical through the place where the scene starts, the
    /// left channel's counter-clockwise as seen from above. There they are the angle apart and as far as the one emitter; while
    /// the listener walks they stay where they are. A scene without an emitter has no angle.
    pub spread: f32,
}

impl EmitterParams {
    /// The angle of a sound with so many channels in some scene, radians within the limits.
    fn spread_in(&self, scene: &Scene, channels: usize) -> f32 {
        let spread = if self.spread.is_finite() { self.spread.clamp(0.0, std::f32::consts::PI) } else { 0.0 };
        if channels < 2 || scene.emitter().is_none() { 0.0 } else { spread }
    }

    /// How far the emitters of both channels are moved from the scene's emitter, metres.
    fn offsets(&self, scene: &Scene, spread: f32) -> [Vec3; 2] {
        let Some(emitter) = scene.emitter().filter(|_| spread > 0.0) else { return [self.offset; 2] };
        let way = emitter + self.offset - scene.start_pose().position;
        [0.5, -0.5].map(|side| self.offset + Quat::from_rotation_z(side * spread) * way - way)
    }
}

/// The second emitter.
struct Second {
    renderer: Renderer,
    /// Share of the right channel that it plays, 0 to 1; the first one plays the rest.
    share: f32,
    /// Samples since it was given anything.
    idle: usize,
    asleep: bool,
    input: Vec<f32>,
    ears: [Vec<f32>; 2],
}

/// A scene's renderers at one sample rate: one for each emitter.
///
/// Made off the audio thread by a loader; a [`Spatializer`](crate::Spatializer) on the audio thread owns it until the next
/// scene, and it is dropped elsewhere.
///
/// A channel has half of its amplitude, so that a sound which is the same in both is as loud as with one emitter.
pub struct Emitters {
    first: Renderer,
    second: Option<Box<Second>>,
    input: Vec<f32>,
    /// Gain of both ears.
    level: f32,
    /// Change of a share from one sample to the next.
    step: f32,
    fresh: bool,
}

impl From<Renderer> for Emitters {
    fn from(first: Renderer) -> Self {
        let samples = FADE_S * first.grid().sample_rate_hz;
        Self { first, second: None, input: vec![0.0; CHUNK], level: 1.0, step: 1.0 / whole(samples).max(1) as f32, fresh: true }
    }
}

impl From<Box<Renderer>> for Box<Emitters> {
    fn from(first: Box<Renderer>) -> Self {
        Self::new(Emitters::from(*first))
    }
}

impl Emitters {
    /// Adds a renderer of the scene and sample rate for a second emitter ([`Renderer::another`]); without one a
    /// stereo sound is played by one emitter whatever the angle.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    #[must_use]
    pub fn with_second(mut self, renderer: Renderer) -> Self {
        let ears = [vec![0.0; CHUNK], vec![0.0; CHUNK]];
        self.second = Some(Box::new(Second { renderer, share: 0.0, idle: 0, asleep: true, input: vec![0.0; CHUNK], ears }));
        self
    }

    /// Sets a gain of all that is rendered, linear, from 0 on; what is no such number is taken as 1, which changes
    /// nothing.
    #[must_use]
    pub fn with_level(self, gain: f32) -> Self {
        let level = if gain.is_finite() && gain >= 0.0 { gain } else { 1.0 };
        Self { level, ..self }
    }

    /// Adds this many further sources to the room of the one emitter, or of the left channel's
    /// ([`Renderer::with_further`]).
    ///
    /// # Errors
    /// As that has.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn with_further(self, count: usize) -> Result<Self, RenderError> {
        Ok(Self { first: self.first.with_further(count)?, ..self })
    }

    /// The renderer of the one emitter, or of the left channel's.
    #[must_use]
    pub fn first(&self) -> &Renderer {
        &self.first
    }

    /// Whether there is a second emitter.
    #[must_use]
    pub fn has_second(&self) -> bool {
        self.second.is_some()
    }

    /// Bytes of this instance, without the shared scene.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let second = self.second.as_ref().map_or(0, |second| second.renderer.memory_bytes() + CHUNK * 3 * size_of::<f32>());
        self.first.memory_bytes() + second + CHUNK * size_of::<f32>()
    }

    /// Samples until either emitter asks for a pose.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    #[must_use]
    pub fn samples_to_pose(&self) -> usize {
        let second = self.second.as_ref().filter(|second| !second.asleep);
        second.map_or(usize::MAX, |second| second.renderer.samples_to_pose()).min(self.first.samples_to_pose())
    }

    /// Takes the next pose at once, without a crossfade.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn jump(&mut self) {
        self.first.jump();
        self.second.iter_mut().for_each(|second| second.renderer.jump());
    }

    /// Forgets all sound.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn reset(&mut self) {
        self.first.reset();
        self.second.iter_mut().for_each(|second| (second.asleep, second.share) = (true, 0.0));
        self.fresh = true;
    }

    /// Renders one or two channels into both ears, all of one length; of none, silence. `pose_at(i)` is the pose at sample `i`;
    /// it is asked at hops only, by each emitter.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn process(
        &mut self,
        input: &[&[f32]],
        ears: [&mut [f32]; 2],
        params: impl Into<RenderParams>,
        emitters: &EmitterParams,
        pose_at: &mut impl FnMut(usize) -> Pose,
    ) {
        self.process_others(input, Others::NONE, ears, params.into(), emitters, pose_at);
    }

    /// Processes a block with what further sources play ([`Renderer::process_further`]), which the first emitter's room hears.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn process_further(
        &mut self,
        input: &[&[f32]],
        further: &[Further<'_>],
        ears: [&mut [f32]; 2],
        params: impl Into<RenderParams>,
        emitters: &EmitterParams,
        pose_at: &mut impl FnMut(usize) -> Pose,
    ) {
        self.process_others(input, Others { all: further, start: 0 }, ears, params.into(), emitters, pose_at);
    }

    /// Processes a block with what further sources play from some sample of their blocks on.
    pub(crate) fn process_others(
        &mut self,
        input: &[&[f32]],
        others: Others<'_>,
        [left, right]: [&mut [f32]; 2],
        params: RenderParams,
        emitters: &EmitterParams,
        pose_at: &mut impl FnMut(usize) -> Pose,
    ) {
        let (Some(first), Some(last)) = (input.first(), input.last()) else {
            [left, right].into_iter().for_each(|ear| ear.fill(0.0));
            return;
        };
        let spread = emitters.spread_in(self.first.scene(), input.len());
        let offsets = emitters.offsets(self.first.scene(), if self.second.is_some() { spread } else { 0.0 });
        let len = left.len().min(right.len()).min(first.len()).min(last.len());
        for start in (0..len).step_by(CHUNK) {
            let span = start..len.min(start + CHUNK);
            let ears = [&mut left[span.clone()], &mut right[span.clone()]];
            let others = Others { start: others.start + start, ..others };
            let channels = [&first[span.clone()], &last[span]];
            self.chunk(channels, others, ears, params, spread > 0.0, offsets, &mut |i| pose_at(start + i));
        }
        if self.level != 1.0 {
            [left, right].into_iter().flat_map(|ear| &mut ear[..len]).for_each(|sample| *sample *= self.level);
        }
    }

    #[expect(clippy::too_many_arguments, reason = "what a block is made of")]
    fn chunk(
        &mut self,
        [a, b]: [&[f32]; 2],
        others: Others<'_>,
        [left, right]: [&mut [f32]; 2],
        params: RenderParams,
        apart: bool,
        [first_at, second_at]: [Vec3; 2],
        pose_at: &mut impl FnMut(usize) -> Pose,
    ) {
        let n = a.len();
        let mono = &mut self.input[..n];
        let fresh = std::mem::take(&mut self.fresh);
        let playing = self.second.as_mut().filter(|second| apart || !second.asleep);
        let Some(second) = playing else {
            for ((m, a), b) in mono.iter_mut().zip(a).zip(b) {
                *m = 0.5 * (a + b);
            }
            self.first.process_all((mono, first_at), others, [left, right], params, pose_at);
            return;
        };
        if std::mem::take(&mut second.asleep) {
            second.renderer.reset();
        }
        let wanted = if apart { 1.0 } else { 0.0 };
        if fresh {
            second.share = wanted;
        }
        second.idle = if second.share > 0.0 || apart { 0 } else { second.idle.saturating_add(n) };
        let other = &mut second.input[..n];
        for (((m, o), a), b) in mono.iter_mut().zip(&mut *other).zip(a).zip(b) {
            second.share += (wanted - second.share).clamp(-self.step, self.step);
            *m = 0.5 * (a + (1.0 - second.share) * b);
            *o = 0.5 * second.share * b;
        }
        let [other_left, other_right] = &mut second.ears;
        let other_ears = [&mut other_left[..n], &mut other_right[..n]];
        second.renderer.process_all((other, second_at), Others::NONE, other_ears, params, pose_at);
        self.first.process_all((mono, first_at), others, [&mut *left, &mut *right], params, pose_at);
        let mut silent = true;
        for (ear, other) in [left, right].into_iter().zip(&second.ears) {
            for (x, other) in ear.iter_mut().zip(other) {
                *x += other;
                silent &= *other == 0.0;
            }
        }
        let tail = second.renderer.latency_samples() + second.renderer.tail_samples();
        second.asleep = silent && second.idle > tail;
    }
}

impl Renderer {
    /// Another renderer of the same scene, sample rate and carriers, without a decoder.
    ///
    /// # Errors
    /// The scene cannot be played at the sample rate ([`RenderError`]).
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn another(&self) -> Result<Self, RenderError> {
        Self::with_carriers(self.scene().clone(), self.grid().sample_rate_hz, self.carriers())
    }
}
