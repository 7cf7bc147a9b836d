//! What a scene does, measured on what the render head puts out.

pub use crate::judge::response_measures::Unmeasurable;
use crate::judge::response_measures::response_measures;
use promenade_core::{HeldOut, Pose, Renderer, ResponseMeasures, Scene, Tier};
use std::sync::Arc;

/// What the renderer makes of a unit impulse at sample `lead`, for a listener who stands still, at the scene's own rate: `len` samples
/// of both ears, with the latency taken out.
#[must_use]
pub fn render_response(scene: &Arc<Scene>, pose: Pose, lead: usize, len: usize) -> [Vec<f32>; 2] {
    let Ok(mut renderer) = Renderer::new(Arc::clone(scene), scene.grid().sample_rate_hz) else {
        return [Vec::new(), Vec::new()];
    };
    let latency = renderer.latency_samples();
    let mut input = vec![0.0; len + latency];
    if let Some(x) = input.get_mut(lead) {
        *x = 1.0;
    }
    let mut ears = [vec![0.0; input.len()], vec![0.0; input.len()]];
    let [left, right] = &mut ears;
    renderer.process(&input, [left, right], Tier::Standard, &mut |_| pose);
    ears.map(|ear| ear[latency..].to_vec())
}

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
    /// Reverberation time T20, as a share of the measured one; none where no pose has one.
    pub t20: Option<f64>,
    /// Early decay time, as a share of the measured one.
    pub edt: Option<f64>,
    /// Clarity C50, dB.
    pub c50_db: Option<f64>,
}

/// Renders every held-out pose of a scene and compares. Poses whose rendering cannot be measured are an error with their name.
///
/// # Errors
/// The name of the pose and why its rendered response has no measures.
pub fn compare_held_out(scene: &Arc<Scene>, response_s: f64) -> Result<Vec<Comparison>, (String, Unmeasurable)> {
    let rate = scene.grid().sample_rate_hz;
    let lead = scene.grid().n_fft;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "seconds in samples")]
    let len = lead + (response_s * rate) as usize;
    let one = |held: &HeldOut| {
        let [left, right] = render_response(scene, held.pose, lead, len);
        let rendered = response_measures(&left, &right, rate).map_err(|e| (held.name.clone(), e))?;
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
