//! STL files, text and binary. Of a text with several solids each is a group by its name, otherwise all is one.

use super::{MAX_TRIANGLES, Mesh, Triangle};
use crate::error::AcousticsError;
use std::io::Cursor;
use std::path::Path;

/// Bytes before the triangles of a binary file, and of each.
const HEAD: usize = 84;
const TRIANGLE: u64 = 50;

pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Mesh, AcousticsError> {
    let wrong = |found: String| AcousticsError::content(path, "a readable STL file", found);
    // A binary file says how many triangles follow; checked before that many are stored. Its free text may begin as a text
    // does.
    let count = bytes[..HEAD.min(bytes.len())].last_chunk::<4>().map_or(0, |count| u32::from_le_bytes(*count));
    let fits = bytes.len() as u64 == HEAD as u64 + TRIANGLE * u64::from(count);
    if fits && count as usize > MAX_TRIANGLES {
        return Err(AcousticsError::content(path, Mesh::EXPECTED, format!("{count} triangles")));
    }
    if !fits && !bytes.starts_with(b"solid") {
        return Err(wrong(format!("{count} triangles in {} bytes", bytes.len())));
    }
    let solids = if fits { vec![bytes] } else { solids(bytes) };
    let mut mesh = Mesh::default();
    for solid in &solids {
        // The crate tells a text by "solid " at its start, which a binary file may have and a text without a name has not.
        let whole = if fits { [&[0; 80], &solid[80..]].concat() } else { [b"solid a\n", after_line(solid)].concat() };
        let found = stl_io::read_stl(&mut Cursor::new(whole)).map_err(|e| wrong(e.to_string()))?;
        let group = mesh.group(if solids.len() > 1 { name(solid) } else { "surface" });
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend(found.vertices.iter().map(|v| v.0.map(f64::from)));
        let corners = found.faces.iter().map(|f| f.vertices.map(|v| first + v as u32));
        mesh.triangles.extend(corners.map(|corners| Triangle { corners, group }));
        mesh.within_limits().map_err(|found| AcousticsError::content(path, Mesh::EXPECTED, found))?;
    }
    Ok(mesh)
}

/// The parts of a text that begin with `solid`.
fn solids(bytes: &[u8]) -> Vec<&[u8]> {
    let mut starts = vec![0];
    let mut at = 0;
    for line in bytes.split_inclusive(|b| *b == b'\n') {
        if at > 0 && line.trim_ascii_start().starts_with(b"solid") {
            starts.push(at);
        }
        at += line.len();
    }
    starts.push(bytes.len());
    starts.windows(2).map(|ends| &bytes[ends[0]..ends[1]]).collect()
}

fn after_line(text: &[u8]) -> &[u8] {
    text.iter().position(|b| *b == b'\n').map_or(&[], |end| &text[end + 1..])
}

/// What follows `solid` on its line.
fn name(solid: &[u8]) -> &str {
    let line = solid.split(|b| *b == b'\n').next().unwrap_or_default();
    let name = std::str::from_utf8(line).unwrap_or_default().trim().trim_start_matches("solid").trim();
    if name.is_empty() { "surface" } else { name }
}
