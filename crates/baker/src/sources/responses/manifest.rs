//! WAV files described by a JSON manifest.

use super::check;
use super::pattern::{Field, Pattern};
use super::{Levels, LoadOptions, Response, Responses, Side, Walls};
use crate::sources::Split;
use crate::sources::file;
use crate::{BakeError, sound};
use promenade_core::glam::Vec3;
use promenade_core::{Mover, Pose};
use promenade_sofa::{About, Recorded};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Bytes a manifest may have.
const MAX_BYTES: u64 = 64 << 20;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Manifest {
    title: String,
    #[serde(default)]
    credit: String,
    #[serde(default)]
    licence: String,
    /// For people; not read.
    #[serde(default, rename = "note")]
    _note: String,
    /// Folder of the files, relative to the manifest.
    root: Option<PathBuf>,
    pattern: Option<String>,
    #[serde(default)]
    patterns: Vec<Entry>,
    #[serde(default)]
    responses: Vec<Entry>,
    #[serde(default)]
    azimuth_positive: Side,
    /// Which channels are the ears; the two of a file with two channels where it is not given.
    channels: Option<[usize; 2]>,
    /// Used where an entry has none of its own.
    listener: Option<Listener>,
    source: Option<[f32; 3]>,
    distance_m: Option<f32>,
    /// Metres of a unit of the lengths in file names.
    length_unit_m: Option<f32>,
    /// The room, where it is a box.
    room: Option<BoxRoom>,
    levels: Option<Levels>,
}

/// A box along the axes of the world.
#[derive(Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct BoxRoom {
    /// Lengths along x, y and z, metres; null where they are not known.
    size: [Option<f32>; 3],
    /// The corner of least coordinates.
    #[serde(default)]
    corner: [f32; 3],
    /// What moves while the listener walks, where sources lie around one listener.
    moves: Option<Moves>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Moves {
    Listener,
    Source,
}

impl BoxRoom {
    fn walls(self) -> Walls {
        let moves = self.moves.map(|moves| match moves {
            Moves::Listener => Mover::Listener,
            Moves::Source => Mover::Source,
        });
        Walls {
            corner: Vec3::from_array(self.corner),
            size: Vec3::from_array(self.size.map(|length| length.unwrap_or(f32::INFINITY))),
            moves,
        }
    }
}

#[derive(Clone, Copy, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Listener {
    #[serde(default)]
    position: [f32; 3],
    /// Yaw, pitch and roll, degrees.
    #[serde(default)]
    ypr: [f32; 3],
}

/// A file, or with a pattern in its name many, and what is known of its pose.
#[derive(Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    file: String,
    listener: Option<Listener>,
    /// World position, metres; instead of a direction.
    source: Option<[f32; 3]>,
    /// Direction of the source as the head sees it, degrees.
    azimuth_deg: Option<f32>,
    elevation_deg: Option<f32>,
    distance_m: Option<f32>,
    /// What the data set has it for.
    split: Option<Split>,
}

/// Responses of two ears.
pub(super) fn load(path: &Path, options: &LoadOptions) -> Result<Responses, BakeError> {
    let mut splits = BTreeMap::new();
    let (mut responses, mut room, mut levels) = (Vec::new(), None, None);
    let about = each(path, options, |manifest, file, recorded, split| {
        (room, levels) = (manifest.room.map(BoxRoom::walls), manifest.levels);
        if let Some(split) = split
            && splits.insert(recorded.name.clone(), split).is_some_and(|other| other != split)
        {
            return Err(BakeError::entry(path, &recorded.name, "one \"split\" for all responses of a name", "two"));
        }
        responses.push(binaural(path, file, manifest.channels, recorded)?);
        Ok(())
    })?;
    Ok(Responses { splits, room, levels, ..Responses::of(about, responses) })
}

/// Responses whose channels are those of an Ambisonic microphone.
pub(super) fn ambisonic(path: &Path, options: &LoadOptions) -> Result<(About, Vec<Recorded>), BakeError> {
    let mut all = Vec::new();
    let about = each(path, options, |_, _, recorded, _| {
        all.push(recorded);
        Ok(())
    })?;
    Ok((about, all))
}

/// Hands on all files with their poses.
fn each(
    path: &Path,
    options: &LoadOptions,
    mut take: impl FnMut(&Manifest, &Path, Recorded, Option<Split>) -> Result<(), BakeError>,
) -> Result<About, BakeError> {
    let manifest: Manifest = file::json(path, MAX_BYTES)?;
    manifest.check(path)?;
    let beside = path.parent().unwrap_or(Path::new(""));
    let root = match (&options.root, &manifest.root) {
        (Some(root), _) => root.clone(),
        (None, Some(root)) => beside.join(root),
        (None, None) => beside.to_path_buf(),
    };
    let files = files(path, &root, &manifest)?;
    let mut loader = Loader { path, manifest: &manifest, options, rate: None };
    let mut frames = 0;
    for (index, (file, entry)) in files.iter().enumerate() {
        let recorded = loader.recorded(file, entry)?;
        frames = frames.max(recorded.channels.first().map_or(0, Vec::len) * recorded.channels.len().div_ceil(2));
        check::size(path, index + 1, frames)?;
        take(&manifest, file, recorded, entry.split)?;
    }
    let Some((_, rate)) = loader.rate else {
        return Err(BakeError::content(path, "at least one file in \"pattern\", \"patterns\" or \"responses\"", "none"));
    };
    let Manifest { title, credit, licence, .. } = manifest;
    Ok(About { title, credit, licence, sample_rate_hz: f64::from(rate) })
}

impl Manifest {
    fn check(&self, path: &Path) -> Result<(), BakeError> {
        if let Some([left, right]) = self.channels
            && left == right
        {
            let expected = "two channels, the left ear's and the right ear's";
            return Err(BakeError::entry(path, "\"channels\"", expected, format!("[{left}, {right}]")));
        }
        match self.length_unit_m {
            Some(unit) if !(1e-6..=1e3).contains(&unit) => {
                Err(BakeError::entry(path, "\"length_unit_m\"", "0.000001 to 1000 metres", unit))
            }
            _ => Ok(()),
        }
    }
}

/// A response by the channels that are ears.
fn binaural(path: &Path, file: &Path, ears: Option<[usize; 2]>, recorded: Recorded) -> Result<Response, BakeError> {
    let Recorded { listener, source, mut channels, name, .. } = recorded;
    let count = channels.len();
    if ears.is_none() && count > 2 {
        let expected = "2 channels, or \"channels\": [left, right] in the manifest, counted from 0";
        return Err(BakeError::content(file, expected, format!("{count} channels")));
    }
    let mut ear = |index: usize| {
        let expected = || format!("a channel {index} for an ear, counted from 0");
        channels
            .get_mut(index)
            .map(std::mem::take)
            .ok_or_else(|| BakeError::content(file, expected(), format!("{count} channels")))
    };
    let [left, right] = ears.unwrap_or([0, 1]);
    let (left, right) = (ear(left)?, ear(right)?);
    let shown = file.display().to_string();
    let source = source.ok_or_else(|| BakeError::entry(path, shown, "a \"source\" or an azimuth", "neither"))?;
    Ok(Response { listener, source, left, right, name })
}

/// Every file with its entry, patterns replaced by what they match.
fn files(path: &Path, root: &Path, manifest: &Manifest) -> Result<Vec<(PathBuf, Entry)>, BakeError> {
    let whole = manifest.pattern.iter().map(|file| Entry { file: file.clone(), ..Entry::default() });
    let mut files = Vec::new();
    for entry in whole.chain(manifest.patterns.iter().cloned()) {
        matching(path, root, manifest, &entry, &mut files)?;
    }
    files.extend(manifest.responses.iter().map(|entry| (root.join(&entry.file), entry.clone())));
    Ok(files)
}

fn matching(
    path: &Path,
    root: &Path,
    manifest: &Manifest,
    entry: &Entry,
    files: &mut Vec<(PathBuf, Entry)>,
) -> Result<(), BakeError> {
    let (folder, name) = match entry.file.rsplit_once('/') {
        Some((folder, name)) => (root.join(folder), name),
        None => (root.to_path_buf(), entry.file.as_str()),
    };
    let pattern = Pattern::parse(name).map_err(|(expected, found)| BakeError::entry(path, "pattern", expected, found))?;
    let mut names: Vec<String> = std::fs::read_dir(&folder)
        .and_then(|list| list.map(|e| e.map(|e| e.file_name().to_string_lossy().into_owned())).collect())
        .map_err(BakeError::read(&folder))?;
    names.sort();
    let mut found: Vec<_> = names.iter().filter_map(|n| Some((pattern.numbers(n)?, n))).collect();
    if found.is_empty() {
        let found = format!("none among its {} files", names.len());
        return Err(BakeError::content(&folder, format!("files named {name}"), found));
    }
    found.sort_by(|a, b| a.0.iter().map(|v| v.1).partial_cmp(b.0.iter().map(|v| v.1)).unwrap_or(std::cmp::Ordering::Equal));
    for (numbers, name) in found {
        let mut entry = entry.clone();
        // What names do not say is as it is for all.
        let mut listener = entry.listener.or(manifest.listener);
        for (field, value) in numbers {
            let value = value as f32;
            let metres = value * manifest.length_unit_m.unwrap_or(1.0);
            let head = listener.get_or_insert_default();
            match field {
                Field::Azimuth => entry.azimuth_deg = Some(value),
                Field::Elevation => entry.elevation_deg = Some(value),
                Field::Distance => entry.distance_m = Some(metres),
                Field::Yaw => head.ypr[0] = value,
                Field::Pitch => head.ypr[1] = value,
                Field::Roll => head.ypr[2] = value,
                Field::X => head.position[0] = metres,
                Field::Y => head.position[1] = metres,
                Field::Z => head.position[2] = metres,
            }
        }
        entry.listener = listener;
        files.push((folder.join(name), entry));
    }
    Ok(())
}

struct Loader<'a> {
    path: &'a Path,
    manifest: &'a Manifest,
    options: &'a LoadOptions,
    /// The file that set the sample rate, and the rate.
    rate: Option<(PathBuf, u32)>,
}

impl Loader<'_> {
    fn recorded(&mut self, file: &Path, entry: &Entry) -> Result<Recorded, BakeError> {
        let listener = entry.listener.or(self.manifest.listener).unwrap_or_default();
        let [yaw, pitch, roll] = listener.ypr.map(f32::to_radians);
        let listener = Pose::from_ypr(Vec3::from_array(listener.position), yaw, pitch, roll);
        let source = self.source(file, entry, &listener)?;
        let wav = sound::read(file)?;
        check::rate(file, wav.sample_rate_hz, &mut self.rate)?;
        let name = file.file_stem().map_or_else(|| entry.file.clone(), |n| n.to_string_lossy().into_owned());
        let distance_m = entry.distance_m.or(self.manifest.distance_m);
        Ok(Recorded { listener, source, distance_m, channels: wav.channels, name })
    }

    /// The source where the manifest says it.
    fn source(&self, file: &Path, entry: &Entry, listener: &Pose) -> Result<Option<Vec3>, BakeError> {
        let Some(azimuth) = entry.azimuth_deg else {
            return Ok(entry.source.or(self.manifest.source).map(Vec3::from_array));
        };
        let distance = entry.distance_m.or(self.manifest.distance_m);
        let distance = distance.filter(|d| d.is_finite() && *d > 0.0).ok_or_else(|| {
            let found = distance.map_or("none".to_owned(), |d| d.to_string());
            BakeError::entry(self.path, file.display().to_string(), "a \"distance_m\" above 0 beside the azimuth", found)
        })?;
        let positive = self.options.azimuth_positive.unwrap_or(self.manifest.azimuth_positive);
        let direction = promenade_sofa::to_cartesian(azimuth, entry.elevation_deg.unwrap_or(0.0), distance, positive);
        Ok(Some(listener.position + listener.orientation * direction))
    }
}
