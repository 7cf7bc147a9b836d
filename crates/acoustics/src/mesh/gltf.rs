//! glTF files with their buffers in the file or beside it; groups are their materials, else their nodes.

use super::file::bytes as bytes_of;
use super::names::Names;
use super::{Mesh, Triangle};
use crate::error::AcousticsError;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::{DMat4, DVec3};
use gltf::accessor::{DataType, Dimensions, Item, Iter};
use gltf::buffer::Source;
use gltf::mesh::Mode;
use gltf::{Accessor, Semantic};
use percent_encoding::percent_decode_str;
use std::collections::HashSet;
use std::panic::catch_unwind;
use std::path::Path;

/// Beginnings of the names of extensions that a file may require: they change how surfaces look and not where they are, or are
/// read.
const KNOWN: [&str; 7] =
    ["KHR_materials_", "KHR_lights_", "KHR_texture_", "EXT_texture_", "MSFT_texture_", "KHR_xmp", "KHR_mesh_quantization"];

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
                let coded = uri.split_once(";base64,").and_then(|(_, coded)| STANDARD.decode(coded).ok());
                coded.ok_or_else(|| wrong("a data URI in base64", uri.chars().take(40).collect()))?
            }
            Source::Uri(uri) => bytes_of(&folder.join(&*percent_decode_str(uri).decode_utf8_lossy()))?,
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
    let unreadable = |e: gltf::Error| wrong("a readable glTF file", e.to_string());
    let file = gltf::Gltf::from_slice_without_validation(bytes).map_err(unreadable)?;
    if let Some(name) = file.extensions_required().find(|name| !KNOWN.iter().any(|known| name.starts_with(known))) {
        return Err(wrong("a glTF file without compression and other required extensions", name.to_owned()));
    }
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
            if !matches!(primitive.mode(), Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
                continue;
            }
            // A mesh may stand in many places: what that makes is known before it is made.
            let count = primitive.get(&Semantic::Positions).map_or(0, |accessor| accessor.count());
            let corners = primitive.indices().map_or(count, |accessor| accessor.count());
            let triangles = if primitive.mode() == Mode::Triangles { corners / 3 } else { corners.saturating_sub(2) };
            mesh.within_limits_with(triangles, count).map_err(|found| wrong(Mesh::EXPECTED, found))?;
            let group = groups.number(primitive.material().name().or(node.name()).unwrap_or("surface"));
            let reader = primitive.reader(|buffer| buffers.get(buffer.index()).map(Vec::as_slice));
            let first = mesh.vertices.len() as u32;
            let positions = primitive.get(&Semantic::Positions).and_then(|accessor| positions(&accessor, &buffers));
            let positions = positions.ok_or_else(|| wrong("positions of vertices", "none".into()))?;
            mesh.vertices.extend(positions.into_iter().map(|p| place.transform_point3(p).to_array()));
            let indices: Vec<u32> = match reader.read_indices() {
                Some(indices) => indices.into_u32().collect(),
                None => (0..mesh.vertices.len() as u32 - first).collect(),
            };
            // Either side of a triangle reflects: its sense of rotation does not matter.
            let corners: Vec<[u32; 3]> = match (primitive.mode(), &indices[..]) {
                (Mode::TriangleStrip, strip) => strip.array_windows::<3>().copied().collect(),
                (Mode::TriangleFan, [hub, rim @ ..]) => rim.array_windows::<2>().map(|[a, b]| [*hub, *a, *b]).collect(),
                (_, list) => list.as_chunks::<3>().0.to_vec(),
            };
            // Strips hold triangles without a surface where they turn back.
            let whole = corners.into_iter().filter(|[a, b, c]| a != b && b != c && c != a);
            mesh.triangles.extend(whole.map(|c| Triangle { corners: c.map(|i| first.saturating_add(i)), group }));
        }
    }
    mesh.groups = groups.into_all();
    Ok(mesh)
}

/// Places in floats, or in integers that stand for themselves or for shares of their largest (KHR_mesh_quantization).
fn positions(accessor: &Accessor<'_>, buffers: &[Vec<u8>]) -> Option<Vec<DVec3>> {
    fn all<T: Item + Copy>(of: &Accessor<'_>, buffers: &[Vec<u8>], value: impl Fn(T) -> f64) -> Option<Vec<DVec3>>
    where
        [T; 3]: Item,
    {
        let buffer = |buffer: gltf::Buffer<'_>| buffers.get(buffer.index()).map(Vec::as_slice);
        Some(Iter::<[T; 3]>::new(of.clone(), buffer)?.map(|p| DVec3::from_array(p.map(&value))).collect())
    }
    let share = |most: f64| if accessor.normalized() { most.recip() } else { 1.0 };
    if accessor.dimensions() != Dimensions::Vec3 {
        return None;
    }
    match accessor.data_type() {
        DataType::F32 => all(accessor, buffers, |v: f32| v.into()),
        DataType::I8 => all(accessor, buffers, |v: i8| f64::from(v) * share(127.0)),
        DataType::U8 => all(accessor, buffers, |v: u8| f64::from(v) * share(255.0)),
        DataType::I16 => all(accessor, buffers, |v: i16| f64::from(v) * share(32_767.0)),
        DataType::U16 => all(accessor, buffers, |v: u16| f64::from(v) * share(65_535.0)),
        DataType::U32 => None,
    }
}
