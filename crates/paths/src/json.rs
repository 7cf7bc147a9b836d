//! Paths in JSON: `[{"t": 0, "position": [x, y, z], "ypr": [yaw, pitch, roll]}, ...]`, or `"quat": [w, x, y, z]`.

use crate::PathFileError;
use crate::text::{self, decimal};
use crate::waypoint::{Track, Waypoint, to_degrees};
use promenade_core::{CameraPath, KeyframeEntry, MAX_KEYFRAMES};
use serde::Deserialize;
use serde::de::{Deserializer, Error, SeqAccess, Visitor};
use std::fmt;

/// Keyframes in JSON, at most [`MAX_KEYFRAMES`].
struct Entries(Vec<KeyframeEntry>);

impl<'de> Deserialize<'de> for Entries {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Limited;
        impl<'de> Visitor<'de> for Limited {
            type Value = Entries;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an array of keyframes")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut entries: A) -> Result<Entries, A::Error> {
                let mut kept = Vec::new();
                while let Some(entry) = entries.next_element()? {
                    if kept.len() == MAX_KEYFRAMES {
                        return Err(A::Error::custom(format_args!("expected at most {MAX_KEYFRAMES} keyframes, found more")));
                    }
                    kept.push(entry);
                }
                Ok(Entries(kept))
            }
        }
        deserializer.deserialize_seq(Limited)
    }
}

pub(crate) fn read(file: &str, bytes: &[u8]) -> Result<Track, PathFileError> {
    let Entries(entries) = serde_json::from_str(text::of(file, bytes)?).map_err(PathFileError::json(file))?;
    let waypoint = |(index, entry): (usize, &KeyframeEntry)| entry.to_keyframe(index).map(|k| Waypoint::at(k.t_s, &k.pose));
    let waypoints = entries.iter().enumerate().map(waypoint).collect::<Result<_, _>>();
    let waypoints = waypoints.map_err(PathFileError::at(file, "no camera path"))?;
    Ok(Track { waypoints, place: Box::new(|index| format!("keyframe {index}")), notes: Vec::new() })
}

pub(crate) fn write(path: &CameraPath) -> String {
    let list = |values: &[String]| format!("[{}]", values.join(", "));
    let row = |k: &promenade_core::Keyframe| {
        let position = list(&k.pose.position.to_array().map(|v| (v + 0.0).to_string()));
        let ypr = list(&to_degrees(k.pose.orientation).map(decimal));
        format!("  {{\"t\": {}, \"position\": {position}, \"ypr\": {ypr}}}", k.t_s + 0.0)
    };
    let rows: Vec<String> = path.keyframes().iter().map(row).collect();
    format!("[\n{}\n]\n", rows.join(",\n"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fails(json: &str) -> String {
        let error = read("p.json", json.as_bytes()).and_then(|t| t.path("p.json")).unwrap_err();
        format!("{error}: {}", std::error::Error::source(&error).map(ToString::to_string).unwrap_or_default())
    }

    #[test]
    fn errors_name_the_place() {
        for (json, clue) in [
            ("", "p.json: not the JSON that is expected here: EOF while parsing"),
            ("[]", "p.json: no camera path: a camera path needs at least one keyframe, found none"),
            ("{}", "expected an array of keyframes at line 1"),
            ("[\n{\"t\":0}]", "line 2 column"),
            (r#"[{"t":0,"position":[0,0,0]}]"#, "keyframe 0: expected an orientation"),
            (r#"[{"t":0,"position":[0,0,0],"quat":[2,0,0,0]}]"#, "length 2"),
            (r#"[{"t":0,"position":[0,0,0],"ypr":[0,0,0],"speed":1}]"#, "unknown field"),
            (r#"[{"t":0,"position":[0,1e39,0],"ypr":[0,0,0]}]"#, "p.json: keyframe 0: expected a finite pose"),
            (
                r#"[{"t":1,"position":[0,0,0],"ypr":[0,0,0]},{"t":1,"position":[0,0,0],"ypr":[0,0,0]}]"#,
                "p.json: keyframe 1: expected a time after 1 s, that of keyframe 0, found 1 s",
            ),
        ] {
            let error = fails(json);
            assert!(error.contains(clue), "{json}: {error}");
        }
    }

    #[test]
    fn there_are_not_too_many() {
        let entry = r#"{"t":0,"position":[0,0,0],"ypr":[0,0,0]}"#;
        let json = format!("[{}{entry}]", format!("{entry},").repeat(MAX_KEYFRAMES));
        assert!(fails(&json).contains("expected at most 1000000 keyframes, found more"));
    }
}
