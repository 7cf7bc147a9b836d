//! Training: captures in, anchor clouds with their decoders out.
//!
//! What is trained is what is played. The network (AV-Cloud's transformer) runs as a differentiable graph; what follows it, the engine's
//! own render head, gives its derivative itself ([`promenade_core::gradient::ClipRender`]; for AV-Cloud's own, [`promenade_core::gradient::PublishedAdjoint`]).

mod checkpoint;
mod head;
mod network;
mod published;
mod scene;
mod search;
pub mod settings;
mod setup;
mod softmax;
mod spectral_loss;
mod streaming;
mod time_filter;
mod training;
mod weights;

pub use burn::tensor::Device;
pub use checkpoint::{Checkpoint, CurvePoint};
pub use head::Example;
pub use search::{Trial, WORTH, search};
pub use settings::{HeadKind, LossSettings, NetworkSettings, TrainSettings};
pub use training::{Scores, StepReport, Trainer};
pub use weights::{AdamW, Arrays};

/// The graphics card that Vulkan gives first.
#[cfg(feature = "gpu")]
#[must_use]
pub fn gpu() -> Device {
    Device::vulkan(burn::tensor::DeviceKind::DefaultDevice)
}
