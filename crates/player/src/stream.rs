//! A scene as a host plays it, offline.

use promenade_core::{
    BlockParams, EmitterParams, Emitters, Latency, Pose, RenderError, RenderParams, Renderer, RendererConfig, Scene, Voice,
};
use std::sync::Arc;

/// Samples that are rendered at a time.
const BLOCK: usize = 4096;

/// Left and right ear, of one length.
pub type Ears = [Vec<f32>; 2];

/// Plays sounds through a scene, each from silence, in time with what it is given; every decode is waited for.
///
/// What [`Player`](crate::Player), the judge and the editor's panel Response render with, on a thread that may wait.
pub struct Stream {
    emitters: Emitters,
    params: RenderParams,
    places: EmitterParams,
    latency: Latency,
    /// Voices besides those of the sound's own channels.
    further: usize,
    /// Samples since the sound began.
    played: usize,
}

impl Stream {
    /// Plays a scene at a sample rate with some settings, of which mix, gain and bypass are none of a stream's.
    ///
    /// # Errors
    /// A rate at which it cannot be played.
    pub fn new(scene: &Arc<Scene>, rate_hz: f64, block: &BlockParams) -> Result<Self, RenderError> {
        Self::at_latency(scene, rate_hz, block, Latency::Frame)
    }

    /// Plays a scene with a latency, where the scene has it.
    ///
    /// # Errors
    /// A rate at which it cannot be played.
    pub fn at_latency(scene: &Arc<Scene>, rate_hz: f64, block: &BlockParams, latency: Latency) -> Result<Self, RenderError> {
        let mut params = RenderParams::from(block);
        params.live.wait = true;
        let emitters = made(scene, rate_hz, latency, 1)?;
        Ok(Self { emitters, params, places: block.emitters, latency, further: 0, played: 0 })
    }

    /// Adds so many further voices.
    ///
    /// # Errors
    /// A scene that plays one voice only.
    pub fn with_further(self, further: usize) -> Result<Self, RenderError> {
        Self { further, ..self }.made_again()
    }

    /// Gives the channels of a stereo sound an emitter each, this angle apart, radians.
    ///
    /// # Errors
    /// A scene that plays one voice only.
    pub fn with_spread(self, spread: f32) -> Result<Self, RenderError> {
        Self { places: EmitterParams { spread, ..self.places }, ..self }.made_again()
    }

    fn made_again(self) -> Result<Self, RenderError> {
        let own = if self.is_spread() { 2 } else { 1 };
        let (scene, rate_hz) = (self.renderer().scene(), self.renderer().grid().sample_rate_hz);
        let emitters = made(scene, rate_hz, self.latency, own + self.further)?;
        Ok(Self { emitters: if own > 1 { emitters.with_second() } else { emitters }, ..self })
    }

    /// Whether a stereo sound's channels have emitters of their own.
    #[must_use]
    pub fn is_spread(&self) -> bool {
        self.places.spread > 0.0
    }

    /// How the scene is rendered.
    #[must_use]
    pub fn params(&self) -> &RenderParams {
        &self.params
    }

    /// How the scene is rendered from now on.
    pub fn params_mut(&mut self) -> &mut RenderParams {
        &mut self.params
    }

    /// What renders the voices.
    #[must_use]
    pub fn renderer(&self) -> &Renderer {
        self.emitters.renderer()
    }

    /// Samples for which the room sounds on after a sound has ended.
    #[must_use]
    pub fn tail_samples(&self) -> usize {
        self.renderer().tail_samples_with(&self.params.trim)
    }

    /// Forgets what has been played: the next sample is a sound's first.
    pub fn restart(&mut self) {
        self.emitters.reset();
        self.played = 0;
    }

    /// Renders the next samples of one or two channels into both ears, all of one length; `pose_at` is given seconds from the
    /// sound's start. So many samples of the ears, which come back, are from before the sound: altogether the renderer's
    /// latency.
    pub fn advance(&mut self, input: &[&[f32]], ears: [&mut [f32]; 2], pose_at: &mut dyn FnMut(f64) -> Pose) -> usize {
        self.advance_further(input, &[], ears, pose_at)
    }

    /// Renders the next samples as [`Stream::advance`] does, with what further voices play.
    pub fn advance_further(
        &mut self,
        input: &[&[f32]],
        further: &[Voice<'_>],
        ears: [&mut [f32]; 2],
        pose_at: &mut dyn FnMut(f64) -> Pose,
    ) -> usize {
        let (count, latency, rate_hz) =
            (ears[0].len(), self.renderer().latency_samples(), self.renderer().grid().sample_rate_hz);
        let played = self.played;
        let mut pose_at = |i| pose_at((played + i) as f64 / rate_hz);
        self.emitters.process(input, further, ears, self.params, &self.places, &mut pose_at);
        self.played += count;
        latency.saturating_sub(played).min(count)
    }

    /// Both ears of a mono sound, as long as it; `pose_at` is given seconds from its start. `None` as soon as it is not
    /// `wanted` any more.
    pub fn render(&mut self, dry: &[f32], mut pose_at: impl FnMut(f64) -> Pose, wanted: &dyn Fn() -> bool) -> Option<Ears> {
        self.restart();
        let whole = dry.len() + self.renderer().latency_samples();
        let mut rendered = [(); 2].map(|()| Vec::with_capacity(dry.len()));
        let mut ears = [(); 2].map(|()| vec![0.0; BLOCK]);
        for start in (0..whole).step_by(BLOCK) {
            if !wanted() {
                return None;
            }
            let count = BLOCK.min(whole - start);
            let mut input = dry[start.min(dry.len())..(start + count).min(dry.len())].to_vec();
            input.resize(count, 0.0);
            let early = self.advance(&[&input], ears.each_mut().map(|ear| &mut ear[..count]), &mut pose_at);
            rendered.iter_mut().zip(&ears).for_each(|(to, ear)| to.extend_from_slice(&ear[early..count]));
        }
        Some(rendered)
    }

    /// What a unit impulse becomes for a listener who stands still, over some seconds after it. Before it there is silence of
    /// one window, [`Stream::lead`] samples. `None` as soon as it is not `wanted` any more.
    pub fn respond(&mut self, pose: Pose, seconds: f64, wanted: &dyn Fn() -> bool) -> Option<Ears> {
        let lead = self.lead();
        let mut impulse = vec![0.0; lead + (seconds * self.renderer().grid().sample_rate_hz) as usize];
        if let Some(x) = impulse.get_mut(lead) {
            *x = 1.0;
        }
        self.render(&impulse, |_| pose, wanted)
    }

    /// Samples of silence before the impulse of a response.
    #[must_use]
    pub fn lead(&self) -> usize {
        self.renderer().grid().n_fft
    }
}

fn made(scene: &Arc<Scene>, rate_hz: f64, latency: Latency, voices: usize) -> Result<Emitters, RenderError> {
    let config = RendererConfig { latency, ..RendererConfig::inline(scene, rate_hz, voices) };
    Ok(Renderer::new(Arc::clone(scene), config)?.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_testing::scenes::room;

    #[test]
    fn sounds_begin_anew_and_end_when_they_are_not_wanted() {
        let scene = room(16_000.0, 0.3, 0.05);
        let mut stream = Stream::new(&scene, 48_000.0, &BlockParams::default()).unwrap();
        let first = stream.respond(Pose::IDENTITY, 0.4, &|| true).unwrap();
        let again = stream.respond(Pose::IDENTITY, 0.4, &|| true).unwrap();
        assert_eq!(first[0].len(), stream.lead() + 19_200);
        assert!(first == again, "something of the first is heard in the second");
        assert!(first[0].iter().any(|x| x.abs() > 0.01));
        let calls = std::cell::Cell::new(0);
        let twice = || calls.replace(calls.get() + 1) < 2;
        assert_eq!(stream.respond(Pose::IDENTITY, 10.0, &twice), None);
        assert_eq!(calls.get(), 3);
    }
}
