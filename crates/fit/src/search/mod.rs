//! Where walls are, from echoes: of walls that are stated and of a box of which nothing is.

mod box_search;
mod wall_scan;

pub(crate) use box_search::near_box;
pub use box_search::{Searched, search_box};
pub use wall_scan::Scanned;
pub(crate) use wall_scan::scan;
