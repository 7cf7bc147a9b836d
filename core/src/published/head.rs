//! The published render head in the place of the streaming one.

use crate::decode::live::PublishedFrame;
use crate::grid::LONGEST_LATENCY_S;
use crate::published::converted::ConvertedStream;
use crate::published::{ConvMode, FrameMasks, PublishedStream};
use crate::render::part::{Heard, Part};
use crate::{Scene, StftGrid};
use std::ops::Range;

/// The published head at a host's rate.
enum Stream {
    /// The model's own.
    Own(Box<PublishedStream>),
    /// Any other.
    Converted(Box<ConvertedStream>),
}

/// A [`PublishedStream`] of one voice.
pub(crate) struct PublishedHead {
    stream: Stream,
    input: Vec<f32>,
    out: [Vec<f32>; 2],
    /// It takes the place of what all voices made; others add to it.
    leads: bool,
}

impl PublishedHead {
    /// `None` where the scene has no convolution layers; at rates other than the model's, where they cannot be converted within
    /// the longest latency. The layers know only the grid that they were trained on. That of the first voice `leads`.
    pub(crate) fn new(scene: &Scene, grid: &StftGrid, leads: bool) -> Option<Self> {
        let cloud = scene.cloud().filter(|c| c.conv != ConvMode::Off)?;
        let stream = PublishedStream::new(&cloud.model, *scene.grid(), cloud.stream_options(scene.shape().taps)).ok()?;
        let stream = if grid == scene.grid() {
            Stream::Own(Box::new(stream))
        } else {
            Stream::Converted(Box::new(ConvertedStream::new(stream, grid)?))
        };
        if stream.latency_samples() as f64 > LONGEST_LATENCY_S * grid.sample_rate_hz {
            return None;
        }
        let hop = || vec![0.0; grid.hop];
        Some(Self { stream, input: hop(), out: [hop(), hop()], leads })
    }

    pub(crate) fn latency_samples(&self) -> usize {
        self.stream.latency_samples()
    }
}

impl Part for PublishedHead {
    fn take(&mut self, hop: &mut [f32], _span: Range<usize>, _heard: &mut Heard<'_>) {
        self.input.copy_from_slice(hop);
    }

    fn finish(&mut self, frame: Option<&PublishedFrame>, ready: &mut [Vec<f32>; 2]) {
        let Some(frame) = frame else { return };
        let masks = FrameMasks { mixture: &frame.mixture, difference: &frame.difference, taps: frame.taps.as_ref() };
        let [left, right] = &mut self.out;
        self.stream.hop(&self.input, masks, [left, right]);
        for (ready, out) in ready.iter_mut().zip(&self.out) {
            let others = if self.leads { 0.0 } else { 1.0 };
            ready.iter_mut().zip(out).for_each(|(ready, out)| *ready = others * *ready + out);
        }
    }

    fn reset(&mut self) {
        self.stream.reset();
    }

    fn memory_bytes(&self) -> usize {
        self.stream.memory_bytes() + 4 * self.input.len()
    }
}

impl Stream {
    fn latency_samples(&self) -> usize {
        match self {
            Self::Own(stream) => stream.latency_samples(),
            Self::Converted(stream) => stream.latency_samples(),
        }
    }

    fn hop(&mut self, input: &[f32], frame: FrameMasks<'_>, out: [&mut [f32]; 2]) {
        match self {
            Self::Own(stream) => stream.hop(input, frame, out),
            Self::Converted(stream) => stream.hop(input, frame, out),
        }
    }

    fn reset(&mut self) {
        match self {
            Self::Own(stream) => stream.reset(),
            Self::Converted(stream) => stream.reset(),
        }
    }

    fn memory_bytes(&self) -> usize {
        match self {
            Self::Own(stream) => stream.memory_bytes(),
            Self::Converted(stream) => stream.memory_bytes(),
        }
    }
}
