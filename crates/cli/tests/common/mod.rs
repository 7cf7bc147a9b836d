//! What the tests of the command line share: running it, and a place to run it in.

#![allow(dead_code, unreachable_pub, reason = "each test uses a part of it")]

use promenade_baker::wav::{self, Format};
use promenade_testing::Noise;
use std::path::PathBuf;
use std::process::{Command, Output};

pub const RATE: u32 = 16_000;

pub fn promenade(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_promenade")).args(args).output().unwrap()
}

pub fn succeeds(args: &[&str]) -> (String, String) {
    let out = promenade(args);
    let (stdout, stderr) = (String::from_utf8(out.stdout).unwrap(), String::from_utf8(out.stderr).unwrap());
    assert!(out.status.success(), "{args:?}: {stderr}");
    (stdout, stderr)
}

/// What it prints as JSON.
pub fn json(args: &[&str]) -> serde_json::Value {
    serde_json::from_str(&succeeds(args).0).unwrap()
}

/// A checkpoint that the tests of the import read.
pub fn checkpoint(name: &str) -> String {
    concat!(env!("CARGO_MANIFEST_DIR"), "/../baker/tests/checkpoint/").to_owned() + name
}

/// Each fails as [`fails`] has it, with a line that contains the text beside it.
pub fn all_fail(cases: &[(Vec<&str>, &str)]) {
    for (args, clue) in cases {
        let said = fails(args);
        assert!(said.contains(clue), "{args:?}: {said}");
    }
}

/// Fails with status 1 and one line, which is returned.
pub fn fails(args: &[&str]) -> String {
    let out = promenade(args);
    let said = String::from_utf8(out.stderr).unwrap();
    assert_eq!(out.status.code(), Some(1), "{args:?}: {said}");
    let line = said.lines().last().unwrap_or_default().to_owned();
    assert!(line.starts_with("error: "), "{args:?}: {said}");
    assert!(!said.contains("panicked"), "{said}");
    line
}

/// A folder with a small synthetic room: the head turns, the source stays 2 m ahead.
pub struct Place {
    /// Where it is.
    pub folder: tempfile::TempDir,
}

impl Place {
    pub fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let count = RATE as usize / 2;
        let mut noise = Noise::new(1);
        for yaw in (-90..=90).step_by(15) {
            // The source is on the left when the head is turned to the right.
            let side = -(yaw as f32).to_radians().sin();
            let ear = |sign: f32, noise: &mut Noise| -> Vec<f32> {
                let arrival = 40.0 - sign * side * 5.0;
                (0..count)
                    .map(|i| {
                        let t = i as f32 - arrival;
                        let direct = (1.0 + 0.6 * sign * side) * (-0.5 * (t / 0.8).powi(2)).exp();
                        let tail = if t > 20.0 { 0.03 * (-6.9 * t / (0.3 * RATE as f32)).exp() * noise.value() } else { 0.0 };
                        direct + tail
                    })
                    .collect()
            };
            let (left, right) = (ear(1.0, &mut noise), ear(-1.0, &mut noise));
            wav::write(&folder.path().join(format!("turn_{yaw}.wav")), RATE, &[&left, &right], Format::Float32).unwrap();
        }
        let manifest = r#"{"title":"test room","credit":"nobody","licence":"CC0","pattern":"turn_{yaw}.wav","source":[2,0,0]}"#;
        std::fs::write(folder.path().join("responses.json"), manifest).unwrap();
        Self { folder }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn text(&self, name: &str) -> String {
        self.path(name).to_str().unwrap().to_owned()
    }

    pub fn bake(&self) -> String {
        let scene = self.text("room.promenade");
        succeeds(&["bake", "responses", self.folder.path().to_str().unwrap(), "-o", &scene, "--hold-out", "yaw=-30..30/30"]);
        scene
    }

    pub fn dry(&self, name: &str, seconds: f32, channels: usize) -> String {
        let count = (seconds * RATE as f32) as usize;
        let x: Vec<f32> = (0..count).map(|i| 0.3 * (i as f32 * 0.21).sin() * (1.0 - i as f32 / count as f32)).collect();
        wav::write(&self.path(name), RATE, &vec![&x[..]; channels], Format::Int16).unwrap();
        self.text(name)
    }

    /// Names in the folder, to see what was left behind.
    pub fn names(&self) -> Vec<String> {
        let mut names: Vec<String> = std::fs::read_dir(self.folder.path())
            .unwrap()
            .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }
}

pub fn rms(x: &[f32]) -> f32 {
    (x.iter().map(|v| v * v).sum::<f32>() / x.len().max(1) as f32).sqrt()
}
