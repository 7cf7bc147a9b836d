//! A box room that the user draws, as a project keeps it.

use crate::parameter::cast::narrow;
use promenade_acoustics::{AcousticsError, Air, BANDS, Entry, Material, Materials, Shoebox};
use promenade_core::Scene;
use promenade_core::glam::Vec3;
use promenade_room::{PLAYED_IMAGES, RoomError, SIZES_M, SceneHead, SceneOptions, ShoeboxRoom, Some7, factored};
use serde::{Deserialize, Serialize};
use std::sync::LazyLock;

/// The table of materials.
static TABLE: LazyLock<Materials> = LazyLock::new(Materials::default);
/// The emitter that is moved keeps this far from the walls, metres, where there is room for it.
const OFF_WALLS_M: f32 = 0.1;
/// A room begins with the listener here, metres from its corner.
const LISTENER_M: Vec3 = Vec3::new(1.8, 2.1, 1.3);

/// Three lengths, six materials by name and an emitter. Fields that a newer version has added are ignored, missing ones are as
/// at first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct DrawnRoom {
    /// Lengths along x, y and z, metres.
    pub size: [f32; 3],
    /// The corner of least x, y and z in the world, metres.
    pub corner: [f32; 3],
    /// The emitter in the world, metres.
    pub emitter: [f32; 3],
    /// Materials as [`Materials::material`] reads them, of the walls at the least and the greatest x and y, of floor and
    /// ceiling.
    pub materials: [String; 6],
    /// Reverberation times that the walls are to have, T20 by octave from 125 Hz, seconds.
    #[serde(skip_serializing_if = "is_unset")]
    pub t20_s: [Option<f32>; BANDS],
    /// How much more or less the walls absorb for that, as [`factored`] has it; 1 is as their materials do.
    #[serde(skip_serializing_if = "is_one")]
    pub factors: [f32; BANDS],
}

fn is_unset(t20_s: &[Option<f32>; BANDS]) -> bool {
    t20_s.iter().all(Option::is_none)
}

fn is_one(factors: &[f32; BANDS]) -> bool {
    *factors == [1.0; BANDS]
}

impl Default for DrawnRoom {
    /// A living room about a listener at the world's origin.
    fn default() -> Self {
        let materials = ["plasterboard", "plasterboard", "curtains_cotton_0.5", "plasterboard", "carpet_thin", "plasterboard"];
        Self {
            size: [6.0, 4.6, 2.7],
            corner: (-LISTENER_M).to_array(),
            emitter: (Vec3::new(4.2, 2.9, 1.3) - LISTENER_M).to_array(),
            materials: materials.map(str::to_owned),
            t20_s: [None; BANDS],
            factors: [1.0; BANDS],
        }
    }
}

impl DrawnRoom {
    /// A room about a listener.
    pub fn around(listener: Vec3) -> Self {
        let mut room = Self::default();
        let moved = |at: [f32; 3]| (Vec3::from_array(at) + listener).to_array();
        (room.corner, room.emitter) = (moved(room.corner), moved(room.emitter));
        room
    }

    /// The materials that there are, by name.
    pub fn materials_of_table() -> impl Iterator<Item = (&'static str, &'static Entry)> {
        TABLE.absorbing()
    }

    /// Corners of least and of greatest x, y and z.
    pub fn corners(&self) -> [Vec3; 2] {
        let low = Vec3::from_array(self.corner);
        [low, low + Vec3::from_array(self.size)]
    }

    /// Its lengths in words.
    pub fn lengths(&self) -> String {
        let [x, y, z] = self.size.map(|length| format!("{:.2}", length).trim_end_matches('0').trim_end_matches('.').to_owned());
        format!("{x} x {y} x {z} m")
    }

    /// Sets a length, metres; the corner stays. The emitter is kept inside.
    pub fn set_length(&mut self, axis: usize, length: f32) {
        self.size[axis] = within(length);
        self.set_emitter(Vec3::from_array(self.emitter));
    }

    /// Moves one of the six walls to a coordinate; the one opposite stays. The emitter is kept inside.
    pub fn move_wall(&mut self, wall: usize, to: f32) {
        let axis = wall / 2;
        let [low, high] = self.corners().map(|corner| corner[axis]);
        if wall.is_multiple_of(2) {
            self.size[axis] = within(high - to);
            self.corner[axis] = high - self.size[axis];
        } else {
            self.size[axis] = within(to - low);
        }
        self.set_emitter(Vec3::from_array(self.emitter));
    }

    /// Moves the emitter, as far as it stays inside.
    pub fn set_emitter(&mut self, to: Vec3) {
        let [low, high] = self.corners();
        let off = Vec3::splat(OFF_WALLS_M).min(0.25 * (high - low));
        if to.is_finite() {
            self.emitter = to.clamp(low + off, (high - off).max(low + off)).to_array();
        }
    }

    /// Whether a place is inside.
    pub fn holds(&self, at: Vec3) -> bool {
        let [low, high] = self.corners();
        at.cmpge(low).all() && at.cmple(high).all()
    }

    /// The walls as their materials make them.
    ///
    /// # Errors
    /// A material that the table has not.
    fn named(&self) -> Result<Shoebox, AcousticsError> {
        let mut materials = Vec::with_capacity(self.materials.len());
        for name in &self.materials {
            materials.push(TABLE.material(name)?);
        }
        let materials = materials.try_into().unwrap_or_else(|_| unreachable!("as many materials as names"));
        Ok(Shoebox { size: self.size.map(f64::from), materials })
    }

    /// The walls as their materials make them, and the times that they are to have, if there are any.
    pub fn wanted(&self) -> Option<(Shoebox, Some7)> {
        let t20_s = self.t20_s.map(|t| t.map(f64::from));
        t20_s.iter().any(Option::is_some).then_some(t20_s).zip(self.named().ok()).map(|(t20_s, walls)| (walls, t20_s))
    }

    /// The room with its walls as they are heard.
    ///
    /// # Errors
    /// A material that the table has not.
    fn room(&self) -> Result<ShoeboxRoom, AcousticsError> {
        let named = self.named()?;
        // A state from a file may hold anything.
        let factors = self.factors.map(|f| if f.is_finite() { f64::from(f).clamp(1e-3, 1e3) } else { 1.0 });
        let walls = Shoebox { materials: named.materials.each_ref().map(|m| factored(m, &factors)), ..named };
        Ok(ShoeboxRoom { walls, corner: self.corner.into(), emitter: self.emitter.into() })
    }

    /// Whether its materials are there.
    ///
    /// # Errors
    /// The first that is not.
    pub fn check(&self) -> Result<(), AcousticsError> {
        self.room().map(drop)
    }

    /// The room as a scene, heard with a head.
    ///
    /// # Errors
    /// A length, an emitter or a material that no room can have.
    ///
    /// # Real-time
    /// Not real-time safe: takes as long as a room's making.
    pub fn scene(&self, head: &SceneHead) -> Result<Scene, RoomError> {
        let title = format!("Room of {}", self.lengths());
        let [x, y, z] = self.size;
        let [ex, ey, ez] = (Vec3::from_array(self.emitter) - Vec3::from_array(self.corner)).to_array();
        let room = self.room()?;
        let materials = if is_one(&self.factors) {
            self.materials.join(";")
        } else {
            room.walls.materials.each_ref().map(described).join(";")
        };
        let recipe = format!("simulate box --size {x},{y},{z} --emitter {ex},{ey},{ez} --materials '{materials}'");
        room.scene(
            head,
            &SceneOptions {
                images: PLAYED_IMAGES,
                air: Air::default(),
                waves_hz: None,
                layer_m: None,
                gain_db: 0.0,
                seed: 1,
                title,
                recipe,
            },
        )
    }
}

/// A material as [`Materials::material`] reads it.
fn described(material: &Material) -> String {
    let all = |shares: &[f32]| shares.iter().map(|s| format!("{s:.4}")).collect::<Vec<_>>().join("/");
    format!("{}:{}", all(&material.absorption), all(&material.scattering))
}

/// A length that a room can have.
fn within(length: f32) -> f32 {
    let (least, greatest) = (narrow(SIZES_M.0), narrow(SIZES_M.1));
    if length.is_finite() { length.clamp(least, greatest) } else { least }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn walls_move_one_by_one_and_take_the_emitter_along() {
        let mut room = DrawnRoom::around(Vec3::new(10.0, 0.0, 1.5));
        let [low, high] = room.corners();
        room.move_wall(1, high.x - 3.0);
        assert_eq!((room.corner[0], room.corners()[1].x), (low.x, high.x - 3.0));
        assert!((room.emitter[0] - (high.x - 3.0 - OFF_WALLS_M)).abs() < 1e-5, "{:?}", room.emitter);
        room.move_wall(4, low.z - 1.0);
        assert!((room.corners()[1].z - high.z).abs() < 1e-5 && (room.size[2] - 3.7).abs() < 1e-5);
        room.move_wall(0, 1e9);
        assert_eq!(room.size[0], 0.5, "a wall does not pass the one opposite");
        room.set_length(1, f32::NAN);
        room.set_emitter(Vec3::splat(1e30));
        assert!(room.holds(room.emitter.into()) && room.size[1] == 0.5);
    }

    #[test]
    fn a_room_survives_a_state_and_what_it_lacks_is_as_at_first() {
        let mut room = DrawnRoom::around(Vec3::ONE);
        room.materials[4] = "0.3:0.5".to_owned();
        let json = serde_json::to_string(&room).unwrap();
        assert_eq!(serde_json::from_str::<DrawnRoom>(&json).unwrap(), room);
        let later: DrawnRoom = serde_json::from_str(r#"{"size": [3.0, 4.0, 5.0], "shape": "round"}"#).unwrap();
        assert_eq!((later.size, later.materials), ([3.0, 4.0, 5.0], DrawnRoom::default().materials));
    }

    #[test]
    fn typed_times_change_what_walls_absorb_and_not_what_they_are_made_of() {
        let mut room = DrawnRoom::default();
        assert_eq!(room.wanted(), None);
        let named = room.room().unwrap().walls;
        (room.t20_s[2], room.factors[2]) = (Some(0.4), 2.0);
        let (walls, t20_s) = room.wanted().unwrap();
        assert_eq!((&walls, t20_s[3]), (&named, None));
        let heard = room.room().unwrap().walls;
        for (named, heard) in named.materials.iter().zip(&heard.materials) {
            assert!(heard.absorption[2] > named.absorption[2] && heard.absorption[3] == named.absorption[3]);
        }
        room.factors[2] = f32::NAN;
        assert_eq!(room.room().unwrap().walls, named, "as a damaged state may have it");
    }

    #[test]
    fn every_material_of_the_table_is_one_and_others_are_named() {
        for (name, _) in DrawnRoom::materials_of_table() {
            let room = DrawnRoom { materials: std::array::from_fn(|_| name.to_owned()), ..DrawnRoom::default() };
            assert!(room.room().is_ok(), "{name}");
        }
        let room = DrawnRoom { materials: std::array::from_fn(|_| "marbel".to_owned()), ..DrawnRoom::default() };
        assert!(room.room().unwrap_err().to_string().contains("marble_floor"));
    }
}
