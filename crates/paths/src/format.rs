//! The forms that a path has in files.

use crate::PathFileError;
use crate::sound_file::is_wave;

/// What a path was read from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Keyframes in JSON.
    Json,
    /// Rows under a head.
    Csv,
    /// Cameras of a COLMAP model, `images.txt`.
    ColmapText,
    /// Cameras of a COLMAP model, `images.bin`.
    ColmapBinary,
    /// Cameras of NeRF tools, `transforms.json`, or of Record3D, `metadata.json`.
    Transforms,
    /// A camera's trajectory as TUM or KITTI have it.
    Trajectory,
    /// An animation in glTF or GLB.
    Gltf,
    /// An object's moves in a sound file, by the Audio Definition Model.
    Adm,
}

/// What a path can be written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WriteFormat {
    /// Keyframes in JSON.
    Json,
    /// Rows under a head.
    Csv,
}

/// What is said where no form fits.
const ANY: &str = "a camera path: JSON, CSV, COLMAP's images.txt or images.bin, a transforms.json, a trajectory of \
     TUM or KITTI, glTF, or a sound file with ADM";

impl Format {
    /// Name in texts.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Json => "JSON",
            Self::Csv => "CSV",
            Self::ColmapText => "COLMAP text",
            Self::ColmapBinary => "COLMAP binary",
            Self::Transforms => "NeRF transforms",
            Self::Trajectory => "rows of poses",
            Self::Gltf => "glTF",
            Self::Adm => "ADM",
        }
    }

    pub(crate) fn is_colmap(self) -> bool {
        matches!(self, Self::ColmapText | Self::ColmapBinary)
    }

    /// Whether the poses are a camera's.
    pub(crate) fn is_of_cameras(self) -> bool {
        self.is_colmap() || matches!(self, Self::Transforms | Self::Trajectory)
    }

    /// The form of a file: by the ending of its name where that says it, else by the content.
    pub(crate) fn of(file: &str, bytes: &[u8]) -> Result<Self, PathFileError> {
        match ending(file).as_str() {
            "json" if is_object(bytes) => Ok(Self::Transforms),
            "json" => Ok(Self::Json),
            "csv" | "tsv" => Ok(Self::Csv),
            "wav" | "bw64" | "rf64" if is_wave(bytes) => Ok(Self::Adm),
            "gltf" | "glb" => Ok(Self::Gltf),
            _ => by_content(bytes).ok_or_else(|| PathFileError::content(file, ANY, glance(bytes))),
        }
    }
}

impl WriteFormat {
    /// The form that a file's name asks for.
    ///
    /// # Errors
    /// An ending other than `.json` and `.csv`.
    pub fn of(file: &str) -> Result<Self, PathFileError> {
        match ending(file).as_str() {
            "json" => Ok(Self::Json),
            "csv" => Ok(Self::Csv),
            other => Err(PathFileError::content(file, "a name ending in .json or .csv", format!("the ending \"{other}\""))),
        }
    }
}

fn ending(file: &str) -> String {
    let name = file.rsplit(['/', '\\']).next().unwrap_or_default();
    name.rsplit_once('.').map(|(_, e)| e.to_ascii_lowercase()).unwrap_or_default()
}

/// Whether JSON is an object, as the cameras of NeRF tools are; a path's keyframes are an array.
fn is_object(bytes: &[u8]) -> bool {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    text.trim_ascii_start().starts_with(b"{")
}

fn by_content(bytes: &[u8]) -> Option<Format> {
    if bytes.starts_with(b"glTF") {
        return Some(Format::Gltf);
    }
    if is_wave(bytes) {
        return Some(Format::Adm);
    }
    // The count of images comes first: 0 bytes at its upper end are in no text. Scenes begin with a length too, and then with
    // JSON.
    if bytes.get(..8).is_some_and(|count| count[4..] == [0; 4]) && !bytes[8..].starts_with(b"{\"") {
        return Some(Format::ColmapBinary);
    }
    let text = std::str::from_utf8(bytes).ok()?;
    let lines = text.trim_start_matches('\u{feff}').lines().map(str::trim);
    let first = lines.into_iter().find(|l| !l.is_empty() && !l.starts_with('#'))?;
    let words: Vec<&str> = first.split_whitespace().collect();
    if first.starts_with('[') {
        Some(Format::Json)
    } else if first.starts_with('{') {
        let of_cameras = ["\"transform_matrix\"", "\"camera_to_world\""].iter().any(|key| text.contains(key));
        Some(if of_cameras { Format::Transforms } else { Format::Gltf })
    } else if matches!(words.len(), 8 | 12) && words.iter().all(|word| word.parse::<f64>().is_ok()) {
        Some(Format::Trajectory)
    } else if words.len() >= 10 && words[..9].iter().all(|w| w.parse::<f64>().is_ok()) {
        Some(Format::ColmapText)
    } else if first.split([',', ';', '\t']).any(|cell| cell.trim().trim_matches('"').eq_ignore_ascii_case("t")) {
        Some(Format::Csv)
    } else {
        None
    }
}

/// The beginning of a file in words.
fn glance(bytes: &[u8]) -> String {
    let printable = |b: &&u8| b.is_ascii_graphic() || matches!(b, b' ' | b'\t' | b'\r' | b'\n');
    let start = &bytes[..bytes.len().min(40)];
    if bytes.is_empty() {
        "an empty file".to_owned()
    } else if start.iter().all(|b| printable(&b)) {
        format!("text that begins with {:?}", String::from_utf8_lossy(start))
    } else {
        let hex: Vec<String> = start.iter().take(8).map(|b| format!("{b:02x}")).collect();
        format!("the bytes {}", hex.join(" "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ending_says_it_else_the_content() {
        let images = "# Image list\n# ...\n1 1 0 0 0 0 0 0 1 a.jpg\n\n";
        for (name, bytes, format) in [
            ("walk.JSON", &b""[..], Format::Json),
            ("a.b/walk.csv", b"", Format::Csv),
            ("walk.tsv", b"", Format::Csv),
            ("walk.glb", b"", Format::Gltf),
            ("walk.gltf", b"", Format::Gltf),
            ("images.txt", images.as_bytes(), Format::ColmapText),
            ("poses.txt", b"# a\n1305031102.1 1 2 3 0 0 0 1\n", Format::Trajectory),
            ("00.txt", b"1 0 0 0 0 1 0 0 0 0 1 0\n", Format::Trajectory),
            ("images.bin", &[3, 0, 0, 0, 0, 0, 0, 0, 1], Format::ColmapBinary),
            ("walk", b"\xef\xbb\xbf [{}]", Format::Json),
            ("transforms.json", b"\xef\xbb\xbf\n {}", Format::Transforms),
            ("walk", b"glTF....", Format::Gltf),
            ("walk.txt", b"{\"asset\": {}}", Format::Gltf),
            ("walk", b"{\"frames\": [{\"transform_matrix\": []}]}", Format::Transforms),
            ("walk.txt", b"# mine\n x; y; T\n", Format::Csv),
        ] {
            assert_eq!(Format::of(name, bytes).unwrap(), format, "{name}");
        }
    }

    #[test]
    fn says_what_is_there_instead() {
        for (bytes, clue) in [
            (&b""[..], "found an empty file"),
            (b"hello\n", "found text that begins with \"hello\\n\""),
            (b"RIFF\xff\xfe\0\x01\x02", "found the bytes 52 49 46 46 ff fe 00 01"),
        ] {
            let error = Format::of("walk.wav", bytes).unwrap_err().to_string();
            assert!(error.starts_with("walk.wav: expected a camera path: JSON") && error.ends_with(clue), "{error}");
        }
        let error = WriteFormat::of("out/walk.glb").unwrap_err().to_string();
        assert!(error.contains("expected a name ending in .json or .csv, found the ending \"glb\""), "{error}");
    }
}
