//! The slots of an instance's project: their files, and their texts for hosts that show parameters as text.

use crate::library::{self, LoadError, slots::Slots};
use crate::parameter::row::{SLOTS, SlotKind};
use crate::project::persisted::Persisted;
use crate::worker::lock::lock;
use nice_plug::params::persist::PersistentField;
use promenade_fault::Fault;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// The folders are looked through again after this; hosts ask for the text of every point of automation.
const KEPT: Duration = Duration::from_secs(2);

/// As a state has them.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct SavedSlots {
    /// Of scenes.
    pub scenes: Slots,
    /// Of camera paths.
    pub walks: Slots,
}

impl SavedSlots {
    /// Those of a kind.
    pub fn of(&self, kind: SlotKind) -> &Slots {
        match kind {
            SlotKind::Scene => &self.scenes,
            SlotKind::Walk => &self.walks,
        }
    }

    fn of_mut(&mut self, kind: SlotKind) -> &mut Slots {
        match kind {
            SlotKind::Scene => &mut self.scenes,
            SlotKind::Walk => &mut self.walks,
        }
    }
}

/// The slots of a project, which its parameters share.
#[derive(Clone, Default)]
pub struct ProjectSlots(Arc<Shared>);

/// Texts of one kind of slot, with what they are made of and when.
type Known = Option<(Instant, SavedSlots, Arc<Vec<String>>)>;

#[derive(Default)]
struct Shared {
    saved: Persisted<SavedSlots>,
    /// The texts of scenes and of paths.
    texts: Mutex<[Known; 2]>,
}

fn paths(files: &[PathBuf]) -> impl Iterator<Item = &Path> + Clone {
    files.iter().map(PathBuf::as_path)
}

impl ProjectSlots {
    /// As they are, without a look at the library.
    pub fn saved(&self) -> SavedSlots {
        self.0.saved.get().0
    }

    /// Those of a kind, with the library's newest files, and all files.
    fn followed(&self, kind: SlotKind, folders: &[PathBuf]) -> (Slots, Vec<PathBuf>) {
        let files = library::files(folders, extensions(kind));
        loop {
            let (mut saved, restores) = self.0.saved.get();
            let slots = saved.of_mut(kind);
            let grows = slots.follow(paths(&files));
            let slots = slots.clone();
            if !grows || self.0.saved.replace(saved, restores) {
                return (slots, files);
            }
        }
    }

    /// The file in a slot. Reads the library's folders.
    ///
    /// # Errors
    /// The slot is empty, or its file is not there.
    pub fn file(&self, kind: SlotKind, slot: u32) -> Result<PathBuf, LoadError> {
        self.file_among(&library::folders(), kind, slot)
    }

    fn file_among(&self, folders: &[PathBuf], kind: SlotKind, slot: u32) -> Result<PathBuf, LoadError> {
        let (slots, files) = self.followed(kind, folders);
        let number = usize::try_from(slot).unwrap_or(usize::MAX);
        slots.file(number, paths(&files)).map(|file| files[file].clone()).ok_or_else(|| match slots.name(number) {
            Some(name) => Fault::new(format!("library slot {slot}: {name} is in none of {folders:?}")).into(),
            None => LoadError::NoneChosen(format!(
                "library slot {slot} is empty: the folders {folders:?} hold {} files of that kind",
                files.len()
            )),
        })
    }

    /// The slot of a file of the library. Reads its folders.
    pub fn slot_of(&self, kind: SlotKind, file: &Path) -> Option<usize> {
        let (slots, files) = self.followed(kind, &library::folders());
        slots.slot(files.iter().position(|other| other == file)?, paths(&files))
    }

    /// A slot as text: the name of its file, or its number where it is empty.
    pub fn text(&self, kind: SlotKind, slot: i32) -> String {
        let texts = self.texts(kind);
        usize::try_from(slot).ok().and_then(|slot| texts.get(slot).cloned()).unwrap_or_else(|| slot.to_string())
    }

    /// The slot of a text: a name, or a number.
    pub fn slot_named(&self, kind: SlotKind, text: &str) -> Option<i32> {
        let text = text.trim();
        let named = self.texts(kind).iter().position(|known| known.eq_ignore_ascii_case(text));
        let named = named.and_then(|slot| i32::try_from(slot).ok());
        named.or_else(|| text.parse().ok().filter(|slot| (0..=i32::from(SLOTS)).contains(slot)))
    }

    fn texts(&self, kind: SlotKind) -> Arc<Vec<String>> {
        let known = &mut lock(&self.0.texts)[kind as usize];
        let saved = self.saved();
        match known {
            Some((made, of, texts)) if made.elapsed() < KEPT && *of == saved => Arc::clone(texts),
            _ => {
                let own = match kind {
                    SlotKind::Scene => "Project's scene",
                    SlotKind::Walk => "Project's path",
                };
                let texts = Arc::new(self.followed(kind, &library::folders()).0.texts(own));
                *known = Some((Instant::now(), self.saved(), Arc::clone(&texts)));
                texts
            }
        }
    }
}

fn extensions(kind: SlotKind) -> &'static [&'static str] {
    match kind {
        SlotKind::Scene => library::SCENES,
        SlotKind::Walk => library::WALKS,
    }
}

impl PersistentField<'_, SavedSlots> for ProjectSlots {
    fn set(&self, saved: SavedSlots) {
        self.0.saved.restore(saved);
    }

    fn map<F: Fn(&SavedSlots) -> R, R>(&self, done: F) -> R {
        self.0.saved.map(done)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_empty_slot_is_none_and_one_whose_file_has_gone_is_a_fault() {
        let kept = tempfile::tempdir().unwrap();
        let folders = [kept.path().to_owned()];
        let [a, b] = ["a.promenade", "b.promenade"].map(|name| folders[0].join(name));
        std::fs::write(&b, b"b").unwrap();
        let slots = ProjectSlots::default();
        let file = |slot| slots.file_among(&folders, SlotKind::Scene, slot);
        assert_eq!(file(1).unwrap(), b);
        std::fs::write(&a, b"a").unwrap();
        assert_eq!((file(1).unwrap(), file(2).unwrap()), (b.clone(), a));
        for slot in [0, 3, u32::MAX] {
            let Err(LoadError::NoneChosen(why)) = file(slot) else { panic!("slot {slot} is filled") };
            assert!(why.contains("hold 2 files"), "{why}");
        }
        std::fs::remove_file(b).unwrap();
        let Err(LoadError::Fault(why)) = file(1) else { panic!("slot 1 is found") };
        assert!(why.to_string().contains("b.promenade is in none of"), "{why}");
    }

    #[test]
    fn a_slot_is_set_by_its_number_as_well() {
        let slots = ProjectSlots::default();
        let slot = |kind, text: &str| slots.slot_named(kind, text);
        assert_eq!((slot(SlotKind::Scene, "64"), slot(SlotKind::Scene, " 0 ")), (Some(64), Some(0)));
        assert_eq!((slot(SlotKind::Walk, "65"), slot(SlotKind::Walk, "-1"), slot(SlotKind::Walk, "")), (None, None, None));
        for number in 0..=i32::from(SLOTS) {
            assert_eq!(slot(SlotKind::Scene, &slots.text(SlotKind::Scene, number)), Some(number));
        }
    }
}
