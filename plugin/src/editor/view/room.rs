//! A drawn room in the view: its walls, and what a drag makes of them.

use super::drag::{Handle, Target};
use super::{super::ctx::Ctx, super::theme::faded, camera::Camera, ground::edges, layers::Layers};
use crate::library::drawn_room::DrawnRoom;
use egui::{Modifiers, Pos2, Rect, Stroke};
use promenade_core::glam::Vec3;

/// Radius of the handle of a wall, points.
const RADIUS: f32 = 5.0;

/// The middle of a wall.
fn middle(room: &DrawnRoom, wall: usize) -> Vec3 {
    let [low, high] = room.corners();
    let mut at = low.midpoint(high);
    at[wall / 2] = if wall.is_multiple_of(2) { low[wall / 2] } else { high[wall / 2] };
    at
}

/// The walls that can be taken hold of: from above, those that are seen from the side.
fn walls(camera: &Camera) -> std::ops::Range<usize> {
    0..if matches!(camera, Camera::Plan(_)) { 4 } else { 6 }
}

/// Where the walls can be taken hold of.
pub(super) fn targets(room: &DrawnRoom, camera: &Camera, rect: Rect) -> Vec<Target> {
    let target = |wall| Some((Handle::Wall(wall), camera.project(rect, middle(room, wall))?.at, RADIUS));
    walls(camera).filter_map(target).collect()
}

/// Draws the walls' edges and handles.
pub(super) fn paint(layers: &mut Layers<'_>, ctx: &Ctx<'_>, room: &DrawnRoom, hot: Option<Handle>) {
    let [low, high] = room.corners();
    let stroke = Stroke::new(1.5, faded(ctx.palette.text, 0.8));
    for [a, b] in edges(low, high) {
        layers.line(a, b, stroke);
    }
    for wall in walls(layers.camera) {
        let is_hot = hot == Some(Handle::Wall(wall));
        let fill = if is_hot { ctx.palette.accent } else { ctx.palette.panel };
        let radius = if is_hot { RADIUS + 2.0 } else { RADIUS };
        layers.ball(middle(room, wall), radius, fill, Stroke::new(1.5, ctx.palette.accent));
    }
}

/// A drag of a wall or of the emitter of a drawn room, as it was when it began.
#[derive(Clone, Debug)]
pub(super) struct RoomDrag {
    /// What is dragged.
    pub(super) handle: Handle,
    from: Pos2,
    start: DrawnRoom,
}

impl RoomDrag {
    /// A drag of a handle from a place of the window; `None` of what is no part of the room.
    pub(super) fn begin(handle: Handle, from: Pos2, room: &DrawnRoom) -> Option<Self> {
        matches!(handle, Handle::Wall(_) | Handle::Emitter).then(|| Self { handle, from, start: room.clone() })
    }

    /// The room with the pointer at a place: a wall moves along its normal, the emitter at its height or with Alt up and down.
    pub(super) fn room(&self, camera: &Camera, rect: Rect, to: Pos2, modifiers: Modifiers) -> DrawnRoom {
        let mut room = self.start.clone();
        let world = match self.handle {
            Handle::Wall(wall) => middle(&room, wall),
            _ => room.emitter.into(),
        };
        let rise = || Vec3::Z * camera.rise(rect, world, self.from, to);
        let along = || {
            let [from, to] = [self.from, to].map(|at| camera.on_level(rect, at, world.z));
            Some(to? - from?)
        };
        match self.handle {
            Handle::Wall(wall) => {
                let by = if wall / 2 == 2 { Some(rise()) } else { along() };
                if let Some(by) = by {
                    room.move_wall(wall, world[wall / 2] + by[wall / 2]);
                }
            }
            _ => {
                if let Some(by) = if modifiers.alt { Some(rise()) } else { along() } {
                    room.set_emitter(world + by);
                }
            }
        }
        room
    }
}

#[cfg(test)]
mod tests {
    use super::super::camera::{Orbit, Plan};
    use super::*;
    use egui::{pos2, vec2};

    fn rect() -> Rect {
        Rect::from_min_size(pos2(0.0, 0.0), vec2(600.0, 400.0))
    }

    #[test]
    fn a_wall_follows_the_pointer_and_the_one_opposite_stays() {
        let room = DrawnRoom::default();
        for camera in [Camera::Plan(Plan::default()), Camera::Orbit(Orbit::default())] {
            let target = targets(&room, &camera, rect()).into_iter().find(|t| t.0 == Handle::Wall(1)).unwrap();
            let drag = RoomDrag::begin(target.0, target.1, &room).unwrap();
            let to = camera.project(rect(), middle(&room, 1) + Vec3::new(0.75, 0.4, 0.0)).unwrap().at;
            let moved = drag.room(&camera, rect(), to, Modifiers::NONE);
            assert!((moved.size[0] - room.size[0] - 0.75).abs() < 1e-3, "{:?}", moved.size);
            assert_eq!((moved.size[1], moved.corner), (room.size[1], room.corner));
        }
        let camera = Camera::Orbit(Orbit::default());
        let ceiling = camera.project(rect(), middle(&room, 5)).unwrap().at;
        let drag = RoomDrag::begin(Handle::Wall(5), ceiling, &room).unwrap();
        let lifted = drag.room(&camera, rect(), ceiling - vec2(0.0, 30.0), Modifiers::NONE);
        assert!(lifted.size[2] > room.size[2] + 0.1 && lifted.corner == room.corner);
        assert!(RoomDrag::begin(Handle::Listener, ceiling, &room).is_none());
    }

    #[test]
    fn the_emitter_stays_inside() {
        let (room, camera) = (DrawnRoom::default(), Camera::Plan(Plan::default()));
        let from = camera.project(rect(), room.emitter.into()).unwrap().at;
        let drag = RoomDrag::begin(Handle::Emitter, from, &room).unwrap();
        let moved = drag.room(&camera, rect(), from + vec2(5000.0, -20.0), Modifiers::NONE);
        assert!(moved.holds(moved.emitter.into()) && moved.emitter != room.emitter, "{:?}", moved.emitter);
        assert_eq!(moved.size, room.size);
    }
}
