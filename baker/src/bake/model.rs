//! What a model head makes of a direction, which measured direct sounds are interpolated against.

use promenade_core::glam::Vec3;
use promenade_core::head::{at_hz, lag_s, low_pass_power};
use promenade_core::{Head, StftGrid};
use promenade_fourier::minimum_phase_log;
use promenade_fourier::num_complex::Complex64;

/// Radius of a head over the speed of sound, seconds.
const RADIUS_S: f64 = 0.09 / 343.0;
/// Nepers of a decibel.
const NEPERS_PER_DB: f64 = std::f64::consts::LN_10 / 20.0;

/// A model head on a grid.
pub(crate) struct Model<'a> {
    head: Option<&'a Head>,
    grid: &'a StftGrid,
}

/// What it makes of one direction: logarithms of the ears' gains by bin, and the delay between them beyond that of their
/// minimum phases, seconds, positive when the left ear is later.
pub(crate) struct Modelled {
    pub(crate) logs: [Vec<f64>; 2],
    pub(crate) delay_s: f64,
}

impl<'a> Model<'a> {
    /// Of the head that responses were measured with; where it is not known, of a rigid sphere, whose delays alone count.
    pub(crate) fn of(head: Option<&'a Head>, grid: &'a StftGrid) -> Self {
        Self { head, grid }
    }

    /// Towards a direction of unit length.
    pub(crate) fn at(&self, direction: Vec3) -> Modelled {
        let bins = self.grid.bins();
        let Some(head) = self.head else {
            // Woodworth 1938.
            let y = f64::from(direction.y).clamp(-1.0, 1.0);
            return Modelled { logs: [vec![0.0; bins], vec![0.0; bins]], delay_s: -RADIUS_S * (y.asin() + y) };
        };
        let ears = head.ears(direction);
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
        Modelled { delay_s: f64::from(ears.itd_s()) - lag_s(cross), logs }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_far_ear_is_later() {
        let grid = StftGrid { sample_rate_hz: 48_000.0, n_fft: 960, hop: 240 };
        let [left, ahead] = [Vec3::Y, Vec3::X].map(|d| Model::of(None, &grid).at(d));
        assert!((-800e-6..-600e-6).contains(&left.delay_s), "{}", left.delay_s);
        assert!(ahead.delay_s.abs() < 1e-9, "{}", ahead.delay_s);
    }
}
