//! The view of the place: from above or from anywhere, to look at and to move things in.

pub(super) mod camera;
mod extent;
mod grid;
mod grip;
mod head;
mod keys;
mod layers;
mod place;

use super::ctx::Ctx;
use super::source;
use super::theme::{GRID, Palette, faded};
use super::widgets::{button, segments};
use crate::attention::Attended;
use crate::remote::Knob;
use crate::settings;
use camera::{Camera, Orbit, Plan};
use egui::{Align2, CornerRadius, CursorIcon, PointerButton, Rect, Response, Sense, Ui, UiBuilder, pos2, vec2};
pub(super) use grip::pose_of;
use grip::{Grip, Target, Thing, pick, wrapped};
pub(super) use keys::reset;
use layers::Layers;
use promenade_core::Pose;
use promenade_core::glam::Vec3;
use std::sync::Arc;

/// Closer per point of the wheel.
const ZOOM_PER_POINT: f32 = 0.004;
/// Degrees per point of the wheel.
const TURN_PER_POINT: f32 = 0.12;

/// How the place is looked at, and what is held.
pub(super) struct View {
    plan: Camera,
    orbit: Camera,
    /// What each of both was fitted to.
    fitted: [Option<Fitted>; 2],
    grip: Option<Grip>,
}

/// What a camera was fitted to.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Fitted {
    /// Scene and camera path by their addresses.
    shown: [Option<usize>; 2],
    /// The room that there was.
    size: egui::Vec2,
    /// Whether the user has moved the camera since.
    moved: bool,
}

impl Default for View {
    fn default() -> Self {
        Self { plan: Camera::Plan(Plan::default()), orbit: Camera::Orbit(Orbit::default()), fitted: [None; 2], grip: None }
    }
}

/// The poses that are shown, and what can be taken hold of.
struct Scenery {
    heard: Pose,
    knobs: Pose,
    /// Why the knobs are not heard.
    reason: Option<&'static str>,
    emitter: Option<(Vec3, Vec3)>,
    targets: Vec<Target>,
}

impl Scenery {
    fn of(ctx: &Ctx<'_>, rect: Rect, camera: &Camera) -> Self {
        let (heard, knobs) = (ctx.frame.pose, pose_of(|knob| ctx.value(knob)));
        let reason = source::reason(ctx);
        let offset = Vec3::new(ctx.value(Knob::Ex), ctx.value(Knob::Ey), ctx.value(Knob::Ez));
        let emitter = ctx.scene.and_then(|scene| scene.emitter()).map(|home| (home, home + offset));
        let held = if reason.is_some() { &knobs } else { &heard };
        let spot = |world| camera.project(rect, world);
        let mut targets = Vec::new();
        if let Some(at) = spot(held.position) {
            targets.push((Thing::Listener, at.at, head::radius(at)));
        }
        if let Some(tip) = head::nose(spot, held) {
            targets.push((Thing::Nose, tip, 3.0));
        }
        if let Some(at) = emitter.and_then(|(_, moved)| spot(moved)) {
            targets.push((Thing::Emitter, at.at, 8.0));
        }
        let keyframes = ctx.walk.map_or(&[][..], |walk| walk.path.keyframes());
        targets.extend(
            keyframes
                .iter()
                .enumerate()
                .filter_map(|(index, keyframe)| spot(keyframe.pose.position).map(|at| (Thing::Keyframe(index), at.at, 0.0))),
        );
        Self { heard, knobs, reason, emitter, targets }
    }

    fn held(&self) -> &Pose {
        if self.reason.is_some() { &self.knobs } else { &self.heard }
    }
}

impl View {
    /// Shows the place in what is left of the window.
    pub(super) fn show(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>, attended: Option<&Attended>) {
        let rect = ui.max_rect();
        let response = ui.interact(rect, ui.scope_id().with("place"), Sense::click_and_drag());
        let now = shown(ctx);
        // Another scene is another place; another path or window is fitted only where the user has left it to the editor.
        let fits = |fitted: &Fitted| match fitted.moved {
            true => fitted.shown[0] == now[0],
            false => fitted.shown == now && fitted.size == rect.size(),
        };
        if !self.fitted[kind(ctx)].as_ref().is_some_and(fits) {
            self.fit(rect, ctx);
        }
        let mut scenery = Scenery::of(ctx, rect, self.camera(ctx));
        let hot = self.handle(ui, &response, rect, ctx, &scenery);
        let camera = *self.camera(ctx);
        if keys::move_listener(ui, &response, ctx, &camera) {
            self.fit(rect, ctx);
        }
        // What was moved is shown where it is now.
        scenery = Scenery::of(ctx, rect, &camera);
        paint(ui, rect, &camera, ctx, &scenery, hot, attended);
        if response.has_focus() {
            let stroke = egui::Stroke::new(1.0, faded(ctx.palette.accent, 0.6));
            ui.painter().rect_stroke(rect, CornerRadius::ZERO, stroke, egui::StrokeKind::Inside);
        }
        self.tools(ui, rect, ctx);
        caption(ui, rect, ctx, &scenery, hot);
    }

    fn camera(&self, ctx: &Ctx<'_>) -> &Camera {
        match ctx.settings.view {
            settings::View::Top => &self.plan,
            settings::View::Orbit => &self.orbit,
        }
    }

    /// The camera, to be moved by the user.
    fn camera_mut(&mut self, ctx: &Ctx<'_>) -> &mut Camera {
        if let Some(fitted) = &mut self.fitted[kind(ctx)] {
            fitted.moved = true;
        }
        match ctx.settings.view {
            settings::View::Top => &mut self.plan,
            settings::View::Orbit => &mut self.orbit,
        }
    }

    fn fit(&mut self, rect: Rect, ctx: &Ctx<'_>) {
        let (low, high) = extent::of(ctx);
        self.camera_mut(ctx).fit(rect, low, high);
        self.fitted[kind(ctx)] = Some(Fitted { shown: shown(ctx), size: rect.size(), moved: false });
    }

    /// Pointer and wheel. Returns what the pointer is over or holds.
    fn handle(&mut self, ui: &Ui, response: &Response, rect: Rect, ctx: &mut Ctx<'_>, scenery: &Scenery) -> Option<Thing> {
        let modifiers = ui.input(|input| input.modifiers);
        let over = response.hover_pos().and_then(|at| pick(&scenery.targets, at));
        if response.is_pointer_button_down_on() || response.clicked() {
            response.request_focus();
        }
        if response.drag_started_by(PointerButton::Primary) {
            // Where the button went down, not where the move was noticed.
            let from = ui.input(|input| input.pointer.press_origin()).or(response.interact_pointer_pos());
            self.grip = from.and_then(|from| {
                let thing = pick(&scenery.targets, from)?;
                (!matches!(thing, Thing::Keyframe(_))).then(|| take_hold(ctx, scenery, thing, from))
            });
        }
        if let Some(grip) = self.grip.filter(|_| response.dragged_by(PointerButton::Primary)) {
            if let Some(to) = response.interact_pointer_pos() {
                for (knob, value) in grip.drag(self.camera(ctx), rect, to, modifiers) {
                    ctx.hold(knob, value);
                }
            }
            ui.ctx().set_cursor_icon(CursorIcon::Grabbing);
            return Some(grip.thing);
        }
        self.grip = None;
        let by = response.drag_delta();
        if response.dragged_by(PointerButton::Primary) && !modifiers.shift {
            match ctx.settings.view {
                settings::View::Top => self.camera_mut(ctx).pan(rect, by),
                settings::View::Orbit => self.camera_mut(ctx).turn(by),
            }
        } else if response.dragged() {
            self.camera_mut(ctx).pan(rect, by);
        }
        if response.clicked()
            && let Some(at) = response.interact_pointer_pos()
        {
            match pick(&scenery.targets, at) {
                Some(Thing::Keyframe(index)) => ctx.selection.keyframe = Some(index),
                Some(_) => {}
                None => ctx.selection.keyframe = None,
            }
        }
        if response.double_clicked() && over.is_none() {
            self.fit(rect, ctx);
        }
        if let Some(at) = response.hover_pos() {
            let (scroll, pinch) = ui.input(|input| (input.smooth_scroll_delta().y, input.zoom_delta()));
            if pinch != 1.0 {
                self.camera_mut(ctx).zoom(rect, at, pinch);
            } else if scroll != 0.0 && matches!(over, Some(Thing::Listener | Thing::Nose)) {
                let value = wrapped(ctx.value(Knob::Yaw) + scroll * TURN_PER_POINT);
                ctx.nudge(Knob::Yaw, value);
            } else if scroll != 0.0 {
                self.camera_mut(ctx).zoom(rect, at, (scroll * ZOOM_PER_POINT).exp());
            }
        }
        if over.is_some() {
            ui.ctx().set_cursor_icon(CursorIcon::Grab);
        }
        over
    }

    /// The buttons in the view's corner.
    fn tools(&mut self, ui: &mut Ui, rect: Rect, ctx: &mut Ctx<'_>) {
        let place = Rect::from_min_size(rect.min + vec2(12.0, 12.0), vec2(220.0, 24.0));
        ui.scope_builder(UiBuilder::new().max_rect(place), |ui| {
            ui.horizontal(|ui| {
                ui.scope(|ui| {
                    ui.set_max_width(104.0);
                    let chosen = usize::from(ctx.settings.view == settings::View::Orbit);
                    if let Some(index) = segments(ui, ctx.palette, &["Top", "3-D"], chosen, |_| true) {
                        ctx.settings.view = if index == 0 { settings::View::Top } else { settings::View::Orbit };
                    }
                });
                ui.add_space(GRID);
                if button(ui, ctx.palette, "Fit").on_hover_text("Show everything (F, or a double click)").clicked() {
                    self.fit(rect, ctx);
                }
            });
        });
    }
}

/// What there is to be fitted, by addresses.
fn shown(ctx: &Ctx<'_>) -> [Option<usize>; 2] {
    [ctx.scene.map(|scene| Arc::as_ptr(scene) as usize), ctx.walk.map(|walk| Arc::as_ptr(walk) as usize)]
}

/// Number of the camera that is in use.
fn kind(ctx: &Ctx<'_>) -> usize {
    usize::from(ctx.settings.view == settings::View::Orbit)
}

fn take_hold(ctx: &Ctx<'_>, scenery: &Scenery, thing: Thing, from: egui::Pos2) -> Grip {
    let world = match (thing, scenery.emitter) {
        (Thing::Emitter, Some((_, moved))) => moved,
        _ => scenery.held().position,
    };
    let mut grip =
        Grip { thing, from, world, values: [0.0; 3], yaw_deg: ctx.value(Knob::Yaw), heard_yaw: scenery.held().ypr().0 };
    grip.values = grip.knobs().map(|knob| ctx.value(knob));
    grip
}

fn paint(
    ui: &Ui,
    rect: Rect,
    camera: &Camera,
    ctx: &Ctx<'_>,
    scenery: &Scenery,
    hot: Option<Thing>,
    attended: Option<&Attended>,
) {
    let painter = ui.painter().with_clip_rect(rect);
    grid::paint(&painter, rect, camera, ctx.palette);
    let mut layers = Layers::new(rect, camera);
    if let Some(scene) = ctx.scene {
        place::bounds(&mut layers, ctx, scene);
        place::anchors(&mut layers, ctx, scene, attended);
    }
    if let Some(walk) = ctx.walk {
        place::path(&mut layers, ctx, &walk.path, ctx.selection.keyframe);
    }
    if let Some((home, moved)) = scenery.emitter {
        place::emitter(&mut layers, ctx, home, moved, hot == Some(Thing::Emitter));
    }
    let held = matches!(hot, Some(Thing::Listener | Thing::Nose));
    head::listener(&mut layers, ctx, &scenery.heard, held && scenery.reason.is_none());
    if scenery.reason.is_some() {
        head::ghost(&mut layers, ctx, &scenery.knobs, held);
    }
    layers.paint(&painter);
    grid::paint_scale(&painter, rect, camera, ctx.palette);
}

/// What moves the listener, and what can be done with what the pointer is over.
fn caption(ui: &Ui, rect: Rect, ctx: &Ctx<'_>, scenery: &Scenery, hot: Option<Thing>) {
    let palette = ctx.palette;
    let plate = |align: Align2, at: egui::Pos2, text: String, colour| {
        let galley = ui.painter().layout(text, Palette::caption(), palette.text, rect.width() - 40.0);
        let size = galley.size() + vec2(16.0, 8.0);
        let place = align.anchor_size(at, size);
        ui.painter().rect_filled(place, CornerRadius::same(4), faded(palette.panel, 0.92));
        ui.painter().galley_with_override_text_color(place.min + vec2(8.0, 4.0), galley, colour);
    };
    let text = match (hot, scenery.reason) {
        (Some(Thing::Listener | Thing::Nose), Some(reason)) => Some((reason.to_owned(), palette.warn)),
        (Some(Thing::Listener), None) => {
            Some(("Drag to move, with Shift to turn, with Alt for height; the wheel turns".to_owned(), palette.soft))
        }
        (Some(Thing::Nose), None) => Some(("Drag to turn".to_owned(), palette.soft)),
        (Some(Thing::Emitter), _) => Some(("Drag to move the emitter, with Alt for height".to_owned(), palette.soft)),
        (Some(Thing::Keyframe(index)), _) => {
            let t_s = ctx.walk.and_then(|walk| walk.path.keyframes().get(index)).map_or(0.0, |keyframe| keyframe.t_s);
            Some((format!("Keyframe {} at {t_s:.2} s", index + 1), palette.path))
        }
        (None, _) => None,
    };
    if let Some((text, colour)) = text {
        plate(Align2::CENTER_BOTTOM, pos2(rect.center().x, rect.bottom() - 24.0), text, colour);
    }
}
