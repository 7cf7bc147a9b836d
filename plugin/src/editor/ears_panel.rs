//! What both ears hear of the direct sound.

use super::ctx::Ctx;
use super::panel::Panel;
use super::widgets::note;
use egui::Ui;

/// Masks over frequency, level and time between the ears.
pub(super) struct EarsPanel;

impl Panel for EarsPanel {
    fn title(&self) -> &'static str {
        "Ears"
    }

    fn show(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>) {
        note(ui, ctx.palette, format!("{:+.1} dB, {:+.0} us", ctx.frame.ild_db, ctx.frame.itd_s * 1e6));
    }
}
