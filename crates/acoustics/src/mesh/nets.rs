//! Surfaces between cells (S. F. Frisken Gibson, "Constrained elastic surface nets", MICCAI 1998, without the relaxation).

use super::{Mesh, Triangle};

/// No vertex.
const NONE: u32 = u32::MAX;

/// Values at the middles of cells, of which the first is at `low`; cells have an edge of `cell_m`, x goes fastest.
struct Cells<'a> {
    values: &'a [f32],
    counts: [usize; 3],
    steps: [usize; 3],
    low: [f64; 3],
    cell_m: f64,
}

/// The surface on which values at the middles of cells change their sign, closed where the outermost cells are all of one, in
/// triangles that look towards the values above 0. The first value is at `low`, cells have an edge of `cell_m`, x goes fastest.
pub(super) fn surface(values: &[f32], counts: [usize; 3], low: [f64; 3], cell_m: f64) -> Mesh {
    let cells = Cells { values, counts, steps: [1, counts[0], counts[0] * counts[1]], low, cell_m };
    let mut mesh = Mesh { groups: vec!["surface".to_owned()], ..Mesh::default() };
    // By the lowest corner of each cube of eight cells.
    let mut vertices = vec![NONE; values.len()];
    for (cell, at) in cells.from(0) {
        if let Some(place) = cells.crossed(cell, at) {
            vertices[cell] = mesh.vertices.len() as u32;
            mesh.vertices.push(place);
        }
    }
    for (cell, _) in cells.from(1) {
        for axis in 0..3 {
            if cells.is_free(cell) == cells.is_free(cell + cells.steps[axis]) {
                continue;
            }
            // The four cubes about the edge between both, round the axis.
            let (u, v) = (cells.steps[(axis + 1) % 3], cells.steps[(axis + 2) % 3]);
            let mut around = [cell - u - v, cell - v, cell, cell - u].map(|cube| vertices[cube]);
            if around.contains(&NONE) {
                continue;
            }
            // Towards the free side.
            if cells.is_free(cell) {
                around.reverse();
            }
            let [a, b, c, d] = around;
            mesh.triangles.extend([[a, b, c], [a, c, d]].map(|corners| Triangle { corners, group: 0 }));
        }
    }
    mesh
}

impl Cells<'_> {
    fn is_free(&self, cell: usize) -> bool {
        self.values[cell] > 0.0
    }

    /// Cells from a first one along each axis to the last but one, with their numbers along the axes.
    fn from(&self, first: usize) -> impl Iterator<Item = (usize, [usize; 3])> {
        let ([nx, ny, nz], [_, sy, sz]) = (self.counts.map(|count| count.saturating_sub(1)), self.steps);
        let rows = (first..nz).flat_map(move |z| (first..ny).map(move |y| (y, z)));
        rows.flat_map(move |(y, z)| (first..nx).map(move |x| (x + sy * y + sz * z, [x, y, z])))
    }

    /// The mean of where edges of the cube from a cell on are crossed, metres; none where none is.
    fn crossed(&self, cell: usize, at: [usize; 3]) -> Option<[f64; 3]> {
        let corner = |c: usize| cell + (0..3).map(|axis| if c >> axis & 1 == 1 { self.steps[axis] } else { 0 }).sum::<usize>();
        let (mut sum, mut count) = ([0.0; 3], 0_u32);
        for c in 0..8_usize {
            for axis in (0..3).filter(|axis| c >> axis & 1 == 0) {
                let (a, b) = (corner(c), corner(c | 1 << axis));
                if self.is_free(a) == self.is_free(b) {
                    continue;
                }
                let (from, to) = (f64::from(self.values[a]), f64::from(self.values[b]));
                let crossed = from / (from - to);
                for (other, sum) in sum.iter_mut().enumerate() {
                    *sum += if other == axis { crossed } else { (c >> other & 1) as f64 };
                }
                count += 1;
            }
        }
        let place = |axis: usize| self.low[axis] + self.cell_m * (at[axis] as f64 + sum[axis] / f64::from(count));
        (count > 0).then(|| [0, 1, 2].map(place))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ball_has_a_closed_surface_that_looks_inwards() {
        let n = 24;
        let middle = 11.5;
        let value = |i: usize| {
            let at = [i % n, i / n % n, i / (n * n)].map(|c| (c as f64 - middle).powi(2));
            (8.0 - at.iter().sum::<f64>().sqrt()) as f32
        };
        let values: Vec<f32> = (0..n * n * n).map(value).collect();
        let mesh = surface(&values, [n; 3], [-1.0; 3], 0.1);
        let report = mesh.report();
        assert_eq!((report.open_edges, report.flipped, report.shared_edges), (0, 0, 0), "{report:?}");
        let volume = 4.0 / 3.0 * std::f64::consts::PI * 0.8_f64.powi(3);
        assert!((report.volume_m3.unwrap() / volume - 1.0).abs() < 0.02, "{report:?}");
        let centre = [-1.0 + 0.1 * middle; 3];
        for triangle in &mesh.triangles {
            let [a, b, c] = mesh.corners(triangle);
            assert!((b - a).cross(c - a).dot(glam::DVec3::from(centre) - a) > 0.0);
        }
    }
}
