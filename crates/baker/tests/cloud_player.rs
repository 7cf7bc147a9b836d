//! A player of an anchor cloud.

use promenade_baker::checkpoint::Imported;
use promenade_baker::cloud_scene::{CloudSceneOptions, cloud_scene};
use promenade_core::network::{CloudKind, CloudModel};
use promenade_core::published::{ConvMode, Projection};
use promenade_core::{Latency, Provenance, StftGrid};
use promenade_player::{Player, Playing};
use promenade_testing::clouds::{self, Sizes};
use std::sync::Arc;

#[test]
fn what_is_played_in_frames_alone_is_said() {
    // Four hops, which can be told apart.
    let grid = StftGrid { sample_rate_hz: 8000.0, n_fft: 64, hop: 16 };
    let sizes = Sizes { anchors: 4, bands: 33, frames: 60, width: 32, hyper: 0 };
    let model = CloudModel::new(clouds::parts(CloudKind::SimpleSh, sizes)).unwrap();
    let sooner = |conv| {
        let options = CloudSceneOptions {
            provenance: Provenance::default(),
            bounds: None,
            start_pose: None,
            taps: 16,
            conv,
            projection: Projection::Diagonal,
            seed: 1,
        };
        let imported = Imported { model: model.clone(), grid, notes: Vec::new() };
        let scene = Arc::new(cloud_scene(imported, options).unwrap());
        let player = Player::at_latency(&scene, grid.sample_rate_hz, Playing::Stream, Latency::None);
        player.map(|player| player.playing()).map_err(|error| error.to_string())
    };
    assert_eq!(sooner(ConvMode::Off), Ok(Playing::Stream));
    let error = sooner(ConvMode::LookAhead).unwrap_err();
    assert!(error.contains("expected frame") && error.contains("found none"), "{error}");
}
