//! Zip archives: NumPy's and PyTorch's files.

use super::bytes;
use fastrand::Rng;
use std::io::{Cursor, Read, Write};
use zip::write::SimpleFileOptions;
use zip::{ZipArchive, ZipWriter};

/// An archive with one entry changed, lost, repeated under another name or put in the place of another; its checksums fit.
pub(super) fn changed(rng: &mut Rng, file: &[u8], other: &[u8]) -> Option<Vec<u8>> {
    let mut entries = entries(file)?;
    let more = self::entries(other).unwrap_or_default();
    let at = rng.usize(..entries.len());
    match rng.u8(0..10) {
        0 => drop(entries.remove(at)),
        1 => {
            let (name, content) = entries[at].clone();
            entries.push((format!("{name}2"), content));
        }
        2 => {
            let to = rng.usize(..entries.len());
            entries[at].1 = entries[to].1.clone();
        }
        3 if !more.is_empty() => entries[at].1 = more[rng.usize(..more.len())].1.clone(),
        _ => {
            let donor = more.get(at).map_or(&[][..], |entry| &entry.1);
            for _ in 0..1 + rng.usize(..3) {
                bytes::change(rng, &mut entries[at].1, donor);
            }
        }
    }
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    // PyTorch reads only what is stored as it is.
    let options = SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    for (name, content) in entries {
        zip.start_file(name, options).ok()?;
        zip.write_all(&content).ok()?;
    }
    zip.finish().ok().map(Cursor::into_inner)
}

fn entries(file: &[u8]) -> Option<Vec<(String, Vec<u8>)>> {
    let mut zip = ZipArchive::new(Cursor::new(file)).ok()?;
    let mut entries = Vec::new();
    for index in 0..zip.len().min(1000) {
        let entry = zip.by_index(index).ok()?;
        let name = entry.name().ok()?.into_owned();
        let mut content = Vec::new();
        entry.take(1 << 20).read_to_end(&mut content).ok()?;
        entries.push((name, content));
    }
    Some(entries).filter(|entries| !entries.is_empty())
}
