//! Directions around a direction.

use crate::number::single;
use glam::Vec3;

/// Directions that a response is interpolated from.
pub const NEIGHBOURS: usize = 5;
/// Directions that stand for the sphere in means over it.
const SPHERE: usize = 4096;

/// The measured directions nearest to a direction, unit vectors all, with weights that sum to 1, the nearest first: Franke and
/// Little's weights (1980), which fall to 0 where the next further direction lies, so that a turn of the head has no steps.
///
/// With none measured, all weight is on a direction 0 that is not there.
#[must_use]
pub fn near(measured: &[Vec3], direction: Vec3) -> [(usize, f32); NEIGHBOURS] {
    // One more sets how far the others reach.
    let mut nearest = [(usize::MAX, f32::NEG_INFINITY); NEIGHBOURS + 1];
    for (i, d) in measured.iter().enumerate() {
        let closeness = d.dot(direction);
        if closeness > nearest[NEIGHBOURS].1 {
            let place = nearest.partition_point(|n| n.1 >= closeness);
            nearest[place..].rotate_right(1);
            nearest[place] = (i, closeness);
        }
    }
    let far = |(i, _): (usize, f32)| measured.get(i).map(|d| d.distance(direction));
    // With few directions all of them count, however far.
    let reach = far(nearest[NEIGHBOURS]).unwrap_or(4.0);
    let mut weights = [(0, 0.0); NEIGHBOURS];
    let mut sum = 0.0;
    for (weight, n) in weights.iter_mut().zip(nearest) {
        let Some(distance) = far(n) else { continue };
        let w = ((reach - distance).max(0.0) / (reach * distance.max(1e-6)).max(1e-12)).powi(2);
        *weight = (n.0, w);
        sum += w;
    }
    if sum > 0.0 {
        weights.iter_mut().for_each(|w| w.1 /= sum);
    } else {
        weights[0] = (nearest[0].0, 1.0);
    }
    weights
}

/// A direction of a lattice of `count` that covers the sphere evenly (Swinbank and Purser 2006).
#[must_use]
pub fn lattice(i: usize, count: usize) -> Vec3 {
    let (i, count) = (single(i as f64) + 0.5, single(count as f64));
    let z = 1.0 - 2.0 * i / count;
    let turn = std::f32::consts::PI * (1.0 + 5.0_f32.sqrt()) * i;
    let r = (1.0 - z * z).max(0.0).sqrt();
    Vec3::new(r * turn.cos(), r * turn.sin(), z)
}

/// The share of the sphere that each direction stands for: how much of it is nearest to it.
pub(super) fn shares(measured: &[Vec3]) -> Vec<f32> {
    let mut shares = vec![0.0; measured.len()];
    for i in 0..SPHERE {
        if let Some(nearest) = nearest(measured, lattice(i, SPHERE)) {
            shares[nearest] += 1.0 / single(SPHERE as f64);
        }
    }
    shares
}

/// At most `count` of the directions, the numbers of unit vectors in rising order: from the first on, always the one that lies
/// furthest from those that are kept, so that crowded places are thinned out first (Gonzalez 1985).
#[must_use]
pub fn spread(measured: &[Vec3], count: usize) -> Vec<usize> {
    if measured.len() <= count {
        return (0..measured.len()).collect();
    }
    let mut closeness = vec![f32::NEG_INFINITY; measured.len()];
    let (mut kept, mut newest) = (Vec::with_capacity(count), 0);
    while kept.len() < count {
        kept.push(newest);
        for (closeness, direction) in closeness.iter_mut().zip(measured) {
            *closeness = closeness.max(direction.dot(measured[newest]));
        }
        newest = (0..measured.len()).min_by(|a, b| closeness[*a].total_cmp(&closeness[*b])).unwrap_or(0);
    }
    kept.sort_unstable();
    kept
}

fn nearest(measured: &[Vec3], direction: Vec3) -> Option<usize> {
    (0..measured.len()).max_by(|a, b| measured[*a].dot(direction).total_cmp(&measured[*b].dot(direction)))
}
