//! Debian's packages that tests need.

use anyhow::{Context, Result};
use std::path::Path;
use std::process::{Command, Stdio};

/// What the system's list lacks of packages; all of them where there is no such list.
pub(crate) fn missing(packages: &[&'static str]) -> Vec<&'static str> {
    let installed = |package: &str| {
        let status = Command::new("dpkg-query").args(["--show", "--showformat", "${db:Status-Status}", package]).output();
        status.is_ok_and(|out| out.stdout == b"installed")
    };
    packages.iter().copied().filter(|package| !installed(package)).collect()
}

/// Installs packages where this user may; says whether it did.
pub(crate) fn install(packages: &[&str]) -> Result<bool> {
    let user = Command::new("id").arg("-u").output().context("cannot run id")?;
    if user.stdout.trim_ascii() != b"0" || !Path::new("/usr/bin/apt-get").is_file() {
        return Ok(false);
    }
    let apt = |args: &[&str]| {
        let status = Command::new("apt-get").args(args).env("DEBIAN_FRONTEND", "noninteractive").stdout(Stdio::null()).status();
        status.context("cannot run apt-get").map(|status| status.success())
    };
    Ok(apt(&["update"])? && apt(&[&["install", "--yes", "--no-install-recommends"], packages].concat())?)
}
