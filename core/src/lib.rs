//! Promenade's engine: a listener's pose and a scene go in with a dry track, binaural stereo comes out.

mod path;
mod pose;
mod tier;

pub use glam;
pub use path::{CameraPath, Keyframe, PathError, Playback};
pub use pose::Pose;
pub use tier::Tier;
