//! Values that a host saves with the project beside the parameters, and reports that it does not save.

use nice_plug::params::persist::PersistentField;
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, OnceLock, PoisonError, RwLock};

/// A value that the host saves with the project. It counts how often the host has restored it, and calls a hook each time.
///
/// The audio thread never touches the value.
#[derive(Default)]
pub struct Persisted<T> {
    value: RwLock<T>,
    restores: AtomicU64,
    changes: AtomicU32,
    on_restore: OnceLock<Box<dyn Fn() + Send + Sync>>,
}

impl<T: Default> Persisted<T> {
    /// A value that no host has restored yet.
    pub fn new(value: T) -> Self {
        Self { value: RwLock::new(value), ..Self::default() }
    }
}

impl<T: Clone> Persisted<T> {
    /// The value, and the number of times a host has restored it.
    pub fn get(&self) -> (T, u64) {
        let value = self.value.read().unwrap_or_else(PoisonError::into_inner);
        (value.clone(), self.restores())
    }

    /// Replaces the value, unless the host has restored it since [`Persisted::get`] returned `restores`. Returns whether it was
    /// replaced.
    pub fn replace(&self, value: T, restores: u64) -> bool {
        let mut held = self.value.write().unwrap_or_else(PoisonError::into_inner);
        let current = self.restores.load(Ordering::Acquire) == restores;
        if current {
            *held = value;
            self.changes.fetch_add(1, Ordering::AcqRel);
        }
        current
    }

    /// Replaces the value, also for threads that are about to replace the old one, without the hook.
    pub fn supersede(&self, value: T) {
        let mut held = self.value.write().unwrap_or_else(PoisonError::into_inner);
        *held = value;
        self.restores.fetch_add(1, Ordering::AcqRel);
        self.changes.fetch_add(1, Ordering::AcqRel);
    }

    /// Replaces the value as when the host restores it: the hook is called.
    pub fn restore(&self, value: T) {
        self.supersede(value);
        if let Some(hook) = self.on_restore.get() {
            hook();
        }
    }

    /// Has `owner` act after each restore, on the host's thread, while it is there; only the first owner is kept.
    pub fn on_restore<O: Send + Sync + 'static>(&self, owner: &Arc<O>, act: fn(&O)) {
        let owner = Arc::downgrade(owner);
        let hook = move || {
            if let Some(owner) = owner.upgrade() {
                act(&owner);
            }
        };
        // A second hook would mean two owners of one instance, which the constructor rules out.
        drop(self.on_restore.set(Box::new(hook)));
    }
}

impl<T> Persisted<T> {
    /// How often a host has restored the value.
    pub fn restores(&self) -> u64 {
        self.restores.load(Ordering::Acquire)
    }

    /// How often the value has been replaced or restored.
    ///
    /// # Real-time
    /// Any thread; no allocation, lock or I/O.
    pub fn changes(&self) -> u32 {
        self.changes.load(Ordering::Acquire)
    }
}

impl<'a, T> PersistentField<'a, T> for Persisted<T>
where
    T: Clone + Serialize + Deserialize<'a> + Send + Sync,
{
    fn set(&self, new_value: T) {
        self.restore(new_value);
    }

    fn map<F: Fn(&T) -> R, R>(&self, f: F) -> R {
        f(&self.value.read().unwrap_or_else(PoisonError::into_inner))
    }
}

/// What went wrong or looks odd, as a message for the user. It is not saved: it names folders of this machine.
#[derive(Default)]
pub struct Report(RwLock<String>);

impl Report {
    /// Replaces the text; empty when all is well.
    pub fn set_text(&self, text: String) {
        *self.0.write().unwrap_or_else(PoisonError::into_inner) = text;
    }

    /// The text.
    pub fn text(&self) -> String {
        self.0.read().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_restore_wins_over_a_replacement_that_began_before_it() {
        let persisted = Persisted::<String>::default();
        let (_, restores) = persisted.get();
        PersistentField::set(&persisted, "restored".to_owned());
        assert!(!persisted.replace("late".to_owned(), restores));
        assert_eq!(persisted.get().0, "restored");
    }

    #[test]
    fn what_supersedes_wins_over_a_replacement_that_began_before_it() {
        let persisted = Persisted::<String>::default();
        let (_, restores) = persisted.get();
        persisted.supersede("newer".to_owned());
        assert!(!persisted.replace("written back".to_owned(), restores));
        assert_eq!(persisted.get().0, "newer");
    }
}
