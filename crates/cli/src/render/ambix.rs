//! Ambisonics: all channels of a sound field, two at a time as a pair of ears.

use super::{Walk, voices};
use crate::args::RenderArgs;
use anyhow::{Context, Result, bail};
use promenade_baker::player::{Mix, Player, Source};
use promenade_baker::wav::WavWriter;
use promenade_core::Scene;
use promenade_core::head::channels;
use std::sync::Arc;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread;

/// Blocks of a pair that wait for the others.
const WAITING: usize = 4;

/// Samples of two channels.
type Block = [Vec<f32>; 2];

/// Refuses what only ears have.
pub(super) fn check(args: &RenderArgs) -> Result<()> {
    let trim = args.sound.trim();
    let wrong = [("--head", args.head.is_some()), ("--mix below 1", args.mix < 1.0), ("--width", trim.width != 1.0)];
    if let Some((option, _)) = wrong.iter().find(|(_, given)| *given) {
        bail!("{option}: expected --format binaural with it, found ambix, which has no ears");
    }
    Ok(())
}

/// Renders all pairs at once, each on its thread, and writes their channels block by block. `at` is told samples that are done.
pub(super) fn play(scene: &Scene, args: &RenderArgs, walk: &Walk, writer: &mut WavWriter, at: impl Fn(usize)) -> Result<()> {
    let count = channels(args.order.into());
    thread::scope(|scope| {
        let pairs: Vec<_> = (0..count.div_ceil(2))
            .map(|pair| {
                let (to, from) = sync_channel(WAITING);
                (from, scope.spawn(move || one(scene, args, walk, pair, &to)))
            })
            .collect();
        let mut played = 0;
        // A pair that fails ends early, and all with it.
        while let Ok(blocks) = pairs.iter().map(|(from, _)| from.recv()).collect::<Result<Vec<Block>, _>>() {
            let block: Vec<&[f32]> = blocks.iter().flatten().take(count).map(Vec::as_slice).collect();
            played += block[0].len();
            at(played);
            writer.write(&block)?;
        }
        for (from, pair) in pairs {
            drop(from);
            pair.join().map_err(|_| anyhow::anyhow!("a thread that renders two channels has ended before its time"))??;
        }
        Ok(())
    })
}

/// Renders one pair until its sound ends or nobody waits for it.
fn one(scene: &Scene, args: &RenderArgs, walk: &Walk, pair: usize, to: &SyncSender<Block>) -> Result<()> {
    let named = || args.scene.display().to_string();
    let scene = Arc::new(scene.ambisonic_pair(pair).with_context(named)?);
    let source = Source::open(&args.input, None)?;
    let rate = source.sample_rate_hz();
    let player = Player::at_latency(&scene, f64::from(rate), args.tier, args.latency).with_context(named)?;
    let player = player.with_voices(voices::open(args, &scene, rate)?)?;
    let mut write = |ears: [&[f32]; 2]| {
        // Whoever waited has gone with an error of their own.
        let _gone = to.send(ears.map(<[f32]>::to_vec));
        Ok(())
    };
    let mut player = player.with_trim(args.sound.trim())?;
    Ok(player.play(source, Mix::new(1.0, args.gain), args.block as usize, &mut |seconds| walk.pose_at(seconds), &mut write)?)
}
