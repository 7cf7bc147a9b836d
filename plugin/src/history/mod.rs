//! Undo, redo and the comparison of two settings.

pub mod presets;
pub mod user_state;

use crate::history::user_state::UserState;
use crate::telemetry::waveform::Waveform;

/// What an instance keeps from one window to the next.
#[derive(Debug, Default)]
pub struct Session {
    /// Undo, redo, A and B.
    pub history: History,
    /// Name of the preset that was chosen last.
    pub preset: Option<String>,
    /// What was heard over the time of the transport.
    pub waveform: Waveform,
}

/// Steps that can be undone.
const LONGEST_HISTORY: usize = 200;

/// The states that undo, redo and the A/B comparison go back to.
#[derive(Debug, Default)]
pub struct History {
    undone: Vec<UserState>,
    done: Vec<UserState>,
    other: Option<UserState>,
    /// Whether the newest change was an undo, a redo or a switch between A and B.
    travelled: bool,
    /// Whether B is heard.
    b: bool,
}

impl History {
    /// Records what the user has just changed: the state `before`, and that `now`. Undo, redo and the switch between A and B
    /// are not recorded.
    pub fn record(&mut self, before: UserState, now: &UserState) {
        if !std::mem::take(&mut self.travelled) && before != *now {
            self.push(before);
        }
    }

    fn push(&mut self, before: UserState) {
        self.undone.clear();
        if self.done.last() != Some(&before) {
            self.done.push(before);
        }
        if self.done.len() > LONGEST_HISTORY {
            self.done.remove(0);
        }
    }

    /// The state before the last change; `now` can then be redone.
    pub fn undo(&mut self, now: UserState) -> Option<UserState> {
        let before = self.done.pop()?;
        self.travelled = true;
        self.undone.push(now);
        Some(before)
    }

    /// The state after the change that was undone last.
    pub fn redo(&mut self, now: UserState) -> Option<UserState> {
        let after = self.undone.pop()?;
        self.travelled = true;
        self.done.push(now);
        Some(after)
    }

    /// Whether there is something to undo, and to redo.
    pub fn can(&self) -> (bool, bool) {
        (!self.done.is_empty(), !self.undone.is_empty())
    }

    /// Whether B is heard, not A.
    pub fn is_b(&self) -> bool {
        self.b
    }

    /// Switches from A to B or back and returns the state to restore. B begins as a copy of A.
    pub fn compare(&mut self, now: UserState) -> UserState {
        self.b = !self.b;
        self.travelled = true;
        self.other.replace(now.clone()).unwrap_or(now)
    }

    /// Copies the one of A and B that is heard to the other.
    pub fn copy(&mut self, now: UserState) {
        self.other = Some(now);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::history::user_state::tests::with;
    use crate::parameter::Parameter;

    #[test]
    fn changes_are_undone_and_done_again() {
        let [first, second, third] = [0.0, 1.0, 2.0].map(|x| with(Parameter::X, x));
        let mut history = History::default();
        assert!(history.undo(first.clone()).is_none());
        history.push(first.clone());
        history.push(second.clone());
        assert_eq!(history.undo(third.clone()), Some(second.clone()));
        assert_eq!(history.undo(second.clone()), Some(first.clone()));
        assert_eq!(history.redo(first.clone()), Some(second.clone()));
        history.record(first, &second);
        assert_eq!(history.can(), (true, true), "what was done again is no change of its own");
        history.record(second.clone(), &second);
        assert_eq!(history.can(), (true, true), "nothing has changed");
        history.record(second, &third);
        assert_eq!(history.can(), (true, false), "a change after an undo forgets what was undone");
    }

    #[test]
    fn a_step_holds_no_keyframes_of_its_own() {
        use crate::project::{params::PromenadeParams, walk::SavedWalk};
        use promenade_core::{Keyframe, Pose};
        let keyframes = (0..360_000).map(|n| Keyframe { t_s: f64::from(n), pose: Pose::IDENTITY }).collect::<Vec<_>>();
        let params = PromenadeParams::beginning_on(Some(&SavedWalk::of(&keyframes)));
        let places = [0, 1].map(|_| UserState::of(&params).walk().keyframes.as_ptr());
        assert_eq!(places[0], places[1], "20 MB are copied");
    }

    #[test]
    fn b_begins_as_a_and_both_are_kept() {
        let [a, b] = [0.0, 1.0].map(|x| with(Parameter::X, x));
        let mut history = History::default();
        assert_eq!(history.compare(a.clone()), a);
        assert!(history.is_b());
        assert_eq!(history.compare(b.clone()), a);
        assert_eq!(history.compare(a), b);
    }
}
