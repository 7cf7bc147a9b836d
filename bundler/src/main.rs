//! `cargo xtask`: makes the plugin's bundles and archives for users, installs for this user, and runs every test.

mod archive;
mod browser;
mod bundle;
mod check;
mod deny;
mod install;
mod licenses;
mod manifest;
mod manual;
mod package;
mod packages;
mod quick;
mod readme;
mod screen;
mod search;
mod sections;
mod system;
#[cfg(unix)]
mod validators;
mod web;

use crate::bundle::Profile;
use crate::system::System;
use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

const USAGE: &str = "\
cargo xtask bundle [--debug] [other options of cargo build]
    builds Promenade.clap and Promenade.vst3 into target/bundled, as they ship or, quicker, for development
cargo xtask install [other options of cargo build]
    builds the bundles and the command line with training, and copies them, the presets and the scenes to where this
    user's hosts, the plugin and a terminal look for them
cargo xtask archive [--target TARGET] [--without-standalone]
    builds all that users are given into one .zip in target/archives, with licences and how to install it;
    on Linux the standalone program needs the headers of ALSA and JACK
cargo xtask package [--target TARGET]
    packs the archive of a target for its system's own installer, with that system's tool: .deb (dpkg), .pkg (pkgbuild) or a
    setup program (Inno Setup)
cargo xtask web
    builds the engine that pages of `promenade web` play, into target/web
cargo xtask search [MINUTES]
    reads changed files of every kind for so much processor time, 60 minutes unless told, and names those that a reader does not
    survive
cargo xtask validators [--debug]
    runs those of the formats' validators that CLAP_VALIDATOR, VST3_VALIDATOR and PLUGINVAL name, on all plugins
cargo xtask pictures
    makes the pictures of the editor in docs/pictures, on a screen without a monitor
cargo xtask test [--quick]
    checks format and lints, bundles the plugin, runs every test in Rust and in Python; with --quick the lints and
    tests in Rust of the crates that have changed, and the test programs of all that stand on them";

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<()> {
    let root = root();
    std::env::set_current_dir(&root).with_context(|| format!("cannot enter {}", root.display()))?;
    let mut args = std::env::args().skip(1);
    let command = args.next().unwrap_or_default();
    let options = args.collect::<Vec<_>>();
    match command.as_str() {
        "bundle" => {
            let (debug, options): (Vec<_>, Vec<_>) = options.into_iter().partition(|option| option == "--debug");
            let profile = if debug.is_empty() { Profile::Dist } else { Profile::Development };
            let folder = bundle::bundle(profile, &options)?;
            println!("bundles are in {}", folder.display());
            Ok(())
        }
        "install" => {
            let bundles = bundle::bundle(Profile::Dist, &options)?;
            let program = bundle::program(&bundle::COMMAND_LINE, Profile::Dist, System::here()?, None, &options)?;
            let mut programs = vec![program];
            // Everything else works without it.
            match web::web() {
                Ok(engine) => programs.push(engine),
                Err(error) => println!("`promenade web` will have no engine: {error:#}"),
            }
            install::install(&manifest::installed(&root, &bundles, &programs)?)
        }
        "web" if options.is_empty() => web::web().map(|_| ()),
        "archive" => archive::archive(&root, &options),
        "package" => package::package(&root, &options),
        "search" => search::search(&options),
        #[cfg(unix)]
        "validators" => validators::validators(&options),
        "pictures" if options.is_empty() => check::pictures(),
        "test" if options.is_empty() => check::test(),
        "test" if options == ["--quick"] => quick::test(&root),
        "" | "help" | "--help" => {
            println!("{USAGE}");
            Ok(())
        }
        _ => bail!("there is no \"{}\"\n\n{USAGE}", [vec![command], options].concat().join(" ")),
    }
}

/// The repository's folder.
fn root() -> PathBuf {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    package.parent().unwrap_or(package).to_owned()
}
