//! Rooms from geometry: where their walls mirror a source to, and how the rest of its energy arrives.
//!
//! A [`Mesh`] with a [`Material`] for each of its groups is a [`Room`]. [`Images`] finds the mirror images of a source that
//! listeners see, a [`Shoebox`] has its own without a search. Meshes come with the feature `meshes`; boxes need none of it.
//! Everything is in metres, seconds, hertz and linear factors of energy or amplitude, as each item says; axes are the caller's.
//! Numbers by octave are [`Octaves`]. Directions and places are `[x, y, z]`.
//!
//! Sound travels on rays, of which only the direct sound goes round [`Edges`], one each. Below Schroeder's frequency, some
//! 200 Hz in a living room, the field is that of [`waves`], or of a box's modes ([`Shoebox::low_field`]).

#![forbid(unsafe_code)]

mod admittance;
mod air;
mod bands;
mod box_waves;
#[cfg(feature = "meshes")]
mod diffraction;
#[cfg(feature = "meshes")]
mod directivity;
mod echogram;
mod error;
mod eyring;
mod image;
#[cfg(feature = "meshes")]
mod images;
#[cfg(feature = "meshes")]
mod intensity;
mod lattice;
mod low_field;
mod material;
mod materials;
mod measures;
#[cfg(feature = "meshes")]
mod mesh;
mod octave;
mod particles;
#[cfg(feature = "meshes")]
mod ply;
#[cfg(feature = "meshes")]
mod ray;
#[cfg(feature = "meshes")]
mod rays;
#[cfg(feature = "meshes")]
mod reflections;
#[cfg(feature = "meshes")]
mod room;
mod shares;
mod shoebox;
mod surface;
#[cfg(feature = "meshes")]
mod waves;
mod wildcard;

pub use admittance::admittance;
pub use air::{Air, speed_m_s};
pub use box_waves::LowPlaces;
#[cfg(feature = "meshes")]
pub use diffraction::{DiffractionPath, Edges, Lit};
#[cfg(feature = "meshes")]
pub use directivity::{Directivity, Source};
pub use echogram::{Bin, Echogram};
pub use error::AcousticsError;
pub use image::{Image, MAX_ORDER, Reflected};
#[cfg(feature = "meshes")]
pub use images::{ImageOptions, Images};
#[cfg(feature = "meshes")]
pub use intensity::{Intensity, Seen};
pub use lattice::fibonacci;
pub use low_field::{LowField, LowResponse};
pub use material::{Material, SCATTERING};
pub use materials::{Entry, Materials};
pub use measures::Measures;
#[cfg(feature = "meshes")]
pub use mesh::{Flattened, Floor, FoundBox, Mesh, MeshReport, Sights, Triangle};
pub use octave::{BANDS, OCTAVES_HZ, Octaves, octave_energy, octave_energy_from_63, octave_place};
pub use particles::ParticleOptions;
#[cfg(feature = "meshes")]
pub use ply::{Ply, PlyError, PlyLimits};
#[cfg(feature = "meshes")]
pub use rays::{LateField, RayOptions, late_field};
#[cfg(feature = "meshes")]
pub use reflections::{Met, reflections};
#[cfg(feature = "meshes")]
pub use room::{Room, Surroundings};
pub use shares::Curve;
pub use shoebox::{BoxImage, Shoebox, box_images};
#[cfg(feature = "meshes")]
pub use waves::{WaveOptions, waves};
pub use wildcard::fits;

/// Metres per second, of air at 20 degrees Celsius.
pub const SPEED_OF_SOUND_M_S: f64 = promenade_core::network::SPEED_OF_SOUND_M_S as f64;
