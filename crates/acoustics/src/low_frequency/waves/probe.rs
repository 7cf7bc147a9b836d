//! Places between the middles of cells.

use super::cells::Cells;
use glam::DVec3;
use std::collections::BTreeMap;

/// Shares that cells have in the pressure at a place, and in its gradient, per metre.
#[derive(Clone, Debug, Default)]
pub(super) struct Probe {
    pub(super) pressure: Vec<(u32, f32)>,
    pub(super) gradient: [Vec<(u32, f32)>; 3],
}

/// Weights of the four cells about a place by Lagrange's cubic polynomial, and of its derivative, per cell; the place lies
/// `fraction` of the way from the second to the third.
fn cubic(fraction: f64) -> [[f64; 4]; 2] {
    let nodes = [-1.0, 0.0, 1.0, 2.0];
    let mut weights = [[0.0; 4]; 2];
    for (n, own) in nodes.iter().enumerate() {
        let others = || nodes.iter().enumerate().filter(move |(m, _)| *m != n).map(|(_, node)| *node);
        let scale: f64 = others().map(|node| own - node).product();
        weights[0][n] = others().map(|node| fraction - node).product::<f64>() / scale;
        let all: Vec<f64> = others().collect();
        let derivative: f64 =
            (0..3).map(|left| (0..3).filter(|m| *m != left).map(|m| fraction - all[m]).product::<f64>()).sum();
        weights[1][n] = derivative / scale;
    }
    weights
}

/// The cell that lies so many steps away along an axis; a wall on the way mirrors.
fn walk(cells: &Cells, from: usize, axis: usize, steps: i32) -> usize {
    let (mut at, mut up) = (from, steps > 0);
    for _ in 0..steps.unsigned_abs() {
        match cells.neighbour(at, axis, up) {
            Some(next) => at = next,
            None => up = !up,
        }
    }
    at
}

impl Probe {
    /// Of a place near a cell that is seen from there.
    pub(super) fn new(cells: &Cells, nearest: usize, place: DVec3) -> Self {
        let away = (place - cells.middle(nearest)) / cells.step;
        let base = away.floor();
        let weights = (away - base).to_array().map(cubic);
        let base = base.to_array().map(|steps| steps as i32);
        let mut sums: [BTreeMap<usize, f64>; 4] = Default::default();
        for i in 0..64 {
            let n = [i % 4, i / 4 % 4, i / 16];
            let cell = (0..3).fold(nearest, |at, axis| walk(cells, at, axis, base[axis] + n[axis] as i32 - 1));
            for (kind, sum) in sums.iter_mut().enumerate() {
                let of = |axis: usize| {
                    let derived = kind == axis + 1;
                    weights[axis][usize::from(derived)][n[axis]] / if derived { cells.step[axis] } else { 1.0 }
                };
                *sum.entry(cell).or_insert(0.0) += (0..3).map(of).product::<f64>();
            }
        }
        let [pressure, x, y, z] = sums.map(|sum| sum.into_iter().map(|(cell, share)| (cell as u32, share as f32)).collect());
        Self { pressure, gradient: [x, y, z] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cubics_pass_through_polynomials() {
        let [value, slope] = cubic(0.3);
        let of = |weights: [f64; 4], f: fn(f64) -> f64| (0..4).map(|n| weights[n] * f(n as f64 - 1.0)).sum::<f64>();
        assert!((of(value, |x| x.powi(3) - x) - (0.027 - 0.3)).abs() < 1e-12);
        assert!((of(slope, |x| x.powi(3) - x) - (3.0 * 0.09 - 1.0)).abs() < 1e-12);
    }
}
