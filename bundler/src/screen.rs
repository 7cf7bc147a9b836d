//! A screen without a monitor, for the tests that open windows.

use crate::packages;
use anyhow::{Context, Result, bail};
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};

/// Debian's packages: the screen, its software OpenGL and what windows load at run time; headers of the sound systems for the
/// standalone program.
const PACKAGES: [&str; 10] = [
    "libasound2-dev",
    "libegl1",
    "libgl1",
    "libgl1-mesa-dri",
    "libjack-jackd2-dev",
    "libx11-xcb1",
    "libxcursor1",
    "libxkbcommon-x11-0",
    "pkg-config",
    "xvfb",
];
/// Wide enough for the editor at three times its size.
const SIZE: &str = "3600x2400x24";

/// A running X server; it ends when this is dropped.
pub(crate) struct Screen {
    server: Child,
    /// Its name for programs.
    pub(crate) display: String,
}

impl Screen {
    /// Starts several; none, with the reason printed, on systems without X11 or where its packages are missing and cannot be
    /// installed.
    ///
    /// # Errors
    /// In continuous integration, where nothing may be skipped, and when a server does not start.
    pub(crate) fn start_several(count: usize) -> Result<Vec<Self>> {
        if !cfg!(target_os = "linux") {
            println!("windows are tested on Linux only");
            return Ok(Vec::new());
        }
        let missing = missing_packages();
        if !missing.is_empty() && !packages::install(&missing)? {
            let missing = missing.join(" ");
            if std::env::var_os("CI").is_some() {
                bail!("packages are missing: {missing}");
            }
            println!("tests with windows are skipped; install for them: {missing}");
            return Ok(Vec::new());
        }
        (0..count).map(|_| Self::start()).collect()
    }

    fn start() -> Result<Self> {
        // Without a reset, which would turn away whoever comes just after the last window has gone. The server picks a free
        // number and writes it to the file descriptor that it is given.
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", SIZE, "+extension", "GLX", "-noreset", "-nolisten", "tcp"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .context("cannot start Xvfb")?;
        let mut number = String::new();
        if let Some(out) = server.stdout.as_mut() {
            BufReader::new(out).read_line(&mut number).context("Xvfb does not name its display")?;
        }
        let display = format!(":{}", number.trim());
        let screen = Self { server, display };
        if number.trim().is_empty() {
            bail!("Xvfb has ended without a display");
        }
        Ok(screen)
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// Whether the packages for screens and for the standalone program are there.
pub(crate) fn has_packages() -> bool {
    missing_packages().is_empty()
}

/// What Debian's package list lacks; everything where there is no such list but also no server.
fn missing_packages() -> Vec<&'static str> {
    if !Path::new("/usr/bin/dpkg-query").is_file() {
        let there = Command::new("Xvfb").arg("-help").output().is_ok();
        return if there { Vec::new() } else { PACKAGES.to_vec() };
    }
    packages::missing(&PACKAGES)
}
