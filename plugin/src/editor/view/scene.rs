//! Draws a scene: its bounds, anchors, measured poses and emitter; and the camera path.

use super::{super::ctx::Ctx, super::theme::faded, camera::Camera, ground::edges, layers::Layers};
use crate::parameter::cast::byte;
use crate::telemetry::attention::AttentionWeights;
use egui::{Color32, Shape, Stroke};
use promenade_core::glam::Vec3;
use promenade_core::{Anchor, CameraPath, Scene};

/// More anchors than this are thinned out evenly.
const MOST_ANCHORS: usize = 6000;
/// Pieces that the curve of a path is drawn in.
const PIECES: usize = 600;
/// Paths of more keyframes than this show only the selected one.
const MOST_KEYFRAMES: usize = 400;

/// The box in which the listener may stand, and where the measured poses were.
pub(super) fn bounds(layers: &mut Layers<'_>, ctx: &Ctx<'_>, scene: &Scene) {
    let (low, high) = scene.bounds();
    if low != high {
        let stroke = Stroke::new(1.0, faded(ctx.palette.soft, 0.7));
        for [a, b] in edges(low, high) {
            layers.dashes(a, b, stroke);
        }
    }
    let faint = faded(ctx.palette.soft, 0.35);
    for held_out in scene.held_out() {
        let (from, ahead) = (held_out.pose.position, held_out.pose.orientation * Vec3::X);
        let Some(seen) = layers.project(from) else { continue };
        // As long as 16 points wherever it is.
        layers.line(from, from + ahead * (16.0 / seen.scale), Stroke::new(1.0, faint));
        layers.ball(from, 2.0, faint, Stroke::NONE);
    }
}

/// Anchors in their colours; the more the decoder attends to one, the larger it is.
pub(super) fn anchors(layers: &mut Layers<'_>, ctx: &Ctx<'_>, scene: &Scene, attention: Option<&AttentionWeights>) {
    let all = scene.anchors();
    let attention = attention.filter(|attention| attention.weights.len() == all.len());
    let most = attention.map_or(1.0, |attention| attention.weights.iter().fold(f32::MIN_POSITIVE, |a, b| a.max(*b)));
    let outline = Stroke::new(0.75, faded(ctx.palette.ground, 0.8));
    for (index, Anchor { position, colour }) in all.iter().enumerate().step_by(all.len().div_ceil(MOST_ANCHORS).max(1)) {
        let [r, g, b] = colour.to_array().map(|v| byte(v * 255.0));
        // Towards grey, so that dark ones are seen on a dark ground and light ones on a light.
        let colour = Color32::from_rgb(r, g, b).lerp_to_gamma(ctx.palette.soft, 0.25);
        let share = attention.map_or(0.16, |attention| (attention.weights[index] / most).sqrt());
        layers.ball(*position, 2.0 + 7.0 * share, faded(colour, 0.7 + 0.3 * share), outline);
    }
}

/// The emitter: where the scene has it, and where it is moved to.
pub(super) fn emitter(layers: &mut Layers<'_>, ctx: &Ctx<'_>, home: Vec3, moved: Vec3, hot: bool) {
    let colour = if ctx.is_outside(moved) { ctx.palette.warn } else { ctx.source_colour(0) };
    if moved.distance(home) > 1e-3 {
        layers.dashes(home, moved, Stroke::new(1.0, faded(colour, 0.7)));
        layers.ball(home, 5.0, Color32::TRANSPARENT, Stroke::new(1.0, faded(colour, 0.7)));
    }
    stem(layers, moved, faded(colour, 0.45));
    let Some(seen) = layers.project(moved) else { return };
    if hot {
        layers.add(seen.depth, Shape::circle_filled(seen.at, 17.0, faded(colour, 0.16)));
    }
    layers.add(seen.depth, Shape::circle_filled(seen.at, 6.0, colour));
    for (radius, share) in [(10.0, 0.7), (14.0, 0.35)] {
        layers.add(seen.depth, Shape::circle_stroke(seen.at, radius, Stroke::new(1.5, faded(colour, share))));
    }
}

/// In space, a line from a thing down to the ground, by which its height can be seen.
pub(super) fn stem(layers: &mut Layers<'_>, world: Vec3, colour: Color32) {
    if matches!(layers.camera, Camera::Orbit(_)) && world.z.abs() > 0.02 {
        let foot = world.truncate().extend(0.0);
        layers.line(world, foot, Stroke::new(1.0, colour));
        layers.ball(foot, 2.0, colour, Stroke::NONE);
    }
}

/// The curve of a path and its keyframes in a colour. `selected` stands out.
pub(super) fn path(layers: &mut Layers<'_>, ctx: &Ctx<'_>, path: &CameraPath, colour: Color32, selected: Option<usize>) {
    let keyframes = path.keyframes();
    let (Some(first), Some(last)) = (keyframes.first(), keyframes.last()) else { return };
    let pieces = (keyframes.len() * 16).clamp(2, PIECES);
    let at = |n: usize| path.pose_at(first.t_s + (last.t_s - first.t_s) * n as f64 / pieces as f64).position;
    let mut from = at(0);
    for n in 1..=pieces {
        let to = at(n);
        layers.line(from, to, Stroke::new(2.0, faded(colour, 0.8)));
        from = to;
    }
    for (index, keyframe) in keyframes.iter().enumerate() {
        let chosen = selected == Some(index);
        if keyframes.len() > MOST_KEYFRAMES && !chosen {
            continue;
        }
        let (here, ahead) = (keyframe.pose.position, keyframe.pose.orientation * Vec3::X);
        let Some(seen) = layers.project(here) else { continue };
        let length = if chosen { 22.0 } else { 12.0 };
        layers.line(here, here + ahead * (length / seen.scale), Stroke::new(if chosen { 2.0 } else { 1.25 }, colour));
        if chosen {
            layers.ball(here, 9.0, faded(colour, 0.2), Stroke::new(1.5, colour));
        }
        layers.ball(here, if chosen { 5.0 } else { 3.5 }, colour, Stroke::new(1.0, ctx.palette.ground));
    }
}
