//! How far one rendering of a scene is from another, as a listener has it.

use crate::error::JudgeError;
use crate::measures::{Unmeasurable, response_measures, response_s};
use crate::poses::{Course, noise};
use promenade_core::{
    Audible, Carriers, LiveParams, Measure, Pose, Renderer, RendererConfig, ResponseMeasures, Scene, StftGrid, Voice,
};
use promenade_fourier::num_complex::Complex64;
use promenade_fourier::spectrum;
use promenade_metrics::statistics::quantile;
use promenade_metrics::{MetricError, band_powers, ild_db, interaural_coherence, itds_s};
use std::f64::consts::TAU;
use std::ops::Range;
use std::sync::Arc;

/// Differences that are just noticed, of decay times as a share: these, C50, levels (strength) and coherence after ISO
/// 3382-1:2009, annexes A and B; ITD after Klumpp and Eady (1956), ILD after Mills (1960).
pub const JND_DECAY: f64 = 0.05;
/// Of levels between the ears or of a critical band (Lindau 2008), and of clarity, dB.
pub const JND_DB: f64 = 1.0;
/// Of a delay between the ears, seconds, where they hear one sound. It grows as their coherence falls, and below a fifth of it
/// listeners hear none (Rakerd and Hartmann 2010): over the coherence's square here.
pub const JND_ITD_S: f64 = 20e-6;
const LEAST_COHERENCE: f64 = 0.2;
/// Of the ears' coherence.
const JND_COHERENCE: f64 = 0.075;
/// The shallowest modulation of a steady sound that is heard (Viemeister 1979: -26 dB), and the share of a modulation's square
/// by which another is heard to be deeper (Wakefield and Viemeister 1990: 1.5 dB).
const JND_MODULATION: f64 = 0.05;
const JND_DEEPER: f64 = 0.41;
/// Clarity of a response that has nothing after 50 ms, and of all that are clearer, dB.
const CLEAREST_DB: f64 = 20.0;
/// Bands so much fainter than the loudest do not count, and no band differs by more than this, dB.
const FAINT_DB: f64 = 40.0;
const MOST_DB: f64 = 20.0;
/// The share of poses, or of moments on the way, that differ by no more than is said.
const OF_POSES: f64 = 0.9;
/// What the delay between the ears is heard by, and where the early part of a response ends, for coherence, seconds.
const FIRST_S: f64 = 0.01;
const EARLY_S: f64 = 0.08;
/// Longest response, as a share of the reverberation time and in seconds.
const OF_DECAY: f64 = 0.5;
const LONGEST_S: f64 = 1.5;
/// Levels are heard over this time, seconds; way and turn last so long, and nothing is compared before its filters are settled.
const WINDOW_S: f64 = 0.1;
const WAY_S: f64 = 2.4;
const TURN_S: f64 = 1.5;
const SETTLED_S: f64 = 0.4;
/// Held tones, as multiples of the rate at which their envelopes are taken, Hz, so that none is heard in another's.
const ENVELOPE_HZ: f64 = 400.0;
const TONES: [u32; 8] = [1, 2, 4, 7, 11, 16, 23, 31];
/// The modulation that is heard as roughness and flutter, Hz.
const FLUTTER_HZ: Range<f64> = 15.0..60.0;

/// What one rendering of a scene is to a listener who stands at some places, walks and turns.
pub struct Heard {
    standing: Vec<Standing>,
    moving: Moving,
}

/// What is heard on some ways.
#[derive(Default)]
pub(crate) struct Moving {
    /// Levels of critical bands at both ears and the level difference between them, dB, by moment of the ways.
    moments: Vec<(Vec<f64>, f64)>,
    /// Depth of each tone's modulation at each ear while the head turns.
    modulation: Vec<f64>,
}

/// A response; nothing of it is known where all is silent.
pub(crate) struct Standing {
    measures: Option<ResponseMeasures>,
    /// Levels of critical bands at both ears, dB.
    levels_db: Vec<f64>,
    /// Delays between the ears that may be heard, seconds.
    itds_s: Vec<f64>,
    /// Coherence of the ears in what is heard first, early and late.
    first: f64,
    coherence: Vec<f64>,
}

impl Heard {
    /// Plays a scene along a course at its own rate, as long as that is `wanted`.
    ///
    /// # Errors
    /// It cannot be rendered, its responses cannot be measured, or they are no longer asked for.
    pub fn of(scene: &Arc<Scene>, course: &Course, wanted: &(dyn Fn() -> bool + Sync)) -> Result<Self, JudgeError> {
        let rate = scene.grid().sample_rate_hz;
        scene.playable_at(rate)?;
        let carriers = Arc::new(Carriers::new(scene, rate));
        let part = |course: &Course| -> Result<Self, JudgeError> {
            let mut player = Player::on(scene, Some(Arc::clone(&carriers)))?;
            Ok(Self { standing: player.standing(course, wanted)?, moving: player.moving(course, wanted)? })
        };
        let mut all = Self { standing: Vec::new(), moving: Moving::default() };
        for part in each(&course.parts(), part) {
            let Self { standing, moving } = part?;
            all.standing.extend(standing);
            all.moving.moments.extend(moving.moments);
            all.moving.modulation.extend(moving.modulation);
        }
        Ok(all)
    }

    /// How far it is from another of the same course: each measure's error over what is just noticed, at nine of ten poses.
    #[must_use]
    pub fn errors(&self, other: &Self) -> Vec<Audible> {
        self.errors_at(other, OF_POSES)
    }

    /// The errors that a share of the poses does not exceed.
    pub(crate) fn errors_at(&self, other: &Self, share: f64) -> Vec<Audible> {
        [other.standing_errors(&self.standing, share), other.moving_errors(&self.moving, share)].concat()
    }

    /// The errors of what is heard standing, against this.
    pub(crate) fn standing_errors(&self, of: &[Standing], share: f64) -> Vec<Audible> {
        at_most_poses(standing_errors(of, &self.standing), share)
    }

    /// The errors of what is heard on ways, against this.
    pub(crate) fn moving_errors(&self, of: &Moving, share: f64) -> Vec<Audible> {
        let moments = || of.moments.iter().zip(&self.moving.moments);
        let deeper = |(a, b): (&f64, &f64)| ((a * a - b * b).max(0.0) / (JND_MODULATION.powi(2) + JND_DEEPER * b * b)).sqrt();
        at_most_poses(
            vec![
                (Measure::MovingLevels, moments().map(|((a, _), (b, _))| mean_difference_db(a, b) / JND_DB).collect()),
                (Measure::MovingIld, moments().map(|((_, a), (_, b))| (a - b).abs() / JND_DB).collect()),
                (Measure::Modulation, of.modulation.iter().zip(&self.moving.modulation).map(deeper).collect()),
            ],
            share,
        )
    }
}

/// How far a scene is from the measurements that it was not made from, by measure; none where it has none.
///
/// # Errors
/// It cannot be rendered, or its responses cannot be measured.
pub fn errors_to_measurements(scene: &Arc<Scene>) -> Result<Vec<Audible>, JudgeError> {
    let (rate, mut player) = (scene.grid().sample_rate_hz, Player::new(scene)?);
    let (mut rendered, mut measured) = (Vec::new(), Vec::new());
    for held in scene.held_out() {
        let ears = player.respond(held.pose, response_s(scene), &|| true)?;
        rendered.push(Standing { coherence: Vec::new(), ..Standing::of(&ears, rate, &[])? });
        let (itds_s, levels_db, coherence) = (vec![held.measured.itd_s], Vec::new(), Vec::new());
        measured.push(Standing { measures: Some(held.measured), itds_s, levels_db, first: 1.0, coherence });
    }
    Ok(at_most_poses(standing_errors(&rendered, &measured), OF_POSES))
}

/// The largest of some errors; none of none.
#[must_use]
pub fn largest(errors: &[Audible]) -> Audible {
    errors.iter().copied().max_by(|a, b| a.jnds.total_cmp(&b.jnds)).unwrap_or(Audible { jnds: 0.0, measure: Measure::Levels })
}

/// What a closure makes of each of some items, on all processors where that is built.
pub(crate) fn each<I: Sync, T: Send>(items: &[I], one: impl Fn(&I) -> T + Sync + Send) -> Vec<T> {
    #[cfg(feature = "rayon")]
    return rayon::prelude::ParallelIterator::collect(rayon::prelude::ParallelIterator::map(
        rayon::prelude::IntoParallelRefIterator::par_iter(items),
        one,
    ));
    #[cfg(not(feature = "rayon"))]
    return items.iter().map(one).collect();
}

/// Samples that are rendered at a time.
const BLOCK: usize = 4096;

/// Left and right ear.
type Ears = [Vec<f32>; 2];

/// Plays a scene at its own rate, sound by sound, and waits for every decode.
pub(crate) struct Player {
    renderer: Renderer,
}

impl Player {
    pub(crate) fn new(scene: &Arc<Scene>) -> Result<Self, JudgeError> {
        Self::on(scene, None)
    }

    /// On carriers of the scene at its own rate, where there are some.
    fn on(scene: &Arc<Scene>, carriers: Option<Arc<Carriers>>) -> Result<Self, JudgeError> {
        let config = RendererConfig { carriers, ..RendererConfig::inline(scene, scene.grid().sample_rate_hz, 1) };
        Ok(Self { renderer: Renderer::new(Arc::clone(scene), config)? })
    }

    /// The scene's rate, and the critical bands that it has.
    fn bands(&self) -> (f64, Vec<(f64, f64)>) {
        let (rate, top_hz) = (self.renderer.grid().sample_rate_hz, f64::from(self.renderer.scene().top_hz()));
        (rate, critical_bands(top_hz.min(0.45 * rate)))
    }

    /// What is heard at the poses of a course.
    pub(crate) fn standing(&mut self, course: &Course, wanted: &dyn Fn() -> bool) -> Result<Vec<Standing>, JudgeError> {
        let (rate, bands) = self.bands();
        let seconds = (OF_DECAY / 1.5 * response_s(self.renderer.scene())).clamp(0.25, LONGEST_S);
        course.poses.iter().map(|pose| Standing::of(&self.respond(*pose, seconds, wanted)?, rate, &bands)).collect()
    }

    /// What is heard on the ways of a course.
    pub(crate) fn moving(&mut self, course: &Course, wanted: &dyn Fn() -> bool) -> Result<Moving, JudgeError> {
        let (rate, bands) = self.bands();
        let length = |seconds: f64| (seconds * rate) as usize;
        let mut moving = Moving::default();
        if course.ways.is_empty() {
            return Ok(moving);
        }
        let tones: Vec<f64> = TONES.iter().map(|n| ENVELOPE_HZ * f64::from(*n)).filter(|hz| *hz < 0.45 * rate).collect();
        let held: Vec<f32> = (0..length(TURN_S)).map(|i| tone_sum(&tones, i as f64 / rate)).collect();
        let (walked, settled) = (noise(length(WAY_S)), length(SETTLED_S));
        for way in &course.ways {
            let ears = self.render(&walked, |seconds| way.walked(seconds), wanted)?;
            let [left, right] = ears.each_ref().map(|ear| ear[settled..].chunks_exact(length(WINDOW_S)));
            moving.moments.extend(left.zip(right).map(|(l, r)| (levels_db([l, r], rate, &bands), ild_db(l, r).unwrap_or(0.0))));
            let ears = self.render(&held, |seconds| way.turned(seconds), wanted)?;
            let of_ear = |ear: &Vec<f32>| tones.iter().map(|hz| modulation(&ear[settled..], *hz, rate)).collect::<Vec<_>>();
            moving.modulation.extend(ears.iter().flat_map(of_ear));
        }
        Ok(moving)
    }

    /// Both ears of a sound, as long as it; `pose_at` is given seconds from its start.
    fn render(&mut self, dry: &[f32], pose_at: impl Fn(f64) -> Pose, wanted: &dyn Fn() -> bool) -> Result<Ears, JudgeError> {
        self.renderer.reset();
        let (latency, rate) = (self.renderer.latency_samples(), self.renderer.grid().sample_rate_hz);
        let mut ears = [(); 2].map(|()| vec![0.0; dry.len() + latency]);
        let [left, right] = &mut ears;
        for (n, (left, right)) in left.chunks_mut(BLOCK).zip(right.chunks_mut(BLOCK)).enumerate() {
            if !wanted() {
                return Err(JudgeError::Unwanted);
            }
            let start = n * BLOCK;
            let sound = Voice::from(&dry[start.min(dry.len())..(start + BLOCK).min(dry.len())]);
            let live = LiveParams { wait: true, ..LiveParams::default() };
            self.renderer.process(&[sound], [left, right], live, &mut |i| pose_at((start + i) as f64 / rate));
        }
        Ok(ears.map(|mut ear| ear.split_off(latency)))
    }

    /// What a unit impulse after a window of silence becomes for a listener who stands still, over some seconds after it.
    fn respond(&mut self, pose: Pose, seconds: f64, wanted: &dyn Fn() -> bool) -> Result<Ears, JudgeError> {
        let StftGrid { n_fft, sample_rate_hz, .. } = *self.renderer.grid();
        let mut impulse = vec![0.0; n_fft + (seconds * sample_rate_hz) as usize];
        impulse[n_fft] = 1.0;
        self.render(&impulse, |_| pose, wanted)
    }
}

/// By measure the error that a share of the poses does not exceed.
fn at_most_poses(errors: Vec<(Measure, Vec<f64>)>, share: f64) -> Vec<Audible> {
    let of_poses = |(measure, mut values): (Measure, Vec<f64>)| {
        values.sort_by(f64::total_cmp);
        Some(Audible { jnds: quantile(&values, share)? as f32, measure })
    };
    errors.into_iter().filter_map(of_poses).collect()
}

fn standing_errors(of: &[Standing], other: &[Standing]) -> Vec<(Measure, Vec<f64>)> {
    let pairs = || of.iter().zip(other);
    let sounding = || pairs().filter_map(|(a, b)| Some((a.measures.as_ref()?, b.measures.as_ref()?)));
    // A decay that is missing counts as one of no time.
    let decay = |time: fn(&ResponseMeasures) -> Option<f64>| -> Vec<f64> {
        sounding().filter_map(|(a, b)| Some((time(a).unwrap_or(0.0) / time(b)? - 1.0).abs() / JND_DECAY)).collect()
    };
    // Where several lags correlate nearly as well, any of them may be heard.
    let itd = |(a, b): (&Standing, &Standing)| {
        let off_s = a.itds_s.iter().flat_map(|a| b.itds_s.iter().map(move |b| (a - b).abs())).min_by(f64::total_cmp)?;
        (b.first >= LEAST_COHERENCE).then_some(off_s * b.first.powi(2) / JND_ITD_S)
    };
    let clarity = |m: &ResponseMeasures| m.c50_db.unwrap_or(CLEAREST_DB).min(CLEAREST_DB);
    let coherence = |(a, b): (&f64, &f64)| (a - b).abs() / JND_COHERENCE;
    vec![
        (Measure::Itd, pairs().filter_map(itd).collect()),
        (Measure::Ild, sounding().map(|(a, b)| (a.ild_db - b.ild_db).abs() / JND_DB).collect()),
        (Measure::T20, decay(|m| m.t20_s)),
        (Measure::Edt, decay(|m| m.edt_s)),
        (Measure::C50, sounding().map(|(a, b)| (clarity(a) - clarity(b)).abs() / JND_DB).collect()),
        (Measure::Coherence, pairs().flat_map(|(a, b)| a.coherence.iter().zip(&b.coherence).map(coherence)).collect()),
        (Measure::Levels, pairs().map(|(a, b)| mean_difference_db(&a.levels_db, &b.levels_db) / JND_DB).collect()),
    ]
}

impl Standing {
    fn of(ears: &Ears, rate: f64, bands: &[(f64, f64)]) -> Result<Self, JudgeError> {
        let [left, right] = ears.each_ref().map(|ear| &ear[..]);
        let measures = match response_measures(left, right, rate) {
            Ok(measures) => Some(measures),
            Err(Unmeasurable { source: MetricError::Silent, .. }) => None,
            Err(source) => return Err(source.into()),
        };
        let itds_s = itds_s(left, right, rate).unwrap_or_default();
        let loudest = |ear: &[f32]| ear.iter().enumerate().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).map_or(0, |(i, _)| i);
        let until = |seconds: f64| (loudest(left).min(loudest(right)) + (seconds * rate) as usize).min(left.len());
        let (first, early) = (until(FIRST_S), until(EARLY_S));
        let coherence = |span: Range<usize>| interaural_coherence([&left[span.clone()], &right[span]], rate).unwrap_or(1.0);
        let (first, coherence) = (coherence(0..first), vec![coherence(0..early), coherence(early..left.len())]);
        Ok(Self { measures, itds_s, first, levels_db: levels_db([left, right], rate, bands), coherence })
    }
}

/// Edges of critical bands up to a frequency, Hz, from 75 Hz on, after Traunmüller (1990): `z = 26.81 f / (1960 + f) - 0.53`,
/// and 1.22 times as much more from 20.1 on.
fn critical_bands(top_hz: f64) -> Vec<(f64, f64)> {
    let edge = |bark: f64| {
        let z = if bark > 20.1 { 20.1 + (bark - 20.1) / 1.22 } else { bark };
        1960.0 * (z + 0.53) / (26.28 - z)
    };
    let edges: Vec<f64> = (0..24).map(|z| edge(f64::from(z) + 0.25)).take_while(|hz| *hz <= top_hz).collect();
    edges.windows(2).map(|pair| (pair[0], pair[1])).collect()
}

fn levels_db(ears: [&[f32]; 2], rate: f64, bands: &[(f64, f64)]) -> Vec<f64> {
    ears.iter().flat_map(|ear| band_powers(ear, rate, bands)).map(|power| 10.0 * power.max(1e-30).log10()).collect()
}

/// Mean over the bands that are heard in the second of the difference between levels, dB.
fn mean_difference_db(of: &[f64], other: &[f64]) -> f64 {
    let loudest = other.iter().copied().fold(f64::MIN, f64::max);
    let heard = of.iter().zip(other).filter(|(_, level)| **level > loudest - FAINT_DB);
    let (sum, count) = heard.fold((0.0, 0.0), |(sum, count), (a, b)| (sum + (a - b).abs().min(MOST_DB), count + 1.0));
    sum / f64::max(count, 1.0)
}

fn tone_sum(tones: &[f64], at_s: f64) -> f32 {
    (tones.iter().enumerate().map(|(n, hz)| (TAU * hz * at_s + n as f64).sin()).sum::<f64>() / tones.len() as f64) as f32
}

/// Depth of the modulation of a tone's envelope in [`FLUTTER_HZ`], as an amplitude over its mean.
fn modulation(sound: &[f32], hz: f64, rate: f64) -> f64 {
    // Blocks need not be whole numbers of samples long, but each is one period of the envelope's rate.
    let count = (sound.len() as f64 / rate * ENVELOPE_HZ) as usize;
    let block = |n: usize| (n as f64 * rate / ENVELOPE_HZ).round() as usize;
    let turn = Complex64::from_polar(1.0, -TAU * hz / rate);
    let base = |(sum, phase): (Complex64, Complex64), x: &f32| (sum + phase * f64::from(*x), phase * turn);
    let of_block = |block: &[f32]| block.iter().fold((Complex64::ZERO, Complex64::ONE), base).0.norm();
    let envelope = (0..count).map(|n| of_block(&sound[block(n)..block(n + 1).min(sound.len())]));
    let length = count.next_power_of_two();
    let window = |n: usize| 0.5 - 0.5 * (TAU * (n as f64 + 0.5) / count as f64).cos();
    let spectrum = spectrum(envelope.enumerate().map(|(n, v)| window(n) * v), length);
    let inside = |k: &usize| FLUTTER_HZ.contains(&(ENVELOPE_HZ * *k as f64 / length as f64));
    let flutter: f64 = (1..length / 2).filter(inside).map(|k| spectrum[k].norm_sqr()).sum();
    // A sine of depth m has a quarter of m squared on each side, which the window spreads to 3/2 of it, and the transform over
    // as many bins more as it is longer.
    (4.0 * flutter / 1.5 / spectrum[0].norm_sqr().max(1e-30) * count as f64 / length as f64).sqrt()
}

#[cfg(test)]
mod tests;
