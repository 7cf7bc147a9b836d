//! What an open editor asks of a scene, and who answers while it waits.

pub mod response;
pub mod settled;
pub mod tier_figures;
