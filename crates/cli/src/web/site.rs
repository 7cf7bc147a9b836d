//! The files of a page: its own, the engine, and what the user brings.

use super::{outline, splats};
use crate::{path, report, scene};
use anyhow::{Context, Result};
use promenade_baker::{atomic, file};
use promenade_core::{MAX_SCENE_BYTES, network::Placement};
use promenade_paths::ImportOptions;
use promenade_player::{read_head, read_headphones};
use promenade_study::http::compressed;
use promenade_web::ENGINE_FILE;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;

/// Bytes of a dry sound, at most: browsers decode it whole.
const MOST_SOUND_BYTES: u64 = 1 << 28;

/// A page in the making.
pub(crate) struct Site {
    files: BTreeMap<String, Vec<u8>>,
    lists: BTreeMap<&'static str, Vec<Value>>,
}

impl Site {
    pub(crate) fn new(engine: Vec<u8>) -> Self {
        let mut files: BTreeMap<_, _> =
            promenade_web::files().iter().map(|(name, text)| ((*name).to_owned(), text.as_bytes().to_vec())).collect();
        files.insert(ENGINE_FILE.to_owned(), engine);
        Self { files, lists: BTreeMap::new() }
    }

    /// Splats for a scene; gives what the list of contents says of them.
    pub(crate) fn add_splats(&mut self, from: &Path, placement: &Placement) -> Result<Value> {
        let (bytes, kind) = splats::read(from)?;
        let file = self.add("splats", from, kind, bytes);
        let placement = json!({
            "origin": placement.origin.to_array(),
            "rotation": placement.rotation.inverse().to_array(),
            "metres_per_unit": 1.0 / placement.units_per_metre,
        });
        Ok(json!({ "file": file, "placement": placement }))
    }

    /// A scene with its splats, and the outline of the mesh beside it, where there is one of the same name.
    pub(crate) fn add_scene(&mut self, from: &Path, splats: Option<Value>) -> Result<()> {
        let read = scene::read(from)?;
        let bytes = file::read(from, MAX_SCENE_BYTES as u64).with_context(|| format!("{}: cannot be read", from.display()))?;
        let count = bytes.len();
        let file = self.add("scenes", from, "promenade", bytes);
        let mesh = from.with_extension("obj");
        let outline = if mesh.is_file() { outline::of(&mesh)? } else { None };
        let outline = outline.map(|edges| self.add("scenes", from, "outline.json", json!(edges).to_string().into_bytes()));
        let title = if read.title().is_empty() { stem(from) } else { read.title().to_owned() };
        let mut entry = json!({ "name": title, "file": file, "bytes": count, "outline": outline });
        if let Some(splats) = splats {
            entry["splats"] = splats;
        }
        self.list("scenes", entry);
        Ok(())
    }

    /// A dry sound, and who made it.
    pub(crate) fn add_sound(&mut self, from: &Path, credit: Option<&str>) -> Result<()> {
        let bytes = file::read(from, MOST_SOUND_BYTES).with_context(|| format!("{}: cannot be read", from.display()))?;
        let ending = from.extension().map_or(String::new(), |e| e.to_string_lossy().into_owned());
        let count = bytes.len();
        let file = self.add("sounds", from, &ending, bytes);
        self.list("sounds", json!({ "name": stem(from), "file": file, "bytes": count, "credit": credit }));
        Ok(())
    }

    /// A path in a scene, by its number.
    pub(crate) fn add_path(&mut self, from: &Path, scene: usize) -> Result<()> {
        let imported = path::read(from, &ImportOptions::default())?;
        report::notes(&imported.notes);
        let row = |k: &promenade_paths::Keyframe| {
            let ([x, y, z], [qx, qy, qz, qw]) = (k.pose.position.to_array(), k.pose.orientation.to_array());
            (k.t_s, x, y, z, qx, qy, qz, qw)
        };
        let rows: Vec<_> = imported.path.keyframes().iter().map(row).collect();
        let file = self.add("paths", from, "json", json!(rows).to_string().into_bytes());
        self.list("paths", json!({ "name": stem(from), "file": file, "scene": scene }));
        Ok(())
    }

    pub(crate) fn add_head(&mut self, from: &Path) -> Result<()> {
        let head = read_head(from)?;
        report::notes(head.notes());
        let file = self.add("heads", from, "head", head.to_bytes());
        self.list("heads", json!({ "name": head.name(), "file": file }));
        Ok(())
    }

    pub(crate) fn add_headphones(&mut self, from: &Path) -> Result<()> {
        let headphones = read_headphones(from)?;
        let text = serde_json::to_vec(&headphones).context("the headphones cannot be written")?;
        let file = self.add("headphones", from, "json", text);
        self.list("headphones", json!({ "name": stem(from), "file": file }));
        Ok(())
    }

    /// The whole page; the title is the first scene's unless there is another.
    pub(crate) fn finish(mut self, title: Option<&str>) -> Self {
        let first = self.lists.get("scenes").and_then(|scenes| scenes.first()).map(|scene| scene["name"].clone());
        let mut contents = json!({ "title": title.map(Value::from).or(first) });
        for (name, list) in &self.lists {
            contents[*name] = json!(list);
        }
        self.files.insert("site.json".to_owned(), contents.to_string().into_bytes());
        // Servers send these instead to browsers that take them.
        let smaller = |(name, bytes): (&String, &Vec<u8>)| Some((format!("{name}.gz"), compressed(name, bytes)?));
        let packed: Vec<_> = self.files.iter().filter_map(smaller).collect();
        self.files.extend(packed);
        self
    }

    /// Names, with slashes, and contents.
    pub(crate) fn files(&self) -> &BTreeMap<String, Vec<u8>> {
        &self.files
    }

    pub(crate) fn bytes(&self) -> usize {
        self.files.values().map(Vec::len).sum()
    }

    /// Writes all files into a folder, the list of contents last.
    pub(crate) fn write(&self, folder: &Path) -> Result<()> {
        promenade_web::check_folder(folder).map_err(anyhow::Error::msg)?;
        let last = |name: &str| name.starts_with("site.json");
        let order = self.files.iter().filter(|(name, _)| !last(name)).chain(self.files.iter().filter(|(name, _)| last(name)));
        for (name, bytes) in order {
            let to = folder.join(name);
            let parent = to.parent().unwrap_or(folder);
            std::fs::create_dir_all(parent).with_context(|| format!("{}: cannot be made", parent.display()))?;
            let beside = folder.join(format!("{name}.gz"));
            if beside.is_file() {
                // That of an older page would be sent; this page's comes after it.
                std::fs::remove_file(&beside).with_context(|| format!("{}: cannot be removed", beside.display()))?;
            }
            atomic::write(&to, bytes)?;
        }
        Ok(())
    }

    fn list(&mut self, of: &'static str, entry: Value) {
        self.lists.entry(of).or_default().push(entry);
    }

    /// Adds a file under a name that a link can have and no other file has; returns it.
    fn add(&mut self, folder: &str, from: &Path, ending: &str, bytes: Vec<u8>) -> String {
        let plain = |c: char| if c.is_ascii_alphanumeric() || c == '-' || c == '.' { c.to_ascii_lowercase() } else { '-' };
        let stem: String = stem(from).chars().map(plain).collect();
        let ending: String = ending.chars().map(plain).collect();
        let named = |number: usize| match number {
            0 => format!("{folder}/{stem}.{ending}"),
            _ => format!("{folder}/{stem}-{}.{ending}", number + 1),
        };
        let name = (0..).map(named).find(|name| !self.files.contains_key(name)).unwrap_or_default();
        self.files.insert(name.clone(), bytes);
        name
    }
}

/// A file's name without its ending.
fn stem(path: &Path) -> String {
    path.file_stem().map_or_else(|| "unnamed".to_owned(), |stem| stem.to_string_lossy().into_owned())
}
