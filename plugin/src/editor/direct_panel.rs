//! What both ears hear of the direct sound.

use super::plot::{Plot, along, hertz_text};
use super::theme::{Palette, faded};
use super::{ctx::Ctx, direction::dial, panel::Panel, words::Word};
use crate::telemetry::{HIGHEST_HZ, MASK_POINTS, frequency_hz, hertz};
use egui::{Align2, Color32, Painter, Pos2, Rect, Sense, Shape, Stroke, Ui, UiBuilder, pos2, vec2};

/// Range of the plot, dB.
const RANGE_DB: (f32, f32) = (-60.0, 12.0);
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

fn spectrum(painter: &Painter, rect: Rect, ctx: &Ctx<'_>, pointer: Option<Pos2>) {
    let palette = ctx.palette;
    let plot = Plot::new(painter, rect, RANGE_DB, palette);
    plot.frequencies(painter, palette);
    let inside = painter.with_clip_rect(plot.rect);
    let Some(scene) = ctx.scene else {
        let none = "No scene: the dry sound passes";
        inside.text(plot.rect.center(), Align2::CENTER_CENTER, none, Palette::caption(), palette.soft);
        return;
    };
    let top_hz = scene.top_hz();
    for (masks, colour) in ctx.frame.masks_db.iter().zip([palette.left, palette.right]) {
        curve(&inside, masks, colour, top_hz, &plot);
    }
    if top_hz < HIGHEST_HZ * 0.99 {
        let top = plot.x(along(top_hz));
        inside.vline(top, plot.rect.y_range(), Stroke::new(1.0, faded(palette.soft, 0.5)));
        if plot.rect.right() - top > 56.0 {
            let at = pos2(top + 6.0, plot.rect.bottom() - 4.0);
            inside.text(at, Align2::LEFT_BOTTOM, "no data", Palette::caption(), palette.soft);
        }
    }
    let hover = pointer.filter(|at| plot.rect.contains(*at));
    plot.legend(&inside, hover, &ctx.frame.masks_db, |along| hertz_text(hertz(along)), palette);
}

/// A mask: faint above what the data cover.
fn curve(painter: &Painter, masks: &[f32; MASK_POINTS], colour: Color32, top_hz: f32, plot: &Plot) {
    let place = |(point, db): (usize, &f32)| pos2(plot.x(along(frequency_hz(point))), plot.y(*db));
    let points = masks.iter().enumerate().map(place).collect::<Vec<_>>();
    let cut = points.partition_point(|at| at.x <= plot.x(along(top_hz))).clamp(1, points.len());
    painter.add(Shape::line(points[..cut].to_vec(), Stroke::new(2.0, colour)));
    painter.add(Shape::line(points[cut - 1..].to_vec(), Stroke::new(1.5, faded(colour, 0.35))));
}
