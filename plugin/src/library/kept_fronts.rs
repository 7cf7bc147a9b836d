//! Fronts in the user's cache, by the content of their scenes.

use crate::library::cache::content_hash;
use crate::library::file::{read_limited, write_whole};
use nice_plug::nice_warn;
use promenade_core::{FrontPoint, Scene};
use std::io::{Error, ErrorKind, Result};
use std::path::{Path, PathBuf};

/// Counts up when fronts are found in another way.
const METHOD: u32 = 1;
/// A larger file is none of ours, bytes.
const LARGEST_FILE: u64 = 1 << 14;
/// Fronts that are kept; the oldest go.
const MOST_FILES: usize = 256;

/// A folder of fronts; none where the system names no folder for caches.
#[derive(Clone, Debug)]
pub(super) struct KeptFronts(Option<PathBuf>);

impl KeptFronts {
    /// Those of this user.
    pub(super) fn of_this_machine() -> Self {
        Self(dirs::cache_dir().map(|folder| folder.join("promenade").join("fronts")))
    }

    /// Those in a folder, which need not exist.
    #[cfg(test)]
    pub(super) fn in_folder(folder: &Path) -> Self {
        Self(Some(folder.to_owned()))
    }

    /// The file of a scene's front.
    pub(super) fn file(&self, scene: &Scene) -> Option<PathBuf> {
        let name = format!("{}-{METHOD}.json", content_hash(&scene.to_bytes().ok()?));
        self.0.as_ref().map(|folder| folder.join(name))
    }
}

/// The front in a file, if there is one. One that is damaged is as none, and the host's log says so.
pub(super) fn read(file: &Path) -> Option<Vec<FrontPoint>> {
    let is_valid = |p: &FrontPoint| (0.0..f32::INFINITY).contains(&p.error.jnds) && (0.0..=1.0).contains(&p.cost);
    let points = |bytes: Vec<u8>| -> Result<Vec<FrontPoint>> {
        let rows = serde_json::from_slice::<Vec<[f32; FrontPoint::NUMBERS]>>(&bytes)?;
        let points: Option<Vec<_>> = rows.iter().map(|row| FrontPoint::of_numbers(row).filter(is_valid)).collect();
        let expected = || Error::new(ErrorKind::InvalidData, "expected settings with errors and costs of 0 to 1, found others");
        points.filter(|points| !points.is_empty()).ok_or_else(expected)
    };
    match read_limited(file, LARGEST_FILE).and_then(points) {
        Ok(points) => Some(points),
        Err(error) if error.kind() == ErrorKind::NotFound => None,
        Err(error) => {
            nice_warn!("{}: the front is not used: {error}", file.display());
            None
        }
    }
}

/// Keeps a front in a file.
pub(super) fn write(file: &Path, front: &[FrontPoint]) {
    let bytes = serde_json::to_vec(&front.iter().map(FrontPoint::numbers).collect::<Vec<_>>()).map_err(Error::other);
    let folder = file.parent().unwrap_or(Path::new(""));
    let made = std::fs::create_dir_all(folder).and_then(|()| write_whole(file, &bytes?)).and_then(|()| forget_oldest(folder));
    if let Err(error) = made {
        nice_warn!("{}: the front cannot be kept: {error}", file.display());
    }
}

fn forget_oldest(folder: &Path) -> Result<()> {
    let entries = std::fs::read_dir(folder)?.collect::<Result<Vec<_>>>()?;
    let mut files: Vec<_> = entries.iter().filter_map(|e| Some((e.metadata().ok()?.modified().ok()?, e.path()))).collect();
    files.sort();
    files.iter().rev().skip(MOST_FILES).try_for_each(|(_, path)| std::fs::remove_file(path))
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_core::{Audible, Measure, Setting};
    use promenade_testing::scenes::room_with_images;

    fn front() -> Vec<FrontPoint> {
        let setting = Setting { images: 3, waves: false, ..Setting::ALL };
        let error = Audible { jnds: 0.5, measure: Measure::MovingIld };
        vec![FrontPoint { setting, error, cost: 0.75 }]
    }

    #[test]
    fn a_front_comes_back_for_the_content_of_its_scene() {
        let folder = tempfile::tempdir().unwrap();
        let kept = KeptFronts::in_folder(&folder.path().join("fronts"));
        let [first, same, other] = [4, 4, 5].map(|images| room_with_images(8_000.0, 0.2, 0.05, images));
        let file = kept.file(&first).unwrap();
        assert_eq!(read(&file), None);
        write(&file, &front());
        assert_eq!(read(&kept.file(&same).unwrap()), Some(front()));
        assert_eq!(read(&kept.file(&other).unwrap()), None);
    }

    #[test]
    fn what_is_damaged_is_no_front_and_the_oldest_go() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("front.json");
        write(&file, &front());
        let whole = std::fs::read(&file).unwrap();
        let text = String::from_utf8(whole.clone()).unwrap();
        let wrong = [("0.75", "1.5"), ("8.0", "99.0"), ("0.5", "-1"), ("0.5", "1e39"), ("3.0,", ""), ("3.0", "null")];
        let damaged = wrong.map(|(from, to)| text.replace(from, to).into_bytes());
        let damaged = damaged.into_iter().filter(|bytes| *bytes != whole);
        let cut = (0..whole.len()).map(|end| whole[..end].to_vec());
        for bytes in cut.chain(damaged).chain([b"[]".to_vec(), vec![b' '; 1 << 15]]) {
            std::fs::write(&file, &bytes).unwrap();
            assert_eq!(read(&file), None, "{}", String::from_utf8_lossy(&bytes));
        }
        for n in 0..MOST_FILES + 3 {
            write(&folder.path().join(format!("{n}.json")), &front());
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), MOST_FILES);
        assert!(read(&folder.path().join(format!("{}.json", MOST_FILES + 2))).is_some(), "the newest stays");
    }
}
