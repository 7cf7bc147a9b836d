//! Folders of responses with poses beside them, as data sets for acoustic fields have them.

use super::{Response, Responses, check};
use crate::sources::file;
use crate::{BakeError, Split, sound};
use promenade_audio::npy::Array;
use promenade_core::Pose;
use promenade_core::glam::{Quat, Vec3};
use promenade_core::network::Placement;
use promenade_paths::PlacementOptions;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Bytes that a file of poses may have.
const MAX_BYTES: u64 = 64 << 20;
/// Sources closer than this are one, metres.
const SAME_PLACE_M: f32 = 1e-2;

/// How responses and poses lie in a folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FolderLayout {
    /// A folder per response, in the folder itself or its `data`, with `rir.wav`, the listener's place in `rx_pos.txt` and the
    /// source's in `tx_pos.txt`, the last three numbers of either: as Real Acoustic Fields is published.
    Raf,
    /// Sound files in the order of their names, one row for each in `poses.npy`, `poses.json` or `poses.txt`; the source in the
    /// options, or in `source.txt`: as other sets can be brought to be.
    Rows,
}

/// What a folder does not say.
#[derive(Clone, Debug, PartialEq)]
pub struct FolderOptions {
    /// How it is laid out.
    pub layout: FolderLayout,
    /// Name of the set.
    pub title: String,
    /// Whom to credit.
    pub credit: String,
    /// Terms of the data.
    pub licence: String,
    /// Where the data's world lies in Promenade's; z up where they give none.
    pub placement: PlacementOptions,
    /// The source, metres in Promenade's world, where it is not in the folder.
    pub emitter: Option<Vec3>,
    /// Which of several sources, counted from 0 in the order in which they appear; without it the one with most responses.
    pub source: Option<usize>,
}

/// Loads responses of one source and one or two channels; one channel is what both ears hear.
///
/// A row of poses has 3 numbers (position), 6 (position, yaw, pitch and roll in degrees) or 7 (position, quaternion w, x, y,
/// z), in the data's world with the head's axes x forward, y left, z up; without an orientation heads look along x.
///
/// # Errors
/// Missing or damaged files, another number of rows than of files, rates that differ, and what [`Responses::load`] refuses.
/// Checked against layouts that were made by hand only.
pub fn load_folder(folder: &Path, options: &FolderOptions) -> Result<Responses, BakeError> {
    let measured = match options.layout {
        FolderLayout::Raf => raf(folder)?,
        FolderLayout::Rows => rows(folder, options.emitter.is_some())?,
    };
    let heads: Vec<Pose> = measured.iter().map(|one| one.listener).collect();
    let placement = options.placement.over(&Placement::IDENTITY, &heads)?;
    let mut notes = Vec::new();
    let mut rate: Option<(PathBuf, u32)> = None;
    let mut responses = Vec::with_capacity(measured.len());
    let (mut mono, mut longest, mut splits) = (0, 0, BTreeMap::new());
    for one in measured {
        splits.extend(one.split.map(|split| (one.name.clone(), split)));
        let wav = sound::read(&one.file)?;
        check::rate(&one.file, wav.sample_rate_hz, &mut rate)?;
        let count = wav.channels.len();
        let mut channels = wav.channels.into_iter();
        let (left, right) = match (channels.next(), channels.next(), count) {
            (Some(both), None, _) => {
                mono += 1;
                (both.clone(), both)
            }
            (Some(left), Some(right), 2) => (left, right),
            _ => return Err(BakeError::content(&one.file, "1 or 2 channels", count)),
        };
        longest = longest.max(left.len());
        check::size(folder, responses.len() + 1, longest)?;
        let mut listener = placement.pose(&one.listener);
        if !one.turned {
            listener.orientation = Quat::IDENTITY;
        }
        let source = one.source.map(|s| placement.to_scene(s)).or(options.emitter);
        let source = source.ok_or_else(|| BakeError::content(folder, "a source, in the folder or as an option", "none"))?;
        responses.push(Response { listener, source, left, right, name: one.name });
    }
    if mono > 0 {
        notes.push(format!("{mono} responses have one channel: both ears hear the same, and the head does not shade"));
    }
    one_source(folder, &mut responses, options.source, &mut notes)?;
    let mut set = Responses {
        title: options.title.clone(),
        credit: options.credit.clone(),
        licence: options.licence.clone(),
        sample_rate_hz: rate.map_or(0.0, |(_, hz)| f64::from(hz)),
        responses,
        notes,
        splits,
        ..Responses::default()
    };
    check::finish(folder, &mut set, true)?;
    Ok(set)
}

/// A response on disk, in the data's world.
struct Measured {
    file: PathBuf,
    name: String,
    listener: Pose,
    /// Whether the data say where the head looks.
    turned: bool,
    source: Option<Vec3>,
    split: Option<Split>,
}

fn raf(folder: &Path) -> Result<Vec<Measured>, BakeError> {
    let data = folder.join("data");
    let root = if data.is_dir() { data } else { folder.to_path_buf() };
    let splits = raf_splits(&folder.join("metadata/data-split.json"))?;
    let mut found = Vec::new();
    for place in file::entries(&root)?.into_iter().filter(|p| p.join("rir.wav").is_file()) {
        let position = |name: &str| {
            let path = place.join(name);
            let numbers = numbers(&path)?;
            // What goes before the position is an orientation; a loudspeaker has one, a microphone none.
            match numbers[..] {
                [.., x, y, z] if matches!(numbers.len(), 3 | 7) => Ok(Vec3::new(x, y, z)),
                _ => Err(BakeError::content(&path, "3 numbers, or 7 of which the last 3 are a position", numbers.len())),
            }
        };
        let listener = Pose { position: position("rx_pos.txt")?, orientation: Quat::IDENTITY };
        let source = Some(position("tx_pos.txt")?);
        let name = place.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let split = splits.get(number(&name)).copied();
        found.push(Measured { file: place.join("rir.wav"), name, listener, turned: false, source, split });
    }
    if found.is_empty() {
        return Err(BakeError::content(&root, "folders with a rir.wav", "none"));
    }
    Ok(found)
}

/// What responses are for, by their numbers: `train`, `validation` and `test` each have a list of them, or lists in a list.
/// What a training is stopped by is seen by it: validation is for learning. Nothing where there is no such file.
fn raf_splits(path: &Path) -> Result<BTreeMap<String, Split>, BakeError> {
    if !path.exists() {
        return Ok(BTreeMap::new());
    }
    let lists: BTreeMap<String, serde_json::Value> = file::json(path, MAX_BYTES)?;
    let mut splits = BTreeMap::new();
    for (list, values) in &lists {
        let split = match list.as_str() {
            "train" | "validation" => Split::Train,
            "test" => Split::Test,
            other => return Err(BakeError::entry(path, format!("\"{other}\""), "train, validation or test", "another list")),
        };
        let mut open = vec![values];
        while let Some(value) = open.pop() {
            let name = match value {
                serde_json::Value::Array(values) => {
                    open.extend(values);
                    continue;
                }
                serde_json::Value::String(name) => number(name).to_owned(),
                serde_json::Value::Number(n) => number(&n.to_string()).to_owned(),
                other => {
                    return Err(BakeError::entry(path, format!("\"{list}\""), "names of responses", other));
                }
            };
            if splits.insert(name.clone(), split).is_some_and(|before| before != split) {
                return Err(BakeError::entry(path, name, "a response in one list", "in two"));
            }
        }
    }
    Ok(splits)
}

/// A name without the zeros before its number.
fn number(name: &str) -> &str {
    let short = name.trim_start_matches('0');
    if short.is_empty() { "0" } else { short }
}

fn rows(folder: &Path, knows_source: bool) -> Result<Vec<Measured>, BakeError> {
    let files = file::sounds(folder)?;
    let named = |names: &[&str]| names.iter().map(|n| folder.join(n)).find(|p| p.is_file());
    let Some(path) = named(&["poses.npy", "poses.json", "poses.txt", "poses.csv"]) else {
        return Err(BakeError::content(folder, "a poses.npy, poses.json or poses.txt", "none"));
    };
    let poses = table(&path)?;
    if poses.len() != files.len() || files.is_empty() {
        return Err(BakeError::content(&path, format!("{} poses, one for each sound file", files.len()), poses.len()));
    }
    let source = match named(&["source.txt", "source.npy"]) {
        Some(path) if !knows_source => match table(&path)?.concat()[..] {
            [x, y, z] => Some(Vec3::new(x, y, z)),
            ref other => return Err(BakeError::content(&path, "3 numbers", other.len())),
        },
        _ => None,
    };
    let measured = |(file, row): (PathBuf, Vec<f32>)| {
        let name = file.file_stem().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let wrong = |found: String| BakeError::entry(&path, format!("pose of {name}"), "3, 6 or 7 finite numbers", found);
        if let Some(bad) = row.iter().find(|v| !v.is_finite()) {
            return Err(wrong(bad.to_string()));
        }
        let (listener, turned) = match row[..] {
            [x, y, z] => (Pose { position: Vec3::new(x, y, z), orientation: Quat::IDENTITY }, false),
            [x, y, z, yaw, pitch, roll] => {
                let [yaw, pitch, roll] = [yaw, pitch, roll].map(f32::to_radians);
                (Pose::from_ypr(Vec3::new(x, y, z), yaw, pitch, roll), true)
            }
            [x, y, z, qw, qx, qy, qz] => {
                let q = Quat::from_xyzw(qx, qy, qz, qw);
                if !(0.99..=1.01).contains(&q.length()) {
                    return Err(wrong(format!("a quaternion of length {}", q.length())));
                }
                (Pose { position: Vec3::new(x, y, z), orientation: q.normalize() }, true)
            }
            _ => return Err(wrong(row.len().to_string())),
        };
        Ok(Measured { file, name, listener, turned, source, split: None })
    };
    files.into_iter().zip(poses).map(measured).collect()
}

/// Rows of numbers: NumPy's, JSON's, or lines.
fn table(path: &Path) -> Result<Vec<Vec<f32>>, BakeError> {
    match file::ending(path).as_str() {
        "npy" => {
            let wrong = |found: String| BakeError::content(path, "rows of floats as NumPy saves them", found);
            let array = Array::read(path, MAX_BYTES)?;
            let columns = array.shape.last().copied().unwrap_or(0);
            if array.shape.len() > 2 || columns == 0 {
                return Err(wrong(format!("the shape {:?}", array.shape)));
            }
            Ok(array.values.chunks_exact(columns).map(|row| row.iter().map(|v| *v as f32).collect()).collect())
        }
        "json" => file::json(path, MAX_BYTES),
        _ => {
            let bytes = file::bytes(path, MAX_BYTES)?;
            let text = String::from_utf8_lossy(&bytes);
            let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty() && !line.trim().starts_with('#'));
            lines.map(|(number, line)| of_line(path, number, line)).collect()
        }
    }
}

/// All numbers of a text.
fn numbers(path: &Path) -> Result<Vec<f32>, BakeError> {
    of_line(path, 0, &String::from_utf8_lossy(&file::bytes(path, MAX_BYTES)?))
}

fn of_line(path: &Path, number: usize, line: &str) -> Result<Vec<f32>, BakeError> {
    let words = line.split(|c: char| c == ',' || c == ';' || c.is_whitespace()).filter(|w| !w.is_empty());
    let value = |word: &str| {
        let wrong = || BakeError::entry(path, format!("line {}", number + 1), "finite numbers", word);
        word.parse::<f32>().ok().filter(|v| v.is_finite()).ok_or_else(wrong)
    };
    words.map(value).collect()
}

/// Keeps the responses of one source.
fn one_source(
    folder: &Path,
    responses: &mut Vec<Response>,
    wanted: Option<usize>,
    notes: &mut Vec<String>,
) -> Result<(), BakeError> {
    let mut places: Vec<(Vec3, usize)> = Vec::new();
    for r in responses.iter() {
        match places.iter_mut().find(|(p, _)| p.distance(r.source) < SAME_PLACE_M) {
            Some((_, count)) => *count += 1,
            None => places.push((r.source, 1)),
        }
    }
    let most = (0..places.len()).rev().max_by_key(|&i| places[i].1).unwrap_or(0);
    let chosen = wanted.unwrap_or(most);
    let Some((place, count)) = places.get(chosen).copied() else {
        let found = format!("{} sources", places.len());
        return Err(BakeError::content(folder, format!("a source {chosen}, counted from 0"), found));
    };
    if places.len() > 1 {
        let (sources, all) = (places.len(), responses.len());
        notes.push(format!("source {chosen} of {sources} at {place} was used, with {count} of {all} responses"));
        responses.retain(|r| r.source.distance(place) < SAME_PLACE_M);
    }
    // Places that are one but for the grain of their measurement are one.
    responses.iter_mut().for_each(|r| r.source = place);
    Ok(())
}
