//! The panel on the right: pose, sources, output.

use super::controls::{follow_path, list, number, slider};
use super::path_panel::{read, take};
use super::theme::{CONTROL, Palette, SPACE};
use super::widgets::{button, drop_down, heading, labelled, note, segments, title};
use super::{loudness, pose_source};
use super::{ctx::Ctx, direction::seen_from, meter::Meters, source_path::SourcePath, view::reset, words::Word};
use crate::parameter::choices::{Choice, Variants};
use crate::parameter::source_knob::{Part, SourceKnob};
use crate::parameter::{Parameter, row::SlotKind};
use crate::project::scene_frame::from_polar;
use egui::{Align, Align2, DragValue, Frame, Layout, Margin, Rect, ScrollArea, Sense, Ui, UiBuilder, Vec2};
use promenade_core::Pose;
use std::path::PathBuf;

/// Width, points.
const WIDTH: f32 = 248.0;
/// Room for the scroll bar, points.
const BAR: i8 = 8;
/// Height of mix, gain and meters with the space above, points.
const OUTPUT: f32 = 172.0;

/// Shows it.
pub(super) fn right(ui: &mut Ui, ctx: &mut Ctx<'_>, path: &mut SourcePath, meters: &mut Meters) {
    let frame = Frame::new().fill(ctx.palette.panel).inner_margin(Margin { left: 12, right: 4, top: 4, bottom: 4 });
    egui::Panel::right("controls").exact_size(WIDTH).resizable(false).frame(frame).show(ui, |ui| {
        // What goes out is seen at every size.
        let controls = (ui.available_height() - OUTPUT).max(0.0);
        ScrollArea::vertical().max_height(controls).auto_shrink(false).show(ui, |ui| {
            ui.set_width(ui.available_width() - f32::from(BAR));
            ui.spacing_mut().item_spacing.y = SPACE;
            pose(ui, ctx);
            movement(ui, ctx);
            source(ui, ctx, path);
        });
        ui.add_space(SPACE);
        ui.spacing_mut().item_spacing.y = SPACE;
        let below = Frame::new().inner_margin(Margin { right: BAR, ..Margin::ZERO });
        below.show(ui, |ui| {
            heading(ui, ctx.palette, Word::Output);
            slider(ui, ctx, Parameter::Mix);
            slider(ui, ctx, Parameter::Gain);
            meters.show(ui, ctx.palette);
            loudness::show(ui, ctx);
        });
    });
}

fn pose(ui: &mut Ui, ctx: &mut Ctx<'_>) {
    let palette = ctx.palette;
    ui.horizontal(|ui| {
        title(ui, palette, Word::Listener);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if button(ui, palette, Word::Reset).clicked() {
                reset(ctx);
            }
        });
    });
    origin(ui, ctx);
    triple(ui, ctx, [Parameter::X, Parameter::Y, Parameter::Z]);
    triple(ui, ctx, [Parameter::Yaw, Parameter::Pitch, Parameter::Roll]);
}

/// Place and path of the source, or where there are several, of the one that is chosen.
fn source(ui: &mut Ui, ctx: &mut Ctx<'_>, path: &mut SourcePath) {
    heading(ui, ctx.palette, Word::Source);
    let further = ctx.params().further();
    let chosen = ctx.selection.source.min(further);
    if further > 0 {
        let sources = ctx.sources;
        let name = |source| match sources.name(source) {
            name if name == format!("Source {}", source + 1) => name,
            name => format!("{}  {name}", source + 1),
        };
        let names = (0..=further).map(name);
        if let Some(source) = drop_down(ui, "source", &name(chosen), names, chosen, |_| Word::Source.help()) {
            ctx.selection.source = source;
        }
    }
    place_by(ui, ctx);
    if ctx.is_polar() {
        triple(ui, ctx, Parameter::polar_of(chosen));
    } else {
        triple(ui, ctx, Parameter::place_of(chosen));
        direction(ui, ctx, chosen);
    }
    if let Some(further) = chosen.checked_sub(1) {
        slider(ui, ctx, Parameter::Source(SourceKnob { further, part: Part::Level }));
    }
    path.show(ui, ctx, chosen);
}

/// Where the head hears a source: to type and to drag, which moves the source in the world.
fn direction(ui: &mut Ui, ctx: &mut Ctx<'_>, source: usize) {
    let home = ctx.scene.and_then(|scene| scene.emitter());
    let pose = ctx.frame.pose;
    let (azimuth, elevation, distance) = home.map_or((0.0, 0.0, 0.0), |home| seen_from(&pose, ctx.source_at(home, source)));
    let mut values = [azimuth, elevation, distance];
    let words = [Word::Azimuth, Word::Elevation, Word::Distance];
    let mut moved = None;
    ui.add_enabled_ui(home.is_some(), |ui| {
        three(ui, ctx, words.map(Word::label), |ui, _, index| {
            let (range, suffix, speed, decimals) = match index {
                0 => (-180.0..=180.0, "°", 0.5, 1),
                1 => (-90.0..=90.0, "°", 0.5, 1),
                _ => (0.05..=100.0, " m", 0.02, 2),
            };
            let drag = DragValue::new(&mut values[index]).range(range).speed(speed).fixed_decimals(decimals).suffix(suffix);
            let response = ui.add_sized(Vec2::new(ui.available_width(), CONTROL), drag.update_while_editing(false));
            if response.dragged() || response.changed() {
                moved = Some(response.dragged());
            }
            response.on_hover_text(words[index].help());
        });
    });
    if let (Some(home), Some(holds)) = (home, moved) {
        ctx.put_source(home, source, pose.position + pose.orientation * from_polar(values), holds);
    }
}

fn movement(ui: &mut Ui, ctx: &mut Ctx<'_>) {
    heading(ui, ctx.palette, Word::Movement);
    follow_path(ui, ctx);
    labelled(ui, ctx.palette, Word::Of(Parameter::Walk), |ui| paths(ui, ctx));
    labelled(ui, ctx.palette, Word::Of(Parameter::Tracking), |ui| list(ui, ctx, Parameter::Tracking));
}

/// The camera path: the one that is saved with the project, or one of the library.
fn paths(ui: &mut Ui, ctx: &mut Ctx<'_>) {
    let own = if ctx.walk.is_some() { "Project's path" } else { "None" };
    let walks = &ctx.listing.walks;
    let slots = ctx.params().slots.saved().walks;
    let slot = ctx.index(Parameter::Walk);
    // None where the slot's file is not there.
    let chosen = if slot == 0 { Some(0) } else { slots.file(slot, walks.iter().map(PathBuf::as_path)).map(|file| 1 + file) };
    let stems = walks.iter().map(|path| path.file_stem().unwrap_or_default().to_string_lossy().into_owned());
    let names = std::iter::once(own.to_owned()).chain(stems);
    let shown = if slot == 0 { own.to_owned() } else { slots.text(slot) };
    match drop_down(ui, "walk", &shown, names, chosen.unwrap_or(usize::MAX), |_| Parameter::Walk.row().help) {
        None => {}
        Some(0) => ctx.set(Parameter::Walk, 0.0),
        Some(number) => {
            let file = &walks[number - 1];
            match ctx.params().slots.slot_of(SlotKind::Walk, file) {
                Some(slot) => ctx.set(Parameter::Walk, slot as f32),
                None => match read(file) {
                    Ok((walk, _)) => take(ctx, walk),
                    Err(why) => ctx.instance.loader.exchange.walk_report.set_text(why),
                },
            }
        }
    }
}

/// Which parameters say where sources are; all sources stay where they are when others do.
fn place_by(ui: &mut Ui, ctx: &mut Ctx<'_>) {
    let Variants { names, help, .. } = Choice::Place.variants();
    let tooltip = |index: usize| Ok(help[index].to_owned());
    if let Some(choice) = segments(ui, ctx.palette, names, ctx.index(Parameter::Place), tooltip) {
        ctx.place_by(choice);
    }
}

/// What moves the listener.
fn origin(ui: &mut Ui, ctx: &Ctx<'_>) {
    let palette = ctx.palette;
    let waits = pose_source::reason(ctx).is_some();
    ui.horizontal(|ui| {
        let (dot, _) = ui.allocate_exact_size(Vec2::new(8.0, 16.0), Sense::hover());
        ui.painter().circle_filled(dot.center(), 3.5, if waits { palette.warn } else { palette.accent });
        note(ui, palette, pose_source::description(ctx));
    });
    if waits {
        // The fields below are those of its own position.
        for line in in_numbers(&ctx.frame.pose) {
            note(ui, palette, line);
        }
    }
}

/// A pose in metres and degrees.
fn in_numbers(pose: &Pose) -> [String; 2] {
    let (at, (yaw, pitch, roll)) = (pose.position, pose.ypr());
    let [yaw, pitch, roll] = [yaw, pitch, roll].map(f32::to_degrees);
    [format!("Heard: {:.2}, {:.2}, {:.2} m", at.x, at.y, at.z), format!("{yaw:.0}° yaw, {pitch:.0}° pitch, {roll:.0}° roll")]
}

/// Three parameters side by side, each under its name.
fn triple(ui: &mut Ui, ctx: &mut Ctx<'_>, parameters: [Parameter; 3]) {
    three(ui, ctx, parameters.map(|p| p.row().label), |ui, ctx, index| drop(number(ui, ctx, parameters[index])));
}

/// Three controls side by side, each under its name.
fn three(ui: &mut Ui, ctx: &mut Ctx<'_>, names: [&str; 3], mut add: impl FnMut(&mut Ui, &mut Ctx<'_>, usize)) {
    const NAMES: f32 = 14.0;
    let palette = ctx.palette;
    let width = (ui.available_width() - 2.0 * SPACE) / 3.0;
    let (rect, _) = ui.allocate_exact_size(Vec2::new(ui.available_width(), NAMES + CONTROL), Sense::hover());
    for (index, name) in names.into_iter().enumerate() {
        let left = rect.left() + index as f32 * (width + SPACE);
        let place = Rect::from_min_size(egui::pos2(left, rect.top()), Vec2::new(width, rect.height()));
        let at = place.left_top() + Vec2::new(2.0, 0.0);
        ui.painter().text(at, Align2::LEFT_TOP, name, Palette::caption(), palette.soft);
        let field = place.with_min_y(place.top() + NAMES);
        ui.scope_builder(UiBuilder::new().max_rect(field), |ui| add(ui, ctx, index));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_direction_that_is_typed_is_where_the_source_is_seen() {
        let pose = Pose::from_ypr([1.0, -2.5, 0.25].into(), 0.5, -0.25, 0.1);
        let place = pose.position + pose.orientation * from_polar([-40.0, 20.0, 2.5]);
        let (azimuth, elevation, distance) = seen_from(&pose, place);
        assert!((azimuth + 40.0).abs() < 1e-3 && (elevation - 20.0).abs() < 1e-3 && (distance - 2.5).abs() < 1e-5);
    }

    #[test]
    fn a_walk_is_followed_in_numbers() {
        let pose = Pose::from_ypr([1.0, -2.5, 0.25].into(), 0.5, -0.25, 0.0);
        assert_eq!(in_numbers(&pose), ["Heard: 1.00, -2.50, 0.25 m", "29° yaw, -14° pitch, 0° roll"]);
    }
}
