//! The inner loop: format, lints and tests of what a change can have broken.

use crate::bundle::{cargo, run};
use crate::check::Built;
use crate::screen;
use crate::sections::Sections;
use anyhow::{Context, Result, bail};
use cargo_metadata::{MetadataCommand, Package};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Checks the format, lints and tests the crates that have changed, and runs the test programs of all that stand on them. What
/// has changed is what the branch's upstream does not have, committed or not.
///
/// # Errors
/// Git or cargo cannot be run; a check fails.
pub(crate) fn test(root: &Path) -> Result<()> {
    let mut sections = Sections::default();
    sections.run("format", || run(cargo("fmt").args(["--all", "--check"])))?;
    let metadata = MetadataCommand::new().current_dir(root).no_deps().exec().context("cannot run cargo metadata")?;
    let files = changed_files()?;
    let packages = &metadata.packages;
    let changed = changed(packages, &files.iter().map(|file| root.join(file)).collect::<Vec<_>>());
    if changed.is_empty() {
        println!("no crate has changed");
        return Ok(());
    }
    let above: BTreeSet<&str> = &with_dependents(packages, &changed) - &changed;
    let built = Built::new(screen::has_packages())?;
    let only = |command: &str, names: &BTreeSet<&str>| {
        let mut cargo = built.cargo_with(command, |package| names.contains(package));
        for package in packages.iter().filter(|package| !names.contains(package.name.as_str())) {
            cargo.args(["--exclude", package.name.as_str()]);
        }
        cargo
    };
    sections.run("lints", || run(only("clippy", &changed).args(["--all-targets", "--", "-D", "warnings"])))?;
    // What stands on a change meets it from outside; tests inside of these crates would compile each of them a second time.
    let mut result = sections.run("tests", || run(only("test", &changed).args(["--tests", "--no-fail-fast"])));
    if result.is_ok() && !above.is_empty() {
        result = sections.run("tests above", || run(only("test", &above).args(["--test", "*", "--no-fail-fast"])));
    }
    sections.print();
    result
}

/// Paths from the root of all files that the upstream's commit does not have like this; without an upstream, the last commit.
fn changed_files() -> Result<Vec<PathBuf>> {
    let git = |args: &[&str]| -> Result<Option<String>> {
        let out = Command::new("git").args(args).output().context("cannot run git")?;
        Ok(out.status.success().then(|| String::from_utf8_lossy(&out.stdout).into_owned()))
    };
    let base = git(&["merge-base", "HEAD", "@{upstream}"])?.unwrap_or_else(|| "HEAD".to_owned());
    let Some(tracked) = git(&["diff", "--name-only", base.trim()])? else { bail!("this folder is no checkout of git") };
    let new = git(&["ls-files", "--others", "--exclude-standard"])?.unwrap_or_default();
    Ok(tracked.lines().chain(new.lines()).map(PathBuf::from).collect())
}

/// Names of the packages that files are of.
fn changed<'a>(packages: &'a [Package], files: &[PathBuf]) -> BTreeSet<&'a str> {
    let folder = |package: &Package| package.manifest_path.parent().map(|folder| folder.as_std_path().to_owned());
    let holds = |package: &&Package| folder(package).is_some_and(|folder| files.iter().any(|file| file.starts_with(&folder)));
    packages.iter().filter(holds).map(|package| package.name.as_str()).collect()
}

/// Those packages and all that depend on them, however far.
fn with_dependents<'a>(packages: &'a [Package], changed: &BTreeSet<&'a str>) -> BTreeSet<&'a str> {
    let mut found = changed.clone();
    loop {
        let uses = |package: &&Package| package.dependencies.iter().any(|on| found.contains(on.name.as_str()));
        let more: BTreeSet<&str> = packages.iter().filter(uses).map(|package| package.name.as_str()).collect();
        let before = found.len();
        found.extend(more);
        if found.len() == before {
            return found;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_reaches_the_crates_that_stand_on_it() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().unwrap();
        let metadata = MetadataCommand::new().current_dir(&root).no_deps().exec().unwrap();
        let reached = |file: &str| {
            let changed = changed(&metadata.packages, &[root.join(file)]);
            let above = with_dependents(&metadata.packages, &changed);
            (changed.len(), above.into_iter().map(str::to_owned).collect::<Vec<_>>())
        };
        assert_eq!(reached("docs/figures.md"), (0, Vec::new()));
        assert_eq!(reached("crates/cli/src/main.rs"), (1, vec!["promenade".to_owned()]));
        let (changed, above) = reached("core/src/lib.rs");
        assert!(changed == 1 && above.len() > 10 && !above.contains(&"promenade-host".to_owned()), "{above:?}");
    }
}
