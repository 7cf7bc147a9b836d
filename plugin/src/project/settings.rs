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
    /// Whether the list of scenes is open.
    pub scenes: bool,
    /// Whether the drawer under the view is open.
    pub drawer: bool,
    /// Whether a scene that is chosen in the list is played as loud as the one before it.
    pub matches: bool,
    /// Title of the drawer's tab.
    pub tab: String,
}

/// The smallest window, points at zoom 1.
pub const LEAST_SIZE: (f32, f32) = (720.0, 480.0);
/// The least and the greatest zoom.
pub const ZOOMS: (f32, f32) = (0.75, 3.0);
/// No window is wider or higher than this, points.
const MOST: f32 = 8192.0;

impl Default for EditorSettings {
    fn default() -> Self {
        Self {
            width: 1200.0,
            height: 760.0,
            zoom: 1.0,
            theme: Theme::default(),
            view: View::default(),
            scenes: true,
            drawer: true,
            matches: true,
            tab: String::new(),
        }
    }
}

impl EditorSettings {
    /// Everything larger or smaller in the same window. It grows only where it would be below [`LEAST_SIZE`]: screens end
    /// somewhere.
    #[must_use]
    pub fn zoomed(self, zoom: f32) -> Self {
        let share = self.zoom / zoom;
        Self { width: (self.width * share).max(LEAST_SIZE.0), height: (self.height * share).max(LEAST_SIZE.1), zoom, ..self }
    }

    /// The settings without what no window can be.
    #[must_use]
    pub fn within_reason(self) -> Self {
        let sane =
            |value: f32, least: f32, most: f32, else_: f32| if value.is_finite() { value.clamp(least, most) } else { else_ };
        let usual = Self::default();
        Self {
            width: sane(self.width, LEAST_SIZE.0, MOST, usual.width),
            height: sane(self.height, LEAST_SIZE.1, MOST, usual.height),
            zoom: sane(self.zoom, ZOOMS.0, ZOOMS.1, 1.0),
            ..self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_zoom_keeps_the_window_unless_it_would_be_too_small() {
        let usual = EditorSettings::default();
        let pixels = |settings: &EditorSettings| (settings.width * settings.zoom, settings.height * settings.zoom);
        let larger = usual.clone().zoomed(1.5);
        assert_eq!((larger.zoom, pixels(&larger)), (1.5, pixels(&usual)));
        assert_eq!(pixels(&larger.zoomed(1.0)), pixels(&usual));
        let least = usual.zoomed(3.0);
        assert_eq!((least.width, least.height), LEAST_SIZE);
    }

    #[test]
    fn a_window_that_cannot_be_is_brought_back() {
        let odd = EditorSettings { width: f32::NAN, height: 1e9, zoom: -3.0, ..EditorSettings::default() };
        let sane = odd.within_reason();
        assert_eq!((sane.width, sane.height, sane.zoom), (1200.0, MOST, ZOOMS.0));
        let usual = EditorSettings::default();
        assert_eq!(usual.clone().within_reason(), usual);
    }

    #[test]
    fn what_an_older_version_has_kept_is_read() {
        let old: EditorSettings = serde_json::from_str(r#"{"width": 900.0, "theme": "light", "view": "orbit"}"#).unwrap();
        assert_eq!((old.width, old.theme, old.view), (900.0, Theme::Light, View::Orbit));
        assert!(old.scenes && old.drawer);
    }
}
