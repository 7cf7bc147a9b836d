//! COLMAP's sparse models: where their files are, and their points.

use super::{Camera, MAX_POINTS, Point, PointOptions, file};
use crate::BakeError;
use crate::sources::file::ending;
use promenade_core::glam::Vec3;
use promenade_paths::colmap;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Where a folder keeps a model.
const FOLDERS: [&str; 3] = ["", "sparse/0", "sparse"];
/// Id, position, colour, error and the length of no track.
const LEAST_BYTES: usize = 8 + 3 * 8 + 3 + 8 + 8;
/// An image's id and the number of a point in it.
const TRACK_BYTES: usize = 8;

/// Files of a model.
#[derive(Debug)]
pub(super) struct Model {
    pub(super) points: PathBuf,
    pub(super) images: PathBuf,
}

/// The points with the images beside them; COLMAP itself prefers the binary form.
pub(super) fn model(folder: &Path) -> Result<Model, BakeError> {
    let points = find(folder, &FOLDERS, "points3D")?;
    let beside = points.parent().unwrap_or(folder);
    Ok(Model { images: find(beside, &[""], "images")?, points })
}

/// The lenses beside the images.
pub(super) fn lenses(folder: &Path) -> Result<BTreeMap<u32, colmap::Lens>, BakeError> {
    let images = images(folder)?;
    let path = find(images.parent().unwrap_or(folder), &[""], "cameras")?;
    colmap::lenses(&path.display().to_string(), &file::bytes(&path)?)
}

pub(super) fn images(folder: &Path) -> Result<PathBuf, BakeError> {
    find(folder, &FOLDERS, "images")
}

fn find(folder: &Path, under: &[&str], stem: &str) -> Result<PathBuf, BakeError> {
    let mut files = under.iter().flat_map(|f| ["bin", "txt"].map(|e| folder.join(f).join(format!("{stem}.{e}"))));
    files.find(|f| f.is_file()).ok_or_else(|| {
        let expected = format!("a COLMAP model, a folder with {stem}.bin or {stem}.txt or with sparse/0");
        BakeError::content(folder, expected, "none of them")
    })
}

pub(super) fn cameras(path: &Path) -> Result<Vec<Camera>, BakeError> {
    let name = path.display().to_string();
    colmap::images(&name, &file::bytes(path)?)
}

/// The points that are good enough.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Good {
    pub(super) points: Vec<Point>,
    /// Ids of images and numbers of the points that are seen in them.
    pub(super) sights: Vec<[u32; 2]>,
    /// How many points are not good enough.
    pub(super) left_out: usize,
}

pub(super) fn points(path: &Path, bytes: &[u8], options: &PointOptions) -> Result<Good, BakeError> {
    let Good { mut points, mut sights, mut left_out } = Good::default();
    let mut take = |place: &dyn Fn() -> String, found: FilePoint| {
        // What does not fit is found to be infinite.
        let position = Vec3::from_array(found.position.map(|v| v as f32));
        if !position.is_finite() || !found.error_px.is_finite() {
            let what = format!("{:?} with error {}", found.position, found.error_px);
            return Err(BakeError::entry(path, place(), "a point with a finite position and error", what));
        }
        if found.error_px > options.max_error_px || (found.seen.len() as u64) < u64::from(options.min_track) {
            left_out += 1;
        } else {
            sights.extend(found.seen.iter().map(|image| [*image, points.len() as u32]));
            points.push(Point { position, colour: found.colour.map(|c| f32::from(c) / 255.0) });
        }
        Ok(())
    };
    if ending(path) == "txt" {
        text(path, bytes, &mut take)?;
    } else {
        binary(path, bytes, &mut take)?;
    }
    Ok(Good { points, sights, left_out })
}

/// A point as it is in the file.
struct FilePoint {
    position: [f64; 3],
    colour: [u8; 3],
    /// Below 0 where COLMAP has not computed it.
    error_px: f64,
    /// Ids of the images that it is seen in.
    seen: Vec<u32>,
}

type Take<'a> = dyn FnMut(&dyn Fn() -> String, FilePoint) -> Result<(), BakeError> + 'a;

fn binary(path: &Path, bytes: &[u8], take: &mut Take<'_>) -> Result<(), BakeError> {
    let mut rest = bytes;
    let place = |rest: &[u8]| format!("byte {}", bytes.len() - rest.len());
    let mut next = |count: usize, what: &str| -> Result<(String, &[u8]), BakeError> {
        let at = place(rest);
        let Some((taken, left)) = rest.split_at_checked(count) else {
            let found = format!("{} to the end", rest.len());
            return Err(BakeError::entry(path, at, format!("{count} bytes of {what}"), found));
        };
        rest = left;
        Ok((at, taken))
    };
    let (_, head) = next(8, "the count of points")?;
    let count = u64::from_le_bytes(array(head));
    let most = MAX_POINTS.min((bytes.len() - 8) / LEAST_BYTES);
    if count > most as u64 {
        let expected = format!("at most {most} points in {} bytes", bytes.len());
        return Err(BakeError::entry(path, "byte 0", expected, count));
    }
    for _ in 0..count {
        let (at, point) = next(LEAST_BYTES, "a point")?;
        let float = |i: usize| f64::from_le_bytes(array(&point[i..]));
        let track = u64::from_le_bytes(array(&point[43..]));
        let (position, colour) = ([float(8), float(16), float(24)], [point[32], point[33], point[34]]);
        let length = usize::try_from(track).ok().and_then(|n| n.checked_mul(TRACK_BYTES)).unwrap_or(usize::MAX);
        let (_, track) = next(length, "a track")?;
        let seen = track.as_chunks::<TRACK_BYTES>().0.iter().map(|view| u32::from_le_bytes(array(view))).collect();
        take(&|| at.clone(), FilePoint { position, colour, error_px: float(35), seen })?;
    }
    if rest.is_empty() {
        return Ok(());
    }
    let expected = format!("the end after {count} points");
    Err(BakeError::entry(path, place(rest), expected, format!("{} bytes more", rest.len())))
}

/// The first bytes, of which there are enough.
fn array<const N: usize>(bytes: &[u8]) -> [u8; N] {
    std::array::from_fn(|i| bytes[i])
}

fn text(path: &Path, bytes: &[u8], take: &mut Take<'_>) -> Result<(), BakeError> {
    let text = std::str::from_utf8(bytes)
        .map_err(|e| BakeError::entry(path, format!("byte {}", e.valid_up_to()), "text in UTF-8", "something else"))?;
    let mut count = 0;
    for (line, number) in text.lines().zip(1_u64..) {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let place = || format!("line {number}");
        let found = parse(line).ok_or_else(|| {
            let expected = "POINT3D_ID X Y Z R G B ERROR and pairs of IMAGE_ID POINT2D_IDX";
            let shown: String = line.chars().take(60).collect();
            BakeError::entry(path, place(), expected, format!("{shown:?}"))
        })?;
        count += 1;
        if count > MAX_POINTS {
            return Err(BakeError::entry(path, place(), format!("at most {MAX_POINTS} points"), "more"));
        }
        take(&place, found)?;
    }
    Ok(())
}

fn parse(line: &str) -> Option<FilePoint> {
    let mut words = line.split_ascii_whitespace();
    words.next()?.parse::<u64>().ok()?;
    let mut float = || words.next()?.parse::<f64>().ok();
    let position = [float()?, float()?, float()?];
    let mut level = || words.next()?.parse::<u8>().ok();
    let colour = [level()?, level()?, level()?];
    let error_px = words.next()?.parse::<f64>().ok()?;
    let mut seen = Vec::new();
    while let Some(image) = words.next() {
        seen.push(image.parse().ok()?);
        words.next()?.parse::<u64>().ok()?;
    }
    Some(FilePoint { position, colour, error_px, seen })
}
