//! The view of the place: from above or from anywhere, to look at and to move handles in.

pub(super) mod camera;
mod drag;
mod extent;
mod ground;
mod keys;
mod layers;
mod listener;
mod map;
mod room;
mod scene;
mod sources;

use super::theme::{Palette, SPACE, faded};
use super::widgets::{button, words};
use super::{ctx::Ctx, pose_source, words::Word};
use crate::library::drawn_room::DrawnRoom;
use crate::listener::snapshot::pose_of;
use crate::parameter::{Parameter, choices::Follow};
use crate::project::settings;
use crate::telemetry::attention::AttentionWeights;
use camera::{Camera, Orbit, Plan};
use drag::{Drag, Handle, Target, pick, wrapped};
use egui::{Align2, CornerRadius, CursorIcon, PointerButton, Rect, Response, Sense, Stroke, Ui, UiBuilder, pos2, vec2};
pub(super) use keys::reset;
use layers::Layers;
use nice_plug::prelude::Enum;
use promenade_core::Pose;
use promenade_core::glam::Vec3;
use room::RoomDrag;
use std::sync::Arc;

/// Closer per point of the wheel.
const ZOOM_PER_POINT: f32 = 0.004;
/// What stands for the address of a drawn room.
const DRAWN: usize = 1;
/// Degrees per point of the wheel.
const TURN_PER_POINT: f32 = 0.12;

/// How the place is looked at, and what is held.
pub(super) struct View {
    /// From above, and from anywhere.
    cameras: [Camera; 2],
    /// What each of both was fitted to.
    fitted: [Option<Fitted>; 2],
    drag: Option<Drag>,
    room_drag: Option<RoomDrag>,
}

/// What a camera was fitted to.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Fitted {
    /// Scene and camera path by their addresses; a drawn room is one place whatever its size.
    shown: [Option<usize>; 2],
    /// The room that there was.
    size: egui::Vec2,
    /// Whether the user has moved the camera since.
    moved: bool,
}

impl Default for View {
    fn default() -> Self {
        Self {
            cameras: [Camera::Plan(Plan::default()), Camera::Orbit(Orbit::default())],
            fitted: [None; 2],
            drag: None,
            room_drag: None,
        }
    }
}

/// The poses that are shown, and what can be taken hold of.
struct Scenery {
    heard: Pose,
    knobs: Pose,
    /// Why the knobs are not heard.
    reason: Option<&'static str>,
    emitter: Option<(Vec3, Vec3)>,
    /// Where further sources are.
    sources: Vec<Vec3>,
    room: Option<DrawnRoom>,
    targets: Vec<Target>,
}

impl Scenery {
    fn of(ctx: &Ctx<'_>, rect: Rect, camera: &Camera) -> Self {
        let (heard, knobs) = (ctx.frame.pose, pose_of(|parameter| ctx.value(parameter)));
        let reason = pose_source::reason(ctx);
        let room = ctx.drawn_room();
        let drawn = room.as_ref().map(|room| Vec3::from_array(room.emitter));
        let emitter = drawn.or_else(|| ctx.scene.and_then(|scene| scene.emitter())).map(|home| (home, ctx.source_at(home, 0)));
        let held = if reason.is_some() { &knobs } else { &heard };
        let project = |world| camera.project(rect, world);
        let mut targets = Vec::new();
        if let Some(at) = project(held.position) {
            targets.push((Handle::Listener, at.at, listener::radius(at)));
        }
        if let Some(tip) = listener::nose(project, held) {
            targets.push((Handle::Nose, tip, 3.0));
        }
        if let Some(at) = emitter.and_then(|(_, moved)| project(moved)) {
            targets.push((Handle::Emitter, at.at, 8.0));
        }
        let sources = emitter.map_or_else(Vec::new, |(home, _)| sources::places(ctx, home));
        targets.extend(sources::targets(ctx, &sources, project));
        targets.extend(room.iter().flat_map(|room| room::targets(room, camera, rect)));
        let keyframes = ctx.walk.map_or(&[][..], |walk| walk.path.keyframes());
        targets.extend(
            keyframes.iter().enumerate().filter_map(|(index, keyframe)| {
                project(keyframe.pose.position).map(|at| (Handle::Keyframe(index), at.at, 0.0))
            }),
        );
        Self { heard, knobs, reason, emitter, sources, room, targets }
    }

    fn held(&self) -> &Pose {
        if self.reason.is_some() { &self.knobs } else { &self.heard }
    }
}

impl View {
    /// Shows the place in what is left of the window.
    pub(super) fn show(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>, attention: Option<&AttentionWeights>) {
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
        let moves = (0..=ctx.params().further()).any(|source| ctx.source_walk(source).is_some());
        ctx.shows_time |= moves && Follow::from_index(ctx.index(Parameter::Follow)) == Follow::Transport;
        // What was moved is shown where it is now.
        scenery = Scenery::of(ctx, rect, &camera);
        paint(ui, rect, &camera, ctx, &scenery, hot, attention);
        if response.has_focus() {
            let stroke = egui::Stroke::new(1.0, faded(ctx.palette.accent, 0.6));
            ui.painter().rect_stroke(rect, CornerRadius::ZERO, stroke, egui::StrokeKind::Inside);
        }
        self.tools(ui, rect, ctx);
        map::legend(ui.painter(), rect, &camera, ctx, response.hover_pos());
        caption(ui, rect, ctx, &scenery, hot);
    }

    fn camera(&self, ctx: &Ctx<'_>) -> &Camera {
        &self.cameras[kind(ctx)]
    }

    /// The camera, to be moved by the user.
    fn camera_mut(&mut self, ctx: &Ctx<'_>) -> &mut Camera {
        if let Some(fitted) = &mut self.fitted[kind(ctx)] {
            fitted.moved = true;
        }
        &mut self.cameras[kind(ctx)]
    }

    fn fit(&mut self, rect: Rect, ctx: &Ctx<'_>) {
        let (low, high) = extent::of(ctx);
        self.camera_mut(ctx).fit(rect, low, high);
        self.fitted[kind(ctx)] = Some(Fitted { shown: shown(ctx), size: rect.size(), moved: false });
    }

    /// Moves what is dragged, and says what that is.
    fn drag(&mut self, ui: &Ui, response: &Response, rect: Rect, ctx: &mut Ctx<'_>, scenery: &Scenery) -> Option<Handle> {
        let modifiers = ui.input(|input| input.modifiers);
        if response.drag_started_by(PointerButton::Primary) {
            // Where the button went down, not where the move was noticed.
            let from = ui.input(|input| input.pointer.press_origin()).or(response.interact_pointer_pos());
            let picked = from.and_then(|from| Some((pick(&scenery.targets, from)?, from)));
            self.room_drag =
                picked.zip(scenery.room.as_ref()).and_then(|((handle, from), room)| RoomDrag::begin(handle, from, room));
            let free = |handle| self.room_drag.is_none() && !matches!(handle, Handle::Keyframe(_) | Handle::Wall(_));
            self.drag = picked.filter(|(handle, _)| free(*handle)).map(|(handle, from)| begin_drag(ctx, scenery, handle, from));
            choose(ctx, picked.map(|(handle, _)| handle));
        }
        if let Some(drag) = &self.room_drag {
            if response.dragged_by(PointerButton::Primary) {
                if let Some(to) = response.interact_pointer_pos() {
                    ctx.draw(drag.room(self.camera(ctx), rect, to, modifiers));
                }
                ui.ctx().set_cursor_icon(CursorIcon::Grabbing);
                return Some(drag.handle);
            }
            self.room_drag = None;
            ctx.touch();
        }
        if let Some(drag) = self.drag.filter(|_| response.dragged_by(PointerButton::Primary)) {
            if let Some(to) = response.interact_pointer_pos() {
                let values = drag.values(self.camera(ctx), rect, to, modifiers);
                match drag.source().filter(|_| ctx.is_polar()) {
                    Some(source) => ctx.set_offset(source, drag.moved(&values), true, true),
                    None => values.into_iter().for_each(|(parameter, value)| ctx.hold(parameter, value)),
                }
            }
            ui.ctx().set_cursor_icon(CursorIcon::Grabbing);
            return Some(drag.handle);
        }
        self.drag = None;
        None
    }

    /// Pointer and wheel. Returns what the pointer is over or holds.
    fn handle(&mut self, ui: &Ui, response: &Response, rect: Rect, ctx: &mut Ctx<'_>, scenery: &Scenery) -> Option<Handle> {
        let modifiers = ui.input(|input| input.modifiers);
        let over = response.hover_pos().and_then(|at| pick(&scenery.targets, at));
        if response.is_pointer_button_down_on() || response.clicked() {
            response.request_focus();
        }
        if let Some(handle) = self.drag(ui, response, rect, ctx, scenery) {
            return Some(handle);
        }
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
                Some(Handle::Keyframe(index)) => ctx.selection.keyframe = Some(index),
                Some(handle) => choose(ctx, Some(handle)),
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
            } else if scroll != 0.0 && matches!(over, Some(Handle::Listener | Handle::Nose)) {
                let value = wrapped(ctx.value(Parameter::Yaw) + scroll * TURN_PER_POINT);
                ctx.nudge(Parameter::Yaw, value);
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
        let place = Rect::from_min_size(rect.min + vec2(12.0, 12.0), vec2(rect.width() - 24.0, 24.0));
        ui.scope_builder(UiBuilder::new().max_rect(place), |ui| {
            ui.horizontal(|ui| {
                ui.scope(|ui| {
                    ui.set_max_width(104.0);
                    let chosen = usize::from(ctx.settings.view == settings::View::Orbit);
                    if let Some(index) = words(ui, ctx.palette, &[Word::Top, Word::Orbit], chosen) {
                        ctx.settings.view = if index == 0 { settings::View::Top } else { settings::View::Orbit };
                    }
                });
                ui.add_space(SPACE);
                if button(ui, ctx.palette, Word::Fit).clicked() {
                    self.fit(rect, ctx);
                }
                ui.add_space(SPACE);
                ui.scope(|ui| {
                    ui.set_max_width(216.0);
                    let all = [settings::Map::None, settings::Map::Level, settings::Map::T20, settings::Map::C50];
                    let chosen = all.iter().position(|map| *map == ctx.settings.map).unwrap_or(0);
                    let names = [Word::NoMap, Word::LevelMap, Word::T20, Word::C50];
                    if let Some(index) = words(ui, ctx.palette, &names, chosen) {
                        ctx.settings.map = all[index];
                    }
                });
            });
        });
    }
}

/// What there is to be fitted, by addresses.
fn shown(ctx: &Ctx<'_>) -> [Option<usize>; 2] {
    let scene = ctx.scene.map(|scene| Arc::as_ptr(scene) as usize);
    let place = if ctx.drawn_room().is_some() { Some(DRAWN) } else { scene };
    [place, ctx.walk.map(|walk| Arc::as_ptr(walk) as usize)]
}

/// Number of the camera that is in use.
fn kind(ctx: &Ctx<'_>) -> usize {
    usize::from(ctx.settings.view == settings::View::Orbit)
}

/// Shows a source in the panel, if it is one.
fn choose(ctx: &mut Ctx<'_>, handle: Option<Handle>) {
    match handle {
        Some(Handle::Emitter) => ctx.selection.source = 0,
        Some(Handle::Source(further)) => ctx.selection.source = further + 1,
        _ => (),
    }
}

fn begin_drag(ctx: &Ctx<'_>, scenery: &Scenery, handle: Handle, from: egui::Pos2) -> Drag {
    let world = match (handle, scenery.emitter) {
        (Handle::Emitter, Some((_, moved))) => moved,
        (Handle::Source(further), _) => scenery.sources.get(further).copied().unwrap_or_default(),
        _ => scenery.held().position,
    };
    let mut drag =
        Drag { handle, from, world, start: [0.0; 3], yaw_deg: ctx.value(Parameter::Yaw), heard_yaw: scenery.held().ypr().0 };
    drag.start = match drag.source() {
        Some(source) => ctx.offset(source).to_array(),
        None => drag.parameters().map(|parameter| ctx.value(parameter)),
    };
    drag
}

fn paint(
    ui: &Ui,
    rect: Rect,
    camera: &Camera,
    ctx: &Ctx<'_>,
    scenery: &Scenery,
    hot: Option<Handle>,
    attention: Option<&AttentionWeights>,
) {
    let painter = ui.painter().with_clip_rect(rect);
    ground::paint(&painter, rect, camera, ctx.palette);
    if let Some(Ok(map)) = map::wanted(ctx).flatten().as_deref() {
        map::paint(&painter, rect, camera, ctx, map, scenery.emitter.map_or(Vec3::ZERO, |(home, moved)| moved - home));
    }
    let mut layers = Layers::new(rect, camera);
    if let Some(room) = &scenery.room {
        room::paint(&mut layers, ctx, room, hot);
    } else if let Some(scene) = ctx.scene {
        scene::bounds(&mut layers, ctx, scene);
        if ctx.outline.edges.is_empty() {
            scene::anchors(&mut layers, ctx, scene, attention);
        }
        for [a, b] in &ctx.outline.edges {
            layers.line(*a, *b, Stroke::new(1.5, faded(ctx.palette.text, 0.75)));
        }
    }
    if let Some(walk) = ctx.walk {
        scene::path(&mut layers, ctx, &walk.path, ctx.palette.path, ctx.selection.keyframe);
    }
    if let Some(walk) = ctx.source_walk(ctx.selection.source) {
        scene::path(&mut layers, ctx, &walk.path, ctx.palette.emitter, None);
    }
    if let Some((home, moved)) = scenery.emitter {
        scene::emitter(&mut layers, ctx, home, moved, hot == Some(Handle::Emitter));
        if let Some(seen) = layers.project(moved) {
            sources::name(&mut layers, &painter, ctx, seen, ctx.sources.of(0).name, 14.0);
            if !scenery.sources.is_empty() {
                sources::number(&mut layers, &painter, seen, 0, ctx.palette.ground);
            }
        }
    }
    for (further, at) in scenery.sources.iter().enumerate() {
        sources::paint(&mut layers, &painter, ctx, further, *at, hot == Some(Handle::Source(further)));
    }
    let held = matches!(hot, Some(Handle::Listener | Handle::Nose));
    listener::listener(&mut layers, ctx, &scenery.heard, held && scenery.reason.is_none());
    if scenery.reason.is_some() {
        listener::ghost(&mut layers, ctx, &scenery.knobs, held);
    }
    layers.paint(&painter);
    ground::paint_scale(&painter, rect, camera, ctx.palette);
}

/// What moves the listener, and what can be done with what the pointer is over.
fn caption(ui: &Ui, rect: Rect, ctx: &Ctx<'_>, scenery: &Scenery, hot: Option<Handle>) {
    let palette = ctx.palette;
    let plate = |align: Align2, at: egui::Pos2, text: String, colour| {
        let galley = ui.painter().layout(text, Palette::caption(), palette.text, rect.width() - 40.0);
        let size = galley.size() + vec2(16.0, 8.0);
        let place = align.anchor_size(at, size);
        ui.painter().rect_filled(place, CornerRadius::same(4), faded(palette.panel, 0.92));
        ui.painter().galley_with_override_text_color(place.min + vec2(8.0, 4.0), galley, colour);
    };
    let text = match (hot, scenery.reason) {
        (Some(Handle::Listener | Handle::Nose), Some(reason)) => Some((reason.to_owned(), palette.warn)),
        (Some(Handle::Listener), None) => {
            Some(("Drag to move, with Shift to turn, with Alt for height; the wheel turns".to_owned(), palette.soft))
        }
        (Some(Handle::Nose), None) => Some(("Drag to turn".to_owned(), palette.soft)),
        (Some(Handle::Emitter), _) => Some(("Drag to move the source, with Alt for height".to_owned(), palette.soft)),
        (Some(Handle::Source(further)), _) => {
            let name = ctx.sources.name(1 + further);
            let place = scenery.sources.get(further).copied().unwrap_or_default();
            let outside = if ctx.is_outside(place) { ". It is outside of the walls" } else { "" };
            Some((format!("{name}: drag to move, with Alt for height{outside}"), palette.soft))
        }
        (Some(Handle::Wall(_)), _) => Some(("Drag to move the wall".to_owned(), palette.soft)),
        (Some(Handle::Keyframe(index)), _) => {
            let t_s = ctx.walk.and_then(|walk| walk.path.keyframes().get(index)).map_or(0.0, |keyframe| keyframe.t_s);
            Some((format!("Keyframe {} at {t_s:.2} s", index + 1), palette.path))
        }
        (None, _) => None,
    };
    if let Some((text, colour)) = text {
        plate(Align2::CENTER_BOTTOM, pos2(rect.center().x, rect.bottom() - 24.0), text, colour);
    }
}
