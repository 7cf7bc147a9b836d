//! Tests that need a library of scenes and a home of their own.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

/// The variable that names folders of scenes.
const FOLDERS: &str = "PROMENADE_SCENES";

/// Runs the calling test again in a process whose library and home are a folder of its own, filled by `fill`, and there `test`.
/// Returns the log of that process; in it there is none.
///
/// # Panics
/// The test fails there.
pub fn in_library(fill: impl FnOnce(&Path), test: impl FnOnce(&Path)) -> Option<String> {
    if let Some(folder) = env::var_os(FOLDERS).map(PathBuf::from) {
        test(&folder);
        return None;
    }
    let name = std::thread::current().name().expect("a test's thread has its name").to_owned();
    let folder = env::temp_dir().join(format!("promenade-{}-{}", name.replace("::", "-"), std::process::id()));
    fs::create_dir_all(&folder).expect("the folder for temporary files can be written");
    fill(&folder);
    let this = env::current_exe().expect("a test has its own file");
    let again = Command::new(this)
        .args(["--exact", "--include-ignored", &name])
        .env(FOLDERS, &folder)
        .env("HOME", &folder)
        .output()
        .expect("a test can be run again");
    fs::remove_dir_all(&folder).expect("the folder is still there");
    let text = String::from_utf8_lossy(&again.stdout);
    let log = String::from_utf8_lossy(&again.stderr).into_owned();
    assert!(again.status.success() && text.contains("1 passed"), "{text}\n{log}");
    Some(log)
}
