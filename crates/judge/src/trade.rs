//! Speed against accuracy: each setting of a scene, its cost beside its error.

#[cfg(feature = "rayon")]
mod all;
#[cfg(feature = "rayon")]
mod heard;
#[cfg(feature = "rayon")]
mod reduce;

#[cfg(feature = "rayon")]
pub use all::{trade, trade_beside};
#[cfg(feature = "rayon")]
pub use reduce::reduced;

use crate::cost::{Setting, TierCost, setting_costs};
use crate::error::JudgeError;
use crate::measures::{Comparison, MeanErrors, Unmeasurable, response_measures, response_s};
use crate::poses::{noise, poses_within, walk};
use promenade_core::{BlockParams, LiveParams, OCTAVES_HZ, Pose, Quality, ResponseMeasures, Scene, Tier};
use promenade_fourier::spectrum;
use promenade_metrics::{MetricError, lsd_db, rwavs};
use promenade_player::{Ears, Stream};
use std::sync::Arc;

/// Differences that are just noticed, of decay times as a share: these, C50 and levels (strength) after ISO 3382-1:2009,
/// annex A; ITD after Klumpp and Eady (1956), ILD after Mills (1960).
pub const JND_DECAY: f64 = 0.05;
/// Of levels between the ears or of a third-octave (Lindau 2008), and of clarity, dB.
pub const JND_DB: f64 = 1.0;
/// Of a delay between the ears, seconds.
pub const JND_ITD_S: f64 = 20e-6;
/// Clarity of a response that has nothing after 50 ms, and of all that are clearer, dB.
const CLEAREST_DB: f64 = 20.0;
/// Silence is so much below what is heard, dB.
const SILENT_DB: f64 = 60.0;
/// Poses at which responses are compared, and their seed.
const POSES: usize = 6;
const SEED: u64 = 1;
/// Seconds of noise that are heard while walking, and that costs are measured on.
const WALK_S: f64 = 4.0;
const COST_S: f64 = 1.0;

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
    /// Root mean square of the errors, each over the difference that is just noticed: 20 us, 1 dB, 5 % (ISO 3382-1:2009, annex
    /// A; Klumpp and Eady 1956; Mills 1960).
    #[must_use]
    pub fn jnds(&self) -> f64 {
        let dbs = [self.ild_db, self.c50_db, self.octaves_db].map(|db| db / JND_DB);
        root_mean_square(dbs.into_iter().chain([self.itd_s / JND_ITD_S]).chain(self.t20.map(|t| t / JND_DECAY)))
    }
}

/// The nodes of a scene's tables that are thinned together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Nodes {
    /// Azimuths or yaws.
    Directions,
    /// Elevations, or pitches and rolls.
    Elevations,
    /// Places along x, y and z.
    Places,
}

impl Nodes {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Directions, Self::Elevations, Self::Places];

    /// What they are called.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Directions => "directions",
            Self::Elevations => "elevations",
            Self::Places => "places",
        }
    }
}

/// What of a scene is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Less {
    /// The first taps; the late part begins where they end, as much louder as it has decayed until its old beginning.
    Taps(usize),
    /// The first images, which are the strongest.
    Images(usize),
    /// Every second of these nodes.
    Half(Nodes),
}

/// How a setting is had.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Way {
    /// The scene plays it as it is, in its tier.
    Tier,
    /// By so many decodes a second.
    Decodes(f32),
    /// By a scene that holds less.
    Less(Less),
}

/// One setting of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct TradePoint {
    /// What is played, such as "standard" or "standard, 12 of 24 taps".
    pub name: String,
    /// The tier.
    pub tier: Tier,
    /// How it is had.
    pub way: Way,
    /// Processor seconds per second of audio of one core, walking and turning.
    pub real_time: f64,
    /// Processor time over that of a bare short-time transform.
    pub times_stft: f64,
    /// Bytes of the scene in memory.
    pub memory_bytes: usize,
    /// Against the scene's best tier with all that it holds.
    pub to_best: TradeErrors,
    /// Log-spectral distance to it of noise heard while walking, dB.
    pub walking_db: f64,
    /// Against the measurements that the scene was not baked from, where it has any.
    pub to_truth: Option<MeanErrors>,
    /// How far beside the best someone points who knows it, lateral angle, degrees, mean over turns of the head; `None` where
    /// it was not asked for, or nobody knows where the emitter is.
    pub heard_off_deg: Option<f64>,
    /// Whether another setting costs no more and errs no more, standing and walking.
    pub dominated: bool,
}

impl TradePoint {
    /// The error that settings are compared by, in differences that are just noticed: to the measurements where there are any,
    /// else to the scene's best.
    #[must_use]
    pub fn error_jnds(&self) -> f64 {
        self.to_truth.as_ref().map_or_else(|| self.to_best.jnds(), truth_jnds)
    }
}

/// [`TradeErrors::jnds`] of errors to measurements.
#[must_use]
pub fn truth_jnds(errors: &MeanErrors) -> f64 {
    let dbs = [Some(errors.ild_db), errors.c50_db].into_iter().flatten().map(|db| db / JND_DB);
    root_mean_square(dbs.chain([errors.itd_s / JND_ITD_S]).chain(errors.t20.map(|t| t / JND_DECAY)))
}

fn root_mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), v| (sum + v * v, count + 1.0));
    (sum / f64::max(count, 1.0)).sqrt()
}

/// The scene itself in each tier that it has, cheapest first.
#[must_use]
pub fn tiers(scene: &Arc<Scene>) -> Vec<Setting> {
    let setting = |tier: Tier| Setting { name: tier.name().to_owned(), scene: Arc::clone(scene), quality: tier.into() };
    scene.tiers().map(setting).collect()
}

/// What settings of a scene are held against: the best of its tiers, with a decode at every hop.
#[must_use]
pub fn best(scene: &Arc<Scene>) -> Setting {
    let live = LiveParams { rate_hz: (1.0 / scene.grid().hop_s()) as f32, ..LiveParams::default() };
    let tier = scene.tiers().max().unwrap_or_default();
    Setting { name: format!("{}, the best", tier.name()), scene: Arc::clone(scene), quality: Quality { tier, live } }
}

/// Processor time of settings for a host's rate and block, on a second of noise; `None` for a tier that only the scene's own
/// rate has.
#[must_use]
pub fn costs(settings: &[&Setting], sample_rate_hz: f64, block: usize) -> Vec<Option<TierCost>> {
    setting_costs(settings, sample_rate_hz, block, COST_S)
}

/// Each tier of a scene, cheapest first: what it costs at a host's rate and block, and how far it is off. A tier that only the
/// scene's own rate has is left out at others.
///
/// # Errors
/// The result is no longer wanted, or what is heard cannot be compared.
pub fn tier_points(
    scene: &Arc<Scene>,
    sample_rate_hz: f64,
    block: usize,
    wanted: &dyn Fn() -> bool,
) -> Result<Vec<TradePoint>, JudgeError> {
    let best = Rendering::of(&best(scene), wanted)?;
    let mut points = Vec::new();
    for setting in tiers(scene) {
        let heard = Rendering::of(&setting, wanted)?;
        if let Some(cost) = costs(&[&setting], sample_rate_hz, block).into_iter().flatten().next() {
            points.push(TradePoint::new(&setting, Way::Tier, &cost, &heard, &best)?);
        }
    }
    Ok(points)
}

impl TradePoint {
    /// A setting, what it costs and how it is heard beside the best; not dominated by any other yet.
    ///
    /// # Errors
    /// What is heard while walking cannot be compared.
    pub fn new(setting: &Setting, way: Way, cost: &TierCost, heard: &Rendering, best: &Rendering) -> Result<Self, JudgeError> {
        Ok(Self {
            name: setting.name.clone(),
            tier: setting.quality.tier,
            way,
            real_time: cost.real_time,
            times_stft: cost.times_stft,
            memory_bytes: setting.scene.memory_bytes(),
            to_best: heard.errors(best),
            walking_db: heard.walking_db(best)?,
            to_truth: heard.to_truth,
            heard_off_deg: None,
            dominated: false,
        })
    }
}

/// What one setting sounds like.
pub struct Rendering {
    /// Measures and levels by ear and octave, dB, at each pose; a tier that plays the direct sound alone has no measures where
    /// that is hidden.
    poses: Vec<(Option<ResponseMeasures>, Vec<f64>)>,
    walk: Ears,
    to_truth: Option<MeanErrors>,
}

impl Rendering {
    /// Plays a setting at the scene's own rate, as long as that is `wanted`.
    ///
    /// # Errors
    /// It cannot be rendered, its responses cannot be measured, or they are no longer asked for.
    pub fn of(setting: &Setting, wanted: &dyn Fn() -> bool) -> Result<Self, JudgeError> {
        let scene = &setting.scene;
        let rate = scene.grid().sample_rate_hz;
        let Quality { tier, live } = setting.quality;
        let mut stream = Stream::new(scene, rate, &BlockParams { tier, live, ..BlockParams::default() })?;
        let seconds = response_s(scene);
        let mut respond = |pose: Pose, name: &str| {
            let ears = stream.respond(pose, seconds, wanted).ok_or(JudgeError::Unwanted)?;
            let [left, right] = &ears;
            let what = || format!("{} {name}", setting.name);
            let measures = match response_measures(left, right, rate) {
                Ok(measures) => Some(measures),
                Err(Unmeasurable { source: MetricError::Silent, .. }) => None,
                Err(source) => return Err(JudgeError::Unmeasurable { what: what(), source }),
            };
            Ok((measures, ears))
        };
        let mut poses = Vec::new();
        for pose in poses_within(scene.bounds(), scene.start_pose(), POSES, SEED) {
            let (measures, ears) = respond(pose, "at a pose")?;
            poses.push((measures, octaves_db(&ears, rate, scene.top_hz())));
        }
        let mut comparisons = Vec::new();
        for held in scene.held_out() {
            let (rendered, _) = respond(held.pose, &held.name)?;
            comparisons.extend(rendered.map(|rendered| Comparison {
                name: held.name.clone(),
                measured: held.measured,
                rendered,
                levels_db: Default::default(),
            }));
        }
        let start = scene.start_pose();
        let walk = stream.render(&noise((WALK_S * rate) as usize), |seconds| walk(&start, seconds), wanted);
        Ok(Self { poses, walk: walk.ok_or(JudgeError::Unwanted)?, to_truth: MeanErrors::of(&comparisons) })
    }

    fn errors(&self, best: &Self) -> TradeErrors {
        let pairs = || self.poses.iter().zip(&best.poses);
        let mean = |values: Vec<f64>| values.iter().sum::<f64>() / values.len().max(1) as f64;
        let sounding = || pairs().filter_map(|((a, _), (b, _))| Some((a.as_ref()?, b.as_ref()?)));
        let t20 = |m: &Option<ResponseMeasures>| m.and_then(|m| m.t20_s);
        let clarity = |m: &Option<ResponseMeasures>| m.and_then(|m| m.c50_db).unwrap_or(CLEAREST_DB).min(CLEAREST_DB);
        let t20: Vec<f64> =
            pairs().filter_map(|((a, _), (b, _))| t20(b).map(|t| (t20(a).unwrap_or(0.0) / t - 1.0).abs())).collect();
        TradeErrors {
            itd_s: mean(sounding().map(|(a, b)| (a.itd_s - b.itd_s).abs()).collect()),
            ild_db: mean(sounding().map(|(a, b)| (a.ild_db - b.ild_db).abs()).collect()),
            t20: (!t20.is_empty()).then(|| mean(t20)),
            c50_db: mean(pairs().map(|((a, _), (b, _))| (clarity(a) - clarity(b)).abs()).collect()),
            octaves_db: mean(
                pairs()
                    .flat_map(|((_, a), (_, b))| {
                        a.iter().zip(b).map(|(a, b)| (a - b).abs().min(SILENT_DB)).collect::<Vec<f64>>()
                    })
                    .collect(),
            ),
        }
    }

    fn walking_db(&self, best: &Self) -> Result<f64, JudgeError> {
        let ear = |ear: usize| lsd_db(&self.walk[ear], &best.walk[ear], rwavs::SPECTROGRAM);
        let both = ear(0).and_then(|left| Ok(0.5 * (left + ear(1)?)));
        both.map_err(JudgeError::Walk)
    }
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
    fn a_tier_that_costs_less_errs_more_and_the_best_errs_nothing() {
        let scene = room_with_images(8_000.0, 0.2, 0.05, 4);
        let best = Rendering::of(&best(&scene), &|| true).unwrap();
        let tiers = tiers(&scene);
        let costs = costs(&tiers.iter().collect::<Vec<_>>(), 8_000.0, 256);
        let point = |n: usize| {
            let heard = Rendering::of(&tiers[n], &|| true).unwrap();
            TradePoint::new(&tiers[n], Way::Tier, &costs[n].unwrap(), &heard, &best).unwrap()
        };
        let (draft, standard) = (point(0), point(1));
        assert!(standard.error_jnds() < 1e-6 && standard.walking_db < 1e-6, "{standard:?}");
        assert!(draft.error_jnds() > 1.0 && draft.walking_db > 1.0, "{draft:?}");
        assert!(draft.real_time > 0.0 && standard.real_time > 0.0);
        assert_eq!(Rendering::of(&tiers[0], &|| false).err(), Some(JudgeError::Unwanted));
    }

    #[test]
    fn a_tier_that_is_silent_where_the_source_is_hidden_has_figures() {
        let room = room_with_images(8_000.0, 0.2, 0.05, 4);
        let mut parts = room.parts().clone();
        parts.images.as_mut().unwrap().direct.fill(0.0);
        let hidden = Arc::new(Scene::new(parts).unwrap());
        let [draft, best] = [tiers(&hidden).remove(0), best(&hidden)].map(|setting| Rendering::of(&setting, &|| true).unwrap());
        let errors = draft.errors(&best);
        assert!(errors.jnds() > 0.1 && errors.octaves_db <= SILENT_DB, "{errors:?}");
        let silence = Rendering { poses: vec![(None, vec![-200.0; 2]); POSES], ..best };
        let other = Rendering::of(&tiers(&room).remove(1), &|| true).unwrap();
        let errors = silence.errors(&other);
        assert!((errors.octaves_db, errors.itd_s) == (SILENT_DB, 0.0) && errors.jnds().is_finite(), "{errors:?}");
    }

    #[test]
    fn errors_are_counted_in_differences_that_are_just_noticed() {
        let errors = TradeErrors { itd_s: 20e-6, ild_db: 1.0, t20: Some(0.05), c50_db: 1.0, octaves_db: 1.0 };
        assert!((errors.jnds() - 1.0).abs() < 1e-12);
        assert!((TradeErrors { t20: None, itd_s: 60e-6, ..errors }.jnds() - 3.0_f64.sqrt()).abs() < 1e-12);
    }
}
