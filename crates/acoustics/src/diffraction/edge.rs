//! One edge, and how sound passes it.

use super::path::DiffractionPath;
use crate::octave::Octaves;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// What is flat to a hundredth of a degree is no edge, radians.
const FLAT: f64 = 2e-4;
/// Nearer than this to the border of a shadow, radians, a place may be on either side of it, or on a surface.
const BORDER: f64 = 1e-3;
/// Directions are the same when the cosine of the angle between them is nearer to 1 than this.
const PARALLEL: f64 = 1e-6;

/// An edge that sound can go round.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge {
    pub(super) start: DVec3,
    /// Unit length.
    pub(super) along: DVec3,
    pub(super) length: f64,
    /// Unit vectors across the edge: along the surface that the open space begins at, and from it into the open space.
    pub(super) first: DVec3,
    up: DVec3,
    /// Angle of the open space, more than pi, radians.
    pub(super) open: f64,
}

/// A place that sound seems to come from or go to, and where the last leg of its way there begins or ends.
#[derive(Clone, Copy)]
pub(super) struct End {
    pub(super) unfolded: DVec3,
    pub(super) seen: DVec3,
}

impl End {
    pub(super) fn at(place: DVec3) -> Self {
        Self { unfolded: place, seen: place }
    }
}

/// How the shortest way over an edge goes from one place to another.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pass {
    /// Where it passes the edge, metres.
    pub(super) at: DVec3,
    /// How much longer it is than the straight way, metres.
    pub(super) detour_m: f64,
    /// Whether the edge hides one place from the other, or does so within rounding.
    pub(super) hidden: bool,
}

impl Edge {
    /// The edge between two ends of surfaces through each corner, if more than half of the space about it is open.
    pub(super) fn of([start, end]: [DVec3; 2], corners: &[DVec3]) -> Option<Self> {
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
        (open > PI + FLAT).then_some(edge)
    }

    /// Along the edge, away from it and the angle from the first surface, 0 to 2 pi.
    fn cylinder(&self, point: DVec3) -> (f64, f64, f64) {
        let (x, y) = ((point - self.start).dot(self.first), (point - self.start).dot(self.up));
        ((point - self.start).dot(self.along), x.hypot(y), y.atan2(x).rem_euclid(TAU))
    }

    /// The shortest way from one place to another over the edge, if it passes between its ends and both places are in the open:
    /// both sides of the edge unfolded into a plane, it is straight.
    pub(super) fn passed(&self, from: End, to: End) -> Option<Pass> {
        let in_the_open = |point: DVec3| {
            let (_, _, angle) = self.cylinder(point);
            let angle = if angle > TAU - BORDER { 0.0 } else { angle };
            (angle < self.open + BORDER).then_some(angle)
        };
        let turn = (in_the_open(from.seen)? - in_the_open(to.seen)?).abs();
        let [from, to] = [from, to].map(|end| end.unfolded);
        let at = self.pass(from, to);
        if !(0.0..=self.length).contains(&at) {
            return None;
        }
        let at = self.at(at);
        let detour_m = (from.distance(at) + at.distance(to) - from.distance(to)).max(0.0);
        Some(Pass { at, detour_m, hidden: turn > PI - BORDER })
    }

    /// How far along the edge's line the shortest path passes it, metres from its start.
    pub(super) fn pass(&self, from: DVec3, to: DVec3) -> f64 {
        let ((z, r, _), (other_z, other_r, _)) = (self.cylinder(from), self.cylinder(to));
        z + (other_z - z) * r / (r + other_r)
    }

    pub(super) fn at(&self, along_m: f64) -> DVec3 {
        self.start + along_m * self.along
    }

    /// The path of sound that comes from somewhere with gains, on a way longer than the straight one by some metres, and passes
    /// the edge at a place, of which a listener who sees past the edge hears what it takes away.
    pub(super) fn path(
        &self,
        [from, at, listener]: [DVec3; 3],
        longer_m: f64,
        gains: Octaves,
        lit: bool,
    ) -> Option<DiffractionPath> {
        let path_m = from.distance(at) + at.distance(listener) + longer_m;
        let direct_m = from.distance(listener);
        Some(DiffractionPath {
            position: (listener + (at - listener).try_normalize()? * path_m).to_array(),
            path_m,
            detour_m: (path_m - direct_m).max(0.0),
            direct_m,
            from: from.to_array(),
            longer_m,
            gains,
            edge: [self.start, self.start + self.length * self.along].map(|end| end.to_array()),
            lit,
        })
    }

    /// Whether one flat surface lies between both, as the reveal of a doorway: an obstacle as thick as that.
    pub(super) fn shares_surface(&self, other: &Self) -> bool {
        if self.along.dot(other.along).abs() < 1.0 - PARALLEL {
            return false;
        }
        let Some(across) = (other.start - self.start).reject_from_normalized(self.along).try_normalize() else { return false };
        let has = |edge: &Self, way: DVec3| {
            let (sine, cosine) = edge.open.sin_cos();
            [edge.first, cosine * edge.first + sine * edge.up].iter().any(|surface| surface.dot(way) > 1.0 - PARALLEL)
        };
        has(self, across) && has(other, -across)
    }

    /// Into the middle of the open space.
    pub(super) fn outward(&self) -> DVec3 {
        let (sine, cosine) = (0.5 * self.open).sin_cos();
        cosine * self.first + sine * self.up
    }
}
