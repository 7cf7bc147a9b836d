//! Tables of heads whose right side is their left one mirrored: half of the directions say all.

use super::{Axis, Facing, Field, FieldGrid, Rows};
use crate::TransferShape;

/// The azimuths of a table that is mirrored between front and back; `None` where they are no even circle that begins behind.
fn circle(grid: &FieldGrid) -> Option<usize> {
    let Facing::Emitter { azimuth, .. } = &grid.facing else { return None };
    let count = azimuth.count();
    (count >= 4 && count.is_multiple_of(2) && *azimuth == Axis::circle(-std::f32::consts::PI, count)).then_some(count)
}

/// A row as the other side of the head has it.
fn mirrored(row: &[f32], shape: TransferShape) -> Vec<f32> {
    let (bins, ear) = (shape.bins, shape.tap_len() / 2);
    let mut out = row.to_vec();
    out[bins..2 * bins].iter_mut().for_each(|difference| *difference = -*difference);
    let (left, right) = out[2 * bins..4 * bins].split_at_mut(bins);
    left.swap_with_slice(right);
    out[4 * bins] = -out[4 * bins];
    for tap in out[4 * bins + 1..].chunks_exact_mut(2 * ear.max(1)) {
        let (left, right) = tap.split_at_mut(ear.max(1));
        left.swap_with_slice(right);
    }
    out
}

impl Field {
    /// The field with the mirror image of its right side as its left one: a file then keeps one of them. `None` where azimuths
    /// are no even circle that begins behind, or rows are not whole.
    #[must_use]
    pub fn mirrored(&self) -> Option<Self> {
        let (Rows::Whole(rows), shape) = (self.rows(), self.shape()) else { return None };
        let half: Vec<f32> = right_side(rows, circle(self.grid())?, shape).concat();
        let rows = whole(&half, self.grid(), shape)?;
        Self::new(self.grid().clone(), shape, Rows::Whole(rows))
    }
}

/// The rows from behind over the right side to the front.
fn right_side(rows: &[f32], count: usize, shape: TransferShape) -> Vec<&[f32]> {
    let len = shape.row_len();
    rows.chunks_exact(count * len).map(|circle| &circle[..(count / 2 + 1) * len]).collect()
}

/// The rows that a file has to keep of a table; `None` where one side does not say all.
pub(crate) fn half(field: &Field) -> Option<Vec<f32>> {
    let Rows::Whole(rows) = field.rows() else { return None };
    let half = right_side(rows, circle(field.grid())?, field.shape()).concat();
    (whole(&half, field.grid(), field.shape())? == *rows).then_some(half)
}

/// How many rows a file keeps of a mirrored table; `None` for a table that cannot be one.
pub(crate) fn half_nodes(grid: &FieldGrid) -> Option<usize> {
    let count = circle(grid)?;
    Some(grid.nodes() / count * (count / 2 + 1))
}

/// All rows of a table by those of one side.
pub(crate) fn whole(half: &[f32], grid: &FieldGrid, shape: TransferShape) -> Option<Vec<f32>> {
    let (count, len) = (circle(grid)?, shape.row_len());
    let side = count / 2 + 1;
    let mut rows = Vec::with_capacity(grid.nodes() * len);
    for right in half.chunks_exact(side * len) {
        rows.extend_from_slice(right);
        let left = right.chunks_exact(len).skip(1).take(side - 2).rev();
        left.for_each(|row| rows.extend(mirrored(row, shape)));
    }
    Some(rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn one_side_of_a_mirrored_table_says_all() {
        let shape = TransferShape { bins: 3, bands: 2, taps: 1 };
        let facing = |azimuth| Facing::Emitter { position: Vec3::X, elevation: Axis::uniform(0.0, 0.5, 2), azimuth };
        let grid =
            FieldGrid { position: [(); 3].map(|()| Axis::single(0.0)), facing: facing(Axis::circle(-std::f32::consts::PI, 8)) };
        let row = |node: usize| (0..shape.row_len()).map(move |i| (node * 100 + i) as f32);
        let any = Field::new(grid.clone(), shape, Rows::Whole((0..16).flat_map(row).collect())).unwrap();
        assert_eq!(half(&any), None, "its sides differ");
        // Fronts and backs are mirror images of themselves only where both ears have the same.
        let mut even = any.mirrored().unwrap();
        for _ in 0..2 {
            let half = half(&even).unwrap();
            assert_eq!(half.len(), half_nodes(even.grid()).unwrap() * shape.row_len());
            let rows = whole(&half, even.grid(), shape).unwrap();
            assert_eq!(&Rows::Whole(rows.clone()), even.rows());
            // 45 degrees to the right, node 3, against 45 degrees to the left, node 5.
            let (right, left) = (&rows[3 * shape.row_len()..][..shape.row_len()], &rows[5 * shape.row_len()..]);
            assert_eq!((left[0], left[3], left[6], left[9], left[12]), (right[0], -right[3], right[9], right[6], -right[12]));
            assert_eq!((left[13], left[15]), (right[15], right[13]));
            even = even.mirrored().unwrap();
        }
        let odd = FieldGrid { facing: facing(Axis::circle(-std::f32::consts::PI, 7)), ..grid };
        assert_eq!(half_nodes(&odd), None);
    }
}
