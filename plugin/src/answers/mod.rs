//! What an open editor or the loader asks of a scene, and the threads that compute the answers.

pub mod response;
pub mod reverberation;
pub mod room_map;
pub mod settled;
