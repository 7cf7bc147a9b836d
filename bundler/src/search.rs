//! Searches for files that readers do not survive, for longer than tests take.

use crate::bundle::{cargo, run};
use anyhow::{Context, Result, bail};

/// Processor time of all targets together, minutes, unless told.
const MINUTES: f64 = 60.0;
/// Packages with a `tests/fuzz.rs`, and the targets of all of them, which get the same time each.
const PACKAGES: [&str; 3] = ["promenade-baker", "promenade-study", "promenade-fit"];
const TARGETS: f64 = 13.0;

/// Searches all targets one after the other; what is found is named, and fails.
pub(crate) fn search(options: &[String]) -> Result<()> {
    let minutes = match options {
        [] => MINUTES,
        [minutes] => minutes.parse().with_context(|| format!("expected minutes of processor time, found \"{minutes}\""))?,
        _ => bail!("expected minutes of processor time alone"),
    };
    let each = (minutes / TARGETS).max(0.01).to_string();
    let one_by_one = ["--", "--nocapture", "--test-threads", "1"];
    let mut tests = cargo("test");
    tests.args(["--release", "--no-fail-fast"]).args(PACKAGES.iter().flat_map(|package| ["-p", package]));
    tests.args(["--test", "fuzz"]).args(one_by_one).env("PROMENADE_MINUTES", each);
    run(&mut tests)
}
