//! A scene around an imported anchor cloud.

use crate::sources::checkpoint::Imported;
use promenade_core::glam::Vec3;
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
    let anchors = Anchor::all_of(&model);
    let corner = |pick: fn(Vec3, Vec3) -> Vec3| anchors.iter().map(|a| a.position).reduce(pick).unwrap_or(Vec3::ZERO);
    let bounds = options.bounds.unwrap_or_else(|| (corner(Vec3::min), corner(Vec3::max)));
    let middle = Pose { position: 0.5 * (bounds.0 + bounds.1), ..Pose::IDENTITY };
    let bands = Bands::for_rate(grid.sample_rate_hz);
    let taps = options.taps.min(sizes.frames.saturating_sub(1));
    // The late part of a cloud's time filter is silent: its taps are all that is known.
    let tail =
        TailModel { seed: options.seed, t60_s: vec![0.1; bands.count()], coherence: vec![0.0; bands.count()], by_phase: false };
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

/// Frequency up to which a learnt scene's masks are used at faster host rates, Hz.
#[must_use]
pub fn top_hz(grid: &StftGrid) -> f32 {
    (0.5 * TRUSTED_SHARE * grid.sample_rate_hz) as f32
}
