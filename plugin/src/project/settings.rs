//! How the editor was left.

use serde::{Deserialize, Serialize};

/// Light or dark.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Theme {
    /// Dark ground.
    #[default]
    Dark,
    /// Light ground.
    Light,
}

/// How the place is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum View {
    /// From above.
    #[default]
    Top,
    /// From anywhere.
    Orbit,
}

/// What is drawn over the plan of the place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Map {
    /// Nothing.
    #[default]
    None,
    /// Level.
    Level,
    /// Reverberation time.
    T20,
    /// Clarity.
    C50,
}

/// What a project keeps of the editor. Fields that a newer version has added are ignored, missing ones are as at first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct EditorSettings {
    /// Window width, points at the user's scale.
    pub width: f32,
    /// Window height, points at the user's scale.
    pub height: f32,
    /// How the place is drawn.
    pub view: View,
    /// What is drawn over its plan.
    pub map: Map,
    /// Whether the list of scenes is open.
    pub scenes: bool,
    /// Whether the drawer under the view is open.
    pub drawer: bool,
    /// Whether a scene that is chosen in the list is played as loud as the one before it.
    pub matches: bool,
    /// Title of the drawer's tab.
    pub tab: String,
}

/// The smallest window, points.
pub const LEAST_SIZE: (f32, f32) = (720.0, 480.0);
/// No window is wider or higher than this, points.
const MOST: f32 = 8192.0;

impl Default for EditorSettings {
    fn default() -> Self {
        Self {
            width: 1200.0,
            height: 760.0,
            view: View::default(),
            map: Map::default(),
            scenes: true,
            drawer: true,
            matches: true,
            tab: String::new(),
        }
    }
}

impl EditorSettings {
    /// The settings without what no window can be.
    pub fn within_reason(self) -> Self {
        let sane =
            |value: f32, least: f32, most: f32, else_: f32| if value.is_finite() { value.clamp(least, most) } else { else_ };
        let usual = Self::default();
        Self {
            width: sane(self.width, LEAST_SIZE.0, MOST, usual.width),
            height: sane(self.height, LEAST_SIZE.1, MOST, usual.height),
            ..self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_that_cannot_be_is_brought_back() {
        let odd = EditorSettings { width: f32::NAN, height: 1e9, ..EditorSettings::default() };
        let sane = odd.within_reason();
        assert_eq!((sane.width, sane.height), (1200.0, MOST));
        let usual = EditorSettings::default();
        assert_eq!(usual.clone().within_reason(), usual);
    }

    #[test]
    fn what_an_older_version_has_kept_is_read() {
        let old: EditorSettings = serde_json::from_str(r#"{"width": 900.0, "theme": "light", "view": "orbit"}"#).unwrap();
        assert_eq!((old.width, old.view), (900.0, View::Orbit));
        assert!(old.scenes && old.drawer);
    }
}
