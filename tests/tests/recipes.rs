//! The recipes of `docs/recipes.md` name the places that there are.

use promenade_tests::sources;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::process::Command;

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

/// The paths in the first column of each recipe's table, by the recipe's title.
fn places() -> BTreeMap<String, BTreeSet<String>> {
    let text = fs::read_to_string(root().join("docs/recipes.md")).unwrap();
    let mut found: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    let mut title = String::new();
    for line in text.lines() {
        if let Some(heading) = line.strip_prefix("### ") {
            title = heading.to_owned();
        } else if let Some(row) = line.strip_prefix("| `").filter(|_| !title.is_empty()) {
            let column = row.split('|').next().unwrap_or_default();
            let paths = column.split('`').filter(|name| name.contains('/')).map(str::to_owned);
            found.entry(title.clone()).or_default().extend(paths);
        }
    }
    found
}

#[test]
fn recipes_name_files_that_there_are() {
    let all = places();
    assert!(all.len() > 5 && all.contains_key("Add a property of a material"), "{:?}", all.keys());
    for (title, paths) in all {
        for path in paths.iter().filter(|path| !path.contains("NAME")) {
            assert!(root().join(path).exists(), "{title}: {path}");
        }
    }
}

#[test]
fn a_property_of_materials_is_where_its_recipe_says() {
    let listed = &places()["Add a property of a material"];
    let mut reading = BTreeSet::new();
    for name in ["acoustics", "baker", "cli", "plugin", "room"] {
        for source in sources::of_crate(&sources::folder(name)).values().filter(|source| source.members.contains("scattering"))
        {
            let file = source.file.strip_prefix(root()).unwrap();
            reading.insert(file.to_string_lossy().replace('\\', "/"));
        }
    }
    assert!(reading.contains("crates/acoustics/src/images/image.rs"), "{reading:?}");
    let missing: Vec<&String> = reading.difference(listed).collect();
    assert!(missing.is_empty(), "the recipe leaves out {missing:?}");
}

/// What names one thing of a kind is in the places that the recipe for another of that kind lists, files or folders.
fn check(title: &str, words: &[&str]) {
    let listed = Command::new("git").args(["ls-files", "-z"]).current_dir(root()).output().expect("git runs");
    assert!(listed.status.success(), "{}", String::from_utf8_lossy(&listed.stderr));
    let names = String::from_utf8(listed.stdout).unwrap();
    let apart = |name: &&str| !["", "CHANGELOG.md", "docs/recipes.md", "tests/tests/recipes.rs"].contains(name);
    let holds = |name: &&str| {
        let bytes = fs::read(root().join(name)).unwrap_or_default();
        let text = String::from_utf8_lossy(&bytes);
        words.iter().any(|word| text.contains(word))
    };
    let named: Vec<&str> = names.split('\0').filter(apart).filter(holds).collect();
    assert!(named.len() > 2, "{words:?} are in {named:?} alone");
    let places = &places()[title];
    let missing: Vec<_> = named.iter().filter(|file| !places.iter().any(|place| file.starts_with(place.as_str()))).collect();
    assert!(missing.is_empty(), "the recipe \"{title}\" leaves out {missing:?}");
}

#[test]
fn a_parameter_is_where_its_recipe_says() {
    check("Add a parameter", &["LowCut", "low_cut", "lowcut", "Low Cut"]);
}

#[test]
fn a_tracker_format_is_where_its_recipe_says() {
    check("Add a tracker format", &["Supperware", "SUPPERWARE"]);
}
