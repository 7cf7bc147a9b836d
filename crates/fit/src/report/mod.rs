//! What a fit says of itself: text, tables, pictures, and files that other commands read.

mod beside;
mod decays;
mod full;
mod markdown;
mod mesh;
mod panels;

pub use decays::decays_svg;
pub use markdown::table;
pub use mesh::{MaterialsBeside, SourceBeside, box_obj, full_mesh};
