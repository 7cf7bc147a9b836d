//! The page's own files, and what it says in which language.

use promenade_audio::{FileError, file};
use promenade_fault::Fault;
use std::collections::BTreeMap;
use std::path::Path;

/// Texts by name.
type Texts = BTreeMap<String, String>;

/// Texts by language.
const TEXTS: &str = include_str!("../page/texts.json");
/// Largest file of texts, bytes.
const MOST_BYTES: u64 = 1 << 20;

macro_rules! files {
    ($($name:literal),* $(,)?) => {
        &[$(($name, include_str!(concat!("../page/", $name)))),*]
    };
}

/// Names in a site and contents.
pub(crate) const FILES: &[(&str, &str)] = files![
    "index.html",
    "study.css",
    "main.js",
    "answers.js",
    "deck.js",
    "headphones.js",
    "order.js",
    "parts.js",
    "pictures.js",
    "random.js",
    "texts.js",
    "trials.js",
    "walker.js",
];

/// The language, as HTML names it, and the page's texts in it: `language` is one of the page's own, or a JSON file beside the
/// study that is called by its language and has the same texts (`fr.json`).
pub(crate) fn texts(language: &str, from: &Path) -> Result<(String, Texts), Fault> {
    let mut own: BTreeMap<String, Texts> = serde_json::from_str(TEXTS).map_err(FileError::json("texts.json"))?;
    if let Some(texts) = own.remove(language) {
        return Ok((language.to_owned(), texts));
    }
    let known = format!("{} or a file NAME.json", own.keys().cloned().collect::<Vec<_>>().join(", "));
    let name = language.strip_suffix(".json").ok_or_else(|| Fault::argument("language", known, language))?;
    let path = from.join(language);
    let bytes = file::read(&path, MOST_BYTES).map_err(FileError::read(&path))?;
    let texts: Texts = serde_json::from_slice(&bytes).map_err(FileError::json(&path))?;
    match own.values().flat_map(BTreeMap::keys).find(|name| !texts.contains_key(*name)) {
        Some(missing) => Err(FileError::content(&path, format_args!("a text {missing:?}"), "none")),
        None => Ok((name.rsplit(['/', '\\']).next().unwrap_or(name).to_owned(), texts)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The values that a text takes, such as `{number}`.
    fn values(text: &str) -> Vec<&str> {
        let mut found: Vec<&str> = text.split('{').skip(1).filter_map(|rest| rest.split('}').next()).collect();
        found.sort_unstable();
        found
    }

    #[test]
    fn every_language_says_everything_with_the_same_values() {
        let all: BTreeMap<String, Texts> = serde_json::from_str(TEXTS).unwrap();
        let english = &all["en"];
        for (language, texts) in &all {
            assert!(texts.keys().eq(english.keys()), "{language}");
            for (name, text) in texts {
                assert_eq!(values(text), values(&english[name]), "{language}: {name}");
                let names = |name: &str| text.split(", ").count() == 5 || name != "scale";
                assert!(!text.trim().is_empty() && names(name), "{language}: {name}");
            }
        }
    }

    #[test]
    fn the_scripts_ask_for_texts_that_there_are_and_for_all_of_them() {
        let all: BTreeMap<String, Texts> = serde_json::from_str(TEXTS).unwrap();
        let scripts: String = FILES.iter().map(|(_, script)| *script).collect();
        let calls = scripts.match_indices("text(\"").filter(|(at, _)| !scripts[..*at].ends_with(char::is_alphanumeric));
        for name in calls.filter_map(|(at, call)| scripts[at + call.len()..].split('"').next()) {
            assert!(all["en"].contains_key(name), "{name:?} is asked for");
        }
        for name in all["en"].keys().filter(|name| !name.contains("question")) {
            assert!(scripts.contains(&format!("\"{name}\"")), "nobody asks for {name:?}");
        }
    }

    #[test]
    fn a_language_of_ones_own_has_all_texts() {
        let folder = tempfile::tempdir().unwrap();
        let of = |language: &str| texts(language, folder.path()).map(|(name, _)| name).map_err(|error| error.to_string());
        assert_eq!(of("de").unwrap(), "de");
        assert!(of("fr").unwrap_err().contains("expected de, en or a file NAME.json, found fr"));
        let mut own = texts("en", folder.path()).unwrap().1;
        std::fs::write(folder.path().join("fr.json"), serde_json::to_string(&own).unwrap()).unwrap();
        assert_eq!(of("fr.json").unwrap(), "fr");
        own.remove("play");
        std::fs::write(folder.path().join("fr.json"), serde_json::to_string(&own).unwrap()).unwrap();
        assert!(of("fr.json").unwrap_err().contains("fr.json: expected a text \"play\", found none"));
    }
}
