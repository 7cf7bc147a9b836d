//! Dry sound played through a scene, offline: both ears come out aligned with it.

mod clips;
mod mix;
mod playback;
mod source;
mod voice;

pub use clips::ClipPlayer;
pub use mix::Mix;
pub use source::Source;
pub use voice::Voice;

use crate::error::PlayerError;
use crate::{Ears, Stream};
use playback::{Playback, Write};
use promenade_audio::resample;
use promenade_core::headphones::{HeadphoneFilter, Headphones};
use promenade_core::published::ConvMode;
use promenade_core::{BlockParams, Latency, MOST_VOICES, Pose, Scene, Trim};
use source::mono;
use std::sync::Arc;

/// Samples rendered at a time where nobody sees the blocks.
const BLOCK: usize = 4096;

/// How a scene is played.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Playing {
    /// As a stream, as the plugin plays it.
    #[default]
    Stream,
    /// The published model clip by clip, as it is trained.
    Clips,
}

impl Playing {
    /// The name used in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Stream => "stream",
            Self::Clips => "clips",
        }
    }
}

/// Plays sound of one sample rate through a scene. Its output begins with its input: the latency is taken out.
///
/// Made for a scene and a rate by a command or a judge. One thread owns it, never an audio thread, and renders any number of
/// sounds.
///
/// Clips have only the scene's own rate: sound of another rate is converted there and back.
pub struct Player {
    engine: Engine,
    /// Rates of the sound and of the engine, samples per second.
    rate_hz: f64,
    played_hz: f64,
    /// Further sounds that are played with the next.
    voices: Vec<Voice>,
    /// What comes last, at the sound's rate.
    headphones: Option<HeadphoneFilter>,
}

enum Engine {
    Stream(Box<Stream>),
    Clips(Box<ClipPlayer>),
}

impl Player {
    /// Prepares a scene for sound of a sample rate.
    ///
    /// # Errors
    /// A rate that cannot be rendered, or no published model to play clip by clip.
    pub fn new(scene: &Arc<Scene>, rate_hz: f64, playing: Playing) -> Result<Self, PlayerError> {
        Self::at_latency(scene, rate_hz, playing, Latency::Frame)
    }

    /// Prepares a scene as [`Player::new`] does, with another latency: its sound differs by what a pose is heard later, and
    /// begins with its input all the same.
    ///
    /// # Errors
    /// Those of [`Player::new`]; a scene that has no other than its frame's ([`Latency::played_by`]), a published head, and
    /// clips.
    pub fn at_latency(scene: &Arc<Scene>, rate_hz: f64, playing: Playing, latency: Latency) -> Result<Self, PlayerError> {
        let short = latency != Latency::Frame;
        let wrong = |found: &str| {
            let expected = format!("{found} in this scene");
            if short { Err(PlayerError::argument("latency", expected, latency.name())) } else { Ok(()) }
        };
        let (engine, played_hz) = match playing {
            Playing::Stream => {
                // The published head is played in frames alone.
                if convolves(scene) || (short && latency.played_by(scene, rate_hz) != latency) {
                    wrong(Latency::Frame.name())?;
                }
                let stream = Stream::at_latency(scene, rate_hz, &BlockParams::default(), latency);
                let stream = stream.map_err(|e| PlayerError::argument("sample rate", "one that can be rendered", e))?;
                (Engine::Stream(Box::new(stream)), rate_hz)
            }
            Playing::Clips => {
                wrong("none: clips are played whole")?;
                let expected = "one with an anchor cloud, to be played clip by clip";
                let cloud = scene.cloud().ok_or_else(|| PlayerError::argument("scene", expected, "a field only"))?;
                (Engine::Clips(Box::new(ClipPlayer::new(&cloud.model, *scene.grid())?)), scene.grid().sample_rate_hz)
            }
        };
        Ok(Self { engine, rate_hz, played_hz, voices: Vec::new(), headphones: None })
    }

    /// Decodes so many times a second where the scene has a cloud.
    #[must_use]
    pub fn with_decode_rate(mut self, rate_hz: f32) -> Self {
        if let Engine::Stream(stream) = &mut self.engine {
            stream.params_mut().live.rate_hz = rate_hz;
        }
        self
    }

    /// Adds further sounds in the same room, two fewer than [`MOST_VOICES`] at most, of the sound's rate: they are played with
    /// the next sound, and once.
    ///
    /// # Errors
    /// Clips, a sound that is converted, a scene without its emitter's place.
    pub fn with_voices(mut self, voices: Vec<Voice>) -> Result<Self, PlayerError> {
        if voices.is_empty() {
            return Ok(self);
        }
        let wrong = |expected: &str, found: String| Err(PlayerError::argument("further sound", expected, found));
        if voices.len() > MOST_VOICES - 2 {
            return wrong(&format!("{} at most", MOST_VOICES - 2), voices.len().to_string());
        }
        if let Some(voice) = voices.iter().find(|voice| f64::from(voice.sample_rate_hz()) != self.rate_hz) {
            return wrong(&format!("{} Hz", self.rate_hz), format!("{} Hz", voice.sample_rate_hz()));
        }
        self.engine = match self.engine {
            Engine::Clips(_) => return wrong("what is played as a stream", "clips".to_owned()),
            Engine::Stream(stream) if stream.renderer().scene().emitter().is_none() => {
                return wrong("a scene that knows where its emitter is", "one that does not".to_owned());
            }
            Engine::Stream(stream) => {
                let stream = stream.with_further(voices.len());
                let expected = "what can be played from several places";
                Engine::Stream(Box::new(stream.map_err(|e| PlayerError::argument("further sound", expected, e))?))
            }
        };
        self.voices = voices;
        Ok(self)
    }

    /// Sets what a user changes about the scene's sound.
    ///
    /// # Errors
    /// A published model, whose sound is not in parts, follows the low cut alone as a stream and nothing clip by clip.
    pub fn with_trim(mut self, trim: Trim) -> Result<Self, PlayerError> {
        let follows = match self.stream() {
            Some(stream) => trim.leaves_parts() || !convolves(stream.renderer().scene()),
            None => trim == Trim::NEUTRAL,
        };
        if !follows {
            let expected = "one that is decoded, since a published model knows no parts of its sound";
            return Err(PlayerError::argument("scene", expected, "a published model"));
        }
        if let Engine::Stream(stream) = &mut self.engine {
            stream.params_mut().trim = trim;
        }
        Ok(self)
    }

    /// Gives the channels of a stereo sound an emitter each, this angle apart, degrees up to 180
    /// ([`promenade_core::EmitterParams`]); with 0 the mean of the channels has one emitter.
    ///
    /// # Errors
    /// Clips, and a scene without its emitter's place.
    pub fn with_stereo_spread(mut self, degrees: f32) -> Result<Self, PlayerError> {
        if degrees == 0.0 {
            return Ok(self);
        }
        self.engine = match self.engine {
            Engine::Stream(stream) if stream.renderer().scene().emitter().is_some() => {
                let stream = stream.with_spread(degrees.to_radians());
                Engine::Stream(Box::new(
                    stream.map_err(|e| PlayerError::argument("sample rate", "one that can be rendered", e))?,
                ))
            }
            Engine::Stream(_) => {
                return Err(PlayerError::argument(
                    "stereo spread",
                    "a scene that knows where its emitter is",
                    "one that does not",
                ));
            }
            Engine::Clips(_) => {
                return Err(PlayerError::argument("stereo spread", "what is played as a stream", "clips"));
            }
        };
        Ok(self)
    }

    /// Plays for headphones: what [`Player::play`] writes is given what they need, the dry share too.
    #[must_use]
    pub fn with_headphones(mut self, headphones: &Headphones) -> Self {
        self.headphones = Some(headphones.filter(self.rate_hz));
        self
    }

    /// How the scene is played.
    #[must_use]
    pub fn playing(&self) -> Playing {
        if self.stream().is_some() { Playing::Stream } else { Playing::Clips }
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
    ) -> Result<(), PlayerError> {
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
            Engine::Stream(stream) => {
                let voices = &mut std::mem::take(&mut self.voices)[..];
                Ok(Playback { source, voices, tail: true, mix, block }.through(stream, pose_at, write)?)
            }
            Engine::Clips(_) => {
                let channels = source.whole()?;
                let mut ears = self.whole(&[mono(&channels)], false, pose_at)?;
                let mut waiting = [channels.first(), channels.last()].map(|c| c.into_iter().flatten().copied().collect());
                mix.apply(ears.each_mut().map(|ear| &mut ear[..]), &mut waiting);
                write(ears.each_ref().map(|ear| &ear[..]))
            }
        }
    }

    /// Both ears of a mono sound, as long as it; `pose_at` is given seconds from its start.
    ///
    /// # Errors
    /// Rates between which nothing can be converted.
    pub fn render(&mut self, dry: &[f32], pose_at: &mut dyn FnMut(f64) -> Pose) -> Result<Ears, PlayerError> {
        self.whole(&[dry.to_vec()], false, pose_at)
    }

    /// Both ears of one of the clips that the published model was trained on, heard from one pose, up to its last whole hop.
    ///
    /// # Errors
    /// A scene that is not played clip by clip, a rate that is not the scene's, or a clip that is not as long as the model's.
    pub fn render_clip(&mut self, dry: &[f32], pose: &Pose) -> Result<Ears, PlayerError> {
        let playing = self.playing();
        let Engine::Clips(player) = &mut self.engine else {
            return Err(PlayerError::argument("playing", Playing::Clips.name(), playing.name()));
        };
        if self.rate_hz != self.played_hz {
            let expected = format!("{} Hz, the scene's own, to be played clip by clip", self.played_hz);
            return Err(PlayerError::argument("sample rate of a clip", expected, format!("{} Hz", self.rate_hz)));
        }
        player.listen(pose);
        Ok(player.render(dry)?)
    }

    /// Both ears of a sound, converted to the engine's rate and back where they differ; as long as the sound without `tail`.
    fn whole(&mut self, dry: &[Vec<f32>], tail: bool, pose_at: &mut dyn FnMut(f64) -> Pose) -> Result<Ears, PlayerError> {
        let [rate_hz, played_hz] = [self.rate_hz, self.played_hz].map(hertz);
        let source = Source::held(resample::signal(dry, rate_hz, played_hz)?, played_hz);
        let ears = match &mut self.engine {
            Engine::Stream(stream) => {
                let mut ears = Ears::default();
                let mut keep = |block: [&[f32]; 2]| {
                    ears.iter_mut().zip(block).for_each(|(to, from)| to.extend_from_slice(from));
                    Ok(())
                };
                let playback = Playback { source, voices: &mut [], tail, mix: Mix::RENDERED, block: BLOCK };
                playback.through(stream, pose_at, &mut keep)?;
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

/// What a scene at its own rate, makes of a unit impulse at sample `lead`, for a listener
/// who stands still: `len` samples of both ears.
///
/// # Errors
/// A rate that cannot be rendered.
pub fn render_response(scene: &Arc<Scene>, pose: Pose, lead: usize, len: usize) -> Result<Ears, PlayerError> {
    let mut impulse = vec![0.0; len];
    if let Some(x) = impulse.get_mut(lead) {
        *x = 1.0;
    }
    Player::new(scene, scene.grid().sample_rate_hz, Playing::Stream)?.render(&impulse, &mut |_| pose)
}

/// Whether it is a published head that plays a scene.
fn convolves(scene: &Scene) -> bool {
    scene.cloud().is_some_and(|cloud| cloud.conv != ConvMode::Off)
}

fn hertz(rate: f64) -> u32 {
    rate.round() as u32
}
