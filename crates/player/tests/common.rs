//! Running the program.

use std::path::PathBuf;
use std::process::{Command, Output};

pub(crate) fn player(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_promenade-player")).args(args).output().unwrap()
}

/// Succeeds; what it says comes back, of standard output and standard error.
pub(crate) fn succeeds(args: &[&str]) -> (String, String) {
    let out = player(args);
    let [stdout, stderr] = [out.stdout, out.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
    assert!(out.status.success(), "{args:?}: {stderr}");
    (stdout, stderr)
}

/// A scene of the presets.
pub(crate) fn scene(name: &str) -> String {
    let path: PathBuf = [env!("CARGO_MANIFEST_DIR"), "../../presets/scenes", name].iter().collect();
    path.to_str().unwrap().to_owned()
}
