//! The camera path over time: the sound that was heard, keyframes to be moved in time, and where the transport is.

use super::theme::{Palette, faded};
use super::{ctx::Ctx, meter::share, plot::step_s, words::Word};
use crate::telemetry::decibels;
use egui::{Align2, CornerRadius, CursorIcon, Pos2, Rect, Sense, Shape, Stroke, Ui, pos2, vec2};

/// Height, points.
pub(super) const HEIGHT: f32 = 58.0;
/// Height of the axis below, points.
const AXIS: f32 = 14.0;
/// What is shown at least, seconds.
const LEAST_S: f64 = 10.0;
/// The pointer picks a keyframe within this distance, points.
const REACH: f32 = 7.0;
/// Paths of more keyframes are drawn as a band.
const MOST_KEYFRAMES: usize = 400;

/// A keyframe that is moved in time.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Timeline {
    drag: Option<(usize, f64)>,
}

impl Timeline {
    /// Shows it in the whole width; returns a keyframe and the time, seconds of the path, to which it was moved.
    pub(super) fn show(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>) -> Option<(usize, f64)> {
        let (whole, response) = ui.allocate_exact_size(vec2(ui.available_width(), HEIGHT), Sense::click_and_drag());
        let palette = ctx.palette;
        let rect = whole.with_max_y(whole.bottom() - AXIS);
        let painter = ui.painter().with_clip_rect(whole);
        painter.rect_filled(rect, CornerRadius::same(4), palette.ground);
        ctx.shows_time = true;
        let keyframes = ctx.walk.map_or(&[][..], |walk| walk.path.keyframes());
        // A second of the transport is so many of the path.
        let speed = ctx.walk.map_or(1.0, |walk| walk.playback.speed);
        let speed = if speed > 0.0 { speed } else { 1.0 };
        let end_s = keyframes.last().map_or(0.0, |last| last.t_s / speed);
        let shown_s = (1.05 * end_s).max(ctx.frame.transport_s).max(LEAST_S);
        let x = |t_s: f64| rect.left() + rect.width() * crate::parameter::cast::narrow(t_s / shown_s);
        let time = |x: f32| f64::from((x - rect.left()) / rect.width()).clamp(0.0, 1.0) * shown_s;
        self.wave(&painter, rect, ctx, &time);
        axis(&painter, rect, palette, crate::parameter::cast::narrow(shown_s));
        let middle = rect.center().y;
        let at = |index: usize| {
            let moved = self.drag.filter(|(held, _)| *held == index).map(|(_, t_s)| t_s);
            pos2(x(moved.unwrap_or(keyframes[index].t_s) / speed), middle)
        };
        if let (Some(first), Some(last)) = (keyframes.first(), keyframes.last()) {
            let ends = [pos2(x(first.t_s / speed), middle), pos2(x(last.t_s / speed), middle)];
            painter.line_segment(ends, Stroke::new(2.0, faded(palette.path, 0.7)));
        }
        let few = if keyframes.len() <= MOST_KEYFRAMES { keyframes.len() } else { 0 };
        let nearest = |to: Pos2| {
            let near = (0..few).map(|index| (index, (at(index).x - to.x).abs())).filter(|(_, off)| *off <= REACH);
            near.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(index, _)| index)
        };
        let over = response.hover_pos().and_then(nearest);
        for index in (0..few).chain(ctx.selection.keyframe.filter(|index| *index < keyframes.len())) {
            let chosen = ctx.selection.keyframe == Some(index);
            let size = if chosen || over == Some(index) { 7.0 } else { 5.0 };
            let corners = [(0.0, -size), (size, 0.0), (0.0, size), (-size, 0.0)].map(|(x, y)| at(index) + vec2(x, y));
            let line = Stroke::new(1.0, if chosen { palette.text } else { palette.ground });
            painter.add(Shape::convex_polygon(corners.to_vec(), palette.path, line));
        }
        let now = x(ctx.frame.transport_s);
        painter.vline(now, rect.y_range(), Stroke::new(1.5, palette.accent));
        if keyframes.is_empty() {
            let text = "No camera path: record one, add keyframes, or import a file";
            painter.text(rect.center(), Align2::CENTER_CENTER, text, Palette::caption(), palette.soft);
        }
        self.handle(ui, &response, ctx, over, |at| time(at.x) * speed)
    }

    /// The levels that were heard, about the middle.
    fn wave(self, painter: &egui::Painter, rect: Rect, ctx: &Ctx<'_>, time: &dyn Fn(f32) -> f64) {
        let colour = faded(ctx.palette.soft, 0.45);
        let mut left = rect.left();
        while left < rect.right() {
            let peak = ctx.waveform.peak(time(left), time(left + 1.0));
            let half = 0.5 * (rect.height() - 4.0) * if peak > 0.0 { share(decibels(peak)) } else { 0.0 };
            if half > 0.25 {
                painter.vline(left, rect.center().y - half..=rect.center().y + half, Stroke::new(1.0, colour));
            }
            left += 1.0;
        }
    }

    /// Chooses a keyframe, or moves it in time.
    fn handle(
        &mut self,
        ui: &Ui,
        response: &egui::Response,
        ctx: &mut Ctx<'_>,
        over: Option<usize>,
        time: impl Fn(Pos2) -> f64,
    ) -> Option<(usize, f64)> {
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Slider, true, Word::Timeline.label()));
        if over.is_some() || self.drag.is_some() {
            ui.ctx().set_cursor_icon(CursorIcon::ResizeHorizontal);
        }
        if response.drag_started() || response.clicked() {
            ctx.selection.keyframe = over;
        }
        if response.drag_started() {
            self.drag = over.zip(ctx.walk).map(|(index, walk)| (index, walk.path.keyframes()[index].t_s));
        }
        let mut moved = None;
        if let (Some((index, t_s)), Some(at)) = (&mut self.drag, response.interact_pointer_pos()) {
            if response.dragged() {
                *t_s = time(at);
            } else {
                moved = Some((*index, *t_s));
            }
        }
        if !response.dragged() {
            self.drag = None;
        }
        moved
    }
}

/// Seconds below.
fn axis(painter: &egui::Painter, rect: Rect, palette: &Palette, shown_s: f32) {
    let step = step_s(shown_s);
    let mut mark = step;
    while mark < shown_s {
        let at = pos2(rect.left() + rect.width() * mark / shown_s, rect.bottom());
        painter.vline(at.x, rect.y_range(), Stroke::new(1.0, palette.hairline));
        let (minutes, seconds) = ((mark / 60.0).floor(), mark % 60.0);
        let text = if shown_s < 60.0 { format!("{mark} s") } else { format!("{minutes:.0}:{seconds:02.0}") };
        painter.text(at + vec2(0.0, 1.0), Align2::CENTER_TOP, text, Palette::caption(), palette.soft);
        mark += step;
    }
}
