//! Second differences of the pressure on the cells of a room.

use super::cells::Cells;
use crate::room::Room;

/// Faces count as square to an axis from this cosine on.
const SQUARE: f64 = 0.999;
/// Neighbours that a difference takes, before and after along each axis, and itself.
pub(super) const TERMS: usize = 13;

/// Shares of the pressure's difference to a neighbour before and after along an axis, per square metre.
type Pair = [f64; 2];

/// A wall at a cell: its index, the material, none of an open one, and the area, square metres.
pub(super) type Face = (usize, Option<usize>, f64);

/// What cells take of the differences to their neighbours.
pub(super) struct Differences {
    /// Cubic metres of each cell.
    pub(super) volumes: Vec<f64>,
    /// Walls at cells.
    pub(super) faces: Vec<Face>,
    /// By axis, what each cell takes of the differences to both neighbours.
    pairs: [Vec<Pair>; 3],
    /// Which cells, 1 or 0, have walls square to the axes alone.
    square: Vec<f64>,
}

/// Where a wall cuts the link from a cell along an axis: its share, and the face.
fn cut(cells: &Cells, index: usize, axis: usize, up: bool) -> Option<(f64, u32)> {
    let low = if up { index } else { index - cells.strides()[axis] };
    cells.between(axis, low).map(|cut| (cut.share[usize::from(!up)], cut.face[usize::from(!up)]))
}

impl Differences {
    pub(super) fn new(room: &Room, cells: &Cells) -> Self {
        let size = cells.inside.len();
        let h = cells.step.to_array();
        let (mut volumes, extents) = extents(room, cells);
        let whole = h[0] * h[1] * h[2];
        let mut faces = Vec::new();
        let mut pairs: [Vec<Pair>; 3] = std::array::from_fn(|_| vec![[0.0; 2]; size]);
        let across = |index: usize, axis: usize| volumes[index] / extents[index][axis].max(0.05);
        for index in (0..size).filter(|index| cells.inside[*index]) {
            for axis in 0..3 {
                for up in [false, true] {
                    if let Some(other) = cells.neighbour(index, axis, up) {
                        let area = across(index, axis).min(across(other, axis));
                        pairs[axis][index][usize::from(up)] = area / (h[axis] * h[axis]);
                    } else {
                        let area = across(index, axis) * whole / h[axis];
                        match cut(cells, index, axis, up) {
                            Some((_, face)) => {
                                faces.push((index, Some(room.material(face)), area * room.normal(face)[axis].abs()));
                            }
                            None => faces.push((index, None, area)),
                        }
                    }
                }
            }
        }
        // No cell is so small that it is not stable.
        for index in (0..size).filter(|index| cells.inside[*index]) {
            let least = (0..3).map(|axis| 0.5 * (pairs[axis][index][0] + pairs[axis][index][1]) * h[axis] * h[axis]);
            volumes[index] = least.fold(volumes[index], f64::max).max(0.05);
            for pairs in &mut pairs {
                pairs[index] = pairs[index].map(|share| share / volumes[index]);
            }
        }
        volumes.iter_mut().for_each(|volume| *volume *= whole);
        Self { volumes, faces, pairs, square: square(room, cells) }
    }

    /// What a cell's next pressure takes of its neighbours, in the order of the offsets; `courant` is `c^2 dt^2`.
    pub(super) fn terms(&self, cells: &Cells, index: usize, courant: f64) -> [f64; TERMS] {
        let (h, strides) = (cells.step.to_array(), cells.strides());
        let mut terms = [0.0; TERMS];
        terms[0] = 2.0;
        for axis in 0..3 {
            let twelfth = h[axis] * h[axis] / 12.0;
            let stride = strides[axis];
            let [down, up] = self.pairs[axis][index];
            let (lower, upper) = (self.pairs[axis][index - stride], self.pairs[axis][index + stride]);
            // K of the cell before, of this one and of the one after, over the five cells.
            let own = [-down, down + up, -up];
            let mut all = [0.0, own[0], own[1], own[2], 0.0];
            let mut add = |weight: f64, of: Pair, first: usize| {
                let row = [-of[0], of[0] + of[1], -of[1]];
                row.iter().enumerate().for_each(|(n, value)| all[first + n] += twelfth * weight * value);
            };
            add(own[1] * self.square[index], [down, up], 1);
            add(own[0] * self.square[index - stride], lower, 0);
            add(own[2] * self.square[index + stride], upper, 2);
            terms[0] -= courant * all[2];
            for (n, place) in [0, 1, 3, 4].into_iter().enumerate() {
                terms[1 + 4 * axis + n] -= courant * all[place];
            }
        }
        terms
    }
}

/// Which cells, 1 or 0, have walls square to the axes alone: elsewhere the slope along one axis does not end at a wall, and its
/// second difference is none by itself.
fn square(room: &Room, cells: &Cells) -> Vec<f64> {
    let at = |index: usize| {
        let plain = (0..3).flat_map(|axis| [false, true].map(|up| (axis, up))).all(|(axis, up)| {
            let square = |(_, face): (f64, u32)| room.normal(face)[axis].abs() > SQUARE;
            cells.neighbour(index, axis, up).is_some() || cut(cells, index, axis, up).is_some_and(square)
        });
        f64::from(u8::from(plain))
    };
    (0..cells.inside.len()).map(|index| if cells.inside[index] { at(index) } else { 0.0 }).collect()
}

/// Volume of each cell over that of a whole one, and how far it reaches along each axis over a whole one.
fn extents(room: &Room, cells: &Cells) -> (Vec<f64>, Vec<[f64; 3]>) {
    let size = cells.inside.len();
    let mut volumes = vec![1.0; size];
    let mut extents = vec![[1.0; 3]; size];
    for index in (0..size).filter(|index| cells.inside[*index]) {
        // Of each plane the mean over the axes that it cuts, each by its cosine.
        let mut planes: Vec<(u32, f64, f64, [f64; 3])> = Vec::new();
        for axis in 0..3 {
            for up in [false, true] {
                let Some((share, face)) = cut(cells, index, axis, up) else { continue };
                let weight = room.normal(face)[axis].powi(2).max(1e-6);
                let plane = room.plane(face);
                let at = planes.iter().position(|p| p.0 == plane).unwrap_or_else(|| {
                    planes.push((plane, 0.0, 0.0, [0.0; 3]));
                    planes.len() - 1
                });
                planes[at].1 += weight * (share - 0.5);
                planes[at].2 += weight;
                planes[at].3[axis] += share - 0.5;
            }
        }
        for (_, sum, weights, along) in planes {
            let factor = 1.0 + sum / weights;
            volumes[index] *= factor;
            for axis in 0..3 {
                extents[index][axis] *= if along[axis] == 0.0 { 1.0 } else { factor };
            }
        }
    }
    (volumes, extents)
}
