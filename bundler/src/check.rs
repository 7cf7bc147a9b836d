//! Every test of the project, by one command.

use crate::browser::Browser;
use crate::bundle::{self, cargo, run};
use crate::screen::{Screen, has_packages};
use crate::sections::Sections;
use anyhow::{Context, Result, anyhow};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread;

/// What everything is built with, so that one build serves lints, bundles and tests: the command that trains and the standalone
/// program. The latter needs headers that come with the screen's packages.
const FEATURES: [&str; 2] = ["promenade/train", "promenade-plugin/standalone"];

/// Screens that tests with windows are spread over.
const SCREENS: usize = 2;

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
    let screens = sections.run("screens", || Screen::start_several(SCREENS))?;
    let built =
        Built { features: FEATURES[..if screens.is_empty() { 1 } else { 2 }].join(","), sanitizer: real_time_sanitizer()? };

    // Packages are downloaded while the compiler works, and the engine for browsers keeps one processor busy at most.
    let python = thread::spawn(python_environment);
    let browser = thread::spawn(Browser::prepare);
    sections.run("build", || run(built.cargo("build").args(["--lib", "--bins", "--tests"])))?;
    let python = sections.run("python environment", || python.join().map_err(|_| anyhow!("pip's thread has panicked"))?)?;
    let bundles = sections.run("bundles", || bundle::lay_out(&[]))?;

    let vst3 = bundles.join("Promenade.vst3");
    let tool = bundle::target_folder()?.join("debug").join(format!("promenade{}", std::env::consts::EXE_SUFFIX));
    sections.run("lints", || run(built.cargo("clippy").args(["--all-targets", "--", "-D", "warnings"])))?;

    let browser = sections
        .run("engine for browsers", || browser.join().map_err(|_| anyhow!("the thread of the engine has panicked"))?)?;
    let sweep = PathBuf::from("presets/recipes/sweep.py");
    sections.run("python", || {
        let hosts = ["pedalboard_check.py", "dawdreamer_check.py", "many_check.py"].map(|check| (check, &vst3));
        hosts
            .iter()
            .chain(&[("metrics_check.py", &tool), ("sweep_check.py", &sweep)])
            .try_for_each(|(check, of)| run(Command::new(&python).arg(Path::new("tests/python").join(check)).arg(of)))
    })?;
    if let Some(browser) = &browser {
        sections.run("pages in a browser", || browser.test(&tool))?;
    }

    let tests = Tests { built: &built, bundles: &bundles, pictures: bundle::target_folder()?.join("screenshots") };
    std::fs::create_dir_all(&tests.pictures).with_context(|| format!("cannot make {}", tests.pictures.display()))?;
    if let [first, others @ ..] = &screens[..] {
        sections.run("tests with a screen", || tests.on_screens(first, others))?;
    }
    // Last, so that the log ends with the counts of cargo. Examples are linted, not linked.
    let screen = screens.first();
    sections.run("tests", || {
        run(tests.cargo(screen).arg("--doc"))?;
        run(tests.cargo(screen).arg("--tests"))
    })?;

    // Tests that not every machine can run are ignored so far, and named by what they need.
    let needs = [("needs_shared", Path::new("../shared").is_dir()), ("needs_sanitizer", built.sanitizer.is_some())];
    let (here, missing): (Vec<_>, Vec<_>) = needs.into_iter().partition(|(_, here)| *here);
    if !here.is_empty() {
        let names = here.iter().map(|(name, _)| name);
        sections.run("tests with needs", || run(tests.cargo(screen).args(["--tests", "--", "--ignored"]).args(names)))?;
    }
    if browser.is_none() {
        println!("\nthe page was not tried in a browser");
    }
    let missing = missing.iter().map(|(name, _)| *name).chain(screens.is_empty().then_some("needs_screen")).collect::<Vec<_>>();
    if !missing.is_empty() {
        println!("\nnot run on this machine: {}", missing.join(", "));
    }
    Ok(())
}

/// Makes the pictures of the documents: on a screen without a monitor, by the tests that take them.
pub(crate) fn pictures() -> Result<()> {
    let screens = Screen::start_several(1)?;
    let screen = screens.first().context("pictures need a screen without a monitor (Xvfb)")?;
    let made = bundle::target_folder()?.join("screenshots");
    std::fs::create_dir_all(&made).with_context(|| format!("cannot make {}", made.display()))?;
    let mut tests = Built::new(has_packages())?.cargo("test");
    tests.args(["--test", "editor", "--", "--ignored", "--test-threads", "1", "picture"]);
    run(tests.env("DISPLAY", &screen.display).env("LIBGL_ALWAYS_SOFTWARE", "1").env("PROMENADE_SCREENSHOTS", &made))?;
    let folder = Path::new("docs/pictures");
    for entry in std::fs::read_dir(folder).with_context(|| format!("{} cannot be read", folder.display()))? {
        let name = entry.with_context(|| format!("{} cannot be read", folder.display()))?.file_name();
        let (from, to) = (made.join(&name), folder.join(&name));
        if from.is_file() {
            std::fs::copy(&from, &to).with_context(|| format!("cannot copy {} to {}", from.display(), to.display()))?;
            println!("{}", to.display());
        }
    }
    Ok(())
}

/// The one build of everything.
pub(crate) struct Built {
    features: String,
    /// The runtime of the sanitizer.
    sanitizer: Option<PathBuf>,
}

impl Built {
    /// With or without the standalone program, whose headers come with the packages of screens.
    pub(crate) fn new(standalone: bool) -> Result<Self> {
        let features = FEATURES[..if standalone { 2 } else { 1 }].join(",");
        Ok(Self { features, sanitizer: real_time_sanitizer()? })
    }

    /// A command of cargo over the whole workspace.
    pub(crate) fn cargo(&self, command: &str) -> Command {
        self.cargo_with(command, |_| true)
    }

    /// One with the features of some packages alone: cargo refuses those of packages that are left out.
    pub(crate) fn cargo_with(&self, command: &str, takes: impl Fn(&str) -> bool) -> Command {
        let taken = |feature: &&str| feature.split('/').next().is_some_and(&takes);
        let features: Vec<&str> = self.features.split(',').filter(taken).collect();
        let mut cargo = cargo(command);
        cargo.args(["--workspace", "--features", &features.join(",")]);
        // Each time, because a change of these compiles the sanitizer again.
        if let Some(library) = &self.sanitizer {
            cargo.env("RTSAN_ENABLE", "1").env("RTSAN_LIB_PATH", library);
        }
        cargo
    }
}

/// The tests in Rust and what they look for.
struct Tests<'a> {
    built: &'a Built,
    bundles: &'a Path,
    /// Where pictures of windows are kept.
    pictures: PathBuf,
}

impl Tests<'_> {
    fn cargo(&self, screen: Option<&Screen>) -> Command {
        let mut tests = self.built.cargo("test");
        tests.arg("--no-fail-fast").env("PROMENADE_BUNDLES", self.bundles);
        if let Some(screen) = screen {
            // Software drawing, so that the pictures do not depend on the graphics card.
            tests.env("DISPLAY", &screen.display).env("LIBGL_ALWAYS_SOFTWARE", "1");
            // Memory that threads of closed windows keep in arenas of their own would hide what a window leaves behind.
            tests.env("MALLOC_ARENA_MAX", "2");
            tests.env("PROMENADE_SCREENSHOTS", &self.pictures);
        }
        tests
    }

    /// The tests that open windows: on one screen one after the other, because it has one mouse; those of the VST3 on a screen
    /// of their own, if there is another.
    fn on_screens(&self, first: &Screen, others: &[Screen]) -> Result<()> {
        let windows = |screen: &Screen, names: &[&str]| {
            let mut tests = self.cargo(Some(screen));
            tests.args(["--tests", "--", "--ignored", "--test-threads", "1"]).args(names);
            tests
        };
        const VST3: &str = "needs_screen::vst3";
        let Some(second) = others.first() else { return run(&mut windows(first, &["needs_screen"])) };
        let mut vst3 = windows(second, &[VST3]);
        thread::scope(|scope| {
            let beside = scope.spawn(|| vst3.output().context("cannot run the tests of the VST3 with a screen"));
            run(&mut windows(first, &["needs_screen", "--skip", VST3]))?;
            let out = beside.join().map_err(|_| anyhow!("the thread of tests with a screen has panicked"))??;
            println!("{}{}", String::from_utf8_lossy(&out.stdout), String::from_utf8_lossy(&out.stderr));
            if out.status.success() { Ok(()) } else { Err(anyhow!("tests of the VST3 with a screen failed: {}", out.status)) }
        })
    }
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
