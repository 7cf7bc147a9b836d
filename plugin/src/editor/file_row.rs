//! Files that the project takes over: a head, headphones.

use super::chooser::{FileField, FileKind};
use super::widgets::{button, heading, note};
use super::{ctx::Ctx, words::Word};
use crate::history::user_state::UserState;
use crate::project::{exchange::Exchange, file_wish::FileWish, params::PromenadeParams};
use egui::Ui;

/// What a file is of.
pub(super) struct FileOf {
    kind: FileKind,
    heading: Word,
    choose: Word,
    /// Goes back to what is heard without a file.
    none: Word,
    hint: &'static str,
    wish: fn(&Exchange) -> &FileWish,
    /// What is heard with, by name; `None` without a file.
    name: fn(&PromenadeParams, &Exchange) -> Option<String>,
}

/// The head that is heard with: the scene's own, or the user's.
pub(super) const HEAD: FileOf = FileOf {
    kind: FileKind { name: "Measured head (SOFA)", extensions: &["sofa"] },
    heading: Word::Head,
    choose: Word::UseHead,
    none: Word::OwnHead,
    hint: "SOFA file of your ears",
    wish: |exchange| &exchange.head_wish,
    name: |params, exchange| params.head.get().0.is_some().then(|| exchange.head_name.text()),
};

/// What the listener's headphones need.
pub(super) const HEADPHONES: FileOf = FileOf {
    kind: FileKind { name: "Headphones (AutoEq, SOFA)", extensions: &["txt", "sofa"] },
    heading: Word::Headphones,
    choose: Word::UseHeadphones,
    none: Word::NoHeadphones,
    hint: "AutoEq .txt or SOFA",
    wish: |exchange| &exchange.headphones_wish,
    name: |params, _| {
        let (saved, _) = params.headphones.get();
        saved.headphones.is_some().then(|| saved.name.chars().take(LONGEST_NAME).collect())
    },
};

/// Characters of a name that are shown, at most.
const LONGEST_NAME: usize = 60;

/// Chooses a file.
pub(super) struct FileRow {
    of: FileOf,
    file: FileField<String>,
    /// How many answers of the loader the host knows of; `None` until the first picture.
    told: Option<u32>,
    /// The state before the file that is being read.
    before: Option<UserState>,
}

impl FileRow {
    pub(super) fn new(of: FileOf) -> Self {
        Self { of, file: FileField::default(), told: None, before: None }
    }

    /// Shows it.
    pub(super) fn show(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>) {
        heading(ui, ctx.palette, self.of.heading);
        let used = (self.of.name)(ctx.params(), &ctx.instance.loader.exchange);
        // In the field, because the window has no line to spare.
        let hint = used.as_deref().filter(|name| !name.is_empty()).unwrap_or(self.of.hint);
        let field = (hint, self.of.choose, self.of.kind);
        if let Some(file) = self.file.show(ui, ctx, field, |path| Ok(path.display().to_string())) {
            self.ask(ctx, &file);
        }
        // The field cuts names, of which those of one data base begin alike.
        if let Some(name) = used.as_deref().filter(|name| !name.is_empty() && self.of.heading == Word::Head) {
            note(ui, ctx.palette, name);
        }
        if used.is_some() && button(ui, ctx.palette, self.of.none).clicked() {
            self.ask(ctx, "");
        }
        self.tell(ctx);
    }

    fn ask(&mut self, ctx: &Ctx<'_>, file: &str) {
        self.before = Some(UserState::of(ctx.params()));
        (self.of.wish)(&ctx.instance.loader.exchange).ask(file);
        ctx.refresh();
    }

    /// Tells the host that the project has changed, as only an open editor can.
    fn tell(&mut self, ctx: &mut Ctx<'_>) {
        let answered = (self.of.wish)(&ctx.instance.loader.exchange).answered();
        if self.told.replace(answered).is_some_and(|told| told != answered) {
            ctx.touch();
            if let Some(before) = self.before.take() {
                ctx.history.record(before, &UserState::of(&ctx.instance.params));
            }
        }
    }
}
