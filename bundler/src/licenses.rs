//! Licences of the crates that a build links, with their texts.

use crate::bundle::{self, Build, cargo};
use crate::deny::Deny;
use anyhow::{Context, Result, bail};
use cargo_metadata::{CargoOpt, MetadataCommand, Package};
use spdx::{Expression, LicenseReq, ParseMode};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

/// A shorter file only refers to a licence, bytes.
const SHORTEST: usize = 400;

/// What a file's name says about the licence that it holds; the first that fits counts.
const NAMES: [(&str, &str); 12] = [
    ("unlicense", "Unlicense"),
    ("apache", "Apache-2.0"),
    ("a2", "Apache-2.0"),
    ("mit0", "MIT-0"),
    ("mit-0", "MIT-0"),
    ("mit", "MIT"),
    ("zlib", "Zlib"),
    ("0bsd", "0BSD"),
    ("bsd", "BSD-2-Clause"),
    ("boost", "BSL-1.0"),
    ("cc0", "CC0-1.0"),
    ("gpl", "GPL-2.0-only"),
];

/// A crate of somebody else's, and the licences that it is used under.
#[derive(Debug)]
pub(crate) struct Dependency {
    pub(crate) name: String,
    version: String,
    authors: Vec<String>,
    repository: String,
    /// As its manifest has it.
    offered: String,
    chosen: Vec<LicenseReq>,
    /// File names and what is in them.
    pub(crate) texts: Vec<(String, String)>,
}

/// The crates that builds link for a target (none: this machine's), sorted by name.
///
/// # Errors
/// A crate has no licence that is allowed, or its sources cannot be read.
pub(crate) fn dependencies(root: &Path, builds: &[Build], target: Option<&str>) -> Result<Vec<Dependency>> {
    let mut linked = BTreeSet::new();
    for build in builds {
        linked.extend(linked_by(root, build, target)?);
    }
    let mut command = MetadataCommand::new();
    let mut options = vec!["--locked".to_owned()];
    options.extend(bundle::targets(target).iter().map(|target| format!("--filter-platform={target}")));
    let wanted = builds.iter().filter(|build| !build.features.is_empty());
    let features = wanted.map(|build| format!("{}/{}", build.package, build.features)).collect();
    command.current_dir(root).other_options(options).features(CargoOpt::SomeFeatures(features));
    let metadata = command.exec().context("cargo does not describe the packages")?;
    let known = metadata.packages.iter().map(|p| ((p.name.to_string(), p.version.to_string()), p)).collect::<BTreeMap<_, _>>();
    let mut dependencies = Vec::new();
    for (name, version) in linked {
        let package = known.get(&(name.clone(), version)).with_context(|| format!("cargo does not describe {name}"))?;
        // Ours come from no registry.
        if package.source.is_some() {
            dependencies.push(dependency(package)?);
        }
    }
    Ok(dependencies)
}

/// Names and versions of the crates in a build's binaries: no build scripts, macros or tests.
pub(crate) fn linked_by(root: &Path, build: &Build, target: Option<&str>) -> Result<BTreeSet<(String, String)>> {
    let mut tree = cargo("tree");
    tree.current_dir(root).args(["--locked", "--edges", "normal,no-proc-macro", "--prefix", "none", "--format", "{p}"]);
    tree.args(["--package", build.package, "--features", build.features]);
    for target in bundle::targets(target) {
        tree.args(["--target", target]);
    }
    let out = tree.output().context("cannot run cargo tree")?;
    if !out.status.success() {
        bail!("cargo tree failed: {}", String::from_utf8_lossy(&out.stderr));
    }
    let listed = String::from_utf8(out.stdout).context("cargo tree does not write UTF-8")?;
    let package = |line: &str| {
        let mut words = line.split_whitespace();
        Some((words.next()?.to_owned(), words.next()?.strip_prefix('v')?.to_owned()))
    };
    Ok(listed.lines().filter_map(package).collect())
}

fn dependency(package: &Package) -> Result<Dependency> {
    let offered = package.license.clone().unwrap_or_default();
    let of = || format!("{} {}", package.name, package.version);
    let expression = Expression::parse_mode(&offered, ParseMode::LAX)
        .with_context(|| format!("{} has no licence that can be read, found \"{offered}\"", of()))?;
    let chosen = chosen(&expression, package.name.as_ref())
        .with_context(|| format!("{} has no licence that is allowed, found \"{offered}\"", of()))?;
    let folder = package.manifest_path.parent().with_context(|| format!("{} has no folder", of()))?.as_std_path();
    let mut texts = Vec::new();
    for path in licence_files(folder).with_context(|| format!("the sources of {} cannot be read", of()))? {
        let name = path.strip_prefix(folder).unwrap_or(&path).display().to_string();
        if !is_declined(&path, &expression, &chosen) {
            let bytes = fs::read(&path).with_context(|| format!("{} cannot be read", path.display()))?;
            texts.push((name, String::from_utf8_lossy(&bytes).into_owned()));
        }
    }
    for licence in &chosen {
        if !texts.iter().any(|(name, text)| text.len() >= SHORTEST && covers(name, licence)) {
            let id = licence.license.id().with_context(|| format!("{} has a licence without a text", of()))?;
            texts.push((format!("{} of the SPDX list", id.name), id.text().to_owned()));
        }
    }
    Ok(Dependency {
        name: package.name.to_string(),
        version: package.version.to_string(),
        authors: package.authors.clone(),
        repository: package.repository.clone().unwrap_or_default(),
        offered,
        chosen,
        texts,
    })
}

/// The fewest licences that meet an expression, of those that a crate is allowed.
fn chosen(expression: &Expression, name: &str) -> Result<Vec<LicenseReq>> {
    Ok(expression.minimized_requirements(&Deny::read()?.allowed(name)?)?)
}

/// Files whose name says that they hold a licence or a notice, and the texts beside fonts, from the whole of a crate.
fn licence_files(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let (mut files, mut folders) = (Vec::new(), Vec::new());
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() { folders.push(path) } else { files.push(path) }
    }
    let ends = |path: &PathBuf, ending: &str| path.extension().is_some_and(|e| e == ending);
    let fonts = files.iter().any(|path| ends(path, "ttf") || ends(path, "otf"));
    let begins = ["licen", "copying", "copyright", "notice", "unlicense"];
    let named = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
        begins.iter().any(|begin| name.starts_with(begin)) && !ends(path, "rs") || fonts && ends(path, "txt")
    };
    files.retain(named);
    for folder in folders {
        files.extend(licence_files(&folder)?);
    }
    files.sort();
    Ok(files)
}

/// The licence that a file's name speaks of.
fn named(path: &Path) -> Option<&'static str> {
    let name = path.file_name()?.to_str()?.to_lowercase();
    NAMES.iter().find(|(part, _)| name.contains(part)).map(|(_, id)| *id)
}

/// Whether a file holds a licence that the crate offers and that was not chosen.
fn is_declined(path: &Path, expression: &Expression, chosen: &[LicenseReq]) -> bool {
    let is = |licence: &LicenseReq, id: &str| licence.license.id().is_some_and(|l| l.name == id);
    named(path).is_some_and(|id| expression.requirements().any(|r| is(&r.req, id)) && !chosen.iter().any(|c| is(c, id)))
}

/// Whether a file at the root of a crate has the text of a licence: it names this one or none.
fn covers(name: &str, licence: &LicenseReq) -> bool {
    let path = Path::new(name);
    let id = licence.license.id().map_or("", |id| id.name);
    let font = |begin: &str| path.file_name().is_some_and(|n| n.to_string_lossy().to_lowercase().starts_with(begin));
    match id {
        "OFL-1.1" => font("ofl"),
        "Ubuntu-font-1.0" => font("ufl"),
        _ => path.parent() == Some(Path::new("")) && named(path).is_none_or(|named| named == id),
    }
}

/// A document of all dependencies, each text once.
pub(crate) fn document(dependencies: &[Dependency]) -> String {
    let mut out = String::from(
        "Promenade's programs and plugins contain the crates below, in the versions given, under the licences named first; \
         what their\n\
         authors offer besides stands in brackets. The texts follow, each with the crates that it belongs to.\n\n",
    );
    let mut by_text = BTreeMap::<String, Vec<String>>::new();
    for dependency in dependencies {
        let chosen = dependency.chosen.iter().map(ToString::to_string).collect::<Vec<_>>().join(" AND ");
        let Dependency { name, version, authors, repository, offered, .. } = dependency;
        // Writing to a String cannot fail.
        let _ = write!(out, "{name} {version}: {chosen}");
        if *offered != chosen {
            let _ = write!(out, " [{offered}]");
        }
        let _ = writeln!(out, "\n    {}{}{repository}", authors.join(", "), if authors.is_empty() { "" } else { "; " });
        for (file, text) in &dependency.texts {
            let text = text.replace("\r\n", "\n");
            by_text.entry(text.trim().to_owned()).or_default().push(format!("{name} ({file})"));
        }
    }
    for (text, crates) in by_text {
        let _ = write!(out, "\n{}\n{}\n\n{text}\n", "=".repeat(100), crates.join(", "));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::root;

    fn expression(text: &str) -> Expression {
        Expression::parse_mode(text, ParseMode::LAX).unwrap()
    }

    #[test]
    fn the_simplest_allowed_licence_is_chosen() {
        for (offered, wanted) in [
            ("Apache-2.0/MIT", vec!["MIT"]),
            ("Apache-2.0 OR GPL-2.0-only", vec!["Apache-2.0"]),
            ("(MIT OR Apache-2.0) AND OFL-1.1", vec!["MIT", "OFL-1.1"]),
        ] {
            let chosen = chosen(&expression(offered), "some").unwrap();
            assert_eq!(chosen.iter().map(ToString::to_string).collect::<Vec<_>>(), wanted, "{offered}");
        }
        for refused in ["GPL-3.0-only", "MIT AND AGPL-3.0-only", "CC-BY-NC-4.0", "MPL-2.0"] {
            assert!(chosen(&expression(refused), "some").is_err(), "{refused}");
        }
    }

    #[test]
    fn texts_that_were_not_chosen_are_left_out() {
        let offered = expression("Apache-2.0 OR GPL-2.0-only");
        let chosen = chosen(&offered, "some").unwrap();
        assert!(is_declined(Path::new("LICENSE-GPLv2"), &offered, &chosen));
        for kept in ["LICENSE-APACHE", "LICENSE", "LICENSE-HDF5", "NOTICE"] {
            assert!(!is_declined(Path::new(kept), &offered, &chosen), "{kept}");
        }
    }

    #[test]
    fn every_crate_that_ships_has_an_allowed_licence_and_its_text() {
        let for_target = |target| dependencies(&root(), &bundle::BUILDS, target).unwrap();
        let windows = for_target(Some("x86_64-pc-windows-gnu"));
        assert!(windows.iter().any(|d| d.name == "clipboard-win"), "a crate that only Windows has");
        let (all, macos) = (for_target(None), for_target(Some("aarch64-apple-darwin")));
        for dependency in all.iter().chain(&windows).chain(&macos) {
            let full = dependency.texts.iter().filter(|(_, text)| text.len() >= SHORTEST).count();
            assert!((1..=full).contains(&dependency.chosen.len()), "{dependency:?}");
        }
        let names = all.iter().map(|d| d.name.as_str()).collect::<Vec<_>>();
        for linked in ["nice-plug", "egui", "blake3", "cpal", "safetensors", "clap", "burn"] {
            assert!(names.contains(&linked), "{linked}");
        }
        for other in ["tempfile", "serde_derive", "cc", "promenade-core"] {
            assert!(!names.contains(&other), "{other}");
        }
        let text = document(&all);
        for words in [
            "nice-plug 0.",
            "SIL OPEN FONT LICENSE",
            "UBUNTU FONT LICENCE",
            "Permission to use, copy, modify, and/or distribute",
            "Mozilla Public License",
            "UNICODE LICENSE V3",
        ] {
            assert!(text.contains(words), "{words}");
        }
        assert!(!text.contains("GNU GENERAL PUBLIC LICENSE"));
    }
}
