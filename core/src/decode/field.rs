//! Baked transfer functions on a grid of listener positions and head directions.

mod axis;
mod decoder;
pub(crate) mod mirrored;
mod rows;

use crate::{Pose, TransferFunction, TransferShape};
use glam::Vec3;
use std::ops::Range;

pub use axis::Axis;
pub(crate) use decoder::{FieldDecoder, heard};
pub use rows::{Basis, LowRank, Rows, SILENT_DB};

/// The closest distance to the emitter at which the direct sound still grows, metres.
pub const NEAREST_M: f32 = 0.25;
/// Coordinates of a node: three of position, at most three of direction.
const MOST_AXES: usize = 6;
/// Nodes that a cell may have: two along every axis, and for each axis four along that one and two along the others.
const MOST_CORNERS: usize = (1 + 2 * MOST_AXES) << MOST_AXES;

/// What a field's transfer functions depend on besides the listener's position.
#[derive(Clone, Debug, PartialEq)]
pub enum Facing {
    /// The direction of the emitter in the head's frame, however the head is turned.
    Emitter {
        /// Emitter position in the world, metres.
        position: Vec3,
        /// Emitter elevation in the head frame, radians, positive up.
        elevation: Axis,
        /// Emitter azimuth in the head frame, radians, positive left; a full circle unless there is a single node.
        azimuth: Axis,
    },
    /// The head's orientation in the world, as [`Pose::ypr`], radians.
    Head {
        /// Positive to the left; a full circle unless there is a single node.
        yaw: Axis,
        /// Positive nose up.
        pitch: Axis,
        /// Positive right ear down.
        roll: Axis,
    },
}

/// Nodes of a [`Field`]: listener position by direction.
///
/// Read from a scene file or laid out by the baker; lives in a [`Field`], immutable.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldGrid {
    /// Listener positions, metres, along x, y and z.
    pub position: [Axis; 3],
    /// Directions.
    pub facing: Facing,
}

impl FieldGrid {
    /// All axes, the slowest index first.
    #[must_use]
    pub fn axes(&self) -> Vec<&Axis> {
        self.slots().into_iter().flatten().collect()
    }

    /// All axes, the slowest index first, in a place of fixed size.
    fn slots(&self) -> [Option<&Axis>; MOST_AXES] {
        let [x, y, z] = &self.position;
        let [a, b, c] = match &self.facing {
            Facing::Emitter { elevation, azimuth, .. } => [Some(elevation), Some(azimuth), None],
            Facing::Head { yaw, pitch, roll } => [Some(yaw), Some(pitch), Some(roll)],
        };
        [Some(z), Some(y), Some(x), a, b, c]
    }

    /// Number of nodes.
    #[must_use]
    pub fn nodes(&self) -> usize {
        self.axes().iter().map(|a| a.count()).product()
    }

    /// Coordinates of a node in the order of [`FieldGrid::axes`].
    fn coordinates(&self, index: usize) -> [f32; MOST_AXES] {
        let mut rest = index;
        let mut out = [0.0; MOST_AXES];
        for (value, axis) in out.iter_mut().zip(self.slots()).rev() {
            if let Some(axis) = axis {
                *value = axis.nodes()[rest % axis.count()];
                rest /= axis.count();
            }
        }
        out
    }

    /// A listener pose at a node, by which the node's transfer function can be computed.
    #[must_use]
    pub fn pose(&self, index: usize) -> Pose {
        let [z, y, x, a, b, c] = self.coordinates(index);
        let position = Vec3::new(x, y, z);
        match &self.facing {
            Facing::Head { .. } => Pose::from_ypr(position, a, b, c),
            Facing::Emitter { position: emitter, .. } => {
                // The emitter is to be seen from the head in the node's direction.
                let seen = Pose::from_ypr(Vec3::ZERO, b, a, 0.0).orientation;
                let towards = glam::Quat::from_rotation_arc(Vec3::X, (*emitter - position).normalize_or(Vec3::X));
                Pose { position, orientation: (towards * seen.inverse()).normalize() }
            }
        }
    }

    /// Direction of the emitter in the head frame at a node, as a unit vector, and the node's position; forward for nodes of
    /// [`Facing::Head`].
    #[must_use]
    pub fn node(&self, index: usize) -> (Vec3, Vec3) {
        let [z, y, x, elevation, azimuth, _] = self.coordinates(index);
        let direction = match self.facing {
            Facing::Emitter { .. } => {
                // At the poles the cosine is rounded to either sign, which would turn the azimuth round.
                let level = elevation.cos().abs();
                Vec3::new(level * azimuth.cos(), level * azimuth.sin(), elevation.sin())
            }
            Facing::Head { .. } => Vec3::X,
        };
        (Vec3::new(x, y, z), direction)
    }
}

/// Corners of the cell around a pose, with weights that sum to 1.
#[derive(Clone, Debug)]
pub(crate) struct Cell {
    corners: Vec<(u32, f32)>,
    /// Gain of the direct sound at the listener's distance, 1 at 1 m.
    direct_gain: f32,
    scratch: Vec<f32>,
}

impl Cell {
    /// Gain of the direct sound at the listener's distance.
    pub(crate) fn direct_gain(&self) -> f32 {
        self.direct_gain
    }

    /// Weakens the direct sound.
    pub(crate) fn dim(&mut self, gain: f32) {
        self.direct_gain *= gain;
    }
}

/// Nodes around a value on one axis, and how many there are on it.
#[derive(Clone, Copy, Debug)]
struct Line {
    count: usize,
    linear: ([(usize, f32); 4], usize),
    cubic: ([(usize, f32); 4], usize),
}

/// Adds `weight` times the product of linear interpolation along all axes but `curved`, which has a cubic. There is room for
/// all.
fn add_corners(lines: &[Option<Line>; MOST_AXES], curved: Option<usize>, weight: f32, corners: &mut Vec<(u32, f32)>) {
    let first = corners.len();
    corners.push((0, weight));
    // From the slowest index to the fastest, each axis in use multiplies the corners.
    for (axis, line) in lines.iter().enumerate() {
        let Some(line) = line else { continue };
        let (nodes, count) = if curved == Some(axis) { line.cubic } else { line.linear };
        let before = corners.len() - first;
        for _ in 1..count {
            corners.extend_from_within(first..first + before);
        }
        for (share, (node, along)) in corners[first..].chunks_exact_mut(before).zip(nodes) {
            for (index, weight) in share {
                #[expect(clippy::cast_possible_truncation, reason = "node counts are limited when a scene is read")]
                let within = *index * line.count as u32 + node as u32;
                (*index, *weight) = (within, *weight * along);
            }
        }
    }
}

/// Decoder that interpolates baked transfer functions: linearly along each axis with [`Facing::Emitter`]; with [`Facing::Head`]
/// by a cubic along each axis with the others linear, added up, less the linear parts that are counted too often. The error of
/// that is of fourth order like the full product of cubics', at a fifth of the nodes (Gordon 1971, blending-function methods).
///
/// Read from a scene file or made by the baker; the [`Scene`](crate::Scene) shares it between renderers, whose audio threads
/// look poses up in it.
///
/// With [`Facing::Emitter`] the direct sound's masks are stored for a distance of 1 m and fall with distance (ISO 9613-2,
/// geometrical divergence); time filters and late part stay. A listener outside the nodes hears the nearest ones, in the true
/// direction.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    grid: FieldGrid,
    shape: TransferShape,
    rows: Rows,
}

impl Field {
    /// Takes the transfer functions of all nodes; `None` if their number does not fit the grid and the shape.
    #[must_use]
    pub fn new(grid: FieldGrid, shape: TransferShape, rows: Rows) -> Option<Self> {
        rows.fit(grid.nodes(), &shape).then_some(Self { grid, shape, rows })
    }

    /// The nodes.
    #[must_use]
    pub fn grid(&self) -> &FieldGrid {
        &self.grid
    }

    /// Sizes of the transfer functions.
    #[must_use]
    pub fn shape(&self) -> TransferShape {
        self.shape
    }

    /// Emitter position in the world, metres, where the nodes depend on it.
    #[must_use]
    pub fn emitter(&self) -> Option<Vec3> {
        match self.grid.facing {
            Facing::Emitter { position, .. } => Some(position),
            Facing::Head { .. } => None,
        }
    }

    /// Transfer functions of all nodes.
    #[must_use]
    pub fn rows(&self) -> &Rows {
        &self.rows
    }

    /// Bytes of the table.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        4 * self.rows.values().map(<[f32]>::len).sum::<usize>()
    }

    /// The transfer function at a pose.
    #[must_use]
    pub fn decode(&self, pose: &Pose) -> TransferFunction {
        let (mut cell, mut out) = (self.cell(), self.shape.silent());
        self.locate(pose, &mut cell);
        self.masks(&mut cell, &mut out);
        self.taps(&mut cell, 0..self.shape.taps + 1, &mut out);
        out
    }

    /// Room to work in, for the other methods.
    pub(crate) fn cell(&self) -> Cell {
        Cell { corners: Vec::with_capacity(MOST_CORNERS), direct_gain: 0.0, scratch: self.rows.scratch() }
    }

    /// Finds the nodes around a pose.
    pub(crate) fn locate(&self, pose: &Pose, cell: &mut Cell) {
        let at = pose.position;
        let [a, b, c] = match self.grid.facing {
            Facing::Emitter { position, .. } => {
                let relative = pose.to_head(position);
                let distance = relative.length();
                cell.direct_gain = 1.0 / distance.max(NEAREST_M);
                let level = (relative.x * relative.x + relative.y * relative.y).sqrt();
                let azimuth = if level > 1e-6 { relative.y.atan2(relative.x) } else { 0.0 };
                let elevation = if distance > 1e-6 { relative.z.atan2(level) } else { 0.0 };
                [elevation, azimuth, 0.0]
            }
            Facing::Head { .. } => {
                cell.direct_gain = 1.0;
                pose.ypr().into()
            }
        };
        cell.corners.clear();
        let along = self.grid.slots().into_iter().zip([at.z, at.y, at.x, a, b, c]);
        let lines: [Option<Line>; MOST_AXES] = {
            let mut lines = [None; MOST_AXES];
            for (line, (axis, value)) in lines.iter_mut().zip(along) {
                *line = axis.map(|axis| Line { count: axis.count(), linear: axis.linear(value), cubic: axis.cubic(value) });
            }
            lines
        };
        let curved = match self.grid.facing {
            Facing::Head { .. } => lines.map(|l| l.is_some_and(|l| l.cubic.1 > 2)),
            Facing::Emitter { .. } => [false; MOST_AXES],
        };
        let count = curved.iter().filter(|c| **c).count();
        add_corners(&lines, None, 1.0 - count as f32, &mut cell.corners);
        for axis in (0..MOST_AXES).filter(|axis| curved[*axis]) {
            add_corners(&lines, Some(axis), 1.0, &mut cell.corners);
        }
    }

    /// Masks, phase and delay of the direct sound in a cell.
    pub(crate) fn masks(&self, cell: &mut Cell, out: &mut TransferFunction) {
        self.rows.masks(&self.shape, &cell.corners, &mut cell.scratch, out);
        for m in &mut out.mixture {
            *m *= cell.direct_gain;
        }
    }

    /// Time-filter gains of some taps in a cell; the tap after the last explicit one is the late part.
    pub(crate) fn taps(&self, cell: &mut Cell, taps: Range<usize>, out: &mut TransferFunction) {
        self.rows.taps(&self.shape, &cell.corners, taps, &mut cell.scratch, out);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grids() -> [FieldGrid; 2] {
        let position = [Axis::uniform(-1.0, 1.0, 3), Axis::uniform(0.0, 0.5, 2), Axis::single(1.2)];
        let quarter = std::f32::consts::FRAC_PI_4;
        let facings = [
            Facing::Emitter {
                position: Vec3::new(5.0, 0.5, 1.0),
                elevation: Axis::uniform(-quarter, quarter, 3),
                azimuth: Axis::circle(-1.0, 6),
            },
            Facing::Head {
                yaw: Axis::circle(-3.0, 5),
                pitch: Axis::uniform(-quarter, quarter, 3),
                roll: Axis::uniform(-0.2, 0.4, 2),
            },
        ];
        facings.map(|facing| FieldGrid { position: position.clone(), facing })
    }

    #[test]
    fn the_pose_of_a_node_lies_on_that_node() {
        let shape = TransferShape { bins: 2, bands: 2, taps: 0 };
        for grid in grids() {
            let nodes = grid.nodes();
            let field = Field::new(grid.clone(), shape, Rows::Whole(vec![0.0; nodes * shape.row_len()])).unwrap();
            let mut cell = field.cell();
            for index in 0..nodes {
                field.locate(&grid.pose(index), &mut cell);
                let weight: f32 = cell.corners.iter().filter(|(i, _)| *i as usize == index).map(|(_, w)| w).sum();
                assert!((weight - 1.0).abs() < 1e-4, "{index}: {weight} of {:?}", &cell.corners);
            }
        }
    }

    #[test]
    fn coefficients_stand_for_the_rows_they_were_made_of() {
        let shape = TransferShape { bins: 3, bands: 2, taps: 1 };
        let [_, grid] = grids();
        let nodes = grid.nodes();
        let levels =
            Basis { mean: vec![-6.0, -20.0, SILENT_DB, -6.0, -14.0, -12.0], shapes: vec![1.0, 2.0, 0.0, 0.0, 0.0, 3.0] };
        let taps = Basis { mean: vec![0.5; 8], shapes: vec![0.25, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0] };
        let coefficients = (0..nodes).flat_map(|i| [i as f32 % 3.0, i as f32 % 2.0]).collect();
        let field = Field::new(grid.clone(), shape, Rows::LowRank(LowRank { levels, taps, coefficients })).unwrap();
        for index in [0, 7, nodes - 1] {
            let (c, tap) = (index as f32 % 3.0, index as f32 % 2.0);
            let found = field.decode(&grid.pose(index));
            let db = |x: f32| 10.0_f32.powf(x / 20.0);
            let want = [[db(-6.0 + c), db(-6.0)], [db(-20.0 + 2.0 * c), db(-14.0)], [0.0, db(-12.0 + 3.0 * c)]];
            for (k, [left, right]) in want.into_iter().enumerate() {
                let (m, d) = (found.mixture[k], found.difference[k]);
                assert!(((1.0 - d) * m - left).abs() < 1e-4 && ((1.0 + d) * m - right).abs() < 1e-4, "{index} {k}");
            }
            assert!((found.taps[0] - 0.5 - 0.25 * tap).abs() < 1e-4);
            assert!((found.late[3] - (0.5 - tap).max(0.0)).abs() < 1e-4, "gains are never below 0");
            assert!(found.phase.iter().all(|p| *p == 0.0) && found.delay_s == 0.0);
        }
    }
}
