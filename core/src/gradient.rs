//! Derivatives that only training needs: of the render head, of the published head and of a readout, carried back by hand.

pub(crate) mod clip_render;
pub(crate) mod conv;
pub(crate) mod correlation;
pub(crate) mod published_clip;
pub(crate) mod readout;

pub use clip_render::{ClipRender, ClipRenderInput};
pub use published_clip::{PublishedAdjoint, PublishedGradient};
