//! A scene in a listener's terms: how far from the measured direction someone points who knows the measured head.

use crate::bake::layout::Layout;
use crate::bake::model_head::model_head;
use crate::error::BakeError;
use crate::sources::responses::Responses;
use promenade_core::glam::Vec3;
use promenade_core::random::Random;
use promenade_core::{Head, Scene};
use promenade_fourier::num_complex::Complex32;
use promenade_fourier::signal;
use promenade_metrics::{Cues, MetricError, lateral_deg, pointed};
use promenade_player::render_response;
use std::sync::Arc;

/// Draws of noise at each pose, the same for all that is heard there.
const DRAWS: u64 = 200;
/// Directions higher or lower than this, as the vertical part of a unit vector, have an elevation.
const LEVEL_Z: f32 = 0.1;
/// Seconds of a rendered response that are looked at, and of a head's.
const LENGTH_S: f64 = 0.05;
const HEAD_S: f64 = 0.01;
const HEAD_LEAD_S: f64 = 0.002;

/// How far off something heard in the place of the measurements is, means over poses.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HeardOff {
    /// Between the mean lateral angles that are pointed at, degrees.
    pub lateral_deg: f64,
    /// Between the mean elevations that are pointed at, degrees; `None` where all was measured at the height of the ears.
    pub elevation_deg: Option<f64>,
    /// Share of the draws that point ahead where the measurement is heard behind, or the other way round; `None` where only one
    /// side was measured.
    pub confused: Option<f64>,
}

/// What a listener makes of a scene and of what it is compared with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Listened {
    /// Held-out poses.
    pub poses: usize,
    /// The scene.
    pub scene: HeardOff,
    /// The nearest of the measurements that it was baked from.
    pub nearest: HeardOff,
    /// KEMAR in a free field, in the place of the measured head.
    pub other_head: HeardOff,
}

/// Lets a listener who knows the head of `set`, from all its directions, hear a scene at its held-out poses, which are in the
/// set by their names.
///
/// # Errors
/// A scene without held-out poses that the set has, responses without cues, a scene that cannot be rendered.
pub fn listened(scene: &Arc<Scene>, set: &Responses) -> Result<Listened, BakeError> {
    let rate = scene.grid().sample_rate_hz;
    if (set.sample_rate_hz - rate).abs() > 0.5 {
        let found = format!("{} Hz", set.sample_rate_hz);
        return Err(BakeError::argument("responses for the listener", format!("the scene's {rate} Hz"), found));
    }
    let layout = Layout::of(set)?;
    let mut known = Vec::new();
    for (response, site) in set.responses.iter().zip(&layout.sites) {
        let cues = Cues::of(&response.left, &response.right, rate).map_err(named(&response.name))?;
        known.push((site.direction.as_dvec3().to_array(), cues));
    }
    let is_held = |name: &str| scene.held_out().iter().any(|held| held.name == name);
    let baked: Vec<usize> = (0..known.len()).filter(|i| !is_held(&set.responses[*i].name)).collect();
    let held: Vec<usize> = (0..known.len()).filter(|i| is_held(&set.responses[*i].name)).collect();
    if held.is_empty() || baked.is_empty() {
        let found = format!("{} of them", held.len());
        return Err(BakeError::argument(
            "responses for the listener",
            "those that the scene was baked and held out from",
            found,
        ));
    }
    let listening = Listening { scene, set, layout: &layout, known: &known, baked: &baked };
    let rivals: Vec<[Cues; 3]> = held.iter().map(|&pose| listening.rivals(pose)).collect::<Result<_, BakeError>>()?;
    // Levels are a scene's own, or a head's: one gain for all poses.
    let louder = |kind: usize| {
        let differences = held.iter().zip(&rivals).map(|(pose, of)| known[*pose].1.level_db() - of[kind].level_db());
        differences.sum::<f64>() / held.len() as f64
    };
    let louder = [louder(0), 0.0, louder(2)];
    let mut offs = [Vec::new(), Vec::new(), Vec::new()];
    for (&pose, rivals) in held.iter().zip(rivals) {
        let noise = draws(pose as u64, known[pose].1.len());
        let truth = pointed(&known[pose].1, &known, &noise);
        for ((offs, rival), louder) in offs.iter_mut().zip(rivals).zip(louder) {
            offs.push(off(&truth, &pointed(&rival.raised(louder), &known, &noise)));
        }
    }
    let elevated = known.iter().any(|(direction, _)| direction[2].abs() > f64::from(LEVEL_Z));
    let sides = |sign: f64| known.iter().any(|(direction, _)| sign * direction[0] > 0.2);
    let around = sides(1.0) && sides(-1.0);
    let [scene, nearest, other_head] = offs.map(|offs| {
        let mean = |of: fn(&[f64; 3]) -> f64| offs.iter().map(of).sum::<f64>() / offs.len() as f64;
        HeardOff {
            lateral_deg: mean(|off| off[0]),
            elevation_deg: elevated.then(|| mean(|off| off[1])),
            confused: around.then(|| mean(|off| off[2])),
        }
    });
    Ok(Listened { poses: held.len(), scene, nearest, other_head })
}

/// What is listened to.
struct Listening<'a> {
    scene: &'a Arc<Scene>,
    set: &'a Responses,
    layout: &'a Layout,
    /// Direction and cues of each response.
    known: &'a [([f64; 3], Cues)],
    /// The responses that the scene was baked from, by number.
    baked: &'a [usize],
}

impl Listening<'_> {
    /// What is heard in the place of a response, by its number: the scene, the nearest response, KEMAR.
    fn rivals(&self, pose: usize) -> Result<[Cues; 3], BakeError> {
        let Self { scene, set, layout, known, baked } = self;
        let rate = scene.grid().sample_rate_hz;
        let (site, lead) = (&layout.sites[pose], scene.grid().n_fft);
        let name = &set.responses[pose].name;
        let [left, right] = render_response(scene, layout.poses[pose], lead, lead + (LENGTH_S * rate) as usize)?;
        let cues = Cues::of(&left, &right, rate).map_err(named(name))?;
        let apart = |i: &&usize| layout.sites[**i].distance(site);
        let nearest = baked.iter().min_by(|a, b| apart(a).total_cmp(&apart(b))).copied().unwrap_or(pose);
        let [left, right] = head_response(model_head(), site.direction, rate);
        let other = Cues::of(&left, &right, rate).map_err(named("KEMAR"))?;
        Ok([cues, known[nearest].1.clone(), other])
    }
}

/// For `map_err`: the response of a name has no cues.
fn named(name: &str) -> impl Fn(MetricError) -> BakeError {
    let name = name.to_owned();
    move |why| crate::error::unmeasurable(&format!("response '{name}'"), why)
}

/// Differences between mean lateral angles and mean elevations, degrees, and the share of draws on another side of the ears.
fn off(truth: &[[f64; 3]], heard: &[[f64; 3]]) -> [f64; 3] {
    let mean = |of: &dyn Fn([f64; 3]) -> f64, all: &[[f64; 3]]| all.iter().map(|d| of(*d)).sum::<f64>() / all.len() as f64;
    let elevation = |d: [f64; 3]| d[2].clamp(-1.0, 1.0).asin().to_degrees();
    let other_side = truth.iter().zip(heard).filter(|(a, b)| a[0] * b[0] < 0.0).count();
    [
        (mean(&lateral_deg, heard) - mean(&lateral_deg, truth)).abs(),
        (mean(&elevation, heard) - mean(&elevation, truth)).abs(),
        other_side as f64 / truth.len() as f64,
    ]
}

/// Standard normal numbers.
fn draws(pose: u64, len: usize) -> Vec<Vec<f64>> {
    let mut random = Random::new(pose.wrapping_add(1));
    (0..DRAWS).map(|_| (0..len).map(|_| f64::from(random.normal())).collect()).collect()
}

/// What a head hears of a direction in a free field.
fn head_response(head: &Head, direction: Vec3, rate: f64) -> [Vec<f32>; 2] {
    let n_fft = ((HEAD_S * rate) as usize).next_power_of_two();
    let lead = (HEAD_LEAD_S * rate) as usize;
    head.ears(direction).spectra(n_fft, rate).map(|mut spectrum| {
        for (k, x) in spectrum.iter_mut().enumerate() {
            *x *= Complex32::from_polar(1.0, -std::f32::consts::TAU * (k * lead % n_fft) as f32 / n_fft as f32);
        }
        signal(spectrum, n_fft)
    })
}
