//! From the world to the window and back: from above, and from anywhere.

use egui::{Pos2, Rect, Vec2, vec2};
use promenade_core::glam::{Vec2 as Flat, Vec3};

/// Nothing nearer to the eye than this is drawn, metres.
const NEAR_M: f32 = 0.05;
/// Least and greatest scale of the view from above, points per metre.
const SCALES: (f32, f32) = (2.0, 2000.0);
/// Least and greatest distance of the eye, metres.
const DISTANCES: (f32, f32) = (0.3, 400.0);
/// The eye does not go over the top or under the ground further than this, radians.
const STEEPEST: f32 = 1.55;
/// Points that a fitted view leaves free on every side.
const MARGIN: f32 = 52.0;

/// A point of the world as it is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Projected {
    /// Place in the window.
    pub(crate) at: Pos2,
    /// Distance from the eye, metres; from above, the negated height.
    pub(crate) depth: f32,
    /// Points per metre there.
    pub(crate) scale: f32,
}

/// From above: x goes up, y to the left, as for a head that faces x.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Plan {
    /// What is in the middle, metres along x and y.
    pub(crate) centre: Flat,
    /// Points per metre.
    pub(crate) scale: f32,
}

/// From anywhere, in perspective.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Orbit {
    /// What is in the middle, metres.
    pub(crate) target: Vec3,
    /// Direction from there to the eye about z, radians.
    pub(crate) azimuth: f32,
    /// Angle of the eye above the horizon, radians.
    pub(crate) elevation: f32,
    /// Metres from there to the eye.
    pub(crate) distance: f32,
}

/// A way to look at the place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Camera {
    /// From above.
    Plan(Plan),
    /// From anywhere.
    Orbit(Orbit),
}

impl Default for Plan {
    fn default() -> Self {
        Self { centre: Flat::ZERO, scale: 80.0 }
    }
}

impl Default for Orbit {
    fn default() -> Self {
        // From behind a listener who faces x, above the right shoulder.
        Self { target: Vec3::ZERO, azimuth: -2.6, elevation: 0.55, distance: 6.0 }
    }
}

impl Orbit {
    fn eye(&self) -> Vec3 {
        let (sin_a, cos_a) = self.azimuth.sin_cos();
        let (sin_e, cos_e) = self.elevation.sin_cos();
        self.target + self.distance * Vec3::new(cos_e * cos_a, cos_e * sin_a, sin_e)
    }

    /// Right, up and ahead of the eye.
    fn axes(&self) -> [Vec3; 3] {
        let ahead = (self.target - self.eye()).normalize_or(Vec3::X);
        let right = ahead.cross(Vec3::Z).normalize_or(Vec3::NEG_Y);
        [right, right.cross(ahead), ahead]
    }
}

/// Points from the eye to the picture.
fn focal(rect: Rect) -> f32 {
    1.2 * rect.height().min(rect.width()).max(1.0)
}

impl Camera {
    /// A point of the world in a window; `None` behind the eye.
    pub(crate) fn project(&self, rect: Rect, world: Vec3) -> Option<Projected> {
        match self {
            Self::Plan(plan) => {
                let from = world.truncate() - plan.centre;
                let at = rect.center() + plan.scale * vec2(-from.y, -from.x);
                Some(Projected { at, depth: -world.z, scale: plan.scale })
            }
            Self::Orbit(orbit) => {
                let [right, up, ahead] = orbit.axes();
                let from = world - orbit.eye();
                let depth = from.dot(ahead);
                let scale = focal(rect) / depth;
                let at = rect.center() + scale * vec2(from.dot(right), -from.dot(up));
                (depth >= NEAR_M).then_some(Projected { at, depth, scale })
            }
        }
    }

    /// The part of a line that is before the eye.
    pub(crate) fn segment(&self, rect: Rect, a: Vec3, b: Vec3) -> Option<[Projected; 2]> {
        if let Self::Orbit(orbit) = self {
            let ahead = orbit.axes()[2];
            let depth = |p: Vec3| (p - orbit.eye()).dot(ahead);
            let (da, db) = (depth(a), depth(b));
            let cut = |from: Vec3, to: Vec3, d: f32, e: f32| from.lerp(to, (NEAR_M * 1.01 - d) / (e - d));
            let ends = match (da >= NEAR_M, db >= NEAR_M) {
                (true, true) => (a, b),
                (false, false) => return None,
                (true, false) => (a, cut(b, a, db, da)),
                (false, true) => (cut(a, b, da, db), b),
            };
            return Some([self.project(rect, ends.0)?, self.project(rect, ends.1)?]);
        }
        Some([self.project(rect, a)?, self.project(rect, b)?])
    }

    /// Where the eye is and which way it looks at a place of the window.
    fn ray(&self, rect: Rect, at: Pos2) -> (Vec3, Vec3) {
        let from = at - rect.center();
        match self {
            Self::Plan(plan) => {
                let flat = plan.centre + Flat::new(-from.y, -from.x) / plan.scale;
                (flat.extend(0.0), Vec3::NEG_Z)
            }
            Self::Orbit(orbit) => {
                let [right, up, ahead] = orbit.axes();
                (orbit.eye(), (ahead * focal(rect) + right * from.x - up * from.y).normalize())
            }
        }
    }

    /// The point at a height that is seen at a place of the window; `None` above the horizon.
    pub(crate) fn on_level(&self, rect: Rect, at: Pos2, height_m: f32) -> Option<Vec3> {
        let (eye, ray) = self.ray(rect, at);
        if matches!(self, Self::Plan(_)) {
            return Some(eye.truncate().extend(height_m));
        }
        let along = (height_m - eye.z) / ray.z;
        // Near the horizon a point is a step from the next village.
        (along.is_finite() && along > 0.0 && along < DISTANCES.1).then(|| eye + along * ray)
    }

    /// Metres up for a move of the pointer from one place to another, at a point of the world.
    pub(crate) fn rise(&self, rect: Rect, world: Vec3, from: Pos2, to: Pos2) -> f32 {
        let scale = self.project(rect, world).map_or(f32::INFINITY, |seen| seen.scale);
        let foreshortening = match self {
            Self::Plan(_) => 1.0,
            // An upright metre is foreshortened; from straight above it would be a point.
            Self::Orbit(orbit) => orbit.elevation.cos().max(0.2),
        };
        (from.y - to.y) / (scale * foreshortening)
    }

    /// Moves what is seen with the pointer.
    pub(crate) fn pan(&mut self, rect: Rect, by: Vec2) {
        match self {
            Self::Plan(plan) => plan.centre += Flat::new(by.y, by.x) / plan.scale,
            Self::Orbit(orbit) => {
                let [right, up, _] = orbit.axes();
                orbit.target += (up * by.y - right * by.x) * (orbit.distance / focal(rect));
            }
        }
    }

    /// Goes round what is in the middle; from above there is nothing to go round.
    pub(crate) fn turn(&mut self, by: Vec2) {
        if let Self::Orbit(orbit) = self {
            orbit.azimuth = (orbit.azimuth - by.x * 0.008).rem_euclid(std::f32::consts::TAU);
            orbit.elevation = (orbit.elevation + by.y * 0.008).clamp(-0.2, STEEPEST);
        }
    }

    /// Comes `factor` times as close, with what is at a place of the window staying there.
    pub(crate) fn zoom(&mut self, rect: Rect, at: Pos2, factor: f32) {
        match self {
            Self::Plan(plan) => {
                let offset = at - rect.center();
                let held = Flat::new(-offset.y, -offset.x);
                let before = held / plan.scale;
                plan.scale = (plan.scale * factor).clamp(SCALES.0, SCALES.1);
                plan.centre += before - held / plan.scale;
            }
            Self::Orbit(orbit) => orbit.distance = (orbit.distance / factor).clamp(DISTANCES.0, DISTANCES.1),
        }
    }

    /// Shows a box of the world as large as fits.
    pub(crate) fn fit(&mut self, rect: Rect, low: Vec3, high: Vec3) {
        let (size, middle) = (high - low, (low + high) / 2.0);
        let room = (rect.size() - Vec2::splat(2.0 * MARGIN)).max(Vec2::splat(MARGIN));
        match self {
            Self::Plan(plan) => {
                plan.centre = middle.truncate();
                plan.scale = (room.x / size.y.max(0.1)).min(room.y / size.x.max(0.1)).clamp(SCALES.0, SCALES.1);
            }
            Self::Orbit(orbit) => {
                let usual = Orbit::default();
                let radius = (size.length() / 2.0).max(0.1);
                // A ball of that radius fills the room when it is seen under this angle.
                let distance = radius * (1.0 + (2.0 * focal(rect) / room.min_elem()).powi(2)).sqrt();
                *orbit = Orbit { target: middle, distance: distance.clamp(DISTANCES.0, DISTANCES.1) * 0.92, ..usual };
            }
        }
    }

    /// The world's direction, along x or y, that is nearest to up in the window.
    pub(crate) fn up(&self) -> Flat {
        match self {
            Self::Plan(_) => Flat::X,
            Self::Orbit(orbit) => {
                let ahead = -Flat::from_angle(orbit.azimuth);
                if ahead.x.abs() >= ahead.y.abs() { Flat::new(ahead.x.signum(), 0.0) } else { Flat::new(0.0, ahead.y.signum()) }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::pos2;

    fn window() -> Rect {
        Rect::from_min_size(pos2(100.0, 50.0), vec2(640.0, 480.0))
    }

    fn cameras() -> [Camera; 4] {
        let orbit = Orbit::default();
        [
            Camera::Plan(Plan::default()),
            Camera::Plan(Plan { centre: Flat::new(3.0, -2.0), scale: 33.0 }),
            Camera::Orbit(orbit),
            Camera::Orbit(Orbit { target: Vec3::new(1.0, 2.0, 1.0), azimuth: 1.0, elevation: 1.2, distance: 9.0 }),
        ]
    }

    #[test]
    fn from_above_x_goes_up_and_y_to_the_left() {
        let camera = Camera::Plan(Plan::default());
        let at = |p| camera.project(window(), p).unwrap().at - window().center();
        assert_eq!(at(Vec3::X), vec2(0.0, -80.0));
        assert_eq!(at(Vec3::Y), vec2(-80.0, 0.0));
        assert!(camera.project(window(), Vec3::Z).unwrap().depth < camera.project(window(), Vec3::ZERO).unwrap().depth);
    }

    #[test]
    fn in_space_up_is_up_and_y_is_left_of_an_eye_behind() {
        let camera = Camera::Orbit(Orbit { azimuth: std::f32::consts::PI, ..Orbit::default() });
        let at = |p| camera.project(window(), p).unwrap().at - window().center();
        assert!(at(Vec3::Z).y < -10.0 && at(Vec3::Z).x.abs() < 1e-3);
        assert!(at(Vec3::Y).x < -10.0);
        assert!(camera.project(window(), Vec3::X).unwrap().depth > camera.project(window(), Vec3::NEG_X).unwrap().depth);
    }

    #[test]
    fn what_is_seen_at_a_place_is_projected_there() {
        for camera in cameras() {
            for world in [Vec3::ZERO, Vec3::new(1.0, -0.5, 0.7), Vec3::new(-1.2, 2.0, -0.3)] {
                let seen = camera.project(window(), world).unwrap();
                let back = camera.on_level(window(), seen.at, world.z).unwrap();
                assert!((back - world).length() < 1e-3, "{camera:?}: {world} comes back as {back}");
            }
        }
    }

    #[test]
    fn what_is_under_the_pointer_stays_there_when_zooming_from_above() {
        let mut camera = cameras()[1];
        let at = pos2(200.0, 300.0);
        let before = camera.on_level(window(), at, 0.0).unwrap();
        camera.zoom(window(), at, 1.7);
        assert!((camera.on_level(window(), at, 0.0).unwrap() - before).length() < 1e-4);
    }

    #[test]
    fn panning_moves_the_picture_with_the_pointer() {
        for mut camera in cameras() {
            let target = match camera {
                Camera::Plan(plan) => plan.centre.extend(0.0),
                Camera::Orbit(orbit) => orbit.target,
            };
            camera.pan(window(), vec2(30.0, -20.0));
            let moved = camera.project(window(), target).unwrap().at - window().center();
            assert!((moved - vec2(30.0, -20.0)).length() < 0.5, "{camera:?}: {moved:?}");
        }
    }

    #[test]
    fn a_fitted_box_is_in_the_window_and_fills_it() {
        let (low, high) = (Vec3::new(-2.2, -1.6, 1.1), Vec3::new(0.8, 1.6, 1.8));
        for mut camera in cameras() {
            camera.fit(window(), low, high);
            let mut seen = Rect::NOTHING;
            for corner in 0..8 {
                let pick = |bit: usize, low: f32, high: f32| if corner >> bit & 1 == 0 { low } else { high };
                let world = Vec3::new(pick(0, low.x, high.x), pick(1, low.y, high.y), pick(2, low.z, high.z));
                seen.extend_with(camera.project(window(), world).unwrap().at);
            }
            assert!(window().contains_rect(seen), "{camera:?}: {seen:?}");
            assert!(seen.width() > 0.4 * window().width() || seen.height() > 0.4 * window().height(), "{camera:?}: {seen:?}");
        }
    }

    #[test]
    fn a_line_through_the_eye_is_cut_before_it() {
        let camera = cameras()[2];
        let Camera::Orbit(orbit) = camera else { unreachable!() };
        let behind = orbit.eye() + (orbit.eye() - orbit.target);
        let [a, b] = camera.segment(window(), orbit.target, behind).unwrap();
        assert!(a.depth > 1.0 && b.depth >= NEAR_M && b.depth < 2.0 * NEAR_M);
        assert!(camera.segment(window(), behind, behind + Vec3::Z * 0.1).is_none());
    }

    #[test]
    fn lifting_follows_the_pointer() {
        for camera in cameras() {
            let world = Vec3::new(0.3, 0.2, 0.1);
            let from = camera.project(window(), world).unwrap().at;
            let rise = camera.rise(window(), world, from, from - vec2(0.0, 25.0));
            assert!(rise > 0.05, "{camera:?}: {rise}");
        }
    }
}
