//! A scene of trained weights.

use crate::head::streaming::{exponentials, shaped};
use crate::settings::{HeadKind, TrainSettings};
use crate::setup::Setup;
use crate::weights::{Arrays, DELAY};
use promenade_baker::checkpoint::Imported;
use promenade_baker::cloud_scene::{CloudSceneOptions, cloud_scene, top_hz};
use promenade_core::glam::Vec3;
use promenade_core::network::{CloudKind, CloudModel, CloudParts, PoseConvention, Tensor};
use promenade_core::published::{ConvMode, Projection};
use promenade_core::{Anchor, AnchorCloud, Pose, Provenance, Scene, SceneError, SceneParts};

/// Puts a scene around weights: what was trained is what its tier High plays, or, with AV-Cloud's heads, its tier Reference as
/// far as a stream can.
///
/// # Errors
/// Weights that are not finite or do not fit together, and networks with parts left out that the engine does not have.
pub(crate) fn scene(
    setup: &Setup,
    settings: &TrainSettings,
    weights: &Arrays,
    provenance: Provenance,
    poses: &[Pose],
) -> Result<Scene, SceneError> {
    let network = &settings.network;
    let kind = match network.head {
        HeadKind::Taps => CloudKind::Taps,
        HeadKind::Sh => CloudKind::Sh,
        HeadKind::Full => CloudKind::Full,
    };
    let emitter = shaped(setup.emitters.first().copied(), weights);
    let mut weights = weights.clone();
    weights.remove(DELAY);
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
        kind,
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
    if network.head != HeadKind::Taps {
        let options = CloudSceneOptions {
            provenance,
            bounds: Some(bounds),
            start_pose,
            taps: network.taps,
            conv: ConvMode::LookAhead,
            projection: Projection::Diagonal,
            seed: settings.seed,
        };
        return cloud_scene(Imported { model, grid: setup.grid, notes: Vec::new() }, options);
    }
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
