//! Accuracy against processor time: what less of a scene costs, and how far it is off.

use crate::audible::{Heard, Player, each};
use crate::error::JudgeError;
use crate::poses::Course;
use promenade_core::{Audible, FrontPoint, Measure, Scene, Setting};
use std::collections::HashMap;
use std::sync::Arc;

pub use crate::audible::{JND_DB, JND_DECAY, JND_ITD_S, errors_to_measurements, largest};

/// Differences in just noticed ones that fronts are made for.
pub const STANDARD_JNDS: [f32; 4] = [0.25, 0.5, 1.0, 2.0];
/// Poses at which each step is measured, beside one way, the share of them that differ by no more than its error, and the seed.
const POSES: usize = 6;
const OF_STEPS: f64 = 0.9;
const SEED: u64 = 1;
const OTHER_WAYS: usize = 3;
/// The seed of other poses and ways by which reports judge.
pub const OTHER_SEED: u64 = 2;
/// Poses and ways at which what was chosen is checked, their seed, and how often it is chosen anew.
const CHECKED_POSES: usize = 32;
const CHECKED_WAYS: usize = 5;
const CHECKED_SEED: u64 = 3;
/// The share of these that differ by no more than a setting's error, so that nine of ten do in other samples too.
const OF_CHECKED: f64 = 0.95;
const TRIES: usize = 5;
/// An error of this share of its limit is near enough to it, and what is asked for next aims at that one.
const NEAR: f32 = 0.85;
const AIM: f32 = 0.93;
/// Rate at which operations are counted, Hz.
const RATE_HZ: f64 = 48_000.0;
/// Shares of the taps and of the images that are tried.
const SHARES: [f64; 8] = [0.92, 0.83, 0.7, 0.55, 0.4, 0.28, 0.18, 0.1];
/// Decodes a second that are tried; none where the scene has a table.
const DECODES: [usize; 5] = [30, 20, 10, 5, 0];
/// Steps and exchanges of levers that are tried at a time, how many in all before it is as good as it gets, and how far above
/// the limit they may be foretold.
const TRIED: usize = 4;
const MOST_TRIED: usize = 8;
const HOPEFUL: f32 = 1.25;
/// What a step adds to the error at least, so that free ones are compared by what they save.
const LEAST_JNDS: f32 = 0.01;

/// The front of a scene: settings of which none costs no more than another and errs no more, all of the scene first. For each
/// of some limits, as [`STANDARD_JNDS`], there is one that stays within it, if any does. Costs are counts of operations, so
/// that a scene has one front on all machines.
///
/// From all of the scene on, each step is the one that saves most for the error that it adds, by what each step does alone; how
/// far one may go is measured with all steps together, at few poses. What is chosen has the error that is measured at many
/// others; by that one less or more is asked for.
///
/// # Errors
/// The result is no longer wanted, or what is heard cannot be compared.
pub fn front(scene: &Arc<Scene>, limits: &[f32], wanted: &(dyn Fn() -> bool + Sync)) -> Result<Vec<FrontPoint>, JudgeError> {
    let mut search = Search::new(scene, wanted)?;
    let path = search.path()?;
    let mut open: Vec<(f32, f32)> = limits.iter().map(|limit| (*limit, *limit)).collect();
    for _ in 0..TRIES {
        let chosen: Vec<Setting> = open.iter().map(|(_, asked)| search.along(&path, *asked)).collect::<Result<_, _>>()?;
        let known: Vec<bool> = chosen.iter().map(|setting| search.error(*setting).is_some()).collect();
        search.check(&chosen)?;
        let next = |(((limit, asked), setting), known): (((f32, f32), Setting), bool)| {
            let error = search.error(setting)?.jnds;
            let enough = error <= limit && (error >= NEAR * limit || known);
            (!enough).then(|| (limit, asked * (AIM * limit / error.max(0.1 * limit)).clamp(0.5, 1.5)))
        };
        open = open.into_iter().zip(chosen).zip(known).filter_map(next).collect();
    }
    Ok(search.points())
}

/// How far settings are off at so many other poses and on three other ways than a front is made for, of a seed above 3 or of
/// [`OTHER_SEED`].
///
/// # Errors
/// What is heard cannot be compared.
pub fn elsewhere(scene: &Arc<Scene>, settings: &[Setting], poses: usize, seed: u64) -> Result<Vec<Vec<Audible>>, JudgeError> {
    let course = Course::new(scene, poses, OTHER_WAYS, seed);
    let full = Heard::of(scene, &course, &|| true)?;
    let one = |setting: &Setting| {
        let Some(scene) = scene.with_setting(*setting).map(Arc::new) else { return Ok(Vec::new()) };
        Ok(Heard::of(&scene, &course, &|| true)?.errors(&full))
    };
    each(settings, one).into_iter().collect()
}

/// The cheapest scene within an error of all of one, by the front that it carries or else by [`front`].
///
/// # Errors
/// The result is no longer wanted, or what is heard cannot be compared.
pub fn scene_within(
    scene: &Arc<Scene>,
    jnds: f32,
    wanted: &(dyn Fn() -> bool + Sync),
) -> Result<(Arc<Scene>, FrontPoint), JudgeError> {
    let own = &scene.parts().front;
    let found = if own.is_empty() { front(scene, &[jnds], wanted)? } else { own.clone() };
    let all = FrontPoint { setting: Setting::ALL.of(scene), error: largest(&[]), cost: 1.0 };
    let point = *FrontPoint::within(&found, jnds).unwrap_or(&all);
    let kept = scene.with_setting(point.setting).map_or_else(|| Arc::clone(scene), Arc::new);
    Ok((kept, point))
}

/// What has been measured of a scene.
struct Search<'a> {
    /// The scene with its image sources in each order.
    orders: Vec<Arc<Scene>>,
    /// Where steps are measured, and where what was chosen is checked, with all of the scene there.
    courses: [Course; 2],
    full: Vec<Heard>,
    /// Values of each lever, all of it first.
    levers: Vec<Vec<Setting>>,
    measured: HashMap<Setting, Found>,
    standing: HashMap<Setting, Vec<Audible>>,
    checked: Vec<(Setting, Audible)>,
    wanted: &'a (dyn Fn() -> bool + Sync),
}

/// Operations of a setting, and its errors.
type Found = (f64, Vec<Audible>);

/// By lever how far it is pulled.
type Steps = Vec<usize>;

impl<'a> Search<'a> {
    fn new(scene: &Arc<Scene>, wanted: &'a (dyn Fn() -> bool + Sync)) -> Result<Self, JudgeError> {
        let courses = [Course::new(scene, POSES, 1, SEED), Course::new(scene, CHECKED_POSES, CHECKED_WAYS, CHECKED_SEED)];
        let full: Vec<Heard> =
            each(&courses, |course| Heard::of(scene, course, wanted)).into_iter().collect::<Result<_, _>>()?;
        let all = Setting::ALL.of(scene);
        let as_it_is = largest(&full[1].errors_at(&full[1], OF_CHECKED));
        let orders = (0..=all.order).filter_map(|order| scene.with_setting(Setting { order, ..all }).map(Arc::new)).collect();
        let shares = |count: usize| SHARES.map(|share| ((share * count as f64).round() as usize).max(1));
        let taps = shares(all.taps).map(|taps| Setting { taps, ..all });
        let images = shares(all.images).map(|images| Setting { images, ..all });
        let slower = (all.refresh + 1..=Setting::SLOWEST).map(|refresh| Setting { refresh, ..all });
        let decodes = DECODES.map(|decodes| Setting { decodes, ..all });
        let live = scene.cloud().is_some();
        let lever = |settings: Vec<Setting>| -> Vec<Setting> {
            let mut lever = vec![all];
            lever.extend(settings.into_iter().map(|setting| setting.of(scene)));
            lever.dedup();
            lever
        };
        let levers = vec![
            lever(taps.to_vec()),
            lever(if all.images > 1 { images.to_vec() } else { vec![] }),
            lever((0..all.order).rev().map(|order| Setting { order, ..all }).collect()),
            lever(if live { vec![] } else { slower.collect() }),
            lever(if all.waves { vec![Setting { waves: false, ..all }] } else { vec![] }),
            lever(if live { decodes.to_vec() } else { vec![] }),
        ];
        Ok(Self {
            orders,
            courses,
            full,
            levers,
            measured: HashMap::new(),
            standing: HashMap::new(),
            checked: vec![(all, as_it_is)],
            wanted,
        })
    }

    fn all(&self) -> Setting {
        self.levers[0][0]
    }

    fn setting(&self, steps: &Steps) -> Setting {
        let at = |lever: usize| self.levers[lever][steps[lever]];
        Setting {
            taps: at(0).taps,
            images: at(1).images,
            order: at(2).order,
            refresh: at(3).refresh,
            waves: at(4).waves,
            decodes: at(5).decodes,
        }
    }

    /// Measures settings that have not been measured yet. Ways are long, so they are left out where what is heard standing is
    /// beyond a limit already.
    fn measure(&mut self, settings: &[Setting], limit: f32) -> Result<(), JudgeError> {
        let new: Vec<Setting> = settings.iter().copied().filter(|setting| !self.measured.contains_key(setting)).collect();
        let one = |setting: &Setting| -> Result<(Vec<Audible>, Option<Found>), JudgeError> {
            let known = self.standing.get(&self.as_standing(*setting));
            if known.is_some_and(|errors| largest(errors).jnds > limit) {
                return Ok((Vec::new(), None));
            }
            let Some(scene) = self.scene(*setting) else {
                // What does not fit together is no setting.
                let errors = vec![Audible { jnds: f32::INFINITY, measure: Measure::Levels }];
                return Ok((errors.clone(), Some((f64::INFINITY, errors))));
            };
            let (course, full) = (&self.courses[0], &self.full[0]);
            let mut player = Player::new(&scene)?;
            let standing = match known {
                Some(errors) => errors.clone(),
                None => full.standing_errors(&player.standing(course, self.wanted)?, OF_STEPS),
            };
            if largest(&standing).jnds > limit {
                return Ok((standing, None));
            }
            let errors = [&standing[..], &full.moving_errors(&player.moving(course, self.wanted)?, OF_STEPS)].concat();
            Ok((standing, Some((scene.operations(RATE_HZ), errors))))
        };
        let found: Vec<_> = each(&new, one).into_iter().collect::<Result<_, _>>()?;
        for (setting, (standing, errors)) in new.into_iter().zip(found) {
            let of = self.as_standing(setting);
            self.standing.entry(of).or_insert(standing);
            self.measured.extend(errors.map(|errors| (setting, errors)));
        }
        Ok(())
    }

    /// The setting that sounds as another to a listener who stands.
    fn as_standing(&self, setting: Setting) -> Setting {
        Setting { refresh: self.all().refresh, ..setting }
    }

    fn scene(&self, setting: Setting) -> Option<Arc<Scene>> {
        self.orders[setting.order.min(self.orders.len() - 1)].with_setting(setting).map(Arc::new)
    }

    /// The error at many poses, once that was measured.
    fn error(&self, setting: Setting) -> Option<Audible> {
        self.checked.iter().find(|(checked, _)| *checked == setting).map(|(_, error)| *error)
    }

    /// Measures settings at many poses that have not been checked yet.
    fn check(&mut self, settings: &[Setting]) -> Result<(), JudgeError> {
        let mut new: Vec<Setting> = settings.iter().copied().filter(|setting| self.error(*setting).is_none()).collect();
        new.dedup();
        let one = |setting: &Setting| -> Result<Audible, JudgeError> {
            let Some(scene) = self.scene(*setting) else {
                return Ok(Audible { jnds: f32::INFINITY, measure: Measure::Levels });
            };
            let heard = Heard::of(&scene, &self.courses[1], self.wanted)?;
            Ok(largest(&heard.errors_at(&self.full[1], OF_CHECKED)))
        };
        let found: Vec<Audible> = each(&new, one).into_iter().collect::<Result<_, _>>()?;
        self.checked.extend(new.into_iter().zip(found));
        Ok(())
    }

    /// Whether what was measured of a setting stays within a limit.
    fn fits(&self, setting: Setting, limit: f32) -> bool {
        self.measured.get(&setting).is_some_and(|(_, errors)| largest(errors).jnds <= limit)
    }

    /// What steps save of the operations, as the levers have it one by one.
    fn saved(&self, steps: &Steps) -> f64 {
        let cost = |setting: Setting| self.measured[&setting].0;
        self.levers.iter().zip(steps).map(|(lever, step)| cost(lever[0]) - cost(lever[*step])).sum()
    }

    /// Error of each measure by what the levers' steps do one by one.
    fn foretold(&self, steps: &Steps) -> Vec<f32> {
        let alone = || self.levers.iter().zip(steps).flat_map(|(lever, step)| &self.measured[&lever[*step]].1);
        Measure::ALL.iter().map(|measure| alone().filter(|e| e.measure == *measure).map(|e| e.jnds).sum()).collect()
    }

    /// Steps that pull one lever further, and those that let go of another for it and still save, the most saving ones first:
    /// those of which the error can be hoped to stay within a limit.
    fn next_to(&self, here: &Steps, limit: f32) -> Vec<Steps> {
        let pulled = (0..here.len()).filter(|lever| here[*lever] + 1 < self.levers[*lever].len()).map(|lever| {
            let mut steps = here.clone();
            steps[lever] += 1;
            steps
        });
        let let_go = |steps: &Steps| -> Vec<Steps> {
            let others = (0..here.len()).filter(|lever| steps[*lever] == here[*lever] && here[*lever] > 0);
            let back = |lever: usize| [1, 2, here[lever]].map(|by| (lever, here[lever].saturating_sub(by)));
            let to = |(lever, step): (usize, usize)| {
                let mut steps = steps.clone();
                steps[lever] = step;
                steps
            };
            others.flat_map(back).map(to).chain([steps.clone()]).collect()
        };
        let (_, known) = &self.measured[&self.setting(here)];
        let before = self.foretold(here);
        let error = |steps: &Steps| {
            let of = |(n, measure): (usize, &Measure)| {
                known.iter().find(|e| e.measure == *measure).map_or(0.0, |e| e.jnds) + self.foretold(steps)[n] - before[n]
            };
            Measure::ALL.iter().enumerate().map(of).fold(0.0, f32::max)
        };
        let hopeful = |steps: &Steps| self.saved(steps) > self.saved(here) && error(steps) <= HOPEFUL * limit;
        let mut next: Vec<Steps> = pulled.flat_map(|steps| let_go(&steps)).filter(hopeful).collect();
        next.sort_by(|a, b| self.saved(b).total_cmp(&self.saved(a)));
        next.dedup();
        next.truncate(MOST_TRIED);
        next
    }

    /// From all of the scene to the least of it: at each step the one that saves most for what it adds to the error, as the
    /// levers have it one by one.
    fn path(&mut self) -> Result<Vec<Steps>, JudgeError> {
        let alone: Vec<Setting> = self.levers.concat();
        self.measure(&alone, f32::INFINITY)?;
        let error = |steps: &Steps| self.foretold(steps).into_iter().fold(0.0, f32::max);
        let mut path = vec![vec![0; self.levers.len()]];
        while let Some(here) = path.last().cloned() {
            let (here_saved, here_error) = (self.saved(&here), error(&here));
            let worth = |steps: &Steps| {
                let gain = self.saved(steps) - here_saved;
                gain / f64::from((error(steps) - here_error).max(LEAST_JNDS))
            };
            let next = (0..self.levers.len())
                .flat_map(|lever| (here[lever] + 1..self.levers[lever].len()).map(move |step| (lever, step)))
                .map(|(lever, step)| {
                    let mut steps = here.clone();
                    steps[lever] = step;
                    steps
                })
                .filter(|steps| self.saved(steps) > here_saved)
                .max_by(|a, b| worth(a).total_cmp(&worth(b)));
            match next {
                Some(next) => path.push(next),
                None => break,
            }
        }
        Ok(path)
    }

    /// Goes as far along a path as an error allows, and from there by single steps and exchanges as far as that is possible.
    fn along(&mut self, path: &[Steps], limit: f32) -> Result<Setting, JudgeError> {
        let (mut low, mut high) = (0, path.len());
        while high - low > 1 {
            // Both thirds at once, for two processors.
            let tried = [low + (high - low).div_ceil(3), low + (2 * (high - low)).div_ceil(3)].map(|at| at.min(high - 1));
            self.measure(&tried.map(|at| self.setting(&path[at])), limit)?;
            for at in tried {
                if self.fits(self.setting(&path[at]), limit) {
                    low = low.max(at);
                } else {
                    high = high.min(at.max(low + 1));
                    break;
                }
            }
        }
        let mut here = path[low].clone();
        'further: loop {
            for next in self.next_to(&here, limit).chunks(TRIED) {
                let settings: Vec<Setting> = next.iter().map(|steps| self.setting(steps)).collect();
                self.measure(&settings, limit)?;
                let cost = |setting: Setting| self.measured.get(&setting).map_or(f64::INFINITY, |(cost, _)| *cost);
                let before = cost(self.setting(&here));
                let best =
                    next.iter().zip(settings).filter(|(_, setting)| self.fits(*setting, limit) && cost(*setting) < before);
                if let Some((steps, _)) = best.min_by(|(_, a), (_, b)| cost(*a).total_cmp(&cost(*b))) {
                    here.clone_from(steps);
                    continue 'further;
                }
            }
            return Ok(self.setting(&here));
        }
    }

    /// What was checked and is neither dearer nor worse than something else, the dearest first.
    fn points(&self) -> Vec<FrontPoint> {
        let cost = |setting: &Setting| self.measured.get(setting).map_or(f64::INFINITY, |(cost, _)| *cost);
        let all = cost(&self.all());
        let mut points: Vec<FrontPoint> = self
            .checked
            .iter()
            .map(|(setting, error)| FrontPoint { setting: *setting, error: *error, cost: (cost(setting) / all) as f32 })
            .collect();
        points.sort_by(|a, b| b.cost.total_cmp(&a.cost).then(b.error.jnds.total_cmp(&a.error.jnds)));
        let mut kept: Vec<FrontPoint> = Vec::new();
        for point in points.into_iter().rev() {
            if kept.last().is_none_or(|cheaper| point.error.jnds < cheaper.error.jnds) {
                kept.push(point);
            }
        }
        kept.reverse();
        kept
    }
}

#[cfg(test)]
mod tests;
