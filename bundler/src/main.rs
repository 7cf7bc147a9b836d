//! `cargo xtask`: makes the plugin's bundles, installs them for the user, and runs every test.

mod bundle;
mod check;
mod install;
mod screen;
mod sections;

use anyhow::{Context, Result, bail};
use std::path::PathBuf;
use std::process::ExitCode;

const USAGE: &str = "\
cargo xtask bundle [--release] [other options of cargo build]
    builds Promenade.clap and Promenade.vst3 into target/bundled
cargo xtask install [other options of cargo build]
    builds the release bundles and copies them, presets and scenes to where this user's hosts look for them
cargo xtask test
    checks format and lints, bundles the plugin, runs every test in Rust and in Python";

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
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().context("the workspace has moved")?;
    std::env::set_current_dir(&root).with_context(|| format!("cannot enter {}", root.display()))?;
    let mut args = std::env::args().skip(1);
    let command = args.next().unwrap_or_default();
    let options = args.collect::<Vec<_>>();
    match command.as_str() {
        "bundle" => {
            let folder = bundle::bundle(&options)?;
            println!("bundles are in {}", folder.display());
            Ok(())
        }
        "install" => install::install(&options),
        "test" if options.is_empty() => check::test(),
        "" | "help" | "--help" => {
            println!("{USAGE}");
            Ok(())
        }
        _ => bail!("there is no \"{}\"\n\n{USAGE}", [vec![command], options].concat().join(" ")),
    }
}
