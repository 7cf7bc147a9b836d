//! Where walls are, from echoes: of walls that are stated, of a box of which nothing is, and of picked times.

mod box_search;
mod echo_walls;
mod wall_scan;

pub(crate) use box_search::near_box;
pub use box_search::{Searched, search_box};
pub use echo_walls::{EchoBox, EchoWall, echo_box};
pub use wall_scan::Scanned;
pub(crate) use wall_scan::scan;
