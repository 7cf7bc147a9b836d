//! A scene around an imported anchor cloud.

use crate::sources::checkpoint::Imported;
use crate::sources::reconstruction::HARMONIC;
use promenade_core::glam::Vec3;
use promenade_core::network::{CloudEmitter, CloudModel};
use promenade_core::published::{ConvMode, Projection};
use promenade_core::{Anchor, AnchorCloud, Bands, Pose, Provenance, Scene, SceneError, SceneParts, StftGrid, TailModel};

/// Share of the Nyquist frequency up to which masks are used at faster host rates.
const TRUSTED_SHARE: f64 = 0.95;

/// What a checkpoint does not say about its scene.
#[derive(Clone, Debug, PartialEq)]
pub struct CloudSceneOptions {
    /// Title, credit, licence and recipe.
    pub provenance: Provenance,
    /// Corners of the box of listener positions, metres; otherwise the anchors' own.
    pub bounds: Option<(Vec3, Vec3)>,
    /// Pose to start at; otherwise the middle of the bounds.
    pub start_pose: Option<Pose>,
    /// Taps that the time filter becomes; fewer where its clips are shorter.
    pub taps: usize,
    /// Use of the convolution layers; off where there are none.
    pub conv: ConvMode,
    /// How the time filter becomes taps.
    pub projection: Projection,
    /// Seed of the taps' carriers.
    pub seed: u64,
}

/// Puts a scene around a cloud: taps on bands as for measured rooms, anchors in metres with the colour of their nearest point.
///
/// # Errors
/// What of it does not fit together.
pub fn cloud_scene(imported: Imported, options: CloudSceneOptions) -> Result<Scene, SceneError> {
    let Imported { model, grid, notes } = imported;
    let sizes = model.sizes();
    let anchors = display_anchors(&model);
    let corner = |pick: fn(Vec3, Vec3) -> Vec3| anchors.iter().map(|a| a.position).reduce(pick).unwrap_or(Vec3::ZERO);
    let bounds = options.bounds.unwrap_or_else(|| (corner(Vec3::min), corner(Vec3::max)));
    let middle = Pose { position: 0.5 * (bounds.0 + bounds.1), ..Pose::IDENTITY };
    let bands = Bands::for_rate(grid.sample_rate_hz);
    let taps = options.taps.min(sizes.frames.saturating_sub(1));
    // The late part of a cloud's time filter is silent: its taps are all that is known.
    let tail = TailModel { seed: options.seed, t60_s: vec![0.1; bands.count()], coherence: vec![0.0; bands.count()] };
    let mut provenance = options.provenance;
    provenance.notes.extend(notes);
    let top_hz = top_hz(&grid);
    Scene::new(SceneParts {
        provenance,
        taps,
        cloud: Some(AnchorCloud {
            conv: if sizes.conv { options.conv } else { ConvMode::Off },
            projection: options.projection,
            emitter: None,
            model,
        }),
        top_hz,
        start_pose: options.start_pose.unwrap_or(middle),
        bounds,
        anchors,
        ..SceneParts::new(grid, bands, tail)
    })
}

/// Two places in the scene closer than this are one, metres.
const SAME_PLACE_M: f32 = 1e-3;

/// A scene whose network knows its emitter as one of its anchors, the last, with the emitter in another place, world metres;
/// `None` of a scene that holds for one emitter only.
///
/// # Errors
/// A place that is not finite.
pub fn with_emitter(scene: &Scene, position: Vec3) -> Result<Option<Scene>, SceneError> {
    let Some(cloud) = scene.cloud() else { return Ok(None) };
    let parts = cloud.model.parts();
    let (Some(emitter), Some(last)) = (cloud.emitter, parts.anchors.last()) else { return Ok(None) };
    if parts.placement.to_scene(*last).distance(emitter.position) > SAME_PLACE_M {
        return Ok(None);
    }
    let mut parts = parts.clone();
    let moved = parts.placement.listener(&Pose { position, ..Pose::IDENTITY }).centre;
    parts.anchors.pop();
    parts.anchors.push(moved);
    let model = CloudModel::new(parts)?;
    let emitter = Some(CloudEmitter { position, ..emitter });
    let anchors = display_anchors(&model);
    Scene::new(SceneParts { anchors, cloud: Some(AnchorCloud { model, emitter, ..cloud.clone() }), ..scene.parts().clone() })
        .map(Some)
}

/// A model's anchors in metres, each with the colour of its nearest point.
#[must_use]
pub fn display_anchors(model: &CloudModel) -> Vec<Anchor> {
    let parts = model.parts();
    let colour = |features: &[f32]| match features {
        [r, g, b, ..] => (Vec3::new(*r, *g, *b) * HARMONIC + 0.5).clamp(Vec3::ZERO, Vec3::ONE),
        _ => Vec3::splat(0.5),
    };
    (parts.anchors.iter().zip(parts.features.chunks(model.sizes().features.max(1))))
        .map(|(p, f)| Anchor { position: parts.placement.to_scene(*p), colour: colour(f) })
        .collect()
}

/// Frequency up to which a learnt scene's masks are used at faster host rates, Hz.
#[must_use]
pub fn top_hz(grid: &StftGrid) -> f32 {
    (0.5 * TRUSTED_SHARE * grid.sample_rate_hz) as f32
}
