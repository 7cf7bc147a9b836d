//! Reverberation times of a drawn room: typed by octave or read of one measured response, and walls that follow.

use super::chooser::{FileField, FileKind};
use super::theme::{CONTROL, Palette, SPACE};
use super::widgets::{button, note};
use super::{ctx::Ctx, words::Word};
use crate::answers::reverberation::Wanted;
use crate::library::drawn_room::DrawnRoom;
use crate::parameter::cast::narrow;
use egui::{Align2, DragValue, Sense, Ui, Vec2};
use promenade_core::{OCTAVES_HZ, Scene};
use promenade_fault::with_causes;
use promenade_room::{Some7, T20_S, measured_t20_s};
use std::path::Path;

/// The octaves of a drawn room's times.
const OCTAVES: [Word; 7] =
    [Word::T20At125, Word::T20At250, Word::T20At500, Word::T20At1k, Word::T20At2k, Word::T20At4k, Word::T20At8k];
/// Octaves in a line, and the width of an octave's name, points.
const IN_LINE: usize = 2;
const NAME: f32 = 34.0;
/// Files of measured responses.
const KIND: FileKind = FileKind { name: "A measured response", extensions: &["wav", "sofa"] };
/// A factor that differs by less than this from the one that is heard is the same.
const SAME: f32 = 1e-3;

/// The times and what was last said of them.
#[derive(Default)]
pub(super) struct T20Part {
    file: FileField<Some7>,
}

impl T20Part {
    pub(super) fn show(&mut self, ui: &mut Ui, ctx: &Ctx<'_>, room: &DrawnRoom) {
        // What cannot be reached is said below, where the lowest drawer has no line left.
        egui::ScrollArea::vertical().id_salt("times").auto_shrink(false).show(ui, |ui| self.lines(ui, ctx, room));
    }

    fn lines(&mut self, ui: &mut Ui, ctx: &Ctx<'_>, room: &DrawnRoom) {
        ui.spacing_mut().item_spacing.y = 1.0;
        let present = |octave: usize| ctx.scene.map_or(0.0, |scene| late_t60_s(scene, OCTAVES_HZ[octave]));
        let heard = |octave: usize| room.t20_s[octave].unwrap_or_else(|| present(octave));
        for line in 0..OCTAVES.len().div_ceil(IN_LINE) {
            ui.horizontal(|ui| {
                ui.spacing_mut().item_spacing.x = SPACE;
                let whole = ui.available_width();
                for octave in (IN_LINE * line..IN_LINE * (line + 1)).filter(|o| *o < OCTAVES.len()) {
                    let width = (whole - SPACE) / IN_LINE as f32 - NAME - SPACE;
                    time(ui, ctx, room, octave, heard(octave), width);
                }
                if line + 1 == OCTAVES.len().div_ceil(IN_LINE)
                    && room.t20_s.iter().any(Option::is_some)
                    && button(ui, ctx.palette, Word::AsMaterials).clicked()
                {
                    ctx.draw(DrawnRoom { t20_s: [None; 7], factors: [1.0; 7], ..room.clone() });
                    ctx.touch();
                }
            });
        }
        self.open(ui, ctx, room);
        self.follow(ui, ctx, room);
    }

    /// A response from a file.
    fn open(&mut self, ui: &mut Ui, ctx: &Ctx<'_>, room: &DrawnRoom) {
        if let Some(times) = self.file.show(ui, ctx, ("WAV or SOFA", Word::OpenResponse, KIND), measured) {
            let within = |t: f64| narrow(t.clamp(T20_S.0, T20_S.1));
            ctx.draw(DrawnRoom { t20_s: times.map(|t| t.map(within)), ..room.clone() });
            ctx.touch();
        }
    }

    /// Has the walls follow the times, and says where they cannot.
    fn follow(&mut self, ui: &mut Ui, ctx: &Ctx<'_>, room: &DrawnRoom) {
        let Some((walls, t20_s)) = room.wanted() else { return };
        match ctx.views.reverberation(Wanted { walls, t20_s }).as_deref() {
            None => note(ui, ctx.palette, "The walls follow\u{2026}"),
            Some(Err(why)) => drop(ui.colored_label(ctx.palette.error, why)),
            Some(Ok(matched)) => {
                let factors = matched.factors.map(narrow);
                if factors.iter().zip(room.factors).any(|(new, old)| (new - old).abs() > SAME * old) {
                    ctx.draw(DrawnRoom { factors, ..room.clone() });
                    ctx.touch();
                }
                for missed in &matched.missed {
                    ui.colored_label(ctx.palette.warn, missed.to_string());
                }
            }
        }
    }
}

/// Reverberation time of a scene's late part at a frequency, seconds.
pub(super) fn late_t60_s(scene: &Scene, hz: f32) -> f32 {
    let times = &scene.tail().t60_s;
    scene.bands().weights(hz).into_iter().map(|(band, weight)| weight * times[band]).sum()
}

fn time(ui: &mut Ui, ctx: &Ctx<'_>, room: &DrawnRoom, octave: usize, heard_s: f32, width: f32) {
    let word = OCTAVES[octave];
    let (rect, response) = ui.allocate_exact_size(Vec2::new(NAME, CONTROL), Sense::hover());
    ui.painter().text(rect.left_center(), Align2::LEFT_CENTER, word.label(), Palette::caption(), ctx.palette.soft);
    response.on_hover_text(word.help());
    let typed = room.t20_s[octave].is_some();
    let mut seconds = f64::from(heard_s);
    let drag = DragValue::new(&mut seconds)
        .range(0.0..=T20_S.1)
        .speed(0.005)
        .custom_formatter(move |s, _| if typed { format!("{s:.2} s") } else { format!("({s:.2})") })
        .custom_parser(|text| text.trim_matches(['(', ')', 's', ' ']).parse().ok())
        .update_while_editing(false);
    let response = ui.add_sized(Vec2::new(width, CONTROL), drag).on_hover_text(word.help());
    if response.changed() {
        let mut room = room.clone();
        // Nought is nothing: the octave is that of the materials again.
        room.t20_s[octave] = (seconds >= T20_S.0).then_some(narrow(seconds));
        if room.t20_s[octave].is_none() {
            room.factors[octave] = 1.0;
        }
        ctx.draw(room);
    }
    if response.drag_stopped() || (response.changed() && !response.dragged()) {
        ctx.touch();
    }
}

fn measured(path: &Path) -> Result<Some7, String> {
    let (channels, rate_hz) = promenade_sofa::read_measured(path).map_err(|e| with_causes(&e))?;
    let times = measured_t20_s(&channels, rate_hz);
    if times.iter().all(Option::is_none) {
        return Err(format!("{}: no octave decays by 25 dB above the noise", path.display()));
    }
    Ok(times)
}
