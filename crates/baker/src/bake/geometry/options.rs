//! How a scene is made of a room.

use promenade_acoustics::Air;

/// How a scene is made of a room.
#[derive(Clone, Debug, PartialEq)]
pub struct GeometryOptions {
    /// Image sources that are played, at most; the strongest are.
    pub images: usize,
    /// Turns of the head that time filters are stored for, evenly around; with one, what comes more from one side is heard by
    /// both ears alike.
    pub head_turns: usize,
    /// Reflections that an image has at most, and beams that search them.
    pub order: u32,
    /// Beams of the search.
    pub beams: usize,
    /// Rays of the late field.
    pub rays: usize,
    /// Metres between places of the listener.
    pub spacing_m: f32,
    /// Height of the listener's head over the lowest point of the room, metres.
    pub height_m: f32,
    /// Whether the bass of waves has places at several heights, for a listener who sits and stands.
    pub layered: bool,
    /// Distance of places from surfaces, metres.
    pub margin_m: f32,
    /// What the air takes; nothing without it.
    pub air: Option<Air>,
    /// Below this frequency, Hz, waves are in the place of images and rays; 0 for none. Without it as high as the room's size
    /// asks for, and time and the size of the file allow.
    pub waves_hz: Option<f64>,
    /// Level of the direct sound at 1 m over that of the dry sound, dB.
    pub gain_db: f64,
    /// Seed of rays and noise.
    pub seed: u64,
    /// Name shown to the user.
    pub title: String,
    /// How the scene is made, in one line, for its provenance.
    pub recipe: String,
}
