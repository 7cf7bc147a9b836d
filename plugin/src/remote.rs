//! Parameter values that have come over Open Sound Control.
//!
//! A plugin can tell its host of a new value only through an open editor. Until then a remote value stands in place of the host's, and
//! gives way as soon as the host's own value changes: what came last is heard.

use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

/// A parameter that hosts and remote controls can set. The order is that of `docs/parameters.md`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Knob {
    /// `x`, metres.
    X,
    /// `y`, metres.
    Y,
    /// `z`, metres.
    Z,
    /// `yaw`, degrees.
    Yaw,
    /// `pitch`, degrees.
    Pitch,
    /// `roll`, degrees.
    Roll,
    /// `path`, share of 1.
    Path,
    /// `follow`, index.
    Follow,
    /// `offset`, 0 or 1.
    Offset,
    /// `tracking`, index.
    Tracking,
    /// `ex`, metres.
    Ex,
    /// `ey`, metres.
    Ey,
    /// `ez`, metres.
    Ez,
    /// `group`, index.
    Group,
    /// `lead`, 0 or 1.
    Lead,
    /// `tier`, index.
    Tier,
    /// `rate`, hertz.
    Rate,
    /// `mix`, share of 1.
    Mix,
    /// `gain`, dB.
    Gain,
    /// `bypass`, 0 or 1.
    Bypass,
    /// `scene`, index.
    Scene,
    /// `slot`, number.
    Slot,
    /// `walk`, number.
    Walk,
}

impl Knob {
    /// All of them.
    pub const ALL: [Self; 23] = [
        Self::X,
        Self::Y,
        Self::Z,
        Self::Yaw,
        Self::Pitch,
        Self::Roll,
        Self::Path,
        Self::Follow,
        Self::Offset,
        Self::Tracking,
        Self::Ex,
        Self::Ey,
        Self::Ez,
        Self::Group,
        Self::Lead,
        Self::Tier,
        Self::Rate,
        Self::Mix,
        Self::Gain,
        Self::Bypass,
        Self::Scene,
        Self::Slot,
        Self::Walk,
    ];

    /// The parameter's id.
    #[must_use]
    pub fn id(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
            Self::Yaw => "yaw",
            Self::Pitch => "pitch",
            Self::Roll => "roll",
            Self::Path => "path",
            Self::Follow => "follow",
            Self::Offset => "offset",
            Self::Tracking => "tracking",
            Self::Ex => "ex",
            Self::Ey => "ey",
            Self::Ez => "ez",
            Self::Group => "group",
            Self::Lead => "lead",
            Self::Tier => "tier",
            Self::Rate => "rate",
            Self::Mix => "mix",
            Self::Gain => "gain",
            Self::Bypass => "bypass",
            Self::Scene => "scene",
            Self::Slot => "slot",
            Self::Walk => "walk",
        }
    }

    /// The parameter of that id.
    #[must_use]
    pub fn of_id(id: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|knob| knob.id() == id)
    }

    /// Whether its values are whole numbers.
    #[must_use]
    pub fn is_whole(self) -> bool {
        !matches!(
            self,
            Self::X
                | Self::Y
                | Self::Z
                | Self::Yaw
                | Self::Pitch
                | Self::Roll
                | Self::Path
                | Self::Ex
                | Self::Ey
                | Self::Ez
                | Self::Rate
                | Self::Mix
                | Self::Gain
        )
    }
}

/// No remote value: a word that no pair of finite numbers has.
const NONE: u64 = u64::MAX;

/// No value that the host was told: the bits of no finite number.
const UNTOLD: u32 = u32::MAX;

/// A remote value.
struct Place {
    /// The value, and the host's that it stands in for.
    word: AtomicU64,
    /// The value that the host was told of, on its way or arrived: when the host's becomes that one, the host has not moved its knob.
    told: AtomicU32,
}

/// One value per parameter, next to the host's value that it stands in for.
pub struct Remote([Place; Knob::ALL.len()]);

impl Default for Remote {
    fn default() -> Self {
        Self(std::array::from_fn(|_| Place { word: AtomicU64::new(NONE), told: AtomicU32::new(UNTOLD) }))
    }
}

impl Remote {
    /// Sets a plain value, while the host's is `hosted`. What is no number is left out.
    ///
    /// # Real-time
    /// Any thread; no allocation, lock or I/O.
    pub fn set(&self, knob: Knob, value: f32, hosted: f32) {
        if value.is_finite() {
            let word = u64::from(value.to_bits()) << 32 | u64::from(hosted.to_bits());
            self.0[knob as usize].word.store(word, Ordering::Release);
        }
    }

    /// The remote value if the host's has not changed since it came, else the host's.
    ///
    /// # Real-time
    /// Any thread; no allocation, lock or I/O.
    pub fn latest(&self, knob: Knob, hosted: f32) -> f32 {
        self.pending(knob, hosted).unwrap_or(hosted)
    }

    /// The remote value that the host does not know of, if there is one.
    ///
    /// # Real-time
    /// Any thread; no allocation, lock or I/O.
    pub fn pending(&self, knob: Knob, hosted: f32) -> Option<f32> {
        let place = &self.0[knob as usize];
        let word = place.word.load(Ordering::Acquire);
        #[expect(clippy::cast_possible_truncation, reason = "the two halves of a word")]
        let (value, stood_for) = (f32::from_bits((word >> 32) as u32), word as u32);
        if word == NONE {
            None
        } else if stood_for == hosted.to_bits() || place.told.load(Ordering::Acquire) == hosted.to_bits() {
            Some(value).filter(|value| value.to_bits() != hosted.to_bits())
        } else {
            // A newer remote value that comes at this moment stays.
            let _newer = place.word.compare_exchange(word, NONE, Ordering::AcqRel, Ordering::Relaxed);
            None
        }
    }

    /// The host is being told a value, as it will have it. A remote value that comes before the host has it still stands.
    pub fn tell(&self, knob: Knob, told: f32) {
        self.0[knob as usize].told.store(told.to_bits(), Ordering::Release);
    }

    /// Forgets a remote value, because the user has set another.
    pub fn clear(&self, knob: Knob) {
        let place = &self.0[knob as usize];
        place.told.store(UNTOLD, Ordering::Release);
        place.word.store(NONE, Ordering::Release);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::PromenadeParams;
    use nice_plug::prelude::Params;

    #[test]
    fn what_came_last_is_heard() {
        let remote = Remote::default();
        assert_eq!(remote.latest(Knob::Yaw, 10.0), 10.0);
        remote.set(Knob::Yaw, -30.0, 10.0);
        assert_eq!(remote.latest(Knob::Yaw, 10.0), -30.0);
        assert_eq!(remote.latest(Knob::Yaw, 11.0), 11.0, "the host moved its knob");
        assert_eq!(remote.latest(Knob::Yaw, 10.0), 10.0, "and moved it back");
        remote.set(Knob::Yaw, f32::NAN, 10.0);
        assert_eq!(remote.latest(Knob::Yaw, 10.0), 10.0);
    }

    #[test]
    fn a_value_that_comes_while_the_host_is_told_of_the_one_before_is_heard() {
        let remote = Remote::default();
        remote.set(Knob::Yaw, 20.0, 10.0);
        remote.tell(Knob::Yaw, 20.0);
        remote.set(Knob::Yaw, 30.0, 10.0);
        assert_eq!(remote.latest(Knob::Yaw, 20.0), 30.0, "the host has the first");
        remote.tell(Knob::Yaw, 30.0);
        assert_eq!(remote.pending(Knob::Yaw, 30.0), None, "the host has both");
        assert_eq!(remote.latest(Knob::Yaw, 5.0), 5.0, "the host moved its knob");
        assert_eq!(remote.latest(Knob::Yaw, 30.0), 30.0);
        remote.set(Knob::Yaw, 50.0, 30.0);
        remote.clear(Knob::Yaw);
        assert_eq!(remote.latest(Knob::Yaw, 30.0), 30.0, "the user moved it in the editor");
    }

    #[test]
    fn every_parameter_but_the_revision_is_a_knob() {
        let mut ids = PromenadeParams::default().param_map().into_iter().map(|(id, ..)| id).collect::<Vec<_>>();
        ids.retain(|id| id != "revision");
        assert_eq!(ids, Knob::ALL.map(Knob::id));
        for (index, knob) in Knob::ALL.into_iter().enumerate() {
            assert_eq!(knob as usize, index);
        }
    }
}
