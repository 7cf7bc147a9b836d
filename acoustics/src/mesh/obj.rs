//! OBJ files. Of materials only the names count, so their file need not be there.

use super::{Mesh, Triangle};
use crate::error::AcousticsError;
use std::collections::HashMap;
use std::io::{BufReader, Cursor, Read};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// A library of materials that is put before the file and has all names that it uses.
const NAMES: &str = "promenade-names";

pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Mesh, AcousticsError> {
    let mut names: Vec<String> = Vec::new();
    for line in bytes.split(|b| *b == b'\n') {
        let line = String::from_utf8_lossy(line);
        if let Some(name) = line.trim().strip_prefix("usemtl ").map(|n| n.trim().to_owned()).filter(|n| !names.contains(n)) {
            names.push(name);
        }
    }
    let materials = |file: &Path| {
        let used = if file == Path::new(NAMES) { names.clone() } else { Vec::new() };
        let numbers: HashMap<String, usize> = used.iter().cloned().zip(0..).collect();
        let materials = used.into_iter().map(|name| tobj::Material { name, ..Default::default() });
        Ok((materials.collect(), numbers))
    };
    let options = tobj::LoadOptions { triangulate: true, ignore_points: true, ignore_lines: true, ..Default::default() };
    let mut reader = BufReader::new(Cursor::new(format!("mtllib {NAMES}\n")).chain(Cursor::new(bytes)));
    // The crate multiplies numbers of vertices before it looks at them, which ends a build that checks sums.
    let read = AssertUnwindSafe(|| tobj::load_obj_buf(&mut reader, &options, materials));
    let (models, _) = catch_unwind(read)
        .unwrap_or(Err(tobj::LoadError::FaceVertexOutOfBounds))
        .map_err(|e| AcousticsError::content(path, "a readable OBJ file", e))?;
    let mut mesh = Mesh::default();
    for model in models {
        let first = mesh.vertices.len() as u32;
        let of_object = if model.name == "unnamed_object" { "surface" } else { model.name.trim() };
        let group = mesh.group(model.mesh.material_id.and_then(|i| names.get(i)).map_or(of_object, |n| n));
        // tobj reads single precision: a tenth of a millimetre at a kilometre.
        mesh.vertices.extend(model.mesh.positions.as_chunks::<3>().0.iter().map(|v| v.map(f64::from)));
        let corners = model.mesh.indices.as_chunks::<3>().0;
        mesh.triangles.extend(corners.iter().map(|c| Triangle { corners: c.map(|i| first + i), group }));
    }
    Ok(mesh)
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
