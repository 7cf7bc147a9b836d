//! The published head at a host's rate that is not the model's.

use crate::StftGrid;
use crate::number::whole;
use crate::published::{FrameMasks, PublishedStream};
use promenade_fourier::RateConverter;
use std::collections::VecDeque;

/// A [`PublishedStream`] at its model's rate between two conversions, to that rate and back.
///
/// The model's hops are no whole number of a host's samples, so what passes between the conversions and the stream waits in
/// queues, with silence before it that is long enough for none to run empty. That silence is chosen so that all of it together
/// is late by a whole number of the host's samples.
///
/// # Real-time
/// The audio thread owns it; no method but `new` allocates, locks or waits.
pub(crate) struct ConvertedStream {
    stream: PublishedStream,
    to_model: RateConverter,
    from_model: RateConverter,
    /// Samples of the block for the model that have come in.
    filled: usize,
    /// What the model has still to hear.
    dry: VecDeque<f32>,
    /// What it has made, at its own rate.
    made: [VecDeque<f32>; 2],
    /// Rendered samples at the host's rate, left and right.
    ready: [VecDeque<f32>; 2],
    hop: Vec<f32>,
    ears: [Vec<f32>; 2],
    /// Samples of what comes from the first conversion that are still left out: so many as it is late, so that the model's
    /// first frame begins with the sound, as a clip's does.
    skipped: usize,
    /// Silence before what the model makes, samples of its rate.
    silence: usize,
    latency_samples: usize,
}

impl ConvertedStream {
    /// For a host's grid; `None` for rates that [`RateConverter`] does not convert.
    pub(crate) fn new(stream: PublishedStream, grid: &StftGrid) -> Option<Self> {
        let (model, host_hz) = (*stream.grid(), grid.sample_rate_hz);
        let to_model = RateConverter::new(host_hz, model.sample_rate_hz, 1)?;
        let from_model = RateConverter::new(model.sample_rate_hz, host_hz, 2)?;
        let [host_block, model_block] = to_model.block();
        // What one call of the stream gives out lags a hop less than the stream.
        let lag = stream.latency_samples() - model.hop;
        let late = (lag + model.hop - 1).next_multiple_of(to_model.shortest());
        let converted = whole(late as f64 * host_hz / model.sample_rate_hz);
        let queue = |len: usize| VecDeque::with_capacity(len);
        // What is left out before the model is made up for after it.
        let silence = late - lag + model_block / 2;
        let made = silence + model_block + 2 * model.hop;
        let ready = 2 * host_block + 2 * grid.hop;
        let mut converted = Self {
            // Blocks wait to be whole on the way in and on the way out, and each conversion is late by half a block.
            latency_samples: grid.hop + 2 * host_block + converted,
            silence,
            skipped: 0,
            filled: 0,
            dry: queue(model_block + 2 * model.hop),
            made: [queue(made), queue(made)],
            ready: [queue(ready), queue(ready)],
            hop: vec![0.0; model.hop],
            ears: [vec![0.0; model.hop], vec![0.0; model.hop]],
            stream,
            to_model,
            from_model,
        };
        converted.reset();
        Some(converted)
    }

    /// Samples by which it lags behind, where a hop of input is collected before its output sounds.
    pub(crate) fn latency_samples(&self) -> usize {
        self.latency_samples
    }

    /// Takes a hop of the host and gives out a hop of each ear, with the masks of the newest pose.
    pub(crate) fn hop(&mut self, input: &[f32], frame: FrameMasks<'_>, out: [&mut [f32]; 2]) {
        for x in input {
            let block = self.to_model.input(0);
            block[self.filled] = *x;
            self.filled += 1;
            if self.filled == block.len() {
                self.filled = 0;
                self.block(frame);
            }
        }
        for (out, ready) in out.into_iter().zip(&mut self.ready) {
            out.iter_mut().for_each(|o| *o = ready.pop_front().unwrap_or(0.0));
        }
    }

    /// Plays a block to the model and converts what it has made.
    fn block(&mut self, frame: FrameMasks<'_>) {
        self.to_model.convert();
        let heard = self.to_model.output(0);
        let skipped = self.skipped.min(heard.len());
        self.skipped -= skipped;
        self.dry.extend(&heard[skipped..]);
        while self.dry.len() >= self.hop.len() {
            self.hop.iter_mut().for_each(|x| *x = self.dry.pop_front().unwrap_or(0.0));
            let [left, right] = &mut self.ears;
            self.stream.hop(&self.hop, frame, [left, right]);
            for (made, ear) in self.made.iter_mut().zip(&self.ears) {
                made.extend(ear);
            }
        }
        for (ear, made) in self.made.iter_mut().enumerate() {
            self.from_model.input(ear).iter_mut().for_each(|x| *x = made.pop_front().unwrap_or(0.0));
        }
        self.from_model.convert();
        for (ear, ready) in self.ready.iter_mut().enumerate() {
            ready.extend(self.from_model.output(ear));
        }
    }

    /// Forgets the stream so far.
    pub(crate) fn reset(&mut self) {
        self.stream.reset();
        self.to_model.reset();
        self.from_model.reset();
        self.filled = 0;
        self.dry.clear();
        let [host_block, model_block] = self.to_model.block();
        self.skipped = model_block / 2;
        for (queues, silence) in [(&mut self.made, self.silence), (&mut self.ready, host_block)] {
            for queue in queues {
                queue.clear();
                queue.extend(std::iter::repeat_n(0.0, silence));
            }
        }
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        let queues = self.made.iter().chain(&self.ready).chain([&self.dry]).map(VecDeque::capacity).sum::<usize>();
        let converters = self.to_model.memory_bytes() + self.from_model.memory_bytes();
        self.stream.memory_bytes() + converters + size_of::<f32>() * (queues + 3 * self.hop.len())
    }
}
