//! Diffraction of second order: sound round two edges.

use super::edge::Edge;
use super::path::DiffractionPath;
use super::{ASKED, Edges};
use crate::SPEED_OF_SOUND_M_S;
use crate::directivity::source::Source;
use crate::error::{AcousticsError, place};
use crate::octave::OCTAVES_HZ;
use crate::room::Room;
use glam::DVec3;
use promenade_core::barrier_db;

/// Of meshes with more edges, as of scans, no paths round two of them are sought.
const MOST_IN_PAIRS: usize = 400;
/// Steps in which the shortest path round two edges is found, and how near it is then, metres.
const STEPS: usize = 200;
const NEAR_M: f64 = 1e-6;

impl Edges {
    /// The paths from a source to a listener round two edges one after the other, as through a doorway in a thick wall, the
    /// shortest first. Each edge takes what it would take of sound on a path as long as this one that is straight but there
    /// (J. Epstein and D. W. Peterson, "An experimental study of wave propagation at 850 Mc", Proc. IRE 41, 1953, with the
    /// formula of one edge and the whole length of the path).
    ///
    /// # Errors
    /// A source or a listener that is not finite.
    pub fn paths_round_two(
        &self,
        room: &Room,
        source: impl Into<Source>,
        listener: [f64; 3],
    ) -> Result<Vec<DiffractionPath>, AcousticsError> {
        let Source { position, directivity } = source.into();
        let (source, listener) = (place("source", position)?, place("listener", listener)?);
        let mut found = Vec::new();
        if self.all.len() > MOST_IN_PAIRS {
            return Ok(found);
        }
        let seen = |from: DVec3| -> Vec<usize> {
            let sees = |edge: &Edge| ASKED.iter().any(|a| self.free(room, from, self.beside(edge, edge.at(a * edge.length))));
            (0..self.all.len()).filter(|number| sees(&self.all[*number])).collect()
        };
        let (near_source, near_listener) = (seen(source), seen(listener));
        for (a, b) in near_source.iter().flat_map(|a| near_listener.iter().map(move |b| (*a, *b))) {
            let (first, second) = (&self.all[a], &self.all[b]);
            let Some([at_first, at_second]) = bends(first, second, source, listener).filter(|_| a != b) else { continue };
            let (by_first, by_second) = (self.beside(first, at_first), self.beside(second, at_second));
            let hides = |edge: &Edge, from, to| edge.passed(from, to).is_some_and(|pass| pass.hidden);
            let hidden = hides(first, source, by_second) && hides(second, by_first, listener);
            let free = |from, to| self.free(room, from, to);
            if !hidden || !free(source, by_first) || !free(by_first, by_second) || !free(listener, by_second) {
                continue;
            }
            let reach_m = source.distance(at_first) + at_first.distance(at_second);
            let Some(on) = (at_second - at_first).try_normalize() else { continue };
            // What comes after the second edge is straightened, so that nothing steps where that no longer hides anything.
            let path_m = reach_m + at_second.distance(listener);
            let straight = at_first + on * (path_m - source.distance(at_first));
            let direct_m = source.distance(straight);
            let detour_m = path_m - direct_m;
            let mut gains = directivity.towards((at_first - source).to_array());
            for (gain, hz) in gains.iter_mut().zip(OCTAVES_HZ) {
                // A barrier's level is beside that of the straight way.
                *gain *= (path_m / direct_m) as f32
                    * 10.0_f64.powf(-barrier_db(detour_m, hz.into(), SPEED_OF_SOUND_M_S) / 20.0) as f32;
            }
            found.extend(second.path(at_second - on * reach_m, at_second, listener, gains, false));
        }
        self.distinct(&mut found);
        Ok(found)
    }
}

/// Where the shortest path from one place to another passes two edges, if it does between their ends: each is gone round as if
/// the other stood still, in turn.
fn bends(first: &Edge, second: &Edge, from: DVec3, to: DVec3) -> Option<[DVec3; 2]> {
    let mut at = [0.5 * first.length, 0.5 * second.length];
    for _ in 0..STEPS {
        let before = at;
        at[0] = first.pass(from, second.at(at[1]));
        at[1] = second.pass(first.at(at[0]), to);
        if (at[0] - before[0]).abs() + (at[1] - before[1]).abs() < NEAR_M {
            break;
        }
    }
    let inside = (0.0..=first.length).contains(&at[0]) && (0.0..=second.length).contains(&at[1]);
    inside.then(|| [first.at(at[0]), second.at(at[1])])
}
