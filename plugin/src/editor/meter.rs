//! Level meters with peak hold and a light for clipping.

use super::theme::{Palette, faded};
use super::words::Word;
use crate::parameter::cast::narrow;
use crate::telemetry::decibels;
use egui::{Align2, Color32, CornerRadius, Painter, Rect, Response, Sense, Stroke, Ui, Vec2, pos2};

/// What a meter shows, dB below and above full scale.
const RANGE_DB: (f32, f32) = (-60.0, 6.0);
/// How fast the bar falls, dB a second.
const FALL_DB_PER_S: f64 = 26.0;
/// How long a peak is held, seconds.
const HOLD_S: f64 = 1.5;
/// Marks of the scale, dB.
const MARKS_DB: [f32; 5] = [-48.0, -36.0, -24.0, -12.0, 0.0];
/// Height of a bar, points.
const BAR: f32 = 6.0;
/// Space between the bars of a pair, points.
const GAP: f32 = 2.0;

/// One channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Meter {
    level_db: f32,
    hold_db: f32,
    held_until_s: f64,
    clipped: bool,
    now_s: f64,
}

impl Default for Meter {
    fn default() -> Self {
        Self { level_db: RANGE_DB.0, hold_db: RANGE_DB.0, held_until_s: 0.0, clipped: false, now_s: 0.0 }
    }
}

impl Meter {
    /// Takes the peak since the last picture, linear.
    pub fn advance(&mut self, peak: f32, now_s: f64) {
        let peak_db = decibels(peak).max(RANGE_DB.0);
        let fall = narrow((now_s - self.now_s).max(0.0) * FALL_DB_PER_S);
        self.now_s = now_s;
        self.level_db = peak_db.max(self.level_db - fall).max(RANGE_DB.0);
        if peak_db >= self.hold_db {
            (self.hold_db, self.held_until_s) = (peak_db, now_s + HOLD_S);
        } else if now_s > self.held_until_s {
            self.hold_db = (self.hold_db - fall).max(self.level_db);
        }
        self.clipped |= peak >= 1.0;
    }

    /// Seconds until the picture changes by itself; `None` when it rests.
    pub fn rest_s(&self) -> Option<f64> {
        if self.level_db > RANGE_DB.0 || (self.hold_db > self.level_db && self.now_s >= self.held_until_s) {
            Some(0.0)
        } else if self.hold_db > RANGE_DB.0 {
            Some(self.held_until_s - self.now_s)
        } else {
            None
        }
    }
}

/// Share of a meter's length for a level, 0 to 1.
pub fn share(db: f32) -> f32 {
    ((db - RANGE_DB.0) / (RANGE_DB.1 - RANGE_DB.0)).clamp(0.0, 1.0)
}

/// The meters of input and output.
#[derive(Clone, Copy, Debug, Default)]
pub struct Meters {
    input: [Meter; 2],
    output: [Meter; 2],
}

impl Meters {
    /// Takes the peaks since the last picture.
    pub fn advance(&mut self, input: [f32; 2], output: [f32; 2], now_s: f64) {
        for (meters, peaks) in [(&mut self.input, input), (&mut self.output, output)] {
            for (meter, peak) in meters.iter_mut().zip(peaks) {
                meter.advance(peak, now_s);
            }
        }
    }

    /// Seconds until the picture changes by itself.
    pub fn rest_s(&self) -> Option<f64> {
        self.input.iter().chain(&self.output).filter_map(Meter::rest_s).min_by(f64::total_cmp)
    }

    /// Both pairs with their scale. A click puts the lights out.
    pub fn show(&mut self, ui: &mut Ui, palette: &Palette) {
        let mut clicked = false;
        for (word, meters, colours) in
            [(Word::In, &self.input, [palette.soft; 2]), (Word::Out, &self.output, [palette.left, palette.right])]
        {
            clicked |= pair(ui, palette, word, meters, colours).clicked();
        }
        scale(ui, palette);
        if clicked {
            for meter in self.input.iter_mut().chain(&mut self.output) {
                meter.clipped = false;
            }
        }
    }
}

/// Where the bars of a line lie: right of its name, left of its light.
fn bars(rect: Rect) -> Rect {
    Rect::from_min_max(pos2(rect.left() + NAME, rect.top()), pos2(rect.right() - LIGHT, rect.bottom()))
}

/// Width of the names and of the light with the space before it, points.
const NAME: f32 = 28.0;
const LIGHT: f32 = 16.0;

fn pair(ui: &mut Ui, palette: &Palette, word: Word, meters: &[Meter; 2], colours: [Color32; 2]) -> Response {
    let size = Vec2::new(ui.available_width(), 2.0 * BAR + GAP + 4.0);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    let painter = ui.painter();
    painter.text(rect.left_center(), Align2::LEFT_CENTER, word.label(), Palette::caption(), palette.soft);
    let room = bars(rect);
    for (index, (meter, colour)) in meters.iter().zip(colours).enumerate() {
        let top = rect.top() + 2.0 + index as f32 * (BAR + GAP);
        bar(painter, Rect::from_x_y_ranges(room.x_range(), top..=top + BAR), meter, colour, palette);
    }
    let clipped = meters.iter().any(|meter| meter.clipped);
    let light = Rect::from_center_size(pos2(rect.right() - 5.0, rect.center().y), Vec2::new(10.0, 2.0 * BAR + GAP));
    let (fill, line) = if clipped { (palette.error, palette.error) } else { (palette.control, palette.line) };
    painter.rect(light, CornerRadius::same(2), fill, Stroke::new(1.0, line), egui::StrokeKind::Inside);
    let loudest = meters.iter().fold(RANGE_DB.0, |level, meter| level.max(meter.hold_db));
    let text = if loudest > RANGE_DB.0 { format!("{loudest:.1} dBFS") } else { "silent".to_owned() };
    response.on_hover_text(format!("{}: {text}{}", word.help(), if clipped { ", has clipped; click to reset" } else { "" }))
}

fn bar(painter: &Painter, rect: Rect, meter: &Meter, colour: Color32, palette: &Palette) {
    let x = |db: f32| rect.left() + share(db) * rect.width();
    painter.rect_filled(rect, CornerRadius::same(2), palette.control);
    let filled = Rect::from_x_y_ranges(rect.left()..=x(meter.level_db), rect.y_range());
    if filled.width() > 0.5 {
        painter.rect_filled(filled, CornerRadius::same(2), colour);
    }
    let hot = Rect::from_x_y_ranges(x(0.0)..=x(meter.level_db.max(0.0)), rect.y_range());
    if hot.width() > 0.5 {
        painter.rect_filled(hot, CornerRadius::same(2), palette.error);
    }
    if meter.hold_db > RANGE_DB.0 {
        let hold = if meter.hold_db >= 0.0 { palette.error } else { palette.text };
        painter.vline(x(meter.hold_db), rect.y_range(), Stroke::new(2.0, hold));
    }
    painter.vline(x(0.0), rect.y_range(), Stroke::new(1.0, faded(palette.soft, 0.6)));
}

fn scale(ui: &mut Ui, palette: &Palette) {
    let (rect, _) = ui.allocate_exact_size(Vec2::new(ui.available_width(), 12.0), Sense::hover());
    let room = bars(rect);
    for mark in MARKS_DB {
        let at = pos2(room.left() + share(mark) * room.width(), rect.top());
        let text = format!("{mark:.0}").replace('-', "\u{2212}");
        ui.painter().text(at, Align2::CENTER_TOP, text, Palette::caption(), palette.soft);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_goes_from_end_to_end() {
        assert_eq!((share(-60.0), share(6.0), share(-300.0), share(40.0)), (0.0, 1.0, 0.0, 1.0));
        assert!((share(0.0) - 60.0 / 66.0).abs() < 1e-6);
    }

    #[test]
    fn a_bar_falls_while_its_peak_is_held() {
        let mut meter = Meter::default();
        meter.advance(0.5, 10.0);
        assert!((meter.level_db + 6.02).abs() < 0.01);
        meter.advance(0.0, 11.0);
        assert!((meter.level_db + 32.02).abs() < 0.01, "{}", meter.level_db);
        assert!((meter.hold_db + 6.02).abs() < 0.01);
        meter.advance(0.0, 12.0);
        assert!(meter.hold_db < -30.0);
        meter.advance(0.0, 20.0);
        assert_eq!((meter.level_db, meter.hold_db, meter.rest_s()), (RANGE_DB.0, RANGE_DB.0, None));
    }

    #[test]
    fn a_held_peak_asks_for_a_picture_when_it_is_over() {
        let mut meter = Meter::default();
        assert_eq!(meter.rest_s(), None);
        meter.advance(1.5, 0.0);
        meter.advance(0.0, 0.1);
        assert_eq!(meter.rest_s(), Some(0.0), "it falls");
        let mut meter = Meter { level_db: RANGE_DB.0, now_s: 0.5, held_until_s: 1.5, hold_db: -20.0, clipped: false };
        assert_eq!(meter.rest_s(), Some(1.0));
        meter.advance(0.0, 1.6);
        assert!(meter.rest_s().is_none_or(|s| s == 0.0));
    }

    #[test]
    fn clipping_is_remembered() {
        let mut meter = Meter::default();
        meter.advance(0.99, 0.0);
        assert!(!meter.clipped);
        meter.advance(1.0, 0.1);
        meter.advance(0.0, 60.0);
        assert!(meter.clipped);
    }
}
