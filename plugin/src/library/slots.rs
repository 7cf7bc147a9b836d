//! The library's files that the slots of a project stand for.

use crate::parameter::row::SLOTS;
use serde::{Deserialize, Serialize};
use std::collections::HashSet;
use std::path::Path;

/// Names of files, slot 1 first: those that there were when the project began in order, and behind them what came later. A
/// name that is there twice stands for the files of that name, folder by folder.
///
/// A place without a name is free. A name without an ending, from a state that knew no other, is that of a file with any.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Slots(Vec<String>);

/// The name of a file.
fn name_of(file: &Path) -> String {
    file.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// A name without its ending.
fn stem_of(name: &str) -> &str {
    name.rsplit_once('.').map_or(name, |(stem, _)| stem)
}

impl Slots {
    /// A list with one name, in a slot from 1 to [`SLOTS`], with free places before it.
    pub fn with(slot: u32, name: &str) -> Self {
        let place = usize::try_from(slot).ok().filter(|slot| (1..=usize::from(SLOTS)).contains(slot));
        Self(place.filter(|_| !name.is_empty()).map_or_else(Vec::new, |place| {
            let mut names = vec![String::new(); place];
            name.clone_into(&mut names[place - 1]);
            names
        }))
    }

    /// Gives files of the library that have none a slot, as long as there are any; says whether one did not have one.
    pub fn follow<'a>(&mut self, files: impl Iterator<Item = &'a Path>) -> bool {
        let before = self.clone();
        let mut taken = vec![false; self.0.len()];
        for name in files.map(name_of) {
            let place = |wanted: &str| (0..self.0.len()).find(|place| !taken[*place] && self.0[*place] == wanted);
            let place = place(&name).or_else(|| place(stem_of(&name))).or_else(|| place("")).unwrap_or(self.0.len());
            if place == usize::from(SLOTS) {
                continue;
            }
            self.0.resize(self.0.len().max(place + 1), String::new());
            taken.resize(self.0.len(), false);
            (self.0[place], taken[place]) = (name, true);
        }
        *self != before
    }

    /// The name of the file in a slot, whether it is there or not.
    pub fn name(&self, slot: usize) -> Option<&str> {
        self.0.get(slot.checked_sub(1)?).map(String::as_str).filter(|name| !name.is_empty())
    }

    /// The file in a slot, by its number among the library's.
    pub fn file<'a>(&self, slot: usize, files: impl Iterator<Item = &'a Path>) -> Option<usize> {
        let name = self.name(slot)?;
        let before = self.0[..slot - 1].iter().filter(|other| *other == name).count();
        files.enumerate().filter(|(_, file)| name_of(file) == name).nth(before).map(|(number, _)| number)
    }

    /// The slot of a file among the library's, by its number.
    pub fn slot<'a>(&self, number: usize, files: impl Iterator<Item = &'a Path> + Clone) -> Option<usize> {
        (1..=self.0.len()).find(|slot| self.file(*slot, files.clone()) == Some(number))
    }

    /// A slot as text: the name of its file without the ending.
    pub fn text(&self, slot: usize) -> String {
        self.name(slot).map_or_else(|| format!("Empty slot {slot}"), |name| stem_of(name).to_owned())
    }

    /// Texts of all slots, 0 first, which is the project's own; no two are the same.
    pub fn texts(&self, own: &str) -> Vec<String> {
        let mut seen = HashSet::from([own.to_lowercase()]);
        let numbered = (1..=usize::from(SLOTS)).map(|slot| {
            let text = self.text(slot);
            if seen.insert(text.to_lowercase()) { text } else { format!("{text} (slot {slot})") }
        });
        std::iter::once(own.to_owned()).chain(numbered).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paths<'a>(names: &'a [&'a str]) -> impl Iterator<Item = &'a Path> + Clone {
        names.iter().map(|name| Path::new(*name))
    }

    fn slots_of(names: &[&str]) -> Slots {
        let mut slots = Slots::default();
        slots.follow(paths(names));
        slots
    }

    #[test]
    fn slots_have_names_of_their_own() {
        let texts = slots_of(&["hall.csv", "Hall.csv", "project's scene.csv", "2.csv"]).texts("Project's scene");
        assert_eq!(texts.len(), 1 + usize::from(SLOTS));
        let expected = ["Project's scene", "hall", "Hall (slot 2)", "project's scene (slot 3)", "2", "Empty slot 5"];
        assert_eq!(texts[..6], expected);
    }

    #[test]
    fn a_file_keeps_its_slot_whatever_comes_and_goes() {
        let mut slots = slots_of(&["/x/b.csv", "/x/c.csv"]);
        let grown = ["/x/a.csv", "/x/b.csv", "/x/c.csv", "/y/b.csv"];
        assert!(slots.follow(paths(&grown)) && !slots.follow(paths(&grown)));
        assert_eq!([1, 2, 3, 4, 5].map(|slot| slots.file(slot, paths(&grown))), [Some(1), Some(2), Some(0), Some(3), None]);
        assert_eq!([0, 1, 2, 3].map(|number| slots.slot(number, paths(&grown))), [Some(3), Some(1), Some(2), Some(4)]);
        let left = ["/x/a.csv", "/x/c.csv"];
        assert!(!slots.follow(paths(&left)));
        assert_eq!((slots.file(1, paths(&left)), slots.name(1)), (None, Some("b.csv")));
        assert_eq!(slots.file(2, paths(&left)), Some(1));
    }

    #[test]
    fn a_name_from_an_older_project_has_its_slot() {
        for name in ["c.csv", "c"] {
            let mut slots = Slots::with(2, name);
            slots.follow(paths(&["a.csv", "b.csv", "c.csv"]));
            assert_eq!([1, 2, 3].map(|slot| slots.name(slot)), [Some("a.csv"), Some("c.csv"), Some("b.csv")]);
        }
        assert_eq!((Slots::with(0, "c"), Slots::with(65, "c"), Slots::with(3, "")), Default::default());
    }

    #[test]
    fn there_are_so_many_slots_and_no_more() {
        let names = (0..100).map(|number| format!("{number:03}.csv")).collect::<Vec<_>>();
        let slots = slots_of(&names.iter().map(String::as_str).collect::<Vec<_>>());
        assert_eq!((slots.name(64), slots.name(65)), (Some("063.csv"), None));
    }
}
