//! Camera paths: reading and writing them, and what an editor of paths needs.
//!
//! [`read()`] takes the bytes of a file, JSON, CSV, cameras of COLMAP or NeRF tools or a glTF animation, and gives a
//! [`CameraPath`] in Promenade's world: right-handed, z up, metres; the head looks along x. [`write()`] makes JSON or CSV of
//! one. [`simplify()`] reduces a recorded walk to few keyframes, [`Recorder`] records one, and [`edit`] changes single
//! keyframes. [`colmap`] also gives the cameras of a reconstruction, and [`PlacementOptions`] place a foreign world in the
//! scene's.
//!
//! Nothing here opens a file or is meant for the audio thread: all of it may allocate and take its time.
//!
//! ```
//! use promenade_paths::{ImportOptions, alone, read};
//! let csv = b"t,x,y,z,yaw,pitch,roll\n0,0,0,0,0,0,0\n2,1,0,0,90,0,0\n";
//! let imported = read("walk.csv", csv, &ImportOptions::default(), &mut alone)?;
//! assert_eq!(imported.path.duration_s(), 2.0);
//! # Ok::<(), promenade_paths::PathFileError>(())
//! ```

#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::cast_possible_wrap))]
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable))]

mod adm;
pub mod colmap;
mod csv;
pub mod edit;
mod error;
mod format;
mod gltf;
mod json;
mod limit;
mod options;
mod placement;
mod read;
mod recorder;
mod simplify;
mod sound_file;
mod speed;
mod summary;
mod text;
mod trajectory;
mod transforms;
mod waypoint;
mod write;

pub use error::PathFileError;
pub use format::{Format, WriteFormat};
pub use limit::MAX_FILE_BYTES;
pub use options::{Beside, ImportOptions, alone};
pub use placement::{Origin, PlacementOptions};
pub use promenade_core::{CameraPath, Keyframe, KeyframeEntry, MAX_KEYFRAMES, PathError, Pose};
pub use read::{GLTF_TOLERANCE_M, GLTF_TOLERANCE_RAD, Imported, read};
pub use recorder::{RecordError, Recorder, RecorderConfig};
pub use simplify::simplify;
pub use sound_file::bytes_of;
pub use summary::Summary;
pub use write::write;
