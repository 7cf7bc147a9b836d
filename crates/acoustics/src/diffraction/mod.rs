//! Diffraction: sound that reaches places in the shadow of edges, and what edges take of it beside their shadow.

mod edge;
mod images;
mod path;
mod second_order;

pub use images::DiffractedImages;
pub use path::DiffractionPath;

use crate::SPEED_OF_SOUND_M_S;
use crate::directivity::source::Source;
use crate::error::{AcousticsError, place};
use crate::mesh::{Mesh, normal};
use crate::octave::{OCTAVES_HZ, Octaves};
use crate::room::{NOWHERE, Room};
use edge::{Edge, End, Pass};
use glam::DVec3;
use promenade_core::lit_gain;
use std::collections::HashMap;

/// Corners nearer to each other than this share of the mesh's diagonal are one.
const WELD: f64 = 1e-5;
/// How far off its edge a path passes, as a share of the mesh's diagonal: single precision cannot tell less from the wall.
const OFF: f64 = 2e-5;
/// An edge shorter than this, metres, is rough, and rays have what it scatters.
const SHORTEST_M: f64 = 0.2;
/// Edges whose surfaces differ by less than this are one where they continue each other.
const SAME_WEDGE: f64 = 1e-3;
/// An edge takes something of 63 Hz where a way over it is this much longer than the straight one, metres, and of higher
/// frequencies where it is less.
const NEAR_M: f64 = 0.52;

/// Where an edge is asked what it sees, as shares of its length.
const ASKED: [f64; 3] = [0.1, 0.5, 0.9];

/// Edges of a mesh that sound can go round: where surfaces leave more than half of the space about them open.
#[derive(Clone, Debug)]
pub struct Edges {
    /// The longest first.
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
        let edges = edges.into_iter().filter_map(|(_, (ends, corners))| Edge::of(ends, &corners));
        let mut all = joined(edges.collect(), cell);
        all.retain(|edge| edge.length >= SHORTEST_M);
        all.sort_by(|a, b| b.length.total_cmp(&a.length));
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
            let at = edge.passed(End::at(source), End::at(listener)).filter(|pass| pass.hidden)?.at;
            let beside = self.beside(edge, at);
            if !self.free(room, source, beside) || !self.free(room, listener, beside) {
                return None;
            }
            let mut path = edge.path([source, at, listener], 0.0, directivity.towards((at - source).to_array()), false)?;
            // Other edges that either leg passes.
            let straight = source + (at - source).normalize_or_zero() * path.path_m;
            let legs = [
                [End::at(source), End { unfolded: straight, seen: beside }],
                [End { unfolded: path.position.into(), seen: beside }, End::at(listener)],
            ];
            legs.iter().for_each(|leg| self.shade(room, *leg, Some(edge), &mut path.gains));
            Some(path)
        };
        let mut found: Vec<DiffractionPath> = self.all.iter().filter_map(path).collect();
        self.distinct(&mut found);
        Ok(found)
    }

    /// What edges take of the sound of a source that a listener sees, the nearest edge first: paths that are
    /// [`DiffractionPath::lit`].
    ///
    /// # Errors
    /// A source or a listener that is not finite.
    pub fn beside_shadows(
        &self,
        room: &Room,
        source: impl Into<Source>,
        listener: [f64; 3],
    ) -> Result<Vec<DiffractionPath>, AcousticsError> {
        let Source { position, directivity } = source.into();
        let (source, listener) = (place("source", position)?, place("listener", listener)?);
        let path = |(edge, pass): (&Edge, Pass)| {
            edge.path([source, pass.at, listener], 0.0, directivity.towards((listener - source).to_array()), true)
        };
        Ok(self.near(room, [End::at(source), End::at(listener)], None).into_iter().filter_map(path).collect())
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

    /// Edges that a way passes so near that they take some of it, and where, both ends seen from there: the nearest first, one
    /// of each obstacle, and none of that of the edge that the way bends at.
    fn near(&self, room: &Room, [from, to]: [End; 2], bends: Option<&Edge>) -> Vec<(&Edge, Pass)> {
        let way = (to.unfolded - from.unfolded).normalize_or_zero();
        let near = |edge| {
            let pass = Edge::passed(edge, from, to).filter(|pass| pass.detour_m < NEAR_M)?;
            let at = pass.at;
            // Between the leg's ends, and not where it bends.
            let passes = [at - from.seen, to.seen - at].iter().all(|part| part.dot(way) > 4.0 * self.off_m);
            let beside = self.beside(edge, at);
            let free = passes && self.free(room, from.seen, beside) && self.free(room, to.seen, beside);
            free.then_some((edge, pass))
        };
        let mut found: Vec<(&Edge, Pass)> = self.all.iter().filter_map(near).collect();
        found.sort_by(|a, b| a.1.detour_m.total_cmp(&b.1.detour_m));
        let mut kept: Vec<(&Edge, Pass)> = Vec::new();
        for (edge, pass) in found {
            if !kept.iter().map(|(kept, _)| *kept).chain(bends).any(|other| edge.shares_surface(other)) {
                kept.push((edge, pass));
            }
        }
        kept
    }

    /// Takes from amplitudes by octave what the edges take that a way passes in their light, which may bend at one.
    fn shade(&self, room: &Room, leg: [End; 2], bends: Option<&Edge>, gains: &mut Octaves) {
        for (_, pass) in self.near(room, leg, bends) {
            for (gain, hz) in gains.iter_mut().zip(OCTAVES_HZ) {
                *gain *= lit_gain(pass.detour_m, hz.into(), SPEED_OF_SOUND_M_S) as f32;
            }
        }
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

/// Edges that continue each other along a line as one.
fn joined(edges: Vec<Edge>, cell: f64) -> Vec<Edge> {
    let mut lines: HashMap<[i64; 9], Vec<Edge>> = HashMap::new();
    for edge in edges {
        // Moved by numbers that are no round ones, lest round coordinates lie between two cells.
        let rounded = |v: DVec3, cell: f64| (v / cell + 0.371_93).floor().to_array().map(|c| c as i64);
        let off = edge.start.reject_from_normalized(edge.along);
        let [along, first] = [edge.along, edge.first].map(|v| rounded(v, SAME_WEDGE));
        let key = [rounded(off, 10.0 * cell), along, first].concat();
        lines.entry(std::array::from_fn(|i| key[i])).or_default().push(edge);
    }
    let mut lines: Vec<_> = lines.into_iter().collect();
    lines.sort_unstable_by_key(|(key, _)| *key);
    let mut all: Vec<Edge> = Vec::new();
    for (_, mut edges) in lines {
        let along = edges[0].along;
        edges.sort_by(|a, b| a.start.dot(along).total_cmp(&b.start.dot(along)));
        let first = all.len();
        for edge in edges {
            match all[first..].last_mut() {
                Some(last)
                    if (edge.open - last.open).abs() < SAME_WEDGE
                        && edge.start.distance(last.at(last.length)) < 10.0 * cell =>
                {
                    last.length += edge.length;
                }
                _ => all.push(edge),
            }
        }
    }
    all
}
