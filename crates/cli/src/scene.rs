//! Scene files.

use anyhow::{Context, Result};
use promenade_baker::{atomic, file};
use promenade_core::{MAX_SCENE_BYTES, Scene};
use std::path::Path;
use std::sync::Arc;

pub(crate) fn read(path: &Path) -> Result<Arc<Scene>> {
    let name = path.display();
    let bytes = file::read(path, MAX_SCENE_BYTES as u64).with_context(|| format!("{name}: cannot be read"))?;
    let scene = Scene::from_bytes(&bytes).with_context(|| format!("{name}: no readable scene"))?;
    Ok(Arc::new(scene))
}

pub(crate) fn write(path: &Path, scene: &Scene) -> Result<usize> {
    let bytes = scene.to_bytes().with_context(|| format!("{}: cannot be written", path.display()))?;
    atomic::write(path, &bytes)?;
    Ok(bytes.len())
}
