//! From the built library to the folders and files that hosts expect.

use anyhow::{Context, Result};
use std::path::PathBuf;

/// The package that is bundled.
const PACKAGE: &str = "promenade-plugin";

/// Cargo's target folder.
pub(crate) fn target_folder() -> Result<PathBuf> {
    let folder = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| PathBuf::from("target"), PathBuf::from);
    std::path::absolute(folder).context("the target folder has no absolute path")
}

/// Builds the plugin with options of `cargo build` and lays out its bundles; returns their folder.
pub(crate) fn bundle(options: &[String]) -> Result<PathBuf> {
    nice_plug_xtask::build(&[PACKAGE.to_owned()], options)?;
    lay_out(options)
}

/// Lays out the bundles of a plugin that was built with these options; returns their folder.
pub(crate) fn lay_out(options: &[String]) -> Result<PathBuf> {
    let target = target_folder()?;
    nice_plug_xtask::bundle(&target, PACKAGE, options, false)?;
    Ok(target.join("bundled"))
}
