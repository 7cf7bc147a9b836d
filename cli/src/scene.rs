//! Scene files.

use anyhow::{Context, Result, bail};
use promenade_baker::atomic;
use promenade_core::Scene;
use std::path::Path;
use std::sync::Arc;

/// Bytes a scene file may have; checked before it is read.
const MAX_BYTES: u64 = 1 << 31;

pub(crate) fn read(path: &Path) -> Result<Arc<Scene>> {
    let name = path.display();
    let size = std::fs::metadata(path).with_context(|| format!("{name}: cannot be read"))?.len();
    if size > MAX_BYTES {
        bail!("{name}: expected a scene of at most {MAX_BYTES} bytes, found {size}");
    }
    let bytes = std::fs::read(path).with_context(|| format!("{name}: cannot be read"))?;
    let scene = Scene::from_bytes(&bytes).with_context(|| format!("{name}: no readable scene"))?;
    Ok(Arc::new(scene))
}

pub(crate) fn write(path: &Path, scene: &Scene) -> Result<usize> {
    let bytes = scene.to_bytes().with_context(|| format!("{}: cannot be written", path.display()))?;
    atomic::write(path, &bytes)?;
    Ok(bytes.len())
}
