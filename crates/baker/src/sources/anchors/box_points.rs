//! The walls of a box room as points.

use crate::BakeError;
use crate::sources::reconstruction::Point;
use promenade_core::glam::Vec3;

/// Points that a box may have.
const MAX_POINTS: f32 = 4e6;

/// Colours of the walls at x = 0, x = size, y = 0, y = size, floor and ceiling, where nobody gives others: told apart by eye
/// and by a network.
pub const WALL_COLOURS: [[f32; 3]; 6] =
    [[0.7, 0.3, 0.2], [0.2, 0.6, 0.3], [0.25, 0.4, 0.8], [0.8, 0.7, 0.2], [0.35, 0.3, 0.3], [0.9, 0.9, 0.9]];

/// Points on the walls of the box from the origin to `size`, on a grid of this step that begins at the origin, with the colour
/// of each wall.
///
/// # Errors
/// A size or step that is not above 0, or more points than memory should hold.
pub fn box_points(size: Vec3, step: f32, colours: &[[f32; 3]; 6]) -> Result<Vec<Point>, BakeError> {
    let sides = (size / step).floor() + 1.0;
    let count = 2.0 * (sides.x * sides.y + sides.y * sides.z + sides.z * sides.x);
    if !(size.min_element() > 0.0 && step > 0.0 && count <= MAX_POINTS) {
        let expected = format!("lengths above 0 and a step that makes at most {MAX_POINTS} points");
        return Err(BakeError::argument("box", expected, format!("{size} with a step of {step}")));
    }
    let sides = sides.to_array().map(|n| n as usize);
    let mut points = Vec::new();
    for (wall, colour) in colours.iter().enumerate() {
        let (axis, far) = (wall / 2, wall % 2 == 1);
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for i in 0..sides[u] {
            for j in 0..sides[v] {
                let mut position = Vec3::ZERO;
                position[axis] = if far { size[axis] } else { 0.0 };
                (position[u], position[v]) = (i as f32 * step, j as f32 * step);
                points.push(Point { position, colour: *colour });
            }
        }
    }
    Ok(points)
}
