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
pub(crate) const MOST_CONDITIONS: usize = 26;
/// Names that the page gives to the hidden reference and the anchors of 3.5 and 7 kHz.
pub(crate) const REFERENCE: &str = "Reference";
pub(crate) const LOW_ANCHOR: &str = "Low anchor";
pub(crate) const MID_ANCHOR: &str = "Mid anchor";

/// A study, as its author's file has it: read once, then made a site of by [`write_site`](crate::write_site).
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Study {
    /// Its name in files: letters, digits, `-` and `_`.
    pub study: String,
    /// Its title on the page.
    pub title: String,
    /// The language of the page's own words: `en`, `de`, or a file of texts beside the study; English without.
    pub language: Option<String>,
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
    /// What is said to who has answered everything, and has sent it: a code of a panel of listeners.
    pub code: Option<String>,
    /// Questions beside the sounds, asked last.
    #[serde(default)]
    pub questions: Vec<Question>,
    /// What is asked, one after the other.
    pub parts: Vec<Part>,
}

/// A question beside the sounds.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Question {
    /// Its name in answers.
    pub name: String,
    /// What is asked.
    pub text: String,
    /// What can be answered; anything without.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub choices: Option<Vec<String>>,
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
    /// Rates two low-passed references too (3.5 and 7 kHz, ITU-R BS.1534-3).
    #[serde(default)]
    pub anchor: bool,
    /// Its answers are not kept.
    #[serde(default)]
    pub training: bool,
    /// Pairs that are compared, of the conditions of each item; all without.
    pub pairs: Option<Vec<[String; 2]>>,
    /// Neither of two may be preferred.
    #[serde(default)]
    pub no_preference: bool,
    /// Words of the scale, from the lowest on.
    pub words: Option<Vec<String>>,
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
    /// A sound that is heard beside pictures; then conditions and reference are pictures.
    pub sound: Option<PathBuf>,
    /// What the others are held against.
    pub reference: Option<PathBuf>,
    /// Where listeners begin in the scenes: x, y, z in metres, and to where they look, degrees to the left of x.
    #[serde(default)]
    pub start: Option<[f32; 4]>,
    /// Files of sound, scenes or pictures, by condition.
    pub conditions: BTreeMap<String, Stimulus>,
}

/// What a condition is.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(untagged)]
pub enum Stimulus {
    /// A file.
    One(PathBuf),
    /// Two pictures: the second has the weight of the sound at each moment, the first the rest.
    Blend([PathBuf; 2]),
}

impl Stimulus {
    /// Its files, one or two.
    pub fn files(&self) -> &[PathBuf] {
        match self {
            Self::One(file) => std::slice::from_ref(file),
            Self::Blend(files) => files,
        }
    }
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
        let named = |name: &str| (1..=MOST_NAME).contains(&name.chars().count()) && !name.chars().any(char::is_control);
        for (i, question) in self.questions.iter().enumerate() {
            let twice = self.questions[..i].iter().any(|other| other.name == question.name);
            if twice || !named(&question.name) || question.choices.as_ref().is_some_and(Vec::is_empty) {
                let expected = "questions with names of 1 to 64 characters, each its own, and choices or none";
                return wrong(format!("question {}", i + 1), expected, format!("{:?}", question.name));
            }
        }
        let mut trials = 0_usize;
        for (number, part) in self.parts.iter().enumerate() {
            let at = format!("part {}", number + 1);
            let Some(method) = Method::by_name(&part.method) else {
                return wrong(at, "paired, abx or rating", format!("{:?}", part.method));
            };
            if method == Method::Question {
                return wrong(at, "paired, abx or rating, and questions beside the parts", format!("{:?}", part.method));
            }
            if (part.pairs.is_some() || part.no_preference) && method != Method::Paired {
                return wrong(at, "pairs and no_preference in paired comparisons", part.method.clone());
            }
            if part.words.as_ref().is_some_and(|words| method != Method::Rating || !(2..=11).contains(&words.len())) {
                return wrong(at, "2 to 11 words of a rating's scale", format!("{:?}", part.words));
            }
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
            if [REFERENCE, LOW_ANCHOR, MID_ANCHOR].contains(&&**name) {
                return Err(("conditions of other names than Reference, Low anchor and Mid anchor", format!("{name:?}")));
            }
        }
        let count = item.conditions.len();
        let (least, most) = match method {
            Method::Paired => (2, MOST_CONDITIONS),
            Method::Abx => (2, 2),
            Method::Rating | Method::Question => (1, MOST_CONDITIONS - 3),
        };
        if !(least..=most).contains(&count) {
            let expected = if method == Method::Abx { "2 conditions" } else { "2 to 26 conditions, or 1 to 23 to rate" };
            return Err((expected, count.to_string()));
        }
        let needs = self.sequence.as_ref().is_some_and(|s| s.iter().any(|label| label == "R")) || self.anchor;
        if item.reference.is_none() && needs {
            return Err(("a reference, which the sequence or the anchor needs", "none".to_owned()));
        }
        let known = |[one, other]: &&[String; 2]| one != other && [one, other].iter().all(|n| item.conditions.contains_key(*n));
        if let Some(pair) = self.pairs.iter().flatten().find(|pair| !known(pair)) {
            return Err(("pairs of two of its conditions", format!("{pair:?}")));
        }
        if item.start.is_some_and(|start| item.dry.is_none() || !start.iter().all(|v| v.is_finite())) {
            return Err(("a start of four numbers, beside a dry sound", format!("{:?}", item.start)));
        }
        let of_kind = [
            (&item.dry, "promenade", "scenes (.promenade) beside the dry sound"),
            (&item.sound, "png", "pictures (.png) beside the sound"),
        ];
        for (beside, ending, expected) in of_kind.into_iter().filter_map(|(beside, e, x)| Some((beside.as_ref()?, e, x))) {
            let mut files = item.conditions.values().flat_map(Stimulus::files).chain(&item.reference);
            if let Some(other) = files.find(|path| path.extension().is_none_or(|e| e != ending)) {
                return Err((expected, format!("{} beside {}", other.display(), beside.display())));
            }
        }
        if item.sound.is_some() && self.anchor {
            return Err(("no anchor beside pictures: it is a sound", "one".to_owned()));
        }
        if item.sound.is_none() && item.conditions.values().any(|stimulus| stimulus.files().len() > 1) {
            return Err(("a sound beside two pictures", "none".to_owned()));
        }
        let kinds = match method {
            Method::Paired => self.pairs.as_ref().map_or(count * (count - 1) / 2, Vec::len),
            _ => 1,
        };
        Ok(kinds * self.repeats.unwrap_or(if method == Method::Abx { 8 } else { 1 }) as usize)
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
        assert!(with("pairs", json!([["x", "z"]])).contains("pairs of two of its conditions"));
        assert!(with("words", json!(["bad", "good"])).contains("a rating's scale"));
        assert!(with("surprise", json!(1)).contains("unknown field"));
        let item = |key: &str, value: Value| {
            let mut part = part.clone();
            part["items"][0][key] = value;
            of(&study(&part)).unwrap_err()
        };
        assert!(item("conditions", json!({ "x": "x.wav" })).contains("2 to 26 conditions"));
        assert!(item("conditions", json!({ "x": "x.wav", "Low anchor": "y.wav" })).contains("other names"));
        assert!(item("dry", json!("dry.wav")).contains("scenes (.promenade)"));
        assert!(item("sound", json!("mix.wav")).contains("pictures (.png)"));
        let blend = json!({ "x": "x.png", "y": ["x.png", "y.png"] });
        assert!(item("conditions", blend.clone()).contains("a sound beside two pictures"));
        let mut shown = part.clone();
        shown["items"][0] = json!({ "name": "hall", "sound": "mix.wav", "reference": "r.png", "conditions": blend });
        of(&study(&shown)).unwrap();
        shown["method"] = json!("rating");
        shown["anchor"] = json!(true);
        assert!(of(&study(&shown)).unwrap_err().contains("no anchor"));
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
