//! Curves over frequency or time with their axes.

use super::theme::{Palette, faded};
use crate::parameter::cast::index;
use crate::telemetry::{FLOOR_DB, HIGHEST_HZ, LOWEST_HZ};
use egui::{Align2, CornerRadius, Painter, Pos2, Rect, Stroke, pos2, vec2};

/// Marked frequencies, Hz.
const MARKS_HZ: [(f32, &str); 8] =
    [(50.0, "50"), (100.0, "100"), (200.0, "200"), (500.0, "500"), (1e3, "1k"), (2e3, "2k"), (5e3, "5k"), (1e4, "10k")];
/// Lower marks than these are left out where there is no room for all, points.
const CROWDED: f32 = 260.0;
/// Room for the unit at the end of an axis and half a mark, points.
const UNIT: f32 = 28.0;
/// Between two lines of levels, dB.
const STEP_DB: f32 = 12.0;

/// Place of a frequency along an axis, 0 to 1.
pub(super) fn along(hz: f32) -> f32 {
    (hz / LOWEST_HZ).ln() / (HIGHEST_HZ / LOWEST_HZ).ln()
}

/// A plot with its ground and its axis of levels.
pub(super) struct Plot {
    /// Inside of the axes.
    pub(super) rect: Rect,
    range_db: (f32, f32),
}

impl Plot {
    /// Draws ground and levels; the axis below is still to be drawn. `range_db` is a multiple of 12 dB.
    pub(super) fn new(painter: &Painter, whole: Rect, range_db: (f32, f32), palette: &Palette) -> Self {
        let rect = Rect::from_min_max(whole.min + vec2(28.0, 4.0), whole.max - vec2(0.0, 16.0));
        let plot = Self { rect, range_db };
        painter.rect_filled(rect, CornerRadius::same(4), palette.ground);
        // Every line has a number where there is room for all.
        let every = if rect.height() < 90.0 { 2.0 * STEP_DB } else { STEP_DB };
        let mut db = range_db.0;
        while db <= range_db.1 {
            let stroke = Stroke::new(1.0, if db == 0.0 { palette.line } else { palette.hairline });
            painter.hline(rect.x_range(), plot.y(db), stroke);
            if (db / every).fract() == 0.0 && db > range_db.0 {
                let text = format!("{db:.0}").replace('-', "\u{2212}");
                let at = pos2(rect.left() - 6.0, plot.y(db));
                painter.text(at, Align2::RIGHT_CENTER, text, Palette::caption(), palette.soft);
            }
            db += STEP_DB;
        }
        let at = pos2(rect.left() - 6.0, whole.bottom());
        painter.text(at, Align2::RIGHT_BOTTOM, "dB", Palette::caption(), palette.soft);
        plot
    }

    /// Height of a level in the window.
    pub(super) fn y(&self, db: f32) -> f32 {
        let (low, high) = self.range_db;
        self.rect.bottom() - (db - low) / (high - low) * self.rect.height()
    }

    /// Place in the window of a share of the axis below.
    pub(super) fn x(&self, share: f32) -> f32 {
        self.rect.left() + share * self.rect.width()
    }

    /// Share of the axis below at a place in the window.
    pub(super) fn share(&self, x: f32) -> f32 {
        (x - self.rect.left()) / self.rect.width()
    }

    /// Draws an axis of frequencies, from [`LOWEST_HZ`] to [`HIGHEST_HZ`].
    pub(super) fn frequencies(&self, painter: &Painter, palette: &Palette) {
        let crowded = self.rect.width() < CROWDED;
        for (hz, text) in MARKS_HZ {
            let is_decade = text.trim_end_matches('k').trim_end_matches('0') == "1";
            let fits = self.rect.right() - self.x(along(hz)) > UNIT && (is_decade || !crowded);
            self.mark(painter, along(hz), if fits { text } else { "" }, palette);
        }
        self.unit(painter, "Hz", palette);
    }

    /// Draws an axis of times from 0 to some seconds.
    pub(super) fn times(&self, painter: &Painter, seconds: f32, palette: &Palette) {
        let step = step_s(seconds);
        let mut mark = step;
        while mark < 0.93 * seconds {
            let text = if step < 1.0 {
                format!("{mark:.2}").trim_end_matches('0').trim_end_matches('.').to_owned()
            } else {
                format!("{mark:.0}")
            };
            self.mark(painter, mark / seconds, &text, palette);
            mark += step;
        }
        self.unit(painter, "s", palette);
    }

    fn mark(&self, painter: &Painter, share: f32, text: &str, palette: &Palette) {
        painter.vline(self.x(share), self.rect.y_range(), Stroke::new(1.0, palette.hairline));
        let at = pos2(self.x(share), self.rect.bottom() + 16.0);
        painter.text(at, Align2::CENTER_BOTTOM, text, Palette::caption(), palette.soft);
    }

    fn unit(&self, painter: &Painter, unit: &str, palette: &Palette) {
        let at = self.rect.right_bottom() + vec2(0.0, 16.0);
        painter.text(at, Align2::RIGHT_BOTTOM, unit, Palette::caption(), palette.soft);
    }

    /// Names both ears' curves at the upper right, over the curves; at the pointer with their values there, dB, and its place.
    pub(super) fn legend(
        &self,
        painter: &Painter,
        pointer: Option<Pos2>,
        curves: &[impl AsRef<[f32]>; 2],
        place: impl Fn(f32) -> String,
        palette: &Palette,
    ) {
        let reading = pointer.map(|at| (at.x, self.share(at.x)));
        let text = |name: &str, ear: usize| match reading {
            Some((_, along)) => format!("{name} {:.1} dB", at_share(curves[ear].as_ref(), along).max(FLOOR_DB)),
            None => name.to_owned(),
        };
        let mut texts = vec![(text("Right", 1), palette.right), (text("Left", 0), palette.left)];
        if let Some((x, along)) = reading {
            painter.vline(x, self.rect.y_range(), Stroke::new(1.0, faded(palette.soft, 0.7)));
            texts.push((place(along), palette.soft));
        }
        let mut at = pos2(self.rect.right() - 8.0, self.rect.top() + 4.0);
        for (text, colour) in texts {
            let galley = painter.layout_no_wrap(text, Palette::body(), colour);
            let place = Align2::RIGHT_TOP.anchor_size(at, galley.size());
            painter.rect_filled(place.expand(3.0), CornerRadius::same(3), faded(palette.ground, 0.8));
            painter.galley(place.min, galley, colour);
            at.x = place.left() - 12.0;
        }
    }
}

/// A curve at a place along the plot.
fn at_share(curve: &[f32], along: f32) -> f32 {
    let place = along.clamp(0.0, 1.0) * (curve.len() - 1) as f32;
    let low = index(place).min(curve.len() - 2);
    curve[low] + (place - low as f32) * (curve[low + 1] - curve[low])
}

/// The least length of 1, 2 or 5 times a power of ten that is no shorter than another, 1e-3 or more.
pub(super) fn round_step(least: f32) -> f32 {
    let least = least.max(1e-3);
    let decade = 10.0_f32.powf(least.log10().floor());
    [1.0, 2.0, 5.0, 10.0].into_iter().map(|step| step * decade).find(|step| *step >= least * 0.999).unwrap_or(10.0 * decade)
}

/// Time between two marks of an axis, seconds; at most six of them.
pub(super) fn step_s(seconds: f32) -> f32 {
    round_step(seconds / 6.0)
}

/// A frequency as it is written.
pub(super) fn hertz_text(hz: f32) -> String {
    if hz < 1000.0 { format!("{hz:.0} Hz") } else { format!("{:.2} kHz", hz / 1e3) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::telemetry::{MASK_POINTS, frequency_hz, hertz};

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
        let masks: [f32; MASK_POINTS] = std::array::from_fn(|point| point as f32);
        assert!((at_share(&masks, 0.5) - 47.5).abs() < 1e-3);
        assert_eq!((at_share(&masks, -1.0), at_share(&masks, 2.0)), (0.0, 95.0));
    }

    #[test]
    fn an_axis_of_time_has_a_few_round_marks() {
        for (seconds, step) in [(0.3, 0.05), (1.0, 0.2), (0.6, 0.1), (12.0, 2.0), (60.0, 10.0)] {
            assert!((step_s(seconds) / step - 1.0).abs() < 1e-3, "{seconds}: {}", step_s(seconds));
        }
    }
}
