//! Promenade's engine: a listener's pose and a scene go in with a dry track, binaural stereo comes out.
//!
//! A [`Scene`] is read from bytes, a [`Renderer`] plays it at a host's sample rate, a [`Spatializer`] is what the audio thread owns.
//! Nothing here knows a host, a thread, a file, a clock or a user interface.

#![forbid(unsafe_code)]
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable))]

mod bands;
mod carrier;
mod clip_head;
pub mod cloud;
mod decoding;
mod direct;
mod field;
mod grid;
mod head;
mod lanes;
mod late;
mod live;
pub mod metrics;
mod path;
mod phasor;
mod pose;
mod reference;
mod renderer;
mod scene;
mod spatializer;
mod stft;
mod taps;
mod tier;
mod transfer;

pub use bands::Bands;
pub use clip_head::{ClipHead, ClipInput};
pub use field::{Axis, Basis, Facing, Field, FieldGrid, LowRank, NEAREST_M, Rows, SILENT_DB};
pub use glam;
pub use grid::StftGrid;
pub use live::{Decoded, LiveDecoder, LiveParams, SarhFrame};
pub use path::{CameraPath, Keyframe, KeyframeEntry, MAX_KEYFRAMES, PathError, Playback};
pub use pose::Pose;
pub use renderer::{Quality, RenderError, Renderer, SAMPLE_RATES_HZ};
pub use scene::{
    Anchor, AnchorCloud, HeldOut, MAX_SCENE_BYTES, Provenance, Scene, SceneCard, SceneError, SceneParts, TailModel,
};
pub use spatializer::{BlockParams, Spatializer};
pub use tier::Tier;
pub use transfer::{TransferFunction, TransferShape};
