//! A room to draw: three lengths, six materials, and how it then reverberates.

use super::t20::{T20Part, late_t60_s};
use super::theme::{CONTROL, SPACE};
use super::widgets::{button, columns, drop_down, fact, field, fits, note, outcome, row};
use super::{ctx::Ctx, panel::Panel, words::Word};
use crate::library::{self, drawn_room::DrawnRoom};
use egui::{DragValue, Ui, Vec2};
use promenade_fault::with_causes;
use promenade_room::SIZES_M;
use std::ops::Range;

/// Width of a row's name, points.
const NAME: f32 = 52.0;
/// Each length with its axis.
const LENGTHS: [Word; 3] = [Word::Length, Word::Width, Word::Height];
/// Walls in the order of [`DrawnRoom::materials`].
const WALLS: [Word; 6] = [Word::BackWall, Word::FrontWall, Word::RightWall, Word::LeftWall, Word::Floor, Word::Ceiling];
/// Least widths of the columns: lengths, materials twice, times, figures; and where that does not fit, materials once.
/// Points.
const WIDE: [f32; 5] = [112.0, 168.0, 168.0, 176.0, 128.0];
const NARROW: [f32; 4] = [112.0, 180.0, 176.0, 128.0];

/// Draws a room and saves it.
#[derive(Default)]
pub(super) struct RoomPanel {
    title: String,
    t20: T20Part,
    /// What was done last, or what went wrong.
    outcome: Option<Result<String, String>>,
}

/// A part of the panel.
#[derive(Clone)]
enum Part {
    Lengths,
    Walls(Range<usize>),
    Times,
    Figures,
}

impl Panel for RoomPanel {
    fn title(&self) -> Word {
        Word::Room
    }

    fn show(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>) {
        let Some(room) = ctx.drawn_room() else {
            note(ui, ctx.palette, "No drawn room is played.");
            if button(ui, ctx.palette, Word::DrawRoom).clicked() {
                ctx.choose_room();
            }
            return;
        };
        let mut show = |ui: &mut Ui, part: Part| {
            // Six lines fit into the lowest drawer.
            ui.spacing_mut().item_spacing.y =
                if matches!(&part, Part::Times) || matches!(&part, Part::Walls(walls) if walls.len() > 3) {
                    1.0
                } else {
                    SPACE
                };
            match part {
                Part::Lengths => lengths(ui, ctx, &room),
                Part::Walls(walls) => walls.for_each(|wall| material(ui, ctx, &room, wall)),
                Part::Times => self.t20.show(ui, ctx, &room),
                Part::Figures => self.save(ui, ctx),
            }
        };
        if fits(ui.available_width(), WIDE) {
            columns(ui, WIDE, |ui, column| {
                let parts = [Part::Lengths, Part::Walls(0..3), Part::Walls(3..6), Part::Times, Part::Figures];
                show(ui, parts[column].clone());
            });
        } else {
            columns(ui, NARROW, |ui, column| {
                show(ui, [Part::Lengths, Part::Walls(0..6), Part::Times, Part::Figures][column].clone());
            });
        }
    }
}

fn lengths(ui: &mut Ui, ctx: &Ctx<'_>, room: &DrawnRoom) {
    for (axis, word) in LENGTHS.into_iter().enumerate() {
        row(ui, ctx.palette, word, NAME, |ui| {
            let mut length = f64::from(room.size[axis]);
            let drag = DragValue::new(&mut length)
                .range(SIZES_M.0..=SIZES_M.1)
                .speed(0.02)
                .fixed_decimals(2)
                .update_while_editing(false)
                .suffix(" m");
            let response = ui.add_sized(Vec2::new(ui.available_width(), CONTROL), drag).on_hover_text(word.help());
            if response.changed() {
                let mut room = room.clone();
                room.set_length(axis, crate::parameter::cast::narrow(length));
                ctx.draw(room);
            }
            // One change for the host, not one for each picture.
            if response.drag_stopped() || (response.changed() && !response.dragged()) {
                ctx.touch();
            }
        });
    }
    fact(ui, ctx.palette, Word::Volume, &format!("{:.1} m³", room.size.iter().product::<f32>()));
    if !room.holds(ctx.frame.pose.position) {
        ui.colored_label(ctx.palette.warn, "The listener is outside");
    }
}

fn material(ui: &mut Ui, ctx: &Ctx<'_>, room: &DrawnRoom, wall: usize) {
    let table = DrawnRoom::materials_of_table().collect::<Vec<_>>();
    let plain = |name: &str| name.replace('_', " ");
    let chosen = table.iter().position(|(name, _)| *name == room.materials[wall]).unwrap_or(usize::MAX);
    let help = |index: usize| table.get(index).map_or(WALLS[wall].help(), |(_, entry)| entry.description.as_str());
    row(ui, ctx.palette, WALLS[wall], NAME, |ui| {
        let names = table.iter().map(|(name, _)| plain(name));
        if let Some(index) = drop_down(ui, WALLS[wall].label(), &plain(&room.materials[wall]), names, chosen, help) {
            let mut room = room.clone();
            table[index].0.clone_into(&mut room.materials[wall]);
            ctx.draw(room);
            ctx.touch();
        }
    });
}

impl RoomPanel {
    fn save(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>) {
        let palette = ctx.palette;
        if let Some(scene) = ctx.scene {
            let middle = 0.5 * (late_t60_s(scene, 500.0) + late_t60_s(scene, 1000.0));
            fact(ui, palette, Word::Reverberation, &format!("{middle:.2} s"));
        }
        let entered =
            field(ui, &mut self.title, "Name of the scene").lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter));
        ui.horizontal(|ui| {
            let named = !self.title.trim().is_empty();
            let clicked = ui.add_enabled_ui(named, |ui| button(ui, palette, Word::SaveScene)).inner.clicked();
            if named
                && (clicked || entered)
                && let Some(scene) = ctx.scene
            {
                let saved = library::save(&library::folders(), &self.title, scene);
                self.outcome = Some(saved.map(|path| format!("Saved as {}", path.display())).map_err(|e| with_causes(&e)));
                ctx.selection.relist = true;
            }
        });
        outcome(ui, palette, self.outcome.as_ref(), "");
    }
}
