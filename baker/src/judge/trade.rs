//! Speed against accuracy: a scene played with less and less of what it holds, each setting's cost beside its error.

mod reduce;

use crate::error::BakeError;
use crate::judge::cost::{Setting, noise, setting_costs, walk};
use crate::judge::measure::{Comparison, MeanErrors, response_s};
use crate::judge::response_measures::response_measures;
use crate::judge::streaming::poses_within;
use crate::player::{Ears, Player, Playing};
use crate::sources::simulation::OCTAVES_HZ;
use promenade_core::{HeldOut, LiveParams, Pose, Quality, ResponseMeasures, Scene, Tier};
use promenade_fourier::spectrum;
use promenade_metrics::{lsd_db, rwavs};
use rayon::prelude::*;
use std::sync::Arc;

/// Differences that are just noticed: T20 and C50 after ISO 3382-1:2009, annex A, as levels (strength); ITD after Klumpp and Eady (1956),
/// ILD after Mills (1960).
const JND_T20: f64 = 0.05;
const JND_DB: f64 = 1.0;
const JND_ITD_S: f64 = 20e-6;
/// Clarity of a response that has nothing after 50 ms, and of all that are clearer, dB.
const CLEAREST_DB: f64 = 20.0;
/// Poses at which responses are compared, and their seed.
const POSES: usize = 6;
const SEED: u64 = 1;
/// Seconds of noise that are heard while walking, and that costs are measured on.
const WALK_S: f64 = 4.0;
const COST_S: f64 = 1.0;
/// Decodes a second that are tried, besides the usual rate.
const DECODE_RATES_HZ: [f32; 4] = [5.0, 10.0, 20.0, 80.0];

/// Errors of one setting, means over poses and ears of absolute differences.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TradeErrors {
    /// Interaural time difference, seconds.
    pub itd_s: f64,
    /// Interaural level difference, dB.
    pub ild_db: f64,
    /// Reverberation time T20, as a share; `None` where no pose has one. A decay that is missing counts as one of no time.
    pub t20: Option<f64>,
    /// Clarity C50, dB, of values up to 20 dB.
    pub c50_db: f64,
    /// Levels of the octaves from 125 Hz on, dB.
    pub octaves_db: f64,
}

impl TradeErrors {
    /// Root mean square of the errors, each over the difference that is just noticed: 20 us, 1 dB, 5 % (ISO 3382-1:2009, annex A; Klumpp
    /// and Eady 1956; Mills 1960).
    #[must_use]
    pub fn jnds(&self) -> f64 {
        let dbs = [self.ild_db, self.c50_db, self.octaves_db].map(|db| db / JND_DB);
        root_mean_square(dbs.into_iter().chain([self.itd_s / JND_ITD_S]).chain(self.t20.map(|t| t / JND_T20)))
    }
}

/// One setting of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct TradePoint {
    /// What is played, such as "standard" or "standard, 12 of 24 taps".
    pub name: String,
    /// The tier.
    pub tier: Tier,
    /// Whether the scene offers it as it is: a tier of its own.
    pub offered: bool,
    /// Processor seconds per second of audio of one core, walking and turning.
    pub real_time: f64,
    /// The same over that of a bare short-time transform.
    pub times_stft: f64,
    /// Bytes of the scene in memory.
    pub memory_bytes: usize,
    /// Against the scene's best tier with all that it holds.
    pub to_best: TradeErrors,
    /// Log-spectral distance to it of noise heard while walking, dB.
    pub walking_db: f64,
    /// Against the measurements that the scene was not baked from, where it has any.
    pub to_truth: Option<MeanErrors>,
    /// Whether another setting costs no more and errs no more, standing and walking.
    pub dominated: bool,
}

impl TradePoint {
    /// The error that settings are compared by, in differences that are just noticed: to the measurements where there are any, else to the
    /// scene's best.
    #[must_use]
    pub fn error_jnds(&self) -> f64 {
        self.to_truth.as_ref().map_or_else(|| self.to_best.jnds(), truth_jnds)
    }
}

/// [`TradeErrors::jnds`] of errors to measurements.
#[must_use]
pub fn truth_jnds(errors: &MeanErrors) -> f64 {
    let dbs = [Some(errors.ild_db), errors.c50_db].into_iter().flatten().map(|db| db / JND_DB);
    root_mean_square(dbs.chain([errors.itd_s / JND_ITD_S]).chain(errors.t20.map(|t| t / JND_T20)))
}

fn root_mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), v| (sum + v * v, count + 1.0));
    (sum / f64::max(count, 1.0)).sqrt()
}

/// Plays a scene in every tier, and with fewer taps, images, nodes and decodes as far as it has them; costs are for a host rate and block.
/// The cheapest comes first.
///
/// # Errors
/// A setting that cannot be rendered, or whose responses cannot be measured.
pub fn trade(scene: &Arc<Scene>, sample_rate_hz: f64, block: usize) -> Result<Vec<TradePoint>, BakeError> {
    let settings = settings(scene);
    let best = settings.iter().map(|(setting, _)| setting.quality.tier).max().unwrap_or_default();
    let every_hop = LiveParams { rate_hz: (1.0 / scene.grid().hop_s()) as f32, ..LiveParams::default() };
    let best = Heard::of(&Setting {
        name: String::new(),
        scene: Arc::clone(scene),
        quality: Quality { tier: best, live: every_hop },
    })?;
    let heard: Result<Vec<Heard>, BakeError> = settings.par_iter().map(|(setting, _)| Heard::of(setting)).collect();
    let only: Vec<&Setting> = settings.iter().map(|(setting, _)| setting).collect();
    let costs = setting_costs(&only, sample_rate_hz, block, COST_S);
    let mut points = Vec::new();
    for (((setting, offered), heard), cost) in settings.iter().zip(heard?).zip(costs) {
        // A tier that only the scene's own rate has costs nothing at another.
        let Some(cost) = cost else { continue };
        points.push(TradePoint {
            name: setting.name.clone(),
            tier: setting.quality.tier,
            offered: *offered,
            real_time: cost.real_time,
            times_stft: cost.times_stft,
            memory_bytes: setting.scene.memory_bytes(),
            to_best: heard.errors(&best),
            walking_db: heard.walking_db(&best)?,
            to_truth: heard.to_truth,
            dominated: false,
        });
    }
    points.sort_by(|a, b| a.real_time.total_cmp(&b.real_time));
    for i in 0..points.len() {
        let measures = |p: &TradePoint| [p.real_time, p.error_jnds(), p.walking_db];
        let own = measures(&points[i]);
        let no_worse = |other: &TradePoint| measures(other).iter().zip(own).all(|(other, own)| *other <= own);
        points[i].dominated = points.iter().enumerate().any(|(j, other)| j != i && no_worse(other));
    }
    Ok(points)
}

/// Every setting, and whether the scene offers it as it is.
fn settings(scene: &Arc<Scene>) -> Vec<(Setting, bool)> {
    let mut out: Vec<(Setting, bool)> = Vec::new();
    for tier in scene.tiers() {
        out.push((Setting { name: tier.name().to_owned(), scene: Arc::clone(scene), quality: tier.into() }, true));
        if tier >= Tier::High {
            for rate_hz in DECODE_RATES_HZ {
                let name = format!("{}, {rate_hz} decodes/s", tier.name());
                let live = LiveParams { rate_hz, ..LiveParams::default() };
                out.push((Setting { name, scene: Arc::clone(scene), quality: Quality { tier, live } }, false));
            }
        }
    }
    // What is left out is left out of the best tier that plays it at every hop.
    let tier = scene.played_tier(Tier::Standard);
    for (what, reduced) in reduce::all(scene) {
        let name = format!("{}, {what}", tier.name());
        out.push((Setting { name, scene: Arc::new(reduced), quality: tier.into() }, false));
    }
    out
}

/// What one setting sounds like.
struct Heard {
    /// Measures and levels by ear and octave, dB, at each pose.
    poses: Vec<(ResponseMeasures, Vec<f64>)>,
    walk: Ears,
    to_truth: Option<MeanErrors>,
}

impl Heard {
    fn of(setting: &Setting) -> Result<Self, BakeError> {
        let scene = &setting.scene;
        let rate = scene.grid().sample_rate_hz;
        let (lead, length_s) = (scene.grid().n_fft, response_s(scene));
        let mut impulse = vec![0.0; lead + (length_s * rate) as usize];
        impulse[lead] = 1.0;
        let respond = |pose: Pose, name: &str| {
            let ears = player(setting)?.render(&impulse, &mut |_| pose)?;
            let [left, right] = &ears;
            let measures = response_measures(left, right, rate);
            let measures = measures.map_err(|why| BakeError::unmeasurable(format!("'{}' {name}", setting.name), why))?;
            Ok::<_, BakeError>((measures, ears))
        };
        let poses = poses_within(scene.bounds(), scene.start_pose(), POSES, SEED);
        let poses: Result<Vec<_>, BakeError> = poses
            .into_iter()
            .map(|pose| respond(pose, "at a pose").map(|(measures, ears)| (measures, octaves_db(&ears, rate, scene.top_hz()))))
            .collect();
        let held = |held: &HeldOut| {
            let (rendered, _) = respond(held.pose, &held.name)?;
            Ok(Comparison { name: held.name.clone(), measured: held.measured, rendered })
        };
        let comparisons: Result<Vec<Comparison>, BakeError> = scene.held_out().iter().map(held).collect();
        let noise = noise((WALK_S * rate) as usize);
        let start = scene.start_pose();
        let walk = player(setting)?.render(&noise, &mut |seconds| walk(&start, seconds))?;
        Ok(Self { poses: poses?, walk, to_truth: MeanErrors::of(&comparisons?) })
    }

    fn errors(&self, best: &Self) -> TradeErrors {
        let pairs = || self.poses.iter().zip(&best.poses);
        let mean = |values: Vec<f64>| values.iter().sum::<f64>() / values.len().max(1) as f64;
        let clarity = |m: &ResponseMeasures| m.c50_db.unwrap_or(CLEAREST_DB).min(CLEAREST_DB);
        let t20: Vec<f64> =
            pairs().filter_map(|((a, _), (b, _))| b.t20_s.map(|t| (a.t20_s.unwrap_or(0.0) / t - 1.0).abs())).collect();
        TradeErrors {
            itd_s: mean(pairs().map(|((a, _), (b, _))| (a.itd_s - b.itd_s).abs()).collect()),
            ild_db: mean(pairs().map(|((a, _), (b, _))| (a.ild_db - b.ild_db).abs()).collect()),
            t20: (!t20.is_empty()).then(|| mean(t20)),
            c50_db: mean(pairs().map(|((a, _), (b, _))| (clarity(a) - clarity(b)).abs()).collect()),
            octaves_db: mean(
                pairs()
                    .flat_map(|((_, a), (_, b))| a.iter().zip(b).map(|(a, b)| (a - b).abs()).collect::<Vec<f64>>())
                    .collect(),
            ),
        }
    }

    fn walking_db(&self, best: &Self) -> Result<f64, BakeError> {
        let ear = |ear: usize| lsd_db(&self.walk[ear], &best.walk[ear], rwavs::SPECTROGRAM);
        let both = ear(0).and_then(|left| Ok(0.5 * (left + ear(1)?)));
        both.map_err(|why| BakeError::argument("noise heard while walking", "one that can be compared", why))
    }
}

fn player(setting: &Setting) -> Result<Player, BakeError> {
    let Quality { tier, live } = setting.quality;
    let player = Player::new(&setting.scene, setting.scene.grid().sample_rate_hz, Some(Playing::Stream(tier)))?;
    Ok(player.with_decode_rate(live.rate_hz))
}

/// Level of each octave below `top_hz` at both ears, dB.
fn octaves_db(ears: &Ears, sample_rate_hz: f64, top_hz: f32) -> Vec<f64> {
    let length = ears[0].len().next_multiple_of(2);
    let hz = |k: usize| k as f64 * sample_rate_hz / length as f64;
    let mut out = Vec::new();
    for ear in ears {
        let bins = spectrum(ear.iter().map(|x| f64::from(*x)), length);
        for centre in
            OCTAVES_HZ.map(f64::from).into_iter().filter(|centre| centre * std::f64::consts::SQRT_2 <= f64::from(top_hz))
        {
            let inside = |k: &usize| (centre / std::f64::consts::SQRT_2..centre * std::f64::consts::SQRT_2).contains(&hz(*k));
            let energy: f64 = (0..bins.len()).filter(inside).map(|k| bins[k].norm_sqr()).sum();
            out.push(10.0 * energy.max(1e-20).log10());
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_testing::scenes::room_with_images;

    #[test]
    fn what_costs_less_errs_more_and_the_scene_itself_errs_nothing() {
        let scene = room_with_images(8_000.0, 0.2, 0.05, 4);
        let points = trade(&scene, 8_000.0, 256).unwrap();
        assert!(points.windows(2).all(|pair| pair[0].real_time <= pair[1].real_time));
        let get = |name: &str| points.iter().find(|p| p.name == name).unwrap_or_else(|| panic!("{name} in {points:?}"));
        let (draft, standard) = (get("draft"), get("standard"));
        assert!(draft.offered && standard.offered && !get("standard, 6 of 24 taps").offered);
        assert!(standard.error_jnds() < 1e-6 && standard.walking_db < 1e-6, "{standard:?}");
        assert!(draft.error_jnds() > 1.0 && draft.walking_db > 1.0, "{draft:?}");
        for p in &points {
            let better =
                |q: &TradePoint| q.real_time < p.real_time && q.error_jnds() < p.error_jnds() && q.walking_db < p.walking_db;
            assert!(p.dominated || !points.iter().any(better), "{}", p.name);
        }
    }

    #[test]
    fn errors_are_counted_in_differences_that_are_just_noticed() {
        let errors = TradeErrors { itd_s: 20e-6, ild_db: 1.0, t20: Some(0.05), c50_db: 1.0, octaves_db: 1.0 };
        assert!((errors.jnds() - 1.0).abs() < 1e-12);
        assert!((TradeErrors { t20: None, itd_s: 60e-6, ..errors }.jnds() - 3.0_f64.sqrt()).abs() < 1e-12);
    }
}
