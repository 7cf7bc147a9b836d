//! The validators of those who make the formats, as far as the environment names them; `docs/hosts.md` says how they are built.

use crate::bundle::{self, Profile};
use crate::screen::Screen;
use anyhow::{Context, Result, bail};
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Orders of pluginval's tests, at [`USUAL`] and at [`ALL`].
const ORDERS: [(usize, [&str; 2]); 2] = [(20, USUAL), (5, ALL)];
/// A rate and a block.
const USUAL: [&str; 2] = ["48000", "512"];
/// Rates and blocks, each with each.
const ALL: [&str; 2] = ["22050,44100,48000,88200,96000,192000", "1,16,64,512,4096"];
/// What validators print of what they find and let pass.
const NOISE: [&str; 4] = ["ERROR", "not correctly", "WARNING", "FAILED"];

/// Something that a validator is run on.
struct Run {
    what: String,
    command: Command,
}

/// What came of it.
#[derive(Debug, PartialEq, Eq)]
enum Outcome {
    Passed,
    Failed,
    /// The host has gone with the plugin, by a signal.
    Aborted(i32),
}

/// Bundles the plugins, runs each validator that is named on all of them, and prints a table.
///
/// # Errors
/// None is named, one cannot be run, or one finds anything.
pub(crate) fn validators(options: &[String]) -> Result<()> {
    let named = ["CLAP_VALIDATOR", "VST3_VALIDATOR", "PLUGINVAL"].map(|name| std::env::var_os(name).map(PathBuf::from));
    if named.iter().all(Option::is_none) {
        bail!("CLAP_VALIDATOR, VST3_VALIDATOR or PLUGINVAL has to name a validator");
    }
    let profile = match options.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [] => Profile::Dist,
        ["--debug"] => Profile::Development,
        _ => bail!("expected --debug or nothing"),
    };
    let bundles = bundle::bundle(profile, &[])?;
    let Some(screen) = Screen::start_several(1)?.pop() else { bail!("validators open windows") };
    let (clap, vst3) = (bundles.join("Promenade.clap"), bundles.join("Promenade.vst3"));
    let [clap_validator, vst3_validator, pluginval] = named;
    let runs = clap_validator.iter().map(|program| clap_run(program, &clap));
    let runs = runs.chain(vst3_validator.iter().flat_map(|program| vst3_runs(program, &vst3)));
    let runs = runs.chain(pluginval.iter().flat_map(|program| pluginval_runs(program, &vst3)));
    let (mut rows, mut failed) = (Vec::new(), 0);
    for Run { what, mut command } in runs {
        println!("{what}");
        let output = command.env("DISPLAY", &screen.display).output().with_context(|| format!("cannot run {command:?}"))?;
        let outcome = outcome(&output);
        failed += usize::from(outcome != Outcome::Passed);
        rows.push(row(&what, &outcome, &text(&output)));
    }
    println!("\n| Validator | Outcome | Tests | What it prints besides |\n|---|---|---|---|\n{}", rows.join("\n"));
    if failed == 0 { Ok(()) } else { bail!("{failed} of {} runs found something", rows.len()) }
}

fn clap_run(program: &Path, bundle: &Path) -> Run {
    let mut command = Command::new(program);
    command.arg("validate").arg(bundle);
    Run { what: "clap-validator".to_owned(), command }
}

fn vst3_runs(program: &Path, bundle: &Path) -> [Run; 2] {
    ["", "-e"].map(|option| {
        let mut command = Command::new(program);
        command.args((!option.is_empty()).then_some(option)).arg(bundle);
        Run { what: format!("Steinberg's validator {option}").trim_end().to_owned(), command }
    })
}

fn pluginval_runs(program: &Path, bundle: &Path) -> Vec<Run> {
    let run = |seed: usize, [rates, blocks]: [&str; 2]| {
        let mut command = Command::new(program);
        command.args(["--strictness-level", "10", "--validate-in-process", "--randomise", "--seed", &seed.to_string()]);
        command.args(["--sample-rates", rates, "--block-sizes", blocks, "--validate"]).arg(bundle);
        Run { what: format!("pluginval, order {seed}, {rates} Hz, blocks of {blocks}"), command }
    };
    ORDERS.into_iter().flat_map(|(count, at)| (1..=count).map(move |seed| run(seed, at))).collect()
}

fn outcome(output: &Output) -> Outcome {
    match output.status.signal() {
        Some(signal) => Outcome::Aborted(signal),
        None if output.status.success() => Outcome::Passed,
        None => Outcome::Failed,
    }
}

fn text(output: &Output) -> String {
    [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned()).concat()
}

/// A line of the table.
fn row(what: &str, outcome: &Outcome, text: &str) -> String {
    let outcome = match outcome {
        Outcome::Passed => "passed".to_owned(),
        Outcome::Failed => "failed".to_owned(),
        Outcome::Aborted(signal) => format!("ended by signal {signal}"),
    };
    let counted = text.lines().rev().find(|line| line.contains("tests passed") || line.contains(" passed, "));
    // The plugin's own lines begin with the time.
    let found = |line: &'_ str| NOISE.iter().filter_map(|word| line.find(word)).min();
    let mut noise: Vec<_> = text.lines().filter_map(|line| Some(line[found(line)?..].trim())).collect();
    noise.sort_unstable();
    noise.dedup();
    format!("| {what} | {outcome} | {} | {} |", counted.unwrap_or_default().trim(), noise.join("; "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_says_how_a_run_ended_and_what_was_let_pass() {
        let text = "Info\nThe bypass parameter was not correctly set!\nThe bypass parameter was not correctly set!\n\
                    Result: 141 tests passed, 0 tests failed\n";
        assert_eq!(
            row("one", &Outcome::Passed, text),
            "| one | passed | Result: 141 tests passed, 0 tests failed | not correctly set! |"
        );
        assert_eq!(row("two", &Outcome::Aborted(6), ""), "| two | ended by signal 6 |  |  |");
    }

    #[test]
    fn a_program_that_falls_is_aborted() {
        let run = |script: &str| outcome(&Command::new("sh").args(["-c", script]).output().unwrap());
        assert_eq!([run("true"), run("exit 3"), run("kill -ABRT $$")], [Outcome::Passed, Outcome::Failed, Outcome::Aborted(6)]);
    }
}
