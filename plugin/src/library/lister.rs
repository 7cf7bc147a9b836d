//! Lists scenes and camera paths for an editor, without reading whole scenes.

use crate::library::factory::{self, FactoryScene};
use crate::library::{self, file};
use crate::worker::{Task, lock::lock, repaint::Repaint};
use promenade_core::SceneCard;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::{Instant, SystemTime};

/// A scene as it is listed.
#[derive(Clone, Debug)]
pub struct Listed {
    /// Where it is; empty for a factory scene.
    pub path: PathBuf,
    /// Size of the file, bytes.
    pub bytes: u64,
    /// The file's own description, or what is wrong with the file; `None` until it is read.
    pub card: Option<Result<Arc<SceneCard>, String>>,
    changed: Option<SystemTime>,
}

impl Listed {
    /// The file's name without its extension.
    pub fn file_name(&self) -> &str {
        self.path.file_stem().and_then(|name| name.to_str()).unwrap_or_default()
    }

    /// The scene's title, or the file's name until that is known.
    pub fn title(&self) -> &str {
        match &self.card {
            Some(Ok(card)) if !card.provenance.title.is_empty() => &card.provenance.title,
            _ => self.file_name(),
        }
    }
}

/// The scenes and camera paths that can be chosen.
#[derive(Clone, Debug, Default)]
pub struct Listing {
    /// The loft that is built in, which a project names as it names a file.
    pub loft: Option<Listed>,
    /// The other built-in scenes, in the order of [`crate::parameter::choices::SceneChoice`].
    pub factory: Vec<Listed>,
    /// The library's scenes; the first is in slot 1.
    pub scenes: Vec<Listed>,
    /// The library's camera paths; the first is in slot 1.
    pub walks: Vec<PathBuf>,
    /// The folders that were searched.
    pub folders: Vec<PathBuf>,
}

/// Makes the list on a thread of its own.
pub struct Lister {
    newest: Mutex<Arc<Listing>>,
    repaint: Repaint,
}

impl Lister {
    /// Nothing listed yet; `repaint` is asked for a picture whenever the list changes.
    pub fn new(repaint: Repaint) -> Arc<Self> {
        Arc::new(Self { newest: Mutex::default(), repaint })
    }

    /// What is known so far.
    pub fn newest(&self) -> Arc<Listing> {
        Arc::clone(&lock(&self.newest))
    }

    fn publish(&self, listing: &Listing) {
        *lock(&self.newest) = Arc::new(listing.clone());
        self.repaint.request_repaint();
    }

    /// Lists names at once, then reads each file's description; files that have not changed are not read again.
    fn list(&self, folders: Vec<PathBuf>) {
        let old = self.newest();
        let known = |path: &Path| old.scenes.iter().find(|listed| listed.path == path);
        let mut listing = Listing {
            loft: Some(built_in(&factory::LOFT)),
            factory: [factory::ROOM_A, factory::ROOM_B].iter().map(built_in).collect(),
            walks: library::files(&folders, library::WALKS),
            scenes: Vec::new(),
            folders,
        };
        for path in library::files(&listing.folders, library::SCENES) {
            let meta = std::fs::metadata(&path).ok();
            let (bytes, changed) = meta.map_or((0, None), |meta| (meta.len(), meta.modified().ok()));
            let same = known(&path).filter(|listed| listed.bytes == bytes && listed.changed == changed);
            let card = same.and_then(|listed| listed.card.clone());
            listing.scenes.push(Listed { path, bytes, card, changed });
        }
        self.publish(&listing);
        for index in 0..listing.scenes.len() {
            if listing.scenes[index].card.is_none() {
                listing.scenes[index].card = Some(card_at(&listing.scenes[index].path).map(Arc::new));
                self.publish(&listing);
            }
        }
    }
}

impl Task for Lister {
    fn run(&self) -> Option<Instant> {
        self.list(library::folders());
        None
    }
}

fn built_in(scene: &FactoryScene) -> Listed {
    let card = SceneCard::from_head(scene.bytes).map(Arc::new).map_err(|error| error.to_string());
    Listed { path: PathBuf::new(), bytes: scene.bytes.len() as u64, card: Some(card), changed: None }
}

/// Reads a file's description from its header.
pub(crate) fn card_at(path: &Path) -> Result<SceneCard, String> {
    let read = |path: &Path| -> std::io::Result<Result<SceneCard, String>> {
        let mut file = file::open(path)?;
        let mut header = Vec::new();
        file.by_ref().take(8).read_to_end(&mut header)?;
        let length = match SceneCard::head_len(&header) {
            Ok(length) => length,
            Err(error) => return Ok(Err(error.to_string())),
        };
        // The length is the file's own claim: no more is read than there is.
        file.take((length - header.len()) as u64).read_to_end(&mut header)?;
        Ok(SceneCard::from_head(&header).map_err(|error| error.to_string()))
    };
    read(path).map_err(|error| error.to_string()).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_file_is_listed_with_its_description_or_what_is_wrong() {
        let kept = tempfile::tempdir().unwrap();
        let folder = kept.path().to_owned();
        std::fs::write(folder.join("a.promenade"), factory::ROOM_B.bytes).unwrap();
        std::fs::write(folder.join("b.promenade"), b"none").unwrap();
        std::fs::write(folder.join("c.promenade"), u64::MAX.to_le_bytes()).unwrap();
        std::fs::write(folder.join("walk.json"), "[]").unwrap();
        let lister = Lister::new(Repaint::default());
        lister.list(vec![folder.clone()]);
        let listing = lister.newest();
        assert_eq!((listing.factory.len(), listing.scenes.len(), listing.walks.len()), (2, 3, 1));
        assert!(listing.scenes[0].card.as_ref().unwrap().is_ok());
        assert_eq!(listing.scenes[0].title(), "IoSR Room B, class room");
        for (scene, words) in [(&listing.scenes[1], "found 4"), (&listing.scenes[2], "at most")] {
            let error = scene.card.as_ref().unwrap().as_ref().unwrap_err();
            assert!(error.contains(words), "{error}");
        }
        assert_eq!(listing.scenes[1].title(), "b");
        kept.close().unwrap();
        lister.list(vec![folder]);
        assert!(lister.newest().scenes.is_empty());
    }

    #[cfg(unix)]
    #[test]
    fn a_pipe_is_listed_with_what_it_is() {
        use crate::library::tests::{in_time, make_pipe};
        let kept = tempfile::tempdir().unwrap();
        let folder = kept.path().to_owned();
        make_pipe(&folder.join("a.promenade"));
        let lister = Lister::new(Repaint::default());
        let listed = Arc::clone(&lister);
        in_time(move || listed.list(vec![folder]));
        let error = lister.newest().scenes[0].card.as_ref().unwrap().as_ref().unwrap_err().clone();
        assert!(error.contains("expected a regular file"), "{error}");
    }
}
