//! The recipes of `docs/recipes.md` name the places that there are.

use promenade_tests::sources;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

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
        for source in sources::of_crate(&root().join(name)).values().filter(|source| source.members.contains("scattering")) {
            let file = source.file.strip_prefix(root()).unwrap();
            reading.insert(file.to_string_lossy().replace('\\', "/"));
        }
    }
    assert!(reading.contains("acoustics/src/image.rs"), "{reading:?}");
    let missing: Vec<&String> = reading.difference(listed).collect();
    assert!(missing.is_empty(), "the recipe leaves out {missing:?}");
}
