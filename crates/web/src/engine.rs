//! One scene at one sample rate, and all that a page may change about it.

use crate::description;
use crate::listener::Listener;
use crate::mailbox::{Correspondent, SharedMailbox};
use promenade_core::decode::{CloudDecoder, InlineWorker};
use promenade_core::glam::Vec3;
use promenade_core::headphones::{HeadphoneStage, Headphones};
use promenade_core::{
    BlockParams, CameraPath, DecodeWorker, Decoded, Emitters, FrontPoint, Head, Keyframe, MOST_VOICES, Playback, Pose,
    Renderer, RendererConfig, Scene, Spatializer, Voice,
};
use std::sync::Arc;

/// Samples that are worked on at a time, at most: a browser's render quantum, or several.
pub(crate) const MOST_SAMPLES: usize = 1024;

/// How a scene is prepared.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// With a second emitter, for stereo sound whose channels come from two places.
    pub second_emitter: bool,
    /// Decode poses on the thread that renders: offline only.
    pub inline: bool,
    /// Sounds beside the first that can be played in the same place, at most 32.
    pub further: usize,
    /// The most that it may be off from all of the scene, in differences that are just noticed, where the scene carries its
    /// front; 0 plays all of it.
    pub within: f32,
}

/// A sound beside the first.
struct Further {
    input: Vec<f32>,
    /// How far it is moved from the scene's emitter, metres.
    offset: Vec3,
}

/// One instance of the module: loaded in a Worker, then played on the audio thread, which gets its memory. What goes wrong is
/// said in words.
pub struct Engine {
    rate_hz: f64,
    head: Option<Head>,
    headphones: Option<Headphones>,
    scene: Option<Arc<Scene>>,
    /// Whether the file says what less of its scene costs.
    front: bool,
    stream: Spatializer,
    headphone_stage: HeadphoneStage,
    params: BlockParams,
    pub(crate) listener: Listener,
    mailboxes: Vec<SharedMailbox>,
    decoder: Option<(CloudDecoder, Decoded)>,
    input: [Vec<f32>; 2],
    further: Vec<Further>,
    ears: [Vec<f32>; 2],
    /// Samples since the stream began.
    clock: u64,
}

impl Engine {
    /// At a sample rate, Hz, without a scene.
    #[must_use]
    pub fn new(rate_hz: f64) -> Self {
        let pair = || [vec![0.0; MOST_SAMPLES], vec![0.0; MOST_SAMPLES]];
        Self {
            rate_hz,
            head: None,
            headphones: None,
            scene: None,
            front: false,
            stream: Spatializer::new(rate_hz),
            headphone_stage: HeadphoneStage::default(),
            params: BlockParams::default(),
            listener: Listener::new(Pose::IDENTITY, rate_hz),
            mailboxes: Vec::new(),
            decoder: None,
            input: pair(),
            further: Vec::new(),
            ears: pair(),
            clock: 0,
        }
    }

    /// Takes the head that the next scene is heard with, as [`Head::to_bytes`] wrote it.
    ///
    /// # Errors
    /// The bytes are no head.
    pub fn set_head(&mut self, bytes: &[u8]) -> Result<(), String> {
        self.head = Some(Head::from_bytes(bytes).map_err(|e| e.to_string())?);
        Ok(())
    }

    /// Takes the headphones that are compensated: a preset of AutoEq or Equalizer APO, or JSON as a project keeps them.
    ///
    /// # Errors
    /// The text is neither.
    pub fn set_headphones(&mut self, bytes: &[u8]) -> Result<(), String> {
        let text = std::str::from_utf8(bytes).map_err(|_| "the headphones' file is no text".to_owned())?;
        let headphones = if text.trim_start().starts_with('{') {
            serde_json::from_str(text).map_err(|e| e.to_string())?
        } else {
            Headphones::from_text(text).map_err(|e| e.to_string())?
        };
        self.headphone_stage.install(Some(Box::new(headphones.filter(self.rate_hz))), self.rate_hz);
        self.headphones = Some(headphones);
        Ok(())
    }

    /// Reads a scene and makes it ready to play.
    ///
    /// # Errors
    /// The bytes are no scene, the scene cannot be played at this rate, or not with another head.
    pub fn load(&mut self, bytes: &[u8], options: LoadOptions) -> Result<(), String> {
        let mut scene = Scene::from_bytes(bytes).map_err(|e| e.to_string())?;
        if let Some(head) = &self.head {
            scene = scene.with_head(head).map_err(|e| e.to_string())?;
        }
        self.front = !scene.parts().front.is_empty();
        let point = FrontPoint::within(&scene.parts().front, options.within).filter(|_| options.within > 0.0).copied();
        if let Some(kept) = point.and_then(|point| scene.with_setting(point.setting)) {
            scene = kept;
        }
        let scene = Arc::new(scene);
        let first = if options.second_emitter { 2 } else { 1 };
        let voices = first + options.further.min(u32::BITS as usize);
        self.mailboxes.clear();
        self.decoder = CloudDecoder::new(&scene).map(|decoder| {
            let blank = decoder.blank();
            (decoder, blank)
        });
        let workers = match &mut self.decoder {
            Some(_) if options.inline => InlineWorker::several(&scene, voices),
            Some((decoder, _)) => {
                let mailboxes = &mut self.mailboxes;
                let by_mail = |_| {
                    let mailbox = SharedMailbox::new(decoder, &scene.start_pose());
                    mailboxes.push(mailbox.clone());
                    Box::new(Correspondent::new(mailbox)) as Box<dyn DecodeWorker>
                };
                (0..voices).map(by_mail).collect()
            }
            None => Vec::new(),
        };
        let config = RendererConfig { voices, workers, ..self.rate_hz.into() };
        let renderer = Renderer::new(Arc::clone(&scene), config).map_err(|e| e.to_string())?;
        self.params.live.wait = options.inline;
        let emitters = Emitters::from(renderer);
        self.stream.install(if options.second_emitter { emitters.with_second() } else { emitters });
        let further = || Further { input: vec![0.0; MOST_SAMPLES], offset: Vec3::ZERO };
        self.further = std::iter::repeat_with(further).take(voices - first).collect();
        self.listener = Listener::new(scene.start_pose(), self.rate_hz);
        self.scene = Some(scene);
        self.clock = 0;
        Ok(())
    }

    /// Drops what only a Worker needs, so that less memory is handed over: its decoder.
    pub fn lighten(&mut self) {
        self.decoder = None;
    }

    /// The scene as JSON, for a page.
    #[must_use]
    pub fn description(&self) -> String {
        let Some(scene) = &self.scene else { return "null".to_owned() };
        let mut all = description::description(scene);
        if let Some(of) = all.as_object_mut() {
            of.insert("latency_samples".into(), self.stream.latency_samples().into());
            of.insert("front".into(), self.front.into());
            of.insert("headphones".into(), self.headphones.is_some().into());
        }
        all.to_string()
    }

    /// Points to draw: anchors (0) or image sources (1).
    #[must_use]
    pub fn points(&self, kind: u32) -> Vec<f32> {
        match (&self.scene, kind) {
            (Some(scene), 0) => description::anchors(scene),
            (Some(scene), 1) => description::images(scene),
            _ => Vec::new(),
        }
    }

    /// Changes a setting; the numbers are those of `page/engine/settings.js`.
    pub fn set(&mut self, setting: u32, value: f32) {
        let p = &mut self.params;
        let on = value != 0.0;
        match setting {
            1 => p.gain = value,
            2 => p.mix = value,
            3 => p.bypass = on,
            4 => p.wet_solo = on,
            5 => p.trim.direct = value,
            6 => p.trim.early = value,
            7 => p.trim.late = value,
            8 => p.trim.decay = value,
            9 => p.trim.distance_law = value,
            10 => p.trim.width = value,
            11 => p.trim.low_cut_hz = value,
            12 => p.emitters.spread = value,
            13 => p.live.rate_hz = value,
            _ => {}
        }
    }

    /// Takes a path: rows of time in seconds, x, y, z in metres, and a quaternion x, y, z, w; none takes it away.
    ///
    /// # Errors
    /// It is no path.
    pub fn set_path(&mut self, rows: &[f64]) -> Result<(), String> {
        let keyframe = |r: &[f64; 8]| {
            let [t_s, v @ ..] = *r;
            let [x, y, z, qx, qy, qz, qw] = v.map(|v| v as f32);
            Keyframe { t_s, pose: pose(x, y, z, qx, qy, qz, qw) }
        };
        let rows: Vec<Keyframe> = rows.as_chunks::<8>().0.iter().map(keyframe).collect();
        let path = if rows.is_empty() { None } else { Some(CameraPath::new(rows).map_err(|e| e.to_string())?) };
        self.listener.set_path(path);
        Ok(())
    }

    /// Walks the path from some seconds along it; with `own_head` it moves the listener and messages turn the head.
    pub fn walk(&mut self, from_s: f64, speed: f64, looping: bool, own_head: bool) {
        self.listener.walk(from_s, Playback { speed, looping }, own_head, self.clock);
    }

    /// Leaves the path where it is.
    pub fn stop(&mut self) {
        self.listener.stop(self.clock);
    }

    /// Takes a pose that was sent at a time of the sender's clock, seconds; it is glided to.
    pub fn take_pose(&mut self, pose: Pose, sent_s: f64) {
        self.listener.glide.take(pose, sent_s, self.clock);
    }

    /// Is at a pose from now on.
    pub fn jump(&mut self, pose: Pose) {
        if pose.is_valid() {
            self.listener.glide.jump(pose);
            self.stream.jump();
        }
    }

    /// Where samples are written, 1024 at most: both channels of the first sound, then one of each further one. Empty for a
    /// sound that the scene was not loaded for.
    pub fn input(&mut self, channel: usize) -> &mut [f32] {
        match channel.checked_sub(2) {
            None => &mut self.input[channel],
            Some(further) => self.further.get_mut(further).map_or(&mut [], |further| &mut further.input),
        }
    }

    /// Moves a sound, 0 for the first, from the scene's emitter, metres.
    pub fn put(&mut self, sound: usize, offset: Vec3) {
        match sound.checked_sub(1) {
            None => self.params.emitters.offset = offset,
            Some(further) => self.further.get_mut(further).into_iter().for_each(|further| further.offset = offset),
        }
    }

    /// Where the samples of an ear are read.
    #[must_use]
    pub fn ear(&self, ear: usize) -> &[f32] {
        &self.ears[ear.min(1)]
    }

    /// Plays a block of `channels` (1 or 2) channels and `len` samples, at most 1024, from the inputs to the ears, and with it
    /// each further sound whose bit is set in `further`. A sound that plays nothing costs nothing once it has died away.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock that is waited for, or I/O.
    pub fn process(&mut self, channels: usize, further: u32, len: usize) {
        let len = len.min(MOST_SAMPLES);
        let (clock, listener) = (self.clock, &mut self.listener);
        listener.glide.forget_before(clock);
        let listener = &*listener;
        let [first, second] = &self.input;
        let both = [&first[..len], &second[..len]];
        let [left, right] = &mut self.ears;
        let (left, right) = (&mut left[..len], &mut right[..len]);
        let heard = &both[..channels.clamp(1, 2)];
        let mut voices = [Voice::default(); MOST_VOICES];
        for (n, (voice, sound)) in voices.iter_mut().zip(&self.further).enumerate() {
            let plays = further >> n & 1 == 1;
            *voice = Voice { input: if plays { &sound.input[..len] } else { &[] }, offset: sound.offset, ..Voice::default() };
        }
        self.stream.process(heard, &voices[..self.further.len()], [&mut *left, &mut *right], &self.params, |i| {
            listener.pose_at((clock + i as u64) as f64)
        });
        self.headphone_stage.process([left, right], true);
        self.clock += len as u64;
    }

    /// Is as new again: a walk begins where it began, and the same input gives the same output.
    pub fn reset(&mut self) {
        self.stream.reset();
        self.headphone_stage.reset();
        self.listener.reset();
        self.clock = 0;
    }

    /// The pose that is played now, and seconds along the path, below 0 where none is walked.
    #[must_use]
    pub fn heard(&self) -> (Pose, f64) {
        (self.listener.pose_at(self.clock as f64), self.listener.along_s(self.clock).unwrap_or(-1.0))
    }

    /// Samples from sound in to sound out, and from a pose that is sent to its being used.
    #[must_use]
    pub fn latency_samples(&self) -> (usize, f64) {
        (self.stream.latency_samples(), self.listener.glide.delay())
    }

    /// The pose that a voice is to decode, once: the first sound's, its second emitter's, then those of further sounds.
    pub fn asked(&mut self, voice: usize) -> Option<Pose> {
        self.mailboxes.get(voice).and_then(SharedMailbox::asked)
    }

    /// Takes the answer to it. Returns whether it fits the scene.
    pub fn answer(&mut self, voice: usize, row: &[f32]) -> bool {
        self.mailboxes.get(voice).is_some_and(|mailbox| mailbox.answer(row))
    }

    /// Decodes a pose for another instance of the same scene; empty where the scene has nothing to decode.
    pub fn decode(&mut self, pose: &Pose) -> Vec<f32> {
        let Some((decoder, out)) = &mut self.decoder else { return Vec::new() };
        decoder.decode(pose, out);
        let mut row = vec![0.0; out.flat_len()];
        out.write_to(&mut row);
        row
    }
}

/// A pose of numbers; the quaternion need not be of unit length.
pub(crate) fn pose(x: f32, y: f32, z: f32, qx: f32, qy: f32, qz: f32, qw: f32) -> Pose {
    let orientation = promenade_core::glam::Quat::from_xyzw(qx, qy, qz, qw);
    Pose { position: Vec3::new(x, y, z), orientation: orientation.normalize() }
}

#[cfg(test)]
mod tests;
