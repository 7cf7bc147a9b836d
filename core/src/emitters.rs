//! One scene played by one emitter, or by two that are given the channels of a stereo sound.

use crate::number::whole;
use crate::{MOST_VOICES, Pose, RenderParams, Renderer, Scene, Voice};
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

/// A voice of its own for the right channel.
#[derive(Default)]
struct Second {
    /// Share of the right channel that it plays, 0 to 1; the first one plays the rest.
    share: f32,
    input: Vec<f32>,
}

/// A scene's renderer, the sound of whose first voice has one channel, or two with a voice for each.
///
/// Made off the audio thread by a loader; a [`Spatializer`](crate::Spatializer) on the audio thread owns it until the next
/// scene, and it is dropped elsewhere.
///
/// A channel has half of its amplitude, so that a sound which is the same in both is as loud as with one emitter.
pub struct Emitters {
    renderer: Renderer,
    second: Option<Second>,
    input: Vec<f32>,
    /// Gain of both ears.
    level: f32,
    /// Change of a share from one sample to the next.
    step: f32,
    fresh: bool,
}

impl From<Renderer> for Emitters {
    fn from(renderer: Renderer) -> Self {
        let samples = FADE_S * renderer.grid().sample_rate_hz;
        let step = 1.0 / whole(samples).max(1) as f32;
        Self { renderer, second: None, input: vec![0.0; CHUNK], level: 1.0, step, fresh: true }
    }
}

impl From<Box<Renderer>> for Box<Emitters> {
    fn from(renderer: Box<Renderer>) -> Self {
        Self::new(Emitters::from(*renderer))
    }
}

impl Emitters {
    /// Lets the renderer's second voice play the right channel of a stereo sound; otherwise one voice plays both, whatever the
    /// angle between them. A renderer of one voice stays as it is.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    #[must_use]
    pub fn with_second(mut self) -> Self {
        self.second = Some(Second { share: 0.0, input: vec![0.0; CHUNK] }).filter(|_| self.renderer.voices() > 1);
        self
    }

    /// Sets a gain of all that is rendered, linear, from 0 on; what is no such number is taken as 1, which changes
    /// nothing.
    #[must_use]
    pub fn with_level(self, gain: f32) -> Self {
        let level = if gain.is_finite() && gain >= 0.0 { gain } else { 1.0 };
        Self { level, ..self }
    }

    /// What renders the voices.
    #[must_use]
    pub fn renderer(&self) -> &Renderer {
        &self.renderer
    }

    /// Bytes of this instance, without the shared scene.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let second = self.second.as_ref().map_or(0, |second| second.input.len());
        self.renderer.memory_bytes() + (self.input.len() + second) * size_of::<f32>()
    }

    /// Samples until a pose is asked for.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    #[must_use]
    pub fn samples_to_pose(&self) -> usize {
        self.renderer.samples_to_pose()
    }

    /// Takes the next pose at once, without a crossfade.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn jump(&mut self) {
        self.renderer.jump();
    }

    /// Forgets all sound.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn reset(&mut self) {
        self.renderer.reset();
        self.fresh = true;
    }

    /// Renders one or two channels, and what further voices play, into both ears, all of one length; of no channels, silence.
    /// `pose_at(i)` is the pose at sample `i`; it is asked at hops only.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn process(
        &mut self,
        input: &[&[f32]],
        further: &[Voice<'_>],
        [left, right]: [&mut [f32]; 2],
        params: impl Into<RenderParams>,
        emitters: &EmitterParams,
        pose_at: &mut dyn FnMut(usize) -> Pose,
    ) {
        let (Some(first), Some(last)) = (input.first(), input.last()) else {
            [left, right].into_iter().for_each(|ear| ear.fill(0.0));
            return;
        };
        let params = params.into();
        let spread = emitters.spread_in(self.renderer.scene(), input.len());
        let offsets = emitters.offsets(self.renderer.scene(), if self.second.is_some() { spread } else { 0.0 });
        let len = left.len().min(right.len()).min(first.len()).min(last.len());
        let wanted = if spread > 0.0 { 1.0 } else { 0.0 };
        if std::mem::take(&mut self.fresh) {
            self.second.iter_mut().for_each(|second| second.share = wanted);
        }
        for start in (0..len).step_by(CHUNK) {
            let span = start..len.min(start + CHUNK);
            let mono = &mut self.input[..span.len()];
            let channels = first[span.clone()].iter().zip(&last[span.clone()]);
            let mut voices = [Voice::default(); MOST_VOICES];
            let mut count = 1;
            match &mut self.second {
                Some(second) => {
                    let plays = wanted > 0.0 || second.share > 0.0;
                    let other = &mut second.input[..span.len()];
                    for ((m, o), (a, b)) in mono.iter_mut().zip(&mut *other).zip(channels) {
                        second.share += (wanted - second.share).clamp(-self.step, self.step);
                        *m = 0.5 * (a + (1.0 - second.share) * b);
                        *o = 0.5 * second.share * b;
                    }
                    let input = if plays { &*other } else { &[] };
                    voices[1] = Voice { input, offset: offsets[1], ..Voice::default() };
                    count = 2;
                }
                None => mono.iter_mut().zip(channels).for_each(|(m, (a, b))| *m = 0.5 * (a + b)),
            }
            voices[0] = Voice { input: mono, offset: offsets[0], ..Voice::default() };
            for (voice, further) in voices[count..].iter_mut().zip(further) {
                *voice = further.span(span.clone());
                count += 1;
            }
            let ears = [&mut left[span.clone()], &mut right[span]];
            self.renderer.process(&voices[..count.min(MOST_VOICES)], ears, params, &mut |i| pose_at(start + i));
        }
        if self.level != 1.0 {
            [left, right].into_iter().flat_map(|ear| &mut ear[..len]).for_each(|sample| *sample *= self.level);
        }
    }
}
