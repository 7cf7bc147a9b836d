//! Level and time between the ears, and where the emitter is from the head.

use super::theme::{Palette, SPACE, faded};
use super::{ctx::Ctx, widgets::fact, words::Word};
use crate::project::scene_frame::to_polar;
use egui::{Color32, CornerRadius, Painter, Rect, Sense, Shape, Stroke, Ui, UiBuilder, Vec2, vec2};
use promenade_core::Pose;
use promenade_core::glam::Vec3;

/// Ends of the gauge of level, dB.
const MOST_DB: f32 = 24.0;
/// Ends of the gauge of time, microseconds.
const MOST_US: f32 = 900.0;

/// Azimuth, positive to the left, and elevation of a point from a head, degrees; and its distance, metres.
pub(super) fn seen_from(pose: &Pose, world: Vec3) -> (f32, f32, f32) {
    to_polar(pose.to_head(world)).into()
}

/// A head from above with the emitter round it, and gauges of level and time, which lean to the side that the sound seems to
/// come from.
pub(super) fn dial(ui: &mut Ui, ctx: &Ctx<'_>) {
    let rect = ui.max_rect();
    let circle = Rect::from_min_size(rect.min + vec2(0.0, 4.0), Vec2::splat((rect.height() - 8.0).min(108.0)));
    let seen = ctx.scene.and_then(|scene| scene.emitter()).map(|home| seen_from(&ctx.frame.pose, ctx.source_at(home, 0)));
    head(ui.painter(), circle, ctx, seen.map(|(azimuth, ..)| azimuth));
    let texts = rect.with_min_x(circle.right() + 16.0).with_min_y(circle.top() + 16.0);
    let (ild, itd_us) = (ctx.frame.ild_db, ctx.frame.itd_s * 1e6);
    ui.scope_builder(UiBuilder::new().max_rect(texts), |ui| {
        for (word, value, unit, decimals, most) in
            [(Word::Level, ild, "dB", 1, MOST_DB), (Word::Time, itd_us, "µs", 0, MOST_US)]
        {
            fact(ui, ctx.palette, word, &towards(value, unit, decimals));
            let (track, _) = ui.allocate_exact_size(vec2(texts.width(), 6.0), Sense::hover());
            gauge(ui.painter(), track, value / most, ctx.palette);
            ui.add_space(2.0 * SPACE);
        }
    });
}

/// A difference between the ears with the side that it favours; positive values favour the right.
fn towards(value: f32, unit: &str, decimals: usize) -> String {
    let text = format!("{:.decimals$}", value.abs());
    let none = text.chars().all(|c| matches!(c, '0' | '.'));
    let side = if none {
        ""
    } else if value > 0.0 {
        " right"
    } else {
        " left"
    };
    format!("{text} {unit}{side}")
}

fn gauge(painter: &Painter, track: Rect, lean: f32, palette: &Palette) {
    painter.rect_filled(track, CornerRadius::same(3), palette.control);
    let lean = if lean.is_finite() { lean.clamp(-1.0, 1.0) } else { 0.0 };
    let (middle, colour) = (track.center().x, if lean > 0.0 { palette.right } else { palette.left });
    let end = middle + lean * track.width() / 2.0;
    if (end - middle).abs() > 0.5 {
        let bar = Rect::from_x_y_ranges(middle.min(end)..=middle.max(end), track.y_range());
        painter.rect_filled(bar, CornerRadius::same(3), colour);
    }
    painter.vline(middle, track.y_range().expand(2.0), Stroke::new(1.0, palette.soft));
}

fn head(painter: &Painter, circle: Rect, ctx: &Ctx<'_>, azimuth_deg: Option<f32>) {
    let palette = ctx.palette;
    let (centre, radius) = (circle.center(), circle.width() / 2.0 - 6.0);
    painter.circle(centre, radius, palette.ground, Stroke::new(1.0, palette.line));
    for n in 0..12 {
        let ray = Vec2::angled(n as f32 * std::f32::consts::TAU / 12.0);
        let length = if n % 3 == 0 { 5.0 } else { 3.0 };
        painter.line_segment([centre + (radius - length) * ray, centre + radius * ray], Stroke::new(1.0, palette.line));
    }
    let skull = radius * 0.3;
    for (side, colour) in [(-1.0, palette.left), (1.0, palette.right)] {
        painter.circle_filled(centre + vec2(side * skull, 0.0), skull * 0.34, colour);
    }
    let nose = vec![
        centre + vec2(0.0, -1.4 * skull),
        centre + vec2(0.5 * skull, -0.7 * skull),
        centre + vec2(-0.5 * skull, -0.7 * skull),
    ];
    painter.add(Shape::convex_polygon(nose, palette.accent, Stroke::NONE));
    painter.circle_filled(centre, skull, palette.accent);
    if let Some(azimuth) = azimuth_deg {
        let ray = vec2(-azimuth.to_radians().sin(), -azimuth.to_radians().cos());
        let emitter: Color32 = palette.emitter;
        painter.line_segment([centre + ray * skull * 1.2, centre + ray * radius], Stroke::new(1.5, faded(emitter, 0.7)));
        painter.circle_filled(centre + ray * radius, 5.0, emitter);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_on_the_left_has_a_positive_azimuth() {
        let pose = Pose::from_ypr(Vec3::ZERO, 0.0, 0.0, 0.0);
        let (azimuth, elevation, distance) = seen_from(&pose, Vec3::new(0.0, 2.0, 0.0));
        assert!((azimuth - 90.0).abs() < 1e-4 && elevation.abs() < 1e-4 && (distance - 2.0).abs() < 1e-6);
        let turned = Pose::from_ypr(Vec3::ZERO, 1.0, 0.0, 0.0);
        assert!((seen_from(&turned, Vec3::X).0 + 1.0_f32.to_degrees()).abs() < 1e-3);
    }

    #[test]
    fn differences_name_the_side() {
        assert_eq!(towards(6.24, "dB", 1), "6.2 dB right");
        assert_eq!(towards(-310.2, "µs", 0), "310 µs left");
        assert_eq!(towards(-0.01, "dB", 1), "0.0 dB");
    }
}
