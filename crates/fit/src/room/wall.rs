//! One flat wall of a room.

/// A flat wall: points `p` with `normal . p = at_m`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlatWall {
    /// Unit length; of a box, out of the room, of a mesh, as its triangles say.
    pub normal: [f64; 3],
    /// Metres from the origin along the normal.
    pub at_m: f64,
    /// Number of its surface.
    pub surface: usize,
    /// Square metres.
    pub area_m2: f64,
}
