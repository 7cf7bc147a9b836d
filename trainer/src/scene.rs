//! A scene of trained weights.

use crate::settings::TrainSettings;
use crate::streaming::exponentials;
use crate::training::Stage;
use crate::weights::Arrays;
use promenade_baker::anchors::HARMONIC;
use promenade_core::cloud::{CloudKind, CloudModel, CloudParts, ConvMode, PoseConvention, Projection, Tensor};
use promenade_core::glam::Vec3;
use promenade_core::{Anchor, AnchorCloud, Pose, Provenance, Scene, SceneError, SceneParts};

/// Share of the Nyquist frequency up to which masks are used at faster host rates.
const TRUSTED_SHARE: f64 = 0.95;

/// Puts a scene around weights: what was trained is what its tier High plays.
///
/// # Errors
/// Weights that are not finite or do not fit together, and networks with parts left out that the engine does not know.
pub fn scene(
    stage: &Stage,
    settings: &TrainSettings,
    weights: &Arrays,
    provenance: Provenance,
    poses: &[Pose],
) -> Result<Scene, SceneError> {
    let network = &settings.network;
    let mut weights = weights.clone();
    if let Some(shapes) = weights.get_mut("tap_shapes") {
        shapes.values = exponentials(&shapes.values);
    }
    if !network.two_masks {
        // Two ears with one mask: the difference is 0 whatever the embedding.
        for name in ["diff_prj.weight", "diff_prj.bias"] {
            weights.entry(name.to_owned()).and_modify(|t: &mut Tensor| t.values.fill(0.0));
        }
    }
    let model = CloudModel::new(CloudParts {
        kind: CloudKind::Taps,
        heads: network.heads,
        max_norm: stage.place.max_norm,
        convention: PoseConvention::Physical,
        alignment: stage.alignment,
        frequencies: stage.queries.clone(),
        anchors: stage.place.anchors.clone(),
        features: stage.place.features.clone(),
        weights,
    })?;
    let features = model.sizes().features.max(1);
    let colour = |features: &[f32]| match features {
        [r, g, b, ..] => (Vec3::new(*r, *g, *b) * HARMONIC + 0.5).clamp(Vec3::ZERO, Vec3::ONE),
        _ => Vec3::splat(0.5),
    };
    let anchors = stage.place.anchors.iter().zip(stage.place.features.chunks(features));
    let anchors = anchors.map(|(p, f)| Anchor { position: stage.alignment.to_world(*p), colour: colour(f) }).collect();
    let positions = || poses.iter().map(|p| p.position);
    let bounds = (positions().reduce(Vec3::min).unwrap_or(Vec3::ZERO), positions().reduce(Vec3::max).unwrap_or(Vec3::ZERO));
    #[expect(clippy::cast_possible_truncation, reason = "a frequency in Hz")]
    let top_hz = (0.5 * TRUSTED_SHARE * stage.grid.sample_rate_hz) as f32;
    Scene::new(SceneParts {
        provenance,
        grid: stage.grid,
        bands: stage.bands.clone(),
        tail: stage.tail.clone(),
        taps: network.taps,
        field: None,
        cloud: Some(AnchorCloud { model, conv: ConvMode::Off, projection: Projection::Diagonal, emitter: stage.emitter }),
        top_hz,
        start_pose: poses.first().copied().unwrap_or(Pose::IDENTITY),
        bounds,
        anchors,
        held_out: Vec::new(),
    })
}
