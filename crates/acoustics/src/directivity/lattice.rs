//! Directions that cover the sphere evenly, and random ones.

use glam::DVec3;
use promenade_core::random::Random;

/// Direction `i` of `count` of Fibonacci's lattice, at the middles of bands of equal area (Swinbank and Purser 2006). Unit
/// length.
#[must_use]
pub fn fibonacci(i: usize, count: usize) -> [f64; 3] {
    direction(i, count).to_array()
}

pub(crate) fn direction(i: usize, count: usize) -> DVec3 {
    let z = 1.0 - (2 * i + 1) as f64 / count as f64;
    let radius = (1.0 - z * z).max(0.0).sqrt();
    // A turn of the golden angle; whole turns are taken off first, which keeps far members exact.
    let turns = (i as f64 * GOLDEN).fract();
    let (sine, cosine) = (std::f64::consts::TAU * turns).sin_cos();
    DVec3::new(radius * cosine, radius * sine, z)
}

/// A random direction after Lambert's law about a normal: the normal and a point of the unit sphere about its end.
pub(crate) fn lambert(normal: DVec3, random: &mut Random) -> DVec3 {
    let z = 1.0 - 2.0 * random.uniform_f64();
    let (sine, cosine) = (std::f64::consts::TAU * random.uniform_f64()).sin_cos();
    let radius = (1.0 - z * z).max(0.0).sqrt();
    (normal + DVec3::new(radius * cosine, radius * sine, z)).try_normalize().unwrap_or(normal)
}

/// The smaller part of a circle that is divided by the golden ratio.
const GOLDEN: f64 = 0.381_966_011_250_105_1;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_even() {
        let all: Vec<DVec3> = (0..2048).map(|i| direction(i, 2048)).collect();
        assert!(all.iter().all(|d| (d.length() - 1.0).abs() < 1e-12));
        assert!(all.iter().sum::<DVec3>().length() < 1e-3 * 2048.0);
        // No direction of the sphere is farther from a member than 1.4 times the radius of a member's share of the sphere.
        let reach = (1.4 * 2.0 / 2048.0_f64.sqrt()).cos();
        for i in 0..500 {
            let any = DVec3::new((i as f64).sin(), (1.7 * i as f64).cos(), (0.3 * i as f64).sin()).normalize();
            assert!(all.iter().any(|d| d.dot(any) > reach), "{any}");
        }
    }
}
