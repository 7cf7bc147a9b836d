//! Sets of responses written as WAV files with a manifest.

use super::{Response, Responses};
use crate::{BakeError, Split, atomic, wav};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Name of the file that makes a folder a set.
pub(crate) const MANIFEST: &str = "responses.json";

/// A `responses.json` as it is written here.
#[derive(Default, Deserialize, Serialize)]
pub(crate) struct Manifest {
    pub(crate) title: String,
    pub(crate) credit: String,
    pub(crate) licence: String,
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub(crate) note: String,
    pub(crate) responses: Vec<Entry>,
}

#[derive(Deserialize, Serialize)]
pub(crate) struct Entry {
    pub(crate) file: String,
    listener: Listener,
    source: [f32; 3],
    #[serde(default, skip_serializing_if = "Option::is_none")]
    split: Option<Split>,
}

#[derive(Deserialize, Serialize)]
struct Listener {
    position: [f32; 3],
    /// Yaw, pitch and roll, degrees.
    ypr: [f32; 3],
}

impl Manifest {
    /// Makes a folder of WAV files a set.
    pub(crate) fn write(&self, folder: &Path) -> Result<(), BakeError> {
        let path = folder.join(MANIFEST);
        let json = serde_json::to_string_pretty(self).map_err(BakeError::json(&path))?;
        atomic::replace(&path, (json + "\n").as_bytes())
    }
}

impl Responses {
    /// Writes a WAV file of 32-bit floats for each response and a `responses.json`, as [`Responses::load`] reads them, into a
    /// folder, which is made where it does not exist. Files of the same names are replaced.
    ///
    /// # Errors
    /// No responses, a sample rate that is no whole number, two responses of one name, or a file that cannot be written. The
    /// manifest comes last: without it the folder is no set.
    pub fn save(&self, folder: &Path) -> Result<(), BakeError> {
        let rate = self.sample_rate_hz as u32;
        if f64::from(rate) != self.sample_rate_hz {
            return Err(BakeError::argument("sample rate", "whole hertz, for WAV files", self.sample_rate_hz));
        }
        let files: Vec<String> = self.responses.iter().map(file_name).collect();
        let mut names: Vec<&String> = files.iter().collect();
        names.sort();
        if let Some(twice) = names.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(BakeError::argument("responses", "a name of its own for each", format!("{} twice", twice[0])));
        }
        if files.is_empty() {
            return Err(BakeError::argument("responses", "at least one", "none"));
        }
        std::fs::create_dir_all(folder).map_err(promenade_audio::FileError::write(folder))?;
        for (response, file) in self.responses.iter().zip(&files) {
            wav::write(&folder.join(file), rate, &[&response.left, &response.right], wav::Format::Float32)?;
        }
        let manifest = Manifest {
            title: self.title.clone(),
            credit: self.credit.clone(),
            licence: self.licence.clone(),
            note: self.notes.join("; "),
            responses: self.responses.iter().zip(files).map(|(response, file)| self.entry(response, file)).collect(),
        };
        manifest.write(folder)
    }

    fn entry(&self, response: &Response, file: String) -> Entry {
        let (yaw, pitch, roll) = response.listener.ypr();
        let listener =
            Listener { position: response.listener.position.to_array(), ypr: [yaw, pitch, roll].map(f32::to_degrees) };
        let split = self.splits.get(&response.name).copied();
        Entry { file, listener, source: response.source.to_array(), split }
    }
}

/// The response's name as a name of a file.
fn file_name(response: &Response) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '_' };
    response.name.chars().map(plain).collect::<String>() + ".wav"
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LoadOptions;
    use promenade_core::Pose;
    use promenade_core::glam::Vec3;

    fn set() -> Responses {
        let response = |i: usize| Response {
            listener: Pose::from_ypr(Vec3::new(0.1, 0.2 * i as f32, 1.3), 2.0 - i as f32, -0.4, 0.3),
            source: Vec3::new(3.0, 0.7, 1.1),
            left: (0..50).map(|n| 1.5 / (n + i + 1) as f32).collect(),
            right: (0..50).map(|n| 0.3 / (n + i + 1) as f32 - 0.02).collect(),
            name: format!("pose {i}"),
        };
        Responses {
            title: "Box".to_owned(),
            credit: "Who \"measured\"".to_owned(),
            licence: "MIT".to_owned(),
            sample_rate_hz: 22_050.0,
            responses: (0..4).map(response).collect(),
            notes: vec!["simulated".to_owned()],
            splits: [("pose 1".to_owned(), Split::Test)].into(),
            ..Responses::default()
        }
    }

    #[test]
    fn a_folder_gives_back_what_was_written() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path().join("new/box");
        set().save(&folder).unwrap();
        let back = Responses::load(&folder, &LoadOptions::default()).unwrap();
        assert_eq!((&back.title, &back.credit, back.sample_rate_hz), (&set().title, &set().credit, 22_050.0));
        for (a, b) in back.responses.iter().zip(&set().responses) {
            assert_eq!((&a.left, &a.right, a.source), (&b.left, &b.right, b.source), "{}", a.name);
            assert_eq!(a.listener.position, b.listener.position);
            assert!(a.listener.orientation.angle_between(b.listener.orientation) < 1e-3);
            assert_eq!(a.name, b.name.replace(' ', "_"));
        }
        assert_eq!(back.responses.len(), 4);
        assert_eq!(back.splits, [("pose_1".to_owned(), Split::Test)].into());
    }

    #[test]
    fn what_makes_no_folder_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let refused = |change: fn(&mut Responses), says: &str| {
            let mut set = set();
            change(&mut set);
            let error = set.save(folder.path()).unwrap_err().to_string();
            assert!(error.contains(says), "{error}");
            assert!(!folder.path().join("responses.json").exists());
        };
        refused(|s| s.sample_rate_hz = 22_050.5, "sample rate: expected whole hertz");
        refused(|s| s.responses[1].name = s.responses[0].name.clone(), "found pose_0.wav twice");
        refused(|s| s.responses.clear(), "expected at least one");
    }
}
