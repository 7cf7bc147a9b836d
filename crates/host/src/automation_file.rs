//! Automation in a file, as people write it.

use crate::Fault;
use crate::automation::{Lane, Point};
use crate::instance::Instance;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use serde_json::Value;
use std::fmt;
use std::path::{Path, PathBuf};

/// The longest automation file that is read, bytes.
pub const MAX_AUTOMATION_BYTES: u64 = 1 << 26;

/// An automation file as it is written, for any plugin.
///
/// `{"parameters": {"Yaw": [{"t": 0.0, "value": "-60 deg"}, {"t": 2.5, "value": 60}]}}`: parameters by name, or by number;
/// times in seconds; values as texts or numbers that the plugin understands, or as `{"normalized": 0.5}`; `"hold": true` on a
/// point keeps its value until the next.
#[derive(Clone, Debug)]
pub struct AutomationFile {
    path: PathBuf,
    parameters: Vec<(String, Vec<Entry>)>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Form {
    parameters: Entries,
}

/// In the order of the file, and with a name as often as it is there.
struct Entries(Vec<(String, Vec<Entry>)>);

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    t: f64,
    value: Value,
    #[serde(default)]
    hold: bool,
}

impl<'de> Deserialize<'de> for Entries {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Pairs;
        impl<'de> Visitor<'de> for Pairs {
            type Value = Entries;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object with a list of points for each parameter")
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Entries, A::Error> {
                let mut all = Vec::new();
                while let Some(pair) = map.next_entry()? {
                    all.push(pair);
                }
                Ok(Entries(all))
            }
        }
        deserializer.deserialize_map(Pairs)
    }
}

impl AutomationFile {
    /// Reads the bytes of a file, whose path errors name.
    ///
    /// # Errors
    /// No JSON of the form.
    pub fn read(path: &Path, bytes: &[u8]) -> Result<Self, Fault> {
        const FORM: &str = r#"expected {"parameters": {NAME: [{"t": SECONDS, "value": VALUE}, ...]}}"#;
        let form: Form = serde_json::from_slice(bytes).map_err(Fault::at(path, FORM))?;
        Ok(Self { path: path.to_path_buf(), parameters: form.parameters.0 })
    }

    /// The automation for a plugin, at its sample rate.
    ///
    /// # Errors
    /// A parameter that the plugin has not, or that is there twice or may not be automated; times that do not rise; a value
    /// that the plugin does not understand.
    pub fn lanes(&self, instance: &mut Instance) -> Result<Vec<Lane>, Fault> {
        let mut lanes: Vec<Lane> = Vec::new();
        for (name, entries) in &self.parameters {
            let lane =
                lane(instance, name, entries, &lanes).map_err(Fault::at(&self.path, format_args!("parameter {name:?}")))?;
            lanes.push(lane);
        }
        Ok(lanes)
    }
}

fn lane(instance: &mut Instance, name: &str, entries: &[Entry], others: &[Lane]) -> Result<Lane, Fault> {
    let parameter = instance.parameter(name)?.clone();
    if others.iter().any(|lane| lane.id() == parameter.id) {
        return Err(Fault::unexpected("each parameter once", "a second time"));
    }
    if !parameter.automatable {
        let found = "one that may not; set it before the start instead";
        return Err(Fault::unexpected("a parameter that may be automated", found));
    }
    let mut points = Vec::with_capacity(entries.len());
    for (number, entry) in entries.iter().enumerate() {
        let value = value(instance, parameter.id, &entry.value, number)?;
        points.push(Point { seconds: entry.t, value, hold: entry.hold });
    }
    Lane::new(&parameter, &points, instance.setup().rate)
}

/// A value as it is written, 0 to 1.
fn value(instance: &mut Instance, id: u32, written: &Value, number: usize) -> Result<f64, Fault> {
    match written {
        Value::String(text) => instance.from_text(id, text),
        // As a text it is in the unit that the plugin shows, which hosts cannot compute with.
        Value::Number(plain) => instance.from_text(id, &plain.to_string()),
        Value::Object(object) if object.len() == 1 && object.get("normalized").is_some_and(Value::is_number) => {
            Ok(object["normalized"].as_f64().unwrap_or(f64::NAN))
        }
        other => {
            let expected = format!("a text, a number or {{\"normalized\": 0 to 1}} as the value of point {number}");
            Err(Fault::unexpected(expected, other))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<AutomationFile, Fault> {
        AutomationFile::read(Path::new("moves.json"), text.as_bytes())
    }

    #[test]
    fn keeps_the_order_and_every_form_of_a_value() {
        let file = read(
            r#"{"parameters": {"Yaw": [{"t": 0, "value": "-60 deg"}, {"t": 2.5, "value": 60, "hold": true}],
                "12": [{"t": 1, "value": {"normalized": 0.5}}], "Yaw": []}}"#,
        );
        let file = file.unwrap();
        assert_eq!(file.parameters.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), ["Yaw", "12", "Yaw"]);
        assert!(file.parameters[0].1[1].hold && !file.parameters[0].1[0].hold);
    }

    #[test]
    fn says_where_the_form_is_not_kept() {
        for (text, said) in [
            ("", "EOF"),
            (r#"{"parameter": {}}"#, "unknown field `parameter`"),
            (r#"{"parameters": []}"#, "an object with a list of points"),
            (r#"{"parameters": {"Yaw": [{"t": 0}]}}"#, "missing field `value`"),
            (r#"{"parameters": {"Yaw": [{"t": "0", "value": 1}]}}"#, "invalid type"),
            (r#"{"parameters": {"Yaw": [{"t": 0, "value": 1, "curve": 2}]}}"#, "unknown field `curve`"),
        ] {
            let error = read(text).unwrap_err();
            let source = std::error::Error::source(&error).unwrap().to_string();
            assert!(source.contains(said), "{text}: {source}");
            assert!(error.to_string().contains("moves.json: expected {\"parameters\""), "{error}");
        }
    }
}
