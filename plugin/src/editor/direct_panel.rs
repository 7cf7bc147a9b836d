//! What both ears hear of the direct sound.

use super::ctx::Ctx;
use super::direction::dial;
use super::panel::Panel;
use super::theme::{Palette, faded};
use super::words::Word;
use crate::cast::index;
use crate::telemetry::{FLOOR_DB, HIGHEST_HZ, LOWEST_HZ, MASK_POINTS, frequency_hz, hertz};
use egui::{Align2, Color32, CornerRadius, Painter, Pos2, Rect, Sense, Shape, Stroke, Ui, UiBuilder, pos2, vec2};

/// Range of the plot, dB.
const RANGE_DB: (f32, f32) = (-60.0, 12.0);
/// Between two lines of the plot, dB.
const STEP_DB: f32 = 12.0;
/// Marked frequencies, Hz.
const MARKS_HZ: [(f32, &str); 8] =
    [(50.0, "50"), (100.0, "100"), (200.0, "200"), (500.0, "500"), (1e3, "1k"), (2e3, "2k"), (5e3, "5k"), (1e4, "10k")];
/// Width of the gauges, points.
const GAUGES: f32 = 248.0;

/// Masks over frequency, level and time between the ears.
pub(super) struct DirectPanel;

impl Panel for DirectPanel {
    fn title(&self) -> Word {
        Word::DirectSound
    }

    fn show(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>) {
        let (rect, response) = ui.allocate_exact_size(ui.available_size(), Sense::hover());
        let rect = rect.shrink2(vec2(4.0, 0.0)).with_max_y(rect.bottom() - 8.0);
        let narrow = rect.width() < 460.0;
        let plot = if narrow { rect } else { rect.with_max_x(rect.right() - GAUGES - 12.0) };
        spectrum(ui.painter(), plot, ctx, response.hover_pos());
        if !narrow {
            let place = rect.with_min_x(rect.right() - GAUGES);
            ui.scope_builder(UiBuilder::new().max_rect(place), |ui| dial(ui, ctx));
        }
    }
}

/// Place of a frequency along the plot, 0 to 1.
fn along(hz: f32) -> f32 {
    (hz / LOWEST_HZ).ln() / (HIGHEST_HZ / LOWEST_HZ).ln()
}

fn spectrum(painter: &Painter, rect: Rect, ctx: &Ctx<'_>, pointer: Option<Pos2>) {
    let palette = ctx.palette;
    let plot = Rect::from_min_max(rect.min + vec2(28.0, 4.0), rect.max - vec2(0.0, 16.0));
    let y = |db: f32| plot.bottom() - (db - RANGE_DB.0) / (RANGE_DB.1 - RANGE_DB.0) * plot.height();
    let x = |hz: f32| plot.left() + along(hz) * plot.width();
    painter.rect_filled(plot, CornerRadius::same(4), palette.ground);
    let caption = |at, align, text: &str, colour| painter.text(at, align, text, Palette::caption(), colour);
    // Every line has a number where there is room for all.
    let every = if plot.height() < 90.0 { 2.0 * STEP_DB } else { STEP_DB };
    let mut db = RANGE_DB.0;
    while db <= RANGE_DB.1 {
        let main = db == 0.0;
        painter.hline(plot.x_range(), y(db), Stroke::new(1.0, if main { palette.line } else { palette.hairline }));
        if (db / every).fract() == 0.0 {
            let text = format!("{db:.0}").replace('-', "\u{2212}");
            caption(pos2(plot.left() - 6.0, y(db)), Align2::RIGHT_CENTER, &text, palette.soft);
        }
        db += STEP_DB;
    }
    for (hz, text) in MARKS_HZ {
        painter.vline(x(hz), plot.y_range(), Stroke::new(1.0, palette.hairline));
        caption(pos2(x(hz), rect.bottom()), Align2::CENTER_BOTTOM, text, palette.soft);
    }
    caption(pos2(plot.left() - 6.0, rect.bottom()), Align2::RIGHT_BOTTOM, "dB", palette.soft);
    caption(pos2(plot.right(), rect.bottom()), Align2::RIGHT_BOTTOM, "Hz", palette.soft);
    let inside = painter.with_clip_rect(plot);
    let top_hz = ctx.scene.map_or(HIGHEST_HZ, |scene| scene.top_hz());
    let Some(_scene) = ctx.scene else {
        caption(plot.center(), Align2::CENTER_CENTER, "No scene: the dry sound passes", palette.soft);
        return;
    };
    for (masks, colour) in ctx.frame.masks_db.iter().zip([palette.left, palette.right]) {
        curve(&inside, masks, colour, top_hz, x, y);
    }
    if top_hz < HIGHEST_HZ * 0.99 {
        inside.vline(x(top_hz), plot.y_range(), Stroke::new(1.0, faded(palette.soft, 0.5)));
        if plot.right() - x(top_hz) > 56.0 {
            let at = pos2(x(top_hz) + 6.0, plot.bottom() - 4.0);
            inside.text(at, Align2::LEFT_BOTTOM, "no data", Palette::caption(), palette.soft);
        }
    }
    let mut legend = pos2(plot.right() - 8.0, plot.top() + 4.0);
    let hover = pointer.filter(|at| plot.contains(*at));
    let reading = hover.map(|at| (at.x - plot.left()) / plot.width());
    for (masks, colour, name) in
        [(&ctx.frame.masks_db[1], palette.right, "Right"), (&ctx.frame.masks_db[0], palette.left, "Left")]
    {
        let text = match reading {
            Some(along) => format!("{name} {:.1} dB", at_share(masks, along).max(FLOOR_DB)),
            None => name.to_owned(),
        };
        let drawn = plate(&inside, legend, text, colour, palette);
        legend.x = drawn.left() - 12.0;
    }
    if let (Some(at), Some(along)) = (hover, reading) {
        inside.vline(at.x, plot.y_range(), Stroke::new(1.0, faded(palette.soft, 0.7)));
        let text =
            if hertz(along) < 1000.0 { format!("{:.0} Hz", hertz(along)) } else { format!("{:.2} kHz", hertz(along) / 1e3) };
        plate(&inside, legend, text, palette.soft, palette);
    }
}

/// Text that can be read over the curves, ending at a place.
fn plate(painter: &Painter, right_top: Pos2, text: String, colour: Color32, palette: &Palette) -> Rect {
    let galley = painter.layout_no_wrap(text, Palette::body(), colour);
    let place = Align2::RIGHT_TOP.anchor_size(right_top, galley.size());
    painter.rect_filled(place.expand(3.0), CornerRadius::same(3), faded(palette.ground, 0.8));
    painter.galley(place.min, galley, colour);
    place
}

/// The mask at a place along the plot, dB.
fn at_share(masks: &[f32; MASK_POINTS], along: f32) -> f32 {
    let place = along.clamp(0.0, 1.0) * (MASK_POINTS - 1) as f32;
    let low = index(place).min(MASK_POINTS - 2);
    masks[low] + (place - low as f32) * (masks[low + 1] - masks[low])
}

/// A mask: faint above what the data cover.
fn curve(
    painter: &Painter,
    masks: &[f32; MASK_POINTS],
    colour: Color32,
    top_hz: f32,
    x: impl Fn(f32) -> f32,
    y: impl Fn(f32) -> f32,
) {
    let points = masks.iter().enumerate().map(|(point, db)| (frequency_hz(point), pos2(x(frequency_hz(point)), y(*db))));
    let points = points.collect::<Vec<_>>();
    let cut = points.partition_point(|(hz, _)| *hz <= top_hz).clamp(1, points.len());
    let places = |part: &[(f32, Pos2)]| part.iter().map(|(_, at)| *at).collect::<Vec<_>>();
    painter.add(Shape::line(places(&points[..cut]), Stroke::new(2.0, colour)));
    painter.add(Shape::line(places(&points[cut - 1..]), Stroke::new(1.5, faded(colour, 0.35))));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axis_is_even_in_octaves_and_comes_back() {
        for point in [0, 31, MASK_POINTS - 1] {
            let hz = frequency_hz(point);
            assert!((along(hz) - point as f32 / (MASK_POINTS - 1) as f32).abs() < 1e-4);
            assert!((hertz(along(hz)) / hz - 1.0).abs() < 1e-3);
        }
    }

    #[test]
    fn a_reading_lies_between_its_points() {
        let masks = std::array::from_fn(|point| point as f32);
        assert!((at_share(&masks, 0.5) - 47.5).abs() < 1e-3);
        assert_eq!((at_share(&masks, -1.0), at_share(&masks, 2.0)), (0.0, 95.0));
    }
}
