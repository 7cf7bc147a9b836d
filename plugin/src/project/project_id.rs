//! Which project an instance belongs to: groups of two projects in one process have nothing to do with each other.
//!
//! No host tells a plugin its project. What is restored brings the id with it, and a new instance has that of the project that
//! was last restored or looked at.

use nice_plug::params::persist::PersistentField;
use std::collections::hash_map::RandomState;
use std::hash::BuildHasher;
use std::sync::atomic::{AtomicU64, Ordering};

/// The id of the project that was last restored or looked at; 0 before there is one.
static CURRENT: AtomicU64 = AtomicU64::new(0);
/// Bits that are free for the number of a group.
const FREE: u64 = 7;

/// The id of an instance's project; presets leave it as it is.
pub struct ProjectId(AtomicU64);

impl Default for ProjectId {
    fn default() -> Self {
        let fresh = RandomState::new().hash_one(0) & !FREE | (FREE + 1);
        let current = CURRENT.compare_exchange(0, fresh, Ordering::AcqRel, Ordering::Acquire);
        Self(AtomicU64::new(current.err().unwrap_or(fresh)))
    }
}

impl ProjectId {
    /// The key of a group of the project in the process, never 0.
    ///
    /// # Real-time
    /// Any thread; no allocation, lock or I/O.
    pub fn group(&self, number: usize) -> u64 {
        self.0.load(Ordering::Acquire) | (number as u64 + 1) & FREE
    }

    /// The user looks at the project: new instances are taken to be its own.
    pub fn look_at(&self) {
        CURRENT.store(self.0.load(Ordering::Acquire), Ordering::Release);
    }
}

impl PersistentField<'_, String> for ProjectId {
    /// What is no id changes nothing.
    fn set(&self, saved: String) {
        if let Some(id) = u64::from_str_radix(&saved, 16).ok().map(|id| id & !FREE).filter(|id| *id != 0) {
            self.0.store(id, Ordering::Release);
            self.look_at();
        }
    }

    fn map<F: Fn(&String) -> R, R>(&self, done: F) -> R {
        done(&format!("{:016x}", self.0.load(Ordering::Acquire)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_project_is_found_again_and_another_has_other_groups() {
        let (here, there) = (ProjectId::default(), ProjectId::default());
        there.set("00000000000004f8".to_owned());
        assert_eq!(there.map(String::clone), "00000000000004f8");
        let keys = [here.group(0), here.group(3), there.group(0), there.group(3)];
        assert!((0..4).all(|a| (0..a).all(|b| keys[a] != keys[b])), "{keys:x?}");
        there.set("nonsense".to_owned());
        assert_eq!(there.group(0), 0x4f9);
        assert_eq!(ProjectId::default().group(0), 0x4f9, "a new instance belongs to the project that was opened last");
    }
}
