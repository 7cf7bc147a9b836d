//! Phases of a field's nodes, unwrapped from node to node.

use promenade_core::glam::Vec3;
use promenade_core::{FieldGrid, TransferFunction};
use std::f32::consts::TAU;

/// Adds whole turns to the phases of nodes until neighbours differ by at most half a turn, since a field interpolates angles.
/// From the node ahead along its circle to both sides, then from circle to circle up and down: what does not close around a
/// notch or a circle is left at the back. Directions are those of a grid of one position.
pub(crate) fn unwrap_phases(grid: &FieldGrid, transfers: &mut [TransferFunction]) {
    let ways: Vec<Vec3> = (0..transfers.len()).map(|i| grid.node(i).1).collect();
    let azimuths = grid.axes().last().map_or(1, |azimuth| azimuth.count());
    let circles = transfers.len() / azimuths;
    let first = |a: &usize, b: &usize, key: &dyn Fn(usize) -> f32| key(*a).total_cmp(&key(*b));
    let level = (0..circles).min_by(|a, b| first(a, b, &|c| ways[c * azimuths].z.abs())).unwrap_or(0);
    let ahead = (0..azimuths).max_by(|a, b| first(a, b, &|a| ways[level * azimuths + a].x)).unwrap_or(0);
    let on_level = |step: usize| level * azimuths + (ahead + step) % azimuths;
    let back = azimuths / 2;
    let left = (1..=back).map(|k| (on_level(k), on_level(k - 1)));
    let right = (back + 1..azimuths).rev().map(|k| (on_level(k), on_level(k + 1)));
    let circle = |to: usize, from: usize| (0..azimuths).map(move |a| (to * azimuths + a, from * azimuths + a));
    let up = (level + 1..circles).flat_map(|c| circle(c, c - 1));
    let down = (0..level).rev().flat_map(|c| circle(c, c + 1));
    for (node, to) in left.chain(right).chain(up).chain(down) {
        let near = transfers[to].phase.clone();
        for (phase, near) in transfers[node].phase.iter_mut().zip(near) {
            *phase += TAU * ((near - *phase) / TAU).round();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_core::{Axis, Facing, TransferShape};

    #[test]
    fn neighbours_differ_by_less_than_half_a_turn() {
        let facing = Facing::Emitter {
            position: Vec3::ZERO,
            elevation: Axis::uniform(-1.2, 0.6, 5),
            azimuth: Axis::circle(-0.5 * TAU, 12),
        };
        let grid = FieldGrid { position: [0.0; 3].map(Axis::single), facing };
        let shape = TransferShape { bins: 3, bands: 1, taps: 0 };
        // Phases that change by seven radians from ear to ear, each with other whole turns.
        let wanted = |i: usize| 3.5 * grid.node(i).1.y;
        let mut transfers: Vec<TransferFunction> = (0..grid.nodes()).map(|_| shape.silent()).collect();
        for (i, transfer) in transfers.iter_mut().enumerate() {
            transfer.phase.fill(wanted(i) + TAU * ((i * 7 % 5) as f32 - 2.0));
        }
        unwrap_phases(&grid, &mut transfers);
        let turns = (transfers[0].phase[0] - wanted(0)) / TAU;
        for (i, transfer) in transfers.iter().enumerate() {
            assert!(transfer.phase.iter().all(|p| (p - wanted(i) - TAU * turns.round()).abs() < 1e-4), "{i}");
        }
    }
}
