//! Training: captures in, anchor clouds with their networks out.
//!
//! The network (AV-Cloud's transformer) is a differentiable graph. The render head after it is core's own, so that training
//! hears what the plugin plays; its derivatives are core's too: [`promenade_core::gradient::ClipRender`].
//!
//! ```no_run
//! use promenade_baker::anchors::AnchorSet;
//! use promenade_baker::Capture;
//! use promenade_core::Provenance;
//! use promenade_trainer::{Device, TrainSettings, Trainer};
//!
//! // Recordings of a walk with the dry sound, and points of the place with their colours.
//! let capture = Capture::load("my-walk".as_ref())?;
//! let anchors = AnchorSet::load("place.safetensors".as_ref())?;
//! let mut trainer = Trainer::new(&capture, &anchors, TrainSettings::default(), Device::default(), 2)?;
//! while trainer.steps() < trainer.settings().steps {
//!     let report = trainer.step();
//!     println!("{}: {}", trainer.steps(), report.loss);
//! }
//! println!("{:?}", trainer.note()?.test);
//! std::fs::write("place.promenade", trainer.scene(Provenance::default())?.to_bytes()?)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod checkpoint;
mod gains;
mod head;
mod network;
pub mod refinement;
mod response_loss;
mod responses;
mod scene;
pub mod settings;
mod setup;
mod simulated;
mod softmax;
mod spectral_loss;
mod training;
mod weights;

pub use burn::tensor::Device;
pub use checkpoint::{Checkpoint, CurvePoint};
pub use head::{Example, ExampleVoice};
pub use responses::{Decay, RecordedResponse, recorded_decays, recorded_responses};
pub use settings::{LossSettings, NetworkSettings, TrainSettings};
pub use simulated::Simulate;
pub use training::{StepReport, Trainer};
pub use weights::{AdamW, Arrays};

/// The graphics card that Vulkan gives first.
#[cfg(feature = "gpu")]
#[must_use]
pub fn gpu() -> Device {
    Device::vulkan(burn::tensor::DeviceKind::DefaultDevice)
}
