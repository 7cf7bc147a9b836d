//! Directions that beams have gone.

use glam::DVec3;

/// Directions within an angle of an axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cone {
    /// Unit length.
    axis: DVec3,
    /// Half angle, radians; of pi or more is everywhere.
    half_angle: f64,
}

impl Cone {
    pub(super) const EVERYWHERE: Self = Self { axis: DVec3::Z, half_angle: f64::INFINITY };

    pub(super) fn new(axis: DVec3, half_angle: f64) -> Self {
        Self { axis: axis.try_normalize().unwrap_or(DVec3::Z), half_angle }
    }

    /// One about the same axis; everywhere stays everywhere.
    pub(super) fn wide(&self, half_angle: f64) -> Self {
        Self { half_angle: self.half_angle.max(half_angle), ..*self }
    }

    /// The cosine of the angle between the axis and a direction of unit length.
    pub(super) fn along(&self, direction: DVec3) -> f64 {
        self.axis.dot(direction)
    }

    pub(super) fn holds(&self, way: DVec3) -> bool {
        self.half_angle >= std::f64::consts::PI || self.axis.dot(way) >= self.half_angle.cos() * way.length()
    }

    /// One that holds both.
    pub(super) fn with(&self, other: &Self) -> Self {
        if self.half_angle.max(other.half_angle) >= std::f64::consts::PI {
            return Self::EVERYWHERE;
        }
        let middle = Self::new(self.axis + other.axis, 0.0);
        let reach = |cone: &Self| middle.along(cone.axis).clamp(-1.0, 1.0).acos() + cone.half_angle;
        Self { half_angle: reach(self).max(reach(other)), ..middle }
    }
}
