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
        ("promenade-acoustics", &["audio", "core", "fault", "fourier", "metrics"]),
        ("promenade-room", &["acoustics", "core", "fault", "fourier", "metrics"]),
        ("promenade-fourier", &[]),
        ("promenade-audio", &["fault", "fourier"]),
        ("promenade-study", &["audio", "core", "fault", "fourier", "judge", "metrics", "paths", "player", "sofa", "web"]),
        ("promenade-player", &["audio", "core", "fault", "fourier", "judge", "metrics", "paths", "sofa"]),
        ("promenade-metrics", &["fourier"]),
        ("promenade-judge", &["core", "fault", "fourier", "metrics"]),
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
/// Of the tools that bake: linear algebra, meshes, threads.
const OF_BAKERS: [&str; 6] = ["nalgebra", "rayon", "obvhs", "tobj", "stl_io", "ply-rs-bw"];

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

/// What each file of a crate uses of its other files. A file does not use what it only hands on.
fn uses_of(files: &BTreeMap<Names, Source>) -> BTreeMap<Names, BTreeSet<Names>> {
    let uses = |(module, source): (&Names, &Source)| {
        let handed_on = |path: &Names| {
            let own = source.exports.iter().filter(|(_, export)| *export == path);
            own.clone().count() > 0 && own.into_iter().all(|(name, _)| !source.names.contains(name))
        };
        let paths = source.paths.iter().filter(|(_, path)| !handed_on(path));
        let others = paths.filter_map(|(_, path)| defined_in(files, module, path, 0)).filter(|other| other != module);
        (module.clone(), others.collect::<BTreeSet<Names>>())
    };
    files.iter().filter(|(module, _)| !module.is_empty()).map(uses).chain([(Names::new(), BTreeSet::new())]).collect()
}

/// Files that use files of their own folder which use them: each is one subject with these, and shares types with them that
/// would need a file of their own. A file that is not among them may hand its folder's items on, and nothing else.
const WITH_THEIR_FOLDERS: [(&str, &str); 26] = [
    ("baker", "bake::field"),
    ("baker", "judge::evaluate"),
    ("baker", "sources::capture"),
    ("baker", "sources::reconstruction"),
    ("baker", "sources::responses"),
    ("baker", "sources::simulation"),
    ("cli", "map"),
    ("cli", "measure"),
    ("cli", "plot"),
    ("cli", "simulate"),
    ("core", "head"),
    ("core", "headphones"),
    ("core", "network::kernels::attention"),
    ("core", "network::kernels::product"),
    ("core", "network::model"),
    ("core", "scene"),
    ("core", "scene::format"),
    ("host", "clap"),
    ("host", "vst3"),
    ("paths", "colmap"),
    ("plugin", "editor::scenes"),
    ("plugin", "export::clap"),
    ("plugin", "listener"),
    ("plugin", "osc"),
    ("plugin", "playing::loader"),
    ("trainer", "refinement"),
];

#[test]
fn no_files_use_each_other_in_a_circle() {
    let (mut circles, mut needed) = (Vec::new(), BTreeSet::new());
    for name in sources::members() {
        let files = sources::of_crate(&sources::folder(&name));
        let mut uses = uses_of(&files);
        for (module, others) in &mut uses {
            let with = |parent: &Names, child: &Names| {
                let parent = parent.join("::");
                let excepted = WITH_THEIR_FOLDERS.contains(&(name.as_str(), parent.as_str()));
                (excepted && child.join("::").starts_with(&(parent.clone() + "::"))).then_some(parent)
            };
            others.retain(|other| {
                let excepted = with(module, other).or_else(|| with(other, module));
                needed.extend(excepted.clone().map(|parent| (name.clone(), parent)));
                excepted.is_none()
            });
        }
        circles.extend(circles_of(&uses).iter().map(|circle| format!("{name}: {circle}")));
    }
    assert!(circles.is_empty(), "{}", circles.join("\n"));
    let unused =
        WITH_THEIR_FOLDERS.iter().filter(|(name, parent)| !needed.contains(&((*name).to_owned(), (*parent).to_owned())));
    assert_eq!(unused.collect::<Vec<_>>(), [] as [&(&str, &str); 0], "these are exceptions of nothing");
}

/// The most that a newcomer to a crate sees at once, files and folders.
const SUBJECTS: usize = 15;
/// The lines from which on a crate is divided by subject.
const LARGE: usize = 8000;
/// Large crates that are not divided by subject yet, and how many files and folders stand at the root of each.
const UNDIVIDED: [(&str, usize); 2] = [
    // Its folders are subjects; types that most of them share (poses, bands, sources) stand beside these.
    ("core", 40),
    // Its files are commands, by the name that is typed.
    ("cli", 40),
];

#[test]
fn large_crates_are_divided_by_subject() {
    let mut large = Vec::new();
    for name in sources::members() {
        let source = sources::folder(&name).join("src");
        let files = sources::of_crate(&sources::folder(&name));
        let lines: usize = files.values().map(|source| std::fs::read_to_string(&source.file).unwrap().lines().count()).sum();
        if lines < LARGE {
            continue;
        }
        let most = UNDIVIDED.iter().find(|(undivided, _)| *undivided == name).map_or(SUBJECTS, |(_, entries)| *entries);
        let entries = std::fs::read_dir(source).unwrap().map(|entry| entry.unwrap().file_name());
        let mut names: Vec<String> = entries.map(|name| name.into_string().unwrap()).collect();
        names.sort();
        assert!(names.len() <= most, "{} entries at the root of {name}/src: {names:?}", names.len());
        large.push(name);
    }
    assert!(["baker", "core", "fit", "plugin"].iter().all(|name| large.iter().any(|large| large == name)), "{large:?}");
}

/// What is done to a frame is divided by the field's terms, as the map of the code has them.
#[test]
fn the_renderers_folders_are_those_of_the_map() {
    let map = std::fs::read_to_string(root().join("docs/architecture.md")).unwrap();
    let rows = map.lines().filter_map(|line| line.strip_prefix("| `render/")?.split_once("/` | "));
    let mapped: BTreeSet<String> = rows.filter(|(_, term)| term.len() > 10).map(|(folder, _)| folder.to_owned()).collect();
    let entries = std::fs::read_dir(root().join("core/src/render")).unwrap().map(Result::unwrap);
    let folders = entries.filter(|entry| entry.file_type().unwrap().is_dir());
    let found: BTreeSet<String> = folders.map(|entry| entry.file_name().into_string().unwrap()).collect();
    assert_eq!(mapped, found);
}

/// Subjects that use each other in a circle, by crate, and why.
const TOGETHER: [(&str, &[&str]); 2] = [
    // A scene holds and checks what its parts play, and the parts are made of scenes.
    ("core", &["decode", "latency", "network", "published", "render", "scene"]),
    // Sources are read for what is baked, and baked while they are read.
    ("baker", &["bake", "sources"]),
];

#[test]
fn no_subjects_use_each_other_in_a_circle() {
    let mut circles = Vec::new();
    for name in sources::members() {
        let files = sources::of_crate(&sources::folder(&name));
        let together = TOGETHER.iter().find(|(of, _)| *of == name).map_or(&[][..], |(_, subjects)| subjects);
        // Not even a subject's first file may use another that uses any file of the subject, in any folder.
        let folders: BTreeSet<&[String]> = files.keys().filter_map(|module| Some(module.split_last()?.1)).collect();
        for folder in folders {
            let depth = folder.len();
            let mut uses: BTreeMap<Names, BTreeSet<Names>> = BTreeMap::new();
            for (module, source) in files.iter().filter(|(module, _)| module.len() > depth && module.starts_with(folder)) {
                let paths = source.paths.iter().filter_map(|(_, path)| defined_in(&files, module, path, 0));
                let beside = paths.filter(|other| other.len() > depth && other.starts_with(folder));
                let others = beside.map(|other| other[..=depth].to_vec()).filter(|other| *other != module[..=depth]);
                let one = |module: &Names| together.contains(&module[0].as_str());
                let own = module[..=depth].to_vec();
                let apart = others.filter(|other| depth > 0 || !(one(&own) && one(other)));
                uses.entry(own.clone()).or_default().extend(apart);
            }
            let known = circles_of(&uses).into_iter().map(|circle| format!("{name}: {circle}"));
            circles.extend(known);
        }
    }
    assert!(circles.is_empty(), "{}", circles.join("\n"));
}
