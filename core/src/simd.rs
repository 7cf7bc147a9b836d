//! Vector arithmetic that the network and the render heads share: operations on vectors, tiles of sums, weights in the order in
//! which they are read. The running machine's instructions are chosen by `pulp`, without unsafe code here.

mod tiles;
mod vectors;
mod weights;

pub(crate) use tiles::{Tile, for_few, for_tiles, step};
pub(crate) use vectors::{all, larger, load, minus, over, plus, root, smaller, times, times_plus};
pub(crate) use weights::{TILE, Weights};

/// Lanes of the widest vector there is, 512 bits.
pub(crate) const LANES: usize = 16;

/// Numbers of the lanes.
pub(crate) const LANE: [f32; LANES] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0];

#[cfg(test)]
pub(crate) mod tests;
