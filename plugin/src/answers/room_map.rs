//! Level, T20 and C50 over the plan of the scene that is heard, as `promenade map` draws them of a mesh.

use crate::answers::settled::Question;
use crate::library::{cache, outline::Outline};
use crate::parameter::cast::{index, narrow};
use promenade_core::glam::{Vec2, Vec3};
use promenade_core::{BlockParams, Pose, Scene, Trim};
use promenade_metrics::{DecayRange, c50_db, decay_time_s, octave_of};
use promenade_player::Stream;
use std::sync::{Arc, Weak};
use std::time::Duration;

/// Places along the longer side of the plan.
const PLACES: f32 = 32.0;
/// Distance of the places from walls, metres.
const MARGIN_M: f32 = 0.1;
/// Rate at which responses are played: it has both octaves, Hz.
const RATE_HZ: f64 = 8_000.0;
/// The octaves over which ISO 3382-1 takes the mean of a room's measures, Hz.
const MIDDLE_HZ: [f64; 2] = [500.0, 1_000.0];
/// The direct sound by itself is over after this, seconds.
const DIRECT_S: f64 = 0.06;
/// A response is played for so many reverberation times: its end lies below what T20 looks at.
const DECAYS: f64 = 0.75;
const LONGEST_S: f64 = 6.0;

/// What is measured at a place; `None` where it has no value.
pub type Measured = [Option<f32>; 3];

/// Measures over a plan.
#[derive(Clone, Debug, PartialEq)]
pub struct RoomMap {
    /// Side of the square about each place, metres.
    pub spacing_m: f32,
    /// Each place with its level, dB re the direct sound at 1 m, T20, seconds, and C50, dB.
    pub places: Vec<(Vec3, Measured)>,
}

impl RoomMap {
    /// The least and the greatest value of a measure.
    pub fn range(&self, measure: usize) -> Option<(f32, f32)> {
        let values = || self.places.iter().filter_map(|(_, measured)| measured[measure]);
        let (low, high) = values().fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
        // Values that hardly differ are no pattern.
        (low <= high).then_some(if high - low > 1e-3 { (low, high) } else { (low - 0.5, high + 0.5) })
    }

    /// What is measured at the place nearest to one of the plan, if that is on the map.
    pub fn at(&self, plan: Vec2) -> Option<&Measured> {
        let far = |place: &Vec3| (place.truncate() - plan).abs().max_element();
        let nearest = self.places.iter().min_by(|a, b| far(&a.0).total_cmp(&far(&b.0)))?;
        (far(&nearest.0) <= 0.5 * self.spacing_m).then_some(&nearest.1)
    }
}

/// A scene as it is heard.
#[derive(Clone, Debug)]
pub struct Mapped {
    /// The scene, which is not kept in memory.
    pub scene: Weak<Scene>,
    /// What is changed about its sound.
    pub trim: Trim,
}

impl Question for Mapped {
    type Answer = Result<RoomMap, String>;
    const REST: Duration = Duration::from_millis(300);

    fn is_like(&self, other: &Self) -> bool {
        Weak::ptr_eq(&self.scene, &other.scene) && self.trim == other.trim
    }

    fn answer(&self, wanted: &dyn Fn() -> bool) -> Option<Self::Answer> {
        let scene = self.scene.upgrade()?;
        map(&scene, self.trim, wanted).transpose()
    }
}

/// The map of a scene; `None` as soon as it is not wanted any more.
fn map(scene: &Arc<Scene>, trim: Trim, wanted: &dyn Fn() -> bool) -> Result<Option<RoomMap>, String> {
    let Some(home) = scene.emitter() else { return Err("This scene does not know where its source is.".to_owned()) };
    let (low, high) = scene.bounds();
    if low.truncate() == high.truncate() {
        return Err("This scene was made for one place: a map needs a room to walk in.".to_owned());
    }
    // A microphone that hears all directions alike.
    let field = cache::ambisonic(scene, 0).map_err(|_| "This scene has no field of sound to be mapped.".to_owned())?;
    let play = |trim: Trim| Stream::new(&field, RATE_HZ, &BlockParams { trim, ..BlockParams::default() });
    let mut stream = play(Trim { width: 1.0, ..trim }).map_err(|error| error.to_string())?;
    let mut direct = play(Trim { early: 0.0, late: 0.0, ..Trim::NEUTRAL }).map_err(|error| error.to_string())?;
    let (spacing_m, places) = places(scene, low.z);
    let energies = |stream: &mut Stream, place: Vec3, seconds: f64| {
        let pose = Pose { position: place, ..Pose::IDENTITY };
        let [sound, _] = stream.respond(pose, seconds, wanted)?;
        Some(MIDDLE_HZ.map(|hz| octave_of(&sound, RATE_HZ, hz)))
    };
    let energy = |octave: &Vec<f32>| octave.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>();
    // At 1 m, of what is seen best of the places next to the source.
    let mut near = places.clone();
    near.sort_by(|a, b| a.distance(home).total_cmp(&b.distance(home)));
    let mut unit = [0.0_f64; 2];
    for place in near.iter().take(4) {
        let Some(octaves) = energies(&mut direct, *place, DIRECT_S) else { return Ok(None) };
        let squared = f64::from(place.distance_squared(home));
        unit.iter_mut().zip(&octaves).for_each(|(unit, octave)| *unit = unit.max(squared * energy(octave)));
    }
    let t60_s = f64::from(scene.tail().longest_t60_s() * trim.decay.max(1.0));
    let seconds = (DECAYS * t60_s + 0.1).min(LONGEST_S);
    let mut mapped = Vec::with_capacity(places.len());
    for place in places {
        let Some(octaves) = energies(&mut stream, place, seconds) else { return Ok(None) };
        let both = |of: &dyn Fn(&Vec<f32>) -> Option<f64>| Some(narrow(0.5 * (of(&octaves[0])? + of(&octaves[1])?)));
        let level = octaves.iter().zip(unit).map(|(octave, unit)| 0.5 * energy(octave) / unit).sum::<f64>();
        let level_db = Some(narrow(10.0 * level.log10())).filter(|db| db.is_finite());
        let t20_s = both(&|octave| decay_time_s(octave, RATE_HZ, DecayRange::T20).ok());
        mapped.push((place, [level_db, t20_s, both(&|octave| c50_db(octave, RATE_HZ).ok())]));
    }
    Ok(Some(RoomMap { spacing_m, places: mapped }))
}

/// Places of a plan between the walls, or in the box that the scene was made for, and the distance between two of them.
fn places(scene: &Scene, height: f32) -> (f32, Vec<Vec3>) {
    let outline = Outline::of(scene.anchors());
    let (low, high) = scene.bounds();
    let [low, high] = outline.plan().unwrap_or([low.truncate(), high.truncate()]);
    let spacing_m = (high - low).max_element() / PLACES;
    let counts = ((high - low) / spacing_m).round().max(Vec2::ONE);
    let [columns, lines] = [counts.x, counts.y].map(index);
    let at = |x: usize, y: usize| (low + spacing_m * (Vec2::new(x as f32, y as f32) + 0.5)).extend(height);
    let all = (0..lines).flat_map(|y| (0..columns).map(move |x| at(x, y)));
    (spacing_m, all.filter(|place| outline.is_clear(*place, MARGIN_M) != Some(false)).collect())
}
