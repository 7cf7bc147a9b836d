//! Every test of the project, by one command.

use crate::browser::Browser;
use crate::bundle::{self, cargo, run};
use crate::screen::Screen;
use crate::sections::Sections;
use anyhow::{Context, Result, anyhow};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread;

/// What everything is built with, so that one build serves lints, bundles and tests: the command that trains and the standalone
/// program. The latter needs headers that come with the screen's packages.
const FEATURES: [&str; 2] = ["promenade/train", "promenade-plugin/standalone"];

/// Checks format and lints, bundles the plugin, and runs every test; stops at the first section that fails.
pub(crate) fn test() -> Result<()> {
    let mut sections = Sections::default();
    let result = all(&mut sections);
    sections.print();
    result?;
    println!("\nall sections passed");
    Ok(())
}

fn all(sections: &mut Sections) -> Result<()> {
    sections.run("format", || run(cargo("fmt").args(["--all", "--check"])))?;
    let screen = sections.run("screen", Screen::start)?;
    let features = FEATURES[..if screen.is_some() { 2 } else { 1 }].join(",");
    let sanitizer = real_time_sanitizer()?;
    let built = |command: &str| {
        let mut cargo = cargo(command);
        cargo.args(["--workspace", "--features", &features]);
        // Each time, because a change of these compiles the sanitizer again.
        if let Some(library) = &sanitizer {
            cargo.env("RTSAN_ENABLE", "1").env("RTSAN_LIB_PATH", library);
        }
        cargo
    };

    // Packages are downloaded while the compiler works, and the engine for browsers keeps one processor busy at most.
    let python = thread::spawn(python_environment);
    let browser = thread::spawn(Browser::prepare);
    sections.run("build", || run(built("build").args(["--lib", "--bins", "--tests"])))?;
    let python = sections.run("python environment", || python.join().map_err(|_| anyhow!("pip's thread has panicked"))?)?;
    let bundles = sections.run("bundles", || bundle::lay_out(&[]))?;

    let vst3 = bundles.join("Promenade.vst3");
    let tool = bundle::target_folder()?.join("debug").join(format!("promenade{}", std::env::consts::EXE_SUFFIX));
    sections.run("lints", || run(built("clippy").args(["--all-targets", "--", "-D", "warnings"])))?;

    let browser = sections
        .run("engine for browsers", || browser.join().map_err(|_| anyhow!("the thread of the engine has panicked"))?)?;
    // By themselves: hosts that announce no bounce are known by the pace of their blocks.
    sections.run("python", || {
        let hosts = ["pedalboard_check.py", "dawdreamer_check.py", "many_check.py"].map(|check| (check, &vst3));
        hosts
            .iter()
            .chain(&[("metrics_check.py", &tool)])
            .try_for_each(|(check, of)| run(Command::new(&python).arg(Path::new("tests/python").join(check)).arg(of)))
    })?;
    if let Some(browser) = &browser {
        sections.run("pages in a browser", || browser.test(&tool))?;
    }

    // Last, so that the log ends with the counts of cargo.
    let tests = || -> Result<Command> {
        let mut tests = built("test");
        tests.arg("--no-fail-fast").env("PROMENADE_BUNDLES", &bundles);
        if let Some(screen) = &screen {
            let pictures = bundle::target_folder()?.join("screenshots");
            std::fs::create_dir_all(&pictures).with_context(|| format!("cannot make {}", pictures.display()))?;
            // Software drawing, so that the pictures do not depend on the graphics card.
            tests.env("DISPLAY", &screen.display).env("LIBGL_ALWAYS_SOFTWARE", "1");
            // Memory that threads of closed windows keep in arenas of their own would hide what a window leaves behind.
            tests.env("MALLOC_ARENA_MAX", "2");
            tests.env("PROMENADE_SCREENSHOTS", &pictures);
        }
        Ok(tests)
    };
    // Examples are linted, not linked.
    sections.run("tests", || run(tests()?.arg("--doc")).and_then(|()| run(tests()?.arg("--tests"))))?;

    // Tests that not every machine can run are ignored so far, and named by what they need.
    let needs = [
        ("needs_shared", Path::new("../shared").is_dir()),
        ("needs_screen", screen.is_some()),
        ("needs_sanitizer", sanitizer.is_some()),
    ];
    let (here, missing): (Vec<_>, Vec<_>) = needs.into_iter().partition(|(_, here)| *here);
    let names = |needs: Vec<(&'static str, bool)>| needs.into_iter().map(|(name, _)| name).collect::<Vec<_>>();
    let (here, missing) = (names(here), names(missing));
    if !here.is_empty() {
        // Where there is one mouse, one after the other.
        let threads = |name: &str| if name == "needs_screen" { &["--test-threads", "1"][..] } else { &[] };
        let needy = |name: &str| run(tests()?.args(["--tests", "--", "--ignored"]).args(threads(name)).arg(name));
        sections.run("tests with needs", || here.iter().try_for_each(|name| needy(name)))?;
    }
    if browser.is_none() {
        println!("\nthe page was not tried in a browser");
    }
    if !missing.is_empty() {
        println!("\nnot run on this machine: {}", missing.join(", "));
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
