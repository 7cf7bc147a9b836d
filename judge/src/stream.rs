//! A scene as a host plays it, for whole sounds.

use promenade_core::{BlockParams, LiveParams, Pose, RenderError, Renderer, Scene, Spatializer};
use std::sync::Arc;

/// Samples that are rendered at a time.
const BLOCK: usize = 4096;

/// Left and right ear, of one length.
pub type Ears = [Vec<f32>; 2];

/// Plays sounds through a scene, each from silence and without latency.
pub struct Stream {
    engine: Spatializer,
    params: BlockParams,
    rate_hz: f64,
}

impl Stream {
    /// Plays a scene at a sample rate with some settings; every decode is waited for.
    ///
    /// # Errors
    /// A rate at which it cannot be played.
    pub fn new(scene: &Arc<Scene>, rate_hz: f64, params: BlockParams) -> Result<Self, RenderError> {
        let mut engine = Spatializer::new(rate_hz);
        engine.install(Box::new(Renderer::for_tier(scene, rate_hz, params.tier)?));
        let live = LiveParams { wait: true, ..params.live };
        Ok(Self { engine, params: BlockParams { live, ..params }, rate_hz })
    }

    /// Both ears of a mono sound, as long as it; `pose_at` is given seconds from its start. `None` as soon as it is not
    /// `wanted` any more.
    pub fn render(&mut self, dry: &[f32], mut pose_at: impl FnMut(f64) -> Pose, wanted: &dyn Fn() -> bool) -> Option<Ears> {
        self.engine.reset();
        let latency = self.engine.latency_samples();
        let mut ears = [(); 2].map(|()| vec![0.0; dry.len() + latency]);
        let [left, right] = &mut ears;
        let mut input = [0.0; BLOCK];
        let mut done = 0;
        while done < left.len() {
            if !wanted() {
                return None;
            }
            let count = BLOCK.min(left.len() - done);
            let input = &mut input[..count];
            input.fill(0.0);
            let rest = &dry[done.min(dry.len())..];
            input.iter_mut().zip(rest).for_each(|(to, from)| *to = *from);
            let out = [&mut left[done..done + count], &mut right[done..done + count]];
            self.engine.process(&[input], out, &self.params, |i| pose_at((done + i) as f64 / self.rate_hz));
            done += count;
        }
        Some(ears.map(|mut ear| ear.split_off(latency)))
    }

    /// What a unit impulse becomes for a listener who stands still, over some seconds after it. Before it there is silence of
    /// one window, [`Stream::lead`] samples. `None` as soon as it is not `wanted` any more.
    pub fn respond(&mut self, pose: Pose, seconds: f64, wanted: &dyn Fn() -> bool) -> Option<Ears> {
        let lead = self.lead();
        let mut impulse = vec![0.0; lead + (seconds * self.rate_hz) as usize];
        if let Some(x) = impulse.get_mut(lead) {
            *x = 1.0;
        }
        self.render(&impulse, |_| pose, wanted)
    }

    /// Samples of silence before the impulse of a response.
    #[must_use]
    pub fn lead(&self) -> usize {
        self.engine.renderer().map_or(0, |renderer| renderer.grid().n_fft)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_testing::scenes::room;

    #[test]
    fn sounds_begin_anew_and_end_when_they_are_not_wanted() {
        let scene = room(16_000.0, 0.3, 0.05);
        let mut stream = Stream::new(&scene, 48_000.0, BlockParams::default()).unwrap();
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
