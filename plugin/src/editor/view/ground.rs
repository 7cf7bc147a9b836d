//! Draws the ground: lines in metres with their numbers, and a scale.

use super::super::plot::round_step;
use super::super::theme::{Palette, faded};
use super::camera::{Camera, Plan};
use egui::{Align2, Painter, Pos2, Rect, Stroke, pos2, vec2};
use promenade_core::glam::Vec3;

/// Least distance between two lines, points.
const LEAST: f32 = 44.0;
/// Lines of the view from anywhere on each side of the middle.
const REACH: i32 = 10;

/// A round length, metres, that spans at least `points`.
pub(super) fn step_m(scale: f32, points: f32) -> f32 {
    round_step(points / scale.max(1e-6))
}

/// A length with as many digits as its step has.
pub(super) fn metres(value: f32, step: f32) -> String {
    let value = if value.abs() < step * 0.01 { 0.0 } else { value };
    let digits = usize::from(step < 1.0) + usize::from(step < 0.1);
    format!("{value:.digits$}")
}

/// Paints the ground below everything else.
pub(super) fn paint(painter: &Painter, rect: Rect, camera: &Camera, palette: &Palette) {
    match camera {
        Camera::Plan(plan) => paint_plan(painter, rect, plan, camera, palette),
        Camera::Orbit(orbit) => {
            let scale = camera.project(rect, orbit.target).map_or(50.0, |seen| seen.scale);
            let step = step_m(scale, LEAST);
            let (x0, y0) = ((orbit.target.x / step).round(), (orbit.target.y / step).round());
            let reach = REACH as f32;
            for n in -REACH..=REACH {
                let (x, y) = ((x0 + n as f32) * step, (y0 + n as f32) * step);
                let across = [Vec3::new(x, (y0 - reach) * step, 0.0), Vec3::new(x, (y0 + reach) * step, 0.0)];
                let along = [Vec3::new((x0 - reach) * step, y, 0.0), Vec3::new((x0 + reach) * step, y, 0.0)];
                for (line, through) in [(across, x), (along, y)] {
                    let main = through.abs() < step * 0.5;
                    let colour =
                        if main { palette.line } else { faded(palette.hairline, 1.0 - n.unsigned_abs() as f32 / 14.0) };
                    if let Some([a, b]) = camera.segment(rect, line[0], line[1]) {
                        painter.line_segment([a.at, b.at], Stroke::new(1.0, colour));
                    }
                }
            }
            numbers_in_space(painter, rect, camera, palette, step);
        }
    }
}

fn paint_plan(painter: &Painter, rect: Rect, plan: &Plan, camera: &Camera, palette: &Palette) {
    let step = step_m(plan.scale, LEAST);
    let world = |at: Pos2| camera.on_level(rect, at, 0.0).unwrap_or(Vec3::ZERO);
    let (first, last) = (world(rect.right_bottom()), world(rect.left_top()));
    let lines = |low: f32, high: f32, is_x: bool| {
        let mut n = (low / step).ceil();
        while n * step <= high {
            let value = n * step;
            let at = camera.project(rect, if is_x { Vec3::X * value } else { Vec3::Y * value }).map_or(rect.min, |s| s.at);
            let main = n == 0.0;
            let stroke = Stroke::new(1.0, if main { palette.line } else { palette.hairline });
            let text = metres(value, step);
            // The corner is left to the numbers of one axis, the top to the buttons.
            if is_x {
                painter.hline(rect.x_range(), at.y, stroke);
                if at.y < rect.top() + 48.0 || at.y > rect.bottom() - 20.0 {
                    n += 1.0;
                    continue;
                }
                number(painter, pos2(rect.left() + 6.0, at.y - 1.0), Align2::LEFT_BOTTOM, text, palette);
            } else {
                painter.vline(at.x, rect.y_range(), stroke);
                number(painter, pos2(at.x + 3.0, rect.bottom() - 4.0), Align2::LEFT_BOTTOM, text, palette);
            }
            n += 1.0;
        }
    };
    lines(first.x, last.x, true);
    lines(first.y, last.y, false);
}

fn numbers_in_space(painter: &Painter, rect: Rect, camera: &Camera, palette: &Palette, step: f32) {
    for n in [-4, -2, 2, 4] {
        let value = n as f32 * step;
        for world in [Vec3::X * value, Vec3::Y * value] {
            if let Some(seen) = camera.project(rect, world) {
                number(painter, seen.at + vec2(3.0, 0.0), Align2::LEFT_TOP, metres(value, step), palette);
            }
        }
    }
}

fn number(painter: &Painter, at: Pos2, align: Align2, text: String, palette: &Palette) {
    painter.text(at, align, text, Palette::caption(), faded(palette.soft, 0.8));
}

/// Paints a length to compare with, and which way the axes go.
pub(super) fn paint_scale(painter: &Painter, rect: Rect, camera: &Camera, palette: &Palette) {
    let corner = rect.right_bottom() - vec2(16.0, 32.0);
    if let Camera::Plan(plan) = camera {
        let step = step_m(plan.scale, LEAST);
        let left = pos2(corner.x - step * plan.scale, corner.y);
        let stroke = Stroke::new(1.5, palette.soft);
        painter.line_segment([left, corner], stroke);
        for end in [left, corner] {
            painter.line_segment([end - vec2(0.0, 4.0), end], stroke);
        }
        let middle = left.lerp(corner, 0.5) - vec2(0.0, 6.0);
        painter.text(middle, Align2::CENTER_BOTTOM, format!("{} m", metres(step, step)), Palette::caption(), palette.soft);
    }
    let centre = pos2(rect.left() + 64.0, rect.bottom() - 52.0);
    let Some(origin) = camera.project(rect, Vec3::ZERO) else { return };
    for (axis, name) in [(Vec3::X, "x"), (Vec3::Y, "y"), (Vec3::Z, "z")] {
        // Directions only: a small step at the origin, in points.
        let Some(tip) = camera.project(rect, axis * 0.05) else { continue };
        let along = (tip.at - origin.at) / (0.05 * origin.scale);
        if along.length() < 0.15 {
            continue;
        }
        painter.line_segment([centre, centre + 20.0 * along], Stroke::new(1.5, palette.soft));
        painter.text(centre + 27.0 * along, Align2::CENTER_CENTER, name, Palette::caption(), palette.soft);
    }
}

/// The edges of a box of the world, flat or not.
pub(super) fn edges(low: Vec3, high: Vec3) -> Vec<[Vec3; 2]> {
    let corner = |n: usize| {
        let pick = |bit: usize, low: f32, high: f32| if n >> bit & 1 == 0 { low } else { high };
        Vec3::new(pick(0, low.x, high.x), pick(1, low.y, high.y), pick(2, low.z, high.z))
    };
    let pairs = (0..8_usize).flat_map(|n| (0..3).map(move |bit| (n, n | 1 << bit))).filter(|(a, b)| a != b);
    pairs.map(|(a, b)| [corner(a), corner(b)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_1_2_or_5_and_wide_enough() {
        for (scale, expected) in [(100.0, 0.5), (44.0, 1.0), (45.0, 1.0), (30.0, 2.0), (4.0, 20.0), (2000.0, 0.05)] {
            let step = step_m(scale, LEAST);
            assert!((step - expected).abs() < 1e-4, "{scale} points per metre: {step}");
            assert!(step * scale >= LEAST * 0.99);
        }
    }

    #[test]
    fn numbers_have_the_digits_of_their_step() {
        assert_eq!(metres(1.5, 0.5), "1.5");
        assert_eq!(metres(-0.001, 0.5), "0.0");
        assert_eq!(metres(20.0, 10.0), "20");
        assert_eq!(metres(0.05, 0.05), "0.05");
    }

    #[test]
    fn a_box_has_twelve_edges() {
        let all = edges(Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0));
        assert_eq!(all.len(), 12);
        let length: f32 = all.iter().map(|[a, b]| (*b - *a).length()).sum();
        assert!((length - 4.0 * 6.0).abs() < 1e-5);
    }
}
