//! Derivatives that only training needs: of the render head and of a readout, carried back by hand.

pub(crate) mod clip_render;
pub(crate) mod readout;

pub use clip_render::{ClipRender, ClipRenderInput};
