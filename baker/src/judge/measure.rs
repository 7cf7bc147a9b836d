//! A scene's rendered responses against measurements that it was not baked from.

use crate::error::BakeError;
use crate::judge::response_measures::response_measures;
use crate::player::render_response;
use promenade_core::{HeldOut, ResponseMeasures, Scene};
use std::ops::RangeInclusive;
use std::sync::Arc;

/// Lengths of rendered responses, seconds.
pub const RESPONSE_S: RangeInclusive<f64> = 0.25..=60.0;

/// One pose: what was measured there and what the render head makes of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// Name of the measurement.
    pub name: String,
    /// Measures of the room.
    pub measured: ResponseMeasures,
    /// The same of the rendered response.
    pub rendered: ResponseMeasures,
}

/// Mean absolute errors over poses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeanErrors {
    /// Interaural time difference, seconds.
    pub itd_s: f64,
    /// Interaural level difference, dB.
    pub ild_db: f64,
    /// Reverberation time T20, as a share of the measured one; `None` where no pose has one.
    pub t20: Option<f64>,
    /// Early decay time, as a share of the measured one.
    pub edt: Option<f64>,
    /// Clarity C50, dB.
    pub c50_db: Option<f64>,
}

/// The length of response in which a scene's decays can be measured, seconds: one and a half times the longest reverberation time.
#[must_use]
pub fn response_s(scene: &Scene) -> f64 {
    (1.5 * f64::from(scene.tail().longest_t60_s())).clamp(*RESPONSE_S.start(), *RESPONSE_S.end())
}

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
            .map_err(|why| BakeError::unmeasurable(format!("held-out pose {}", held.name), why))?;
        Ok(Comparison { name: held.name.clone(), measured: held.measured, rendered })
    };
    scene.held_out().iter().map(one).collect()
}

impl MeanErrors {
    /// Means over comparisons; `None` if there are none.
    #[must_use]
    pub fn of(comparisons: &[Comparison]) -> Option<Self> {
        let mean = |of: fn(&Comparison) -> Option<f64>| {
            let errors: Vec<f64> = comparisons.iter().filter_map(of).map(f64::abs).collect();
            (!errors.is_empty()).then(|| errors.iter().sum::<f64>() / errors.len() as f64)
        };
        Some(Self {
            itd_s: mean(|c| Some(c.rendered.itd_s - c.measured.itd_s))?,
            ild_db: mean(|c| Some(c.rendered.ild_db - c.measured.ild_db))?,
            t20: mean(|c| Some(c.rendered.t20_s? / c.measured.t20_s? - 1.0)),
            edt: mean(|c| Some(c.rendered.edt_s? / c.measured.edt_s? - 1.0)),
            c50_db: mean(|c| Some(c.rendered.c50_db? - c.measured.c50_db?)),
        })
    }
}
