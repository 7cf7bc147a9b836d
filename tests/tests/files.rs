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
    for name in promenade_tests::sources::members() {
        let package = promenade_tests::sources::folder(&name);
        let manifest = fs::read_to_string(package.join("Cargo.toml")).unwrap_or_default();
        if !manifest.contains("autotests = false") {
            continue;
        }
        let all = fs::read_to_string(package.join("tests/all.rs")).unwrap();
        for entry in fs::read_dir(package.join("tests")).unwrap() {
            let path = entry.unwrap().path();
            let is_module = path.extension().is_some_and(|ending| ending == "rs") || path.join("mod.rs").exists();
            if !is_module {
                continue;
            }
            let name = path.file_stem().unwrap().to_str().unwrap();
            let of_all = all.lines().any(|line| line == format!("mod {name};"));
            let program = manifest.contains(&format!("[[test]]\nname = \"{name}\"\n"));
            assert!(of_all != program, "{}: expected in tests/all.rs or in Cargo.toml, once", path.display());
            count += 1;
        }
    }
    assert!(count > 70, "only {count} files are found");
}

/// As `rustfmt.toml` says; rustfmt itself leaves comments and strings as they are.
const COLUMNS: usize = 128;

#[test]
fn lines_of_code_are_at_most_128_columns_wide() {
    let limit = format!("max_width = {COLUMNS}");
    let format = fs::read_to_string(root().join("rustfmt.toml")).unwrap();
    assert!(format.lines().any(|line| line == limit), "rustfmt.toml says another width");
    let (mut count, mut wide) = (0, Vec::new());
    for path in sources(&root()) {
        count += 1;
        let text = fs::read_to_string(&path).unwrap();
        for (number, line) in text.lines().enumerate().filter(|(_, line)| line.chars().count() > COLUMNS) {
            wide.push(format!("{}:{}: {} columns", path.display(), number + 1, line.chars().count()));
        }
    }
    assert!(count > 500, "only {count} files are found");
    assert!(wide.is_empty(), "expected lines of at most {COLUMNS} columns, found\n{}", wide.join("\n"));
}
