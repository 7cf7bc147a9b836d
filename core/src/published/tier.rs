//! The tier Reference: the published render head beside the streaming one.

use crate::decode::live::PublishedFrame;
use crate::grid::LONGEST_LATENCY_S;
use crate::published::converted::ConvertedStream;
use crate::published::{ConvMode, FrameMasks, PublishedStream};
use crate::render::part::{Heard, Part};
use crate::tier::TIER_FADE_STEP;
use crate::{Scene, StftGrid, Tier};
use std::ops::Range;

/// The published head at a host's rate.
enum Stream {
    /// The model's own.
    Own(Box<PublishedStream>),
    /// Any other.
    Converted(Box<ConvertedStream>),
}

/// A [`PublishedStream`] and what it takes to fade between it and the other tiers, which are delayed to match.
pub(crate) struct Reference {
    stream: Stream,
    input: Vec<f32>,
    out: [Vec<f32>; 2],
    /// The other tiers' newest samples, as many as they are early.
    early: [Vec<f32>; 2],
    at: usize,
    /// Share of the stream in what is heard.
    share: f32,
    /// It takes the place of the other tiers; others add to it.
    leads: bool,
}

impl Reference {
    /// `None` where the scene has no such tier; at rates other than the model's, where they cannot be converted within the
    /// longest latency. The convolution layers know only the grid that they were trained on. That of the first voice `leads`.
    pub(crate) fn new(scene: &Scene, grid: &StftGrid, leads: bool) -> Option<Self> {
        let cloud = scene.cloud().filter(|c| c.conv != ConvMode::Off)?;
        let stream = PublishedStream::new(&cloud.model, *scene.grid(), cloud.stream_options(scene.shape().taps)).ok()?;
        let stream = if grid == scene.grid() {
            Stream::Own(Box::new(stream))
        } else {
            Stream::Converted(Box::new(ConvertedStream::new(stream, grid)?))
        };
        let latency = stream.latency_samples();
        if latency as f64 > LONGEST_LATENCY_S * grid.sample_rate_hz {
            return None;
        }
        let early = if leads { latency.saturating_sub(grid.latency_samples()) } else { 0 };
        let pair = |len: usize| [vec![0.0; len], vec![0.0; len]];
        Some(Self { stream, input: vec![0.0; grid.hop], out: pair(grid.hop), early: pair(early), at: 0, share: 0.0, leads })
    }

    pub(crate) fn latency_samples(&self) -> usize {
        self.stream.latency_samples()
    }
}

impl Part for Reference {
    fn take(&mut self, hop: &mut [f32], _span: Range<usize>, _heard: &mut Heard<'_>) {
        self.input.copy_from_slice(hop);
    }

    /// Delays what the other tiers made of the hop, and fades to the stream or from it.
    fn finish(&mut self, tier: Tier, frame: Option<&PublishedFrame>, ready: &mut [Vec<f32>; 2]) {
        let (on, leads) = (tier == Tier::Reference, self.leads);
        let len = self.early[0].len();
        for (ready, early) in ready.iter_mut().zip(&mut self.early) {
            for (i, sample) in ready.iter_mut().enumerate().filter(|_| len > 0) {
                std::mem::swap(sample, &mut early[(self.at + i) % len]);
            }
        }
        self.at = (self.at + self.input.len()).checked_rem(len).unwrap_or(0);
        let target = if on { 1.0 } else { 0.0 };
        if let Some(frame) = frame.filter(|_| on || self.share > 0.0) {
            let before = self.share;
            self.share += (target - self.share).clamp(-TIER_FADE_STEP, TIER_FADE_STEP);
            let masks = FrameMasks { mixture: &frame.mixture, difference: &frame.difference, taps: frame.taps.as_ref() };
            let [left, right] = &mut self.out;
            self.stream.hop(&self.input, masks, [left, right]);
            let slope = (self.share - before) / self.input.len() as f32;
            for (ready, out) in ready.iter_mut().zip(&self.out) {
                for (i, (r, o)) in ready.iter_mut().zip(out).enumerate() {
                    let instead = if leads { *r } else { 0.0 };
                    *r += (before + slope * i as f32) * (o - instead);
                }
            }
            if self.share == 0.0 {
                // What it heard so far belongs to another time when it is wanted again.
                self.stream.reset();
            }
        }
    }

    fn jump(&mut self, tier: Tier) {
        self.share = if tier == Tier::Reference { 1.0 } else { 0.0 };
    }

    fn reset(&mut self) {
        self.stream.reset();
        self.early.iter_mut().for_each(|e| e.fill(0.0));
        (self.at, self.share) = (0, 0.0);
    }

    fn memory_bytes(&self) -> usize {
        self.stream.memory_bytes() + 8 * (self.early[0].len() + self.input.len())
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
