//! Steinberg's preset file: a header, the component's state as JSON, an empty state of the controller, what the file says of
//! itself as XML, and a list of these parts.
//!
//! Source: VST 3 SDK documentation, "Preset format"; names of attributes as in `vstpresetkeys.h`.

use nice_plug::plugin::PluginState;
use roxmltree::Document;

/// Bytes before the first chunk: `VST3`, a version, the class id in hexadecimal, the place of the chunk list.
const HEADER: usize = 48;
/// The class id in hexadecimal as hosts write it.
const CLASS_ID: std::ops::Range<usize> = 8..40;
/// More parts than any preset has.
const MOST_PARTS: usize = 64;
/// Attribute: which collection of its maker the preset belongs to.
const LIBRARY: &str = "MediaLibraryName";
/// The collection of the presets that come with the plugin.
pub(super) const FACTORY: &str = "Promenade Factory";
/// Attribute: what the preset is for, words between `|`.
const STYLE: &str = "MusicalStyle";
/// Attribute: a sentence.
const COMMENT: &str = "Comment";

/// What a preset says of itself.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct About {
    /// A sentence; empty where none is given.
    pub sentence: String,
    /// What it is for: speech, music, film, walk.
    pub uses: Vec<String>,
    /// Whether it came with the plugin.
    pub is_factory: bool,
}

/// A file with a state and nothing about itself; `template` is any preset of the plugin.
pub(super) fn write(component: &[u8], template: &[u8]) -> Vec<u8> {
    let (start, end) = (HEADER as u64, (HEADER + component.len()) as u64);
    let mut bytes = b"VST3".to_vec();
    bytes.extend(1_u32.to_le_bytes());
    bytes.extend(&template[CLASS_ID]);
    bytes.extend(end.to_le_bytes());
    bytes.extend(component);
    bytes.extend(b"List");
    bytes.extend(2_u32.to_le_bytes());
    for (id, at, length) in [(b"Comp", start, component.len() as u64), (b"Cont", end, 0)] {
        bytes.extend(id);
        bytes.extend(at.to_le_bytes());
        bytes.extend(length.to_le_bytes());
    }
    bytes
}

/// The state in a file; of what is none, what was found instead.
pub(super) fn state(bytes: &[u8], template: &[u8]) -> Result<PluginState, String> {
    if bytes.get(..4) != Some(b"VST3") {
        return Err("another kind of file".to_owned());
    }
    if bytes.get(CLASS_ID) != template.get(CLASS_ID) {
        return Err("a preset of another plugin".to_owned());
    }
    list_of(bytes).ok_or("a preset without a list of its parts")?;
    let component = part(bytes, b"Comp").ok_or("a preset without the plugin's state, or cut short")?;
    serde_json::from_slice(component).map_err(|error| format!("a state that cannot be read ({error})"))
}

/// What a file says of itself; hosts and users need not say anything.
pub(super) fn about(bytes: &[u8]) -> About {
    let text = part(bytes, b"Info").and_then(|xml| std::str::from_utf8(xml).ok()).unwrap_or_default();
    let Ok(document) = Document::parse(text) else { return About::default() };
    let value = |id: &str| {
        let attribute = document.descendants().find(|node| node.attribute("id") == Some(id));
        attribute.and_then(|node| node.attribute("value")).unwrap_or_default()
    };
    About {
        sentence: value(COMMENT).to_owned(),
        uses: value(STYLE).split('|').filter(|word| !word.is_empty()).map(str::to_owned).collect(),
        is_factory: value(LIBRARY) == FACTORY,
    }
}

/// Where the list of parts begins.
fn list_of(bytes: &[u8]) -> Option<usize> {
    number(bytes, 40, 8).filter(|at| bytes.get(*at..at.saturating_add(4)) == Some(b"List"))
}

/// The bytes of the part with an id.
fn part<'a>(bytes: &'a [u8], id: &[u8; 4]) -> Option<&'a [u8]> {
    let list = list_of(bytes)?;
    let count = number(bytes, list + 4, 4)?.min(MOST_PARTS);
    let entry = (0..count).map(|n| list + 8 + 20 * n).find(|at| bytes.get(*at..at + 4) == Some(id))?;
    let (start, length) = (number(bytes, entry + 4, 8)?, number(bytes, entry + 12, 8)?);
    bytes.get(start..start.checked_add(length)?)
}

/// A whole number of `len` bytes, at most 8, the least significant first.
fn number(bytes: &[u8], at: usize, len: usize) -> Option<usize> {
    let field = bytes.get(at..at + len)?;
    let mut word = [0; 8];
    word[..len].copy_from_slice(field);
    usize::try_from(u64::from_le_bytes(word)).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    const FACTORY_PRESET: &[u8] =
        include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/../presets/plugin/Office, facing the source.vstpreset"));

    #[test]
    fn a_state_is_written_as_the_recipe_writes_it() {
        let component = part(FACTORY_PRESET, b"Comp").unwrap();
        let written = write(component, FACTORY_PRESET);
        let end = HEADER + component.len();
        assert_eq!(written[..40], FACTORY_PRESET[..40]);
        assert_eq!(written[HEADER..end], FACTORY_PRESET[HEADER..end]);
        assert_eq!(part(&written, b"Comp"), Some(component));
        assert_eq!(about(&written), About::default());
    }

    #[test]
    fn what_a_preset_says_of_itself_is_read() {
        let about = about(FACTORY_PRESET);
        assert!(about.is_factory);
        assert_eq!(about.uses, ["speech"]);
        assert!(about.sentence.ends_with('.'), "{}", about.sentence);
    }

    #[test]
    fn damage_is_an_error() {
        let whole = FACTORY_PRESET;
        let entries = list_of(whole).unwrap() + 8;
        // The list's last entries, of the controller's empty state and of the file itself, are not needed.
        for length in 0..entries + 20 {
            assert!(state(&whole[..length], whole).is_err(), "{length}");
        }
        for at in (0..HEADER).chain(whole.len() - 70..whole.len()) {
            let mut bytes = whole.to_vec();
            bytes[at] ^= 0x55;
            // Some bytes do not matter; none may bring the reader down.
            let _ = (state(&bytes, whole), about(&bytes));
        }
    }
}
