//! What a host marks a parameter with in the plugin's editor, and what it tells of a track.

/// Red, green and blue.
pub type Colour = [u8; 3];

/// A track.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Track {
    /// Its name.
    pub name: String,
    /// Its colour.
    pub colour: Colour,
}

/// What automation does to a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AutomationMark {
    /// There is none.
    None,
    /// There is some.
    Present,
    /// It is played.
    Playing,
    /// It is written.
    Recording,
    /// The user moves against it.
    Overriding,
}

/// A mark on a parameter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Mark {
    /// A control outside moves it: a word, a sentence and a colour; or none does.
    Mapping(Option<(String, String, Colour)>),
    /// Automation, in a colour.
    Automation(AutomationMark, Option<Colour>),
}
