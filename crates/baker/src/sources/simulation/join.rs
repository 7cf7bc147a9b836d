//! Parts of a simulation as folders, and the whole of them.
//!
//! A part's folder is a set of responses of its own, with a `part.json` that comes last: of which run it is, and what every
//! file of it must hold.

use super::part::Part;
use crate::responses::save::{Entry, MANIFEST, Manifest};
use crate::{BakeError, FileError, Responses, atomic, file};
use promenade_core::Pose;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt::{Debug, Write};
use std::path::{Component, Path, PathBuf};

const PART_FILE: &str = "part.json";
/// Version of the form of `part.json`.
const VERSION: u32 = 1;
/// Largest text and largest sound of a part, bytes.
const MOST_TEXT: u64 = 1 << 28;
const MOST_SOUND: u64 = 1 << 26;

/// What a run computes: the same for all its parts, different for any two runs whose samples may differ.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RunKey(String);

impl RunKey {
    /// A hash (BLAKE3) of this version and of everything that decides what is computed. Numbers are hashed as `Debug` prints
    /// them, which tells any two apart.
    #[must_use]
    pub fn of(what: &[&dyn Debug]) -> Self {
        let mut hash = Hash(blake3::Hasher::new());
        let written = write!(hash, "{} {what:?}", env!("CARGO_PKG_VERSION"));
        debug_assert!(written.is_ok());
        Self(hash.0.finalize().to_hex().to_string())
    }
}

struct Hash(blake3::Hasher);

impl Write for Hash {
    fn write_str(&mut self, text: &str) -> std::fmt::Result {
        self.0.update(text.as_bytes());
        Ok(())
    }
}

/// The form of `part.json`.
#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct About {
    version: u32,
    /// [`RunKey`].
    run: String,
    part: u32,
    of: u32,
    /// Of the whole run.
    poses: usize,
    /// BLAKE3 of the set's manifest.
    manifest: String,
    files: Vec<PartEntry>,
}

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct PartEntry {
    /// Number from 0 in the whole run.
    pose: usize,
    file: String,
    blake3: String,
}

/// The folder of one part.
#[derive(Clone, Debug)]
pub struct PartFolder {
    path: PathBuf,
    run: RunKey,
    part: Part,
}

impl PartFolder {
    /// Where a part of a run lies among others: its name has its number and the beginning of the run's key.
    #[must_use]
    pub fn new(among: &Path, run: RunKey, part: Part) -> Self {
        let path = among.join(format!("part-{}-of-{}-{}", part.number, part.of, run.0.get(..16).unwrap_or_default()));
        Self { path, run, part }
    }

    /// The folder.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether the part is there, whole and undamaged.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        let checked = || -> Result<bool, BakeError> {
            let (about, manifest) = read(&self.path)?;
            for (about, _) in about.files.iter().zip(&manifest.responses) {
                sound(&self.path, about)?;
            }
            Ok((about.run, about.part, about.of) == (self.run.0.clone(), self.part.number, self.part.of))
        };
        checked().unwrap_or(false)
    }

    /// Writes what a part has of a run over `poses`.
    ///
    /// # Errors
    /// Responses that are not those of the part, or as [`Responses::save`].
    pub fn save(&self, responses: &Responses, poses: &[Pose]) -> Result<(), BakeError> {
        let mine = self.part.poses(poses);
        if mine.len() != responses.responses.len() {
            return Err(BakeError::argument(
                "responses",
                format!("one for each of {} poses", mine.len()),
                responses.responses.len(),
            ));
        }
        responses.save(&self.path)?;
        let text = text(&self.path, MANIFEST)?;
        let manifest: Manifest = serde_json::from_slice(&text).map_err(BakeError::json(&self.path.join(MANIFEST)))?;
        let about = |(pose, entry): (usize, Entry)| {
            let bytes = bytes(&self.path, &entry.file, MOST_SOUND)?;
            Ok(PartEntry { pose, file: entry.file, blake3: hash(&bytes) })
        };
        let files: Result<Vec<PartEntry>, BakeError> = mine.into_iter().zip(manifest.responses).map(about).collect();
        let about = About {
            version: VERSION,
            run: self.run.0.clone(),
            part: self.part.number,
            of: self.part.of,
            poses: poses.len(),
            manifest: hash(&text),
            files: files?,
        };
        let path = self.path.join(PART_FILE);
        let json = serde_json::to_string_pretty(&about).map_err(BakeError::json(&path))?;
        atomic::replace(&path, (json + "\n").as_bytes())
    }
}

/// Puts all parts of one run together: `output` then holds, byte for byte, what the run makes in one piece. Returns the number
/// of responses. The manifest comes last: without it the folder is no set.
///
/// # Errors
/// A folder that is no complete part, a file that is not as it was written, parts of different runs, a part that is missing or
/// given twice, a file that cannot be written.
pub fn join(parts: &[PathBuf], output: &Path) -> Result<usize, BakeError> {
    let mut read_parts = Vec::with_capacity(parts.len());
    for path in parts {
        read_parts.push((path, read(path)?));
    }
    let Some((first, (about, _))) = read_parts.first() else {
        return Err(BakeError::argument("parts", "at least one", "none"));
    };
    let mut numbers: BTreeMap<u32, &Path> = BTreeMap::new();
    for (path, (other, _)) in &read_parts {
        if (&other.run, other.of, other.poses) != (&about.run, about.of, about.poses) {
            let expected = format!("a part of {} of the same run as {}", about.of, first.display());
            return Err(FileError::content(path, expected, format!("part {} of {} of another run", other.part, other.of)));
        }
        if let Some(twice) = numbers.insert(other.part, path) {
            let expected = format!("each part once, and part {} is {}", other.part, twice.display());
            return Err(FileError::content(path, expected, "the same part"));
        }
    }
    let missing: Vec<String> = (1..=about.of).filter(|n| !numbers.contains_key(n)).map(|n| n.to_string()).collect();
    if !missing.is_empty() {
        return Err(BakeError::argument(
            "parts",
            format!("all {}", about.of),
            format!("none of number {}", missing.join(", ")),
        ));
    }
    let (count, mut whole) = (about.poses, BTreeMap::new());
    let mut head = None;
    for (path, (about, manifest)) in read_parts {
        for (about, entry) in about.files.into_iter().zip(manifest.responses) {
            if about.pose >= count || whole.insert(about.pose, (path, about, entry)).is_some() {
                let expected = format!("poses below {count}, each in one part");
                return Err(FileError::content(&path.join(PART_FILE), expected, "another"));
            }
        }
        head = head.or(Some((manifest.title, manifest.credit, manifest.licence, manifest.note)));
    }
    if whole.len() != count {
        return Err(BakeError::argument("parts", format!("responses of {count} poses together"), whole.len()));
    }
    // All of them are looked at before one is written: what is damaged is mostly known by then.
    for (path, about, _) in whole.values() {
        sound(path, about)?;
    }
    let (title, credit, licence, note) = head.unwrap_or_default();
    let mut written = Written::begin(output)?;
    let mut responses = Vec::with_capacity(count);
    for (path, about, entry) in whole.into_values() {
        written.add(&about.file, &sound(path, &about)?)?;
        responses.push(entry);
    }
    Manifest { title, credit, licence, note, responses }.write(output)?;
    written.keep();
    Ok(count)
}

/// Files that are taken away again unless they are kept: all that were not there before.
struct Written {
    folder: PathBuf,
    /// Folders that were made, the outermost first.
    made: Vec<PathBuf>,
    files: Vec<PathBuf>,
}

impl Written {
    fn begin(folder: &Path) -> Result<Self, BakeError> {
        let missing = folder.ancestors().take_while(|part| !part.as_os_str().is_empty() && !part.exists());
        let mut made: Vec<PathBuf> = missing.map(Path::to_path_buf).collect();
        made.reverse();
        let written = Self { folder: folder.to_path_buf(), made, files: Vec::new() };
        std::fs::create_dir_all(folder).map_err(FileError::write(folder))?;
        Ok(written)
    }

    fn add(&mut self, name: &str, bytes: &[u8]) -> Result<(), BakeError> {
        let path = self.folder.join(name);
        if !path.exists() {
            self.files.push(path.clone());
        }
        atomic::write(&path, bytes)
    }

    fn keep(&mut self) {
        self.files.clear();
        self.made.clear();
    }
}

impl Drop for Written {
    fn drop(&mut self) {
        // What cannot be taken away stays; the error that led here is the one to tell.
        self.files.iter().for_each(|file| drop(std::fs::remove_file(file)));
        self.made.iter().rev().for_each(|folder| drop(std::fs::remove_dir(folder)));
    }
}

/// What a part says of itself, checked but for its sounds.
fn read(folder: &Path) -> Result<(About, Manifest), BakeError> {
    let path = folder.join(PART_FILE);
    if !path.exists() {
        let expected = format!("a complete part of a simulation, with a {PART_FILE}");
        return Err(FileError::content(folder, expected, "none"));
    }
    let wrong = |expected: String, found: String| Err(FileError::content(&path, expected, found));
    let about: About = serde_json::from_slice(&text(folder, PART_FILE)?).map_err(BakeError::json(&path))?;
    if about.version != VERSION {
        return wrong(format!("version {VERSION}"), about.version.to_string());
    }
    if !(1..=about.of).contains(&about.part) {
        return wrong(format!("a part from 1 to {}", about.of), about.part.to_string());
    }
    let manifest = text(folder, MANIFEST)?;
    if hash(&manifest) != about.manifest {
        return Err(FileError::content(&folder.join(MANIFEST), "the file as it was written", "another content"));
    }
    let manifest: Manifest = serde_json::from_slice(&manifest).map_err(BakeError::json(&folder.join(MANIFEST)))?;
    let names = |of: &[Entry]| of.iter().map(|e| e.file.clone()).collect::<Vec<_>>();
    if names(&manifest.responses) != about.files.iter().map(|f| f.file.clone()).collect::<Vec<_>>() {
        return wrong(format!("the files of {MANIFEST}"), "others".to_owned());
    }
    let plain = |name: &str| matches!(Path::new(name).components().collect::<Vec<_>>()[..], [Component::Normal(_)]);
    if let Some(file) = about.files.iter().find(|f| !plain(&f.file)) {
        return wrong("names of files in its folder".to_owned(), file.file.clone());
    }
    Ok((about, manifest))
}

/// The sound of a part's pose, if it is as it was written.
fn sound(folder: &Path, about: &PartEntry) -> Result<Vec<u8>, BakeError> {
    let bytes = bytes(folder, &about.file, MOST_SOUND)?;
    if hash(&bytes) != about.blake3 {
        return Err(FileError::content(&folder.join(&about.file), "the file as it was written", "another content"));
    }
    Ok(bytes)
}

fn text(folder: &Path, name: &str) -> Result<Vec<u8>, BakeError> {
    bytes(folder, name, MOST_TEXT)
}

fn bytes(folder: &Path, name: &str, most: u64) -> Result<Vec<u8>, BakeError> {
    let path = folder.join(name);
    file::read(&path, most).map_err(FileError::read(&path))
}

fn hash(bytes: &[u8]) -> String {
    blake3::hash(bytes).to_hex().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Response;
    use promenade_core::glam::Vec3;

    #[test]
    fn a_join_that_fails_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let poses: Vec<Pose> = (0..4).map(|i| Pose::from_ypr(Vec3::X * i as f32, 0.0, 0.0, 0.0)).collect();
        let response = |i: usize| Response {
            listener: poses[i],
            source: Vec3::Y,
            left: vec![0.5; 16],
            right: vec![0.25; 16],
            name: format!("pose-{i:05}"),
        };
        let parts: Vec<PartFolder> = [1, 2]
            .map(|number| {
                let part = PartFolder::new(folder.path(), RunKey::of(&[&1]), Part { number, of: 2 });
                let mine = part.part.poses(&poses).into_iter().map(response).collect();
                part.save(&Responses { sample_rate_hz: 8_000.0, responses: mine, ..Responses::default() }, &poses).unwrap();
                part
            })
            .into();
        let paths: Vec<PathBuf> = parts.iter().map(|part| part.path().to_path_buf()).collect();
        let output = folder.path().join("deep/whole");
        assert_eq!(join(&paths, &output).unwrap(), 4);
        std::fs::remove_dir_all(folder.path().join("deep")).unwrap();
        // A place for the manifest that nothing can be written to.
        std::fs::create_dir_all(output.join(MANIFEST)).unwrap();
        assert!(join(&paths, &output).is_err());
        assert_eq!(std::fs::read_dir(&output).unwrap().count(), 1, "sounds of a join that failed");
        std::fs::remove_dir_all(folder.path().join("deep")).unwrap();
        // One sound is damaged.
        let sound = std::fs::read_dir(&paths[1]).unwrap().flatten().map(|entry| entry.path());
        let sound = sound.into_iter().find(|path| path.extension().is_some_and(|ending| ending == "wav")).unwrap();
        let mut bytes = std::fs::read(&sound).unwrap();
        *bytes.last_mut().unwrap() ^= 1;
        std::fs::write(&sound, bytes).unwrap();
        assert!(join(&paths, &output).is_err());
        assert!(!folder.path().join("deep").exists(), "folders of a join that failed");
    }
}
