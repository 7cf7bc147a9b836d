//! glTF files with their buffers in the file or beside it; groups are their materials, else their nodes.

use super::file::bytes as bytes_of;
use super::{Mesh, Triangle};
use crate::error::AcousticsError;
use glam::{DMat4, DVec3};
use gltf::buffer::Source;
use std::path::Path;

pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Mesh, AcousticsError> {
    let wrong = |expected: &str, found: String| AcousticsError::content(path, expected, found);
    let file = gltf::Gltf::from_slice(bytes).map_err(|e| wrong("a readable glTF file", e.to_string()))?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut buffers = Vec::new();
    for buffer in file.buffers() {
        let data = match buffer.source() {
            Source::Bin => file.blob.clone().ok_or_else(|| wrong("a binary chunk", "none".into()))?,
            Source::Uri(uri) if uri.starts_with("data:") => {
                return Err(wrong("buffers in a .glb file or in files beside it", "one in the text".into()));
            }
            Source::Uri(uri) => bytes_of(&folder.join(uri))?,
        };
        if data.len() < buffer.length() {
            return Err(wrong(&format!("a buffer of {} bytes", buffer.length()), data.len().to_string()));
        }
        buffers.push(data);
    }
    let scene = file.default_scene().or_else(|| file.scenes().next()).ok_or_else(|| wrong("a scene", "none".into()))?;
    let mut mesh = Mesh::default();
    // z is up here, y there.
    let upright = DMat4::from_cols_array_2d(&[[1., 0., 0., 0.], [0., 0., 1., 0.], [0., -1., 0., 0.], [0., 0., 0., 1.]]);
    let mut nodes: Vec<(gltf::Node<'_>, DMat4, usize)> = scene.nodes().map(|node| (node, upright, 0)).collect();
    while let Some((node, parent, depth)) = nodes.pop() {
        // The format forbids circles; a file may hold one all the same.
        if depth > 64 {
            return Err(wrong("nodes within at most 64 others", "more".into()));
        }
        let local = DMat4::from_cols_array_2d(&node.transform().matrix().map(|column| column.map(f64::from)));
        let place = parent * local;
        nodes.extend(node.children().map(|child| (child, place, depth + 1)));
        for primitive in node.mesh().into_iter().flat_map(|m| m.primitives()) {
            if primitive.mode() != gltf::mesh::Mode::Triangles {
                continue;
            }
            let name = primitive.material().name().or(node.name()).unwrap_or("surface").to_owned();
            let group = mesh.group(&name);
            let reader = primitive.reader(|buffer| buffers.get(buffer.index()).map(Vec::as_slice));
            let first = mesh.vertices.len() as u32;
            let positions = reader.read_positions().ok_or_else(|| wrong("positions of vertices", "none".into()))?;
            let world = |p: [f32; 3]| place.transform_point3(DVec3::from_array(p.map(f64::from))).to_array();
            mesh.vertices.extend(positions.map(world));
            let indices: Vec<u32> = match reader.read_indices() {
                Some(indices) => indices.into_u32().collect(),
                None => (0..mesh.vertices.len() as u32 - first).collect(),
            };
            let corners = indices.as_chunks::<3>().0.iter();
            mesh.triangles.extend(corners.map(|c| Triangle { corners: c.map(|i| first.saturating_add(i)), group }));
        }
    }
    Ok(mesh)
}
