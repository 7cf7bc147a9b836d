//! Diffraction: sound that reaches places in the shadow of edges.

mod edge;
mod images;
mod path;
mod second_order;

pub use images::DiffractedImages;
pub use path::DiffractionPath;

use crate::directivity::source::Source;
use crate::error::{AcousticsError, place};
use crate::mesh::{Mesh, normal};
use crate::room::{NOWHERE, Room};
use edge::Edge;
use glam::DVec3;
use std::collections::HashMap;

/// Corners nearer to each other than this share of the mesh's diagonal are one.
const WELD: f64 = 1e-5;
/// How far off its edge a path passes, as a share of the mesh's diagonal: single precision cannot tell less from the wall.
const OFF: f64 = 2e-5;

/// Where an edge is asked what it sees, as shares of its length.
const ASKED: [f64; 3] = [0.1, 0.5, 0.9];

/// Edges of a mesh that sound can go round: where surfaces leave more than half of the space about them open.
#[derive(Clone, Debug)]
pub struct Edges {
    all: Vec<Edge>,
    off_m: f64,
}

impl Edges {
    /// The edges of a mesh.
    #[must_use]
    pub fn of(mesh: &Mesh) -> Self {
        let [low, high] = mesh.bounds().map(DVec3::from_array);
        let diagonal = low.distance(high);
        let cell = (WELD * diagonal).max(f64::MIN_POSITIVE);
        let weld = |v: DVec3| ((v - low) / cell).round().to_array().map(|c| c as i64);
        /// Where an edge ends, and a corner of each triangle that it bounds.
        type Sides = ([DVec3; 2], Vec<DVec3>);
        let mut sides: HashMap<[[i64; 3]; 2], Sides> = HashMap::new();
        for t in &mesh.triangles {
            let corners = mesh.corners(t);
            if normal(corners[0], corners[1], corners[2]).is_none() {
                continue;
            }
            for k in 0..3 {
                let [a, b, opposite] = [corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]];
                let (a, b) = if weld(a) < weld(b) { (a, b) } else { (b, a) };
                sides.entry([weld(a), weld(b)]).or_insert_with(|| ([a, b], Vec::new())).1.push(opposite);
            }
        }
        let mut edges: Vec<_> = sides.into_iter().collect();
        // Hash maps have no order of their own.
        edges.sort_unstable_by_key(|(key, _)| *key);
        let all = edges.into_iter().filter_map(|(_, (ends, corners))| Edge::of(ends, &corners)).collect();
        Self { all, off_m: OFF * diagonal }
    }

    /// How many there are.
    #[must_use]
    pub fn count(&self) -> usize {
        self.all.len()
    }

    /// The paths from a source to a listener in its shadow round one edge each, the shortest first.
    ///
    /// # Errors
    /// A source or a listener that is not finite.
    pub fn paths(
        &self,
        room: &Room,
        source: impl Into<Source>,
        listener: [f64; 3],
    ) -> Result<Vec<DiffractionPath>, AcousticsError> {
        let Source { position, directivity } = source.into();
        let (source, listener) = (place("source", position)?, place("listener", listener)?);
        let path = |edge: &Edge| {
            let at = edge.bend(source, listener)?;
            let beside = self.beside(edge, at);
            if !self.free(room, source, beside) || !self.free(room, listener, beside) {
                return None;
            }
            edge.path(source, at, listener, directivity.towards((at - source).to_array()))
        };
        let mut found: Vec<DiffractionPath> = self.all.iter().filter_map(path).collect();
        self.distinct(&mut found);
        Ok(found)
    }

    /// The paths from a source to a listener in its shadow round one edge each, or round two where there is none round one, the
    /// shortest first.
    ///
    /// # Errors
    /// A source or a listener that is not finite.
    pub fn paths_round_one_or_two(
        &self,
        room: &Room,
        source: impl Into<Source>,
        listener: [f64; 3],
    ) -> Result<Vec<DiffractionPath>, AcousticsError> {
        let source = source.into();
        let found = self.paths(room, &source, listener)?;
        if found.is_empty() { self.paths_round_two(room, &source, listener) } else { Ok(found) }
    }

    /// Sorts paths by their length; one through the common end of two edges is one.
    fn distinct(&self, found: &mut Vec<DiffractionPath>) {
        found.sort_by(|a, b| a.path_m.total_cmp(&b.path_m));
        found.dedup_by(|a, b| DVec3::from(a.position).distance(b.position.into()) < self.off_m);
    }

    /// A place of an edge, just off its surfaces.
    fn beside(&self, edge: &Edge, at: DVec3) -> DVec3 {
        at + self.off_m * edge.outward()
    }

    /// Whether nothing is between two places, the second of which may be beside an edge.
    fn free(&self, room: &Room, from: DVec3, to: DVec3) -> bool {
        let way = to - from;
        let length = way.length();
        length > 0.0 && room.cast(from, way / length, NOWHERE).is_none_or(|(_, hit)| hit >= length - 0.5 * self.off_m)
    }
}
