//! The drawer under the view: one panel at a time, by tabs.

use super::ctx::Ctx;
use super::ears_panel::EarsPanel;
use super::osc_panel::OscPanel;
use super::path_panel::PathPanel;
use super::presets_panel::PresetsPanel;
use egui::Ui;

/// A panel of the drawer.
pub trait Panel: Send {
    /// Name of its tab.
    fn title(&self) -> &'static str;
    /// Shows it; the height is given, the width is that of the view.
    fn show(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>);
}

/// All panels, in the order of their tabs.
#[must_use]
pub fn panels() -> Vec<Box<dyn Panel>> {
    vec![Box::new(EarsPanel), Box::<PathPanel>::default(), Box::<OscPanel>::default(), Box::<PresetsPanel>::default()]
}
