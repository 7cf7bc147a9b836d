//! How far beside the direction of a scene's best someone points who hears less of it.

use crate::cost::Setting;
use crate::error::JudgeError;
use promenade_core::random::Random;
use promenade_core::{BlockParams, Pose, Quality};
use promenade_metrics::{Cues, lateral_deg, pointed};
use promenade_player::Stream;
use std::f32::consts::TAU;

/// Turns of the head at the scene's start that are listened to.
const TURNS: usize = 24;
/// Seconds of each response, and draws of noise, the same for all that is heard of a turn.
const LENGTH_S: f64 = 0.05;
const DRAWS: usize = 50;

/// What ears tell of the emitter at each turn of the head, with its direction as the head sees it.
pub(super) struct Turned(Vec<([f64; 3], Cues)>);

impl Turned {
    /// Of a setting; `None` where nobody knows where its emitter is, or its direct sound is silent.
    ///
    /// # Errors
    /// It cannot be rendered.
    pub(super) fn of(setting: &Setting) -> Result<Option<Self>, JudgeError> {
        let scene = &setting.scene;
        let Some(emitter) = scene.emitter() else { return Ok(None) };
        let (rate, Quality { tier, live }) = (scene.grid().sample_rate_hz, setting.quality);
        let mut stream = Stream::new(scene, rate, &BlockParams { tier, live, ..BlockParams::default() })?;
        let start = scene.start_pose().position;
        let cues = (0..TURNS).map(|turn| {
            let pose = Pose::from_ypr(start, TAU * turn as f32 / TURNS as f32, 0.0, 0.0);
            let [left, right] = stream.respond(pose, LENGTH_S, &|| true)?;
            let direction = pose.to_head(emitter).try_normalize()?.as_dvec3().to_array();
            Some((direction, Cues::of(&left, &right, rate).ok()?))
        });
        Ok(cues.collect::<Option<Vec<_>>>().map(Self))
    }

    /// Between the mean lateral angles that someone who knows the best points at, hearing this and it, degrees: the mean over
    /// turns.
    pub(super) fn off_deg(&self, best: &Self) -> f64 {
        let len = best.0.first().map_or(0, |(_, cues)| cues.len());
        let offs = self.0.iter().zip(&best.0).enumerate().map(|(turn, ((_, heard), (_, truth)))| {
            let mut random = Random::new(turn as u64 + 1);
            let noise: Vec<Vec<f64>> = (0..DRAWS).map(|_| (0..len).map(|_| f64::from(random.normal())).collect()).collect();
            let mean = |cues: &Cues| pointed(cues, &best.0, &noise).into_iter().map(lateral_deg).sum::<f64>() / DRAWS as f64;
            (mean(heard) - mean(truth)).abs()
        });
        offs.sum::<f64>() / self.0.len().max(1) as f64
    }
}
