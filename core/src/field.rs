//! Baked transfer functions on a regular grid of listener positions and emitter directions.

use crate::lanes::WeightedSum;
use crate::{Pose, TransferFunction, TransferShape};
use glam::Vec3;
use pulp::Arch;
use std::ops::Range;

/// The closest distance to the emitter at which the direct sound still grows, metres.
pub const NEAREST_M: f32 = 0.25;

/// Regular positions along one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    /// First position.
    pub start: f32,
    /// Distance between positions, above 0.
    pub step: f32,
    /// Number of positions, at least 1.
    pub count: usize,
}

impl Axis {
    /// An axis with a single position.
    #[must_use]
    pub fn single(at: f32) -> Self {
        Self { start: at, step: 1.0, count: 1 }
    }

    /// Position of a node.
    #[must_use]
    pub fn at(&self, node: usize) -> f32 {
        self.start + self.step * node as f32
    }

    /// Last position.
    #[must_use]
    pub fn end(&self) -> f32 {
        self.at(self.count - 1)
    }

    /// The two nodes around a value and the weight of the second; the ends hold.
    fn around(&self, value: f32) -> (usize, usize, f32) {
        let last = self.count - 1;
        let along = ((value - self.start) / self.step).clamp(0.0, last as f32);
        let (node, fraction) = split(along);
        let node = node.min(last);
        (node, (node + 1).min(last), fraction)
    }

    /// As [`Axis::around`] on a full circle of `count * step`.
    fn around_circle(&self, value: f32) -> (usize, usize, f32) {
        let (node, fraction) = split(((value - self.start) / self.step).rem_euclid(self.count as f32));
        let node = node % self.count;
        (node, (node + 1) % self.count, fraction)
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the callers clamp or wrap to at least 0")]
fn split(along: f32) -> (usize, f32) {
    (along as usize, along.fract())
}

/// Nodes of a [`Field`]: listener position by emitter direction in the head frame.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldGrid {
    /// Listener positions, metres, along x, y and z.
    pub position: [Axis; 3],
    /// Emitter elevation in the head frame, radians, positive up.
    pub elevation: Axis,
    /// Emitter azimuth in the head frame, radians, positive left; a full circle unless there is a single node.
    pub azimuth: Axis,
}

impl FieldGrid {
    /// Number of nodes.
    #[must_use]
    pub fn nodes(&self) -> usize {
        self.position.iter().map(|a| a.count).product::<usize>() * self.elevation.count * self.azimuth.count
    }

    /// Position and emitter direction (unit vector in the head frame) of a node.
    #[must_use]
    pub fn node(&self, index: usize) -> (Vec3, Vec3) {
        let azimuth = self.azimuth.at(index % self.azimuth.count);
        let rest = index / self.azimuth.count;
        let elevation = self.elevation.at(rest % self.elevation.count);
        let rest = rest / self.elevation.count;
        let [x, y, z] = &self.position;
        let position = Vec3::new(x.at(rest % x.count), y.at(rest / x.count % y.count), z.at(rest / (x.count * y.count)));
        let direction = Vec3::new(elevation.cos() * azimuth.cos(), elevation.cos() * azimuth.sin(), elevation.sin());
        (position, direction)
    }
}

/// Corners of the cell around a pose, with weights that sum to 1.
#[derive(Clone, Debug)]
pub(crate) struct Cell {
    corners: [(u32, f32); 32],
    count: usize,
    /// Gain of the direct sound at the listener's distance, 1 at 1 m.
    direct_gain: f32,
}

impl Cell {
    pub(crate) fn new() -> Self {
        Self { corners: [(0, 0.0); 32], count: 0, direct_gain: 0.0 }
    }
}

/// Decoder that interpolates baked transfer functions: multilinear over position, elevation and azimuth.
///
/// The direct sound's masks are stored for a distance of 1 m and fall with distance (ISO 9613-2, geometrical divergence);
/// time filters and late part stay. A listener outside the nodes hears the nearest ones, in the true direction of the emitter.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    grid: FieldGrid,
    shape: TransferShape,
    emitter: Vec3,
    rows: Vec<f32>,
}

impl Field {
    /// Takes rows of [`TransferFunction::to_row`], one per node, and the emitter's position in the world, metres.
    ///
    /// `None` if the number of values does not fit the grid and the shape.
    #[must_use]
    pub fn new(grid: FieldGrid, shape: TransferShape, emitter: Vec3, rows: Vec<f32>) -> Option<Self> {
        (grid.nodes() > 0 && rows.len() == grid.nodes() * shape.row_len()).then_some(Self { grid, shape, emitter, rows })
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

    /// Emitter position in the world, metres.
    #[must_use]
    pub fn emitter(&self) -> Vec3 {
        self.emitter
    }

    /// All rows, node by node.
    #[must_use]
    pub fn rows(&self) -> &[f32] {
        &self.rows
    }

    /// Finds the nodes around a pose.
    pub(crate) fn locate(&self, pose: &Pose, cell: &mut Cell) {
        let relative = pose.to_head(self.emitter);
        let distance = relative.length();
        cell.direct_gain = 1.0 / distance.max(NEAREST_M);
        let level = (relative.x * relative.x + relative.y * relative.y).sqrt();
        let azimuth = if level > 1e-6 { relative.y.atan2(relative.x) } else { 0.0 };
        let elevation = if distance > 1e-6 { relative.z.atan2(level) } else { 0.0 };
        let g = &self.grid;
        let axes = [
            g.azimuth.around_circle(azimuth),
            g.elevation.around(elevation),
            g.position[0].around(pose.position.x),
            g.position[1].around(pose.position.y),
            g.position[2].around(pose.position.z),
        ];
        let counts = [g.azimuth.count, g.elevation.count, g.position[0].count, g.position[1].count, g.position[2].count];
        cell.corners[0] = (0, 1.0);
        cell.count = 1;
        // From the slowest index to the fastest, each axis in use doubles the corners.
        for ((low, high, fraction), count) in axes.into_iter().zip(counts).rev() {
            let before = cell.count;
            for c in 0..before {
                let (index, weight) = cell.corners[c];
                let base = index as usize * count;
                #[expect(clippy::cast_possible_truncation, reason = "node counts are limited when a scene is read")]
                {
                    cell.corners[c] = ((base + low) as u32, weight * (1.0 - fraction));
                    if fraction > 0.0 {
                        cell.corners[cell.count] = ((base + high) as u32, weight * fraction);
                        cell.count += 1;
                    }
                }
            }
        }
    }

    /// Masks, phase and delay of the direct sound in a cell.
    pub(crate) fn masks(&self, cell: &Cell, out: &mut TransferFunction) {
        let bins = self.shape.bins;
        self.blend(cell, 0..bins, &mut out.mixture);
        self.blend(cell, bins..2 * bins, &mut out.difference);
        self.blend(cell, 2 * bins..4 * bins, &mut out.phase);
        let mut delay = [0.0];
        self.blend(cell, 4 * bins..4 * bins + 1, &mut delay);
        out.delay_s = delay[0];
        for m in &mut out.mixture {
            *m *= cell.direct_gain;
        }
    }

    /// Time-filter gains of some taps in a cell; the tap after the last explicit one is the late part.
    pub(crate) fn taps(&self, cell: &Cell, taps: Range<usize>, out: &mut TransferFunction) {
        let (first, len) = (self.shape.direct_len(), self.shape.tap_len());
        let explicit = taps.start.min(self.shape.taps)..taps.end.min(self.shape.taps);
        let (from, to) = (explicit.start * len, explicit.end * len);
        self.blend(cell, first + from..first + to, &mut out.taps[from..to]);
        if taps.end > self.shape.taps {
            let late = first + self.shape.taps * len;
            self.blend(cell, late..late + len, &mut out.late);
        }
    }

    fn blend(&self, cell: &Cell, part: Range<usize>, out: &mut [f32]) {
        debug_assert_eq!(part.len(), out.len());
        Arch::new().dispatch(WeightedSum {
            rows: &self.rows,
            corners: &cell.corners[..cell.count],
            row_len: self.shape.row_len(),
            offset: part.start,
            out,
        });
    }
}
