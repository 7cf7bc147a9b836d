//! `promenade render --tier clip`: the published model clip by clip.

use crate::render::two_ears;
use anyhow::{Result, bail};
use promenade_baker::resample;
use promenade_core::network::{Masks, Network};
use promenade_core::published::ClipRenderer;
use promenade_core::{Pose, Scene};

/// Both ears at the input's rate, as long as the input. The model runs at its own rate; the sound is converted there and back.
pub(crate) fn render(scene: &Scene, mono: &[f32], rate_hz: u32, pose_at: impl Fn(f64) -> Pose) -> Result<[Vec<f32>; 2]> {
    let Some(cloud) = scene.cloud() else { bail!("expected a scene with an anchor cloud, found a field only") };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked when the scene was read")]
    let model_hz = scene.grid().sample_rate_hz.round() as u32;
    let source = resample::signal(&[mono.to_vec()], rate_hz, model_hz)?;
    let mut renderer = ClipRenderer::new(&cloud.model, *scene.grid())?;
    let mut decoder = Network::new(&cloud.model);
    let sizes = cloud.model.sizes();
    let ears = renderer.render_long(&source[0], |seconds, masks| {
        if masks.mixture.is_empty() {
            *masks = Masks::new(&sizes);
        }
        let listener = cloud.model.listener(&pose_at(seconds));
        decoder.decode(&listener, masks);
        listener
    })?;
    let mut ears = two_ears(resample::signal(&ears, model_hz, rate_hz)?)?;
    ears.iter_mut().for_each(|ear| ear.resize(mono.len(), 0.0));
    Ok(ears)
}
