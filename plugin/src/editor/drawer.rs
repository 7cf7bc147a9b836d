//! The drawer under the view: one panel at a time, by tabs.

use super::theme::{CONTROL, SPACE};
use super::{
    ctx::Ctx, direct_panel::DirectPanel, osc_panel::OscPanel, panel::Panel, path_panel::PathPanel, quality_panel::QualityPanel,
    response_panel::ResponsePanel, room_panel::RoomPanel, sound_panel::SoundPanel, sources_panel::SourcesPanel, widgets::tabs,
};
use egui::{Align, Frame, Layout, Margin, Sense, Ui, UiBuilder, vec2};

/// Height of an open drawer, points.
const HEIGHT: f32 = 208.0;

/// All panels, in the order of their tabs.
pub(super) fn panels() -> Vec<Box<dyn Panel>> {
    vec![
        Box::<SourcesPanel>::default(),
        Box::new(DirectPanel),
        Box::<ResponsePanel>::default(),
        Box::new(SoundPanel::default()),
        Box::<RoomPanel>::default(),
        Box::<PathPanel>::default(),
        Box::new(QualityPanel),
        Box::<OscPanel>::default(),
    ]
}

/// Shows the tabs, and the panel of the chosen one.
pub(super) fn show(ui: &mut Ui, ctx: &mut Ctx<'_>, panels: &mut [Box<dyn Panel>]) {
    let frame = Frame::new().fill(ctx.palette.panel).inner_margin(Margin::symmetric(8, 0));
    let mut panels: Vec<_> = panels.iter_mut().filter(|panel| panel.is_there(ctx)).collect();
    let chosen = panels.iter().position(|panel| panel.title().label() == ctx.settings.tab).unwrap_or(0);
    let bar = CONTROL + 2.0 * SPACE;
    // A low window leaves at least as much to the view.
    let height = if ctx.settings.drawer { HEIGHT.min(ui.available_height() * 0.44).max(bar) } else { bar };
    egui::Panel::bottom("drawer").exact_size(height).resizable(false).frame(frame).show(ui, |ui| {
        let words = panels.iter().map(|panel| panel.title()).collect::<Vec<_>>();
        let (row, _) = ui.allocate_exact_size(vec2(ui.available_width(), bar), Sense::hover());
        let row = UiBuilder::new().max_rect(row).layout(Layout::left_to_right(Align::Center));
        ui.scope_builder(row, |ui| {
            let on = ctx.settings.drawer.then_some(chosen);
            if let Some(index) = tabs(ui, ctx.palette, &words, on) {
                ctx.settings.drawer = on != Some(index);
                words[index].label().clone_into(&mut ctx.settings.tab);
            }
        });
        if ctx.settings.drawer
            && let Some(panel) = panels.get_mut(chosen)
        {
            panel.show(ui, ctx);
        }
    });
}
