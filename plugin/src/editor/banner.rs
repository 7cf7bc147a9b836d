//! Error messages on top of the view.

use super::theme::{Palette, faded};
use super::{ctx::Ctx, widgets::button, words::Word};
use crate::parameter::Parameter;
use egui::{Color32, Frame, Margin, RichText, Ui};

/// The angle between both sides of a stereo input that is offered, degrees.
const STEREO_DEG: f32 = 60.0;

/// Shows a line for everything that is wrong; nothing when all is well.
pub(super) fn show(ui: &mut Ui, ctx: &mut Ctx<'_>) {
    let palette = ctx.palette;
    let from = &ctx.instance.loader.exchange;
    // A scene that is played all the same has a remark, no error.
    let scene_colour = if ctx.scene.is_some() { palette.warn } else { palette.error };
    for (name, report, colour, what) in [
        ("scene", &from.scene_report, scene_colour, "Scene"),
        ("sources", &from.sources_report, palette.warn, "Sources"),
        ("walk", &from.walk_report, palette.error, "Camera path"),
        ("source-walks", &from.source_walks_report, palette.error, "Path"),
        ("head", &from.head_report, palette.warn, "Head"),
        ("headphones", &from.headphones_report, palette.warn, "Headphones"),
    ] {
        let text = report.text();
        if !text.is_empty() && line(ui, ctx, name, what, &text, colour, Word::TryAgain) {
            ctx.instance.loader.retry();
            ctx.refresh();
        }
    }
    let outside = ctx.sources_outside();
    if ctx.params().further() > 0 && !outside.is_empty() {
        let sources = ctx.sources;
        let names = outside.iter().take(3).map(|source| sources.name(*source)).collect::<Vec<_>>().join(", ");
        let more = outside.len().saturating_sub(3);
        let rest = if more > 0 { format!(" and {more} more") } else { String::new() };
        let text = format!("Outside of the walls: {names}{rest}.");
        if line(ui, ctx, "outside", "Sources", &text, palette.warn, Word::Arrange) {
            ctx.arrange();
        }
    }
    let one = ctx.value(Parameter::Spread) == 0.0;
    let text = "Left and right cancel each other: one source plays their sum, of which next to nothing is left.";
    if ctx.frame.cancels && one && line(ui, ctx, "cancels", "Input", text, palette.warn, Word::TrueStereo) {
        ctx.set(Parameter::Spread, STEREO_DEG);
    }
}

/// A line with a button; returns whether that was clicked.
fn line(ui: &mut Ui, ctx: &Ctx<'_>, id: &str, what: &str, text: &str, colour: Color32, word: Word) -> bool {
    let (palette, mut clicked) = (ctx.palette, false);
    let fill = palette.panel.lerp_to_gamma(colour, 0.14);
    let frame = Frame::new().fill(fill).inner_margin(Margin::symmetric(12, 6));
    egui::Panel::top(("banner", id)).resizable(false).frame(frame).show_separator_line(false).show(ui, |ui| {
        ui.horizontal_wrapped(|ui| {
            ui.label(RichText::new(what).font(Palette::heading()).color(colour));
            ui.label(RichText::new(text).font(Palette::caption()).color(palette.text));
            clicked = button(ui, palette, word).clicked();
        });
        let rect = ui.min_rect();
        ui.painter().hline(rect.x_range(), rect.bottom() + 6.0, egui::Stroke::new(1.0, faded(colour, 0.5)));
    });
    clicked
}
