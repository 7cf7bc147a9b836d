//! One edge, and where sound passes it.

use super::path::DiffractionPath;
use crate::octave::Octaves;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// An edge that sound can go round.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge {
    start: DVec3,
    /// Unit length.
    along: DVec3,
    pub(super) length: f64,
    /// Unit vectors across the edge: along the surface that the open space begins at, and from it into the open space.
    first: DVec3,
    up: DVec3,
    /// Angle of the open space, more than pi, radians.
    open: f64,
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
        // What is flat to a hundredth of a degree is no edge.
        (open > PI + 2e-4).then_some(edge)
    }

    /// Along the edge, away from it and the angle from the first surface, 0 to 2 pi.
    fn cylinder(&self, point: DVec3) -> (f64, f64, f64) {
        let (x, y) = ((point - self.start).dot(self.first), (point - self.start).dot(self.up));
        ((point - self.start).dot(self.along), x.hypot(y), y.atan2(x).rem_euclid(TAU))
    }

    /// The point of the edge that the shortest path from one place to another in its shadow goes through: both sides of the
    /// edge unfolded into a plane, it is straight.
    pub(super) fn bend(&self, from: DVec3, to: DVec3) -> Option<DVec3> {
        let ((_, _, angle), (_, _, other_angle)) = (self.cylinder(from), self.cylinder(to));
        let hidden = angle.max(other_angle) < self.open && (angle - other_angle).abs() > PI;
        let at = self.pass(from, to);
        (hidden && (0.0..=self.length).contains(&at)).then(|| self.at(at))
    }

    /// How far along the edge's line the shortest path passes it, metres from its start.
    pub(super) fn pass(&self, from: DVec3, to: DVec3) -> f64 {
        let ((z, r, _), (other_z, other_r, _)) = (self.cylinder(from), self.cylinder(to));
        z + (other_z - z) * r / (r + other_r)
    }

    pub(super) fn at(&self, along_m: f64) -> DVec3 {
        self.start + along_m * self.along
    }

    /// The path of sound that comes from somewhere with gains and passes the edge at a place.
    pub(super) fn path(&self, from: DVec3, at: DVec3, listener: DVec3, gains: Octaves) -> Option<DiffractionPath> {
        let path_m = from.distance(at) + at.distance(listener);
        let direct_m = from.distance(listener);
        Some(DiffractionPath {
            position: (listener + (at - listener).try_normalize()? * path_m).to_array(),
            path_m,
            detour_m: path_m - direct_m,
            direct_m,
            from: from.to_array(),
            gains,
            edge: self.ends(),
        })
    }

    fn ends(&self) -> [[f64; 3]; 2] {
        [self.start, self.start + self.length * self.along].map(|end| end.to_array())
    }

    /// Into the middle of the open space.
    pub(super) fn outward(&self) -> DVec3 {
        let (sine, cosine) = (0.5 * self.open).sin_cos();
        cosine * self.first + sine * self.up
    }
}
