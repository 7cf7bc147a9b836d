//! The space that sight lines cross, and a surface about it.
//!
//! Along the line from an eye to a point that it sees, cells are free, and those just behind the point are not. Near the point
//! they know how far it is (B. Curless and M. Levoy, "A volumetric method for building complex models from range images",
//! SIGGRAPH 1996). What nothing is known of is filled by Laplace's equation, that is Poisson's without a source, between what
//! is (J. Davis et al., "Filling holes in complex surfaces using volumetric diffusion", 3DPVT 2002); beyond the outermost cells
//! nothing is free. The surface is where both halves meet.

use super::enclose::check;
use super::{Mesh, nets};
use crate::error::AcousticsError;
use glam::DVec3;
use rayon::prelude::*;

/// Cells at most, and along the longest side at least.
const MOST_CELLS: usize = 6_000_000;
const LEAST_ALONG: f64 = 8.0;
/// Cells about all points and eyes that belong to the outside.
const BORDER: usize = 3;
/// How far before and behind a point its distance counts, cells.
const NEAR: f64 = 2.0;
/// Points beyond this share on each side are no reason for more cells.
const OUTSIDE: f64 = 0.01;
/// Around an eye it is free, metres.
const ROOM_M: f64 = 0.3;
/// How much a sight line counts beside a neighbouring cell, and how much all together count at most.
const SIGHT: f32 = 0.5;
const MOST_SIGHTS: f32 = 8.0;
/// A line that is known to be free counts less than one that ends here.
const PASSING: f32 = 0.25;
/// Rounds of the relaxation for each cell along the longest side, and its step.
const ROUNDS: f64 = 3.0;
const RELAXED: f32 = 1.85;
/// Solid pieces of fewer cells hang in the air by mistake.
const LEAST_SOLID: usize = 27;

/// What is seen from where.
#[derive(Clone, Copy, Debug)]
pub struct Sights<'a> {
    /// Points of surfaces, metres.
    pub points: &'a [[f64; 3]],
    /// Places that they are seen from, metres.
    pub eyes: &'a [[f64; 3]],
    /// Numbers of an eye and of a point that it sees. Of none, each eye sees the points that no other hides.
    pub lines: &'a [[u32; 2]],
    /// Places that the space holds besides the eyes, metres.
    pub held: &'a [[f64; 3]],
}

impl Mesh {
    /// The surface about the space that is seen to be free, from eyes up to the points that they see, in cells of an edge,
    /// metres; with groups `floor`, `ceiling` and `wall` by direction, z up. It holds all eyes and 0.3 m about each, bends as
    /// the place does, and is closed where nothing was seen.
    ///
    /// # Errors
    /// Fewer than 100 points, no eye, one that is not finite; a cell that is not above 0 or makes too many of them.
    pub fn around_free_space(sights: &Sights<'_>, cell_m: f64) -> Result<Self, AcousticsError> {
        let inside: Vec<[f64; 3]> = sights.eyes.iter().chain(sights.held).copied().collect();
        check(sights.points, &inside)?;
        if sights.eyes.is_empty() {
            return Err(AcousticsError::argument("eyes", "places that points are seen from", "none"));
        }
        let mut grid = Grid::about(sights.points, &inside, cell_m)?;
        match sights.lines {
            [] => grid.look(sights.points, sights.eyes),
            lines => {
                for [eye, point] in lines {
                    let ends = sights.eyes.get(*eye as usize).zip(sights.points.get(*point as usize));
                    if let Some((eye, point)) = ends {
                        grid.see((*eye).into(), (*point).into());
                    }
                }
            }
        }
        inside.iter().for_each(|place| grid.hold((*place).into()));
        grid.settle();
        grid.relax();
        grid.join(&inside);
        let mut mesh = nets::surface(&grid.values, grid.counts, grid.low.to_array(), cell_m);
        if mesh.triangles.is_empty() {
            return Err(AcousticsError::argument("points", "those of a room", "none that enclose anything"));
        }
        mesh.group_by_direction();
        Ok(mesh)
    }
}

/// Cells about a place.
struct Grid {
    low: DVec3,
    cell_m: f64,
    counts: [usize; 3],
    /// By cell: sum of what is known of its distance to the surface, free above 0, in units of [`NEAR`] cells, and how much
    /// that counts; in the end the value alone.
    values: Vec<f32>,
    weights: Vec<f32>,
}

impl Grid {
    fn about(points: &[[f64; 3]], inside: &[[f64; 3]], cell_m: f64) -> Result<Self, AcousticsError> {
        if !(cell_m > 0.0 && cell_m.is_finite()) {
            return Err(AcousticsError::argument("cell", "above 0 m", cell_m));
        }
        let out = (OUTSIDE * points.len() as f64) as usize;
        let range = |axis: usize| {
            let mut all: Vec<f64> = points.iter().map(|p| p[axis]).collect();
            all.sort_by(f64::total_cmp);
            let ends = [all[out], all[all.len() - 1 - out]];
            inside.iter().fold(ends, |[low, high], p| [low.min(p[axis] - ROOM_M), high.max(p[axis] + ROOM_M)])
        };
        let ranges = [0, 1, 2].map(range);
        let border = (BORDER as f64 + NEAR) * cell_m;
        let counts = ranges.map(|[low, high]| ((high - low + 2.0 * border) / cell_m).ceil() + 1.0);
        let most = counts.iter().product::<f64>();
        if most > MOST_CELLS as f64 || counts.iter().copied().fold(0.0, f64::max) < LEAST_ALONG + 2.0 * BORDER as f64 {
            let expected = format!("one that makes {LEAST_ALONG} cells along a side and {MOST_CELLS} in all");
            return Err(AcousticsError::argument("cell", expected, format!("{cell_m} m, which makes {most:.0}")));
        }
        let counts = counts.map(|count| count as usize);
        let cells = counts.iter().product();
        let low = DVec3::from_array(ranges.map(|[low, _]| low - border));
        Ok(Self { low, cell_m, counts, values: vec![0.0; cells], weights: vec![0.0; cells] })
    }

    fn number(&self, cell: [usize; 3]) -> usize {
        cell[0] + self.counts[0] * (cell[1] + self.counts[1] * cell[2])
    }

    /// The cell that a place is in, if it is none of the outermost.
    fn cell(&self, place: DVec3) -> Option<usize> {
        let at = ((place - self.low) / self.cell_m).round();
        let inside = |axis: usize| at[axis] >= BORDER as f64 && at[axis] < (self.counts[axis] - BORDER) as f64;
        (0..3).all(inside).then(|| self.number([0, 1, 2].map(|axis| at[axis] as usize)))
    }

    fn add(&mut self, cell: usize, value: f32, weight: f32) {
        self.values[cell] += weight * value;
        self.weights[cell] += weight;
    }

    /// What a sight line says of the cells along it.
    fn see(&mut self, eye: DVec3, point: DVec3) {
        let way = point - eye;
        let (length, near) = (way.length(), NEAR * self.cell_m);
        let Some(direction) = way.try_normalize() else { return };
        let mut last = usize::MAX;
        let steps = ((length + near) / (0.5 * self.cell_m)) as usize;
        // A grid is no longer than its cells, and what lies outside says nothing.
        let reach = 4.0 * self.counts.iter().sum::<usize>() as f64;
        let first = steps.saturating_sub(reach as usize);
        for step in first..=steps {
            let along = 0.5 * self.cell_m * step as f64;
            let Some(cell) = self.cell(eye + along * direction).filter(|cell| *cell != last) else { continue };
            last = cell;
            let left = (length - along) / near;
            let weight = if left > 1.0 { PASSING } else { 1.0 };
            self.add(cell, left.clamp(-1.0, 1.0) as f32, SIGHT * weight);
        }
    }

    /// Looks from each eye at the points that no other hides: those that are nearest in their direction, to a cell.
    fn look(&mut self, points: &[[f64; 3]], eyes: &[[f64; 3]]) {
        let mut full = vec![false; self.values.len()];
        points.iter().filter_map(|point| self.cell((*point).into())).for_each(|cell| full[cell] = true);
        // Many eyes and many points: each point is looked at from a few.
        const FROM: usize = 4;
        let stride = eyes.len().div_ceil(FROM).max(1);
        for (number, point) in points.iter().enumerate() {
            let point = DVec3::from(*point);
            for eye in eyes.iter().skip(number % stride).step_by(stride) {
                let eye = DVec3::from(*eye);
                let way = point - eye;
                let Some(direction) = way.try_normalize() else { continue };
                let before = way.length() - 1.8 * self.cell_m;
                let steps = (before / (0.5 * self.cell_m)).max(0.0) as usize;
                let hidden = (0..steps.min(4 * MOST_CELLS)).any(|step| {
                    let at = eye + 0.5 * self.cell_m * step as f64 * direction;
                    self.cell(at).is_some_and(|cell| full[cell])
                });
                if !hidden {
                    self.see(eye, point);
                }
            }
        }
    }

    /// It is free about a place.
    fn hold(&mut self, place: DVec3) {
        let reach = (ROOM_M / self.cell_m).ceil().max(1.0) as i64;
        for x in -reach..=reach {
            for y in -reach..=reach {
                for z in -reach..=reach {
                    let step = self.cell_m * DVec3::new(x as f64, y as f64, z as f64);
                    if step.length() > ROOM_M + self.cell_m {
                        continue;
                    }
                    if let Some(cell) = self.cell(place + step) {
                        self.values[cell] = HELD;
                        self.weights[cell] = HELD;
                    }
                }
            }
        }
    }

    /// From sums to means, with weights that are not above the most.
    fn settle(&mut self) {
        for (value, weight) in self.values.iter_mut().zip(&mut self.weights) {
            if *weight > 0.0 {
                *value /= *weight;
                *weight = if *weight >= HELD { HELD } else { weight.min(MOST_SIGHTS) };
            }
        }
    }

    /// Fills what nothing is known of (successive over-relaxation, cells of either colour at once).
    fn relax(&mut self) {
        let [nx, ny, nz] = self.counts;
        let known = self.values.clone();
        let border = |cell: [usize; 3]| (0..3).any(|axis| cell[axis] < BORDER || cell[axis] >= self.counts[axis] - BORDER);
        for number in 0..self.values.len() {
            let cell = [number % nx, number / nx % ny, number / (nx * ny)];
            if border(cell) {
                self.values[number] = -1.0;
            }
        }
        let layer = nx * ny;
        let rounds = (ROUNDS * self.counts.iter().copied().max().unwrap_or(1) as f64) as usize;
        let (weights, known) = (&self.weights, &known);
        for round in 0..2 * rounds {
            let colour = round % 2;
            // Cells of one colour have neighbours of the other alone, so that old and new values do not mix.
            let old = self.values.clone();
            let old = &old;
            self.values.par_chunks_mut(layer).enumerate().for_each(|(z, values)| {
                if z < BORDER || z >= nz - BORDER {
                    return;
                }
                for y in BORDER..ny - BORDER {
                    for x in BORDER..nx - BORDER {
                        if (x + y + z) % 2 != colour {
                            continue;
                        }
                        let at = x + nx * y;
                        let number = at + layer * z;
                        let around = old[number - 1] + old[number + 1] + old[number - nx] + old[number + nx];
                        let around = around + old[number - layer] + old[number + layer];
                        let aim = (around + weights[number] * known[number]) / (6.0 + weights[number]);
                        values[at] = old[number] + RELAXED * (aim - old[number]);
                    }
                }
            });
        }
    }

    /// Takes away free space that hangs together with none of the places, and solid pieces that are too small.
    fn join(&mut self, places: &[[f64; 3]]) {
        let starts: Vec<usize> = places.iter().filter_map(|place| self.cell((*place).into())).collect();
        let mut reached = vec![false; self.values.len()];
        self.flood(&starts, &mut reached, |value| value > 0.0);
        for (value, reached) in self.values.iter_mut().zip(&reached) {
            if *value > 0.0 && !reached {
                *value = -0.1;
            }
        }
        let mut seen = vec![false; self.values.len()];
        self.flood(&[0], &mut seen, |value| value <= 0.0);
        for start in 0..self.values.len() {
            if self.values[start] <= 0.0 && !seen[start] {
                let piece = self.flood(&[start], &mut seen, |value| value <= 0.0);
                if piece.len() < LEAST_SOLID {
                    piece.iter().for_each(|cell| self.values[*cell] = 0.1);
                }
            }
        }
    }

    /// The cells that hang together with some by their faces, of those whose values are as told.
    fn flood(&self, starts: &[usize], reached: &mut [bool], is: impl Fn(f32) -> bool) -> Vec<usize> {
        let [nx, ny, nz] = self.counts;
        let mut all: Vec<usize> = starts.iter().copied().filter(|cell| is(self.values[*cell])).collect();
        all.retain(|cell| !std::mem::replace(&mut reached[*cell], true));
        let mut at = 0;
        while let Some(cell) = all.get(at).copied() {
            let place = [cell % nx, cell / nx % ny, cell / (nx * ny)];
            for (axis, step) in [1, nx, nx * ny].into_iter().enumerate() {
                let ends = [place[axis] > 0, place[axis] + 1 < [nx, ny, nz][axis]];
                for next in [ends[0].then(|| cell - step), ends[1].then(|| cell + step)].into_iter().flatten() {
                    if !reached[next] && is(self.values[next]) {
                        reached[next] = true;
                        all.push(next);
                    }
                }
            }
            at += 1;
        }
        all
    }
}

/// How much it counts that a place is free.
const HELD: f32 = 1e4;
