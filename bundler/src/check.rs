//! Every test of the project, by one command.

use crate::bundle;
use crate::screen::Screen;
use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The feature that builds the standalone program.
const STANDALONE: &str = "promenade-plugin/standalone";
/// The feature that builds the command that trains.
const TRAIN: &str = "promenade/train";

/// Checks format and lints, bundles the plugin, and runs every test; stops at the first section that fails.
pub(crate) fn test() -> Result<()> {
    section("format");
    run(cargo().args(["fmt", "--all", "--check"]))?;

    section("screen");
    let screen = Screen::start()?;

    section("lints");
    let mut lints = cargo();
    lints.args(["clippy", "--workspace", "--all-targets", "--features", TRAIN]);
    if screen.is_some() {
        lints.args(["--features", STANDALONE]);
    }
    run(lints.args(["--", "-D", "warnings"]))?;

    section("bundles");
    let bundles = bundle::bundle(&[])?;

    section("python");
    let python = python_environment()?;
    for check in ["pedalboard_check.py", "dawdreamer_check.py"] {
        run(Command::new(&python).arg(Path::new("tests/python").join(check)).arg(bundles.join("Promenade.vst3")))?;
    }
    run(cargo().args(["build", "--package", "promenade"]))?;
    let tool = bundle::target_folder()?.join("debug").join(format!("promenade{}", std::env::consts::EXE_SUFFIX));
    run(Command::new(&python).arg("tests/python/metrics_check.py").arg(tool))?;

    if screen.is_some() {
        section("standalone");
        run(cargo().args([
            "build",
            "--package",
            "promenade-plugin",
            "--bin",
            "promenade-standalone",
            "--features",
            STANDALONE,
        ]))?;
    }

    // Last, so that the log ends with the counts of cargo.
    section("rust");
    let mut tests = cargo();
    tests.args(["test", "--workspace", "--no-fail-fast", "--features", TRAIN]).env("PROMENADE_BUNDLES", &bundles);
    match real_time_sanitizer()? {
        Some(library) => tests.env("RTSAN_ENABLE", "1").env("RTSAN_LIB_PATH", library),
        None => {
            println!("this toolchain has no real-time sanitizer: only allocations are watched for");
            &mut tests
        }
    };
    if let Some(screen) = &screen {
        let pictures = bundle::target_folder()?.join("screenshots");
        std::fs::create_dir_all(&pictures).with_context(|| format!("cannot make {}", pictures.display()))?;
        let program = bundle::target_folder()?.join("debug").join("promenade-standalone");
        // Software drawing, so that the pictures do not depend on the graphics card.
        tests.args(["--features", STANDALONE]);
        tests.env("DISPLAY", &screen.display).env("LIBGL_ALWAYS_SOFTWARE", "1");
        tests.env("PROMENADE_SCREENSHOTS", &pictures).env("PROMENADE_STANDALONE", program);
    }
    run(&mut tests)?;
    println!("\nall sections passed");
    Ok(())
}

fn section(name: &str) {
    println!("\n=== {name} ===");
}

fn cargo() -> Command {
    // Within `cargo xtask` this is the cargo of the pinned toolchain.
    Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
}

fn run(command: &mut Command) -> Result<()> {
    let status = command.status().with_context(|| format!("cannot run {command:?}"))?;
    if !status.success() {
        bail!("{command:?} failed: {status}");
    }
    Ok(())
}

/// The sanitizer's runtime, which Linux toolchains bring along.
fn real_time_sanitizer() -> Result<Option<PathBuf>> {
    let rustc = Command::new("rustc").args(["--print", "target-libdir"]).output().context("cannot run rustc")?;
    let folder = PathBuf::from(String::from_utf8(rustc.stdout).context("rustc does not name its folder")?.trim());
    Ok(Some(folder.join("librustc-stable_rt.rtsan.a")).filter(|library| library.is_file()))
}

/// A Python with the pinned packages of `tests/python/requirements.txt`, made on first use and again when they change.
fn python_environment() -> Result<PathBuf> {
    let requirements = Path::new("tests/python/requirements.txt");
    let wanted = std::fs::read_to_string(requirements).with_context(|| format!("cannot read {}", requirements.display()))?;
    let folder = bundle::target_folder()?.join("python");
    let python = if cfg!(windows) { folder.join("Scripts/python.exe") } else { folder.join("bin/python") };
    let stamp = folder.join("requirements.installed");
    if std::fs::read_to_string(&stamp).is_ok_and(|installed| installed == wanted) {
        return Ok(python);
    }
    let system = if cfg!(windows) { "python" } else { "python3" };
    run(Command::new(system).args(["-m", "venv", "--clear"]).arg(&folder))?;
    run(Command::new(&python)
        .args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "-r"])
        .arg(requirements))?;
    std::fs::write(&stamp, wanted).with_context(|| format!("cannot write {}", stamp.display()))?;
    Ok(python)
}
