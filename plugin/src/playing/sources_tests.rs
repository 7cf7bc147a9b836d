//! Further sources as they are prepared, and what is said where they cannot be heard.

use crate::library::cache;
use crate::parameter::Parameter;
use crate::playing::loader::{Loader, Prepared};
use crate::playing::output::Output;
use crate::project::params::PromenadeParams;
use promenade_core::{BlockParams, Pose};
use std::sync::Arc;

/// How many further sources are played next.
fn further(loader: &Loader) -> usize {
    let Some(Prepared::Scene(pairs)) = loader.scenes.pop() else { panic!("nothing is prepared") };
    pairs.first().unwrap().renderer().voices() - 1
}

#[test]
fn every_latency_has_all_sources() {
    let _alone = cache::alone();
    let params = Arc::new(PromenadeParams::default().with_further(3));
    let loader = Loader::new(Arc::clone(&params));
    loader.activate(48_000.0, Output::Binaural);
    assert_eq!((further(&loader), loader.exchange.sources_report.text()), (3, String::new()));
    let choose = |latency| {
        params.remote.set(Parameter::Latency, latency, params.hosted(Parameter::Latency));
        loader.refresh();
        (further(&loader), loader.exchange.sources_report.text())
    };
    for latency in [2.0, 1.0, 0.0] {
        assert_eq!(choose(latency), (3, String::new()));
    }
}

/// In blocks shorter than a hop no two instances render a frame in the same one, for as many as there are; in a bounce, and in
/// long blocks, all begin with their input.
#[test]
fn instances_that_play_live_render_their_frames_apart() {
    const COUNT: usize = 8;
    let _alone = cache::alone();
    let poses = |block: u32| {
        let pose_of = |_| {
            let loader = Loader::new(Arc::new(PromenadeParams::default()));
            loader.play_live(block);
            loader.activate(48_000.0, Output::Binaural);
            let Some(Prepared::Scene(pairs)) = loader.scenes.pop() else { panic!("nothing is prepared") };
            let mut played = Output::Binaural.spatializers(48_000.0);
            pairs.install(&mut played);
            let [left, right] = [&mut [0.0][..], &mut [0.0]];
            played[0].process(&[&[0.0]], &[], [left, right], &BlockParams::default(), |_| Pose::IDENTITY);
            played[0].samples_to_pose()
        };
        let mut all: Vec<usize> = (0..COUNT).map(pose_of).collect();
        all.sort_unstable();
        all
    };
    for block in [0, 512] {
        assert!(poses(block).windows(2).all(|two| two[0] == two[1]), "blocks of {block}");
    }
    let mut live = poses(64);
    live.dedup();
    assert!(live.len() >= COUNT - 1, "{live:?}");
}
