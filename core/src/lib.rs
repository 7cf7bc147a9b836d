//! Promenade's engine: a listener's pose and a scene go in with a dry track, binaural stereo comes out.
//!
//! A [`Scene`] is read from bytes, a [`Renderer`] plays it at a host's sample rate, a [`Spatializer`] is what the audio thread
//! owns. Nothing here depends on a host, a thread, a file, a clock or a user interface.
//!
//! ```
//! use promenade_core::glam::Vec3;
//! use promenade_core::{BlockParams, Pose, Renderer, Scene, Spatializer};
//! use std::sync::Arc;
//!
//! // A worker reads a scene and prepares it for the host's sample rate.
//! let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../presets/scenes/iosr-room-a.promenade");
//! let scene = Arc::new(Scene::from_bytes(&std::fs::read(file)?)?);
//! let mut spatializer = Spatializer::new(48_000.0);
//! spatializer.install(Box::new(Renderer::new(scene, 48_000.0)?));
//!
//! // The audio thread plays blocks of any size. The head turns to the left by 90 degrees a second.
//! let dry = [0.5; 512];
//! let (mut left, mut right) = ([0.0; 512], [0.0; 512]);
//! for block in 0..10 {
//!     let yaw = |sample: usize| (block * 512 + sample) as f32 / 48_000.0 * 90.0_f32.to_radians();
//!     let pose_at = |sample| Pose::from_ypr(Vec3::ZERO, yaw(sample), 0.0, 0.0);
//!     spatializer.process(&[&dry], &[], [&mut left, &mut right], &BlockParams::default(), pose_at);
//! }
//! assert!(left.iter().chain(&right).all(|sample| *sample != 0.0));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![forbid(unsafe_code)]
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable))]
#![cfg_attr(not(test), warn(clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::cast_possible_wrap))]

mod bands;
pub mod decode;
mod emitters;
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
mod transfer;
mod trim;
mod voice;

pub use bands::Bands;
pub use decode::{
    Axis, Basis, DecodeWorker, Decoded, Facing, Field, FieldGrid, LiveParams, LowRank, NEAREST_M, PublishedFrame, Rows,
    SILENT_DB,
};
pub use emitters::{EmitterParams, Emitters};
pub use glam;
pub use grid::{StftGrid, TAP_LEAD_HOPS};
pub use head::{Head, HeadError};
pub use latency::Latency;
pub use octave::{OCTAVES, OCTAVES_HZ, Octaves};
pub use path::{CameraPath, Keyframe, KeyframeEntry, MAX_KEYFRAMES, PathError, Playback};
pub use pose::Pose;
pub use ramp::Ramp;
pub use render::carriers::Carriers;
pub use render::late::network::late_share;
pub use render::low::lowest_bins::LOWEST_BINS;
pub use renderer::{RenderError, RenderParams, Renderer, RendererConfig, SAMPLE_RATES_HZ};
pub use scene::{
    AMBISONIC_CHANNELS, AmbisonicHead, Anchor, AnchorCloud, Audible, BASS_SIGNALS, BassEars, BassField, Corners,
    DiffractionEdge, Emission, FrontPoint, HeldOut, ImageSource, ImageSources, Lifted, MAX_SCENE_BYTES, Measure, MeasuredHead,
    MeasuredRoom, Mover, NoHeadError, NotAmbisonicError, Provenance, ResponseMeasures, Scene, SceneCard, SceneError,
    SceneParts, Setting, Site, TailModel, TooCostly, TurningRoom, Weather, ambisonic_dry, barrier_db, lit_gain, noise_share,
    wave_share,
};
pub use spatializer::{BlockParams, Spatializer};
pub use transfer::{MOST_SHARES, Shares, TransferFunction, TransferShape};
pub use trim::{EARLY_S, Trim};
pub use voice::{MOST_VOICES, Voice};
