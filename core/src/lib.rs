//! Promenade's engine: a listener's pose and a scene go in with a dry track, binaural stereo comes out.
//!
//! A [`Scene`] is read from bytes, a [`Renderer`] plays it at a host's sample rate, a [`Spatializer`] is what the audio thread
//! owns. Nothing here depends on a host, a thread, a file, a clock or a user interface.

#![forbid(unsafe_code)]
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable))]
#![cfg_attr(not(test), warn(clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::cast_possible_wrap))]

mod bands;
pub mod decode;
mod emitters;
mod further;
#[cfg(feature = "gradients")]
pub mod gradient;
mod grid;
pub mod head;
pub mod headphones;
mod latency;
mod minimum_phase;
pub mod network;
mod number;
pub mod octave;
mod past;
mod path;
mod pose;
pub mod published;
mod ramp;
pub mod random;
mod render;
mod renderer;
mod scene;
mod simd;
mod source;
mod spatializer;
mod stft;
mod tier;
mod transfer;
mod trim;

pub use bands::Bands;
pub use decode::{
    Axis, Basis, DecodeWorker, Decoded, Facing, Field, FieldGrid, LowRank, NEAREST_M, PublishedFrame, Rows, SILENT_DB,
};
pub use emitters::{EmitterParams, Emitters};
pub use further::{Further, MOST_FURTHER};
pub use glam;
pub use grid::{StftGrid, TAP_LEAD_HOPS};
pub use head::{Head, HeadError};
pub use latency::Latency;
pub use octave::{OCTAVES, OCTAVES_HZ, Octaves};
pub use path::{CameraPath, Keyframe, KeyframeEntry, MAX_KEYFRAMES, PathError, Playback};
pub use pose::Pose;
pub use ramp::Ramp;
pub use render::carriers::Carriers;
pub use render::late::late_share;
pub use render::low::LOWEST_BINS;
pub use renderer::{RenderError, RenderParams, Renderer, SAMPLE_RATES_HZ};
pub use scene::{
    AMBISONIC_CHANNELS, AmbisonicHead, Anchor, AnchorCloud, BASS_SIGNALS, BassEars, BassField, Corners, DiffractionEdge,
    Emission, HeldOut, ImageSource, ImageSources, Lifted, MAX_SCENE_BYTES, MeasuredHead, MeasuredRoom, Mover, NoHeadError,
    NotAmbisonicError, Provenance, ResponseMeasures, Scene, SceneCard, SceneError, SceneParts, Site, TailModel, TooCostly,
    TurningRoom, Weather, ambisonic_dry, barrier_db, lit_gain, noise_share, wave_share,
};
pub use spatializer::{BlockParams, Spatializer};
pub use tier::{LiveParams, Quality, Tier};
pub use transfer::{MOST_SHARES, Shares, TransferFunction, TransferShape};
pub use trim::{EARLY_S, Trim};
