//! At which level a project plays its scenes.

use crate::library::level::gain_of;
use serde::{Deserialize, Serialize};

/// No scene is made louder or softer by more than this, tenths of a decibel.
const MOST_CB: i32 = 400;

/// The level that scenes are played at, so that one is as loud as the next; by default each is played as loud as it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Matching {
    /// Tenths of a decibel over the dry sound, as [`crate::library::level::level_cb`] has it.
    pub level_cb: Option<i32>,
}

impl Matching {
    /// By how much a scene is made louder, tenths of a decibel; of one whose level is not known, nothing.
    pub fn change_cb(self, scene_cb: Option<i32>) -> i32 {
        self.level_cb.zip(scene_cb).map_or(0, |(wanted, own)| wanted.saturating_sub(own).clamp(-MOST_CB, MOST_CB))
    }

    /// The gain that makes a scene of this level as loud as is wanted; 1 changes nothing.
    pub fn gain(self, scene_cb: Option<i32>) -> f32 {
        match self.change_cb(scene_cb) {
            0 => 1.0,
            change_cb => gain_of(change_cb),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_is_brought_to_the_level_and_no_further_than_sound_goes() {
        let to = |level_cb| Matching { level_cb };
        assert_eq!((to(None).gain(Some(-90)), to(Some(-90)).gain(None), to(Some(-90)).gain(Some(-90))), (1.0, 1.0, 1.0));
        assert_eq!(to(Some(-150)).change_cb(Some(-90)), -60);
        assert!((to(Some(-150)).gain(Some(-90)) - 0.501).abs() < 1e-3);
        assert_eq!(to(Some(i32::MIN)).change_cb(Some(i32::MAX)), -MOST_CB);
        let read = |json: &str| serde_json::from_str::<Matching>(json).unwrap();
        assert_eq!((read("{}"), read(r#"{"level_cb": -77}"#)), (to(None), to(Some(-77))));
    }
}
