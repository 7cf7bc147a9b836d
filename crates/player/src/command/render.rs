//! A file through a scene, aligned in time with its input.

use super::ambix;
use super::options::Options;
use super::setup::{Walk, player, scene, walk};
use super::terminal::{self, Bar};
use crate::{PlayerError, Source};
use promenade_audio::FileError;
use promenade_audio::wav::{Format, WavWriter};
use promenade_core::Scene;
use promenade_core::head::channels;
use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// Plays what the options say.
pub(super) fn run(options: &Options) -> Result<(), PlayerError> {
    options.check_ambix()?;
    let scene = scene(options)?;
    let walk = walk(options, &scene)?;
    match options.files.get(2) {
        Some(output) => into_file(options, &scene, &walk, output),
        #[cfg(feature = "play")]
        None => super::card::play(options, &scene, &walk),
        #[cfg(not(feature = "play"))]
        None => Err(PlayerError::argument(
            "--play",
            "a build that plays (cargo run --release -p promenade-player --features play)",
            "one that does not",
        )),
    }
}

fn into_file(options: &Options, scene: &Arc<Scene>, walk: &Walk, output: &Path) -> Result<(), PlayerError> {
    let began = Instant::now();
    let source = Source::open(&options.files[1], None)?;
    let (rate_hz, frames) = (source.sample_rate_hz(), source.frames());
    let rate = f64::from(rate_hz);
    let mut player = player(options, scene, &source)?;
    // Opened first: an output that cannot be written is known at once.
    if let Some(folder) = output.parent() {
        fs::create_dir_all(folder).map_err(FileError::write(output))?;
    }
    let order = options.ambix.then(|| options.order.unwrap_or(3));
    let outputs = order.map_or(2, |order| channels(order.into()) as u16);
    let mut writer = WavWriter::create(output, rate_hz, outputs, options.bits.unwrap_or(Format::Int24))?;
    let bar = Bar::new("rendering", frames as f64 / rate + player.tail_s());
    let mut played = 0;
    let mut write = |channels: &[&[f32]]| {
        played += channels[0].len();
        bar.at(played as f64 / rate);
        writer.write(channels)
    };
    match order {
        Some(order) => ambix::play(scene, options, order, walk, &mut write)?,
        None => player.play(source, options.mix(), options.block(), &mut |s| walk.pose_at(s), &mut |ears| write(&ears))?,
    }
    drop(bar);
    let written = writer.finish()?;
    terminal::done(output, written.frames, rate, began);
    if written.clipped > 0 {
        terminal::note(format_args!(
            "{} samples were above full scale and were limited; lower --gain or write --bits 32f",
            written.clipped
        ));
    }
    Ok(())
}
