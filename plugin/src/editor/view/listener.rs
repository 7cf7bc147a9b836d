//! Draws the listener.

use super::camera::{Camera, Projected};
use super::{super::ctx::Ctx, super::theme::faded, layers::Layers, scene::stem};
use egui::epaint::{Mesh, PathShape};
use egui::{Color32, Pos2, Shape, Stroke, Vec2, vec2};
use promenade_core::Pose;
use promenade_core::glam::Vec3;

/// Half the width of a head, metres.
const RADIUS_M: f32 = 0.09;
/// Least and greatest radius of the head in the window, points.
const RADII: (f32, f32) = (9.0, 26.0);
/// Half the angle of the wedge that shows where the head faces, radians.
const HALF_WEDGE: f32 = 0.6;
/// Length of the wedge, in radii of the head.
const WEDGE: f32 = 5.0;

/// Radius of a head in the window, points.
pub(super) fn radius(seen: Projected) -> f32 {
    (seen.scale * RADIUS_M).clamp(RADII.0, RADII.1)
}

/// Where the point of the nose's handle is, by which the head is turned.
pub(super) fn nose(project: impl Fn(Vec3) -> Option<Projected>, pose: &Pose) -> Option<Pos2> {
    let seen = project(pose.position)?;
    let length = radius(seen) * (WEDGE - 1.0) / seen.scale;
    project(pose.position + pose.orientation * Vec3::X * length).map(|tip| tip.at)
}

/// The listener that is heard.
pub(super) fn listener(layers: &mut Layers<'_>, ctx: &Ctx<'_>, pose: &Pose, hot: bool) {
    let colour = ctx.palette.accent;
    let Some(seen) = layers.project(pose.position) else { return };
    let radius = radius(seen);
    stem(layers, pose.position, faded(colour, 0.5));
    match layers.camera {
        Camera::Plan(_) => wedge(layers, seen, pose, radius, colour),
        Camera::Orbit(_) => frustum(layers, seen, pose, radius, colour),
    }
    if hot {
        layers.add(seen.depth, Shape::circle_filled(seen.at, radius + 7.0, faded(colour, 0.2)));
    }
    skull(layers, ctx, seen, pose, radius, colour);
}

/// The knobs' listener while something else moves the one that is heard.
pub(super) fn ghost(layers: &mut Layers<'_>, ctx: &Ctx<'_>, pose: &Pose, hot: bool) {
    let colour = ctx.palette.soft;
    let Some(seen) = layers.project(pose.position) else { return };
    let radius = radius(seen);
    stem(layers, pose.position, faded(colour, 0.4));
    let fill = faded(colour, if hot { 0.25 } else { 0.08 });
    let circle = (0..=32).map(|n| seen.at + radius * Vec2::angled(n as f32 / 32.0 * std::f32::consts::TAU)).collect::<Vec<_>>();
    layers.add(seen.depth, Shape::circle_filled(seen.at, radius, fill));
    layers.add(seen.depth, Shape::Vec(Shape::dashed_line(&circle, Stroke::new(1.25, colour), 3.0, 3.0)));
    let ahead = pose.orientation * Vec3::X * (radius * 2.2 / seen.scale);
    layers.line(pose.position, pose.position + ahead, Stroke::new(1.25, colour));
}

/// Head, nose and both ears in the ears' colours.
fn skull(layers: &mut Layers<'_>, ctx: &Ctx<'_>, seen: Projected, pose: &Pose, radius: f32, colour: Color32) {
    let size = radius / seen.scale;
    let at = |head: Vec3| pose.position + pose.orientation * head * size;
    for (ear, side) in [(ctx.palette.left, 1.0), (ctx.palette.right, -1.0)] {
        layers.ball(at(Vec3::Y * side), radius * 0.34, ear, Stroke::new(1.0, ctx.palette.ground));
    }
    if let (Some(tip), Some(left), Some(right)) = (
        layers.project(at(Vec3::X * 1.5)),
        layers.project(at(Vec3::new(0.75, 0.55, 0.0))),
        layers.project(at(Vec3::new(0.75, -0.55, 0.0))),
    ) {
        layers.add(tip.depth, PathShape::convex_polygon(vec![tip.at, left.at, right.at], colour, Stroke::NONE));
    }
    layers.ball(pose.position, radius, colour, Stroke::new(1.5, ctx.palette.ground));
}

/// A fading sector where the head faces, for the view from above.
fn wedge(layers: &mut Layers<'_>, seen: Projected, pose: &Pose, radius: f32, colour: Color32) {
    let ahead = pose.orientation * Vec3::X;
    // From above, a head that looks up or down has a shorter wedge.
    let level = ahead.truncate().length();
    let middle = vec2(-ahead.y, -ahead.x).angle();
    let mut mesh = Mesh::default();
    mesh.colored_vertex(seen.at, faded(colour, 0.4));
    let steps = 16_u32;
    for n in 0..=steps {
        let angle = middle + HALF_WEDGE * (2.0 * n as f32 / steps as f32 - 1.0);
        mesh.colored_vertex(seen.at + radius * WEDGE * level.max(0.3) * Vec2::angled(angle), faded(colour, 0.02));
    }
    for n in 1..=steps {
        mesh.add_triangle(0, n, n + 1);
    }
    layers.add(seen.depth, Shape::mesh(mesh));
    let tip = seen.at + radius * (WEDGE - 1.0) * level.max(0.3) * Vec2::angled(middle);
    layers.add(seen.depth, Shape::line_segment([seen.at, tip], Stroke::new(1.5, faded(colour, 0.7))));
    layers.add(seen.depth, Shape::circle_filled(tip, 3.0, colour));
}

/// What the head has before it, for the view from anywhere.
fn frustum(layers: &mut Layers<'_>, seen: Projected, pose: &Pose, radius: f32, colour: Color32) {
    let length = radius * WEDGE / seen.scale;
    let at = |y: f32, z: f32| pose.position + pose.orientation * Vec3::new(1.0, y, z) * length;
    let corners = [at(0.55, 0.4), at(-0.55, 0.4), at(-0.55, -0.4), at(0.55, -0.4)];
    for (index, corner) in corners.iter().enumerate() {
        layers.line(pose.position, *corner, Stroke::new(1.0, faded(colour, 0.6)));
        layers.line(*corner, corners[(index + 1) % 4], Stroke::new(1.25, faded(colour, 0.85)));
    }
    if let [Some(a), Some(b), Some(c), Some(d)] = corners.map(|corner| layers.project(corner)) {
        let face = vec![a.at, b.at, c.at, d.at];
        let depth = (a.depth + b.depth + c.depth + d.depth) / 4.0;
        layers.add(depth, PathShape::convex_polygon(face, faded(colour, 0.1), Stroke::NONE));
    }
    // The upper edge, so that a head upside down is seen as one.
    layers.line(at(0.18, 0.4), at(0.0, 0.58), Stroke::new(1.25, faded(colour, 0.85)));
    layers.line(at(-0.18, 0.4), at(0.0, 0.58), Stroke::new(1.25, faded(colour, 0.85)));
}
