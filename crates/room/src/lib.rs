//! From acoustics to scenes: a room of any kind gives images, what is seen of them and late energies, and [`Surfaces`] makes
//! the scene.
//!
//! Light enough to run in the plugin while a user draws a room. The baker makes its scenes of meshes with the same maker.
//!
//! ```
//! use promenade_acoustics::{Air, Material, Shoebox};
//! use promenade_core::Scene;
//! use promenade_core::glam::Vec3;
//! use promenade_room::{PLAYED_IMAGES, SceneHead, SceneOptions, ShoeboxRoom};
//!
//! // The head of another scene of image sources.
//! let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../presets/scenes/loft.promenade");
//! let head = SceneHead::of_scene(&Scene::from_bytes(&std::fs::read(file)?)?).ok_or("a scene without a head")?;
//!
//! let wall = Material::new("brick", [0.1; 7], [0.1; 7]);
//! let walls = Shoebox { size: [6.0, 4.6, 2.7], materials: std::array::from_fn(|_| wall.clone()) };
//! let room = ShoeboxRoom { walls, corner: Vec3::ZERO, emitter: Vec3::new(4.2, 2.9, 1.3) };
//! let scene = room.scene(
//!     &head,
//!     &SceneOptions {
//!         images: PLAYED_IMAGES,
//!         air: Air::default(),
//!         waves_hz: None,
//!         layer_m: None,
//!         gain_db: 0.0,
//!         seed: 1,
//!         title: "A room".to_owned(),
//!         recipe: String::new(),
//!     },
//! )?;
//! assert_eq!(scene.emitter(), Some(room.emitter));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![forbid(unsafe_code)]

mod bass;
mod energy_vector;
mod error;
mod late;
mod reverberation;
mod scene_head;
mod shoebox_room;
mod surfaces;

pub use bass::{CROSSOVERS_HZ, RoomBass, bass_axis, bass_places, crossover_hz, whole_hz};
pub use energy_vector::{EnergyVector, ear_energy};
pub use error::RoomError;
pub use late::{
    HopEnergies, LONGEST_EARLY_S, LateEnergies, SHORTEST_EARLY_S, early_taps, late_gain, sided, t20_end, time_filters,
};
#[cfg(feature = "meshes")]
pub use reverberation::match_room_t20;
pub use reverberation::{Matched, Missed, Some7, T20_S, factored, match_t20, measured_t20_s, t20_s};
pub use scene_head::SceneHead;
pub use shoebox_room::{PLAYED_IMAGES, SIZES_M, SceneOptions, ShoeboxRoom};
pub use surfaces::{LatePart, Places, Played, PlayedImage, Surfaces, outline};
