//! The walls of the room that responses were measured in.

use crate::BakeError;
use promenade_core::Mover;
use promenade_core::glam::Vec3;

/// Lengths of a room, metres.
const LENGTHS_M: (f32, f32) = (0.5, 200.0);

/// A box room along the axes of the world that its responses are stated in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Walls {
    /// The corner of least coordinates, world, metres.
    pub corner: Vec3,
    /// Lengths along x, y and z, metres; infinite along an axis of whose walls nothing is known.
    pub size: Vec3,
    /// What moves in it while the listener of a scene walks, where sources were measured around one listener; without it the
    /// source, where it was measured at several distances, else the listener.
    pub moves: Option<Mover>,
}

impl Walls {
    /// Checks that it is a room with everything inside.
    ///
    /// # Errors
    /// Lengths outside 0.5 to 200 m, a place outside the room.
    pub(crate) fn check(&self, places: impl Iterator<Item = (&'static str, Vec3)>) -> Result<(), BakeError> {
        let (least, most) = LENGTHS_M;
        let known = self.size.to_array().into_iter().filter(|length| *length != f32::INFINITY);
        if known.clone().count() == 0
            || !known.clone().all(|length| (least..=most).contains(&length))
            || !self.corner.is_finite()
        {
            let expected = format!("lengths of {least} to {most} m, one at least");
            return Err(BakeError::argument("room of the responses", expected, self.size));
        }
        let unknown = Vec3::select(self.size.cmpeq(Vec3::INFINITY), Vec3::INFINITY, Vec3::ZERO);
        let (low, high) = (self.corner - unknown, self.corner + self.size);
        for (what, at) in places {
            if !(at.cmpgt(low).all() && at.cmplt(high).all()) {
                return Err(BakeError::argument("room of the responses", format!("every {what} between {low} and {high}"), at));
            }
        }
        Ok(())
    }
}
