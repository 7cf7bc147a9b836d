//! Scene files.

use anyhow::{Context, Result, bail};
use promenade_baker::atomic;
use promenade_core::Scene;
use std::path::Path;

pub(crate) use promenade_player::command::read_scene as read;

/// Refuses a name that says that a file is no scene.
pub(crate) fn check_name(path: &Path) -> Result<()> {
    if path.extension().is_some_and(|ending| !ending.eq_ignore_ascii_case("promenade")) {
        let found = path.file_name().unwrap_or_default().display();
        bail!("{}: expected a name that ends in .promenade, the format that is written, found {found}", path.display());
    }
    Ok(())
}

/// Writes a scene; its name must say that it is one.
pub(crate) fn write(path: &Path, scene: &Scene) -> Result<usize> {
    check_name(path)?;
    let bytes = scene.to_bytes().with_context(|| format!("{}: cannot be written", path.display()))?;
    atomic::write(path, &bytes)?;
    Ok(bytes.len())
}
