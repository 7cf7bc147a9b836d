//! STL files, text and binary: triangles of one group.

use super::{MAX_TRIANGLES, Mesh, Triangle};
use crate::error::AcousticsError;
use std::io::Cursor;
use std::path::Path;

pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Mesh, AcousticsError> {
    let wrong = |found: String| AcousticsError::content(path, "a readable STL file", found);
    // A binary file says how many triangles of 50 bytes follow; checked before that many are stored.
    if !bytes.starts_with(b"solid") {
        let count = bytes.get(80..84).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
        let count = count.ok_or_else(|| wrong(format!("{} bytes", bytes.len())))?;
        if bytes.len() as u64 != 84 + 50 * u64::from(count) {
            return Err(wrong(format!("{count} triangles in {} bytes", bytes.len())));
        }
        if count as usize > MAX_TRIANGLES {
            return Err(AcousticsError::content(path, Mesh::EXPECTED, format!("{count} triangles")));
        }
    }
    let found = stl_io::read_stl(&mut Cursor::new(bytes)).map_err(|e| wrong(e.to_string()))?;
    let mut mesh = Mesh { vertices: found.vertices.iter().map(|v| v.0.map(f64::from)).collect(), ..Mesh::default() };
    let group = mesh.group("surface");
    mesh.triangles = found.faces.iter().map(|f| Triangle { corners: f.vertices.map(|v| v as u32), group }).collect();
    Ok(mesh)
}
