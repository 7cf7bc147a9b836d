//! Paths of an instance's sources, as projects keep them and as they are played.

use super::walk::{SavedWalk, Walk};
use promenade_fault::Fault;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The saved paths of sources by the sources' numbers, 1 for the first; those without one are left out. Copies share one
/// content.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(from = "BTreeMap<usize, SavedWalk>", into = "BTreeMap<usize, SavedWalk>")]
pub struct SavedSourceWalks(Arc<BTreeMap<usize, SavedWalk>>);

/// Paths that are ready for the audio thread: that of the first source, then those of further ones; none for sources that stay.
pub type SourceWalks = Arc<[Option<Walk>]>;

impl From<BTreeMap<usize, SavedWalk>> for SavedSourceWalks {
    fn from(walks: BTreeMap<usize, SavedWalk>) -> Self {
        Self(Arc::new(walks))
    }
}

impl From<SavedSourceWalks> for BTreeMap<usize, SavedWalk> {
    fn from(walks: SavedSourceWalks) -> Self {
        Arc::unwrap_or_clone(walks.0)
    }
}

impl PartialEq for SavedSourceWalks {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0) || self.0 == other.0
    }
}

impl SavedSourceWalks {
    /// The path of a source, 0 for the first.
    pub fn of(&self, source: usize) -> Option<&SavedWalk> {
        self.0.get(&(source + 1))
    }

    /// Gives a source, 0 for the first, a path, or takes it away.
    pub fn set(&mut self, source: usize, walk: Option<SavedWalk>) {
        let walks = Arc::make_mut(&mut self.0);
        match walk {
            Some(walk) => drop(walks.insert(source + 1, walk)),
            None => drop(walks.remove(&(source + 1))),
        }
    }

    /// The paths of the first `count` sources, and what is wrong with those that make none.
    pub fn to_walks(&self, count: usize) -> (SourceWalks, Vec<(usize, Fault)>) {
        let mut wrong = Vec::new();
        let last = self.0.range(..=count).next_back().map_or(0, |(number, _)| *number);
        let walk = |source| {
            let made = self.of(source)?.to_walk();
            made.unwrap_or_else(|error| {
                wrong.push((source + 1, error));
                None
            })
        };
        let walks = (0..last).map(walk).collect();
        (walks, wrong)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_core::{Keyframe, Pose};

    #[test]
    fn sources_are_counted_from_one_and_come_back() {
        let mut walks = SavedSourceWalks::default();
        assert_eq!(serde_json::to_string(&walks).unwrap(), "{}");
        let before = walks.clone();
        let still = SavedWalk::of(&[Keyframe { t_s: 0.0, pose: Pose::IDENTITY }]);
        walks.set(2, Some(SavedWalk { name: "voice".to_owned(), ..still }));
        assert!(before.of(2).is_none() && before != walks, "a copy stays as it was");
        let json = serde_json::to_string(&walks).unwrap();
        assert!(json.starts_with(r#"{"3":{"keyframes":[{"#) && json.contains(r#""name":"voice""#), "{json}");
        assert_eq!(serde_json::from_str::<SavedSourceWalks>(&json).unwrap(), walks);
        let (ready, wrong) = walks.to_walks(16);
        assert!(wrong.is_empty() && ready.len() == 3 && ready[0].is_none() && ready[2].is_some());
        assert!(walks.to_walks(2).0.is_empty(), "the instance has no third source");
        walks.set(2, None);
        assert_eq!(walks, before);
    }

    #[test]
    fn what_makes_no_path_is_told_by_its_source_and_the_others_play() {
        let mut walks = SavedSourceWalks::default();
        let good = SavedWalk::of(&[Keyframe { t_s: 0.0, pose: Pose::IDENTITY }]);
        walks.set(0, Some(SavedWalk { speed: f64::NAN, ..good.clone() }));
        walks.set(1, Some(good));
        let (ready, wrong) = walks.to_walks(2);
        assert!(ready[0].is_none() && ready[1].is_some());
        assert!(matches!(&wrong[..], [(1, error)] if error.to_string().contains("speed")), "{wrong:?}");
    }
}
