//! The crates depend on each other as `docs/architecture.md` says, and so do the files of each.

use promenade_tests::sources::{self, Names, Source};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Command;

/// Every package that a package needs when it is built, itself among them, with its version, features as they are by default,
/// with further options of `cargo tree`.
fn packages(of: &str, more: &[&str]) -> BTreeSet<String> {
    // Packages for tests and benches are of no concern to who builds the crate.
    let options = ["tree", "--offline", "--edges", "normal,build", "--prefix", "none", "--format", "{p}", "--package", of];
    let out = Command::new(env!("CARGO")).args(options).args(more).current_dir(root()).output().expect("cargo runs");
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let text = String::from_utf8(out.stdout).unwrap();
    text.lines().map(|line| line.trim_end_matches(" (*)").to_owned()).collect()
}

/// Every package that a package pulls in, by name.
fn closure_with(of: &str, more: &[&str]) -> BTreeSet<String> {
    let names = packages(of, more).into_iter().filter_map(|line| line.split_whitespace().next().map(str::to_owned));
    let found: BTreeSet<String> = names.filter(|name| name != of).collect();
    assert!(!found.is_empty(), "{of} depends on something");
    found
}

fn closure(of: &str) -> BTreeSet<String> {
    closure_with(of, &[])
}

/// Those of some packages that a crate pulls in.
fn among(all: &BTreeSet<String>, some: &[&str]) -> Vec<String> {
    all.iter().filter(|name| some.contains(&name.as_str())).cloned().collect()
}

/// The crates of this repository that one pulls in, without their common prefix.
fn ours(of: &str) -> Vec<String> {
    closure(of).into_iter().filter_map(|name| name.strip_prefix("promenade-").map(str::to_owned)).collect()
}

#[test]
fn the_crates_depend_on_each_other_as_they_are_drawn() {
    let table: [(&str, &[&str]); 16] = [
        ("promenade-acoustics", &["audio", "core", "fault", "fourier"]),
        ("promenade-room", &["acoustics", "core", "fault", "fourier", "metrics"]),
        ("promenade-fourier", &[]),
        ("promenade-audio", &["fault"]),
        ("promenade-study", &["audio", "core", "fault", "fourier", "paths", "player", "sofa", "web"]),
        ("promenade-player", &["audio", "core", "fault", "fourier", "paths", "sofa"]),
        ("promenade-metrics", &["fourier"]),
        ("promenade-judge", &["core", "fault", "fourier", "metrics", "player"]),
        ("promenade-core", &["fault", "fourier"]),
        ("promenade-paths", &["core", "fault", "fourier"]),
        ("promenade-sofa", &["audio", "core", "fault", "fourier"]),
        ("promenade-web", &["core", "fault", "fourier"]),
        (
            "promenade-plugin",
            &["acoustics", "audio", "core", "fault", "fourier", "judge", "metrics", "paths", "player", "room", "sofa"],
        ),
        (
            "promenade-baker",
            &["acoustics", "audio", "core", "fault", "fourier", "judge", "metrics", "paths", "player", "room", "sofa"],
        ),
        ("promenade-fit", &["acoustics", "audio", "core", "fault", "fourier", "metrics", "paths", "sofa"]),
        (
            "promenade-trainer",
            &["acoustics", "audio", "baker", "core", "fault", "fourier", "judge", "metrics", "paths", "player", "room", "sofa"],
        ),
    ];
    for (of, needs) in table {
        assert_eq!(ours(of), needs, "{of}");
    }
    assert_eq!(
        ours("promenade"),
        [
            "acoustics",
            "audio",
            "baker",
            "core",
            "fault",
            "fit",
            "fourier",
            "host",
            "judge",
            "metrics",
            "paths",
            "player",
            "room",
            "sofa",
            "study",
            "web"
        ]
    );
}

/// The most packages that a newcomer waits for before the first sound, the player among them.
const OF_FIRST_SOUND: usize = 100;

#[test]
fn the_first_sound_needs_few_packages() {
    let needed = packages("promenade-player", &[]).len();
    assert!(needed <= OF_FIRST_SOUND, "{needed} packages");
}

#[test]
fn the_host_knows_no_plugin_in_particular() {
    assert_eq!(ours("promenade-host"), ["fault"]);
    for shipped in ["promenade-core", "promenade-plugin"] {
        let all = closure(shipped);
        assert!(!all.iter().any(|n| n == "clack-host" || n == "vst3-host"), "{shipped}");
    }
}

/// What opens files, starts threads, or speaks with hosts and users.
const WORLDLY: [&str; 10] =
    ["nice-plug", "hound", "hdf5-pure", "crossbeam", "rayon", "tokio", "egui", "clap", "cpal", "promenade-audio"];
/// Of the tools that bake: linear algebra, checkpoints, meshes, threads.
const OF_BAKERS: [&str; 8] = ["nalgebra", "pytorch-reader", "zip", "rayon", "obvhs", "tobj", "stl_io", "ply-rs-bw"];

#[test]
fn crates_that_compute_know_no_host_file_thread_or_interface() {
    for name in COMPUTE.map(|(name, _)| name).into_iter().filter(|name| *name != "sofa") {
        let foreign = among(&closure(&format!("promenade-{name}")), &WORLDLY);
        assert!(foreign.is_empty(), "{name}: {foreign:?}");
    }
}

#[test]
fn a_hosts_process_has_no_tools_of_bakers_and_hdf5_for_heads_alone() {
    let foreign = among(&closure("promenade-plugin"), &OF_BAKERS);
    assert!(foreign.is_empty(), "{foreign:?}");
    assert_eq!(among(&closure("promenade-baker"), &OF_BAKERS).len(), OF_BAKERS.len(), "names are those that bakers have");
    // Conversion of whole sounds comes with the reader of files, and nobody calls it.
    let of_heads = ["hdf5-pure", "promenade-audio"];
    assert_eq!(among(&closure("promenade-plugin"), &of_heads), of_heads);
    assert!(among(&closure_with("promenade-plugin", &["--prune", "promenade-sofa"]), &of_heads).is_empty());
    for name in ["acoustics", "core", "judge", "metrics", "paths", "plugin", "room", "sofa"] {
        for (module, source) in sources::of_crate(&sources::folder(name)) {
            // The standalone program plays a file; it is no host's process.
            let standalone = name == "plugin" && module.last().is_some_and(|m| m == "player");
            let calls =
                source.paths.iter().find(|(_, path)| path.starts_with(&["promenade_audio", "resample"].map(str::to_owned)));
            assert!(standalone || calls.is_none(), "{}: {calls:?}", source.file.display());
        }
    }
}

#[test]
fn the_training_framework_is_in_the_command_line_alone_and_only_where_it_is_asked_for() {
    for without in ["promenade-plugin", "promenade-baker", "promenade"] {
        let all = closure(without);
        assert!(!all.iter().any(|n| n.starts_with("burn") || n.starts_with("candle") || n == "tch"), "{without}");
    }
}

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

/// What crates that compute use of the standard library: numbers and collections, no files, threads, clocks, sockets or
/// variables.
const OF_STD: [&str; 14] =
    ["array", "borrow", "cmp", "collections", "error", "f32", "f64", "fmt", "iter", "mem", "ops", "slice", "sync::Arc", "u32"];
/// The crates that compute and do nothing else, and what they use beside that: names of files in errors, readers that are
/// handed in, the last plan of a transform.
const COMPUTE: [(&str, &[&str]); 7] = [
    ("core", &[]),
    ("fourier", &["cell::RefCell"]),
    ("metrics", &[]),
    ("room", &[]),
    ("judge", &[]),
    ("paths", &["io", "str"]),
    ("sofa", &["io::Error", "path"]),
];

#[test]
fn crates_that_compute_do_nothing_else() {
    let mut foreign = Vec::new();
    for (name, more) in COMPUTE {
        for source in sources::of_crate(&sources::folder(name)).values() {
            for (line, path) in source.paths.iter().filter(|(_, path)| path[0] == "std") {
                let used = path[1..].join("::");
                if !OF_STD.iter().chain(more).any(|of_std| used.starts_with(of_std)) {
                    foreign.push(format!("{}:{line}: {}", source.file.display(), path.join("::")));
                }
            }
            let prints = ["print", "println", "eprint", "eprintln", "dbg"];
            for (line, name) in source.macros.iter().filter(|(_, name)| prints.contains(&name.as_str())) {
                foreign.push(format!("{}:{line}: {name}!", source.file.display()));
            }
        }
    }
    assert!(foreign.is_empty(), "{}", foreign.join("\n"));
}

/// The module whose file defines what a path means in another module, as far as it is of this crate.
fn defined_in(files: &BTreeMap<Names, Source>, from: &[String], path: &[String], depth: usize) -> Option<Names> {
    let (mut here, mut rest) = match path[0].as_str() {
        "crate" => (Names::new(), &path[1..]),
        "self" => (from.to_vec(), &path[1..]),
        "super" => (from.to_vec(), path),
        name if files.contains_key(&[from, &[name.to_owned()]].concat()) => (from.to_vec(), path),
        _ => return None,
    };
    while rest.first().is_some_and(|name| name == "super") {
        here.pop()?;
        rest = &rest[1..];
    }
    while let Some(name) = rest.first() {
        let child = [&here[..], std::slice::from_ref(name)].concat();
        if files.contains_key(&child) {
            here = child;
            rest = &rest[1..];
        } else if let Some(handed_on) = files.get(&here)?.exports.get(name).filter(|_| depth < 8) {
            let whole = [handed_on, &rest[1..]].concat();
            return defined_in(files, &here, &whole, depth + 1).or(Some(here));
        } else {
            break;
        }
    }
    Some(here)
}

/// The shortest circles among what uses what, each once.
fn circles_of(uses: &BTreeMap<Names, BTreeSet<Names>>) -> Vec<String> {
    let mut circles = Vec::new();
    for start in uses.keys() {
        // The shortest way back.
        let (mut ways, mut seen) = (vec![vec![start]], BTreeSet::new());
        while !ways.is_empty() {
            let further = ways.iter().flat_map(|way| uses[way[way.len() - 1]].iter().map(move |to| [&way[..], &[to]].concat()));
            ways = further.filter(|way| seen.insert(way[way.len() - 1])).collect();
            if let Some(circle) = ways.iter().find(|way| way[way.len() - 1] == start) {
                // From its first module.
                if circle.iter().all(|module| *module >= start) {
                    circles.push(circle.iter().map(|m| m.join("::")).collect::<Vec<_>>().join(" -> "));
                }
                break;
            }
        }
    }
    circles
}

#[test]
fn no_files_use_each_other_in_a_circle() {
    let mut circles = Vec::new();
    for name in sources::members() {
        let files = sources::of_crate(&sources::folder(&name));
        let uses = |(module, source): (&Names, &Source)| {
            let paths = source.paths.iter().filter_map(|(_, path)| defined_in(&files, module, path, 0));
            // A parent and its children are one subject.
            let apart = |other: &Names| !other.starts_with(module) && !module.starts_with(other);
            (module.clone(), paths.filter(apart).collect::<BTreeSet<Names>>())
        };
        let uses: BTreeMap<Names, BTreeSet<Names>> = files.iter().map(uses).collect();
        circles.extend(circles_of(&uses).iter().map(|circle| format!("{name}: {circle}")));
    }
    assert!(circles.is_empty(), "{}", circles.join("\n"));
}

/// The most that a newcomer to the plugin sees at once, files and folders.
const SUBJECTS: usize = 15;

#[test]
fn the_plugin_is_divided_by_subject() {
    let entries = std::fs::read_dir(root().join("plugin/src")).unwrap().map(|entry| entry.unwrap().file_name());
    let mut names: Vec<String> = entries.map(|name| name.into_string().unwrap()).collect();
    names.sort();
    assert!(names.len() <= SUBJECTS, "{} entries at the root of plugin/src: {names:?}", names.len());
    // Not even a subject's first file may use another that uses any file of the subject.
    let files = sources::of_crate(&sources::folder("plugin"));
    let mut uses: BTreeMap<Names, BTreeSet<Names>> = BTreeMap::new();
    for (module, source) in files.iter().filter(|(module, _)| !module.is_empty()) {
        let paths = source.paths.iter().filter_map(|(_, path)| defined_in(&files, module, path, 0));
        let others = paths.filter(|other| !other.is_empty() && other[0] != module[0]).map(|other| vec![other[0].clone()]);
        uses.entry(vec![module[0].clone()]).or_default().extend(others);
    }
    let circles = circles_of(&uses);
    assert!(circles.is_empty(), "{}", circles.join("\n"));
}
