//! Levels of the parts of the sound, the room's decay and width, distance and bass.

use super::controls::{slider, toggle};
use super::file_row::{FileRow, HEAD, HEADPHONES};
use super::widgets::{button, columns, dimmed, note};
use super::{ctx::Ctx, host::default_value, panel::Panel, theme::SPACE, words::Word};
use crate::parameter::Parameter;
use crate::playing::output::Output;
use egui::Ui;
use promenade_core::Scene;
use promenade_core::published::ConvMode;

/// What the panel sets, column by column.
const LEVELS: [Parameter; 3] = [Parameter::Direct, Parameter::Early, Parameter::Late];
const ROOM: [Parameter; 3] = [Parameter::Decay, Parameter::Width, Parameter::Law];
const REST: [Parameter; 3] = [Parameter::LowCut, Parameter::Spread, Parameter::WetSolo];

/// What a user changes about a scene's sound.
pub(super) struct SoundPanel {
    head: FileRow,
    headphones: FileRow,
}

impl Default for SoundPanel {
    fn default() -> Self {
        Self { head: FileRow::new(HEAD), headphones: FileRow::new(HEADPHONES) }
    }
}

impl Panel for SoundPanel {
    fn title(&self) -> Word {
        Word::Sound
    }

    fn show(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>) {
        let whole = ctx.scene.is_some_and(|scene| convolves(scene));
        let ears = ctx.instance.loader.output() == Output::Binaural;
        let far = ctx.scene.is_none_or(|scene| scene.emitter().is_some());
        columns(ui, [224.0, 224.0, 224.0], |ui, column| {
            ui.spacing_mut().item_spacing.y = SPACE;
            match column {
                0 => {
                    dimmed(ui, whole, |ui| LEVELS.into_iter().for_each(|parameter| slider(ui, ctx, parameter)));
                    dimmed(ui, !ears, |ui| self.head.show(ui, ctx));
                }
                1 => {
                    for parameter in ROOM {
                        let deaf = match parameter {
                            Parameter::Width => !ears,
                            Parameter::Law => !far,
                            _ => false,
                        };
                        dimmed(ui, whole || deaf, |ui| slider(ui, ctx, parameter));
                    }
                    dimmed(ui, !ears, |ui| self.headphones.show(ui, ctx));
                }
                _ => {
                    slider(ui, ctx, Parameter::LowCut);
                    dimmed(ui, !far, |ui| slider(ui, ctx, Parameter::Spread));
                    ui.horizontal(|ui| {
                        toggle(ui, ctx, Parameter::WetSolo);
                        if button(ui, ctx.palette, Word::Neutral).clicked() {
                            neutral(ctx);
                        }
                    });
                    limits(ui, ctx, far, ears);
                }
            }
        });
    }
}

/// Sets all to where they change nothing.
fn neutral(ctx: &mut Ctx<'_>) {
    for parameter in LEVELS.into_iter().chain(ROOM).chain(REST) {
        let usual = default_value(ctx.params(), parameter);
        ctx.set(parameter, usual);
    }
}

/// Whether a published model plays a scene.
fn convolves(scene: &Scene) -> bool {
    scene.cloud().is_some_and(|cloud| cloud.conv != ConvMode::Off)
}

/// What of this has no effect on what is heard now.
fn limits(ui: &mut Ui, ctx: &Ctx<'_>, far: bool, ears: bool) {
    match ctx.scene {
        _ if !ears => note(ui, ctx.palette, "Ambisonics go out: head, headphones and width are for ears."),
        Some(scene) if convolves(scene) => {
            note(ui, ctx.palette, "A published model is played that knows no parts: only the low cut acts on it.");
        }
        _ if !far => {
            note(ui, ctx.palette, "The scene does not know where its source is: neither distance nor stereo has an effect.")
        }
        _ if ctx.value(Parameter::Decay) > 1.0 && ctx.scene.is_some_and(|scene| scene.measured().is_some()) => {
            note(ui, ctx.palette, "A measured room's bass rings no longer than was measured: at 200 % it ends 30 dB down.");
        }
        _ => (),
    }
}
