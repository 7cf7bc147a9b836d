//! A room cut into cells: which of them sound reaches, and where surfaces lie between them.

use crate::room::{NOWHERE, Room};
use glam::DVec3;

/// Cells without air on every side of the lattice, as far as a difference reaches.
pub(super) const PAD: usize = 2;
/// Cells beyond an open room in which sound dies away.
pub(super) const SPONGE: usize = 8;
/// No surface.
const NONE: u32 = u32::MAX;
/// How much finer than asked for cells may be, so that walls lie between them.
const FINER: f64 = 1.15;
/// Faces count as square to an axis from this cosine on.
const SQUARE: f64 = 0.999;
/// Surfaces that are met on a line at most.
const MOST_MET: usize = 100_000;

/// Surfaces between two neighbours: seen from either, how far away, as a share of a cell, and which face.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cut {
    pub(super) share: [f64; 2],
    pub(super) face: [u32; 2],
}

/// A lattice of cells in a room. Along each axis cells are numbered from 0, [`PAD`] of them without air.
#[derive(Debug)]
pub(super) struct Cells {
    pub(super) counts: [usize; 3],
    /// Middle of the cell 0, 0, 0, metres.
    pub(super) origin: DVec3,
    /// Length of a cell along each axis, metres.
    pub(super) step: DVec3,
    pub(super) inside: Vec<bool>,
    /// By axis and cell, the number of what lies between it and the next.
    after: [Vec<u32>; 3],
    cuts: Vec<Cut>,
    /// Whether sound leaves the room.
    pub(super) open: bool,
}

impl Cells {
    /// Cells of about `step_m`, those that sound from a source reaches; none if no cell's middle is seen from it.
    pub(super) fn new(room: &Room, source: DVec3, step_m: f64) -> Option<Self> {
        let [low, high] = [room.centre() - room.half(), room.centre() + room.half()];
        let closed = Self::within(room, source, low, high, step_m, 0)?;
        if closed.open { Self::within(room, source, low, high, step_m, SPONGE) } else { Some(closed) }
    }

    /// How many cells a room takes at most.
    pub(super) fn estimate(room: &Room, step_m: f64) -> f64 {
        (2.0 * room.half() / step_m + 2.0).element_product()
    }

    fn within(room: &Room, source: DVec3, low: DVec3, high: DVec3, step_m: f64, beyond: usize) -> Option<Self> {
        let (mut counts, mut step) = ([0; 3], DVec3::ZERO);
        for axis in 0..3 {
            let cells = fitting(room, axis, low[axis], high[axis], step_m);
            step[axis] = (high[axis] - low[axis]).max(step_m) / cells as f64;
            counts[axis] = cells + 2 * (beyond + PAD);
        }
        let origin = low + step * (0.5 - (beyond + PAD) as f64);
        let size = counts.iter().product();
        let mut cells = Self {
            counts,
            origin,
            step,
            inside: vec![false; size],
            after: std::array::from_fn(|_| vec![NONE; size]),
            cuts: Vec::new(),
            open: false,
        };
        (0..3).for_each(|axis| cells.cut(room, axis));
        let start = cells.nearest(room, source)?;
        cells.flood(start);
        Some(cells)
    }

    /// Numbers between neighbours along each axis.
    pub(super) fn strides(&self) -> [usize; 3] {
        [1, self.counts[0], self.counts[0] * self.counts[1]]
    }

    pub(super) fn at(&self, index: usize) -> [usize; 3] {
        let [x, y, _] = self.counts;
        [index % x, index / x % y, index / (x * y)]
    }

    pub(super) fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.counts[1] + y) * self.counts[0] + x
    }

    pub(super) fn middle(&self, index: usize) -> DVec3 {
        let [x, y, z] = self.at(index);
        self.origin + self.step * DVec3::new(x as f64, y as f64, z as f64)
    }

    /// What lies between a cell and the one after it along an axis.
    pub(super) fn between(&self, axis: usize, index: usize) -> Option<&Cut> {
        self.cuts.get(self.after[axis][index] as usize)
    }

    /// The neighbour of a cell with air, if there is nothing between: on the side of greater coordinates if `up`.
    pub(super) fn neighbour(&self, index: usize, axis: usize, up: bool) -> Option<usize> {
        let stride = self.strides()[axis];
        let (low, next) = if up { (index, index + stride) } else { (index - stride, index - stride) };
        (self.after[axis][low] == NONE && self.inside[next]).then_some(next)
    }

    /// Finds the surfaces on all lines along an axis.
    fn cut(&mut self, room: &Room, axis: usize) {
        let others = [(axis + 1) % 3, (axis + 2) % 3];
        let direction = DVec3::AXES[axis];
        let (step, count) = (self.step[axis], self.counts[axis]);
        let stride = self.strides()[axis];
        for j in 0..self.counts[others[1]] {
            for i in 0..self.counts[others[0]] {
                let mut at = [0; 3];
                (at[others[0]], at[others[1]]) = (i, j);
                let first = self.index(at);
                let start = self.middle(first);
                let (mut from, mut leaving, mut met) = (start - 0.5 * step * direction, NOWHERE, 0);
                while let Some((face, far)) = room.cast(from, direction, leaving) {
                    from += far * direction;
                    (leaving, met) = (room.plane(face), met + 1);
                    let place = (from - start)[axis] / step;
                    if place >= (count - 1) as f64 || met > MOST_MET {
                        break;
                    }
                    if place >= 0.0 {
                        let below = place as usize;
                        let share = place - below as f64;
                        let entry = &mut self.after[axis][first + below * stride];
                        if let Some(cut) = self.cuts.get_mut(*entry as usize) {
                            (cut.share[1], cut.face[1]) = (1.0 - share, face);
                        } else {
                            *entry = self.cuts.len() as u32;
                            self.cuts.push(Cut { share: [share, 1.0 - share], face: [face; 2] });
                        }
                    }
                }
            }
        }
    }

    /// The cell nearest to a place whose middle is seen from there.
    pub(super) fn nearest(&self, room: &Room, place: DVec3) -> Option<usize> {
        let base = ((place - self.origin) / self.step).round();
        let reach = -2_i32..=2;
        let all = reach.clone().flat_map(|z| reach.clone().flat_map(move |y| (-2_i32..=2).map(move |x| [x, y, z])));
        let cell = |offset: [i32; 3]| -> Option<usize> {
            let at = base + DVec3::from(offset.map(f64::from));
            let limit = DVec3::from(self.counts.map(|count| (count - 1 - PAD) as f64));
            if !(at.cmpge(DVec3::splat(PAD as f64)).all() && at.cmple(limit).all()) {
                return None;
            }
            let index = self.index(at.to_array().map(|c| c as usize));
            let way = self.middle(index) - place;
            let clear = way.length() < 1e-9
                || room.cast(place, way.normalize(), NOWHERE).is_none_or(|(_, far)| far > way.length() - 1e-6);
            clear.then_some(index)
        };
        let mut seen: Vec<usize> = all.filter_map(cell).collect();
        let far = |index: &usize| self.middle(*index).distance_squared(place);
        // A cell that sound has reached, where that is known.
        if seen.iter().any(|index| self.inside[*index]) {
            seen.retain(|index| self.inside[*index]);
        }
        seen.into_iter().min_by(|a, b| far(a).total_cmp(&far(b)))
    }

    /// Marks all cells that sound from one reaches.
    fn flood(&mut self, start: usize) {
        let strides = self.strides();
        let mut next = vec![start];
        self.inside[start] = true;
        while let Some(index) = next.pop() {
            let at = self.at(index);
            for axis in 0..3 {
                for up in [false, true] {
                    let low = if up { index } else { index - strides[axis] };
                    if self.after[axis][low] != NONE {
                        continue;
                    }
                    let edge = if up { at[axis] + 1 + PAD >= self.counts[axis] } else { at[axis] <= PAD };
                    if edge {
                        self.open = true;
                        continue;
                    }
                    let other = if up { index + strides[axis] } else { index - strides[axis] };
                    if !std::mem::replace(&mut self.inside[other], true) {
                        next.push(other);
                    }
                }
            }
        }
    }
}

/// Into how many cells of about `step_m` an axis is cut, so that faces square to it lie between two.
fn fitting(room: &Room, axis: usize, low: f64, high: f64, step_m: f64) -> usize {
    let length = (high - low).max(step_m);
    let squares = room.square_faces(axis, SQUARE);
    let least = (length / step_m).ceil().max(1.0) as usize;
    let most = ((length / step_m) * FINER).ceil().max(least as f64) as usize;
    let off = |count: usize| -> f64 {
        let of = |(at, area): &(f64, f64)| {
            let place = (at - low) / length * count as f64;
            area * ((place - place.round()) / count as f64).abs()
        };
        squares.iter().map(of).sum()
    };
    let all = (least..=most).map(|count| (off(count), count));
    all.reduce(|best, next| if next.0 < 0.98 * best.0 - 1e-9 { next } else { best }).map_or(least, |(_, count)| count)
}
