//! Points merged in the cells of a grid.

use crate::BakeError;
use crate::sources::reconstruction::Point;
use promenade_core::glam::Vec3;
use std::collections::BTreeMap;

/// The points of one cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Voxel {
    /// Centre of the cell, cloud units.
    pub(super) position: Vec3,
    /// Mean colour, 0 to 1.
    pub(super) colour: [f32; 3],
}

/// Cells of this edge with a point in them, in the order of x, y, z. The middles of cells are the multiples of the edge.
pub(super) fn merge(points: &[Point], edge: f32) -> Result<Vec<Voxel>, BakeError> {
    let mut cells = BTreeMap::<[i64; 3], ([f64; 3], u32)>::new();
    for (index, point) in points.iter().enumerate() {
        let cell = (point.position / edge).to_array().map(f32::round_ties_even);
        // Beyond this the grid is finer than the numbers.
        if !cell.iter().all(|c| c.abs() < 16_777_216.0) || !point.colour.iter().all(|c| c.is_finite()) {
            let expected = format!("finite positions and colours, within {:e} of the origin", edge * 16_777_216.0);
            let found = format!("{} with colour {:?}", point.position, point.colour);
            return Err(BakeError::argument("points", expected, format!("point {index} at {found}")));
        }
        let (sum, count) = cells.entry(cell.map(|c| c as i64)).or_default();
        for (sum, c) in sum.iter_mut().zip(point.colour) {
            *sum += f64::from(c);
        }
        *count += 1;
    }
    let voxel = |(cell, (sum, count)): ([i64; 3], ([f64; 3], u32))| Voxel {
        position: Vec3::from_array(cell.map(|c| c as f32)) * edge,
        colour: sum.map(|s| (s / f64::from(count)) as f32),
    };
    Ok(cells.into_iter().map(voxel).collect())
}
