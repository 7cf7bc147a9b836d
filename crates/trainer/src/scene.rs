//! A scene of trained weights.

use crate::head::streaming::{exponentials, shaped};
use crate::settings::TrainSettings;
use crate::setup::Setup;
use crate::weights::{Arrays, DELAY};
use promenade_baker::cloud_scene::top_hz;
use promenade_core::glam::Vec3;
use promenade_core::network::{CloudKind, CloudModel, CloudParts, PoseConvention};
use promenade_core::published::{ConvMode, Projection};
use promenade_core::{Anchor, AnchorCloud, Pose, Provenance, Scene, SceneError, SceneParts};

/// Puts a scene around weights: what was trained is what is decoded live.
///
/// # Errors
/// Weights that are not finite or do not fit together.
pub(crate) fn scene(
    setup: &Setup,
    settings: &TrainSettings,
    weights: &Arrays,
    provenance: Provenance,
    poses: &[Pose],
) -> Result<Scene, SceneError> {
    let network = &settings.network;
    let emitter = shaped(setup.emitters.first().copied(), weights);
    let mut weights = weights.clone();
    weights.remove(DELAY);
    if let Some(shapes) = weights.get_mut("tap_shapes") {
        shapes.values = exponentials(&shapes.values);
    }
    let model = CloudModel::new(CloudParts {
        kind: CloudKind::Taps,
        heads: network.heads,
        max_norm: setup.cloud.max_norm,
        convention: PoseConvention::Physical,
        placement: setup.placement,
        frequencies: setup.queries.clone(),
        anchors: setup.cloud.anchors.clone(),
        features: setup.cloud.features.clone(),
        weights,
    })?;
    let positions = || poses.iter().map(|p| p.position);
    let bounds = (positions().reduce(Vec3::min).unwrap_or(Vec3::ZERO), positions().reduce(Vec3::max).unwrap_or(Vec3::ZERO));
    let start_pose = poses.first().copied();
    Scene::new(SceneParts {
        provenance,
        taps: network.taps,
        anchors: Anchor::all_of(&model),
        cloud: Some(AnchorCloud { model, conv: ConvMode::Off, projection: Projection::Diagonal, emitter }),
        top_hz: top_hz(&setup.grid),
        start_pose: start_pose.unwrap_or(Pose::IDENTITY),
        bounds,
        ..SceneParts::new(setup.grid, setup.bands.clone(), setup.tail.clone())
    })
}
