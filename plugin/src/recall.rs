//! What presets, undo and the A/B comparison bring back: the parameters, the scene and the camera path.

use crate::params::{Follow, GroupChoice, PromenadeParams, SceneChoice, TierChoice, TrackingChoice};
use crate::reference::SceneReference;
use crate::remote::Knob;
use crate::walk::KeptWalk;
use nice_plug::params::persist::deserialize_field;
use nice_plug::plugin::{ParamValue, PluginState};
use nice_plug::prelude::Enum;

/// Steps that can be undone.
const LONGEST_HISTORY: usize = 200;

/// Everything that a user sets for the sound, as it was at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct Recall {
    knobs: [f32; Knob::ALL.len()],
    scene: SceneReference,
    walk: KeptWalk,
}

impl Recall {
    /// As it is now.
    #[must_use]
    pub fn of(params: &PromenadeParams) -> Self {
        Self {
            knobs: Knob::ALL.map(|knob| params.heard(knob)),
            scene: params.scene_reference.get().0,
            walk: params.kept_walk.get().0,
        }
    }

    /// As a saved state has it; what the state lacks is as in `base`.
    #[must_use]
    pub fn from_state(mut state: PluginState, base: &Self) -> Self {
        crate::state::migrate(&mut state);
        let mut recall = base.clone();
        for knob in Knob::ALL {
            let (low, high) = PromenadeParams::limits(knob);
            if let Some(value) = state.params.get(knob.id()).and_then(|value| plain(knob, value)) {
                recall.knobs[knob as usize] = value.clamp(low, high);
            }
        }
        let field = |name: &str| state.fields.get(name);
        if let Some(scene) = field("scene").and_then(|json| deserialize_field(json).ok()) {
            recall.scene = scene;
        }
        if let Some(walk) = field("walk").and_then(|json| deserialize_field(json).ok()) {
            recall.walk = walk;
        }
        recall
    }

    /// The value of a parameter.
    #[must_use]
    pub fn knob(&self, knob: Knob) -> f32 {
        self.knobs[knob as usize]
    }

    /// Brings it back: `set` is called for each parameter that differs, with its plain value.
    ///
    /// Scene and path go first, so that the choices by slot find what they belong to.
    pub fn apply(&self, params: &PromenadeParams, mut set: impl FnMut(Knob, f32)) {
        if params.scene_reference.get().0 != self.scene {
            params.scene_reference.restore(self.scene.clone());
        }
        if params.kept_walk.get().0 != self.walk {
            params.kept_walk.restore(self.walk.clone());
        }
        for knob in Knob::ALL {
            if params.heard(knob) != self.knob(knob) {
                set(knob, self.knob(knob));
            }
        }
    }
}

/// A saved value as a plain number; choices are saved by their ids.
fn plain(knob: Knob, value: &ParamValue) -> Option<f32> {
    fn index<T: Enum + 'static>(id: &str) -> Option<usize> {
        T::ids()?.iter().position(|known| *known == id)
    }
    #[expect(clippy::cast_precision_loss, reason = "a small whole number")]
    match value {
        ParamValue::F32(number) => Some(*number),
        ParamValue::I32(number) => Some(*number as f32),
        ParamValue::Bool(on) => Some(f32::from(u8::from(*on))),
        ParamValue::String(id) => match knob {
            Knob::Follow => index::<Follow>(id),
            Knob::Tracking => index::<TrackingChoice>(id),
            Knob::Group => index::<GroupChoice>(id),
            Knob::Tier => index::<TierChoice>(id),
            Knob::Scene => index::<SceneChoice>(id),
            _ => None,
        }
        .map(|index| index as f32),
    }
}

/// What can be undone, done again, and compared.
#[derive(Debug, Default)]
pub struct History {
    undone: Vec<Recall>,
    done: Vec<Recall>,
    other: Option<Recall>,
    /// Whether the newest change was one of going back, on or over.
    moved: bool,
    /// Whether B is heard.
    b: bool,
}

impl History {
    /// Takes what the user has just done: how it was `before`, and how it is `now`. Going back, on or over is no change to be noted.
    pub fn settle(&mut self, before: Recall, now: &Recall) {
        if !std::mem::take(&mut self.moved) && before != *now {
            self.note(before);
        }
    }

    fn note(&mut self, before: Recall) {
        self.undone.clear();
        if self.done.last() != Some(&before) {
            self.done.push(before);
        }
        if self.done.len() > LONGEST_HISTORY {
            self.done.remove(0);
        }
    }

    /// Goes one change back from `now`.
    pub fn undo(&mut self, now: Recall) -> Option<Recall> {
        let before = self.done.pop()?;
        self.moved = true;
        self.undone.push(now);
        Some(before)
    }

    /// Makes the change again that was undone last.
    pub fn redo(&mut self, now: Recall) -> Option<Recall> {
        let after = self.undone.pop()?;
        self.moved = true;
        self.done.push(now);
        Some(after)
    }

    /// Whether there is something to undo, and to do again.
    #[must_use]
    pub fn can(&self) -> (bool, bool) {
        (!self.done.is_empty(), !self.undone.is_empty())
    }

    /// Whether B is heard, not A.
    #[must_use]
    pub fn is_b(&self) -> bool {
        self.b
    }

    /// Goes from A to B or back. B begins as a copy of A.
    pub fn compare(&mut self, now: Recall) -> Recall {
        self.b = !self.b;
        self.moved = true;
        self.other.replace(now.clone()).unwrap_or(now)
    }

    /// Makes the other of A and B the same as the one that is heard.
    pub fn copy(&mut self, now: Recall) {
        self.other = Some(now);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(knob: Knob, value: f32) -> Recall {
        let mut recall = Recall::of(&PromenadeParams::default());
        recall.knobs[knob as usize] = value;
        recall
    }

    #[test]
    fn a_saved_state_is_read_and_what_it_lacks_stays() {
        let params = [
            ("x", ParamValue::F32(2.5)),
            ("yaw", ParamValue::F32(1e9)),
            ("follow", ParamValue::String("transport".to_owned())),
            ("bypass", ParamValue::Bool(true)),
            ("slot", ParamValue::I32(7)),
            ("tier", ParamValue::String("no such".to_owned())),
        ];
        let state = PluginState {
            version: String::new(),
            params: params.map(|(id, value)| (id.to_owned(), value)).into_iter().collect(),
            fields: [("walk".to_owned(), r#"{"speed": 0.5}"#.to_owned())].into(),
        };
        let recall = Recall::from_state(state, &with(Knob::Gain, -6.0));
        let found =
            [Knob::X, Knob::Yaw, Knob::Follow, Knob::Bypass, Knob::Slot, Knob::Tier, Knob::Gain].map(|k| recall.knob(k));
        assert_eq!(found, [2.5, 180.0, 2.0, 1.0, 7.0, 1.0, -6.0]);
        assert_eq!(recall.walk.speed, 0.5);
    }

    #[test]
    fn only_what_differs_is_set() {
        let params = PromenadeParams::default();
        let mut recall = with(Knob::Pitch, 12.0);
        recall.walk.looping = true;
        let mut set = Vec::new();
        recall.apply(&params, |knob, value| set.push((knob, value)));
        assert_eq!(set, [(Knob::Pitch, 12.0)]);
        assert!(params.kept_walk.get().0.looping);
    }

    #[test]
    fn changes_are_undone_and_done_again() {
        let [first, second, third] = [0.0, 1.0, 2.0].map(|x| with(Knob::X, x));
        let mut history = History::default();
        assert!(history.undo(first.clone()).is_none());
        history.note(first.clone());
        history.note(second.clone());
        assert_eq!(history.undo(third.clone()), Some(second.clone()));
        assert_eq!(history.undo(second.clone()), Some(first.clone()));
        assert_eq!(history.redo(first.clone()), Some(second.clone()));
        history.settle(first, &second);
        assert_eq!(history.can(), (true, true), "what was done again is no change of its own");
        history.settle(second.clone(), &second);
        assert_eq!(history.can(), (true, true), "nothing has changed");
        history.settle(second, &third);
        assert_eq!(history.can(), (true, false), "a change after an undo forgets what was undone");
    }

    #[test]
    fn b_begins_as_a_and_both_are_kept() {
        let [a, b] = [0.0, 1.0].map(|x| with(Knob::X, x));
        let mut history = History::default();
        assert_eq!(history.compare(a.clone()), a);
        assert!(history.is_b());
        assert_eq!(history.compare(b.clone()), a);
        assert_eq!(history.compare(a), b);
    }
}
