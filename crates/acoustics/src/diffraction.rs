//! Sound that goes round edges to where its source is hidden.

mod bent;

pub use bent::Lit;

use crate::SPEED_OF_SOUND_M_S;
use crate::directivity::Source;
use crate::error::{AcousticsError, place};
use crate::mesh::{Mesh, normal};
use crate::octave::{OCTAVES_HZ, Octaves, octave_energy};
use crate::room::{NOWHERE, Room};
use glam::DVec3;
use promenade_core::barrier_db;
use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

/// Corners nearer to each other than this share of the mesh's diagonal are one.
const WELD: f64 = 1e-5;
/// How far off its edge a way passes, as a share of the mesh's diagonal: single precision cannot tell less from the wall.
const OFF: f64 = 2e-5;

/// Edges of a mesh that sound can go round: where surfaces leave more than half of the space about them open.
#[derive(Clone, Debug)]
pub struct Edges {
    all: Vec<Edge>,
    off_m: f64,
}

#[derive(Clone, Copy, Debug)]
struct Edge {
    start: DVec3,
    /// Unit length.
    along: DVec3,
    length: f64,
    /// Unit vectors across the edge: along the surface that the open space begins at, and from it into the open space.
    first: DVec3,
    up: DVec3,
    /// Angle of the open space, more than pi, radians.
    open: f64,
}

/// Sound round an edge, as a listener hears it: of the source, of one of its images, or of what came round another edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiffractionPath {
    /// Where it seems to come from, metres: behind the edge, as far away as its way is long.
    pub position: [f64; 3],
    /// Its way, metres.
    pub path_m: f64,
    /// How much longer than the straight way that is, metres.
    pub detour_m: f64,
    /// Straight way to where it comes from, metres.
    pub direct_m: f64,
    /// Where the sound that reaches the edge comes from, metres: the source, its image, or behind another edge, as far away
    /// as the way is long.
    pub from: [f64; 3],
    /// What the source sends towards the edge, over what it sends on its axis, and what walls and an edge on the way leave of
    /// it: amplitudes by octave.
    pub sent: Octaves,
    /// Ends of the edge.
    pub edge: [[f64; 3]; 2],
}

impl DiffractionPath {
    /// Amplitude against a source seen at 1 m on its axis, without air, at a frequency.
    #[must_use]
    pub fn amplitude(&self, hz: f64) -> f64 {
        let sent = octave_energy(&self.sent.map(|a| f64::from(a).powi(2)), hz).sqrt();
        sent * 10.0_f64.powf(-barrier_db(self.detour_m, hz, SPEED_OF_SOUND_M_S) / 20.0) / self.direct_m
    }

    /// The same by octave.
    #[must_use]
    pub fn amplitudes(&self) -> Octaves {
        OCTAVES_HZ.map(|hz| self.amplitude(hz.into()) as f32)
    }
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

    /// The ways from a source to a listener in its shadow round one edge each, the shortest first.
    ///
    /// # Errors
    /// A source or a listener that is not finite.
    pub fn around(
        &self,
        room: &Room,
        source: impl Into<Source>,
        listener: [f64; 3],
    ) -> Result<Vec<DiffractionPath>, AcousticsError> {
        let Source { position, directivity } = source.into();
        let (source, listener) = (place("source", position)?, place("listener", listener)?);
        let around = |edge: &Edge| {
            let at = edge.bend(source, listener)?;
            let beside = self.beside(edge, at);
            if !self.free(room, source, beside) || !self.free(room, listener, beside) {
                return None;
            }
            edge.way(source, at, listener, directivity.towards((at - source).to_array()))
        };
        let mut found: Vec<DiffractionPath> = self.all.iter().filter_map(around).collect();
        self.distinct(&mut found);
        Ok(found)
    }

    /// The same, and round two edges where there is no way round one.
    ///
    /// # Errors
    /// As [`Edges::around`].
    pub fn around_any(
        &self,
        room: &Room,
        source: impl Into<Source>,
        listener: [f64; 3],
    ) -> Result<Vec<DiffractionPath>, AcousticsError> {
        let source = source.into();
        let found = self.around(room, &source, listener)?;
        if found.is_empty() { self.around_two(room, &source, listener) } else { Ok(found) }
    }

    /// Sorts ways by their length; one through the common end of two edges is one.
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

impl Edge {
    /// The edge between two ends of surfaces through each corner, if more than half of the space about it is open.
    fn of([start, end]: [DVec3; 2], corners: &[DVec3]) -> Option<Self> {
        let along = (end - start).try_normalize()?;
        let across = |corner: &DVec3| (*corner - start).reject_from_normalized(along).try_normalize();
        let sides: Vec<DVec3> = corners.iter().filter_map(across).collect();
        let x = *sides.first()?;
        let y = along.cross(x);
        let mut angles: Vec<f64> = sides.iter().map(|s| s.dot(y).atan2(s.dot(x)).rem_euclid(TAU)).collect();
        angles.sort_by(f64::total_cmp);
        let next = |i: usize| if i + 1 < angles.len() { angles[i + 1] } else { angles[0] + TAU };
        let gaps = (0..angles.len()).map(|i| (next(i) - angles[i], angles[i]));
        let (open, begin) = gaps.max_by(|a, b| a.0.total_cmp(&b.0))?;
        let turned = |angle: f64| angle.cos() * x + angle.sin() * y;
        let edge = Self { start, along, length: start.distance(end), first: turned(begin), up: turned(begin + 0.5 * PI), open };
        // What is flat to a hundredth of a degree is no edge.
        (open > PI + 2e-4).then_some(edge)
    }

    /// Along the edge, away from it and the angle from the first surface, 0 to 2 pi.
    fn cylinder(&self, point: DVec3) -> (f64, f64, f64) {
        let (x, y) = ((point - self.start).dot(self.first), (point - self.start).dot(self.up));
        ((point - self.start).dot(self.along), x.hypot(y), y.atan2(x).rem_euclid(TAU))
    }

    /// The point of the edge that the shortest way from one place to another in its shadow goes through: both sides of the edge
    /// unfolded into a plane, it is straight.
    fn bend(&self, from: DVec3, to: DVec3) -> Option<DVec3> {
        let ((_, _, angle), (_, _, other_angle)) = (self.cylinder(from), self.cylinder(to));
        let hidden = angle.max(other_angle) < self.open && (angle - other_angle).abs() > PI;
        let at = self.pass(from, to);
        (hidden && (0.0..=self.length).contains(&at)).then(|| self.at(at))
    }

    /// How far along the edge's line the shortest way passes it, metres from its start.
    fn pass(&self, from: DVec3, to: DVec3) -> f64 {
        let ((z, r, _), (other_z, other_r, _)) = (self.cylinder(from), self.cylinder(to));
        z + (other_z - z) * r / (r + other_r)
    }

    fn at(&self, along_m: f64) -> DVec3 {
        self.start + along_m * self.along
    }

    /// The way of sound that comes from somewhere and passes the edge at a place.
    fn way(&self, from: DVec3, at: DVec3, listener: DVec3, sent: Octaves) -> Option<DiffractionPath> {
        let path_m = from.distance(at) + at.distance(listener);
        let direct_m = from.distance(listener);
        Some(DiffractionPath {
            position: (listener + (at - listener).try_normalize()? * path_m).to_array(),
            path_m,
            detour_m: path_m - direct_m,
            direct_m,
            from: from.to_array(),
            sent,
            edge: self.ends(),
        })
    }

    fn ends(&self) -> [[f64; 3]; 2] {
        [self.start, self.start + self.length * self.along].map(|end| end.to_array())
    }

    /// Into the middle of the open space.
    fn outward(&self) -> DVec3 {
        let (sine, cosine) = (0.5 * self.open).sin_cos();
        cosine * self.first + sine * self.up
    }
}
