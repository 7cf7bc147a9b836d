//! What can be known of other systems from this machine: whether their compilers accept every crate, and whether what they make
//! sounds the same.

use crate::bundle::{self, Profile, cargo, run};
use crate::install::copy_into;
use crate::manifest::BUNDLES;
use crate::screen::Screen;
use crate::system::System;
use anyhow::{Context, Result, bail, ensure};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

/// Targets besides this machine's, and the features that are checked there: on ARM Linux the standalone program needs that
/// system's headers.
const TARGETS: [(&str, &str); 4] = [
    (WINDOWS, "promenade-plugin/standalone"),
    ("x86_64-apple-darwin", "promenade-plugin/standalone"),
    ("aarch64-apple-darwin", "promenade-plugin/standalone"),
    (ARM, ""),
];
const WINDOWS: &str = "x86_64-pc-windows-gnu";
const ARM: &str = "aarch64-unknown-linux-gnu";

/// The most by which Windows may differ from Linux at full scale 1: other mathematical functions, the same engine.
const LARGEST_DIFFERENCE: f32 = 1e-6;

/// What is done with a target.
struct Line {
    target: &'static str,
    what: &'static str,
    /// How it went, or why it was not done.
    result: String,
}

/// Checks, runs and compares what this machine can of these targets (none: all), and prints a table of it with what it cannot.
///
/// # Errors
/// A target that is not known here, or a check that was made failed.
pub(crate) fn systems(root: &Path, targets: &[String]) -> Result<()> {
    let known = TARGETS.map(|(target, _)| target);
    if let Some(other) = targets.iter().find(|target| !known.contains(&target.as_str())) {
        bail!("expected targets of {}, found \"{other}\"", known.join(", "));
    }
    let wanted = |target: &str| targets.is_empty() || targets.iter().any(|t| t == target);
    let mut lines = Vec::new();
    for (target, features) in TARGETS.into_iter().filter(|(target, _)| wanted(target)) {
        let result = if has_library(target)? { Some(check(target, features)?) } else { None };
        lines.push(Line { target, what: "compiles", result: result.unwrap_or_else(|| no_library(target)) });
    }
    if wanted(WINDOWS) {
        lines.extend(windows(root)?);
    }
    if wanted(ARM) {
        lines.push(arm()?);
    }
    println!();
    for Line { target, what, result } in lines {
        println!("{target:28} {what:14} {result}");
    }
    Ok(())
}

fn no_library(target: &str) -> String {
    format!("not tried: the toolchain has no standard library for it (rustup target add {target})")
}

/// Whether the toolchain can compile for a target.
fn has_library(target: &str) -> Result<bool> {
    let out =
        Command::new("rustc").args(["--print", "target-libdir", "--target", target]).output().context("cannot run rustc")?;
    let folder = String::from_utf8(out.stdout).context("rustc does not write UTF-8")?;
    Ok(out.status.success() && Path::new(folder.trim()).is_dir())
}

/// Whether a program can be started.
fn has_program(name: &str) -> bool {
    Command::new(name).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok()
}

/// Libraries and programs of every crate.
fn check(target: &str, features: &str) -> Result<String> {
    let started = Instant::now();
    run(cargo("check").args(["--workspace", "--target", target, "--features", features]))?;
    let seconds = started.elapsed().as_secs();
    Ok(format!("all crates, in {}:{:02}", seconds / 60, seconds % 60))
}

/// Renders with the Windows plugins in Wine, beside those of this Linux.
fn windows(root: &Path) -> Result<Vec<Line>> {
    let line = |what, result| Line { target: WINDOWS, what, result };
    let missing = ["x86_64-w64-mingw32-gcc", "wine"].into_iter().find(|program| !has_program(program));
    let obstacle = match missing {
        _ if System::here()? != System::Linux => Some("compared on Linux only".to_owned()),
        _ if !has_library(WINDOWS)? => Some(no_library(WINDOWS)),
        Some(program) => Some(format!("not tried: there is no {program}")),
        None => None,
    };
    if let Some(obstacle) = obstacle {
        return Ok(vec![line("sounds alike", obstacle)]);
    }
    // The VST3's wrapper ends the host where there is no display.
    let screens = Screen::start_several(1)?;
    let Some(screen) = screens.first() else { bail!("Wine needs a screen") };
    let folder = bundle::target_folder()?.join("systems");
    // What ships for Windows, beside what the tests play here.
    let linux = made(&folder, Profile::Development, System::Linux, None)?;
    let windows = made(&folder, Profile::Release, System::Windows, Some(WINDOWS))?;
    random_numbers(&windows)?;
    for (from, to) in [
        ("data/speech.wav", "speech.wav"),
        ("presets/scenes/iosr-room-a.promenade", "room.promenade"),
        ("presets/paths/walk.json", "walk.json"),
    ] {
        fs::copy(root.join(from), folder.join(to)).with_context(|| format!("{from} cannot be copied"))?;
    }
    fs::write(folder.join("moves.json"), MOVES).context("the automation cannot be written")?;
    let mut lines = Vec::new();
    for (what, plugin) in [("CLAP", Some("Promenade.clap")), ("VST3", Some("Promenade.vst3")), ("command line", None)] {
        let rendered = |system: &str, mut command: Command| -> Result<PathBuf> {
            let out = format!("{system}-{what}.wav");
            match plugin {
                Some(plugin) => {
                    command.args(["host", &format!("{system}/{plugin}"), "speech.wav", &out]);
                    command.args(["--automation", "moves.json", "--tail", "1", "--rate", "48000"]);
                }
                None => {
                    command.args(["render", "room.promenade", "speech.wav", &out, "--path", "walk.json", "--bits", "32f"]);
                }
            }
            command.current_dir(&folder).env("DISPLAY", &screen.display);
            // Neither Wine's own messages nor its questions to install more.
            command.env("WINEPREFIX", folder.join("wine")).env("WINEDEBUG", "-all").env("WINEDLLOVERRIDES", "mscoree,mshtml=");
            run(&mut command)?;
            Ok(folder.join(out))
        };
        let native = rendered("Linux", Command::new(linux.join("promenade")))?;
        let mut wine = Command::new("wine");
        wine.arg(windows.join("promenade.exe"));
        let foreign = rendered("Windows", wine)?;
        let (difference, peak) = compare(&native, &foreign)?;
        ensure!(peak > 0.01, "{what}: the renderings are silent");
        ensure!(
            difference <= LARGEST_DIFFERENCE,
            "{what}: Windows differs from Linux by {difference:e}, expected at most {LARGEST_DIFFERENCE:e}"
        );
        lines.push(line(what, format!("runs in Wine and renders within {difference:.1e} of Linux (peak {peak:.2})")));
    }
    Ok(lines)
}

/// A turn of the head and a walk, for every kind of interpolation.
const MOVES: &str = r#"{ "parameters": {
    "Yaw": [{ "t": 0.0, "value": "-60 deg" }, { "t": 12.0, "value": "150 deg" }],
    "Listener X": [{ "t": 0.0, "value": "-1 m" }, { "t": 20.0, "value": "1 m" }]
} }"#;

/// Bundles and command line of a system, in a folder of their own.
fn made(folder: &Path, profile: Profile, system: System, target: Option<&str>) -> Result<PathBuf> {
    let to = folder.join(system.name());
    let (bundles, programs) = bundle::ship(&bundle::BUILDS[..2], profile, system, target)?;
    let mut parts = programs;
    parts.extend(BUNDLES.map(|(name, _)| bundles.join(name)));
    copy_into(&parts, &to)?;
    Ok(to)
}

/// Wine before 9 lacks the library that Rust's takes random numbers from; this one has them from the function behind it.
fn random_numbers(folder: &Path) -> Result<()> {
    const SOURCE: &str = "#include <windows.h>\n#include <ntsecapi.h>\n\
        __declspec(dllexport) BOOL WINAPI ProcessPrng(PBYTE data, SIZE_T length) { return RtlGenRandom(data, (ULONG)length); \
        }\n";
    let source = folder.join("random.c");
    fs::write(&source, SOURCE).with_context(|| format!("cannot write {}", source.display()))?;
    let library = folder.join("bcryptprimitives.dll");
    run(Command::new("x86_64-w64-mingw32-gcc").args(["-shared", "-o"]).arg(library).arg(source).arg("-ladvapi32"))
}

/// The largest difference between the samples of two files, and the larger of their peaks.
fn compare(one: &Path, other: &Path) -> Result<(f32, f32)> {
    let samples = |path: &Path| -> Result<Vec<f32>> {
        let context = || format!("{} cannot be read as 32-bit floats", path.display());
        let mut file = hound::WavReader::open(path).with_context(context)?;
        file.samples::<f32>().collect::<Result<_, _>>().with_context(context)
    };
    let (one, other) = (samples(one)?, samples(other)?);
    ensure!(one.len() == other.len(), "one rendering has {} samples, the other {}", one.len(), other.len());
    let pairs = || one.iter().zip(&other);
    let peak = pairs().fold(0.0_f32, |peak, (a, b)| peak.max(a.abs()).max(b.abs()));
    Ok((pairs().fold(0.0_f32, |most, (a, b)| most.max((a - b).abs())), peak))
}

/// The engine's tests on an emulated ARM processor, whose vector instructions are others than here.
fn arm() -> Result<Line> {
    let line = |result| Ok(Line { target: ARM, what: "engine's tests", result });
    if !has_library(ARM)? {
        return line(no_library(ARM));
    }
    let (linker, emulator) = ("aarch64-linux-gnu-gcc", "qemu-aarch64-static");
    if let Some(program) = [linker, emulator].into_iter().find(|program| !has_program(program)) {
        return line(format!("not tried: there is no {program}"));
    }
    let started = Instant::now();
    let mut test = cargo("test");
    test.args(["--package", "promenade-core", "--lib", "--target", ARM]);
    test.env("CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER", linker);
    test.env("CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER", format!("{emulator} -L /usr/aarch64-linux-gnu"));
    run(&mut test)?;
    let seconds = started.elapsed().as_secs();
    line(format!("pass in {emulator}, in {}:{:02}", seconds / 60, seconds % 60))
}
