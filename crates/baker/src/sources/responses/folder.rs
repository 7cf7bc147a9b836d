//! Folders of responses with poses beside them, as data sets for acoustic fields have them.

use super::{Response, Responses, check};
use crate::sources::file;
use crate::{BakeError, sound};
use promenade_audio::npy::Array;
use promenade_core::Pose;
use promenade_core::glam::{Quat, Vec3};
use promenade_core::network::Placement;
use promenade_paths::PlacementOptions;
use std::path::{Path, PathBuf};

/// Bytes that a file of poses may have.
const MAX_BYTES: u64 = 64 << 20;

/// What a folder does not say.
#[derive(Clone, Debug, PartialEq)]
pub struct FolderOptions {
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
}

/// Loads responses of one source and one or two channels; one channel is what both ears hear. They are sound files in the order
/// of their names, with a row for each in `poses.npy`, `poses.json` or `poses.txt`; the source is that of the options, or of
/// `source.txt`.
///
/// A row of poses has 3 numbers (position), 6 (position, yaw, pitch and roll in degrees) or 7 (position, quaternion w, x, y,
/// z), in the data's world with the head's axes x forward, y left, z up; without an orientation heads look along x.
///
/// # Errors
/// Missing or damaged files, another number of rows than of files, rates that differ, and what [`Responses::load`] refuses.
/// Checked against layouts that were made by hand only.
pub fn load_folder(folder: &Path, options: &FolderOptions) -> Result<Responses, BakeError> {
    let (measured, stated) = rows(folder, options.emitter.is_some())?;
    let heads: Vec<Pose> = measured.iter().map(|one| one.listener).collect();
    let placement = options.placement.over(&Placement::IDENTITY, &heads)?;
    let source = stated.map(|s| placement.to_scene(s)).or(options.emitter);
    let source = source.ok_or_else(|| BakeError::content(folder, "a source, in the folder or as an option", "none"))?;
    let mut notes = Vec::new();
    let mut rate: Option<(PathBuf, u32)> = None;
    let mut responses = Vec::with_capacity(measured.len());
    let (mut mono, mut longest) = (0, 0);
    for one in measured {
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
        responses.push(Response { listener, source, left, right, name: one.name });
    }
    if mono > 0 {
        notes.push(format!("{mono} responses have one channel: both ears hear the same, and the head does not shade"));
    }
    let mut set = Responses {
        title: options.title.clone(),
        credit: options.credit.clone(),
        licence: options.licence.clone(),
        sample_rate_hz: rate.map_or(0.0, |(_, hz)| f64::from(hz)),
        responses,
        notes,
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
}

/// The responses with their poses, and the source that the folder states, if it is asked for one.
fn rows(folder: &Path, knows_source: bool) -> Result<(Vec<Measured>, Option<Vec3>), BakeError> {
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
        Ok(Measured { file, name, listener, turned })
    };
    Ok((files.into_iter().zip(poses).map(measured).collect::<Result<_, _>>()?, source))
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

fn of_line(path: &Path, number: usize, line: &str) -> Result<Vec<f32>, BakeError> {
    let words = line.split(|c: char| c == ',' || c == ';' || c.is_whitespace()).filter(|w| !w.is_empty());
    let value = |word: &str| {
        let wrong = || BakeError::entry(path, format!("line {}", number + 1), "finite numbers", word);
        word.parse::<f32>().ok().filter(|v| v.is_finite()).ok_or_else(wrong)
    };
    words.map(value).collect()
}
