//! What a panel of the drawer under the view has to do.

use super::{ctx::Ctx, words::Word};
use egui::Ui;

/// A panel of the drawer.
pub trait Panel: Send {
    /// Its tab.
    fn title(&self) -> Word;
    /// Whether the instance has it.
    fn is_there(&self, _ctx: &Ctx<'_>) -> bool {
        true
    }
    /// Shows it; the height is given, the width is that of the view.
    fn show(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>);
}
