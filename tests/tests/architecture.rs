//! The crates depend on each other as `docs/architecture.md` says.

use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;

/// Every package that a package pulls in when it is built, by name, features as they are by default.
fn closure(of: &str) -> BTreeSet<String> {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
    let out = Command::new(env!("CARGO")).args(["metadata", "--format-version", "1", "--offline"]).current_dir(root).output();
    let out = out.expect("cargo runs");
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let metadata: Value = serde_json::from_slice(&out.stdout).unwrap();
    let name_of: BTreeMap<&str, &str> =
        array(&metadata["packages"]).iter().map(|p| (text(&p["id"]), text(&p["name"]))).collect();
    let nodes: BTreeMap<&str, &Value> = array(&metadata["resolve"]["nodes"]).iter().map(|n| (text(&n["id"]), n)).collect();
    let start = name_of.iter().find(|(_, name)| **name == of).expect("a package of the workspace").0;
    let (mut found, mut open) = (BTreeSet::new(), vec![*start]);
    while let Some(id) = open.pop() {
        for dependency in array(&nodes[id]["deps"]) {
            // Packages for tests and benches are of no concern to who builds the crate.
            let built = array(&dependency["dep_kinds"]).iter().any(|k| k["kind"] != "dev");
            if built && found.insert(name_of[text(&dependency["pkg"])].to_owned()) {
                open.push(text(&dependency["pkg"]));
            }
        }
    }
    found
}

fn array(value: &Value) -> &Vec<Value> {
    value.as_array().expect("an array")
}

fn text(value: &Value) -> &str {
    value.as_str().expect("a string")
}

fn ours(of: &str) -> Vec<String> {
    closure(of).into_iter().filter(|n| n.starts_with("promenade")).collect()
}

#[test]
fn the_crates_meet_in_core_alone() {
    assert!(ours("promenade-core").is_empty());
    assert_eq!(ours("promenade-plugin"), ["promenade-core"]);
    assert_eq!(ours("promenade-baker"), ["promenade-core"]);
    assert_eq!(ours("promenade"), ["promenade-baker", "promenade-core"]);
}

#[test]
fn core_knows_no_host_file_thread_or_interface() {
    let all = closure("promenade-core");
    for foreign in ["nice-plug", "hound", "crossbeam", "rayon", "tokio", "egui", "clap", "cpal"] {
        assert!(!all.contains(foreign), "{foreign}");
    }
}

#[test]
fn no_training_framework_ships() {
    for shipped in ["promenade-plugin", "promenade"] {
        let all = closure(shipped);
        assert!(!all.iter().any(|n| n.starts_with("burn") || n.starts_with("candle") || n == "tch"), "{shipped}");
    }
}
