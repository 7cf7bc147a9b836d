//! Dry sound played through a scene, offline: both ears come out aligned with it.

mod clips;
mod source;
mod stream;
mod voice;

pub use promenade_judge::Ears;
pub use source::Source;
pub use voice::Voice;

pub(crate) use clips::ClipPlayer;

use crate::error::BakeError;
use crate::sources::capture::{Capture, Clip};
use promenade_audio::{FileError, resample};
use promenade_core::headphones::{HeadphoneFilter, Headphones};
use promenade_core::{BlockParams, Latency, MOST_FURTHER, Pose, Scene, Tier, Trim};
use promenade_judge::Stream;
use std::collections::VecDeque;
use std::sync::Arc;

/// Dry sound that is played before a clip, seconds, at least; as long as the scene's room sounds where that is more.
const PRE_ROLL_S: f64 = 1.0;
/// The most dry sound that is played before a clip, seconds.
const LONGEST_PRE_ROLL_S: f64 = 10.0;
/// Samples rendered at a time where nobody sees the blocks.
const BLOCK: usize = 4096;

/// Takes the next samples of both ears.
type Write<'a> = dyn FnMut([&[f32]; 2]) -> Result<(), FileError> + 'a;

/// How a scene is played.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Playing {
    /// As a stream, as the plugin plays it.
    Stream(Tier),
    /// The published model clip by clip, as it is trained.
    Clip,
}

impl Playing {
    /// The name used on the command line and in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Stream(tier) => tier.name(),
            Self::Clip => "clip",
        }
    }
}

/// Where the listener is while a clip of a capture is played.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Poses {
    /// Where the clip's middle was, for the whole clip and before it: as the published models take it.
    #[default]
    Fixed,
    /// On the track's path.
    Path,
}

/// Linear gains of the rendered and of the dry sound in what is played.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mix {
    rendered: f32,
    dry: f32,
}

impl Mix {
    /// The rendered sound alone.
    pub const RENDERED: Self = Self { rendered: 1.0, dry: 0.0 };

    /// A share of rendered sound, 0 to 1, the rest of it dry, and a gain of both, dB.
    #[must_use]
    pub fn new(share: f32, gain_db: f32) -> Self {
        let gain = 10.0_f32.powf(gain_db / 20.0);
        Self { rendered: gain * share, dry: gain * (1.0 - share) }
    }

    /// The same without dry sound, the rendered as loud as it was.
    #[must_use]
    pub fn without_dry(self) -> Self {
        Self { dry: 0.0, ..self }
    }

    /// Mixes the dry samples that are waiting into the next samples of both ears.
    fn apply(self, ears: [&mut [f32]; 2], waiting: &mut [VecDeque<f32>; 2]) {
        for (ear, waiting) in ears.into_iter().zip(waiting) {
            for x in ear {
                *x = *x * self.rendered + waiting.pop_front().unwrap_or(0.0) * self.dry;
            }
        }
    }
}

/// Plays sound of one sample rate through a scene. Its output begins with its input: the latency is taken out.
///
/// Clips have only the scene's own rate: sound of another rate is converted there and back, as for the tier Reference at rates
/// that a stream does not convert.
pub struct Player {
    engine: Engine,
    /// Rates of the sound and of the engine, samples per second.
    rate_hz: f64,
    played_hz: f64,
    /// Further sounds that are played with the next.
    voices: Vec<Voice>,
    /// What comes last, at the sound's rate.
    headphones: Option<HeadphoneFilter>,
    /// Processor seconds of the last stream.
    processor_s: f64,
}

enum Engine {
    Stream(Box<Stream>),
    Clips(Box<ClipPlayer>),
}

impl Player {
    /// Prepares a scene for sound of a sample rate. Where `playing` is not given, the tier is standard, or the cheapest that
    /// the scene has.
    ///
    /// # Errors
    /// A tier that the scene does not have, a rate that cannot be rendered, or no published model to play clip by clip.
    pub fn new(scene: &Arc<Scene>, rate_hz: f64, playing: Option<Playing>) -> Result<Self, BakeError> {
        Self::at_latency(scene, rate_hz, playing, Latency::Frame)
    }

    /// The same with another latency, whose sound differs by what a pose is heard later; the output begins with its input all
    /// the same.
    ///
    /// # Errors
    /// As [`Player::new`]; a scene that has no other than its frame's ([`Latency::played_by`]), the tier reference, and clips.
    pub fn at_latency(scene: &Arc<Scene>, rate_hz: f64, playing: Option<Playing>, latency: Latency) -> Result<Self, BakeError> {
        let short = latency != Latency::Frame;
        let wrong = |found: &str| {
            let expected = format!("{found} in this scene and tier");
            if short { Err(BakeError::argument("latency", expected, latency.name())) } else { Ok(()) }
        };
        let own_hz = scene.grid().sample_rate_hz;
        let (engine, played_hz) = match playing.unwrap_or_else(|| Playing::Stream(scene.played_tier(Tier::Standard))) {
            Playing::Stream(tier) => {
                if !scene.has_tier(tier) {
                    let has: Vec<_> = scene.tiers().map(Tier::name).collect();
                    return Err(BakeError::argument("tier", has.join(" or "), tier.name()));
                }
                // The published head is played in frames alone.
                if tier == Tier::Reference || (short && latency.played_by(scene, rate_hz) != latency) {
                    wrong(Latency::Frame.name())?;
                }
                let at = |hz: f64| {
                    Stream::at_latency(scene, hz, &BlockParams { tier, ..BlockParams::default() }, latency)
                        .map_err(|e| BakeError::argument("sample rate", "one that can be rendered", e))
                };
                let (mut stream, mut played_hz) = (at(rate_hz)?, rate_hz);
                if stream.renderer().played_tier(tier) != tier {
                    (stream, played_hz) = (at(own_hz)?, own_hz);
                }
                (Engine::Stream(Box::new(stream)), played_hz)
            }
            Playing::Clip => {
                wrong("none: clips are played whole")?;
                let expected = "one with an anchor cloud, to be played clip by clip";
                let cloud = scene.cloud().ok_or_else(|| BakeError::argument("scene", expected, "a field only"))?;
                (Engine::Clips(Box::new(ClipPlayer::new(&cloud.model, *scene.grid())?)), own_hz)
            }
        };
        Ok(Self { engine, rate_hz, played_hz, voices: Vec::new(), headphones: None, processor_s: 0.0 })
    }

    /// The same with so many decodes a second in the tiers high and reference.
    #[must_use]
    pub fn with_decode_rate(mut self, rate_hz: f32) -> Self {
        if let Engine::Stream(stream) = &mut self.engine {
            stream.params_mut().quality.live.rate_hz = rate_hz;
        }
        self
    }

    /// The same with further sounds in one room, [`MOST_FURTHER`] at most, of the sound's rate: they are played with the next
    /// sound, and once. To be chosen before a stereo spread.
    ///
    /// # Errors
    /// Clips, a sound that is converted, a scene without its emitter's place, a latency that is shorter than a frame.
    pub fn with_voices(mut self, voices: Vec<Voice>) -> Result<Self, BakeError> {
        if voices.is_empty() {
            return Ok(self);
        }
        let wrong = |expected: &str, found: String| Err(BakeError::argument("further sound", expected, found));
        if voices.len() > MOST_FURTHER {
            return wrong(&format!("{MOST_FURTHER} at most"), voices.len().to_string());
        }
        if let Some(voice) = voices.iter().find(|voice| f64::from(voice.sample_rate_hz()) != self.rate_hz) {
            return wrong(&format!("{} Hz", self.rate_hz), format!("{} Hz", voice.sample_rate_hz()));
        }
        self.engine = match self.engine {
            Engine::Clips(_) => return wrong("a tier that is played as a stream", "clip".to_owned()),
            Engine::Stream(_) if self.rate_hz != self.played_hz => {
                return wrong("a tier that is played at the sound's rate", "reference".to_owned());
            }
            Engine::Stream(stream) if stream.renderer().scene().emitter().is_none() => {
                return wrong("a scene that knows where its emitter is", "one that does not".to_owned());
            }
            Engine::Stream(stream) => {
                let stream = stream.with_further(voices.len());
                let expected = "what can be played from several places";
                Engine::Stream(Box::new(stream.map_err(|e| BakeError::argument("further sound", expected, e))?))
            }
        };
        self.voices = voices;
        Ok(self)
    }

    /// The same with what a user changes about the scene's sound.
    ///
    /// # Errors
    /// A published model, whose sound is not in parts, follows the low cut alone in the tier Reference and
    /// nothing clip by clip.
    pub fn with_trim(mut self, trim: Trim) -> Result<Self, BakeError> {
        let follows = match self.playing() {
            Playing::Stream(Tier::Reference) => trim.leaves_parts(),
            Playing::Stream(_) => true,
            Playing::Clip => trim == Trim::NEUTRAL,
        };
        if !follows {
            let expected = "draft, standard or high, since the published model knows no parts of its sound";
            return Err(BakeError::argument("tier", expected, self.playing().name()));
        }
        if let Engine::Stream(stream) = &mut self.engine {
            stream.params_mut().trim = trim;
        }
        Ok(self)
    }

    /// The same with emitters of a stereo sound's channels this angle apart, degrees up to 180
    /// ([`promenade_core::EmitterParams`]); with 0 the mean of the channels has one emitter.
    ///
    /// # Errors
    /// Clips, and a scene without its emitter's place.
    pub fn with_stereo_spread(mut self, degrees: f32) -> Result<Self, BakeError> {
        if degrees == 0.0 {
            return Ok(self);
        }
        self.engine = match self.engine {
            Engine::Stream(stream) if stream.renderer().scene().emitter().is_some() => {
                let stream = stream.with_spread(degrees.to_radians());
                Engine::Stream(Box::new(stream.map_err(|e| BakeError::argument("sample rate", "one that can be rendered", e))?))
            }
            Engine::Stream(_) => {
                return Err(BakeError::argument(
                    "stereo spread",
                    "a scene that knows where its emitter is",
                    "one that does not",
                ));
            }
            Engine::Clips(_) => return Err(BakeError::argument("stereo spread", "a tier that is played as a stream", "clip")),
        };
        Ok(self)
    }

    /// The same for headphones: what is played ([`Player::play`]) is given what they need, the dry share too.
    #[must_use]
    pub fn with_headphones(mut self, headphones: &Headphones) -> Self {
        self.headphones = Some(headphones.filter(self.rate_hz));
        self
    }

    /// How the scene is played.
    #[must_use]
    pub fn playing(&self) -> Playing {
        self.stream().map_or(Playing::Clip, |stream| Playing::Stream(stream.params().quality.tier))
    }

    fn stream(&self) -> Option<&Stream> {
        if let Engine::Stream(stream) = &self.engine { Some(stream) } else { None }
    }

    /// Samples, at the rate that is rendered, by which a host hears the scene late; 0 for clips.
    #[must_use]
    pub fn latency_samples(&self) -> usize {
        self.stream().map_or(0, |stream| stream.renderer().latency_samples())
    }

    /// Seconds for which the room sounds on after the input has ended; 0 for clips.
    #[must_use]
    pub fn tail_s(&self) -> f64 {
        self.stream().map_or(0.0, |stream| stream.tail_samples() as f64 / self.played_hz)
    }

    /// Processor seconds that the last stream took; the decoding of its first pose is not counted. 0 for clips.
    #[must_use]
    pub fn processor_s(&self) -> f64 {
        self.processor_s
    }

    /// Plays a whole sound; `pose_at` is given seconds from its start. What sounds after a stream's input is kept.
    ///
    /// `write` is given both ears block by block, of `block` samples at most unless the sound is converted or played in clips,
    /// which takes all of it into memory.
    ///
    /// # Errors
    /// A sound that cannot be read or converted, and those of `write`.
    pub fn play(
        &mut self,
        source: Source,
        mix: Mix,
        block: usize,
        pose_at: &mut dyn FnMut(f64) -> Pose,
        write: &mut Write<'_>,
    ) -> Result<(), BakeError> {
        let mut headphones = self.headphones.clone();
        let mut worn = Ears::default();
        let write = &mut |ears: [&[f32]; 2]| {
            let Some(headphones) = &mut headphones else { return write(ears) };
            for (to, from) in worn.iter_mut().zip(ears) {
                to.clear();
                to.extend_from_slice(from);
            }
            headphones.process(worn.each_mut().map(|ear| &mut ear[..]));
            write(worn.each_ref().map(|ear| &ear[..]))
        };
        match &mut self.engine {
            Engine::Stream(stream) if self.rate_hz == self.played_hz => {
                self.processor_s =
                    stream::play(stream, source, &mut std::mem::take(&mut self.voices), true, (mix, block), pose_at, write)?;
                Ok(())
            }
            _ => {
                let channels = source.whole()?;
                let tail = self.playing() != Playing::Clip;
                let spread = self.stream().is_some_and(Stream::is_spread);
                let played = if spread { channels.clone() } else { vec![mono(&channels)] };
                let mut ears = self.whole(&played, tail, pose_at)?;
                let mut waiting = [channels.first(), channels.last()].map(|c| c.into_iter().flatten().copied().collect());
                mix.apply(ears.each_mut().map(|ear| &mut ear[..]), &mut waiting);
                Ok(write(ears.each_ref().map(|ear| &ear[..]))?)
            }
        }
    }

    /// Both ears of a mono sound, as long as it; `pose_at` is given seconds from its start.
    ///
    /// # Errors
    /// Rates between which nothing can be converted.
    pub fn render(&mut self, dry: &[f32], pose_at: &mut dyn FnMut(f64) -> Pose) -> Result<Ears, BakeError> {
        self.whole(&[dry.to_vec()], false, pose_at)
    }

    /// Both ears of a clip of a capture of this rate. A stream's are as long as the clip, and the dry sound before it is heard
    /// too; those of the published model end with the clip's last whole hop.
    ///
    /// # Errors
    /// Rates between which nothing can be converted; for the published model, a rate that is not the scene's or a clip that is
    /// not as long as those it was trained on.
    ///
    /// # Panics
    /// When the clip is not one of the capture.
    pub fn render_clip(&mut self, capture: &Capture, clip: &Clip, poses: Poses) -> Result<Ears, BakeError> {
        self.render_part(capture, clip, poses, |pre_roll| capture.dry(clip, pre_roll))
    }

    /// As [`Self::render_clip`], of what one of the clip's sources played, by its number among the track's voices.
    ///
    /// # Errors
    /// As [`Self::render_clip`].
    ///
    /// # Panics
    /// When the clip is not one of the capture, or the voice none of its track's.
    pub fn render_voice(&mut self, capture: &Capture, clip: &Clip, voice: usize, poses: Poses) -> Result<Ears, BakeError> {
        let dry = &capture.tracks[clip.track].voices[voice].dry;
        self.render_part(capture, clip, poses, |pre_roll| clip.stretch(dry, pre_roll))
    }

    fn render_part(
        &mut self,
        capture: &Capture,
        clip: &Clip,
        poses: Poses,
        dry: impl Fn(usize) -> Vec<f32>,
    ) -> Result<Ears, BakeError> {
        let rate_hz = self.rate_hz;
        if let Engine::Clips(player) = &mut self.engine {
            if rate_hz != self.played_hz {
                let expected = format!("{} Hz, the scene's own, to be played clip by clip", self.played_hz);
                return Err(BakeError::argument("sample rate of the capture", expected, format!("{rate_hz} Hz")));
            }
            player.listen(&clip.pose);
            let ears = player.render(&dry(0));
            return ears.map_err(|e| BakeError::argument("clip", "one of the model's length", format!("'{}': {e}", clip.name)));
        }
        let pre_roll = (self.tail_s().clamp(PRE_ROLL_S, LONGEST_PRE_ROLL_S) * rate_hz).ceil() as usize;
        let began_s = (clip.start as f64 - pre_roll as f64) / rate_hz;
        let path = &capture.tracks[clip.track].path;
        let ears = self.render(&dry(pre_roll), &mut |seconds| match poses {
            Poses::Fixed => clip.pose,
            Poses::Path => path.pose_at(began_s + seconds),
        })?;
        Ok(ears.map(|mut ear| ear.split_off(pre_roll)))
    }

    /// Both ears of a sound, converted to the engine's rate and back where they differ; as long as the sound without `tail`.
    fn whole(&mut self, dry: &[Vec<f32>], tail: bool, pose_at: &mut dyn FnMut(f64) -> Pose) -> Result<Ears, BakeError> {
        let [rate_hz, played_hz] = [self.rate_hz, self.played_hz].map(hertz);
        let source = Source::held(resample::signal(dry, rate_hz, played_hz)?, played_hz);
        let ears = match &mut self.engine {
            Engine::Stream(stream) => {
                let mut ears = Ears::default();
                let mut keep = |block: [&[f32]; 2]| {
                    ears.iter_mut().zip(block).for_each(|(to, from)| to.extend_from_slice(from));
                    Ok(())
                };
                self.processor_s = stream::play(stream, source, &mut [], tail, (Mix::RENDERED, BLOCK), pose_at, &mut keep)?;
                ears
            }
            Engine::Clips(player) => player.render_long(&mono(&source.whole()?), pose_at)?,
        };
        let mut back = resample::signal(&ears, played_hz, rate_hz)?.into_iter();
        Ok([(); 2].map(|()| {
            let mut ear = back.next().unwrap_or_default();
            ear.resize(if tail { ear.len() } else { dry.first().map_or(0, Vec::len) }, 0.0);
            ear
        }))
    }
}

/// What a scene at its own rate, in the tier standard or its cheapest, makes of a unit impulse at sample `lead`, for a listener
/// who stands still: `len` samples of both ears.
///
/// # Errors
/// A rate that cannot be rendered.
pub fn render_response(scene: &Arc<Scene>, pose: Pose, lead: usize, len: usize) -> Result<Ears, BakeError> {
    let mut impulse = vec![0.0; len];
    if let Some(x) = impulse.get_mut(lead) {
        *x = 1.0;
    }
    Player::new(scene, scene.grid().sample_rate_hz, None)?.render(&impulse, &mut |_| pose)
}

/// The mean of one or two channels.
fn mono(channels: &[Vec<f32>]) -> Vec<f32> {
    match channels {
        [] => Vec::new(),
        [first, .., last] => first.iter().zip(last).map(|(a, b)| 0.5 * (a + b)).collect(),
        [one] => one.clone(),
    }
}

fn hertz(rate: f64) -> u32 {
    rate.round() as u32
}
