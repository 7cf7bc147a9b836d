//! Heads made of numbers.

use promenade_core::Head;
use promenade_core::glam::Vec3;
use promenade_core::head::{HeadDirection, head_band_hz, lattice};
use std::f32::consts::FRAC_PI_2;

/// Speed of sound, metres a second.
const SPEED_M_S: f32 = 343.0;

/// What a rigid sphere with ears at its sides makes of a direction: delays after Woodworth (1938), and a shadow of one pole and one zero
/// (Brown and Duda 1998).
#[must_use]
pub fn direction(towards: Vec3, radius_m: f32) -> HeadDirection {
    let unit = towards.normalize();
    let corner_hz = SPEED_M_S / (std::f32::consts::TAU * radius_m);
    let angle = |side: f32| (side * unit.y).clamp(-1.0, 1.0).acos();
    let way = |side: f32| if angle(side) < FRAC_PI_2 { -angle(side).cos() } else { angle(side) - FRAC_PI_2 };
    let level = |side: f32, hz: f32| {
        let alpha = 1.05 + 0.95 * (angle(side) * 1.2).min(std::f32::consts::PI).cos();
        let ratio = (hz / corner_hz).powi(2);
        10.0 * ((1.0 + (0.5 * alpha).powi(2) * ratio) / (1.0 + 0.25 * ratio)).log10()
    };
    HeadDirection {
        direction: towards,
        delays_s: [1.0, -1.0].map(|side| way(side) * radius_m / SPEED_M_S),
        levels_db: [1.0, -1.0].map(|side| std::array::from_fn(|band| level(side, head_band_hz(band) as f32))),
    }
}

/// A sphere of a radius in metres, heard in 500 directions.
///
/// # Panics
/// A radius that no head has.
#[must_use]
pub fn sphere(radius_m: f32) -> Head {
    let measured = (0..500).map(|i| direction(lattice(i, 500), radius_m)).collect();
    Head::new("Sphere", "nobody", measured).unwrap()
}
