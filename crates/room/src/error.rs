//! Why a room makes no scene.

/// Why a room makes no scene.
pub type RoomError = promenade_fault::Fault;
