//! A fitted room as a mesh, and the materials of its groups.

use super::fitted_room::FittedRoom;
use crate::error::FitError;
use crate::fits::FullFit;
use crate::room::{FlatRoom, Form, WALLS, Walls};
use promenade_acoustics::Mesh;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt::Write;

/// Materials of a mesh's groups as `simulate` understands them, in a file beside the mesh.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct MaterialsBeside {
    /// How they were made, for readers.
    pub made: String,
    /// By group: absorption and scattering with a colon between, each octaves from 63 Hz of a quick fit, and of a full one its
    /// bands as `HZ@SHARE`, with slashes between.
    pub materials: BTreeMap<String, String>,
}

impl MaterialsBeside {
    /// Of a fit, for the groups of its mesh.
    #[must_use]
    pub fn of(fit: &dyn FittedRoom, made: &str) -> Self {
        Self { made: made.to_owned(), materials: fit.materials() }
    }
}

/// The group of patches of a surface that are of one of its materials.
pub(super) fn patch_group(surface: &str, number: usize) -> String {
    format!("{surface}.{}", number + 1)
}

/// The mesh of a full fit: a group for each surface, or for each material of its patches, `x0.1`.
///
/// # Errors
/// A box without a volume.
pub fn full_mesh(fit: &FullFit) -> Result<Mesh, FitError> {
    let Some(own) = &fit.voxels else { return fit.room.mesh() };
    let (of, _) = own.materials(fit.room.surfaces.len());
    Ok(own.voxels.mesh(|p| patch_group(&fit.room.surfaces[own.voxels.patches[p].surface], of[p])))
}

/// A room as a text in the format OBJ, metres, a group for each surface.
pub(super) fn room_obj(room: &FlatRoom) -> String {
    match &room.form {
        Form::Box(walls) => box_obj(walls),
        Form::Mesh(mesh) => mesh.to_obj(),
    }
}

/// The box as a mesh of twelve triangles in a group for each wall, as a text in the format OBJ, metres.
#[must_use]
pub fn box_obj(walls: &Walls) -> String {
    let mut text = String::from("# a fitted room; its materials are in the file beside it\n");
    let coordinate = |i: usize, a: usize| if (i >> a) & 1 == 1 { walls.high_m[a] } else { walls.low_m[a] };
    for i in 0..8 {
        let _ = writeln!(text, "v {:.5} {:.5} {:.5}", coordinate(i, 0), coordinate(i, 1), coordinate(i, 2));
    }
    for (w, name) in WALLS.iter().enumerate() {
        let axis = w / 2;
        let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
        let base = if w % 2 == 1 { 1 << axis } else { 0 };
        // Faces look inwards.
        let corners =
            if w % 2 == 0 { [base, base + u, base + u + v, base + v] } else { [base, base + v, base + u + v, base + u] };
        let [a, b, c, d] = corners.map(|i| i + 1);
        let _ = writeln!(text, "usemtl {name}\nf {a} {b} {c}\nf {a} {c} {d}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mesh_is_a_closed_box_that_looks_inwards() {
        let walls = Walls { low_m: [-0.1, 0.0, 0.2], high_m: [4.0, 3.0, 2.7] };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("room.obj");
        std::fs::write(&path, box_obj(&walls)).unwrap();
        let mesh = promenade_acoustics::Mesh::load(&path).unwrap();
        assert_eq!(mesh.groups, WALLS);
        assert!(mesh.report().warnings().is_empty(), "{:?}", mesh.report().warnings());
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.corners.map(|v| mesh.vertices[v as usize]);
            let edge = |p: [f64; 3], q: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| q[i] - p[i]) };
            let (u, v) = (edge(a, b), edge(a, c));
            let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
            let inwards: f64 = (0..3).map(|i| normal[i] * (0.5 * (walls.low_m[i] + walls.high_m[i]) - a[i])).sum();
            assert!(inwards > 0.0);
        }
    }
}
