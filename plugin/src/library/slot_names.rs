//! Slots of the library by the names of their files, for hosts that show parameters as text.

use crate::library;
use crate::parameter::row::{SLOTS, SlotKind};
use crate::worker::lock::lock;
use std::collections::HashSet;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// The folders are looked through again after this; hosts ask for the text of every point of automation.
const KEPT: Duration = Duration::from_secs(2);

/// Texts of one kind of slot with when they were made.
type Known = Option<(Instant, Arc<Vec<String>>)>;

/// The texts of scenes and of paths.
static KNOWN: Mutex<[Known; 2]> = Mutex::new([None, None]);

/// A slot as text: the name of its file, or its number where it is empty.
#[must_use]
pub fn text(kind: SlotKind, slot: i32) -> String {
    let texts = texts(kind);
    usize::try_from(slot).ok().and_then(|slot| texts.get(slot).cloned()).unwrap_or_else(|| slot.to_string())
}

/// The slot of a text: a name, or a number.
#[must_use]
pub fn slot(kind: SlotKind, text: &str) -> Option<i32> {
    let text = text.trim();
    let named = texts(kind).iter().position(|known| known.eq_ignore_ascii_case(text)).and_then(|slot| i32::try_from(slot).ok());
    named.or_else(|| text.parse().ok().filter(|slot| (0..=i32::from(SLOTS)).contains(slot)))
}

fn texts(kind: SlotKind) -> Arc<Vec<String>> {
    let mut known = lock(&KNOWN);
    let known = &mut known[kind as usize];
    match known {
        Some((made, texts)) if made.elapsed() < KEPT => Arc::clone(texts),
        _ => {
            let (extensions, own) = match kind {
                SlotKind::Scene => (library::SCENES, "Project's scene"),
                SlotKind::Walk => (library::WALKS, "Project's path"),
            };
            let files = library::files(&library::folders(), extensions);
            let texts = Arc::new(texts_of(files.iter().map(|file| stem(file)), own));
            *known = Some((Instant::now(), Arc::clone(&texts)));
            texts
        }
    }
}

fn stem(file: &Path) -> String {
    file.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// The texts of all slots, no two the same.
fn texts_of(names: impl Iterator<Item = String>, own: &str) -> Vec<String> {
    let mut names = names.fuse();
    let mut seen = HashSet::from([own.to_lowercase()]);
    let numbered = (1..=SLOTS).map(|slot| match names.next() {
        Some(name) if seen.insert(name.to_lowercase()) => name,
        Some(name) => format!("{name} (slot {slot})"),
        None => format!("Empty slot {slot}"),
    });
    std::iter::once(own.to_owned()).chain(numbered).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slots_have_names_of_their_own() {
        let names = ["hall", "Hall", "project's scene", "2"].map(str::to_owned);
        let texts = texts_of(names.into_iter(), "Project's scene");
        assert_eq!(texts.len(), 1 + usize::from(SLOTS));
        let expected = ["Project's scene", "hall", "Hall (slot 2)", "project's scene (slot 3)", "2", "Empty slot 5"];
        assert_eq!(texts[..6], expected);
    }

    #[test]
    fn a_slot_is_set_by_its_number_as_well() {
        assert_eq!((slot(SlotKind::Scene, "64"), slot(SlotKind::Scene, " 0 ")), (Some(64), Some(0)));
        assert_eq!((slot(SlotKind::Walk, "65"), slot(SlotKind::Walk, "-1"), slot(SlotKind::Walk, "")), (None, None, None));
        for number in 0..=i32::from(SLOTS) {
            assert_eq!(slot(SlotKind::Scene, &text(SlotKind::Scene, number)), Some(number));
        }
    }
}
