//! From sources to binaries, and from those to the folders and files that hosts expect.

use crate::manifest::BUNDLES;
use crate::system::System;
use anyhow::{Context, Result, bail};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// How well a build is optimised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Profile {
    /// As tests are built.
    Development,
    /// As it ships: optimised over all crates, without symbols.
    Dist,
}

impl Profile {
    /// The option of `cargo build`, if it takes one.
    fn option(self) -> Option<&'static str> {
        match self {
            Self::Development => None,
            Self::Dist => Some("--profile=dist"),
        }
    }

    /// The name of the folder in cargo's target folder.
    fn folder(self) -> &'static str {
        match self {
            Self::Development => "debug",
            Self::Dist => "dist",
        }
    }
}

/// A package and the features that it ships with.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Build {
    pub(crate) package: &'static str,
    pub(crate) features: &'static str,
    /// Its program; none if it is the plugin.
    program: Option<&'static str>,
}

/// The plugin by itself, because features of another package would come into it.
const PLUGIN: Build = Build { package: "promenade-plugin", features: "", program: None };
/// With training, which is one of the main things it is for.
pub(crate) const COMMAND_LINE: Build = Build { package: "promenade", features: "train", program: Some("promenade") };
const STANDALONE: Build = Build { package: "promenade-plugin", features: "standalone", program: Some("promenade-standalone") };
/// All that is shipped. The standalone program comes last: with it the plugin's library is built again.
pub(crate) const BUILDS: [Build; 3] = [PLUGIN, COMMAND_LINE, STANDALONE];

/// Both processors of macOS in each binary, as a target.
pub(crate) const UNIVERSAL: &str = "universal-apple-darwin";

/// The targets that rustc knows of what is asked for; none: that of this machine.
pub(crate) fn targets(asked: Option<&str>) -> Vec<&str> {
    match asked {
        Some(UNIVERSAL) => vec!["aarch64-apple-darwin", "x86_64-apple-darwin"],
        asked => asked.into_iter().collect(),
    }
}

impl Build {
    /// Whether it is the program that needs no host.
    pub(crate) fn is_standalone(&self) -> bool {
        self.program == STANDALONE.program
    }
}

/// A command of the cargo that runs `cargo xtask`.
pub(crate) fn cargo(command: &str) -> Command {
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.arg(command);
    cargo
}

/// Runs a command to its end.
pub(crate) fn run(command: &mut Command) -> Result<()> {
    let status = command.status().with_context(|| format!("cannot run {command:?}"))?;
    if !status.success() {
        bail!("{command:?} failed: {status}");
    }
    Ok(())
}

/// Cargo's target folder.
pub(crate) fn target_folder() -> Result<PathBuf> {
    let folder = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| PathBuf::from("target"), PathBuf::from);
    std::path::absolute(folder).context("the target folder has no absolute path")
}

/// Builds the plugin with more options of `cargo build` and lays out its bundles; returns their folder.
pub(crate) fn bundle(profile: Profile, options: &[String]) -> Result<PathBuf> {
    let profile = profile.option().map(str::to_owned);
    let options = profile.into_iter().chain(options.iter().cloned()).collect::<Vec<_>>();
    nice_plug_xtask::build(&[PLUGIN.package.to_owned()], &options)?;
    lay_out(&options)
}

/// Lays out the bundles of a plugin that was built with these options; returns their folder.
pub(crate) fn lay_out(options: &[String]) -> Result<PathBuf> {
    let target = target_folder()?;
    // A bundle can hold the libraries of several systems, so one that was made for another is not written over but added to.
    for (bundle, _) in BUNDLES {
        remove(&target.join("bundled").join(bundle))?;
    }
    nice_plug_xtask::bundle(&target, PLUGIN.package, options, false)?;
    Ok(target.join("bundled"))
}

/// Builds a program with more options of `cargo build`; returns its path.
pub(crate) fn program(
    build: &Build,
    profile: Profile,
    system: System,
    target: Option<&str>,
    options: &[String],
) -> Result<PathBuf> {
    let name = build.program.with_context(|| format!("{} has no program", build.package))?;
    let mut command = cargo("build");
    command.args(profile.option()).args(["--package", build.package, "--features", build.features, "--bin", name]);
    let mut folder = target_folder()?;
    if let Some(target) = target {
        command.args(["--target", target]);
        folder.push(target);
    }
    command.args(options);
    run(&mut command)?;
    Ok(folder.join(profile.folder()).join(system.program(name)))
}

/// Builds what ships; returns the bundles' folder and the programs.
pub(crate) fn ship(
    builds: &[Build],
    profile: Profile,
    system: System,
    target: Option<&str>,
) -> Result<(PathBuf, Vec<PathBuf>)> {
    if target == Some(UNIVERSAL) {
        return ship_universal(builds, profile, system);
    }
    let options: Vec<String> = target.map(|target| format!("--target={target}")).into_iter().collect();
    let mut bundles = PathBuf::new();
    let mut programs = Vec::new();
    for build in builds {
        match build.program {
            None => bundles = bundle(profile, &options)?,
            Some(_) => programs.push(program(build, profile, system, target, &[])?),
        }
    }
    Ok((bundles, programs))
}

/// [`ship`] for both processors of macOS, each binary of the two joined by Apple's `lipo`.
fn ship_universal(builds: &[Build], profile: Profile, system: System) -> Result<(PathBuf, Vec<PathBuf>)> {
    let folder = target_folder()?;
    let options: Vec<String> = profile.option().map(str::to_owned).into_iter().collect();
    let mut programs = Vec::new();
    for build in builds {
        let mut made = Vec::new();
        for target in targets(Some(UNIVERSAL)) {
            match build.program {
                None => {
                    let options = [&options[..], &[format!("--target={target}")]].concat();
                    nice_plug_xtask::build(&[PLUGIN.package.to_owned()], &options)?;
                }
                Some(_) => made.push(program(build, profile, system, Some(target), &[])?),
            }
        }
        match build.program {
            // Before the standalone program, for which the library is built again.
            None => {
                for (bundle, _) in BUNDLES {
                    remove(&folder.join("bundled").join(bundle))?;
                }
                nice_plug_xtask::bundle(&folder, PLUGIN.package, &options, true)?;
            }
            Some(name) => {
                let joined = folder.join(UNIVERSAL).join(system.program(name));
                fs::create_dir_all(folder.join(UNIVERSAL)).with_context(|| format!("cannot make {UNIVERSAL}"))?;
                run(Command::new("lipo").args(["-create", "-output"]).arg(&joined).args(&made))?;
                // Joining takes the signature off, and Apple's own processors run nothing unsigned.
                run(Command::new("codesign").args(["--force", "--sign", "-"]).arg(&joined))?;
                programs.push(joined);
            }
        }
    }
    Ok((folder.join("bundled"), programs))
}

/// Removes a file or a folder, if it is there.
pub(crate) fn remove(path: &Path) -> Result<()> {
    let removed = if path.is_dir() {
        fs::remove_dir_all(path)
    } else if path.exists() {
        fs::remove_file(path)
    } else {
        Ok(())
    };
    removed.with_context(|| format!("cannot replace {}", path.display()))
}
