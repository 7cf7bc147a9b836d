//! Scene files.

use crate::args::LessArgs;
use crate::report;
use anyhow::{Context, Result, bail};
use promenade_baker::atomic;
use promenade_baker::trade::scene_within;
use promenade_core::{Scene, Setting};
use std::path::Path;
use std::sync::Arc;

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

/// Writes [`kept`] of a scene. Returns how many bytes.
pub(crate) fn write_kept(output: &Path, whole: impl Into<Arc<Scene>>, args: LessArgs) -> Result<usize> {
    let kept = kept(output, whole, args)?;
    write(output, &kept)
}

/// The least of a scene that stays within the error that is asked for, if one is; says what that costs and saves.
pub(crate) fn kept(output: &Path, whole: impl Into<Arc<Scene>>, args: LessArgs) -> Result<Arc<Scene>> {
    let whole = whole.into();
    let Some(limit) = args.within else { return Ok(whole) };
    check_name(output)?;
    let bar = report::Bar::new("comparing settings", 1.0);
    let found = scene_within(&whole, limit, &|| true);
    drop(bar);
    let (kept, point) = found.with_context(|| format!("{}: settings of it cannot be compared", output.display()))?;
    let mut parts = kept.parts().clone();
    if !parts.provenance.recipe.is_empty() {
        parts.provenance.recipe += &format!(" --within {limit}");
    }
    let kept = Scene::new(parts).with_context(|| format!("{}: cannot be reduced", output.display()))?;
    report::line(format_args!(
        "within {limit} JND: {}, {:.0} % of the operations, {} of {} kB, {:.2} JND by {}",
        words(point.setting, &whole),
        100.0 * point.cost,
        kept.to_bytes()?.len().div_ceil(1000),
        whole.to_bytes()?.len().div_ceil(1000),
        point.error.jnds,
        point.error.measure.name()
    ));
    Ok(Arc::new(kept))
}

/// What of a scene is left out.
pub(crate) fn words(setting: Setting, of: &Scene) -> String {
    let (all, its) = (Setting::ALL.of(of), setting.of(of));
    let mut parts = Vec::new();
    let mut less = |differs: bool, text: String| parts.extend(differs.then_some(text));
    less(its.taps < all.taps, format!("{} of {} taps", its.taps, all.taps));
    less(its.images < all.images, format!("{} of {} images", its.images, all.images));
    less(its.order < all.order, format!("order {}", its.order));
    less(its.refresh > all.refresh, format!("refreshed {} times as slowly", its.refresh));
    less(its.waves != all.waves, "no waves".to_owned());
    let decodes = if its.decodes == 0 { "a table".to_owned() } else { format!("{} decodes/s", its.decodes) };
    less(its.decodes < all.decodes, decodes);
    if parts.is_empty() { "all".to_owned() } else { parts.join(", ") }
}
