//! Sound rendered through a plugin, in time with its input.

use crate::Fault;
use crate::automation::Lane;
use crate::instance::Instance;

/// Sound on its way through a plugin: the transport plays from 0, the automation comes at its samples, and the latency that the
/// plugin reports at the start is taken off the output.
pub struct Bounce<'a> {
    instance: &'a mut Instance,
    lanes: &'a [Lane],
    /// Samples that went in.
    position: u64,
    latency: usize,
    /// Samples of the latency that are still to be dropped.
    late: usize,
    block: Vec<Vec<f32>>,
}

impl<'a> Bounce<'a> {
    /// Starts at the first sample, with an instance that has played nothing since it was opened or restarted.
    ///
    /// # Errors
    /// The plugin does not report its latency.
    pub fn new(instance: &'a mut Instance, lanes: &'a [Lane]) -> Result<Self, Fault> {
        let latency = instance.latency()?;
        instance.play_from(0.0);
        let block = vec![Vec::new(); instance.setup().outputs];
        Ok(Self { instance, lanes, position: 0, latency, late: latency, block })
    }

    /// The latency that is taken off, samples: so much silence must follow the input until its end has come out.
    #[must_use]
    pub fn latency(&self) -> usize {
        self.latency
    }

    /// Plays a block, and appends what comes out of it in time to each channel of the output: less than went in, until the
    /// latency is over.
    ///
    /// # Errors
    /// A block that [`Instance::process_into`] refuses.
    pub fn play(&mut self, input: &[&[f32]], output: &mut [Vec<f32>]) -> Result<(), Fault> {
        let len = input.first().map_or(0, |channel| channel.len());
        for lane in self.lanes {
            lane.events(self.position, len, |offset, value| self.instance.set_at(lane.id(), value, offset))?;
        }
        self.block.iter_mut().for_each(|channel| channel.resize(len, 0.0));
        let mut channels: Vec<&mut [f32]> = self.block.iter_mut().map(Vec::as_mut_slice).collect();
        self.instance.process_into(input, &mut channels)?;
        self.position += len as u64;
        let skip = self.late.min(len);
        self.late -= skip;
        for (all, new) in output.iter_mut().zip(&self.block) {
            all.extend_from_slice(&new[skip..]);
        }
        Ok(())
    }

    /// The latency that the plugin reports now, samples, where that is another one than at the start. What came out since then
    /// is out of time by the difference.
    ///
    /// # Errors
    /// The plugin does not report its latency.
    pub fn finish(self) -> Result<Option<usize>, Fault> {
        let now = self.instance.latency()?;
        Ok((now != self.latency).then_some(now))
    }
}

/// Renders a whole signal and so many samples after its end; the result is that much longer than the input and in time with it.
///
/// # Errors
/// A lane or a block that [`Bounce`] refuses, channels of different lengths, or other outputs than two.
pub fn bounce(instance: &mut Instance, input: &[&[f32]], lanes: &[Lane], tail: usize) -> Result<[Vec<f32>; 2], Fault> {
    let block = instance.setup().block;
    let len = input.iter().map(|channel| channel.len()).max().unwrap_or(0);
    let mut bounce = Bounce::new(instance, lanes)?;
    let whole = len + tail + bounce.latency();
    let mut output = [Vec::with_capacity(len + tail), Vec::with_capacity(len + tail)];
    let silence = vec![0.0; block];
    for start in (0..whole).step_by(block) {
        let count = block.min(whole - start);
        let part = |channel: &&[f32]| {
            let sound = &channel[start.min(channel.len())..(start + count).min(channel.len())];
            [sound, &silence[..count - sound.len()]].concat()
        };
        let track: Vec<Vec<f32>> = input.iter().map(part).collect();
        let track: Vec<&[f32]> = track.iter().map(Vec::as_slice).collect();
        bounce.play(&track, &mut output)?;
    }
    Ok(output)
}
