//! What holds for the repository's files themselves.

use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Files of a folder and those below it that end in `.rs`, without what is built.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let paths = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let (folders, files): (Vec<_>, Vec<_>) = paths.partition(|path| path.is_dir());
    let built = |path: &PathBuf| path.join("CACHEDIR.TAG").exists();
    let below = folders.into_iter().filter(|folder| !built(folder)).flat_map(|folder| sources(&folder));
    files.into_iter().filter(|path| path.extension().is_some_and(|ending| ending == "rs")).chain(below).collect()
}

/// A package that lists its test programs finds no others: a file that none of them includes would never run.
#[test]
fn every_file_of_tests_is_run() {
    let mut count = 0;
    for entry in fs::read_dir(root()).unwrap() {
        let package = entry.unwrap().path();
        let manifest = fs::read_to_string(package.join("Cargo.toml")).unwrap_or_default();
        if !manifest.contains("autotests = false") {
            continue;
        }
        let all = fs::read_to_string(package.join("tests/all.rs")).unwrap();
        for entry in fs::read_dir(package.join("tests")).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_stem().unwrap().to_str().unwrap();
            let of_all = all.lines().any(|line| line == format!("mod {name};"));
            let program = manifest.contains(&format!("[[test]]\nname = \"{name}\"\n"));
            assert!(of_all != program, "{}: expected in tests/all.rs or in Cargo.toml, once", path.display());
            count += 1;
        }
    }
    assert!(count > 70, "only {count} files are found");
}
