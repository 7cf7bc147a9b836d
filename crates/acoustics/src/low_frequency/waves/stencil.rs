//! Finite differences on the cells of a room.
//!
//! Along each axis the second difference `K` of neighbours, as volumes and faces of cells have it that reach to the walls, with
//! `K + h^2 / 12 K K` in its place: of fourth order between walls half a cell from a middle, symmetric and never negative
//! everywhere, so that every room is stable up to one time step. In time of second order, and what that does to frequencies is
//! known exactly and taken back from what is recorded.
//!
//! Walls react locally (S. Bilbao, B. Hamilton, J. Botts and L. Savioja 2016: series branches by the trapezoidal rule,
//! passive).
//! A cut link's area counts by the cosine between the axis and the face, so that steps along a slanted wall absorb as the wall.

use super::cells::{Cells, PAD, SPONGE};
use super::differences::{Differences, TERMS};
use super::wall::{Branch, Wall};
use crate::room::Room;
use rayon::prelude::*;
use std::ops::Range;

/// Share of the largest stable time step.
const COURANT: f64 = 0.97;
/// What a cell's share may differ by from one that is far from walls and still be taken as one.
const ALIKE: f64 = 1e-7;
/// Damping of the outermost cells of an open room, times the sound that a time step brings.
const SPONGE_MOST: f64 = 0.25;
/// Cells next to each other along x, by index.
type Run = Range<usize>;

/// The waves in a room.
pub(super) struct Stencil {
    pub(super) dt_s: f64,
    counts: [usize; 3],
    /// Cells far from walls, by layer of z.
    runs: Vec<Vec<Run>>,
    /// What a cell far from walls takes of itself, of its neighbours and of those beyond along each axis.
    middle: f32,
    near: [f32; 3],
    far: [f32; 3],
    /// The others, by layer.
    odd: Vec<Vec<Odd>>,
    /// What walls do, by layer.
    walls: Vec<Vec<Entry>>,
    constants: Vec<Constants>,
    offsets: [isize; TERMS],
    /// Cubic metres of each cell.
    volumes: Vec<f32>,
    speed_m_s: f64,
    now: Vec<f32>,
    before: Vec<f32>,
}

/// A cell near walls, with what it takes of its surroundings in the order of the offsets.
struct Odd {
    index: u32,
    terms: [f32; TERMS],
}

/// The walls of one material at a cell.
struct Entry {
    index: u32,
    wall: u16,
    /// `c dt^2 area / volume`
    share: f32,
    /// What flows into each branch now and did before.
    flows: Vec<[f32; 2]>,
    /// The last of a cell closes its equation with the sum of all: `c dt^2 / V sum A (still / 2dt + sum g / 2dt)`.
    closes: Option<f32>,
}

/// A wall at the time step.
struct Constants {
    /// Of `p+ - p-`: what always conducts.
    still: f32,
    branches: Vec<[f32; 4]>,
}

impl Constants {
    fn new(wall: &Wall, dt: f64) -> Self {
        let branch = |b: &Branch| {
            let (m, r, k) = (b.mass / (dt * dt), b.resistance / (2.0 * dt), b.stiffness / 4.0);
            let d = m + r + k;
            // The flow after this one: `g (p+ - p-) + now * a - before * b`.
            [1.0 / (2.0 * dt * d), (2.0 * m - 2.0 * k) / d, (m - r + k) / d, 0.0].map(|v| v as f32)
        };
        Self { still: wall.still as f32, branches: wall.branches.iter().map(branch).collect() }
    }

    /// What a cell's new pressure takes part with, per share, over `2 dt`.
    fn conducts(&self) -> f32 {
        self.still + self.branches.iter().map(|b| b[0]).sum::<f32>()
    }
}

impl Stencil {
    /// The time step of cells of some length, seconds.
    pub(super) fn time_step_s(step: glam::DVec3, speed_m_s: f64) -> f64 {
        let greatest: f64 = step.to_array().iter().map(|h| 16.0 / 3.0 / (h * h)).sum();
        COURANT * 2.0 / (speed_m_s * greatest.sqrt())
    }

    pub(super) fn new(room: &Room, cells: &Cells, walls: &[Wall], speed_m_s: f64) -> Self {
        let dt = Self::time_step_s(cells.step, speed_m_s);
        let differences = Differences::new(room, cells);
        let size = differences.volumes.len();
        let strides = cells.strides();
        let h = cells.step.to_array();
        let courant = speed_m_s * speed_m_s * dt * dt;
        let regular: [[f64; 3]; 3] = h.map(|h| [5.0 / 2.0, -4.0 / 3.0, 1.0 / 12.0].map(|w| courant * w / (h * h)));
        let offsets = std::array::from_fn(|n| {
            let (axis, place) = (n.saturating_sub(1) / 4, n.saturating_sub(1) % 4);
            let steps = [-2, -1, 1, 2][place];
            if n == 0 { 0 } else { steps * strides[axis].cast_signed() }
        });
        let layers = cells.counts[2];
        let layer = strides[2];
        let mut stencil = Self {
            dt_s: dt,
            counts: cells.counts,
            runs: vec![Vec::new(); layers],
            middle: (2.0 - regular.iter().map(|r| r[0]).sum::<f64>()) as f32,
            near: regular.map(|r| -r[1] as f32),
            far: regular.map(|r| -r[2] as f32),
            odd: (0..layers).map(|_| Vec::new()).collect(),
            walls: (0..layers).map(|_| Vec::new()).collect(),
            constants: walls.iter().map(|wall| Constants::new(wall, dt)).collect(),
            offsets,
            volumes: differences.volumes.iter().map(|v| *v as f32).collect(),
            speed_m_s,
            now: vec![0.0; size],
            before: vec![0.0; size],
        };
        // Air beyond an open edge and a sponge before it conduct everything.
        stencil.constants.push(Constants::new(&Wall { still: 1.0, branches: Vec::new() }, dt));
        for index in (0..size).filter(|index| cells.inside[*index]) {
            let terms = differences.terms(cells, index, courant);
            let alike = |n: usize| {
                let (axis, place) = (n.saturating_sub(1) / 4, n.saturating_sub(1) % 4);
                let plain = match (n, place) {
                    (0, _) => stencil.middle,
                    (_, 1 | 2) => stencil.near[axis],
                    _ => stencil.far[axis],
                };
                (terms[n] - f64::from(plain)).abs() < ALIKE
            };
            let z = index / layer;
            if (0..TERMS).all(alike) {
                match stencil.runs[z].last_mut() {
                    Some(run) if run.end == index => run.end += 1,
                    _ => stencil.runs[z].push(index..index + 1),
                }
            } else {
                stencil.odd[z].push(Odd { index: index as u32, terms: terms.map(|t| t as f32) });
            }
        }
        stencil.add_walls(cells, &differences.faces, &differences.volumes);
        stencil
    }

    /// Walls by cell and material; `faces` are cells with the material and its area, those without one are open.
    fn add_walls(&mut self, cells: &Cells, faces: &[(usize, Option<usize>, f64)], volumes: &[f64]) {
        let (dt, speed, layer) = (self.dt_s, self.speed_m_s, self.counts[0] * self.counts[1]);
        let open = self.constants.len() - 1;
        let mut areas: Vec<(usize, usize, f64)> =
            faces.iter().map(|(index, wall, area)| (*index, wall.unwrap_or(open), *area)).collect();
        if cells.open {
            for index in (0..cells.inside.len()).filter(|index| cells.inside[*index]) {
                let depth = cells.at(index).into_iter().zip(self.counts).map(|(at, count)| {
                    let edge = (at - PAD).min(count - 1 - PAD - at);
                    SPONGE.saturating_sub(edge) as f64 / SPONGE as f64
                });
                let damping = SPONGE_MOST * depth.fold(0.0, f64::max).powi(2);
                if damping > 0.0 {
                    areas.push((index, open, damping * volumes[index] * 2.0 / (speed * dt)));
                }
            }
        }
        areas.sort_by_key(|(index, wall, _)| (*index, *wall));
        areas.dedup_by(|next, kept| {
            let same = (next.0, next.1) == (kept.0, kept.1);
            kept.2 += if same { next.2 } else { 0.0 };
            same
        });
        for of_cell in areas.chunk_by(|a, b| a.0 == b.0) {
            let mut sum = 0.0;
            for (n, (index, wall, area)) in of_cell.iter().enumerate() {
                let share = speed * dt * area / volumes[*index];
                let constants = &self.constants[*wall];
                sum += 0.5 * share as f32 * constants.conducts();
                self.walls[index / layer].push(Entry {
                    index: *index as u32,
                    wall: *wall as u16,
                    share: share as f32,
                    flows: vec![[0.0; 2]; constants.branches.len()],
                    closes: (n + 1 == of_cell.len()).then_some(sum),
                });
            }
        }
    }

    /// One time step: sound of some strength goes out from cells with their shares.
    pub(super) fn step(&mut self, sound: f64, source: &[(usize, f64)]) {
        let layer = self.counts[0] * self.counts[1];
        let now = &self.now;
        let (constants, offsets) = (&self.constants, &self.offsets);
        let (middle, near, far) = (self.middle, self.near, self.far);
        let strides = [1, self.counts[0], layer];
        let strength = (self.speed_m_s * self.dt_s).powi(2) * 4.0 * std::f64::consts::PI * sound;
        let volumes = &self.volumes;
        let layers =
            self.before.par_chunks_mut(layer).zip(&self.runs).zip(&self.odd).zip(self.walls.par_iter_mut()).enumerate();
        layers.for_each(|(z, (((before, runs), odd), walls))| {
            let first = z * layer;
            // Walls need what was before.
            let mut held: Vec<f32> = Vec::with_capacity(walls.len());
            held.extend(walls.iter().map(|wall| before[wall.index as usize - first]));
            for run in runs {
                advance(&mut before[run.start - first..run.end - first], now, run.start, strides, (middle, near, far));
            }
            for odd in odd {
                let index = odd.index as usize;
                let sum: f32 =
                    odd.terms.iter().zip(offsets).map(|(term, offset)| term * now[index.wrapping_add_signed(*offset)]).sum();
                before[index - first] = sum - before[index - first];
            }
            for (index, share) in source.iter().filter(|(index, _)| index / layer == z) {
                before[index - first] += (strength * share) as f32 / volumes[*index];
            }
            react(walls, constants, &held, before, first);
        });
        std::mem::swap(&mut self.now, &mut self.before);
    }

    /// The pressure of a mix of cells.
    pub(super) fn pressure(&self, cells: &[(u32, f32)]) -> f32 {
        cells.iter().map(|(index, share)| share * self.now[*index as usize]).sum()
    }
}

/// Sets cells far from walls, of which the first has this index.
fn advance(out: &mut [f32], now: &[f32], first: usize, strides: [usize; 3], (m, near, far): (f32, [f32; 3], [f32; 3])) {
    let count = out.len();
    let at = |offset: isize| &now[first.wrapping_add_signed(offset)..][..count];
    let [x, y, z] = strides.map(usize::cast_signed);
    let own = at(0);
    let [x1, x2, x3, x4] = [at(-x), at(x), at(-2 * x), at(2 * x)];
    let [y1, y2, y3, y4] = [at(-y), at(y), at(-2 * y), at(2 * y)];
    let [z1, z2, z3, z4] = [at(-z), at(z), at(-2 * z), at(2 * z)];
    for i in 0..count {
        let along_x = near[0] * (x1[i] + x2[i]) + far[0] * (x3[i] + x4[i]);
        let along_y = near[1] * (y1[i] + y2[i]) + far[1] * (y3[i] + y4[i]);
        let along_z = near[2] * (z1[i] + z2[i]) + far[2] * (z3[i] + z4[i]);
        out[i] = m * own[i] - out[i] + along_x + along_y + along_z;
    }
}

/// Lets walls take part in the new pressures of a layer whose first cell has the index `first`; `held` are the pressures before
/// of the entries' cells.
fn react(walls: &mut [Entry], constants: &[Constants], held: &[f32], new: &mut [f32], first: usize) {
    let mut start = 0;
    for end in 0..walls.len() {
        let Some(sum) = walls[end].closes else { continue };
        let old = held[end];
        let mut pushed = 0.0;
        for entry in &walls[start..=end] {
            let branches = &constants[entry.wall as usize].branches;
            let free: f32 = branches.iter().zip(&entry.flows).map(|(b, [now, past])| b[1] * now - b[2] * past - past).sum();
            pushed += 0.5 * entry.share * free;
        }
        let cell = &mut new[walls[end].index as usize - first];
        let next = (*cell + sum * old - pushed) / (1.0 + sum);
        *cell = next;
        for entry in &mut walls[start..=end] {
            let branches = &constants[entry.wall as usize].branches;
            for (b, flow) in branches.iter().zip(&mut entry.flows) {
                let [now, past] = *flow;
                *flow = [b[0] * (next - old) + b[1] * now - b[2] * past, now];
            }
        }
        start = end + 1;
    }
}
