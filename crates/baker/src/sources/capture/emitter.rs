//! Where the sound of a capture came from.

use super::direct::{DIRECT_PRE_ROLL_S, direct_sound};
use super::{Capture, Split};
use crate::BakeError;
use promenade_core::Pose;
use promenade_core::glam::Vec3;
use promenade_core::network::{CloudEmitter, HEAD_RADIUS_M, SPEED_OF_SOUND_M_S};

/// Factors of a head's mean radius that are tried for the sphere whose delay is compared: heads' delays below 1.5 kHz are up to
/// half as long again as Woodworth's.
const RADII: [f64; 6] = [0.9, 1.0, 1.1, 1.2, 1.3, 1.4];
/// Clips that are enough, and the fewest.
const MOST_CLIPS: usize = 400;
const FEWEST_CLIPS: usize = 12;
/// A listener who walks less than this, metres, cannot tell distance.
const LEAST_WALK_M: f32 = 0.5;
/// Direct sound less clear than the first counts nothing, clearer than the second all.
const CLARITY_DB: [f64; 2] = [7.0, 13.0];
/// The search goes this far beyond where the listener was, metres: sideways, up and down.
const BEYOND_M: Vec3 = Vec3::new(8.0, 8.0, 4.0);
/// Metres between the places that are tried first, and clips by which they are judged.
const GRID_M: f32 = 0.5;
const GRID_CLIPS: usize = 80;
/// Places that are looked at closely, at least so far from each other, metres.
const CANDIDATES: usize = 12;
const APART_M: f32 = 1.0;
/// Steps of the close look, metres, from first to last.
const FIRST_STEP_M: f32 = 0.25;
const LAST_STEP_M: f32 = 0.004;
/// Deviations are no more exact than this, and count no more than that.
const DELAY_US: Limits = Limits { exact: 10.0, most: 400.0 };
const LEVEL_DB: Limits = Limits { exact: 0.5, most: 12.0 };
const ARRIVAL_US: Limits = Limits { exact: 20.0, most: 3000.0 };
/// Times of arrival are believed where places explain all but this share of their differences, and these are as large as this.
const UNEXPLAINED: f64 = 0.25;
const LEAST_ARRIVALS_US: f64 = 200.0;
/// ... and where the delays between the ears become no worse than by this factor.
const WORSE_DELAYS: f64 = 1.25;
/// Places with deviations worse by less than this factor may be the right one too.
const AS_GOOD: f64 = 1.2;
/// Parts of the walk that are left out in turn.
const PARTS: usize = 5;

/// Where the sound came from, as the clips say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmitterEstimate {
    /// World metres.
    pub position: Vec3,
    /// How far off the position may be, metres: the farthest place that explains the clips nearly as well, or the jackknife's
    /// standard deviation over parts of the walk, whichever is larger.
    pub spread_m: f32,
    /// Mean deviation of the interaural delays from those of a sphere, microseconds.
    pub itd_residual_us: f32,
    /// Mean deviation of the direct sound's level from falling by 6 dB with each doubling of the distance, dB.
    pub level_residual_db: f32,
    /// Mean deviation of the direct sound's arrival, microseconds, where the recordings keep the time that sound travels.
    pub arrival_residual_us: Option<f32>,
    /// Radius of the sphere whose delays fit best, metres.
    pub head_radius_m: f32,
    /// Clips whose direct sound was clear enough.
    pub clips: usize,
}

/// Estimates where the sound came from by the training clips.
///
/// Of each clip the direct sound is found by the dry sound beside it: its delay between the ears, its level and, where
/// recordings and dry sound run by one clock, when it arrives. Of all places around, the one is taken at which the deviations
/// from a sphere's delays (Woodworth 1938), from levels that fall with distance and from arrivals that grow with it are least,
/// each weighed by its own scale and none counting beyond a limit.
///
/// # Errors
/// A listener who does not move, and fewer than 12 clips with a clear direct sound.
pub fn locate_emitter(capture: &Capture) -> Result<EmitterEstimate, BakeError> {
    let observed = observe(capture);
    if observed.len() < FEWEST_CLIPS {
        let expected = format!("at least {FEWEST_CLIPS} training clips with a clear direct sound");
        return Err(BakeError::argument("clips that tell the emitter", expected, observed.len()));
    }
    let (low, high) = bounds(&observed);
    if low.distance(high) < LEAST_WALK_M {
        let expected = format!("a listener who walks {LEAST_WALK_M} m or more, or distance cannot be told");
        return Err(BakeError::argument("training clips", expected, format!("{:.2} m", low.distance(high))));
    }
    let mut fit = Fit { observed, arrivals: false };
    let mut candidates = fit.candidates();
    let still = fit.still_arrivals_us();
    if still >= LEAST_ARRIVALS_US {
        let delays = fit.deviations(candidates[0].position).delay_us;
        fit.arrivals = true;
        let timed = fit.candidates();
        let found = fit.deviations(timed[0].position);
        if found.arrival_us < UNEXPLAINED * still && found.delay_us < WORSE_DELAYS * delays + DELAY_US.exact {
            candidates = timed;
        } else {
            fit.arrivals = false;
        }
    }
    let best = candidates[0];
    let found = fit.deviations(best.position);
    let short = |v: f64| v as f32;
    Ok(EmitterEstimate {
        position: best.position,
        spread_m: fit.ambiguity_m(&candidates).max(fit.jackknife_m(best.position)),
        itd_residual_us: short(found.delay_us),
        level_residual_db: short(found.level_db),
        arrival_residual_us: fit.arrivals.then_some(short(found.arrival_us)),
        head_radius_m: HEAD_RADIUS_M * short(found.radius),
        clips: fit.observed.len(),
    })
}

/// A clip's direct sound.
#[derive(Clone, Copy)]
struct Observed {
    pose: Pose,
    delay_us: f64,
    level_db: f64,
    arrival_us: f64,
    weight: f64,
}

fn observe(capture: &Capture) -> Vec<Observed> {
    let rate = capture.sample_rate_hz;
    let pre_roll = (DIRECT_PRE_ROLL_S * rate) as usize;
    let every = capture.split(Split::Train).count().div_ceil(MOST_CLIPS).max(1);
    let clips = capture.split(Split::Train).step_by(every);
    clips
        .filter_map(|clip| {
            let direct = direct_sound(&capture.dry(clip, pre_roll), pre_roll, capture.binaural(clip), rate)?;
            let weight = ((direct.clarity_db - CLARITY_DB[0]) / (CLARITY_DB[1] - CLARITY_DB[0])).min(1.0);
            (weight > 0.0).then_some(Observed {
                pose: clip.pose,
                delay_us: 1e6 * direct.delay_s,
                level_db: direct.level_db,
                arrival_us: 1e6 * direct.time_s,
                weight,
            })
        })
        .collect()
}

/// The corners of where the listener was.
fn bounds(observed: &[Observed]) -> (Vec3, Vec3) {
    let all = observed.iter().map(|o| o.pose.position);
    all.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)))
}

/// How exact a deviation is, and the most that it counts.
#[derive(Clone, Copy)]
struct Limits {
    exact: f64,
    most: f64,
}

/// Mean deviations at a place.
#[derive(Clone, Copy)]
struct Deviations {
    delay_us: f64,
    /// Factor of the sphere's radius.
    radius: f64,
    level_db: f64,
    arrival_us: f64,
}

/// A place and its cost.
#[derive(Clone, Copy)]
struct Candidate {
    position: Vec3,
    cost: f64,
}

#[derive(Clone)]
struct Fit {
    observed: Vec<Observed>,
    /// Whether times of arrival count.
    arrivals: bool,
}

impl Fit {
    fn deviations(&self, place: Vec3) -> Deviations {
        let emitter = CloudEmitter::with_sphere(place, HEAD_RADIUS_M);
        let distances = self.observed.iter().map(|o| f64::from(o.pose.position.distance(place).max(0.1)));
        let (mut delays, mut levels, mut arrivals) = (Vec::new(), Vec::new(), Vec::new());
        for (o, distance) in self.observed.iter().zip(distances) {
            delays.push((o.delay_us, 1e6 * f64::from(emitter.delay_s(&o.pose)), o.weight));
            levels.push((o.level_db + 20.0 * distance.log10(), o.weight));
            if self.arrivals {
                arrivals.push((o.arrival_us - 1e6 * distance / f64::from(SPEED_OF_SOUND_M_S), o.weight));
            }
        }
        let of_radius = |radius: f64| {
            let all = delays.iter().map(|(heard, sphere, weight)| (heard - radius * sphere, *weight));
            (mean(all, 0.0, DELAY_US), radius)
        };
        let (delay_us, radius) =
            RADII.into_iter().map(of_radius).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((DELAY_US.most, 1.0));
        Deviations { delay_us, radius, level_db: scatter(&levels, LEVEL_DB), arrival_us: scatter(&arrivals, ARRIVAL_US) }
    }

    /// The mean deviation of times of arrival from each other.
    fn still_arrivals_us(&self) -> f64 {
        scatter(&self.observed.iter().map(|o| (o.arrival_us, o.weight)).collect::<Vec<_>>(), ARRIVAL_US)
    }

    /// The negative log-likelihood of a clip where deviations have Laplace's distribution, of scales that are not known, but
    /// for a constant.
    fn at(&self, position: Vec3) -> Candidate {
        let d = self.deviations(position);
        let timed = if self.arrivals { (d.arrival_us + ARRIVAL_US.exact).ln() } else { 0.0 };
        Candidate { position, cost: (d.delay_us + DELAY_US.exact).ln() + (d.level_db + LEVEL_DB.exact).ln() + timed }
    }

    /// The best places, the very best first, at least some distance from each other before the close look.
    fn candidates(&self) -> Vec<Candidate> {
        let some = Self {
            observed: self.observed.iter().copied().step_by(self.observed.len().div_ceil(GRID_CLIPS)).collect(),
            arrivals: self.arrivals,
        };
        let (low, high) = bounds(&self.observed);
        let (low, high) = (low - BEYOND_M, high + BEYOND_M);
        let [nx, ny, nz] = ((high - low) / GRID_M).to_array().map(|n| n as usize + 1);
        let mut grid: Vec<Candidate> = (0..nx * ny * nz)
            .map(|i| some.at(low + GRID_M * Vec3::new((i % nx) as f32, (i / nx % ny) as f32, (i / nx / ny) as f32)))
            .collect();
        grid.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        let mut chosen: Vec<Candidate> = Vec::new();
        for place in grid {
            if chosen.len() < CANDIDATES && chosen.iter().all(|c| c.position.distance(place.position) >= APART_M) {
                chosen.push(place);
            }
        }
        let mut closer: Vec<_> = chosen.iter().map(|c| self.closer(c.position)).collect();
        closer.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        closer
    }

    /// The best place near one: steps in all directions, ever smaller.
    fn closer(&self, start: Vec3) -> Candidate {
        let mut best = self.at(start);
        let mut step = FIRST_STEP_M;
        while step >= LAST_STEP_M {
            let around = directions().map(|d| self.at(best.position + step * d));
            match around.min_by(|a, b| a.cost.total_cmp(&b.cost)) {
                Some(next) if next.cost < best.cost => best = next,
                _ => step *= 0.5,
            }
        }
        best
    }

    /// The distance to the farthest place that is nearly as good as the best, the first.
    fn ambiguity_m(&self, candidates: &[Candidate]) -> f32 {
        let best = candidates[0];
        let good = |c: &Candidate| c.cost < best.cost + AS_GOOD.ln();
        let others = candidates.iter().filter(|c| good(c)).map(|c| c.position.distance(best.position));
        let reach = directions().map(|direction| {
            let distances = (0..32).map(|i| 0.02 * 1.25_f32.powi(i));
            distances.take_while(|d| good(&self.at(best.position + *d * direction.normalize()))).last().unwrap_or(0.0)
        });
        others.chain(reach).fold(0.0, f32::max)
    }

    /// Standard deviation of the place where parts of the walk are left out in turn (the delete-a-group jackknife).
    fn jackknife_m(&self, place: Vec3) -> f32 {
        let count = self.observed.len();
        let without = |part: usize| {
            let left_out = part * count / PARTS..(part + 1) * count / PARTS;
            let rest = self.observed.iter().enumerate().filter(|(i, _)| !left_out.contains(i)).map(|(_, o)| *o).collect();
            Self { observed: rest, arrivals: self.arrivals }.closer(place).position
        };
        let places: Vec<Vec3> = (0..PARTS).map(without).collect();
        let mean = places.iter().sum::<Vec3>() / PARTS as f32;
        let squares: f32 = places.iter().map(|p| p.distance_squared(mean)).sum();
        (squares * (PARTS - 1) as f32 / PARTS as f32).sqrt()
    }
}

/// The 26 neighbours of a cell.
fn directions() -> impl Iterator<Item = Vec3> {
    (0..27).filter(|i| *i != 13).map(|i: i8| Vec3::new(f32::from(i % 3 - 1), f32::from(i / 3 % 3 - 1), f32::from(i / 9 - 1)))
}

/// The mean deviation from the median, weighted.
fn scatter(values: &[(f64, f64)], limits: Limits) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * sorted.iter().map(|(_, weight)| weight).sum::<f64>();
    let mut below = 0.0;
    let median = sorted.iter().find(|(_, weight)| {
        below += weight;
        below >= half
    });
    mean(sorted.iter().copied(), median.map_or(0.0, |m| m.0), limits)
}

/// The mean deviation from a value, weighted, none counting more than the limit.
fn mean(values: impl Iterator<Item = (f64, f64)>, from: f64, limits: Limits) -> f64 {
    let (sum, weights) = values.fold((0.0, 0.0), |(sum, weights), (value, weight)| {
        (sum + weight * (value - from).abs().min(limits.most), weights + weight)
    });
    if weights > 0.0 { sum / weights } else { limits.most }
}

#[cfg(test)]
mod tests;
