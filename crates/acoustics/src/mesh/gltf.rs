//! glTF files with their buffers in the file or beside it; groups are their materials, else their nodes.

use super::file::bytes as bytes_of;
use super::names::Names;
use super::{Mesh, Triangle};
use crate::error::AcousticsError;
use glam::{DMat4, DVec3};
use gltf::Semantic;
use gltf::buffer::Source;
use std::collections::HashSet;
use std::panic::catch_unwind;
use std::path::Path;

pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Mesh, AcousticsError> {
    // The crate looks at a file in part only, and panics where numbers in it lead nowhere.
    catch_unwind(|| parse(path, bytes))
        .unwrap_or_else(|_| Err(AcousticsError::content(path, "a whole glTF file", "one whose parts do not fit each other")))
}

/// The bytes of all buffers.
fn buffers(path: &Path, file: &gltf::Gltf) -> Result<Vec<Vec<u8>>, AcousticsError> {
    let wrong = |expected: &str, found: String| AcousticsError::content(path, expected, found);
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
    Ok(buffers)
}

fn parse(path: &Path, bytes: &[u8]) -> Result<Mesh, AcousticsError> {
    let wrong = |expected: &str, found: String| AcousticsError::content(path, expected, found);
    let file = gltf::Gltf::from_slice(bytes).map_err(|e| wrong("a readable glTF file", e.to_string()))?;
    let buffers = buffers(path, &file)?;
    // A value takes a byte at least; without a limit a short file could ask for any memory.
    let held: usize = buffers.iter().map(Vec::len).sum();
    if let Some(long) = file.accessors().find(|accessor| accessor.count() > held) {
        return Err(wrong(&format!("at most {held} values, as its buffers are long"), long.count().to_string()));
    }
    let scene = file.default_scene().or_else(|| file.scenes().next()).ok_or_else(|| wrong("a scene", "none".into()))?;
    let (mut mesh, mut groups) = (Mesh::default(), Names::default());
    // z is up here, y there.
    let upright = DMat4::from_cols_array_2d(&[[1., 0., 0., 0.], [0., 0., 1., 0.], [0., -1., 0., 0.], [0., 0., 0., 1.]]);
    let mut nodes: Vec<(gltf::Node<'_>, DMat4)> = scene.nodes().map(|node| (node, upright)).collect();
    let mut placed = HashSet::new();
    while let Some((node, parent)) = nodes.pop() {
        // The format forbids circles and a node in two others; a file may hold them all the same.
        if !placed.insert(node.index()) {
            return Err(wrong("each node in one other at most", format!("node {} twice", node.index())));
        }
        let local = DMat4::from_cols_array_2d(&node.transform().matrix().map(|column| column.map(f64::from)));
        let place = parent * local;
        nodes.extend(node.children().map(|child| (child, place)));
        for primitive in node.mesh().into_iter().flat_map(|m| m.primitives()) {
            if primitive.mode() != gltf::mesh::Mode::Triangles {
                continue;
            }
            // A mesh may stand in many places: what that makes is known before it is made.
            let count = primitive.get(&Semantic::Positions).map_or(0, |accessor| accessor.count());
            let corners = primitive.indices().map_or(count, |accessor| accessor.count());
            mesh.within_limits_with(corners / 3, count).map_err(|found| wrong(Mesh::EXPECTED, found))?;
            let group = groups.number(primitive.material().name().or(node.name()).unwrap_or("surface"));
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
    mesh.groups = groups.into_all();
    Ok(mesh)
}
