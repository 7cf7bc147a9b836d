//! Derivatives that training needs.

pub(crate) mod clip_render;

pub use clip_render::{ClipRender, ClipRenderInput};
