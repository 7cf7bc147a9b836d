//! Parameter values that have come over Open Sound Control.
//!
//! A plugin can report a new value to its host only through an open editor. Until then a remote value overrides the host's, and
//! gives way as soon as the host's own value changes: what came last is heard.

use crate::parameter::Parameter;
use nice_plug::params::persist::PersistentField;
use std::collections::BTreeMap;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

/// No remote value: a word that no pair of finite numbers has.
const NONE: u64 = u64::MAX;

/// No value was announced to the host: the bits of no finite number.
const UNANNOUNCED: u32 = u32::MAX;

/// A remote value of one parameter.
struct Override {
    /// The value, and the host's that it overrides.
    word: AtomicU64,
    /// The value that was announced to the host, on its way or arrived: when the host's becomes this one, the user has not
    /// moved the parameter.
    announced: AtomicU32,
}

/// The host's value of a parameter.
type Hosted = Box<dyn Fn(Parameter) -> f32 + Send + Sync>;

/// The remote values of all parameters.
///
/// A project keeps those that are heard and the host does not know of, by id; [`crate::project::state::migrate`] makes them the
/// host's own. A state that is restored replaces all that has come before.
pub struct Remote {
    values: [Override; Parameter::EVERY.len()],
    hosted: OnceLock<Hosted>,
    /// How often a host has restored a state.
    restores: AtomicU64,
}

impl Default for Remote {
    fn default() -> Self {
        let none = |_| Override { word: AtomicU64::new(NONE), announced: AtomicU32::new(UNANNOUNCED) };
        Self { values: std::array::from_fn(none), hosted: OnceLock::new(), restores: AtomicU64::new(0) }
    }
}

impl PersistentField<'_, BTreeMap<String, f32>> for Remote {
    fn set(&self, _restored: BTreeMap<String, f32>) {
        // First, so that what changes now is known to come with a state.
        self.restores.fetch_add(1, Ordering::AcqRel);
        Parameter::EVERY.into_iter().for_each(|parameter| self.clear(parameter));
    }

    fn map<F: Fn(&BTreeMap<String, f32>) -> R, R>(&self, f: F) -> R {
        let pending = |parameter: Parameter| {
            // Parameters that the instance has not got have none either.
            if self.values[parameter.number()].word.load(Ordering::Acquire) == NONE {
                return None;
            }
            let value = self.pending(parameter, self.hosted.get()?(parameter))?;
            Some((parameter.id().to_owned(), value))
        };
        f(&Parameter::EVERY.into_iter().filter_map(pending).collect())
    }
}

impl Remote {
    /// Asks `hosted` for the host's plain values when a project is saved; only the first is kept.
    pub fn save_beside(&self, hosted: impl Fn(Parameter) -> f32 + Send + Sync + 'static) {
        // A second one would mean two hosts of one instance, which the constructor rules out.
        drop(self.hosted.set(Box::new(hosted)));
    }

    /// How often a host has restored a state.
    pub fn restores(&self) -> u64 {
        self.restores.load(Ordering::Acquire)
    }

    /// Sets a plain value, while the host's is `hosted`. A value that is not finite is ignored.
    ///
    /// # Real-time
    /// Any thread; no allocation, lock or I/O.
    pub fn set(&self, parameter: Parameter, value: f32, hosted: f32) {
        if value.is_finite() {
            let word = u64::from(value.to_bits()) << 32 | u64::from(hosted.to_bits());
            self.values[parameter.number()].word.store(word, Ordering::Release);
        }
    }

    /// The remote value if the host's has not changed since it came, else the host's.
    ///
    /// # Real-time
    /// Any thread; no allocation, lock or I/O.
    pub fn latest(&self, parameter: Parameter, hosted: f32) -> f32 {
        self.pending(parameter, hosted).unwrap_or(hosted)
    }

    /// The remote value that the host does not know of, if there is one.
    ///
    /// # Real-time
    /// Any thread; no allocation, lock or I/O.
    pub fn pending(&self, parameter: Parameter, hosted: f32) -> Option<f32> {
        let held = &self.values[parameter.number()];
        let word = held.word.load(Ordering::Acquire);
        #[expect(clippy::cast_possible_truncation, reason = "the two halves of a word")]
        let (value, overridden) = (f32::from_bits((word >> 32) as u32), word as u32);
        if word == NONE {
            None
        } else if overridden == hosted.to_bits() || held.announced.load(Ordering::Acquire) == hosted.to_bits() {
            Some(value).filter(|value| value.to_bits() != hosted.to_bits())
        } else {
            // A newer remote value that comes at this moment stays.
            let _newer = held.word.compare_exchange(word, NONE, Ordering::AcqRel, Ordering::Relaxed);
            None
        }
    }

    /// Notes that a value is announced to the host, as the host will have it. A remote value that comes before the host has it
    /// stays in force.
    pub fn announce(&self, parameter: Parameter, announced: f32) {
        self.values[parameter.number()].announced.store(announced.to_bits(), Ordering::Release);
    }

    /// Forgets a remote value, because the user has set another.
    pub fn clear(&self, parameter: Parameter) {
        let held = &self.values[parameter.number()];
        held.announced.store(UNANNOUNCED, Ordering::Release);
        held.word.store(NONE, Ordering::Release);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_came_last_is_heard() {
        let remote = Remote::default();
        assert_eq!(remote.latest(Parameter::Yaw, 10.0), 10.0);
        remote.set(Parameter::Yaw, -30.0, 10.0);
        assert_eq!(remote.latest(Parameter::Yaw, 10.0), -30.0);
        assert_eq!(remote.latest(Parameter::Yaw, 11.0), 11.0, "the host moved the parameter");
        assert_eq!(remote.latest(Parameter::Yaw, 10.0), 10.0, "and moved it back");
        remote.set(Parameter::Yaw, f32::NAN, 10.0);
        assert_eq!(remote.latest(Parameter::Yaw, 10.0), 10.0);
    }

    #[test]
    fn a_value_that_comes_while_another_is_announced_is_heard() {
        let remote = Remote::default();
        remote.set(Parameter::Yaw, 20.0, 10.0);
        remote.announce(Parameter::Yaw, 20.0);
        remote.set(Parameter::Yaw, 30.0, 10.0);
        assert_eq!(remote.latest(Parameter::Yaw, 20.0), 30.0, "the host has the first");
        remote.announce(Parameter::Yaw, 30.0);
        assert_eq!(remote.pending(Parameter::Yaw, 30.0), None, "the host has both");
        assert_eq!(remote.latest(Parameter::Yaw, 5.0), 5.0, "the host moved the parameter");
        assert_eq!(remote.latest(Parameter::Yaw, 30.0), 30.0);
        remote.set(Parameter::Yaw, 50.0, 30.0);
        remote.clear(Parameter::Yaw);
        assert_eq!(remote.latest(Parameter::Yaw, 30.0), 30.0, "the user moved it in the editor");
    }
}
