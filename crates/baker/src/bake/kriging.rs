//! Interpolation of scattered measurements onto the nodes of a field.

use glam::Vec3;
use nalgebra::{DMatrix, DVector};
use promenade_core::glam;

/// Measurements that a node is interpolated from, at most.
const NEIGHBOURS: usize = 48;
/// Measurements closer together than this share of their distance from the node count as one.
const CROWDING: f64 = 0.25;
/// Distance over which masks stay alike: chord of the unit sphere of directions.
const DIRECTION_SCALE: f64 = 1.0;
/// Distance over which rooms stay alike, metres.
const POSITION_SCALE_M: f64 = 1.0;

/// Where a transfer function was measured, or is wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Site {
    /// Unit vector to the emitter in the head frame.
    pub(crate) direction: Vec3,
    /// Listener position, metres.
    pub(crate) position: Vec3,
}

impl Site {
    pub(crate) fn distance(&self, other: &Self) -> f64 {
        let d = f64::from((self.direction - other.direction).length()) / DIRECTION_SCALE;
        let p = f64::from((self.position - other.position).length()) / POSITION_SCALE_M;
        (d * d + p * p).sqrt()
    }
}

/// Measurements that a node of a ring is interpolated from, at most, ...
const PER_NODE: usize = 4;
/// ... as far as their weights are above this share.
const SMALLEST_SHARE: f64 = 0.1;

/// The measurements of a ring around a node of its plane, with weights that sum to 1.
pub(crate) fn of_ring(sites: &[Site], node: &Site, nugget: f64) -> Vec<(usize, f64)> {
    let mut found = weights(sites, node, nugget);
    found.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    found.truncate(PER_NODE);
    let sum: f64 = found.iter().map(|s| s.1.max(0.0)).sum();
    found.retain(|s| s.1 > SMALLEST_SHARE * sum);
    let sum: f64 = found.iter().map(|s| s.1).sum();
    found.iter_mut().for_each(|s| s.1 /= sum);
    found
}

/// Weights of measurements at a node, by ordinary kriging: they sum to 1 and pick out a measurement made at the node itself.
///
/// Covariance: Matern with smoothness 3/2 (Rasmussen and Williams 2006, equation 4.17), over the chord between directions and
/// the distance between positions. At most 48 measurements take part, the nearest that do not crowd together. `nugget` is the
/// part of a measurement's variance that it shares with no other.
pub(crate) fn weights(sites: &[Site], node: &Site, nugget: f64) -> Vec<(usize, f64)> {
    let mut order: Vec<usize> = (0..sites.len()).collect();
    order.sort_by(|&a, &b| sites[a].distance(node).total_cmp(&sites[b].distance(node)).then(a.cmp(&b)));
    // Of measurements that crowd together far from the node one says as much as all of them, and keeps the system well
    // conditioned.
    let mut near: Vec<usize> = Vec::with_capacity(NEIGHBOURS);
    for site in order {
        let crowd = CROWDING * sites[site].distance(node);
        if near.len() < NEIGHBOURS && near.iter().all(|&n| sites[n].distance(&sites[site]) >= crowd) {
            near.push(site);
        }
    }
    if let [only] = near[..] {
        return vec![(only, 1.0)];
    }
    let n = near.len();
    let covariance = |r: f64| {
        let s = 3.0_f64.sqrt() * r;
        (1.0 + s) * (-s).exp()
    };
    let system = DMatrix::from_fn(n + 1, n + 1, |i, j| match (i == n, j == n) {
        (true, true) => 0.0,
        (true, false) | (false, true) => 1.0,
        // A small nugget keeps measurements at one and the same site from making the system singular.
        (false, false) => covariance(sites[near[i]].distance(&sites[near[j]])) + if i == j { nugget } else { 0.0 },
    });
    let right = DVector::from_fn(n + 1, |i, _| if i == n { 1.0 } else { covariance(sites[near[i]].distance(node)) });
    match system.lu().solve(&right) {
        Some(solution) => near.iter().enumerate().map(|(i, &site)| (site, solution[i])).collect(),
        None => vec![(near[0], 1.0)],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring(count: usize) -> Vec<Site> {
        (0..count)
            .map(|i| {
                let a = std::f32::consts::TAU * i as f32 / count as f32;
                Site { direction: Vec3::new(a.cos(), a.sin(), 0.0), position: Vec3::ZERO }
            })
            .collect()
    }

    #[test]
    fn a_measurement_at_the_node_takes_all_the_weight() {
        let sites = ring(19);
        for (index, weight) in weights(&sites, &sites[7], 1e-9) {
            assert!((weight - if index == 7 { 1.0 } else { 0.0 }).abs() < 1e-6);
        }
    }

    #[test]
    fn far_from_a_dense_ring_no_weight_is_wild() {
        let sites = ring(360);
        let pole = Site { direction: Vec3::Z, position: Vec3::ZERO };
        for (_, weight) in weights(&sites, &pole, 1e-9) {
            assert!((-0.05..0.5).contains(&weight), "{weight}");
        }
    }

    #[test]
    fn weights_sum_to_one_and_reproduce_a_smooth_function() {
        let sites = ring(36);
        let a = 0.05_f32;
        let node = Site { direction: Vec3::new(a.cos(), a.sin(), 0.0), position: Vec3::ZERO };
        let w = weights(&sites, &node, 1e-9);
        assert!((w.iter().map(|(_, v)| v).sum::<f64>() - 1.0).abs() < 1e-9);
        let value: f64 = w.iter().map(|&(i, v)| v * f64::from(sites[i].direction.y)).sum();
        assert!((value - f64::from(a.sin())).abs() < 2e-3, "{value}");
    }
}
