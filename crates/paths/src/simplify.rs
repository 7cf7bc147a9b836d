//! A recorded walk in few keyframes.

use promenade_core::{CameraPath, Keyframe, PathError, Pose};

/// Where the path is compared besides recorded poses, in shares of the time from one to the next.
const BETWEEN: [f64; 3] = [0.25, 0.5, 0.75];
/// Recorded poses this close are compared alone, seconds: nobody moves between them unseen.
const DENSE_S: f64 = 0.1;
/// Rounds of leaving out keyframes that turn out not to be needed; later rounds find next to none.
const ROUNDS: usize = 4;
/// Keyframes that are kept of a long recording, at most, for which one search is not enough.
const LARGE: usize = 10_000;
/// Recorded poses of a long segment that are compared before all are: one that is far off needs no more.
const SAMPLES: usize = 16;

/// Some of the keyframes, so that the path through them stays within a tolerance of the path through all.
///
/// Compared are positions, metres, and orientations, radians, at every recorded time, and at three times between any two that
/// are more than 0.1 s apart. The first and the last keyframe stay. A tolerance below 0 or one that is no number keeps all.
///
/// # Errors
/// Keyframes that make no [`CameraPath`].
///
/// # Real-time
/// Not real-time safe.
pub fn simplify(keyframes: &[Keyframe], tolerance_m: f32, tolerance_rad: f32) -> Result<Vec<Keyframe>, PathError> {
    let recorded = CameraPath::new(keyframes.to_vec())?;
    if !(tolerance_m >= 0.0 && tolerance_rad >= 0.0) {
        return Ok(keyframes.to_vec());
    }
    let last = keyframes.len() - 1;
    let compared = Compared::of(&recorded);
    let mut best: Option<Vec<usize>> = None;
    for (split, parts) in TRIALS {
        // Of a long recording of which much is kept, another search leaves out hardly more.
        let is_large = |kept: &Vec<usize>| kept.len() > LARGE.max(last / 8);
        if best.as_ref().is_some_and(|b| b.len() <= parts || is_large(b)) {
            continue;
        }
        let mut kept: Vec<usize> = (0..=parts).map(|part| last * part / parts).collect();
        kept.dedup();
        let mut fit = Fit { recorded: &recorded, compared: &compared, tolerance_m, tolerance_rad, kept };
        fit.refine(split)?;
        for _ in 0..ROUNDS {
            if !fit.prune()? {
                break;
            }
        }
        if best.as_ref().is_none_or(|b| fit.kept.len() < b.len()) {
            best = Some(fit.kept);
        }
    }
    Ok(best.unwrap_or_default().iter().map(|i| keyframes[*i]).collect())
}

/// Where a segment that is too far off gets a keyframe more.
#[derive(Clone, Copy, Debug)]
enum Split {
    /// In the middle: slopes are best where keyframes are evenly spaced.
    Middle,
    /// Where it is furthest off: corners and stops are between long even parts.
    Worst,
}

/// How the keyframes are looked for, and in how many even parts the search begins; the fewest are taken.
const TRIALS: [(Split, usize); 3] = [(Split::Worst, 1), (Split::Middle, 5), (Split::Middle, 7)];

/// The recorded path where others are compared with it.
struct Compared {
    /// The recorded keyframe near each place, with the time and the pose there.
    places: Vec<(usize, f64, Pose)>,
    /// The first place of each recorded keyframe, which is at it.
    starts: Vec<usize>,
}

impl Compared {
    fn of(recorded: &CameraPath) -> Self {
        let keyframes = recorded.keyframes();
        let (mut places, mut starts) = (Vec::with_capacity(keyframes.len()), Vec::with_capacity(keyframes.len()));
        for (n, keyframe) in keyframes.iter().enumerate() {
            starts.push(places.len());
            places.push((n, keyframe.t_s, keyframe.pose));
            let span_s = keyframes.get(n + 1).map_or(0.0, |next| next.t_s - keyframe.t_s);
            if span_s > DENSE_S {
                let between = BETWEEN.map(|share| (n + usize::from(share > 0.5), keyframe.t_s + share * span_s));
                places.extend(between.map(|(near, t_s)| (near, t_s, recorded.pose_at(t_s))));
            }
        }
        Self { places, starts }
    }
}

/// A choice of keyframes.
struct Fit<'a> {
    recorded: &'a CameraPath,
    compared: &'a Compared,
    tolerance_m: f32,
    tolerance_rad: f32,
    /// Their numbers in the recording, rising, with the first and the last.
    kept: Vec<usize>,
}

impl Fit<'_> {
    /// Adds keyframes where the path is too far off, until it is nowhere.
    fn refine(&mut self, split: Split) -> Result<(), PathError> {
        // Whether the segment after each kept keyframe is known to be within tolerance.
        let mut fine = vec![false; self.kept.len()];
        loop {
            let path = self.path(&self.kept)?;
            let mut added = Vec::new();
            for (n, pair) in self.kept.windows(2).enumerate() {
                if fine[n] {
                    continue;
                }
                match self.worst(&path, pair[0], pair[1]) {
                    None => fine[n] = true,
                    Some(worst) if pair[1] - pair[0] > 1 => {
                        // Not at the very ends of a long segment: each round shortens every segment by a share.
                        let margin = 1.max((pair[1] - pair[0]) / 8);
                        added.push(match split {
                            Split::Middle => pair[0].midpoint(pair[1]),
                            Split::Worst => worst.clamp(pair[0] + margin, pair[1] - margin),
                        });
                    }
                    // Between two neighbours only the slopes can be wrong, which are those of the keyframes around them.
                    Some(_) => {
                        added.extend([pair[0].saturating_sub(1), (pair[1] + 1).min(self.recorded.keyframes().len() - 1)])
                    }
                }
            }
            added.retain(|i| self.kept.binary_search(i).is_err());
            if added.is_empty() {
                return Ok(());
            }
            (self.kept, fine) = self.merged(added, &fine);
        }
    }

    /// The kept and the added numbers, and which segments are still known to be fine.
    fn merged(&self, mut added: Vec<usize>, fine: &[bool]) -> (Vec<usize>, Vec<bool>) {
        added.sort_unstable();
        added.dedup();
        let mut all: Vec<(usize, bool)> = self.kept.iter().copied().zip(fine.iter().copied()).collect();
        all.extend(added.iter().map(|i| (*i, false)));
        all.sort_unstable_by_key(|(i, _)| *i);
        let kept: Vec<usize> = all.iter().map(|(i, _)| *i).collect();
        let mut fine: Vec<bool> = all.iter().map(|(_, f)| *f).collect();
        for i in added {
            // A keyframe shapes the two segments before it and the two from it on.
            let at = kept.partition_point(|k| *k < i);
            fine[at.saturating_sub(2)..kept.len().min(at + 2)].fill(false);
        }
        (kept, fine)
    }

    /// Leaves out keyframes that are not needed; whether there were any.
    fn prune(&mut self) -> Result<bool, PathError> {
        let old = std::mem::take(&mut self.kept);
        let mut new = Vec::with_capacity(old.len());
        for (at, number) in old.iter().enumerate() {
            if at == 0 || at + 1 == old.len() || !self.fits_without(&new, &old[at + 1..])? {
                new.push(*number);
            }
        }
        self.kept = new;
        Ok(self.kept.len() < old.len())
    }

    /// Whether the path through keyframes before and after a place is within tolerance around it.
    fn fits_without(&self, before: &[usize], after: &[usize]) -> Result<bool, PathError> {
        // Slopes reach no further than this.
        let (before, after) = (&before[before.len().saturating_sub(3)..], &after[..after.len().min(3)]);
        let numbers = [before, after].concat();
        let path = self.path(&numbers)?;
        let middle = before.len();
        let segment =
            |to: usize| numbers.get(to).is_none_or(|n| self.in_order(&path, numbers[to - 1], *n).all(|(_, off)| off <= 1.0));
        // The widened segment first, which is the likeliest to be too far off.
        Ok(segment(middle) && (middle < 2 || segment(middle - 1)) && segment(middle + 1))
    }

    fn path(&self, numbers: &[usize]) -> Result<CameraPath, PathError> {
        CameraPath::new(numbers.iter().map(|i| self.recorded.keyframes()[*i]).collect())
    }

    /// The recorded keyframe near which a path is furthest off between two; none within tolerance.
    fn worst(&self, path: &CameraPath, from: usize, to: usize) -> Option<usize> {
        let worst = |offs: &mut dyn Iterator<Item = (usize, f32)>| {
            let worst = offs.max_by(|a, b| a.1.total_cmp(&b.1))?;
            (worst.1 > 1.0).then_some(worst.0)
        };
        worst(&mut self.samples(path, from, to)).or_else(|| worst(&mut self.offs(path, from, to)))
    }

    /// [`Self::samples`], and then [`Self::offs`].
    fn in_order<'a>(&'a self, path: &'a CameraPath, from: usize, to: usize) -> impl Iterator<Item = (usize, f32)> + 'a {
        self.samples(path, from, to).chain(self.offs(path, from, to))
    }

    /// How far a path is off at a few recorded keyframes of a long segment; none of a short one.
    fn samples<'a>(&'a self, path: &'a CameraPath, from: usize, to: usize) -> impl Iterator<Item = (usize, f32)> + 'a {
        let count = if to - from > 4 * SAMPLES { SAMPLES } else { 1 };
        (1..count).map(move |i| {
            let number = from + (to - from) * i / count;
            let recorded = &self.recorded.keyframes()[number];
            (number, self.off(&path.pose_at(recorded.t_s), &recorded.pose))
        })
    }

    /// How far a path is off between two recorded keyframes, in tolerances, and the recorded keyframe near each place.
    fn offs<'a>(&'a self, path: &'a CameraPath, from: usize, to: usize) -> impl Iterator<Item = (usize, f32)> + 'a {
        let Compared { places, starts } = self.compared;
        // The path goes through its own keyframes.
        let between = &places[starts[from] + 1..starts[to]];
        between.iter().map(move |(near, t_s, recorded)| (*near, self.off(&path.pose_at(*t_s), recorded)))
    }

    /// How far a pose is off, in tolerances; never NaN.
    fn off(&self, pose: &Pose, recorded: &Pose) -> f32 {
        let share = |off: f32, tolerance: f32| if off <= tolerance { 0.0 } else { (off / tolerance).max(1.5) };
        let distance = pose.position.distance(recorded.position);
        share(distance, self.tolerance_m).max(share(angle_between(pose, recorded), self.tolerance_rad))
    }
}

/// The angle between two orientations, radians; precise for small ones, unlike an arc cosine.
pub(crate) fn angle_between(a: &Pose, b: &Pose) -> f32 {
    let (p, q) = (a.orientation, b.orientation);
    4.0 * (0.5 * (p - q).length().min((p + q).length())).min(1.0).asin()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use promenade_testing::Rng;

    /// Poses 60 times a second.
    fn recorded(seconds: f64, pose: impl Fn(f32) -> Pose) -> Vec<Keyframe> {
        let count = (seconds * 60.0).round() as u32;
        (0..=count).map(|i| f64::from(i) / 60.0).map(|t_s| Keyframe { t_s, pose: pose(t_s as f32) }).collect()
    }

    fn assert_within(few: &[Keyframe], all: &[Keyframe], metres: f32, radians: f32) {
        let path = CameraPath::new(few.to_vec()).unwrap();
        for k in all {
            let pose = path.pose_at(k.t_s);
            assert!(pose.position.distance(k.pose.position) <= metres, "{} s", k.t_s);
            assert!(angle_between(&pose, &k.pose) <= radians, "{} s", k.t_s);
        }
        assert_eq!((few[0], few[few.len() - 1]), (all[0], all[all.len() - 1]));
    }

    /// Random smooth walks: sums of slow sines for every coordinate, with pauses.
    fn walk(seed: u64) -> impl Fn(f32) -> Pose {
        let mut rng = Rng::with_seed(seed);
        let mut random = || rng.f32();
        let waves: Vec<[f32; 3]> = (0..24).map(|_| [random(), 0.05 + random(), 6.3 * random()]).collect();
        let pause_s = 3.0 * random();
        move |t| {
            let t = if t < 10.0 { t } else { 10.0_f32.max(t - pause_s) };
            let sum = |n: usize| waves[4 * n..4 * n + 4].iter().map(|[a, f, p]| a * (f * t + p).sin()).sum::<f32>();
            Pose::from_ypr(Vec3::new(3.0 * sum(0), 3.0 * sum(1), 0.2 * sum(2)), 2.0 * sum(3), 0.3 * sum(4), 0.1 * sum(5))
        }
    }

    #[test]
    fn random_walks_stay_within_tolerance() {
        for seed in 0..20 {
            let all = recorded(30.0, walk(seed));
            for (metres, degrees) in [(0.05, 2.0_f32), (0.005, 0.2), (1.0, 0.5)] {
                let few = simplify(&all, metres, degrees.to_radians()).unwrap();
                assert_within(&few, &all, metres, degrees.to_radians());
                assert!(few.len() < all.len() / 4, "seed {seed}, {metres} m: {} of {}", few.len(), all.len());
            }
        }
    }

    #[test]
    fn uneven_times_and_jumps_stay_within_tolerance() {
        let mut all = recorded(20.0, walk(99));
        // Gaps, bursts and a jump.
        all = all.into_iter().enumerate().filter(|(i, _)| i % 7 != 3 && !(300..400).contains(i)).map(|(_, k)| k).collect();
        for k in &mut all[500..] {
            k.pose.position.x += 5.0;
        }
        let few = simplify(&all, 0.02, 0.02).unwrap();
        assert_within(&few, &all, 0.02, 0.02);
        assert!(few.len() < all.len() / 4, "{} of {}", few.len(), all.len());
    }

    #[test]
    fn between_sparse_keyframes_the_spline_stays_too() {
        // Keyframes far apart: comparing them alone would let the curve between them go.
        let all: Vec<Keyframe> = recorded(30.0, walk(5)).into_iter().step_by(45).collect();
        let few = simplify(&all, 0.05, 0.05).unwrap();
        let (path, whole) = (CameraPath::new(few).unwrap(), CameraPath::new(all).unwrap());
        for i in 0..3000 {
            let (a, b) = (path.pose_at(0.01 * f64::from(i)), whole.pose_at(0.01 * f64::from(i)));
            assert!(a.position.distance(b.position) < 0.06, "{i}");
        }
    }

    #[test]
    fn a_listener_who_stays_needs_two_keyframes() {
        let shaking = |t: f32| {
            Pose::from_ypr(Vec3::new(1.0, 2.0 + 1e-3 * (31.0 * t).sin(), 1.7), 0.3 + 1e-3 * (17.0 * t).cos(), 0.0, 0.0)
        };
        assert_eq!(simplify(&recorded(120.0, shaking), 0.01, 0.01).unwrap().len(), 2);
        assert_eq!(simplify(&recorded(0.0, shaking), 0.01, 0.01).unwrap().len(), 1);
        let line = |t: f32| Pose::from_ypr(Vec3::new(1.2 * t, 0.0, 1.7), 0.02 * t, 0.0, 0.0);
        assert_eq!(simplify(&recorded(60.0, line), 0.01, 0.01).unwrap().len(), 2, "nor does one who walks straight on");
    }

    #[test]
    fn a_circle_needs_few() {
        // A minute round a circle of 2 m at 60 poses a second, looking ahead.
        let turn = |t: f32| std::f32::consts::TAU * t / 60.0;
        let all = recorded(60.0, |t| {
            let a = turn(t);
            Pose::from_ypr(Vec3::new(2.0 * a.cos(), 2.0 * a.sin(), 1.7), a + std::f32::consts::FRAC_PI_2, 0.0, 0.0)
        });
        for (metres, degrees, most) in [(0.05, 2.0_f32, 13), (0.01, 0.5, 25), (0.001, 0.1, 80)] {
            let few = simplify(&all, metres, degrees.to_radians()).unwrap();
            println!("a circle within {metres} m and {degrees} degrees: {} of {} keyframes", few.len(), all.len());
            assert_within(&few, &all, metres, degrees.to_radians());
            assert!(few.len() <= most, "{metres} m, {degrees} degrees: {} of {}", few.len(), all.len());
        }
    }

    #[test]
    fn a_long_recording_stays_within_its_tolerances() {
        // To compare all poses with all would take hours. Far apart, poses are compared between them too, and hardly one can be
        // left out.
        let sparse = |step_s: f64| -> Vec<Keyframe> {
            let pose = |t: f32| Pose::from_ypr(Vec3::new(2.0 * t.cos(), 2.0 * t.sin(), 1.7), t.sin(), 0.0, 0.0);
            let at = |i: u32| (f64::from(i) * step_s, pose((f64::from(i) * 0.02 % std::f64::consts::TAU) as f32));
            (0..200_000).map(at).map(|(t_s, pose)| Keyframe { t_s, pose }).collect()
        };
        let dense = recorded(200_000.0 / 60.0, walk(7));
        let cases = [(dense.clone(), 0.05, 2.0_f32), (dense, 0.0, 0.0), (sparse(1.0), 0.05, 2.0), (sparse(1.0), 0.001, 0.1)];
        for (all, metres, degrees) in cases {
            let few = simplify(&all, metres, degrees.to_radians()).unwrap();
            println!("{metres} m, {degrees} degrees: {} of {} keyframes", few.len(), all.len());
            assert_within(&few, &all, metres + 1e-6, degrees.to_radians() + 1e-6);
        }
    }

    #[test]
    fn no_tolerance_keeps_all() {
        let all = recorded(1.0, walk(3));
        assert_eq!(simplify(&all, -1.0, 1.0).unwrap().len(), all.len());
        assert_eq!(simplify(&all, 1.0, f32::NAN).unwrap().len(), all.len());
        let exact = simplify(&all, 0.0, 0.0).unwrap();
        assert_within(&exact, &all, 1e-6, 1e-6);
        assert_eq!(simplify(&[], 1.0, 1.0), Err(PathError::Empty));
        assert!(matches!(simplify(&[all[1], all[0]], 1.0, 1.0), Err(PathError::NotRising { index: 1, .. })));
    }
}
