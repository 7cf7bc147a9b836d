//! Which way up a mesh is.

use super::Mesh;
use glam::{DMat3, DQuat, DVec3};
use std::path::Path;

/// Words in the names of groups that are level.
const LEVEL: [&str; 2] = ["floor", "ceiling"];
/// Share of the area of such groups, or of the plan, that has to lie across an axis.
const MOST: f64 = 0.8;
/// Cosine of the angle within which a surface lies across an axis.
const ACROSS: f64 = 0.99;

/// Whether a format states that y is up, and [`Mesh::load`] has turned it to z.
fn states_y(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ["glb", "gltf"].iter().any(|with| ending.eq_ignore_ascii_case(with)))
}

impl Mesh {
    /// Turns a mesh of a file by the shortest way so that `up`, a direction of the file's axes, points along z. Without a
    /// direction a mesh whose format does not state one is turned if it seems to have y up, as Blender exports OBJ files by
    /// default. Returns whether it was guessed so.
    pub fn stand_up(&mut self, path: &Path, up: Option<[f64; 3]>) -> bool {
        let guessed = up.is_none() && !states_y(path) && self.seems_to_lie();
        let up = up.map(DVec3::from_array).or(guessed.then_some(DVec3::Y));
        let Some(up) = up.and_then(DVec3::try_normalize) else { return false };
        let up = if states_y(path) { DVec3::new(up.x, -up.z, up.y) } else { up };
        let turn = DMat3::from_quat(DQuat::from_rotation_arc(up, DVec3::Z)).to_cols_array_2d();
        // Between two axes numbers are exchanged and not rounded.
        let turn = turn.map(|column| column.map(|v| if (v - v.round()).abs() < 1e-12 { v.round() } else { v }));
        let turn = DMat3::from_cols_array_2d(&turn);
        self.vertices.iter_mut().for_each(|v| *v = (turn * DVec3::from_array(*v)).to_array());
        guessed
    }

    /// Whether surfaces that are called floor or ceiling lie across y; where none is, whether the mesh is longer along z than
    /// along both others and its widest surface is a floor across y.
    fn seems_to_lie(&self) -> bool {
        let [low, high] = self.bounds().map(DVec3::from_array);
        let size = high - low;
        let level: Vec<bool> = self.groups.iter().map(|name| LEVEL.iter().any(|l| name.to_lowercase().contains(l))).collect();
        // Across x, y and z: areas that are level by name, all areas, and those that lie lowest.
        let (mut named, mut whole, mut lowest) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
        for triangle in &self.triangles {
            let [a, b, c] = self.corners(triangle);
            let area = 0.5 * (b - a).cross(c - a);
            for axis in (0..3).filter(|axis| area[*axis].abs() > ACROSS * area.length()) {
                whole[axis] += area.length();
                if (a.min(b).min(c) - low)[axis] < 0.05 * size[axis] {
                    lowest[axis] += area.length();
                }
                if level[triangle.group as usize] {
                    named[axis] += area.length();
                }
            }
        }
        if named.element_sum() > 0.0 {
            return named.y > MOST * named.element_sum();
        }
        let tallest = size.z > size.x.max(size.y);
        tallest && whole.y > whole.x.max(whole.z) && lowest.y > MOST * size.x * size.z
    }
}
