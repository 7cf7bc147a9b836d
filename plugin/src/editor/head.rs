//! The head that is heard with: the scene's own, or the user's.

use super::chooser::{Chooser, FileKind, Place};
use super::ctx::Ctx;
use super::theme::{CONTROL, SPACE};
use super::widgets::{button, heading, note};
use super::words::Word;
use crate::user_state::UserState;
use egui::{Key, TextEdit, Ui, Vec2};

const KIND: FileKind = FileKind { name: "Measured head (SOFA)", extensions: &["sofa"] };

/// Room for the button beside the field, points.
const CHOOSE: f32 = 72.0;

/// Chooses a head.
#[derive(Default)]
pub(super) struct HeadRow {
    file: String,
    chooser: Chooser<String>,
    /// Why nothing was chosen.
    why_not: Option<String>,
    /// How many answers of the loader the host knows of; `None` until the first picture.
    told: Option<u32>,
    /// The state before the head that is being read.
    before: Option<UserState>,
}

impl HeadRow {
    /// Shows it.
    pub(super) fn show(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>) {
        heading(ui, ctx.palette, Word::Head);
        let (saved, _) = ctx.params().head.get();
        // In the field, because the window has no line to spare.
        let name = ctx.params().head_name.text();
        let hint = if name.is_empty() { "Your own: a SOFA file" } else { &name };
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = SPACE;
            let place = Vec2::new(ui.available_width() - CHOOSE, CONTROL);
            let typed = ui.add_sized(place, TextEdit::singleline(&mut self.file).hint_text(hint));
            let entered = typed.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter));
            let free = !self.chooser.is_busy();
            let clicked = ui.add_enabled_ui(free, |ui| button(ui, ctx.palette, Word::UseHead)).inner.clicked();
            if free && (clicked || (entered && !self.file.trim().is_empty())) {
                let place = Place::typed_or(&self.file, Place::Existing);
                let named = |path: &std::path::Path| Ok(path.display().to_string());
                self.why_not = self.chooser.ask(ctx, KIND, place, named).err();
            }
        });
        if saved.is_some() && button(ui, ctx.palette, Word::OwnHead).clicked() {
            self.ask(ctx, "");
        }
        match self.chooser.take() {
            Some(Ok(file)) => {
                self.ask(ctx, &file);
                self.file.clear();
            }
            Some(Err(why)) => self.why_not = Some(why),
            None => (),
        }
        if let Some(why) = &self.why_not {
            note(ui, ctx.palette, why);
        }
        self.tell(ctx);
    }

    fn ask(&mut self, ctx: &Ctx<'_>, file: &str) {
        self.why_not = None;
        self.before = Some(UserState::of(ctx.params()));
        ctx.params().head_wish.ask(file);
        ctx.refresh();
    }

    /// Tells the host that the project has another head, as only an open editor can.
    fn tell(&mut self, ctx: &mut Ctx<'_>) {
        let answered = ctx.params().head_wish.answered();
        if self.told.replace(answered).is_some_and(|told| told != answered) {
            ctx.touch();
            if let Some(before) = self.before.take() {
                ctx.history.record(before, &UserState::of(&ctx.instance.params));
            }
        }
    }
}
