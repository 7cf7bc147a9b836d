//! Sound that is read, streamed through a scene and mixed block by block.

use super::{Mix, Source, Write};
use cpu_time::ThreadTime;
use promenade_audio::FileError;
use promenade_core::Pose;
use promenade_judge::Stream;
use std::collections::VecDeque;

/// Plays a sound from silence, and with `tail` the room that sounds on after it. The latency is rendered after the end and left
/// out at the start. What comes back are the processor seconds of it, the decoding of the first pose not counted.
pub(super) fn play(
    stream: &mut Stream,
    mut source: Source,
    tail: bool,
    mix: Mix,
    block: usize,
    pose_at: &mut dyn FnMut(f64) -> Pose,
    write: &mut Write<'_>,
) -> Result<f64, FileError> {
    let room = if tail { stream.tail_samples() } else { 0 };
    stream.restart();
    let whole = source.frames() + room + stream.renderer().latency_samples();
    let mut processor_s = 0.0;
    let mut channels = vec![Vec::new(); source.channels()];
    let mut waiting = [VecDeque::new(), VecDeque::new()];
    let mut ears = [Vec::new(), Vec::new()];
    let mut done = 0;
    while done < whole {
        // The first sample goes alone: its pose is decoded with it.
        let count = if done == 0 { 1 } else { block.min(whole - done) };
        source.fill(count, &mut channels)?;
        waiting.iter_mut().zip([channels.first(), channels.last()]).for_each(|(to, c)| to.extend(c.into_iter().flatten()));
        ears.iter_mut().for_each(|ear| ear.resize(count, 0.0));
        let [left, right] = &mut ears;
        let began = ThreadTime::now();
        let input: Vec<&[f32]> = channels.iter().map(|channel| &channel[..]).collect();
        let early = stream.advance(&input, [left, right], pose_at);
        if done > 0 {
            processor_s += began.elapsed().as_secs_f64();
        }
        mix.apply([&mut left[early..], &mut right[early..]], &mut waiting);
        write([&left[early..], &right[early..]])?;
        done += count;
    }
    Ok(processor_s)
}
