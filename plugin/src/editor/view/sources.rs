//! Further sources: where they are, and how they are drawn.

use super::super::theme::{Palette, faded};
use super::drag::{Handle, Target};
use super::{super::ctx::Ctx, camera::Projected, layers::Layers, scene::stem};
use crate::project::sources::SourceInfo;
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
    let outside = ctx.is_outside(at);
    let sounds = ctx.frame.sounding & (1 << further) != 0;
    let info = ctx.sources.of(1 + further);
    let colour = if outside { ctx.palette.warn } else { ctx.source_colour(1 + further) };
    // Inputs that nobody uses stand back.
    let is_used = sounds || hot || outside || is_chosen(ctx, Handle::Source(further)) || info != SourceInfo::default();
    let colour = if is_used { colour } else { faded(colour, 0.4) };
    stem(layers, at, faded(colour, 0.3));
    let Some(seen) = layers.project(at) else { return };
    if hot || is_chosen(ctx, Handle::Source(further)) {
        layers.add(seen.depth, Shape::circle_filled(seen.at, 2.0 * RADIUS, faded(colour, 0.2)));
    }
    let fill = if sounds { colour } else { ctx.palette.ground };
    layers.add(seen.depth, Shape::circle_filled(seen.at, RADIUS, fill));
    layers.add(seen.depth, Shape::circle_stroke(seen.at, RADIUS, Stroke::new(1.5, colour)));
    if outside {
        let circle = |n: i16| seen.at + 1.7 * RADIUS * egui::Vec2::angled(f32::from(n) * std::f32::consts::TAU / 24.0);
        let ring = (0..=24).map(circle).collect::<Vec<_>>();
        layers.add(seen.depth, Shape::Vec(Shape::dashed_line(&ring, Stroke::new(1.5, colour), 3.0, 3.0)));
    }
    name(layers, painter, ctx, seen, info.name, RADIUS);
    number(layers, painter, seen, 1 + further, if sounds { ctx.palette.ground } else { colour });
}

/// Writes a source's number into its drawing.
pub(super) fn number(layers: &mut Layers<'_>, painter: &Painter, seen: Projected, source: usize, colour: Color32) {
    let number = painter.layout_no_wrap((1 + source).to_string(), FontId::proportional(9.0), Color32::PLACEHOLDER);
    let corner = Align2::CENTER_CENTER.anchor_size(seen.at, number.size()).min;
    layers.add(seen.depth, egui::epaint::TextShape::new(corner, number, colour));
}

/// Writes a source's name beside it, if it has one; the drawing has a radius, points.
pub(super) fn name(layers: &mut Layers<'_>, painter: &Painter, ctx: &Ctx<'_>, seen: Projected, name: String, radius: f32) {
    if !name.is_empty() {
        let name = painter.layout_no_wrap(name, Palette::caption(), Color32::PLACEHOLDER);
        layers.add(seen.depth, egui::epaint::TextShape::new(seen.at + egui::vec2(radius + 4.0, -7.0), name, ctx.palette.soft));
    }
}
