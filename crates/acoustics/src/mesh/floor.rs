//! The floor in points of a place.

use super::Mesh;
use glam::{DMat3, DVec3};
use promenade_core::random::Random;

/// Planes that are tried, each through three points (M. A. Fischler and R. C. Bolles 1981).
const TRIES: usize = 2000;
/// Least cosine between a floor's normal and up.
const LEVEL: f64 = 0.94;
/// Points of a floor lie within this share of the place's height of it.
const WITHIN: f64 = 0.015;
/// The floor lies below this share of the height of all points.
const LOWER: f64 = 0.4;
/// Points below the floor at most, as a share of those on it.
const BELOW: f64 = 0.5;
/// Share of the points that a floor has at least.
const LEAST: f64 = 0.02;

/// A plane on which many points lie, below nearly all others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Floor {
    /// Up from it, a unit vector.
    pub normal: [f64; 3],
    /// Height of its middle, metres.
    pub height_m: f64,
    /// Share of the points that lie on it.
    pub share: f64,
}

impl Mesh {
    /// The floor of a place that is given by points on its surfaces, z about up; none where no plane within 20 degrees of level
    /// has 2 % of the points. The same each time.
    #[must_use]
    pub fn floor_of(points: &[[f64; 3]]) -> Option<Floor> {
        let mut heights: Vec<f64> = points.iter().map(|p| p[2]).collect();
        heights.sort_by(f64::total_cmp);
        let out = points.len() / 100;
        let (low, high) = (*heights.get(out)?, *heights.get(heights.len().checked_sub(1 + out)?)?);
        let (within, top) = (WITHIN * (high - low), low + LOWER * (high - low));
        let lower: Vec<DVec3> = points.iter().filter(|p| p[2] <= top).map(|p| DVec3::from(*p)).collect();
        if lower.len() < 3 || high <= low {
            return None;
        }
        let mut random = Random::stream(1, 0);
        let mut any = || lower[((random.uniform_f64() * lower.len() as f64) as usize).min(lower.len() - 1)];
        let count = |normal: DVec3, at: DVec3| {
            let mut counts = [0_usize; 2];
            for point in &lower {
                let off = normal.dot(*point - at);
                counts[0] += usize::from(off.abs() < within);
                counts[1] += usize::from(off < -2.0 * within);
            }
            ((counts[1] as f64) < BELOW * counts[0] as f64).then_some(counts[0])
        };
        let mut best: Option<(usize, DVec3, DVec3)> = None;
        for _ in 0..TRIES {
            let [a, b, c] = [any(), any(), any()];
            let Some(normal) = (b - a).cross(c - a).try_normalize() else { continue };
            let normal = if normal.z < 0.0 { -normal } else { normal };
            if normal.z < LEVEL {
                continue;
            }
            if let Some(found) = count(normal, a).filter(|found| best.is_none_or(|best| *found > best.0)) {
                best = Some((found, normal, a));
            }
        }
        let (_, normal, at) = best?;
        // Through all that lie on it, twice.
        let (mut normal, mut at, mut on) = (normal, at, 0);
        for _ in 0..2 {
            let near: Vec<DVec3> = lower.iter().copied().filter(|p| normal.dot(*p - at).abs() < 1.5 * within).collect();
            on = near.len();
            at = near.iter().sum::<DVec3>() / on.max(1) as f64;
            let spread = near.iter().fold(DMat3::ZERO, |sum, p| {
                let p = *p - at;
                sum + DMat3::from_cols(p.x * p, p.y * p, p.z * p)
            });
            let slack = 1e-9 * (spread.x_axis.x + spread.y_axis.y + spread.z_axis.z).max(f64::MIN_POSITIVE);
            let inverse = (spread + DMat3::from_diagonal(DVec3::splat(slack))).inverse();
            for _ in 0..30 {
                normal = (inverse * normal).try_normalize().filter(|n| n.is_finite()).unwrap_or(normal);
            }
        }
        let normal = if normal.z < 0.0 { -normal } else { normal };
        let share = on as f64 / points.len() as f64;
        (share >= LEAST && normal.z >= LEVEL).then_some(Floor { normal: normal.to_array(), height_m: at.z, share })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_floor_is_found_under_a_bed() {
        let mut random = Random::stream(2, 0);
        let mut points = Vec::new();
        // A floor that leans by 3 degrees, a bed on it with more points, a wall, and the sky's reflections below.
        let lean = 3.0_f64.to_radians().tan();
        for i in 0..4000 {
            let [x, y, z] = [0; 3].map(|_| random.uniform_f64());
            points.push(match i % 8 {
                0..3 => [4.0 * x, 3.0 * y, lean * 4.0 * x + 0.02 * (z - 0.5)],
                3..7 => [1.0 + 2.0 * x, 1.0 + y, 0.5 + lean * (1.0 + 2.0 * x) + 0.2 * z],
                _ if i % 64 == 7 => [4.0 * x, 3.0 * y, -2.0 * z],
                _ => [0.0, 3.0 * y, 2.4 * z],
            });
        }
        let floor = Mesh::floor_of(&points).unwrap();
        let tilt = floor.normal[2].acos().to_degrees();
        assert!((tilt - 3.0).abs() < 0.3 && floor.share > 0.3, "{floor:?}");
        assert!((floor.height_m - 2.0 * lean).abs() < 0.05, "{floor:?}");
        assert_eq!(Mesh::floor_of(&[[0.0; 3]; 50]), None);
    }
}
