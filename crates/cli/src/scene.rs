//! Scene files.

use anyhow::{Context, Result};
use promenade_baker::atomic;
use promenade_core::Scene;
use std::path::Path;

pub(crate) use promenade_player::command::read_scene as read;

pub(crate) fn write(path: &Path, scene: &Scene) -> Result<usize> {
    let bytes = scene.to_bytes().with_context(|| format!("{}: cannot be written", path.display()))?;
    atomic::write(path, &bytes)?;
    Ok(bytes.len())
}
