//! What is done to a frame of each voice: its direct sound filtered, its early reflections and the room's late part added.

pub(crate) mod carrier;
pub(crate) mod carriers;
pub(crate) mod early;
pub(crate) mod head;
pub(crate) mod late;
pub(crate) mod low;
pub(crate) mod part;
pub(crate) mod reverberation;
pub(crate) mod room;
pub(crate) mod transform;
pub(crate) mod voice_filters;
