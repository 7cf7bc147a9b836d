//! Measures over the plan, as colours below everything else.

use super::super::theme::{Palette, faded};
use super::{super::ctx::Ctx, camera::Camera};
use crate::answers::room_map::{Mapped, RoomMap};
use crate::listener::snapshot::trim_of;
use crate::project::settings::Map;
use egui::epaint::Mesh;
use egui::{Align2, Color32, CornerRadius, Painter, Pos2, Rect, Shape, pos2, vec2};
use promenade_core::glam::Vec3;
use std::sync::Arc;

/// Viridis by S. van der Walt and N. Smith (matplotlib, CC0), in quarters.
const COLOURS: [[u8; 3]; 5] = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];
/// Units of the measures, and digits after the point.
const UNITS: [(&str, usize); 3] = [("dB", 1), ("s", 2), ("dB", 1)];
/// Size of the legend, points.
const LEGEND: (f32, f32) = (10.0, 120.0);

/// A colour at a share of the scale.
fn colour(share: f32) -> Color32 {
    let along = 4.0 * share.clamp(0.0, 1.0);
    let low = crate::parameter::cast::index(along).min(3);
    let [a, b] = [COLOURS[low], COLOURS[low + 1]].map(|[r, g, b]| Color32::from_rgb(r, g, b));
    a.lerp_to_gamma(b, along - low as f32)
}

/// The number of the measure that is shown.
fn measure(ctx: &Ctx<'_>) -> Option<usize> {
    (ctx.settings.map as usize).checked_sub(1)
}

/// The map that is asked for, once it is known, or why there is none.
pub(super) fn wanted(ctx: &Ctx<'_>) -> Option<Option<Arc<Result<RoomMap, String>>>> {
    let scene = ctx.scene.filter(|_| ctx.settings.map != Map::None)?;
    Some(ctx.views.map(Mapped { scene: Arc::downgrade(scene), trim: trim_of(|parameter| ctx.value(parameter)) }))
}

/// Paints the map; places lie about the emitter, wherever that was moved.
pub(super) fn paint(painter: &Painter, rect: Rect, camera: &Camera, ctx: &Ctx<'_>, map: &RoomMap, shift: Vec3) {
    let Some((measure, (low, high))) = measure(ctx).and_then(|measure| Some((measure, map.range(measure)?))) else { return };
    let half = 0.5 * map.spacing_m;
    let mut mesh = Mesh::default();
    for (place, measured) in &map.places {
        let Some(value) = measured[measure] else { continue };
        let corner = |x: f32, y: f32| camera.project(rect, *place + shift + Vec3::new(x, y, 0.0)).map(|seen| seen.at);
        let corners = [corner(half, half), corner(half, -half), corner(-half, -half), corner(-half, half)];
        let [Some(a), Some(b), Some(c), Some(d)] = corners else { continue };
        let first = u32::try_from(mesh.vertices.len()).unwrap_or(0);
        for at in [a, b, c, d] {
            mesh.colored_vertex(at, faded(colour((value - low) / (high - low)), 0.8));
        }
        mesh.add_triangle(first, first + 1, first + 2);
        mesh.add_triangle(first, first + 2, first + 3);
    }
    painter.add(Shape::mesh(mesh));
}

/// Paints what the colours mean, and what is measured under the pointer.
pub(super) fn legend(painter: &Painter, rect: Rect, camera: &Camera, ctx: &Ctx<'_>, pointer: Option<Pos2>) {
    let palette = ctx.palette;
    let say = |text: &str| {
        let at = rect.right_top() + vec2(-16.0, 18.0);
        painter.text(at, Align2::RIGHT_TOP, text, Palette::caption(), palette.soft);
    };
    let map = match wanted(ctx) {
        None => return,
        Some(None) => return say("The map is being measured"),
        Some(Some(map)) => map,
    };
    let map = match &*map {
        Err(why) => return say(why),
        Ok(map) => map,
    };
    let Some((measure, (low, high))) = measure(ctx).and_then(|measure| Some((measure, map.range(measure)?))) else {
        return say("There is no value anywhere");
    };
    let (unit, digits) = UNITS[measure];
    let bar = Rect::from_min_size(rect.right_top() + vec2(-24.0 - LEGEND.0, 24.0), vec2(LEGEND.0, LEGEND.1));
    let plate = Rect::from_min_max(bar.min - vec2(72.0, 14.0), bar.max + vec2(10.0, 34.0));
    painter.rect_filled(plate, CornerRadius::same(4), faded(palette.panel, 0.92));
    let steps = 40_u16;
    for step in 0..steps {
        let share = f32::from(step) / f32::from(steps);
        let y = bar.bottom() - share * bar.height();
        let piece = Rect::from_x_y_ranges(bar.x_range(), y - bar.height() / f32::from(steps) - 0.5..=y);
        painter.rect_filled(piece, CornerRadius::ZERO, colour(share));
    }
    for share in [0.0, 0.5, 1.0] {
        let text = format!("{:.digits$} {unit}", low + share * (high - low)).replace('-', "\u{2212}");
        let at = pos2(bar.left() - 6.0, bar.bottom() - share * bar.height());
        painter.text(at, Align2::RIGHT_CENTER, text, Palette::caption(), palette.text);
    }
    let emitter = ctx.scene.and_then(|scene| scene.emitter());
    let shift = emitter.map_or(Vec3::ZERO, |home| ctx.source_at(home, 0) - home);
    let height = map.places.first().map_or(0.0, |(place, _)| place.z);
    let under = pointer.and_then(|at| camera.on_level(rect, at, height + shift.z));
    let value = under.and_then(|world| map.at((world - shift).truncate())).and_then(|measured| measured[measure]);
    let here = value.map_or("\u{2013}".to_owned(), |value| format!("{value:.digits$} {unit}").replace('-', "\u{2212}"));
    let at = plate.center_bottom() - vec2(0.0, 5.0);
    painter.text(at, Align2::CENTER_BOTTOM, format!("Here {here}"), Palette::caption(), palette.text);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_go_from_dark_to_light() {
        assert_eq!(
            (colour(0.0), colour(1.0), colour(9.0)),
            (Color32::from_rgb(68, 1, 84), Color32::from_rgb(253, 231, 37), colour(1.0))
        );
        assert_eq!(colour(0.5), Color32::from_rgb(33, 145, 140));
    }
}
