//! Meshes from files.

use super::file::bytes;
use super::{Mesh, gltf, obj, ply, stl};
use crate::error::AcousticsError;
use std::path::Path;

impl Mesh {
    /// Reads a mesh after its ending: `.obj`, `.stl`, `.ply`, `.glb` or `.gltf`. Groups are the materials of the file,
    /// else its objects, else one that is called `surface`. Coordinates are the file's, except those of glTF,
    /// whose y axis is up and is turned to z.
    ///
    /// # Errors
    /// A file that cannot be read, is damaged, of another kind, or holds no triangles.
    pub fn load(path: &Path) -> Result<Self, AcousticsError> {
        let read = match path.extension().map(|e| e.to_string_lossy().to_lowercase()).as_deref() {
            Some("obj") => obj::read,
            Some("stl") => stl::read,
            Some("ply") => ply::read,
            Some("glb" | "gltf") => gltf::read,
            other => {
                let found = format!("the ending \"{}\"", other.unwrap_or_default());
                return Err(AcousticsError::content(path, "a file ending in .obj, .stl, .ply, .glb or .gltf", found));
            }
        };
        let mesh = read(path, &bytes(path)?)?;
        mesh.within_limits().map_err(|found| AcousticsError::content(path, Self::EXPECTED, found))?;
        if mesh.triangles.is_empty() {
            let found = format!("{} vertices and no triangle", mesh.vertices.len());
            return Err(AcousticsError::content(path, "a mesh of triangles", found));
        }
        mesh.check().map_err(|e| AcousticsError::content(path, "a mesh that holds together", e))?;
        Ok(mesh)
    }
}
