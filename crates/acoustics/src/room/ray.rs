//! A ray on its way through a room.

use crate::directivity::lattice::lambert;
use crate::room::{NOWHERE, Room};
use glam::DVec3;
use promenade_core::random::Random;

/// A half line. What it meets is found in single precision; where, is computed in double precision from the plane that is met.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    pub(crate) origin: DVec3,
    /// Unit length.
    pub(crate) direction: DVec3,
    /// Where the search begins: a little before the origin on the way that led there, and so in a corner on this side of both
    /// walls.
    start: DVec3,
    /// The plane that it leaves, and cannot meet again.
    leaving: u32,
}

/// Where a ray meets a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hit {
    /// Metres along the ray, not below 0.
    pub(crate) distance: f64,
    /// Number of the face.
    pub(crate) face: u32,
    /// Metres from where the search began.
    searched: f64,
}

impl Ray {
    pub(crate) fn new(origin: DVec3, direction: DVec3) -> Self {
        Self { origin, direction, start: origin, leaving: NOWHERE }
    }

    /// The first face on the way; none where the room is open.
    #[inline]
    pub(crate) fn cast(&self, room: &Room) -> Option<Hit> {
        let (face, roughly) = room.cast(self.start, self.direction, self.leaving)?;
        let plane = &room.planes()[room.plane(face) as usize];
        let exactly = -plane.height(self.origin) / plane.normal.dot(self.direction);
        // Where a ray grazes a plane, the way to it is anything.
        let distance = if (exactly - roughly).abs() < 100.0 * room.skin() { exactly.max(0.0) } else { roughly };
        Some(Hit { distance, face, searched: roughly })
    }

    /// A point that is so far along it, metres.
    pub(crate) fn at(&self, distance: f64) -> DVec3 {
        self.origin + distance * self.direction
    }

    /// Goes on as from a mirror.
    pub(crate) fn mirror(&mut self, room: &Room, hit: &Hit) {
        let plane = room.plane(hit.face);
        self.go_to(room, hit, plane);
        self.direction = room.planes()[plane as usize].reflect(self.direction);
    }

    /// Goes on from where it hits in a direction after Lambert's law, to the side that it has come from.
    pub(crate) fn scatter(&mut self, room: &Room, hit: &Hit, random: &mut Random) {
        let number = room.plane(hit.face);
        let plane = room.planes()[number as usize];
        self.go_to(room, hit, number);
        // No exact way goes on here, so that of the search does.
        self.origin = self.start - plane.height(self.start) * plane.normal;
        self.direction = lambert(if plane.normal.dot(self.direction) > 0.0 { -plane.normal } else { plane.normal }, random);
    }

    fn go_to(&mut self, room: &Room, hit: &Hit, plane: u32) {
        self.origin = self.at(hit.distance);
        // On the way of the search, which has met nothing so far; in a corner, where that is shorter, the last start will do.
        self.start += (hit.searched - room.skin()).max(0.0) * self.direction;
        self.leaving = plane;
    }
}
