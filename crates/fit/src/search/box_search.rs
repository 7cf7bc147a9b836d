//! A box of which nothing is stated, from responses and their places: where its six walls are.
//!
//! Each wall alone is scanned as in [`wall_scan`](super::wall_scan), from the outermost place outwards. Of each the best few
//! distances are kept, and of all their combinations that one is taken whose single echoes and echoes of two walls together are
//! the strongest: the sum over walls and pairs of walls is looked up, so that all combinations are tried.

use super::wall_scan::{BESIDE_M, REACH, STEP_M, Scanned, WITH_OTHERS, echo_of, echoes, judge, mirrored};
use crate::early::{Chain, EarlyModel, Unknowns};
use crate::error::FitError;
use crate::measurements::{LEAST_RESPONSES, Measurements};
use crate::room::{FlatWall, Walls, outwards};
use rayon::prelude::*;

/// Walls are at least this far beyond the outermost place, and at most, metres.
const BEYOND_M: (f64, f64) = (0.1, 12.0);
/// Metres from one distance to the next where nothing is stated.
const COARSE_M: f64 = 0.01;
/// Distances that are kept of each wall.
const KEPT: usize = 10;
/// Responses that have to hear an echo.
const LEAST_HEARD: usize = 3;
/// The least length of a room, metres.
const LEAST_M: f64 = 1.0;

/// A box that was searched.
#[derive(Clone, Debug, PartialEq)]
pub struct Searched {
    /// Its walls.
    pub walls: Walls,
    /// How each stands out of its scan.
    pub scanned: [Scanned; 6],
}

/// Searches the box that responses were measured in, its walls along the axes of the places.
///
/// # Errors
/// Fewer than three measurements.
pub fn search_box(set: &Measurements) -> Result<Searched, FitError> {
    let chain = Chain::of(set).filter(|_| set.all.len() >= LEAST_RESPONSES);
    let Some(chain) = chain else {
        return Err(FitError::argument("measurements", format!("at least {LEAST_RESPONSES} responses"), set.all.len()));
    };
    let u = Unknowns { surfaces: 0, nodes: 0, walls: 0, places: set.all.len() };
    let model = EarlyModel::new(u, set, &chain, 1, 0.05);
    let search = Search::new(&model, &chain);
    let ranges = std::array::from_fn(|w| search.beyond(w));
    let Some((at, scanned)) = search.best(&ranges) else {
        return Err(FitError::argument("measurements", "echoes of six walls within 60 ms", "none of one of them"));
    };
    let mut walls = Walls { low_m: [0.0; 3], high_m: [0.0; 3] };
    (0..6).for_each(|w| walls.set_wall(w, at[w]));
    walls.check()?;
    Ok(Searched { walls, scanned })
}

/// Searches the walls of a box about where they are stated.
pub(crate) fn near_box(model: &EarlyModel<'_>, walls: &Walls, chain: &Chain) -> [Scanned; 6] {
    let search = Search::new(model, chain);
    let size = walls.size_m();
    let ranges = std::array::from_fn(|w| {
        let reach = (REACH.0 * size[w / 2]).max(REACH.1);
        let steps = (reach / STEP_M) as i32;
        (-steps..=steps).map(|i| walls.wall_m(w) + f64::from(i) * STEP_M).collect()
    });
    let Some((at, scanned)) = search.best(&ranges) else { return [Scanned::default(); 6] };
    std::array::from_fn(|w| {
        let moved_m = if scanned[w].found { outwards(w) * (at[w] - walls.wall_m(w)) } else { 0.0 };
        Scanned { moved_m, ..scanned[w] }
    })
}

/// Responses and places while walls are searched.
struct Search<'a> {
    set: &'a Measurements,
    rate_hz: f64,
    echoes: Vec<Vec<f64>>,
}

impl<'a> Search<'a> {
    fn new(model: &EarlyModel<'a>, chain: &Chain) -> Self {
        let echoes = (0..model.set.all.len()).into_par_iter().map(|i| echoes(model, chain, i)).collect();
        Self { set: model.set, rate_hz: model.rate_hz, echoes }
    }

    /// Coordinates of a wall beyond the outermost place.
    fn beyond(&self, wall: usize) -> Vec<f64> {
        let axis = wall / 2;
        let outwards = outwards(wall);
        let places = self.set.all.iter().flat_map(|m| [m.source.at_m[axis], m.microphone.at_m[axis]]);
        let outermost = places.map(|x| outwards * x).fold(f64::NEG_INFINITY, f64::max);
        let steps = ((BEYOND_M.1 - BEYOND_M.0) / COARSE_M) as usize;
        (0..steps).map(|i| outwards * (outermost + BEYOND_M.0 + COARSE_M * i as f64)).collect()
    }

    /// The best coordinates of all walls within ranges, and how each stands out with all others where they are; none where a
    /// wall is heard by too few.
    fn best(&self, ranges: &[Vec<f64>; 6]) -> Option<([f64; 6], [Scanned; 6])> {
        let scans: Vec<Vec<(f64, f64)>> = ranges
            .par_iter()
            .enumerate()
            .map(|(w, range)| range.iter().filter_map(|at| Some((*at, self.echo(&[plane(w, *at)])?))).collect())
            .collect();
        let kept: Vec<Vec<(f64, f64)>> = scans.iter().map(|s| peaks(s)).collect();
        if kept.iter().any(Vec::is_empty) {
            return None;
        }
        let best = self.together(&kept);
        let at: [f64; 6] = std::array::from_fn(|w| kept[w][best[w]].0);
        let judged: Vec<(f64, Scanned)> = (0..6)
            .into_par_iter()
            .map(|w| {
                let with = |(x, alone): &(f64, f64)| {
                    let others = (0..6).filter(|o| *o != w).map(|o| self.pair((w, *x), (o, at[o])));
                    (*x, alone + others.filter(|v| v.is_finite()).sum::<f64>())
                };
                let scores: Vec<(f64, f64)> = scans[w].iter().map(with).collect();
                let own = judge(&scores);
                let found = own.found && (own.moved_m - at[w]).abs() < BESIDE_M;
                (if found { own.moved_m } else { at[w] }, Scanned { moved_m: 0.0, found, ..own })
            })
            .collect();
        Some((std::array::from_fn(|w| judged[w].0), std::array::from_fn(|w| judged[w].1)))
    }

    /// The echo of two walls together.
    fn pair(&self, (a, x): (usize, f64), (b, y): (usize, f64)) -> f64 {
        let (first, second) = (plane(a, x), plane(b, y));
        if a / 2 != b / 2 {
            return WITH_OTHERS * self.echo(&[first, second]).unwrap_or(0.0);
        }
        if (y - x) * (if a < b { 1.0 } else { -1.0 }) < LEAST_M {
            return f64::NEG_INFINITY;
        }
        // Between walls that face each other there are two, and they are not the same.
        let two = [self.echo(&[first, second]), self.echo(&[second, first])];
        WITH_OTHERS * 0.5 * two.iter().map(|e| e.unwrap_or(0.0)).sum::<f64>()
    }

    /// How loud the echo of some walls one after the other is in the mean; none that too few responses can hold.
    fn echo(&self, walls: &[FlatWall]) -> Option<f64> {
        let (mut sum, mut count) = (0.0, 0);
        for (m, own) in self.set.all.iter().zip(&self.echoes) {
            let image = walls.iter().fold(m.source.at_m, |at, wall| mirrored(wall, at));
            if let Some(echo) = echo_of(image, m, own, self.rate_hz, self.set.air.speed_m_s()) {
                sum += echo;
                count += 1;
            }
        }
        (count >= LEAST_HEARD.min(self.set.all.len())).then(|| sum / f64::from(u32::try_from(count).unwrap_or(1)))
    }

    /// Which of its distances each wall has in the best combination.
    fn together(&self, kept: &[Vec<(f64, f64)>]) -> [usize; 6] {
        let pairs: Vec<(usize, usize)> = (0..6).flat_map(|a| (a + 1..6).map(move |b| (a, b))).collect();
        // Of a pair of walls, the echo of both for each two of their distances.
        let tables: Vec<Vec<f64>> = pairs
            .par_iter()
            .map(|(a, b)| {
                let both = |(x, y): (f64, f64)| self.pair((*a, x), (*b, y));
                kept[*a].iter().flat_map(|x| kept[*b].iter().map(move |y| (x.0, y.0))).map(both).collect()
            })
            .collect();
        let first = (0..kept[0].len()).into_par_iter();
        let best = first.map(|zero| {
            let mut best = (f64::NEG_INFINITY, [0; 6]);
            let mut at = [zero, 0, 0, 0, 0, 0];
            loop {
                let alone: f64 = at.iter().enumerate().map(|(w, i)| kept[w][*i].1).sum();
                let paired: f64 = pairs.iter().zip(&tables).map(|((a, b), t)| t[at[*a] * kept[*b].len() + at[*b]]).sum();
                if alone + paired > best.0 {
                    best = (alone + paired, at);
                }
                // The next combination, counted up from the last wall.
                let Some(w) = (1..6).rev().find(|w| at[*w] + 1 < kept[*w].len()) else { return best };
                at[w] += 1;
                at[w + 1..].fill(0);
            }
        });
        let all: Vec<(f64, [usize; 6])> = best.collect();
        all.into_iter().fold((f64::NEG_INFINITY, [0; 6]), |a, b| if b.0 > a.0 { b } else { a }).1
    }
}

/// Wall `wall` of a box at a coordinate of its axis.
fn plane(wall: usize, at: f64) -> FlatWall {
    let mut normal = [0.0; 3];
    normal[wall / 2] = 1.0;
    FlatWall { normal, at_m: at, surface: wall, area_m2: 1.0 }
}

/// The highest of a scan, none beside another.
fn peaks(scan: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut order: Vec<&(f64, f64)> = scan.iter().collect();
    order.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut kept: Vec<(f64, f64)> = Vec::new();
    for one in order {
        if kept.len() < KEPT && kept.iter().all(|k| (k.0 - one.0).abs() > BESIDE_M) {
            kept.push(*one);
        }
    }
    kept
}
