//! AV-Cloud's time filters: what a clip's frames, or a stream's, add to each other.
//!
//! Two forms (Chen and Shlizerman 2024, section 3.3, as the published code has them): a hyper-network that turns each band's
//! embedding into a matrix over frames and three neighbouring bands, and one matrix for all bands from spherical harmonics of
//! the directions to the anchors.

mod exact;
pub(crate) mod harmonics;
mod hyper;
mod project;
mod stream_taps;

pub(crate) use exact::TimeFilter;
pub use harmonics::spherical_harmonics;
pub use project::{Projection, TapProjector};
pub use stream_taps::StreamTaps;
