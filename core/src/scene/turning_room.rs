//! A room that turns with the head.

use crate::Pose;
use glam::Vec3;

/// What moves in a turning room while the listener walks in the scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mover {
    /// The listener; the source keeps its place in the room.
    #[default]
    Listener,
    /// The source; the listener keeps the place that was measured.
    Source,
}

/// Where image sources lie in a room that was measured with sources around one listener. Each orientation of the head in the
/// scene stands for another place of the source in the room, which turns with the head.
#[derive(Clone, Debug, PartialEq)]
pub struct TurningRoom {
    /// The head in the room when it was measured.
    pub listener: Pose,
    /// The centre of the turning room in the scene's world, metres.
    pub centre: Vec3,
    /// What moves while the listener walks.
    pub moves: Mover,
    /// 1 where only sources before the head were measured, -1 where only sources behind it were, and those on the other side
    /// are heard as their mirror images; 0 where both were.
    pub side: f32,
    /// How each image follows the emitter along the room's x, y and z: 1, or -1.
    pub mirrors: Vec<Vec3>,
}

/// A pose as image sources are seen from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Outlook {
    /// The listener in the room.
    pub(crate) pose: Pose,
    /// How far the emitter is from where the images are stated for, metres.
    pub(crate) shift: Vec3,
}

impl TurningRoom {
    /// Where the emitter is in the room that images are stated for: with the head at the centre, as it was measured.
    #[must_use]
    pub fn reference(&self, emitter: Vec3) -> Vec3 {
        self.listener.position + self.listener.orientation * (emitter - self.centre)
    }

    /// A pose in the scene as one in the room.
    pub(crate) fn outlook(&self, pose: &Pose, emitter: Vec3) -> Outlook {
        let centre = match self.moves {
            Mover::Listener => self.centre,
            Mover::Source => pose.position,
        };
        let from_head = |at: Vec3| pose.orientation.inverse() * (at - centre);
        let (mut source, mut head) = (from_head(emitter), from_head(pose.position));
        if (source.x - head.x) * self.side < 0.0 {
            (source.x, head.x) = (-source.x, -head.x);
        }
        let Pose { position, orientation } = self.listener;
        let shift = position + orientation * source - self.reference(emitter);
        Outlook { pose: Pose { position: position + orientation * head, orientation }, shift }
    }

    /// How far images may be from the emitter beyond what they are where they are stated, metres, while it is at its distance.
    pub(crate) fn beyond_m(&self, emitter: Vec3) -> f32 {
        // Each turn moves the emitter by up to twice its distance, and an image by as much the other way.
        4.0 * emitter.distance(self.centre)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn room(moves: Mover, side: f32) -> TurningRoom {
        // The head looks along the room's y.
        let listener = Pose::from_ypr(Vec3::new(2.0, 3.0, 1.5), std::f32::consts::FRAC_PI_2, 0.0, 0.0);
        TurningRoom { listener, centre: Vec3::ZERO, moves, side, mirrors: Vec::new() }
    }

    const EMITTER: Vec3 = Vec3::new(1.5, 0.0, 0.0);

    fn near(a: Vec3, b: [f32; 3]) -> bool {
        a.distance(Vec3::from_array(b)) < 1e-5
    }

    #[test]
    fn a_turn_of_the_head_is_another_place_of_the_source() {
        let room = room(Mover::Listener, 0.0);
        assert!(near(room.reference(EMITTER), [2.0, 4.5, 1.5]));
        // Turned to the left, the head has the source on its right: in the room, along x.
        let turned = room.outlook(&Pose::from_ypr(Vec3::ZERO, std::f32::consts::FRAC_PI_2, 0.0, 0.0), EMITTER);
        assert!(near(turned.pose.position, [2.0, 3.0, 1.5]) && near(turned.shift, [1.5, -1.5, 0.0]), "{turned:?}");
    }

    #[test]
    fn a_walk_moves_the_listener_or_the_source() {
        let walked = Pose { position: Vec3::new(-0.5, 0.0, 0.0), ..Pose::IDENTITY };
        let listener = room(Mover::Listener, 0.0).outlook(&walked, EMITTER);
        assert!(near(listener.pose.position, [2.0, 2.5, 1.5]) && near(listener.shift, [0.0; 3]), "{listener:?}");
        let source = room(Mover::Source, 0.0).outlook(&walked, EMITTER);
        assert!(near(source.pose.position, [2.0, 3.0, 1.5]) && near(source.shift, [0.0, 0.5, 0.0]), "{source:?}");
    }

    #[test]
    fn what_was_not_measured_behind_is_the_mirror_image_of_what_was_ahead() {
        let behind = Pose::from_ypr(Vec3::ZERO, std::f32::consts::PI, 0.0, 0.0);
        let found = room(Mover::Listener, 1.0).outlook(&behind, EMITTER);
        assert!(near(found.shift, [0.0; 3]), "{found:?}");
        let plain = room(Mover::Listener, 0.0).outlook(&behind, EMITTER);
        assert!(near(plain.shift, [0.0, -3.0, 0.0]), "{plain:?}");
    }
}
