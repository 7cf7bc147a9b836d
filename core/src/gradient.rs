//! Derivatives that training needs.

pub(crate) mod clip_head;

pub use clip_head::{ClipHead, ClipInput};
