//! Rooms from geometry: where their walls mirror a source to, and how the rest of its energy arrives.
//!
//! A [`Mesh`] with a [`Material`] for each of its groups is a [`Room`]. [`Images`] finds the mirror images of a source that
//! listeners see, a [`Shoebox`] has its own without a search. Meshes come with the feature `meshes`; boxes need none of it.
//! Everything is in metres, seconds, hertz and linear factors of energy or amplitude, as each item says; axes are the caller's.
//! Numbers by octave are [`Octaves`]. Directions and places are `[x, y, z]`.
//!
//! Sound travels on rays, of which only the direct sound goes round [`Edges`], one each. Below Schroeder's frequency, some
//! 200 Hz in a living room, the field is that of [`waves`], or of a box's modes ([`Shoebox::low_field`]).
//!
//! ```
//! use promenade_acoustics::{Air, Material, Reflected, Shoebox};
//!
//! // A box of 6 x 4.6 x 2.7 m whose walls absorb a tenth and scatter nothing.
//! let wall = Material::even("plaster", 0.1, 0.0);
//! let room = Shoebox { size: [6.0, 4.6, 2.7], materials: std::array::from_fn(|_| wall.clone()) };
//!
//! // The source, and its mirror images in the six walls.
//! let images = room.images([1.0, 2.0, 1.5], 1, Reflected::Whole)?;
//! assert_eq!(images.len(), 7);
//! assert!(images.iter().any(|image| image.position == [-1.0, 2.0, 1.5]));
//! assert!(images[1..].iter().all(|image| (image.gains[3] - 0.9_f32.sqrt()).abs() < 1e-6));
//!
//! // Reverberation times in octaves from 125 Hz; air takes some of the treble.
//! let t60_s = room.eyring_t60_s(Some(Air::default()));
//! assert!(t60_s[0] > 0.9 && t60_s[0] < 1.2 && t60_s[6] < t60_s[0], "{t60_s:?}");
//! # Ok::<(), promenade_acoustics::AcousticsError>(())
//! ```

#![forbid(unsafe_code)]

#[cfg(feature = "meshes")]
mod diffraction;
mod directivity;
mod error;
mod images;
mod low_frequency;
mod materials;
#[cfg(feature = "meshes")]
mod mesh;
mod octave;
mod rays;
#[cfg(feature = "meshes")]
mod room;

#[cfg(feature = "meshes")]
pub use diffraction::{DiffractedImages, DiffractionPath, Edges};
pub use directivity::lattice::fibonacci;
#[cfg(feature = "meshes")]
pub use directivity::source::{Directivity, Source};
pub use error::AcousticsError;
pub use images::image::{Image, MAX_ORDER, Reflected};
#[cfg(feature = "meshes")]
pub use images::search::{ImageOptions, Images};
pub use images::shoebox::{BoxImage, Shoebox, box_images};
pub use low_frequency::low_field::{LowField, LowResponse};
pub use low_frequency::modes::LowPlaces;
#[cfg(feature = "meshes")]
pub use low_frequency::waves::{WaveOptions, waves};
pub use materials::admittance::admittance;
pub use materials::air::{Air, speed_m_s};
pub use materials::catalogue::{Entry, Materials};
pub use materials::curve::Curve;
pub use materials::material::{Material, SCATTERING};
pub use materials::wildcard::fits;
#[cfg(feature = "meshes")]
pub use mesh::{Flattened, Floor, FoundBox, Mesh, MeshReport, Ply, PlyError, PlyLimits, Sights, Triangle};
pub use octave::{BANDS, OCTAVES_HZ, Octaves, centred, octave_energy, octave_energy_from_63, octave_place};
pub use rays::echogram::{Bin, Echogram, decay_time_s, low_t20_s};
#[cfg(feature = "meshes")]
pub use rays::intensity::{Intensity, Seen};
#[cfg(feature = "meshes")]
pub use rays::late_field::{LateField, RayOptions, late_field};
pub use rays::measures::Measures;
pub use rays::particles::ParticleOptions;
#[cfg(feature = "meshes")]
pub use rays::reflections::{Met, reflections};
#[cfg(feature = "meshes")]
pub use room::{Room, Surroundings};

/// Metres per second, of air at 20 degrees Celsius.
pub const SPEED_OF_SOUND_M_S: f64 = promenade_core::network::SPEED_OF_SOUND_M_S as f64;
