//! Shapes at their depth, painted from far to near.

use super::camera::{Camera, Projected};
use egui::epaint::CircleShape;
use egui::{Color32, Painter, Rect, Shape, Stroke};
use promenade_core::glam::Vec3;

/// What is to be painted.
pub(super) struct Layers<'a> {
    /// Where.
    pub(super) rect: Rect,
    /// Seen how.
    pub(super) camera: &'a Camera,
    shapes: Vec<(f32, Shape)>,
}

impl<'a> Layers<'a> {
    /// Nothing yet.
    pub(super) fn new(rect: Rect, camera: &'a Camera) -> Self {
        Self { rect, camera, shapes: Vec::new() }
    }

    /// A point as it is seen.
    pub(super) fn project(&self, world: Vec3) -> Option<Projected> {
        self.camera.project(self.rect, world)
    }

    /// A shape at a depth.
    pub(super) fn add(&mut self, depth: f32, shape: impl Into<Shape>) {
        self.shapes.push((depth, shape.into()));
    }

    /// A line through the world.
    pub(super) fn line(&mut self, a: Vec3, b: Vec3, stroke: Stroke) {
        if let Some([a, b]) = self.camera.segment(self.rect, a, b) {
            self.add((a.depth + b.depth) / 2.0, Shape::line_segment([a.at, b.at], stroke));
        }
    }

    /// A dashed line through the world.
    pub(super) fn dashes(&mut self, a: Vec3, b: Vec3, stroke: Stroke) {
        if let Some([a, b]) = self.camera.segment(self.rect, a, b)
            && (b.at - a.at).length() < 8000.0
        {
            let dashes = Shape::dashed_line(&[a.at, b.at], stroke, 4.0, 4.0);
            self.add((a.depth + b.depth) / 2.0, Shape::Vec(dashes));
        }
    }

    /// A ball of a size in points.
    pub(super) fn ball(&mut self, world: Vec3, radius: f32, fill: Color32, stroke: Stroke) {
        if let Some(seen) = self.project(world) {
            self.add(seen.depth, CircleShape { center: seen.at, radius, fill, stroke });
        }
    }

    /// Paints them, the farthest first.
    pub(super) fn paint(mut self, painter: &Painter) {
        self.shapes.sort_by(|a, b| b.0.total_cmp(&a.0));
        painter.extend(self.shapes.into_iter().map(|(_, shape)| shape));
    }
}

#[cfg(test)]
mod tests {
    use super::super::camera::Orbit;
    use super::*;
    use egui::{pos2, vec2};

    #[test]
    fn the_nearest_is_painted_last() {
        let camera = Camera::Orbit(Orbit::default());
        let mut layers = Layers::new(Rect::from_min_size(pos2(0.0, 0.0), vec2(400.0, 400.0)), &camera);
        for x in [1.0, -1.0, 0.0] {
            layers.ball(Vec3::X * x, 3.0, Color32::WHITE, Stroke::NONE);
        }
        let ctx = egui::Context::default();
        let painter = ctx.debug_painter();
        layers.paint(&painter);
        let mut centres = Vec::new();
        painter.for_each_shape(|clipped| {
            if let Shape::Circle(circle) = &clipped.shape {
                centres.push(circle.center);
            }
        });
        let at = |x: f32| camera.project(Rect::from_min_size(pos2(0.0, 0.0), vec2(400.0, 400.0)), Vec3::X * x).unwrap().at;
        // The eye is behind the origin, on the side of negative x.
        assert_eq!(centres, [at(1.0), at(0.0), at(-1.0)]);
    }
}
