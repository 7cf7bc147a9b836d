//! The view of the place.

use super::ctx::Ctx;
use super::theme::Palette;
use egui::{Align2, Ui};

/// How the place is looked at.
#[derive(Default)]
pub(super) struct View {}

impl View {
    /// Shows the place.
    pub(super) fn show(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>) {
        let title = ctx.scene.map_or("No scene", |scene| scene.title());
        ui.painter().text(ui.max_rect().center(), Align2::CENTER_CENTER, title, Palette::heading(), ctx.palette.text);
    }
}
