//! Further sources: where they are, and how they are drawn.

use super::super::ctx::Ctx;
use super::super::theme::faded;
use super::camera::Projected;
use super::drag::{Handle, Target};
use super::layers::Layers;
use super::scene::stem;
use egui::{Align2, Color32, FontId, Painter, Shape, Stroke};
use promenade_core::glam::Vec3;

/// Radius of one that is drawn, points.
const RADIUS: f32 = 7.0;

/// Where further sources are, beside an emitter at `home`.
pub(super) fn places(ctx: &Ctx<'_>, home: Vec3) -> Vec<Vec3> {
    (1..=ctx.params().further()).map(|source| ctx.source_at(home, source)).collect()
}

/// What can be taken hold of. Of two that lie upon each other the chosen one is.
pub(super) fn targets(ctx: &Ctx<'_>, places: &[Vec3], project: impl Fn(Vec3) -> Option<Projected>) -> Vec<Target> {
    let target = |(further, at): (usize, &Vec3)| Some((Handle::Source(further), project(*at)?.at, RADIUS));
    let mut all: Vec<_> = places.iter().enumerate().filter_map(target).collect();
    all.sort_by_key(|(handle, ..)| !is_chosen(ctx, *handle));
    all
}

fn is_chosen(ctx: &Ctx<'_>, handle: Handle) -> bool {
    matches!(handle, Handle::Source(further) if ctx.selection.source == further + 1)
}

/// Draws one: filled where it was heard of late, else a ring, with its number.
pub(super) fn paint(layers: &mut Layers<'_>, painter: &Painter, ctx: &Ctx<'_>, further: usize, at: Vec3, hot: bool) {
    let colour = ctx.palette.emitter;
    let sounds = ctx.frame.sounding & (1 << further) != 0;
    stem(layers, at, faded(colour, 0.3));
    let Some(seen) = layers.project(at) else { return };
    if hot || is_chosen(ctx, Handle::Source(further)) {
        layers.add(seen.depth, Shape::circle_filled(seen.at, 2.0 * RADIUS, faded(colour, 0.2)));
    }
    let fill = if sounds { colour } else { ctx.palette.ground };
    layers.add(seen.depth, Shape::circle_filled(seen.at, RADIUS, fill));
    layers.add(seen.depth, Shape::circle_stroke(seen.at, RADIUS, Stroke::new(1.5, colour)));
    let text = if sounds { ctx.palette.ground } else { colour };
    let number = painter.layout_no_wrap((further + 2).to_string(), FontId::proportional(9.0), Color32::PLACEHOLDER);
    let corner = Align2::CENTER_CENTER.anchor_size(seen.at, number.size()).min;
    layers.add(seen.depth, egui::epaint::TextShape::new(corner, number, text));
}
