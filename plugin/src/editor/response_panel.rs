//! The response of what is heard: how it decays and what it leaves of each frequency.

use super::plot::{Plot, along, hertz_text};
use super::theme::{CONTROL, Palette, SPACE};
use super::{ctx::Ctx, panel::Panel, widgets::segments, words::Word};
use crate::answers::response::{DECAY_FLOOR_DB, DECAY_POINTS, Listening, Response};
use crate::listener::snapshot::Snapshot;
use crate::telemetry::{FLOOR_DB, frequency_hz, hertz};
use egui::{Align2, Color32, Painter, Pos2, Rect, Sense, Shape, Stroke, Ui, UiBuilder, pos2, vec2};
use promenade_core::Pose;

/// The whole, and the octaves of [`OCTAVES_HZ`].
const BANDS: [&str; 8] = ["All", "125", "250", "500", "1k", "2k", "4k", "8k"];
/// Range of both plots, dB; the floor of a decay lies below it.
const DECAY_DB: (f32, f32) = (-72.0, 0.0);
const SPECTRUM_DB: (f32, f32) = (-48.0, 24.0);
/// Most and least width of the row of octaves, points.
const BAND_WIDTHS: (f32, f32) = (340.0, 240.0);
/// Width of the figures beside it, points.
const FIGURES: f32 = 190.0;

/// Shows the response at the pose that is heard.
#[derive(Default)]
pub(super) struct ResponsePanel {
    /// Number of the octave in [`BANDS`].
    band: usize,
}

impl Panel for ResponsePanel {
    fn title(&self) -> Word {
        Word::Response
    }

    fn show(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>) {
        let (rect, _) = ui.allocate_exact_size(ui.available_size(), Sense::hover());
        let rect = rect.shrink2(vec2(4.0, 0.0)).with_max_y(rect.bottom() - 8.0);
        let response = self.response(ctx);
        let top = rect.with_max_y(rect.top() + CONTROL);
        let bands = (top.width() - FIGURES).clamp(BAND_WIDTHS.1, BAND_WIDTHS.0);
        ui.scope_builder(UiBuilder::new().max_rect(top.with_max_x(top.left() + bands)), |ui| {
            let help = |band: usize| Ok(if band == 0 { Word::AllOctaves.help() } else { Word::OneOctave.help() }.to_owned());
            if let Some(band) = segments(ui, ctx.palette, &BANDS, self.band, help) {
                self.band = band;
            }
        });
        figures(ui, top.with_min_x(top.left() + bands + 2.0 * SPACE), ctx.palette, response.as_ref());
        let plots = rect.with_min_y(top.bottom() + SPACE);
        let middle = plots.center().x;
        let response = response.as_ref().map(|(response, _)| &**response);
        decay(ui, plots.with_max_x(middle - SPACE), ctx.palette, response);
        spectrum(ui, plots.with_min_x(middle + SPACE), ctx.palette, response);
    }
}

impl ResponsePanel {
    /// The newest response, and whether it is that of what is heard now.
    fn response(&self, ctx: &Ctx<'_>) -> Option<(std::sync::Arc<Response>, bool)> {
        let (scene, rate_hz) = (ctx.scene?, ctx.instance.loader.sample_rate_hz()?);
        let heard = ctx.frame.pose;
        let home = scene.emitter().unwrap_or_default();
        let pose = Pose { position: heard.position + home - ctx.source_at(home, 0), ..heard };
        let block = <Snapshot>::of(ctx.params(), None).block;
        let octave = self.band.checked_sub(1);
        ctx.views.response(Listening::new(scene, rate_hz, pose, block, octave))
    }
}

/// T20 and C50.
fn figures(ui: &mut Ui, rect: Rect, palette: &Palette, response: Option<&(std::sync::Arc<Response>, bool)>) {
    let t20 = response.and_then(|(response, _)| response.t20_s).map_or("\u{2013}".to_owned(), |t20| format!("{t20:.2} s"));
    let c50 = response.and_then(|(response, _)| response.c50_db).map_or("\u{2013}".to_owned(), |c50| format!("{c50:.1} dB"));
    let fresh = response.is_some_and(|(_, fresh)| *fresh);
    let colour = if fresh { palette.text } else { palette.soft };
    let half = rect.width() / 2.0;
    for (place, word, value) in
        [(rect.with_max_x(rect.left() + half), Word::T20, t20), (rect.with_min_x(rect.left() + half), Word::C50, c50)]
    {
        let painter = ui.painter();
        let name = painter.text(place.left_center(), Align2::LEFT_CENTER, word.label(), Palette::body(), palette.soft);
        painter.text(name.right_center() + vec2(SPACE, 0.0), Align2::LEFT_CENTER, value, Palette::body(), colour);
        ui.interact(place, ui.scope_id().with(word.label()), Sense::hover()).on_hover_text(word.help());
    }
}

/// Writes a plot's name, which explains it; returns where the pointer is in the plot.
fn pointer(ui: &Ui, plot: &Plot, word: Word, palette: &Palette) -> Option<Pos2> {
    let at = plot.rect.left_bottom() + vec2(8.0, -4.0);
    let name = ui.painter().text(at, Align2::LEFT_BOTTOM, word.label(), Palette::body(), palette.soft);
    ui.interact(name, ui.scope_id().with(word.label()), Sense::hover()).on_hover_text(word.help());
    let plot = ui.interact(plot.rect, ui.scope_id().with((word.label(), "plot")), Sense::hover()).hover_pos();
    plot.filter(|at| !name.contains(*at))
}

/// What is written in a plot that has no curve yet.
fn waiting(painter: &Painter, plot: &Plot, palette: &Palette) {
    painter.text(plot.rect.center(), Align2::CENTER_CENTER, "No response yet", Palette::caption(), palette.soft);
}

fn line(painter: &Painter, points: impl Iterator<Item = Pos2>, colour: Color32) {
    painter.add(Shape::line(points.collect(), Stroke::new(2.0, colour)));
}

fn decay(ui: &mut Ui, rect: Rect, palette: &Palette, response: Option<&Response>) {
    let plot = Plot::new(ui.painter(), rect, DECAY_DB, palette);
    let inside = ui.painter().with_clip_rect(plot.rect);
    let pointer = pointer(ui, &plot, Word::DecayCurve, palette);
    let Some(response) = response else { return waiting(&inside, &plot, palette) };
    plot.times(ui.painter(), response.seconds, palette);
    for (curve, colour) in response.decay_db.iter().zip([palette.left, palette.right]) {
        let shown = curve.partition_point(|db| *db > DECAY_FLOOR_DB);
        let at = |(point, db): (usize, &f32)| pos2(plot.x(point as f32 / (DECAY_POINTS - 1) as f32), plot.y(*db));
        line(&inside, curve.iter().enumerate().take(shown + 1).map(at), colour);
    }
    plot.legend(&inside, pointer, &response.decay_db, |along| format!("{:.2} s", along * response.seconds), palette);
}

fn spectrum(ui: &mut Ui, rect: Rect, palette: &Palette, response: Option<&Response>) {
    let plot = Plot::new(ui.painter(), rect, SPECTRUM_DB, palette);
    plot.frequencies(ui.painter(), palette);
    let inside = ui.painter().with_clip_rect(plot.rect);
    let pointer = pointer(ui, &plot, Word::Spectrum, palette);
    let Some(response) = response else { return waiting(&inside, &plot, palette) };
    for (curve, colour) in response.spectrum_db.iter().zip([palette.left, palette.right]) {
        let known = curve.iter().enumerate().filter(|(_, db)| **db > FLOOR_DB);
        line(&inside, known.map(|(point, db)| pos2(plot.x(along(frequency_hz(point))), plot.y(*db))), colour);
    }
    plot.legend(&inside, pointer, &response.spectrum_db, |along| hertz_text(hertz(along)), palette);
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_core::OCTAVES_HZ;

    #[test]
    fn every_octave_has_its_name() {
        assert_eq!(BANDS.len(), OCTAVES_HZ.len() + 1);
        for (name, hz) in BANDS[1..].iter().zip(OCTAVES_HZ) {
            let read = name.strip_suffix('k').map_or_else(|| name.parse(), |k| k.parse().map(|k: f32| 1e3 * k));
            assert_eq!(read, Ok(hz));
        }
        assert!(DECAY_DB.0 < DECAY_FLOOR_DB);
    }
}
