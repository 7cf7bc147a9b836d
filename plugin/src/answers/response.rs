//! The response of the scene that is heard, at a pose and with settings, as curves and figures.

use crate::answers::settled::Question;
use crate::parameter::cast::narrow;
use crate::telemetry::{FLOOR_DB, MASK_POINTS, frequency_hz};
use promenade_core::{BlockParams, OCTAVES_HZ, Pose, Scene};
use promenade_judge::{response_measures, response_s};
use promenade_metrics::{DecayRange, MetricError, c50_db, decay_time_s, octave_of, schroeder_db, smoothed_levels_db};
use promenade_player::{Ears, Stream};
use std::sync::{Arc, Weak};
use std::time::Duration;

/// Points of a curve of decay.
pub const DECAY_POINTS: usize = 240;
/// A decay is shown down to this level, dB.
pub const DECAY_FLOOR_DB: f32 = -70.0;
/// The spectrum is averaged over so many octaves.
const SMOOTHED_OCTAVES: f64 = 1.0 / 3.0;
/// Smaller steps of the listener change nothing that is seen: metres, radians.
const STEP_M: f32 = 0.005;
const STEP_RAD: f32 = 0.01;

/// What is heard of a unit impulse, and by whom.
#[derive(Clone, Debug)]
pub struct Listening {
    /// The scene, which is not kept in memory.
    pub scene: Weak<Scene>,
    /// The host's sample rate, Hz.
    pub sample_rate_hz: f64,
    /// The listener, the emitter being where the scene has it.
    pub pose: Pose,
    /// The settings.
    pub block: BlockParams,
    /// The octave that is looked at alone, as an index of [`OCTAVES_HZ`].
    pub octave: Option<usize>,
}

/// Curves and figures of a response.
#[derive(Clone, Debug, PartialEq)]
pub struct Response {
    /// Energy that is left at the left and the right ear (Schroeder's integral) at [`DECAY_POINTS`] times from the onset on, dB
    /// below all of it.
    pub decay_db: [Vec<f32>; 2],
    /// From the first of these times to the last, seconds.
    pub seconds: f32,
    /// Third-octave levels at [`frequency_hz`] of both ears, all octaves, dB above a unit impulse.
    pub spectrum_db: [Vec<f32>; 2],
    /// Reverberation time T20, mean of both ears, seconds; `None` where there is no decay to see.
    pub t20_s: Option<f64>,
    /// Clarity C50, mean of both ears, dB; `None` where there is nothing after 50 ms.
    pub c50_db: Option<f64>,
}

impl Listening {
    /// What is sounded and heard: mix, gain and bypass are no part of the place.
    pub fn new(scene: &Arc<Scene>, sample_rate_hz: f64, pose: Pose, block: BlockParams, octave: Option<usize>) -> Self {
        let block = BlockParams { mix: 1.0, gain: 1.0, bypass: false, ..block };
        Self { scene: Arc::downgrade(scene), sample_rate_hz, pose, block, octave }
    }

    /// The response of both ears. `None` where it cannot be played, or as soon as it is not `wanted` any more.
    pub fn ears(&self, wanted: &dyn Fn() -> bool) -> Option<Ears> {
        let scene = self.scene.upgrade()?;
        let longer = f64::from(self.block.trim.decay).max(1.0);
        let mut stream = Stream::new(&scene, self.sample_rate_hz, &self.block).ok()?;
        stream.respond(self.pose, longer * response_s(&scene), wanted)
    }
}

impl Response {
    /// Of both ears at a sample rate, or of an octave of them. Silence has no curve: it is at the floor.
    pub fn of(ears: &Ears, sample_rate_hz: f64, octave_hz: Option<f32>) -> Self {
        let centres = (0..MASK_POINTS).map(|point| f64::from(frequency_hz(point))).collect::<Vec<_>>();
        let spectrum = |ear: &Vec<f32>| {
            let levels = smoothed_levels_db(ear, sample_rate_hz, &centres, SMOOTHED_OCTAVES);
            levels.into_iter().map(|level| narrow(level).max(FLOOR_DB)).collect()
        };
        let spectrum_db = ears.each_ref().map(spectrum);
        let band;
        let heard = match octave_hz {
            Some(hz) => {
                band = ears.each_ref().map(|ear| octave_of(ear, sample_rate_hz, f64::from(hz)));
                &band
            }
            None => ears,
        };
        let whole = heard.each_ref().map(|ear| schroeder_db(ear).unwrap_or_default());
        // Both ears end where the later of them has reached the floor.
        let above = |curve: &Vec<f64>| curve.partition_point(|level| *level > f64::from(DECAY_FLOOR_DB));
        let shown = whole.iter().map(above).max().unwrap_or(0).max(DECAY_POINTS);
        let point = |curve: &Vec<f64>, at: usize| {
            curve.get(at * (shown - 1) / (DECAY_POINTS - 1)).map_or(DECAY_FLOOR_DB, |level| narrow(*level).max(DECAY_FLOOR_DB))
        };
        let decay_db = whole.each_ref().map(|curve| (0..DECAY_POINTS).map(|at| point(curve, at)).collect());
        let mean = |of: &dyn Fn(&[f32]) -> Result<f64, MetricError>| Some(0.5 * (of(&heard[0]).ok()? + of(&heard[1]).ok()?));
        let measured = octave_hz.is_none().then(|| response_measures(&ears[0], &ears[1], sample_rate_hz).ok());
        let [t20_s, c50_db] = match measured {
            Some(measured) => measured.map_or([None; 2], |measured| [measured.t20_s, measured.c50_db]),
            None => [mean(&|ear| decay_time_s(ear, sample_rate_hz, DecayRange::T20)), mean(&|ear| c50_db(ear, sample_rate_hz))],
        };
        let seconds = narrow((shown - 1) as f64 / sample_rate_hz);
        Self { decay_db, seconds, spectrum_db, t20_s, c50_db }
    }
}

impl Question for Listening {
    type Answer = Response;
    const REST: Duration = Duration::from_millis(150);

    fn is_like(&self, other: &Self) -> bool {
        let (a, b) = (&self.pose, &other.pose);
        let turned = 2.0 * (a.orientation - b.orientation).length().min((a.orientation + b.orientation).length());
        Weak::ptr_eq(&self.scene, &other.scene)
            && (self.sample_rate_hz, self.block, self.octave) == (other.sample_rate_hz, other.block, other.octave)
            && a.position.distance(b.position) < STEP_M
            && turned < STEP_RAD
    }

    fn answer(&self, wanted: &dyn Fn() -> bool) -> Option<Response> {
        let ears = self.ears(wanted)?;
        Some(Response::of(&ears, self.sample_rate_hz, self.octave.and_then(|octave| OCTAVES_HZ.get(octave)).copied()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_core::Trim;
    use promenade_testing::scenes::room;

    fn listening(scene: &Arc<Scene>, block: BlockParams, octave: Option<usize>) -> Listening {
        Listening::new(scene, 48_000.0, scene.start_pose(), block, octave)
    }

    /// A tone that decays by 60 dB within so many seconds.
    fn decaying(hz: f64, t60_s: f64, at_s: f64) -> f64 {
        (std::f64::consts::TAU * hz * at_s).sin() * 10_f64.powf(-3.0 * at_s / t60_s)
    }

    #[test]
    fn a_known_decay_has_its_figures_and_a_curve_along_them() {
        let sound = |i: usize| {
            let at_s = i as f64 / 48_000.0;
            (decaying(250.0, 1.0, at_s) + 10.0 * decaying(2000.0, 0.5, at_s)) as f32
        };
        let ears: Ears = [(); 2].map(|()| (0..96_000).map(sound).collect());
        for (octave_hz, t60_s) in [(250.0, 1.0), (2000.0, 0.5)] {
            let found = Response::of(&ears, 48_000.0, Some(octave_hz));
            let t20_s = found.t20_s.unwrap();
            assert!((t20_s / t60_s - 1.0).abs() < 0.02, "{t20_s} s of {t60_s} at {octave_hz} Hz");
            for curve in &found.decay_db {
                assert!(curve.len() == DECAY_POINTS && curve[0].abs() < 0.1 && curve.windows(2).all(|pair| pair[1] <= pair[0]));
                // Along the line that T20 is the slope of, to a point.
                let at =
                    |db: f32| curve.partition_point(|level| *level > db) as f32 / (DECAY_POINTS - 1) as f32 * found.seconds;
                let point_s = found.seconds / (DECAY_POINTS - 1) as f32;
                let off_s = f64::from(at(-25.0) - at(-5.0)) - t20_s / 3.0;
                assert!(off_s.abs() <= 1.5 * f64::from(point_s), "{off_s} s off at {octave_hz} Hz");
            }
        }
    }

    #[test]
    fn curves_and_figures_follow_the_settings() {
        let scene = room(48_000.0, 0.5, 5.0);
        let usual = listening(&scene, BlockParams::default(), None).answer(&|| true).unwrap();
        let trim = Trim { decay: 2.0, ..Trim::NEUTRAL };
        let longer = listening(&scene, BlockParams { trim, ..BlockParams::default() }, None).answer(&|| true).unwrap();
        let ratio = longer.t20_s.unwrap() / usual.t20_s.unwrap();
        assert!((ratio / 2.0 - 1.0).abs() < 0.05, "{ratio}");
        let octave = listening(&scene, BlockParams::default(), Some(4)).answer(&|| true).unwrap();
        assert_eq!(octave.spectrum_db, usual.spectrum_db);
        assert!(octave.decay_db != usual.decay_db && octave.t20_s != usual.t20_s, "an octave is looked at alone");
        let louder = listening(&scene, BlockParams { gain: 4.0, mix: 0.3, ..BlockParams::default() }, None);
        assert_eq!(louder.answer(&|| true).unwrap(), usual, "mix and gain are no part of the place");
    }

    #[test]
    fn a_step_that_nobody_sees_asks_nothing_and_another_sound_does() {
        let scene = room(16_000.0, 0.2, 0.05);
        let asked = listening(&scene, BlockParams::default(), None);
        let mut other = asked.clone();
        other.pose.position.x += 0.001;
        assert!(other.is_like(&asked));
        other.pose.position.x += 0.1;
        assert!(!other.is_like(&asked));
        let turned = Pose::from_ypr(asked.pose.position, 0.1, 0.0, 0.0);
        assert!(!Listening { pose: turned, ..asked.clone() }.is_like(&asked));
        let trim = Trim { early: 0.1, ..Trim::NEUTRAL };
        let fainter = listening(&scene, BlockParams { trim, ..BlockParams::default() }, None);
        assert!(!fainter.is_like(&asked) && fainter.answer(&|| true).is_some());
        assert!(asked.answer(&|| false).is_none(), "nobody wants it");
        let usual = asked.answer(&|| true).unwrap();
        assert_ne!(usual.decay_db, fainter.answer(&|| true).unwrap().decay_db);
        drop(scene);
        assert!(fainter.answer(&|| true).is_none(), "the scene is gone");
    }
}
