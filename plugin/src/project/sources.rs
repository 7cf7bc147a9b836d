//! What a project says of its sources besides their places: names, colours, and which of them are heard.

use crate::parameter::source_knob::MOST_INPUTS;
use crate::project::persisted::Persisted;
use nice_plug::params::persist::PersistentField;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};

/// Characters of a name, at most.
pub const LONGEST_NAME: usize = 40;

/// What is said of a source.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct SourceInfo {
    /// Its name; empty for its number.
    pub name: String,
    /// Its colour, red, green and blue.
    pub colour: Option<[u8; 3]>,
    /// Whether it is silent.
    pub mute: bool,
    /// Whether it is heard alone, with others that are.
    pub solo: bool,
}

/// By the sources' numbers, 1 for the first; those of which nothing is said are left out.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct SavedSources(BTreeMap<usize, SourceInfo>);

impl SavedSources {
    /// What is said of a source, 0 for the first.
    pub fn of(&self, source: usize) -> SourceInfo {
        self.0.get(&(source + 1)).cloned().unwrap_or_default()
    }

    /// The name of a source, 0 for the first.
    pub fn name(&self, source: usize) -> String {
        let known = self.0.get(&(source + 1)).map(|info| info.name.trim()).filter(|name| !name.is_empty());
        known.map_or_else(|| format!("Source {}", source + 1), |name| name.chars().take(LONGEST_NAME).collect())
    }

    /// Changes what is said of a source, 0 for the first.
    pub fn change(&mut self, source: usize, change: impl FnOnce(&mut SourceInfo)) {
        let info = self.0.entry(source + 1).or_default();
        change(info);
        if *info == SourceInfo::default() {
            self.0.remove(&(source + 1));
        }
    }

    /// A bit for each source that is not heard, that of the first the lowest: muted, or not soloed where another is.
    pub fn silent(&self) -> u64 {
        let bits = |of: fn(&SourceInfo) -> bool| {
            let those = self.0.iter().filter(|(number, info)| (1..=MOST_INPUTS).contains(number) && of(info));
            those.fold(0, |bits, (number, _)| bits | 1_u64 << (number - 1))
        };
        let soloed = bits(|info| info.solo);
        bits(|info| info.mute) | if soloed == 0 { 0 } else { !soloed }
    }
}

/// The sources of an instance's project.
#[derive(Default)]
pub struct ProjectSources {
    /// As they are saved; whoever changes them calls [`ProjectSources::follow`].
    pub saved: Persisted<SavedSources>,
    silent: AtomicU64,
}

impl ProjectSources {
    /// Has the audio thread hear what is saved.
    pub fn follow(&self) {
        self.silent.store(self.saved.get().0.silent(), Ordering::Release);
    }

    /// Whether a source, 0 for the first, is heard.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn is_heard(&self, source: usize) -> bool {
        self.silent.load(Ordering::Acquire) >> source & 1 == 0
    }
}

impl PersistentField<'_, SavedSources> for ProjectSources {
    fn set(&self, saved: SavedSources) {
        self.saved.restore(saved);
        self.follow();
    }

    fn map<F: Fn(&SavedSources) -> R, R>(&self, done: F) -> R {
        self.saved.map(done)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_solo_silences_the_others_and_a_mute_itself() {
        let mut sources = SavedSources::default();
        assert_eq!((sources.silent(), sources.name(2)), (0, "Source 3".to_owned()));
        sources.change(2, |info| info.mute = true);
        assert_eq!(sources.silent(), 0b100);
        sources.change(2, |info| (info.solo, info.name) = (true, "Voice".to_owned()));
        sources.change(63, |info| info.solo = true);
        assert_eq!((sources.silent(), sources.name(2)), (!(1 << 63), "Voice".to_owned()), "a mute wins over its own solo");
        let json = serde_json::to_string(&sources).unwrap();
        assert_eq!(serde_json::from_str::<SavedSources>(&json).unwrap(), sources);
        sources.change(2, |info| *info = SourceInfo::default());
        sources.change(63, |info| info.solo = false);
        assert_eq!(sources, SavedSources::default());
    }
}
