//! Error messages on top of the view.

use super::ctx::Ctx;
use super::theme::{Palette, faded};
use super::widgets::button;
use super::words::Word;
use egui::{Color32, Frame, Margin, RichText, Ui};

/// Shows a line for everything that is wrong; nothing when all is well.
pub(super) fn show(ui: &mut Ui, ctx: &Ctx<'_>) {
    let palette = ctx.palette;
    let from = &ctx.instance.loader.exchange;
    let [scene, sources, walk, source_walks, head, headphones] = [
        &from.scene_report,
        &from.sources_report,
        &from.walk_report,
        &from.source_walks_report,
        &from.head_report,
        &from.headphones_report,
    ]
    .map(|report| report.text());
    // A scene that is played all the same has a remark, no error.
    let scene_colour = if ctx.scene.is_some() { palette.warn } else { palette.error };
    for (name, text, colour, what) in [
        ("scene", &scene, scene_colour, "Scene"),
        ("sources", &sources, palette.warn, "Sources"),
        ("walk", &walk, palette.error, "Camera path"),
        ("source-walks", &source_walks, palette.error, "Path"),
        ("head", &head, palette.warn, "Head"),
        ("headphones", &headphones, palette.warn, "Headphones"),
    ] {
        if !text.is_empty() {
            line(ui, ctx, name, what, text, colour);
        }
    }
}

fn line(ui: &mut Ui, ctx: &Ctx<'_>, id: &str, what: &str, text: &str, colour: Color32) {
    let palette = ctx.palette;
    let fill = palette.panel.lerp_to_gamma(colour, 0.14);
    let frame = Frame::new().fill(fill).inner_margin(Margin::symmetric(12, 6));
    egui::Panel::top(("banner", id)).resizable(false).frame(frame).show_separator_line(false).show(ui, |ui| {
        ui.horizontal_wrapped(|ui| {
            ui.label(RichText::new(what).font(Palette::heading()).color(colour));
            ui.label(RichText::new(text).font(Palette::caption()).color(palette.text));
            if button(ui, palette, Word::TryAgain).clicked() {
                ctx.instance.loader.retry();
                ctx.refresh();
            }
        });
        let rect = ui.min_rect();
        ui.painter().hline(rect.x_range(), rect.bottom() + 6.0, egui::Stroke::new(1.0, faded(colour, 0.5)));
    });
}
