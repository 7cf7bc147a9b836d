//! Walls of a box from picked times of first echoes, when it is not known which wall made which.
//!
//! Each column of echoes is held against each wall: the distance whose images come at those times, in the median over all
//! pairs of source and microphone. Columns and walls are paired so that the medians together are the least, and distances are
//! then those of least squares over the echoes that are not far off.

use crate::error::FitError;
use crate::measurements::{Echoes, distance};
use crate::room::{WALLS, Walls, outwards};
use promenade_metrics::statistics::median_high;

/// Walls are searched this far beyond the outermost place, metres, in steps.
const BEYOND_M: (f64, f64) = (0.05, 8.0);
const STEP_M: f64 = 0.01;
/// Echoes farther off than so many medians, or this many metres, are others'.
const FAR: f64 = 3.0;
const FAR_M: f64 = 0.02;
/// Rounds of least squares.
const ROUNDS: usize = 12;

/// One wall of a box by its echoes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EchoWall {
    /// Its coordinate on its axis, metres.
    pub at_m: f64,
    /// Standard error of that, metres.
    pub error_m: f64,
    /// Which column of echoes it made, counted from 0.
    pub column: usize,
    /// Echoes that agree, of all.
    pub agree: (usize, usize),
    /// Median distance of its echoes from their times, metres of way.
    pub median_m: f64,
}

/// A box by its echoes.
#[derive(Clone, Debug, PartialEq)]
pub struct EchoBox {
    /// Its walls, in the order of [`WALLS`].
    pub walls: [EchoWall; 6],
    /// Speed of sound by the direct sounds, metres per second.
    pub speed_m_s: f64,
}

impl EchoBox {
    /// As a box.
    #[must_use]
    pub fn walls(&self) -> Walls {
        let mut walls = Walls { low_m: [0.0; 3], high_m: [0.0; 3] };
        self.walls.iter().enumerate().for_each(|(w, found)| walls.set_wall(w, found.at_m));
        walls
    }
}

/// Finds the walls of a box.
///
/// # Errors
/// Fewer than three pairs, or not six echoes of each.
pub fn echo_box(all: &[Echoes]) -> Result<EchoBox, FitError> {
    if all.len() < 3 {
        return Err(FitError::argument("echoes", "at least three pairs of source and microphone", all.len()));
    }
    if let Some(odd) = all.iter().find(|e| e.echoes_s.len() != WALLS.len()) {
        return Err(FitError::argument("echoes", "six of each pair", odd.echoes_s.len()));
    }
    let speed_m_s = median(all.iter().map(|e| distance(e.source_m, e.microphone_m) / e.direct_s));
    let scans: Vec<Vec<(f64, f64)>> =
        (0..6).map(|wall| (0..6).map(|column| scan(all, wall, column, speed_m_s)).collect()).collect();
    let mut best = (f64::INFINITY, [0; 6]);
    permutations(&mut [0, 1, 2, 3, 4, 5], 0, &mut |columns| {
        let sum: f64 = columns.iter().enumerate().map(|(wall, column)| scans[wall][*column].1).sum();
        if sum < best.0 {
            best = (sum, *columns);
        }
    });
    let walls = std::array::from_fn(|w| refined(all, w, best.1[w], speed_m_s, scans[w][best.1[w]].0));
    Ok(EchoBox { walls, speed_m_s })
}

/// Metres of way by which the image at a wall is longer than the time of an echo says.
fn off(e: &Echoes, wall: usize, at_m: f64, column: usize, speed_m_s: f64) -> f64 {
    let mut image = e.source_m;
    image[wall / 2] = 2.0 * at_m - image[wall / 2];
    distance(image, e.microphone_m) - e.echoes_s[column] * speed_m_s
}

/// The best distance of a wall for a column, and the median that is left.
fn scan(all: &[Echoes], wall: usize, column: usize, speed_m_s: f64) -> (f64, f64) {
    let axis = wall / 2;
    let outwards = outwards(wall);
    let places = all.iter().flat_map(|e| [e.source_m[axis], e.microphone_m[axis]]);
    let outermost = places.map(|x| outwards * x).fold(f64::NEG_INFINITY, f64::max);
    let steps = ((BEYOND_M.1 - BEYOND_M.0) / STEP_M) as usize;
    (0..steps)
        .map(|i| {
            let at = outwards * (outermost + BEYOND_M.0 + STEP_M * i as f64);
            (at, median(all.iter().map(|e| off(e, wall, at, column, speed_m_s).abs())))
        })
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .unwrap_or((0.0, f64::INFINITY))
}

/// Least squares over the echoes that agree.
fn refined(all: &[Echoes], wall: usize, column: usize, speed_m_s: f64, start_m: f64) -> EchoWall {
    const STEP: f64 = 1e-4;
    let mut found = EchoWall { at_m: start_m, error_m: f64::INFINITY, column, agree: (0, all.len()), median_m: f64::INFINITY };
    for _ in 0..ROUNDS {
        let rows: Vec<(f64, f64)> = all
            .iter()
            .map(|e| {
                let at = |m: f64| off(e, wall, m, column, speed_m_s);
                (at(found.at_m), (at(found.at_m + STEP) - at(found.at_m - STEP)) / (2.0 * STEP))
            })
            .collect();
        found.median_m = median(rows.iter().map(|r| r.0.abs()));
        let near: Vec<&(f64, f64)> = rows.iter().filter(|r| r.0.abs() < (FAR * found.median_m).max(FAR_M)).collect();
        let power: f64 = near.iter().map(|r| r.1 * r.1).sum();
        if power <= 0.0 {
            break;
        }
        found.at_m -= near.iter().map(|r| r.0 * r.1).sum::<f64>() / power;
        found.agree.0 = near.len();
        let variance = near.iter().map(|r| r.0 * r.0).sum::<f64>() / near.len() as f64;
        found.error_m = (variance / power).sqrt();
    }
    found
}

fn median(all: impl Iterator<Item = f64>) -> f64 {
    median_high(all).unwrap_or(f64::INFINITY)
}

/// Calls for every order of six numbers.
fn permutations(order: &mut [usize; 6], from: usize, with: &mut impl FnMut(&[usize; 6])) {
    if from == order.len() {
        with(order);
        return;
    }
    for i in from..order.len() {
        order.swap(from, i);
        permutations(order, from + 1, with);
        order.swap(from, i);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::Random;

    #[test]
    fn walls_are_found_whichever_column_is_theirs() {
        let walls = [-0.3, 5.4, 0.2, 5.9, 0.0, 2.4];
        let columns = [3, 5, 0, 1, 4, 2];
        let mut random = Random::new(4, 0);
        let mut at = |low: [f64; 3], high: [f64; 3]| -> [f64; 3] {
            std::array::from_fn(|a| low[a] + (high[a] - low[a]) * random.uniform())
        };
        let mut all: Vec<Echoes> = (0..24)
            .map(|_| Echoes {
                source_m: at([0.3, 0.8, 0.5], [4.9, 5.2, 1.9]),
                microphone_m: at([0.3, 0.8, 0.5], [4.9, 5.2, 1.9]),
                direct_s: 0.0,
                echoes_s: vec![0.0; 6],
            })
            .collect();
        let mut random = Random::new(5, 0);
        for (i, e) in all.iter_mut().enumerate() {
            e.direct_s = distance(e.source_m, e.microphone_m) / 345.0;
            for w in 0..6 {
                // A sixth of them were picked wrongly.
                let wrong = if (i + w) % 6 == 0 { 0.8 * random.uniform() } else { 0.0 };
                e.echoes_s[columns[w]] = (off(e, w, walls[w], columns[w], 345.0) + 0.01 * random.normal() + wrong) / 345.0;
            }
        }
        let found = echo_box(&all).unwrap();
        assert!((found.speed_m_s - 345.0).abs() < 1e-6);
        for (w, wall) in found.walls.iter().enumerate() {
            assert!(wall.column == columns[w] && (wall.at_m - walls[w]).abs() < 0.01 && wall.error_m < 0.01, "{w}: {wall:?}");
        }
        assert!(echo_box(&all[..2]).is_err());
    }
}
