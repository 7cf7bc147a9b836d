//! What a model head makes of a direction, which measured direct sounds are interpolated against.

use promenade_core::glam::Vec3;
use promenade_core::head::{at_hz, lag_s, low_pass_power};
use promenade_core::{Head, StftGrid};
use promenade_fourier::minimum_phase_log;
use promenade_fourier::num_complex::Complex64;

/// Up to the first of these frequencies levels are taken relative to a head that stands in for the measured one, from the
/// second on as they are, Hz: pinnae differ.
const ALIKE_HZ: (f64, f64) = (2_500.0, 6_000.0);
/// Where neighbouring directions are closer than this, radians, delays are taken relative to a sphere's: between them it is as
/// near as a head that stands in for the measured one, and smoother.
const DENSE: f32 = 12.0 * std::f32::consts::PI / 180.0;
/// Its radius over the speed of sound, seconds.
const SPHERE_S: f64 = 0.0875 / 343.0;
/// Nepers of a decibel.
const NEPERS_PER_DB: f64 = std::f64::consts::LN_10 / 20.0;

/// A model head on a grid.
pub(crate) struct Model<'a> {
    head: &'a Head,
    /// How much of the logarithms of its gains counts, by bin.
    shares: Vec<f64>,
    /// Whether delays are a sphere's.
    sphere: bool,
    grid: &'a StftGrid,
}

/// What it makes of one direction: logarithms of the ears' gains by bin, and the delay between them beyond that of their
/// minimum phases, seconds, positive when the left ear is later.
pub(crate) struct Modelled {
    pub(crate) logs: [Vec<f64>; 2],
    pub(crate) delay_s: f64,
}

impl<'a> Model<'a> {
    /// Of the head that responses were measured with.
    pub(crate) fn of(head: &'a Head, grid: &'a StftGrid) -> Self {
        Self { head, shares: vec![1.0; grid.bins()], sphere: false, grid }
    }

    /// Of a head that stands in for the one they were measured with, in directions so far apart, radians.
    pub(crate) fn instead(head: &'a Head, grid: &'a StftGrid, spacing: f32) -> Self {
        let share = |k: usize| {
            let along = (grid.bin_hz(k).max(1.0) / ALIKE_HZ.0).ln() / (ALIKE_HZ.1 / ALIKE_HZ.0).ln();
            0.5 + 0.5 * (std::f64::consts::PI * along.clamp(0.0, 1.0)).cos()
        };
        Self { head, shares: (0..grid.bins()).map(share).collect(), sphere: spacing < DENSE, grid }
    }

    /// Towards a direction of unit length.
    pub(crate) fn at(&self, direction: Vec3) -> Modelled {
        let bins = self.grid.bins();
        let ears = self.head.ears(direction);
        let hz = |k: usize| self.grid.bin_hz(k);
        let logs = ears
            .levels_db
            .each_ref()
            .map(|levels| -> Vec<f64> { (0..bins).map(|k| NEPERS_PER_DB * f64::from(at_hz(levels, hz(k)))).collect() });
        let minimum = logs.each_ref().map(|logs| minimum_phase_log(logs.iter().copied(), self.grid.n_fft));
        let cross = minimum[0].iter().zip(&minimum[1]).enumerate();
        let cross = cross.map(|(k, (l, r))| {
            let weighed: Complex64 = l.exp() * r.exp().conj();
            (hz(k), low_pass_power(hz(k)) * weighed)
        });
        let delay_s = if self.sphere { sphere_s(direction) } else { f64::from(ears.itd_s()) - lag_s(cross) };
        let counted = logs.map(|logs| logs.iter().zip(&self.shares).map(|(log, share)| share * log).collect());
        Modelled { delay_s, logs: counted }
    }
}

/// The interaural delay of a rigid sphere (Woodworth 1938), seconds, positive when the left ear is later.
fn sphere_s(direction: Vec3) -> f64 {
    let left = f64::from(direction.y).clamp(-1.0, 1.0);
    -SPHERE_S * (left.asin() + left)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::model_head::model_head;

    #[test]
    fn the_far_ear_is_later() {
        let grid = StftGrid { sample_rate_hz: 48_000.0, n_fft: 960, hop: 240 };
        let [left, ahead] = [Vec3::Y, Vec3::X].map(|d| Model::instead(model_head(), &grid, 0.5).at(d));
        assert!((Model::instead(model_head(), &grid, 0.1).at(Vec3::Y).delay_s + 656e-6).abs() < 1e-6, "a sphere's");
        assert!((-800e-6..-500e-6).contains(&left.delay_s), "{}", left.delay_s);
        assert!(ahead.delay_s.abs() < 30e-6, "{}", ahead.delay_s);
        let shade = |hz: f64| {
            let k = (hz / grid.bin_hz(1)).round() as usize;
            left.logs[0][k] - left.logs[1][k]
        };
        assert!(shade(2_000.0) > 0.6, "the near ear is louder: {} nepers", shade(2_000.0));
        assert!(shade(6_100.0).abs() < 1e-9 && shade(10_000.0).abs() < 1e-9, "pinnae are the measured head's own");
    }
}
