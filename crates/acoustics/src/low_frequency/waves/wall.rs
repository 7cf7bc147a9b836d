//! Walls by waves: their admittance over frequency.

use crate::materials::admittance::{absorbed, admittance};
use crate::materials::material::Material;
use std::f64::consts::TAU;

/// Branches of a wall, where they resonate, Hz, and how sharply.
const BRANCHES: usize = 4;
const BRANCHES_HZ: [f64; BRANCHES] = [25.0, 63.0, 160.0, 400.0];
const SHARPNESS: f64 = 0.8;
/// Frequencies that a wall is fitted at, Hz.
const FITTED_HZ: [f64; 11] = [31.5, 40.0, 50.0, 63.0, 80.0, 100.0, 125.0, 177.0, 250.0, 354.0, 500.0];
/// Rounds of the fit.
const ROUNDS: usize = 12;

/// Admittance of a wall over that of air: `still + sum 1 / (mass s + resistance + stiffness / s)`, passive at all frequencies.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Wall {
    pub(super) still: f64,
    pub(super) branches: Vec<Branch>,
}

/// A resonance of a wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Branch {
    pub(super) mass: f64,
    pub(super) resistance: f64,
    pub(super) stiffness: f64,
}

impl Branch {
    /// One that conducts `most` at its resonance.
    fn new(hz: f64, most: f64) -> Self {
        let (resistance, omega) = (1.0 / most, TAU * hz);
        Self { mass: SHARPNESS * resistance / omega, resistance, stiffness: SHARPNESS * resistance * omega }
    }

    fn at(&self, hz: f64) -> [f64; 2] {
        let reactance = self.mass * TAU * hz - self.stiffness / (TAU * hz);
        let square = self.resistance * self.resistance + reactance * reactance;
        [self.resistance / square, -reactance / square]
    }
}

impl Wall {
    /// A wall that takes what a material's octaves do.
    pub(super) fn of(material: &Material) -> Self {
        let wanted = FITTED_HZ.map(|hz| material.absorbed(hz));
        let (least, most) = wanted.iter().fold((1.0_f64, 0.0_f64), |(a, b), w| (a.min(*w), b.max(*w)));
        if most - least < 1e-3 {
            return Self { still: admittance(0.5 * (least + most)), branches: Vec::new() };
        }
        let mut aims = wanted.map(admittance);
        let mut wall = Self::fitted(&aims);
        for _ in 0..ROUNDS {
            // What reactances reflect is made good for.
            for (n, aim) in aims.iter_mut().enumerate() {
                let [real, imaginary] = wall.at(FITTED_HZ[n]);
                *aim = (*aim * (wanted[n].max(1e-4) / absorbed(real, imaginary).max(1e-4)).clamp(0.7, 1.4)).min(2.0);
            }
            wall = Self::fitted(&aims);
        }
        wall
    }

    /// Sum of what conducts always and what each branch does, none of them negative, that is nearest to real admittances at the
    /// frequencies of the fit, relative to them (coordinate descent).
    fn fitted(aims: &[f64; FITTED_HZ.len()]) -> Self {
        let columns: [[f64; FITTED_HZ.len()]; BRANCHES + 1] = std::array::from_fn(|c| {
            std::array::from_fn(|n| {
                let real = if c == 0 { 1.0 } else { Branch::new(BRANCHES_HZ[c - 1], 1.0).at(FITTED_HZ[n])[0] };
                real / aims[n].max(1e-6)
            })
        });
        let mut shares = [0.0; BRANCHES + 1];
        let mut left = [1.0; FITTED_HZ.len()];
        for _ in 0..400 {
            for (share, column) in shares.iter_mut().zip(&columns) {
                let along: f64 = left.iter().zip(column).map(|(l, c)| l * c).sum();
                let square: f64 = column.iter().map(|c| c * c).sum();
                let next = (*share + along / square).max(0.0);
                left.iter_mut().zip(column).for_each(|(l, c)| *l -= (next - *share) * c);
                *share = next;
            }
        }
        let branch = |(hz, share): (f64, f64)| (share > 1e-9).then(|| Branch::new(hz, share));
        let branches = BRANCHES_HZ.into_iter().zip(shares.into_iter().skip(1)).filter_map(branch).collect();
        Self { still: shares[0], branches }
    }

    /// Real and imaginary part.
    fn at(&self, hz: f64) -> [f64; 2] {
        self.branches.iter().map(|b| b.at(hz)).fold([self.still, 0.0], |sum, b| [sum[0] + b[0], sum[1] + b[1]])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn walls_take_what_their_octaves_say() {
        let even = Wall::of(&Material::even("", 0.3, 0.1));
        assert!(even.branches.is_empty());
        // A curtain, a panel, and both as they are known at 63 Hz.
        let [curtain, panel] = [[0.06, 0.1, 0.38, 0.63, 0.7, 0.73, 0.73], [0.4, 0.25, 0.12, 0.08, 0.08, 0.08, 0.08]];
        for (absorption, absorption_63) in [(curtain, None), (panel, None), (curtain, Some(0.04)), (panel, Some(0.6))] {
            let material = Material { absorption_63, ..Material::absorbing(absorption) };
            let wall = Wall::of(&material);
            for hz in [40.0, 63.0, 125.0, 177.0, 250.0] {
                let [real, imaginary] = wall.at(hz);
                let (found, wanted) = (absorbed(real, imaginary), material.absorbed(hz));
                let most = if hz < 60.0 { 0.3 } else { 0.2 };
                assert!((found / wanted - 1.0).abs() < most, "{found} for {wanted} at {hz} Hz");
            }
        }
    }
}
