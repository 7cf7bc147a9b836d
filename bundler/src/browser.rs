//! Tests of the page that `promenade web` makes, in Chromium.

use crate::bundle::{run, target_folder};
use crate::{packages, web};
use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Where browsers of that family are.
const PROGRAMS: [&str; 3] = ["/usr/bin/chromium", "/usr/bin/google-chrome", "/usr/bin/chromium-browser"];
/// Debian's packages that the engine is compiled with where the toolchain has no standard library for it.
const COMPILER: [&str; 4] = ["rustc-web", "cargo-web", "rust-web-src", "lld-19"];
/// The scripts, which are copied to where the packages of their lock file are installed.
const SCRIPTS: &str = "tests/browser";
/// What says for which lock file those were installed.
const STAMP: &str = "package-lock.installed";

/// What the tests need, if this machine has it.
pub(crate) struct Browser {
    engine: PathBuf,
    scripts: PathBuf,
}

impl Browser {
    /// Builds the engine and installs what is missing; none, with the reason printed, where that cannot be had.
    ///
    /// # Errors
    /// In continuous integration, where nothing may be skipped; an engine that does not compile.
    pub(crate) fn prepare() -> Result<Option<Self>> {
        if !cfg!(target_os = "linux") {
            println!("pages are tested on Linux only");
            return Ok(None);
        }
        let mut missing = Vec::new();
        if browser().is_none() {
            missing.push("chromium");
        }
        if !web::has_library() {
            // Those that are installed may be too old.
            missing.extend(COMPILER);
        }
        if !missing.is_empty() && !packages::install(&missing)? {
            return without(&format!("install for them: {}", missing.join(" ")));
        }
        let node = |program: &str| Command::new(program).arg("--version").output().is_ok_and(|out| out.status.success());
        if !node("node") || !node("npm") {
            return without("install for them: node npm");
        }
        let engine = web::web()?;
        Ok(Some(Self { engine, scripts: scripts()? }))
    }

    /// Runs the tests with a build of the command line.
    pub(crate) fn test(&self, program: &Path) -> Result<()> {
        ["page_test.mjs", "study_test.mjs"].iter().try_for_each(|script| {
            let mut node = Command::new("node");
            node.arg(self.scripts.join(script)).arg(program).arg(&self.engine);
            run(node.env("PROMENADE_CHROMIUM", browser().unwrap_or(PROGRAMS[0])))
        })
    }
}

/// The first browser that is here.
fn browser() -> Option<&'static str> {
    PROGRAMS.into_iter().find(|program| Path::new(program).is_file())
}

fn without(reason: &str) -> Result<Option<Browser>> {
    if std::env::var_os("CI").is_some() {
        bail!("tests of the page cannot run; {reason}");
    }
    println!("tests of the page are skipped; {reason}");
    Ok(None)
}

/// The scripts with their packages, copied so that nothing is installed in the repository.
fn scripts() -> Result<PathBuf> {
    let folder = target_folder()?.join("browser");
    std::fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let context = || format!("cannot copy {SCRIPTS}");
    for file in std::fs::read_dir(SCRIPTS).with_context(context)? {
        let file = file.with_context(context)?;
        if file.file_type().is_ok_and(|kind| kind.is_file()) {
            std::fs::copy(file.path(), folder.join(file.file_name())).with_context(context)?;
        }
    }
    let lock = std::fs::read(folder.join("package-lock.json")).with_context(context)?;
    let stamp = folder.join(STAMP);
    if !std::fs::read(&stamp).is_ok_and(|installed| installed == lock) {
        run(Command::new("npm").args(["ci", "--no-audit", "--no-fund", "--ignore-scripts"]).current_dir(&folder))?;
        std::fs::write(&stamp, lock).with_context(|| format!("cannot write {}", stamp.display()))?;
    }
    Ok(folder)
}
