//! A scene's rendered responses against measurements that it was not baked from.

use crate::error::BakeError;
use promenade_core::{HeldOut, Scene};
use promenade_judge::{response_levels_db, response_measures};
use promenade_player::render_response;
use std::sync::Arc;

pub use promenade_judge::{Comparison, MeanErrors, RESPONSE_S, mean_level_errors_db, response_s};

/// Renders responses of some seconds at all held-out poses of a scene and compares them with the measurements.
///
/// # Errors
/// A rendered response that has no measures, by the name of its pose, or a scene that cannot be rendered.
pub fn compare_held_out(scene: &Arc<Scene>, response_s: f64) -> Result<Vec<Comparison>, BakeError> {
    let rate = scene.grid().sample_rate_hz;
    let lead = scene.grid().n_fft;
    let len = lead + (response_s * rate) as usize;
    let one = |held: &HeldOut| {
        let [left, right] = render_response(scene, held.pose, lead, len)?;
        let rendered = response_measures(&left, &right, rate)
            .map_err(|why| crate::error::unmeasurable(&format!("held-out pose {}", held.name), why))?;
        let levels_db = (!held.levels_db.is_empty()).then(|| response_levels_db(&left, &right, rate));
        let levels_db = [held.levels_db.clone(), levels_db.unwrap_or_default()];
        Ok(Comparison { name: held.name.clone(), measured: held.measured, rendered, levels_db })
    };
    scene.held_out().iter().map(one).collect()
}
