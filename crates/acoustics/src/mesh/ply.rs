//! PLY files, text and binary: polygons of one group.

use super::ply_file::{Ply, PlyLimits};
use super::{MAX_TRIANGLES, MAX_VERTICES, Mesh, Triangle};
use crate::error::AcousticsError;

use ply_rs_bw::ply::{Property, PropertyAccess, PropertyAccessResult};
use std::path::Path;

struct Vertex([f64; 3]);

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self([f64::NAN; 3])
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let Some(axis) = ["x", "y", "z"].iter().position(|axis| *axis == name) else { return PropertyAccessResult::Ignored };
        self.0[axis] = match property {
            Property::Float(v) => f64::from(v),
            Property::Double(v) => v,
            _ => return PropertyAccessResult::UnsupportedType,
        };
        PropertyAccessResult::Set
    }
}

pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Mesh, AcousticsError> {
    let limits = PlyLimits { vertices: MAX_VERTICES, faces: MAX_TRIANGLES };
    let ply = Ply::<Vertex>::read(bytes, limits).map_err(|e| e.at(path))?;
    let triangles = ply.triangles(|v| v.0).map_err(|e| e.at(path))?;
    let mut mesh = Mesh { vertices: ply.vertices.into_iter().map(|v| v.0).collect(), ..Mesh::default() };
    let group = mesh.group("surface");
    mesh.triangles = triangles.into_iter().map(|corners| Triangle { corners, group }).collect();
    Ok(mesh)
}
