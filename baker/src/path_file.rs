//! Camera paths from files: JSON (`[{"t": 0, "position": [x, y, z], "ypr": [deg, deg, deg]}, ...]`, or `"quat": [w, x, y, z]`) and
//! CSV (header `t,x,y,z,yaw,pitch,roll`). Seconds, metres and degrees.

use crate::BakeError;
use promenade_core::{CameraPath, Keyframe, KeyframeEntry, PathError};
use std::path::Path;

/// Bytes a path file may have.
const MAX_BYTES: u64 = 256 << 20;
/// The columns of a CSV path.
const COLUMNS: [&str; 7] = ["t", "x", "y", "z", "yaw", "pitch", "roll"];

/// Reads a camera path; the ending of the name, `.json` or `.csv`, tells the form.
///
/// # Errors
/// A file that cannot be read, another ending, a line or entry that is no keyframe, or keyframes that make no path. The message
/// names the file and the line or entry.
pub fn read(path: &Path) -> Result<CameraPath, BakeError> {
    let size = std::fs::metadata(path).map_err(BakeError::read(path))?.len();
    if size > MAX_BYTES {
        return Err(BakeError::content(path, format!("at most {MAX_BYTES} bytes"), format!("{size}")));
    }
    let ending = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let text = || std::fs::read_to_string(path).map_err(BakeError::read(path));
    let entries = match ending.as_str() {
        "json" => serde_json::from_str(&text()?).map_err(|source| BakeError::Json { path: path.to_path_buf(), source })?,
        "csv" => from_csv(path, &text()?)?,
        _ => return Err(BakeError::content(path, "a camera path ending in .json or .csv", format!("the ending \"{ending}\""))),
    };
    camera_path(&entries).map_err(|source| BakeError::CameraPath { path: path.to_path_buf(), source })
}

fn camera_path(entries: &[KeyframeEntry]) -> Result<CameraPath, PathError> {
    let keyframes = entries.iter().enumerate().map(|(index, e)| e.to_keyframe(index));
    CameraPath::new(keyframes.collect::<Result<Vec<Keyframe>, _>>()?)
}

fn from_csv(path: &Path, text: &str) -> Result<Vec<KeyframeEntry>, BakeError> {
    let mut lines = text.lines().enumerate().map(|(i, l)| (i + 1, l.trim())).filter(|(_, l)| !l.is_empty());
    let header = lines.next().map_or("", |(_, l)| l).trim_start_matches('\u{feff}');
    if !header.split(',').map(str::trim).eq(COLUMNS) {
        return Err(BakeError::entry(path, "line 1", format!("the header \"{}\"", COLUMNS.join(",")), format!("\"{header}\"")));
    }
    let keyframe = |(number, line): (usize, &str)| {
        let mut values = [0.0_f64; 7];
        let fields: Vec<&str> = line.split(',').map(str::trim).collect();
        if fields.len() != values.len() {
            return Err(BakeError::entry(path, format!("line {number}"), "7 numbers", format!("{} fields", fields.len())));
        }
        for ((value, field), column) in values.iter_mut().zip(fields).zip(COLUMNS) {
            *value = field.parse().map_err(|_| {
                BakeError::entry(path, format!("line {number}"), format!("a number for {column}"), format!("\"{field}\""))
            })?;
        }
        #[expect(clippy::cast_possible_truncation, reason = "positions and angles are f32 inside")]
        let [x, y, z, yaw, pitch, roll] = [1, 2, 3, 4, 5, 6].map(|i| values[i] as f32);
        Ok(KeyframeEntry { t: values[0], position: [x, y, z], ypr: Some([yaw, pitch, roll]), quat: None })
    };
    lines.map(keyframe).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_core::glam::Vec3;

    fn parse(name: &str, text: &str) -> Result<CameraPath, String> {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join(name);
        std::fs::write(&file, text).unwrap();
        read(&file).map_err(|e| format!("{e}: {}", std::error::Error::source(&e).map(ToString::to_string).unwrap_or_default()))
    }

    #[test]
    fn both_forms_say_the_same() {
        let json =
            parse("p.json", r#"[{"t":0,"position":[1,2,3],"ypr":[90,10,-5]},{"t":2.5,"position":[0,0,1],"quat":[1,0,0,0]}]"#)
                .unwrap();
        let csv = parse("p.csv", "t, x, y, z, yaw, pitch, roll\n0,1,2,3,90,10,-5\n\n2.5,0,0,1,0,0,0\n").unwrap();
        assert_eq!(json, csv);
        let ahead = json.keyframes()[0].pose.orientation * Vec3::X;
        assert!(ahead.y > 0.9 && ahead.z > 0.1, "yaw is to the left, pitch is up: {ahead}");
    }

    #[test]
    fn errors_name_the_place() {
        for (name, text, clue) in [
            ("p.csv", "time,x\n", "line 1"),
            ("p.csv", "", "line 1"),
            (
                "p.csv",
                "t,x,y,z,yaw,pitch,roll\n0,0,0,0,0,0,0\n1,0,zero,0,0,0,0\n",
                "line 3: expected a number for y, found \"zero\"",
            ),
            ("p.csv", "t,x,y,z,yaw,pitch,roll\n0,0,0\n", "line 2: expected 7 numbers, found 3 fields"),
            ("p.csv", "t,x,y,z,yaw,pitch,roll\n0,NaN,0,0,0,0,0\n", "keyframe 0"),
            ("p.csv", "t,x,y,z,yaw,pitch,roll\n", "none"),
            ("p.json", "[]", "none"),
            ("p.json", "[{\"t\":0}]", "line 1 column"),
            ("p.json", r#"[{"t":0,"position":[0,0,0]}]"#, "keyframe 0: expected an orientation"),
            ("p.json", r#"[{"t":0,"position":[0,0,0],"quat":[2,0,0,0]}]"#, "length 2"),
            ("p.json", r#"[{"t":0,"position":[0,0,0],"ypr":[0,0,0],"speed":1}]"#, "unknown field"),
            ("p.json", r#"[{"t":1,"position":[0,0,0],"ypr":[0,0,0]},{"t":1,"position":[0,0,0],"ypr":[0,0,0]}]"#, "keyframe 1"),
            ("p.txt", "", ".json or .csv"),
        ] {
            let error = parse(name, text).unwrap_err();
            assert!(error.contains(clue), "{text:?}: {error}");
        }
    }
}
