//! What a study asks, as its author writes it.

use crate::answers::Method;
use promenade_audio::{FileError, file};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Most bytes of a study file.
const MOST_BYTES: u64 = 4 << 20;
/// Most trials of a person.
const MOST_TRIALS: usize = 10_000;
/// Most characters of a name.
const MOST_NAME: usize = 64;
/// Most conditions of an item: rated ones have a slider each.
const MOST_CONDITIONS: usize = 26;
/// Names that the page gives to the hidden reference and the anchor.
pub(crate) const REFERENCE: &str = "Reference";
pub(crate) const ANCHOR: &str = "Anchor";

/// A study.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Study {
    /// Its name in files: letters, digits, `-` and `_`.
    pub study: String,
    /// Its title on the page.
    pub title: String,
    /// What is said first; an empty line begins a paragraph.
    pub welcome: Option<String>,
    /// What listeners agree to.
    pub consent: Option<String>,
    /// What is said last.
    pub thanks: Option<String>,
    /// Seed of all orders.
    #[serde(default = "one")]
    pub seed: u64,
    /// Whether headphones are asked for and found out.
    #[serde(default = "yes")]
    pub headphones: bool,
    /// Whether all sounds of an item are brought to one loudness.
    #[serde(default = "yes")]
    pub match_loudness: bool,
    /// Whether answers are sent to the server that the page comes from; they can be saved in any case.
    #[serde(default)]
    pub post: bool,
    /// What is asked, one after the other.
    pub parts: Vec<Part>,
}

fn one() -> u64 {
    1
}

fn yes() -> bool {
    true
}

/// Trials of one kind.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Part {
    /// `paired`, `abx` or `rating`.
    pub method: String,
    /// A page before the first trial.
    pub intro: Option<String>,
    /// Its title.
    pub title: Option<String>,
    /// What is asked, instead of the page's own words.
    pub question: Option<String>,
    /// Paired comparisons that play by themselves: R, A and B in any order. Files are played R A R B unless told, live scenes
    /// are chosen by the listener.
    pub sequence: Option<Vec<String>>,
    /// Seconds for which each of the sequence is played.
    pub seconds: Option<f64>,
    /// Seconds for which each sound must be heard before it can be answered.
    pub listen_s: Option<f64>,
    /// How often each pair is asked, or each ABX trial is done.
    pub repeats: Option<u32>,
    /// Rates a low-passed reference (3.5 kHz) too.
    #[serde(default)]
    pub anchor: bool,
    /// What is listened to.
    pub items: Vec<Item>,
}

/// Sounds that are compared with each other.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Item {
    /// Its name.
    pub name: String,
    /// A dry sound; then conditions and reference are scenes, in which the listener walks.
    pub dry: Option<PathBuf>,
    /// What the others are held against.
    pub reference: Option<PathBuf>,
    /// Files of sound or scenes, by condition.
    pub conditions: BTreeMap<String, PathBuf>,
}

impl Study {
    /// Reads and checks a study file.
    ///
    /// # Errors
    /// A file that cannot be read or is no study, with what was expected and found.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        let bytes = file::read(path, MOST_BYTES).map_err(FileError::read(path))?;
        let study = serde_json::from_slice(&bytes).map_err(|error| FileError::content(path, "a study", error.to_string()));
        let study: Self = study?;
        study.check().map_err(|(entry, expected, found)| FileError::entry(path, entry, expected, found))?;
        Ok(study)
    }

    /// Whether listeners walk in scenes.
    pub fn is_live(&self) -> bool {
        self.parts.iter().flat_map(|part| &part.items).any(|item| item.dry.is_some())
    }

    fn check(&self) -> Result<(), (String, String, String)> {
        let wrong = |entry: String, expected: &str, found: String| Err((entry, expected.to_owned(), found));
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if self.study.is_empty() || self.study.len() > MOST_NAME || !self.study.chars().all(plain) {
            return wrong("study".into(), "1 to 64 letters, digits, - and _", format!("{:?}", self.study));
        }
        if self.parts.is_empty() || self.parts.len() > 100 {
            return wrong("parts".into(), "1 to 100 parts", self.parts.len().to_string());
        }
        let mut trials = 0_usize;
        for (number, part) in self.parts.iter().enumerate() {
            let at = format!("part {}", number + 1);
            let Some(method) = Method::by_name(&part.method) else {
                return wrong(at, "paired, abx or rating", format!("{:?}", part.method));
            };
            if let Some(sequence) = &part.sequence {
                let known = sequence.iter().all(|label| ["R", "A", "B"].contains(&&**label));
                let both = ["A", "B"].iter().all(|label| sequence.iter().any(|other| other == label));
                if method != Method::Paired || !known || !both || sequence.len() > 20 {
                    return wrong(
                        at,
                        "paired comparisons, and a sequence of R, A and B with both A and B",
                        format!("{sequence:?}"),
                    );
                }
            }
            for (what, value, most) in [("seconds", part.seconds, 600.0), ("listen_s", part.listen_s, 600.0)] {
                if value.is_some_and(|value| !(0.0..=most).contains(&value)) {
                    return wrong(format!("{at}: {what}"), "0 to 600 seconds", format!("{value:?}"));
                }
            }
            if part.repeats.is_some_and(|repeats| !(1..=100).contains(&repeats)) {
                return wrong(format!("{at}: repeats"), "1 to 100", format!("{:?}", part.repeats));
            }
            if part.items.is_empty() {
                return wrong(at, "at least one item", "none".into());
            }
            for (i, item) in part.items.iter().enumerate() {
                let name = format!("{at}: item {:?}", item.name);
                if part.items[..i].iter().any(|other| other.name == item.name) {
                    return wrong(name, "items of different names", "it twice".into());
                }
                trials = trials.saturating_add(part.check_item(method, item).map_err(|(e, f)| (name, e.to_owned(), f))?);
            }
        }
        if trials > MOST_TRIALS {
            return wrong("parts".into(), "at most 10000 trials", trials.to_string());
        }
        Ok(())
    }
}

impl Part {
    /// The number of trials.
    fn check_item(&self, method: Method, item: &Item) -> Result<usize, (&'static str, String)> {
        for name in item.conditions.keys().chain([&item.name]) {
            if name.is_empty() || name.chars().count() > MOST_NAME || name.chars().any(char::is_control) {
                return Err(("names of 1 to 64 characters", format!("{name:?}")));
            }
            if [REFERENCE, ANCHOR].contains(&&**name) {
                return Err(("conditions of other names than Reference and Anchor", format!("{name:?}")));
            }
        }
        let count = item.conditions.len();
        let (least, most) = match method {
            Method::Paired => (2, MOST_CONDITIONS),
            Method::Abx => (2, 2),
            Method::Rating => (1, MOST_CONDITIONS - 2),
        };
        if !(least..=most).contains(&count) {
            let expected = if method == Method::Abx { "2 conditions" } else { "2 to 26 conditions, or 1 to 24 to rate" };
            return Err((expected, count.to_string()));
        }
        let needs = self.sequence.as_ref().is_some_and(|s| s.iter().any(|label| label == "R")) || self.anchor;
        if item.reference.is_none() && needs {
            return Err(("a reference, which the sequence or the anchor needs", "none".to_owned()));
        }
        if let Some(dry) = &item.dry {
            let scene = |path: &PathBuf| path.extension().is_some_and(|e| e == "promenade");
            if let Some(other) = item.conditions.values().chain(&item.reference).find(|path| !scene(path)) {
                return Err((
                    "scenes (.promenade) beside the dry sound",
                    format!("{} beside {}", other.display(), dry.display()),
                ));
            }
        }
        Ok(match method {
            Method::Paired => count * (count - 1) / 2 * self.repeats.unwrap_or(1) as usize,
            Method::Abx => self.repeats.unwrap_or(8) as usize,
            Method::Rating => 1,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};

    fn of(study: &Value) -> Result<(), String> {
        let study: Study = serde_json::from_value(study.clone()).map_err(|error| error.to_string())?;
        study.check().map_err(|(entry, expected, found)| format!("{entry}: {expected}, {found}"))
    }

    fn study(part: &Value) -> Value {
        json!({ "study": "rooms", "title": "Rooms", "parts": [part] })
    }

    #[test]
    fn studies_are_checked() {
        let item = json!({ "name": "hall", "reference": "r.wav", "conditions": { "x": "x.wav", "y": "y.wav" } });
        let part = json!({ "method": "paired", "items": [item] });
        of(&study(&part)).unwrap();
        let with = |key: &str, value: Value| {
            let mut part = part.clone();
            part[key] = value;
            of(&study(&part)).unwrap_err()
        };
        assert!(with("method", json!("guess")).contains("paired, abx or rating"));
        assert!(with("sequence", json!(["A", "A"])).contains("both A and B"));
        assert!(with("listen_s", json!(-1)).contains("0 to 600"));
        assert!(with("repeats", json!(0)).contains("1 to 100"));
        assert!(with("items", json!([])).contains("at least one item"));
        assert!(with("items", json!([item, item])).contains("twice"));
        assert!(with("surprise", json!(1)).contains("unknown field"));
        let item = |key: &str, value: Value| {
            let mut part = part.clone();
            part["items"][0][key] = value;
            of(&study(&part)).unwrap_err()
        };
        assert!(item("conditions", json!({ "x": "x.wav" })).contains("2 to 26 conditions"));
        assert!(item("conditions", json!({ "x": "x.wav", "Anchor": "y.wav" })).contains("other names"));
        assert!(item("dry", json!("dry.wav")).contains("scenes (.promenade)"));
        let mut bare = part.clone();
        bare["items"][0].as_object_mut().unwrap().remove("reference");
        of(&study(&bare)).unwrap();
        bare["sequence"] = json!(["R", "A", "B"]);
        assert!(of(&study(&bare)).unwrap_err().contains("a reference"));
        let mut named = study(&part);
        named["study"] = json!("../rooms");
        assert!(of(&named).unwrap_err().contains("letters, digits"));
    }
}
