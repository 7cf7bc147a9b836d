//! OBJ files. Of materials only the names count, so their file need not be there.

use super::names::Names;
use super::polygon::Cutter;
use super::{Mesh, Triangle};
use crate::error::AcousticsError;
use glam::DVec3;
use std::collections::HashMap;
use std::io::{BufReader, Cursor, Read};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// A library of materials that is put before the file and has all names that it uses.
const NAMES: &str = "promenade-names";

pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Mesh, AcousticsError> {
    let mut used = Names::default();
    let bytes = &plain(bytes)[..];
    for line in bytes.split(|b| *b == b'\n') {
        let line = String::from_utf8_lossy(line);
        if let Some(name) = line.trim().strip_prefix("usemtl ") {
            used.number(name.trim());
        }
    }
    let names = used.into_all();
    let materials = |file: &Path| {
        let used = if file == Path::new(NAMES) { names.clone() } else { Vec::new() };
        let numbers: HashMap<String, usize> = used.iter().cloned().zip(0..).collect();
        let materials = used.into_iter().map(|name| tobj::Material { name, ..Default::default() });
        Ok((materials.collect(), numbers))
    };
    let options = tobj::LoadOptions { ignore_points: true, ignore_lines: true, ..Default::default() };
    let mut reader = BufReader::new(Cursor::new(format!("mtllib {NAMES}\n")).chain(Cursor::new(bytes)));
    // The crate multiplies numbers of vertices before it looks at them, which ends a build that checks sums.
    let read = AssertUnwindSafe(|| tobj::load_obj_buf(&mut reader, &options, materials));
    let (models, _) = catch_unwind(read)
        .unwrap_or(Err(tobj::LoadError::FaceVertexOutOfBounds))
        .map_err(|e| AcousticsError::content(path, "a readable OBJ file", e))?;
    let (mut mesh, mut groups, mut cutter) = (Mesh::default(), Names::default(), Cutter::default());
    for model in models {
        let first = mesh.vertices.len() as u32;
        let of_object = if model.name == "unnamed_object" { "surface" } else { model.name.trim() };
        let group = groups.number(model.mesh.material_id.and_then(|i| names.get(i)).map_or(of_object, |n| n));
        // tobj reads single precision: a tenth of a millimetre at a kilometre.
        let places: Vec<DVec3> =
            model.mesh.positions.as_chunks::<3>().0.iter().map(|v| DVec3::from(v.map(f64::from))).collect();
        // Without numbers of corners all polygons have three.
        let threes = vec![3; if model.mesh.face_arities.is_empty() { model.mesh.indices.len() / 3 } else { 0 }];
        let mut left = &model.mesh.indices[..];
        for count in threes.iter().chain(&model.mesh.face_arities) {
            let Some((corners, rest)) = left.split_at_checked(*count as usize) else { break };
            left = rest;
            let mut around = Vec::with_capacity(corners.len());
            for corner in corners {
                let place = places.get(*corner as usize);
                around.push(
                    *place.ok_or_else(|| AcousticsError::content(path, "vertices of polygons", format!("number {corner}")))?,
                );
            }
            let cut = cutter.cut(&around).map_err(|found| AcousticsError::content(path, Cutter::EXPECTED, found))?;
            mesh.triangles.extend(cut.into_iter().map(|t| Triangle { corners: t.map(|i| first + corners[i]), group }));
        }
        mesh.vertices.extend(places.iter().map(|place| place.to_array()));
        mesh.within_limits().map_err(|found| AcousticsError::content(path, Mesh::EXPECTED, found))?;
    }
    mesh.groups = groups.into_all();
    Ok(mesh)
}

/// The text with lines that a backslash continues in one, and spaces for tabs.
fn plain(bytes: &[u8]) -> Vec<u8> {
    let mut plain = Vec::with_capacity(bytes.len());
    for line in bytes.split_inclusive(|b| *b == b'\n') {
        match line.trim_ascii_end().strip_suffix(b"\\") {
            Some(begun) => plain.extend([begun, b" "].concat()),
            None => plain.extend(line),
        }
    }
    plain.iter_mut().filter(|b| **b == b'\t').for_each(|b| *b = b' ');
    plain
}

impl Mesh {
    /// The mesh as an OBJ file whose groups are materials, to a tenth of a millimetre.
    #[must_use]
    pub fn to_obj(&self) -> String {
        let mut text = String::from("# metres, z up\n");
        for [x, y, z] in &self.vertices {
            text.push_str(&format!("v {x:.4} {y:.4} {z:.4}\n"));
        }
        for (number, name) in self.groups.iter().enumerate() {
            text.push_str(&format!("usemtl {name}\n"));
            for triangle in self.triangles.iter().filter(|triangle| triangle.group as usize == number) {
                let [a, b, c] = triangle.corners.map(|corner| corner + 1);
                text.push_str(&format!("f {a} {b} {c}\n"));
            }
        }
        text
    }
}
