//! The crates depend on each other as `docs/architecture.md` says.

use std::collections::BTreeSet;
use std::process::Command;

/// Every package that a package pulls in when it is built, by name, features as they are by default.
fn closure(of: &str) -> BTreeSet<String> {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
    // Packages for tests and benches are of no concern to who builds the crate.
    let options = ["tree", "--offline", "--edges", "normal,build", "--prefix", "none", "--format", "{p}", "--package", of];
    let out = Command::new(env!("CARGO")).args(options).current_dir(root).output().expect("cargo runs");
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let text = String::from_utf8(out.stdout).unwrap();
    let names = text.lines().filter_map(|line| line.split_whitespace().next()).map(str::to_owned);
    let found: BTreeSet<String> = names.filter(|name| name != of).collect();
    assert!(!found.is_empty(), "{of} depends on something");
    found
}

fn ours(of: &str) -> Vec<String> {
    closure(of).into_iter().filter(|n| n.starts_with("promenade")).collect()
}

#[test]
fn the_crates_meet_in_core_alone() {
    assert!(ours("promenade-core").is_empty());
    assert_eq!(ours("promenade-paths"), ["promenade-core"]);
    assert_eq!(ours("promenade-plugin"), ["promenade-core", "promenade-paths"]);
    assert!(ours("promenade-audio").is_empty());
    assert!(ours("promenade-metrics").is_empty());
    assert_eq!(ours("promenade-baker"), ["promenade-audio", "promenade-core", "promenade-metrics", "promenade-paths"]);
    assert_eq!(
        ours("promenade-trainer"),
        ["promenade-audio", "promenade-baker", "promenade-core", "promenade-metrics", "promenade-paths"]
    );
    assert_eq!(
        ours("promenade"),
        ["promenade-audio", "promenade-baker", "promenade-core", "promenade-host", "promenade-metrics", "promenade-paths"]
    );
}

#[test]
fn the_host_knows_no_plugin_in_particular() {
    assert!(ours("promenade-host").is_empty());
    for shipped in ["promenade-core", "promenade-plugin"] {
        let all = closure(shipped);
        assert!(!all.iter().any(|n| n.starts_with("clack") || n == "vst3-host"), "{shipped}");
    }
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
