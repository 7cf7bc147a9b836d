//! Clusters of points: Lloyd's k-means from a k-means++ start.

use promenade_core::glam::{DVec3, Vec3};
use promenade_core::random::Random;

const MAX_ITERATIONS: usize = 300;
/// Squared movement of all centres together below which they stand still, of the mean variance of the coordinates.
const TOLERANCE: f64 = 1e-4;

/// Clusters of points.
#[derive(Debug)]
pub(super) struct Clusters {
    pub(super) centres: Vec<Vec3>,
    /// Sum of the squared distances of the points to the nearest centre.
    pub(super) inertia: f64,
    pub(super) iterations: usize,
}

/// Coordinates one after the other, so that the search for the nearest runs over whole vectors of them.
#[derive(Default)]
struct Centres {
    axes: [Vec<f32>; 3],
    distances: Vec<f32>,
}

impl Centres {
    fn of(centres: &[Vec3]) -> Self {
        let axis = |a: usize| centres.iter().map(|c| c[a]).collect();
        Self { axes: [axis(0), axis(1), axis(2)], distances: vec![0.0; centres.len()] }
    }

    /// The nearest centre, of equally near ones the first, and its squared distance.
    fn nearest(&mut self, p: Vec3) -> (usize, f32) {
        let [x, y, z] = &self.axes;
        for (((d, x), y), z) in self.distances.iter_mut().zip(x).zip(y).zip(z) {
            *d = (x - p.x) * (x - p.x) + (y - p.y) * (y - p.y) + (z - p.z) * (z - p.z);
        }
        let least = self.distances.iter().copied().fold(f32::INFINITY, f32::min);
        (self.distances.iter().position(|d| *d == least).unwrap_or(0), least)
    }
}

/// Finds `count` clusters among at least as many points. The same each time for one seed.
pub(super) fn k_means(points: &[Vec3], count: usize, seed: u64) -> Clusters {
    // About their mean, differences of coordinates lose least.
    let n = points.len() as f64;
    let mean = (points.iter().map(|p| p.as_dvec3()).sum::<DVec3>() / n).as_vec3();
    let points: Vec<Vec3> = points.iter().map(|p| *p - mean).collect();
    let variance = points.iter().map(|p| f64::from(p.length_squared())).sum::<f64>() / (3.0 * n);
    let mut centres = start(&points, count, &mut Random::new(seed));
    let mut labels = vec![usize::MAX; points.len()];
    let mut iterations = 0;
    while iterations < MAX_ITERATIONS {
        iterations += 1;
        let (changed, moved) = step(&points, &mut labels, &mut centres);
        if !changed || moved <= TOLERANCE * variance {
            break;
        }
    }
    let mut last = Centres::of(&centres);
    let inertia = points.iter().map(|p| f64::from(last.nearest(*p).1)).sum();
    Clusters { centres: centres.into_iter().map(|c| c + mean).collect(), inertia, iterations }
}

/// Greedy k-means++ (Arthur and Vassilvitskii 2007): each next centre is the best of a few points drawn by their squared
/// distance to the centres so far.
fn start(points: &[Vec3], count: usize, random: &mut Random) -> Vec<Vec3> {
    let trials = 2 + (count as f32).ln() as usize;
    let at = |share: f64, weights: &[f32], total: f64| {
        let mut left = share * total;
        let found = weights.iter().position(|w| {
            left -= f64::from(*w);
            left < 0.0
        });
        // Where rounding leaves a rest, the last point with a weight.
        found.or_else(|| weights.iter().rposition(|w| *w > 0.0)).unwrap_or(0)
    };
    let sum = |d: &[f32]| d.iter().map(|v| f64::from(*v)).sum::<f64>();
    let first = points[at(f64::from(random.uniform()), &vec![1.0; points.len()], points.len() as f64)];
    let mut centres = vec![first];
    let mut nearest: Vec<f32> = points.iter().map(|p| p.distance_squared(first)).collect();
    let mut total = sum(&nearest);
    while centres.len() < count {
        let mut best: Option<(f64, Vec3, Vec<f32>)> = None;
        for _ in 0..trials {
            let candidate = points[at(f64::from(random.uniform()), &nearest, total)];
            let with: Vec<f32> = points.iter().zip(&nearest).map(|(p, d)| d.min(p.distance_squared(candidate))).collect();
            let left = sum(&with);
            if best.as_ref().is_none_or(|(least, ..)| left < *least) {
                best = Some((left, candidate, with));
            }
        }
        let Some((left, candidate, with)) = best else { break };
        (total, nearest) = (left, with);
        centres.push(candidate);
    }
    centres
}

/// One round: whether a point has changed its cluster, and the squared movement of all centres.
fn step(points: &[Vec3], labels: &mut [usize], centres: &mut [Vec3]) -> (bool, f64) {
    let mut search = Centres::of(centres);
    let mut sums = vec![(DVec3::ZERO, 0_u32); centres.len()];
    let mut distances = Vec::with_capacity(points.len());
    let mut changed = false;
    for (point, label) in points.iter().zip(labels.iter_mut()) {
        let (nearest, distance) = search.nearest(*point);
        changed |= *label != nearest;
        *label = nearest;
        distances.push(distance);
        sums[nearest] = (sums[nearest].0 + point.as_dvec3(), sums[nearest].1 + 1);
    }
    // A centre without points takes the point that is farthest from its own.
    for empty in 0..sums.len() {
        if sums[empty].1 > 0 {
            continue;
        }
        let farthest =
            (0..points.len()).filter(|i| sums[labels[*i]].1 > 1).max_by(|a, b| distances[*a].total_cmp(&distances[*b]));
        let Some(farthest) = farthest else { continue };
        let (point, (sum, count)) = (points[farthest].as_dvec3(), sums[labels[farthest]]);
        sums[labels[farthest]] = (sum - point, count - 1);
        sums[empty] = (sums[empty].0 + point, 1);
        (labels[farthest], distances[farthest], changed) = (empty, 0.0, true);
    }
    let mut moved = 0.0;
    for (centre, (sum, count)) in centres.iter_mut().zip(&sums) {
        let next = (*sum / f64::from(*count)).as_vec3();
        moved += f64::from(centre.distance_squared(next));
        *centre = next;
    }
    (changed, moved)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_clusters_that_lie_apart() {
        let mut random = Random::new(3);
        let mut points = Vec::new();
        for corner in 0..8 {
            let corner = 100.0 * Vec3::new((corner & 1) as f32, (corner >> 1 & 1) as f32, (corner >> 2) as f32);
            let mut offset = || Vec3::new(random.uniform(), random.uniform(), random.uniform()) - 0.5;
            points.extend((0..40).map(|_| corner + offset()));
        }
        let clusters = k_means(&points, 8, 1);
        for centre in &clusters.centres {
            let corner = (*centre / 100.0).round() * 100.0;
            assert!(centre.distance(corner) < 0.3, "{centre}");
        }
        assert!(clusters.inertia < 8.0 * 40.0 * 0.3 && clusters.iterations < 5, "{clusters:?}");
        assert_eq!(k_means(&points, 8, 1).centres, clusters.centres, "the same each time");
        assert_ne!(k_means(&points, 20, 1).centres, k_means(&points, 20, 2).centres, "the seed counts");
    }

    #[test]
    fn as_many_clusters_as_points_are_the_points() {
        let points: Vec<Vec3> = (0..20).map(|i| Vec3::new((i * i) as f32, i as f32, 0.0)).collect();
        let clusters = k_means(&points, 20, 1);
        let mut found = clusters.centres;
        found.sort_by(|a, b| a.x.total_cmp(&b.x));
        assert!(found.iter().zip(&points).all(|(a, b)| a.distance(*b) < 1e-4), "{found:?}");
        assert!(clusters.inertia < 1e-6);
    }

    #[test]
    fn points_on_one_spot_make_clusters_all_the_same() {
        let clusters = k_means(&[Vec3::ONE; 5], 3, 1);
        assert!(clusters.centres.iter().all(|c| c.distance(Vec3::ONE) < 1e-6), "{clusters:?}");
    }
}
