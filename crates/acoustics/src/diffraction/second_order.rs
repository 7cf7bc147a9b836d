//! Diffraction of second order: sound round two edges.

use super::edge::{Edge, End};
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
    /// shortest first. Both take what one edge takes of a path so much longer than the straight one, and where they are far
    /// apart, in wavelengths, up to 4.8 dB more (ISO 9613-2:1996, equations 14 and 15): but no more than what the lesser bend
    /// takes by itself, so that nothing steps where that no longer hides anything.
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
            let hides = |edge: &Edge, from, to| edge.passed(End::at(from), End::at(to)).is_some_and(|pass| pass.hidden);
            let hidden = hides(first, source, by_second) && hides(second, by_first, listener);
            let free = |from, to| self.free(room, from, to);
            if !hidden || !free(source, by_first) || !free(by_first, by_second) || !free(listener, by_second) {
                continue;
            }
            let bend = |from: DVec3, at: DVec3, to: DVec3| from.distance(at) + at.distance(to) - from.distance(to);
            let longer_m = bend(source, at_first, at_second);
            let lesser_m = longer_m.min(bend(at_first, at_second, listener));
            let mut gains = directivity.towards((at_first - source).to_array());
            for (gain, hz) in gains.iter_mut().zip(OCTAVES_HZ) {
                *gain *= 10.0_f64.powf(-apart_db(at_first.distance(at_second), lesser_m, hz.into()) / 20.0) as f32;
            }
            found.extend(second.path([source, at_second, listener], longer_m, gains, false));
        }
        self.distinct(&mut found);
        Ok(found)
    }
}

/// What two edges some metres apart take more than one whose detour is theirs together, dB; `lesser_m` is that of the lesser
/// bend.
fn apart_db(apart_m: f64, lesser_m: f64, hz: f64) -> f64 {
    let ratio = (5.0 * SPEED_OF_SOUND_M_S / hz / apart_m).powi(2);
    let most_db = 10.0 * ((1.0 + ratio) / (1.0 / 3.0 + ratio)).log10();
    (barrier_db(lesser_m, hz, SPEED_OF_SOUND_M_S) - barrier_db(0.0, hz, SPEED_OF_SOUND_M_S)).min(most_db)
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
