//! Ambisonics: all channels of a sound field, two at a time as a pair of ears.

use super::options::Options;
use super::setup::{Walk, player};
use crate::error::of;
use crate::{Mix, PlayerError, Source};
use promenade_audio::FileError;
use promenade_core::Scene;
use promenade_core::head::channels;
use std::panic::resume_unwind;
use std::sync::Arc;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread;

/// Blocks of a pair that wait for the others.
const WAITING: usize = 4;

/// Samples of two channels.
type Block = [Vec<f32>; 2];

impl Options {
    /// Refuses what only ears have.
    pub(super) fn check_ambix(&self) -> Result<(), PlayerError> {
        let of_ears = [
            ("--head", self.head.is_some()),
            ("--headphones", self.headphones.is_some()),
            ("--mix below 1", self.share.is_some_and(|share| share < 1.0)),
            ("--width", self.trim.width != 1.0),
        ];
        match of_ears.into_iter().find(|(_, given)| *given && self.ambix) {
            Some((option, _)) => Err(PlayerError::argument(option, "--format binaural with it", "ambix, which has no ears")),
            None => Ok(()),
        }
    }
}

/// Renders all pairs at once, each on its thread, and writes their channels block by block.
pub(super) fn play(
    scene: &Scene,
    options: &Options,
    order: u8,
    walk: &Walk,
    write: &mut impl FnMut(&[&[f32]]) -> Result<(), FileError>,
) -> Result<(), PlayerError> {
    let count = channels(order.into());
    thread::scope(|scope| {
        let pairs: Vec<_> = (0..count.div_ceil(2))
            .map(|pair| {
                let (to, from) = sync_channel(WAITING);
                (from, scope.spawn(move || one(scene, options, walk, pair, &to)))
            })
            .collect();
        // A pair that fails ends early, and all with it.
        while let Ok(blocks) = pairs.iter().map(|(from, _)| from.recv()).collect::<Result<Vec<Block>, _>>() {
            let block: Vec<&[f32]> = blocks.iter().flatten().take(count).map(Vec::as_slice).collect();
            write(&block)?;
        }
        for (from, pair) in pairs {
            drop(from);
            pair.join().unwrap_or_else(|panic| resume_unwind(panic))?;
        }
        Ok(())
    })
}

/// Renders one pair until its sound ends or nobody waits for it.
fn one(scene: &Scene, options: &Options, walk: &Walk, pair: usize, to: &SyncSender<Block>) -> Result<(), PlayerError> {
    let scene = scene.ambisonic_pair(pair).map_err(of(&options.files[0]))?;
    let source = Source::open(&options.files[1], None)?;
    let mut player = player(options, &Arc::new(scene), &source)?;
    let mut write = |ears: [&[f32]; 2]| {
        // Whoever waited has gone with an error of their own.
        let _gone = to.send(ears.map(<[f32]>::to_vec));
        Ok(())
    };
    player.play(source, Mix::new(1.0, options.gain_db), options.block(), &mut |seconds| walk.pose_at(seconds), &mut write)
}
