//! Parts of a simulation, each a set of responses, and the whole of them.

use super::part::Part;
use crate::responses::save::{MANIFEST, Manifest};
use crate::{BakeError, FileError, atomic, file};
use std::collections::BTreeMap;
use std::fmt::{Debug, Write};
use std::path::{Component, Path, PathBuf};

/// Largest manifest and largest sound of a part, bytes.
const MOST_TEXT: u64 = 1 << 28;
const MOST_SOUND: u64 = 1 << 26;

struct Hash(blake3::Hasher);

impl Write for Hash {
    fn write_str(&mut self, text: &str) -> std::fmt::Result {
        self.0.update(text.as_bytes());
        Ok(())
    }
}

/// Where a part of a run lies among others: its name has its number, how many there are, and a hash (BLAKE3) of this version
/// and of all that decides what the run computes. Numbers are hashed as `Debug` prints them, which tells any two apart.
#[must_use]
pub fn part_folder(among: &Path, part: Part, run: &[&dyn Debug]) -> PathBuf {
    let mut hash = Hash(blake3::Hasher::new());
    let written = write!(hash, "{} {run:?}", env!("CARGO_PKG_VERSION"));
    debug_assert!(written.is_ok());
    let run = hash.0.finalize().to_hex();
    among.join(format!("part-{}-of-{}-{}", part.number, part.of, &run[..16]))
}

/// Whether a part is there: its manifest comes last.
#[must_use]
pub fn is_complete(folder: &Path) -> bool {
    manifest(folder).is_ok()
}

/// Puts all parts of one run together: `output` then holds, byte for byte, what the run makes in one piece. Returns the number
/// of responses. The manifest comes last: without it the folder is no set.
///
/// # Errors
/// A folder that is no complete part, parts of different runs, a part that is missing or given twice, a file that cannot be
/// read or written.
pub fn join(parts: &[PathBuf], output: &Path) -> Result<usize, BakeError> {
    let mut named = BTreeMap::new();
    let mut run: Option<(u32, String, &Path)> = None;
    for path in parts {
        let (part, key) = part_of(path)?;
        let (of, first_key, first) = run.get_or_insert_with(|| (part.of, key.clone(), path));
        if (part.of, &key) != (*of, &*first_key) {
            let expected = format!("a part of {of} of the same run as {}", first.display());
            return Err(FileError::content(path, expected, format!("part {} of {} of another run", part.number, part.of)));
        }
        if let Some((twice, _)) = named.insert(part.number, (path, manifest(path)?)) {
            let expected = format!("each part once, and part {} is {}", part.number, twice.display());
            return Err(FileError::content(path, expected, "the same part"));
        }
    }
    let of = run.map_or(1, |(of, ..)| of);
    let missing: Vec<String> = (1..=of).filter(|n| !named.contains_key(n)).map(|n| n.to_string()).collect();
    if !missing.is_empty() {
        let found = format!("none of number {}", missing.join(", "));
        return Err(BakeError::argument("parts", format!("all {of}"), found));
    }
    std::fs::create_dir_all(output).map_err(FileError::write(output))?;
    let mut whole = Manifest::default();
    for (folder, manifest) in named.into_values() {
        for entry in &manifest.responses {
            atomic::write(&output.join(&entry.file), &bytes(folder, &entry.file, MOST_SOUND)?)?;
        }
        let others = std::mem::take(&mut whole.responses);
        whole = manifest;
        whole.responses.extend(others);
    }
    whole.responses.sort_by(|a, b| a.file.cmp(&b.file));
    whole.write(output)?;
    Ok(whole.responses.len())
}

/// Which part of which run a folder's name says that it is.
fn part_of(folder: &Path) -> Result<(Part, String), BakeError> {
    let parsed = || {
        let (number, rest) = folder.file_name()?.to_str()?.strip_prefix("part-")?.split_once("-of-")?;
        let (of, run) = rest.split_once('-')?;
        let part = Part { number: number.parse().ok()?, of: of.parse().ok()? };
        (1..=part.of).contains(&part.number).then(|| (part, run.to_owned()))
    };
    parsed().ok_or_else(|| FileError::content(folder, "a part as `simulate` calls it, part-K-of-N-RUN", "another name"))
}

/// The manifest of a part, all of whose sounds lie in its folder.
fn manifest(folder: &Path) -> Result<Manifest, BakeError> {
    let path = folder.join(MANIFEST);
    if !path.exists() {
        return Err(FileError::content(folder, format!("a complete part of a simulation, with a {MANIFEST}"), "none"));
    }
    let manifest: Manifest = serde_json::from_slice(&bytes(folder, MANIFEST, MOST_TEXT)?).map_err(BakeError::json(&path))?;
    let plain = |name: &str| matches!(Path::new(name).components().collect::<Vec<_>>()[..], [Component::Normal(_)]);
    match manifest.responses.iter().find(|entry| !plain(&entry.file) || !folder.join(&entry.file).is_file()) {
        Some(entry) => Err(FileError::content(&path, "names of files in its folder", &*entry.file)),
        None => Ok(manifest),
    }
}

fn bytes(folder: &Path, name: &str, most: u64) -> Result<Vec<u8>, BakeError> {
    let path = folder.join(name);
    file::read(&path, most).map_err(FileError::read(&path))
}
