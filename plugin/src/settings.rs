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

/// What a project keeps of the editor. Fields that a newer version has added are ignored, missing ones are as at first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct EditorSettings {
    /// Window width, points.
    pub width: f32,
    /// Window height, points.
    pub height: f32,
    /// Size of everything in the window, 1 for as it comes.
    pub zoom: f32,
    /// Light or dark.
    pub theme: Theme,
    /// How the place is drawn.
    pub view: View,
}

impl Default for EditorSettings {
    fn default() -> Self {
        Self { width: 1000.0, height: 660.0, zoom: 1.0, theme: Theme::default(), view: View::default() }
    }
}
