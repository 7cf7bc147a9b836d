//! What the audio thread owns: block in, block out.

use crate::grid::LONGEST_LATENCY_S;
use crate::number::{bounded, finite, whole};
use crate::past::Past;
use crate::ramp::Ramp;
use crate::{EmitterParams, Emitters, LiveParams, MOST_VOICES, Pose, RenderParams, Renderer, Trim, Voice};

/// Length of a cross-fade between scenes, seconds.
const SCENE_FADE_S: f64 = 0.05;
/// The longest that another setting of a place sounds before it is faded in, seconds.
const LONGEST_REST_S: f64 = 1.0;
/// Length of the ramp that takes a step in gain, mix or bypass, seconds.
const GAIN_RAMP_S: f64 = 0.001;
/// Samples that are worked on at a time.
const CHUNK: usize = 256;

/// Settings that hold for one block.
///
/// A snapshot of parameters that the audio thread takes at the beginning of each block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockParams {
    /// How often a live decoder is asked.
    pub live: LiveParams,
    /// Share of the rendered sound, 0 (dry only) to 1 (rendered only).
    pub mix: f32,
    /// Output gain, linear.
    pub gain: f32,
    /// Play the room alone, as on a send: neither the dry share nor the direct sound.
    pub wet_solo: bool,
    /// Pass the dry sound at unit gain.
    pub bypass: bool,
    /// What the user changes about the scene's sound.
    pub trim: Trim,
    /// Where it is played from.
    pub emitters: EmitterParams,
}

impl Default for BlockParams {
    fn default() -> Self {
        Self {
            live: LiveParams::default(),
            mix: 1.0,
            gain: 1.0,
            wet_solo: false,
            bypass: false,
            trim: Trim::NEUTRAL,
            emitters: EmitterParams::default(),
        }
    }
}

impl From<&BlockParams> for RenderParams {
    /// What of a block's settings the render head follows.
    fn from(block: &BlockParams) -> Self {
        let direct = if block.wet_solo { 0.0 } else { block.trim.direct };
        let trim = Trim { direct, ..block.trim };
        Self { live: block.live, trim }
    }
}

/// Places a mono or stereo input in a scene, any block size, with the dry sound aligned to the rendered one.
///
/// Made with an instance for a sample rate; its audio thread owns it. Scenes are made elsewhere, swapped in whole, and given
/// back to be dropped.
///
/// Changes of gain, mix and bypass belong to the input sample they come with: they are heard at that sample plus the latency.
pub struct Spatializer {
    sample_rate_hz: f64,
    active: Option<Box<Emitters>>,
    fading: Option<Box<Emitters>>,
    retired: Option<Box<Emitters>>,
    /// Samples until the cross-fade begins, and its progress; it runs while below `fade_len`.
    rest: usize,
    fade: usize,
    fade_len: usize,
    ramp_len: usize,
    past: Past,
    /// What comes next into it.
    next: [Vec<f32>; 4],
    longest_delay: usize,
    wet_gain: Ramp,
    dry_gain: Ramp,
    /// What each output has of each dry channel.
    dry: [[f32; 2]; 2],
    fresh: bool,
    wet: [Vec<f32>; 2],
    old: [Vec<f32>; 2],
    /// Sum of the further voices' dry sound, and their levels in it.
    further: Vec<f32>,
    levels: [Option<Ramp>; MOST_VOICES],
}

impl Spatializer {
    /// Without a scene it passes the dry sound with no latency.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    #[must_use]
    pub fn new(sample_rate_hz: f64) -> Self {
        let samples = |seconds: f64| whole(seconds * sample_rate_hz).max(1);
        let pair = || [vec![0.0; CHUNK], vec![0.0; CHUNK]];
        Self {
            sample_rate_hz,
            active: None,
            fading: None,
            retired: None,
            fade: samples(SCENE_FADE_S),
            rest: 0,
            fade_len: samples(SCENE_FADE_S),
            ramp_len: samples(GAIN_RAMP_S),
            past: Past::new(samples(LONGEST_LATENCY_S), CHUNK),
            next: std::array::from_fn(|_| vec![0.0; CHUNK]),
            longest_delay: samples(LONGEST_LATENCY_S),
            wet_gain: Ramp::default(),
            dry_gain: Ramp::default(),
            dry: [[1.0, 0.0], [0.0, 1.0]],
            fresh: true,
            wet: pair(),
            old: pair(),
            further: vec![0.0; CHUNK],
            levels: [None; MOST_VOICES],
        }
    }

    /// Sets which dry channel each output receives: a gain of each dry channel per output,
    /// `[output][channel]`.
    #[must_use]
    pub fn with_dry(self, dry: [[f32; 2]; 2]) -> Self {
        Self { dry, ..self }
    }

    /// The host's sample rate, Hz.
    #[must_use]
    pub fn sample_rate_hz(&self) -> f64 {
        self.sample_rate_hz
    }

    /// Plays a scene from now on, without a fade.
    ///
    /// # Real-time
    /// Not real-time safe: drops the scene that was played.
    pub fn install(&mut self, emitters: impl Into<Box<Emitters>>) {
        self.fading = None;
        self.retired = None;
        self.active = Some(emitters.into());
        self.reset();
    }

    /// Whether [`Spatializer::swap_in`] would take a scene now.
    #[must_use]
    pub fn is_free(&self) -> bool {
        self.fade >= self.fade_len && self.retired.is_none()
    }

    /// Begins a cross-fade to another scene, at equal gain over 50 ms; without a past, as after [`Spatializer::reset`], it
    /// plays at once.
    ///
    /// # Errors
    /// They come back while a fade is running or what was retired has not been taken.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn swap_in(&mut self, emitters: Box<Emitters>) -> Result<(), Box<Emitters>> {
        if !self.is_free() {
            return Err(emitters);
        }
        let old = self.active.replace(emitters);
        if self.fresh {
            self.retired = old;
        } else {
            self.fading = old;
            self.fade = 0;
        }
        Ok(())
    }

    /// As [`Spatializer::swap_in`], for another setting of the place that is played: the fade begins when its room sounds as
    /// well, after a reverberation time or a second.
    ///
    /// # Errors
    /// They come back while a fade is running or what was retired has not been taken.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn swap_in_sounding(&mut self, emitters: Box<Emitters>) -> Result<(), Box<Emitters>> {
        let t60_s = f64::from(emitters.renderer().scene().tail().longest_t60_s());
        self.swap_in(emitters)?;
        if self.fade < self.fade_len {
            self.rest = whole(t60_s.min(LONGEST_REST_S) * self.sample_rate_hz);
        }
        Ok(())
    }

    /// What has been faded out, to be dropped on another thread.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn take_retired(&mut self) -> Option<Box<Emitters>> {
        self.retired.take()
    }

    /// The renderer that is heard, or being faded in.
    #[must_use]
    pub fn renderer(&self) -> Option<&Renderer> {
        self.active.as_deref().map(Emitters::renderer)
    }

    /// Samples by which the output lags the input.
    #[must_use]
    pub fn latency_samples(&self) -> usize {
        latency_of(self.active.as_deref()).min(self.longest_delay)
    }

    /// Samples for which the output sounds on after the input has ended, beyond the latency.
    #[must_use]
    pub fn tail_samples(&self) -> usize {
        self.active.as_ref().map_or(0, |emitters| emitters.renderer().tail_samples())
    }

    /// Samples until a pose is next asked for; `usize::MAX` without a scene.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    #[must_use]
    pub fn samples_to_pose(&self) -> usize {
        let sounding = [&self.active, &self.fading].into_iter().flatten();
        sounding.map(|emitters| emitters.samples_to_pose()).min().unwrap_or(usize::MAX)
    }

    /// Takes the next pose at once, as after the transport was moved; what sounds goes on.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn jump(&mut self) {
        for emitters in [&mut self.active, &mut self.fading].into_iter().flatten() {
            emitters.jump();
        }
    }

    /// Is as new again: the next pose and the next settings are jumped to, not glided to, and the same sound and poses give the
    /// same samples.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn reset(&mut self) {
        if let Some(active) = &mut self.active {
            active.reset();
        }
        (self.fade, self.rest) = (self.fade_len, 0);
        if self.fading.is_some() {
            self.retired = self.fading.take();
        }
        self.past.reset();
        self.fresh = true;
    }

    /// Renders a block of one or two input channels, and what further voices of the renderer play in the same room, in their
    /// order. `pose_at(i)` is the pose at sample `i` of the block; it is asked at hops only.
    ///
    /// Two channels are averaged for the rendered sound, unless their emitters are some angle apart, and kept apart in the dry
    /// sound. In the dry sound each further voice is on both channels.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O. All slices of channels have the same length.
    pub fn process(
        &mut self,
        input: &[&[f32]],
        further: &[Voice<'_>],
        [left, right]: [&mut [f32]; 2],
        params: &BlockParams,
        mut pose_at: impl FnMut(usize) -> Pose,
    ) {
        let Some(first) = input.first() else {
            left.fill(0.0);
            right.fill(0.0);
            return;
        };
        let second = input.get(1).unwrap_or(first);
        let mono = input.len() < 2;
        let emitters = if mono { EmitterParams { spread: 0.0, ..params.emitters } } else { params.emitters };
        let len = left.len().min(right.len()).min(first.len()).min(second.len());
        self.aim(params);
        let rendered = RenderParams::from(params);
        let mut spans = [Voice::default(); MOST_VOICES];
        let further = &further[..further.len().min(MOST_VOICES)];
        for start in (0..len).step_by(CHUNK) {
            let span = start..len.min(start + CHUNK);
            spans.iter_mut().zip(further).for_each(|(to, voice)| *to = voice.span(span.clone()));
            let out = [&mut left[span.clone()], &mut right[span.clone()]];
            let channels = [&first[span.clone()], &second[span]];
            self.mix(channels, &spans[..further.len()], out, rendered, &emitters, &mut |i| pose_at(start + i));
        }
    }

    fn aim(&mut self, params: &BlockParams) {
        let (gain, mix) = (finite(params.gain).clamp(0.0, 1e3), finite(params.mix).clamp(0.0, 1.0));
        let (wet, dry) =
            if params.bypass { (0.0, 1.0) } else { (gain * mix, if params.wet_solo { 0.0 } else { gain * (1.0 - mix) }) };
        self.wet_gain.aim(wet, self.ramp_len);
        self.dry_gain.aim(dry, self.ramp_len);
        if self.fresh {
            self.wet_gain.jump();
            self.dry_gain.jump();
            self.levels.fill(None);
            self.fresh = false;
        }
    }

    /// Mixes samples that are worked on at a time.
    fn mix(
        &mut self,
        [first, second]: [&[f32]; 2],
        voices: &[Voice<'_>],
        [left, right]: [&mut [f32]; 2],
        params: RenderParams,
        emitters: &EmitterParams,
        pose_at: &mut dyn FnMut(usize) -> Pose,
    ) {
        let n = first.len();
        let render = |played: &mut Option<Box<Emitters>>, out: &mut [Vec<f32>; 2], pose_at: &mut dyn FnMut(usize) -> Pose| {
            let [l, r] = out;
            match played {
                Some(played) => {
                    let ears = [&mut l[..n], &mut r[..n]];
                    played.process(&[first, second], voices, ears, params, emitters, pose_at);
                }
                None => [l, r].into_iter().for_each(|ear| ear[..n].fill(0.0)),
            }
        };
        render(&mut self.active, &mut self.wet, pose_at);
        let fading = self.fade < self.fade_len;
        if fading {
            render(&mut self.fading, &mut self.old, pose_at);
        }
        let further = &mut self.further[..n];
        further.fill(0.0);
        for (voice, level) in voices.iter().zip(&mut self.levels) {
            let level = level.get_or_insert(Ramp::at(voice.gain()));
            level.aim(voice.gain(), self.ramp_len);
            level.add(voice.input, further);
        }
        let [dry_left, dry_right, wet_gain, dry_gain] = self.next.each_mut().map(|row| &mut row[..n]);
        self.wet_gain.fill(wet_gain);
        self.dry_gain.fill(dry_gain);
        let dry = self.dry;
        let inputs = first.iter().zip(second).zip(&*further);
        for ((left, right), ((a, b), further)) in dry_left.iter_mut().zip(&mut *dry_right).zip(inputs) {
            let (a, b) = (finite(*a) + further, finite(*b) + further);
            (*left, *right) = (dry[0][0] * a + dry[0][1] * b, dry[1][0] * a + dry[1][1] * b);
        }
        self.past.take([dry_left, dry_right, wet_gain, dry_gain]);
        // Without a scene nothing is rendered: the dry sound takes the place of the rendered one.
        let stand_in = |played: &Option<Box<Emitters>>| if played.is_some() { 0.0 } else { 1.0 };
        self.past.mix(self.latency_samples(), stand_in(&self.active), self.wet.each_mut().map(|ear| &mut ear[..n]));
        if fading {
            let delay = latency_of(self.fading.as_deref()).min(self.longest_delay);
            self.past.mix(delay, stand_in(&self.fading), self.old.each_mut().map(|ear| &mut ear[..n]));
            for (ear, old) in self.wet.iter_mut().zip(&self.old) {
                for (i, (x, old)) in ear[..n].iter_mut().zip(old).enumerate() {
                    let share = ((self.fade + i).saturating_sub(self.rest) as f32 / self.fade_len as f32).min(1.0);
                    *x = old + share * (*x - old);
                }
            }
        }
        for (out, ear) in [left, right].into_iter().zip(&self.wet) {
            out.iter_mut().zip(ear).for_each(|(out, x)| *out = bounded(*x));
        }
        if fading {
            let rested = n.min(self.rest);
            (self.rest, self.fade) = (self.rest - rested, self.fade + n - rested);
            if self.fade >= self.fade_len {
                self.retired = self.fading.take();
            }
        }
    }
}

fn latency_of(emitters: Option<&Emitters>) -> usize {
    emitters.map_or(0, |emitters| emitters.renderer().latency_samples())
}
