//! Real spherical harmonics in the order of AmbiX: channel `l * l + l + m` (ACN), full 3-D normalisation (N3D), no
//! Condon-Shortley phase (Nachbar et al., "AmbiX - a suggested Ambisonics format", Ambisonics Symposium 2011).

use super::near::lattice;
use crate::number::single;
use glam::{Quat, Vec3};

/// The highest order that is read.
const MAX_ORDER: usize = 4;
/// Directions that stand for the sphere in sums over it.
const SPHERE: usize = 4096;

/// Channels of an order.
#[must_use]
pub fn channels(order: usize) -> usize {
    (order + 1) * (order + 1)
}

/// The order with this many channels, 1 to 4.
#[must_use]
pub fn order_of(channels_found: usize) -> Option<usize> {
    (1..=MAX_ORDER).find(|order| channels(*order) == channels_found)
}

/// Degree of a channel.
#[must_use]
pub fn degree(channel: usize) -> usize {
    channel.isqrt()
}

/// Values of all channels of an order in a direction of unit length; the mean of each one's square over the sphere is 1.
#[must_use]
pub fn harmonics(order: usize, direction: Vec3) -> Vec<f32> {
    let [x, y, z] = direction.to_array().map(f64::from);
    let mut values = vec![0.0_f32; channels(order)];
    // cos and sin of m times the azimuth, times the m-th power of the cosine of the elevation.
    let (mut cosine, mut sine) = (1.0, 0.0);
    let mut sectoral = 1.0;
    for m in 0..=order {
        if m > 0 {
            (cosine, sine) = (x * cosine - y * sine, x * sine + y * cosine);
            sectoral *= (2 * m - 1) as f64;
        }
        // Associated Legendre functions over the m-th power of the cosine, by their recursion in the degree.
        let (mut before, mut legendre) = (0.0, sectoral);
        for l in m..=order {
            if l > m {
                let next = ((2 * l - 1) as f64 * z * legendre - (l + m - 1) as f64 * before) / (l - m) as f64;
                (before, legendre) = (legendre, next);
            }
            // (l - m)! / (l + m)!
            let ratio: f64 = (l - m + 1..=l + m).map(|k| 1.0 / k as f64).product();
            let twice = if m == 0 { 1.0 } else { 2.0 };
            let value = ((2 * l + 1) as f64 * twice * ratio).sqrt() * legendre;
            values[l * l + l + m] = single(value * cosine);
            if m > 0 {
                values[l * l + l - m] = single(value * sine);
            }
        }
    }
    values
}

/// How channels change when the head turns by `head`: `turned[i]` is the sum of `matrix[i][j]` times channel `j`. Channels of
/// other degrees have no part.
#[must_use]
pub fn turning(order: usize, head: Quat) -> Vec<Vec<f32>> {
    let count = channels(order);
    let mut matrix = vec![vec![0.0_f64; count]; count];
    for i in 0..SPHERE {
        let world = lattice(i, SPHERE);
        let (seen, there) = (harmonics(order, head.inverse() * world), harmonics(order, world));
        for (row, a) in seen.iter().enumerate() {
            let l = degree(row);
            for column in l * l..channels(l) {
                matrix[row][column] += f64::from(a * there[column]) / SPHERE as f64;
            }
        }
    }
    matrix.into_iter().map(|row| row.into_iter().map(single).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_channels_are_those_of_ambix() {
        let d = Vec3::new(0.6, -0.48, 0.64);
        let y = harmonics(2, d);
        let (r3, r5, r15) = (3.0_f32.sqrt(), 5.0_f32.sqrt(), 15.0_f32.sqrt());
        let expected = [
            1.0,
            r3 * d.y,
            r3 * d.z,
            r3 * d.x,
            r15 * d.x * d.y,
            r15 * d.y * d.z,
            r5 * 0.5 * (3.0 * d.z * d.z - 1.0),
            r15 * d.x * d.z,
            r15 * 0.5 * (d.x * d.x - d.y * d.y),
        ];
        for (channel, (found, expected)) in y.iter().zip(expected).enumerate() {
            assert!((found - expected).abs() < 1e-5, "channel {channel}: {found}, not {expected}");
        }
        assert_eq!((order_of(4), order_of(25), order_of(7), order_of(36)), (Some(1), Some(4), None, None));
    }

    #[test]
    fn they_are_orthonormal_and_turn_with_the_head() {
        let identity = turning(4, Quat::IDENTITY);
        for (i, row) in identity.iter().enumerate() {
            for (j, v) in row.iter().enumerate() {
                assert!((v - f32::from(u8::from(i == j))).abs() < 2e-3, "{i} {j}: {v}");
            }
        }
        let head = Quat::from_rotation_z(0.7) * Quat::from_rotation_y(-0.4) * Quat::from_rotation_x(0.3);
        let direction = Vec3::new(0.6, -0.48, 0.64);
        let world = harmonics(4, direction);
        let expected = harmonics(4, head.inverse() * direction);
        for (row, expected) in turning(4, head).iter().zip(expected) {
            let turned: f32 = row.iter().zip(&world).map(|(a, b)| a * b).sum();
            assert!((turned - expected).abs() < 5e-3, "{turned}, not {expected}");
        }
    }
}
