//! What is heard before a frame is complete.

use crate::latency::Pace;
use crate::render::images::ImageRenderer;
use crate::render::lanes::EarBlocks;
use crate::render::undelayed::Undelayed;
use crate::render::waves::WaveBass;
use crate::{Pose, StftGrid, Trim};
use std::ops::Range;

/// Where a hop begins and ends: the listener's poses, and what the user changes.
#[derive(Clone, Copy)]
pub(crate) struct Hop {
    pub(crate) from: Pose,
    pub(crate) to: Pose,
    pub(crate) trim: Trim,
    pub(crate) draft: bool,
}

/// The first hops of the filters, images and the bass of waves, for one stream whose latency is shorter than a frame.
pub(crate) struct AtOnce {
    undelayed: Undelayed,
    block: usize,
    hop_len: usize,
    hop: Hop,
    /// What the ears hear of images during the running block.
    images: [Vec<f32>; 2],
    /// What comes out so many samples later, and where.
    waiting: Vec<[f32; 2]>,
    at: usize,
}

impl AtOnce {
    /// For a short pace on a host's grid.
    pub(crate) fn new(grid: &StftGrid, pace: &Pace) -> Self {
        let waits = pace.latency.stated(grid).saturating_sub(grid.lead());
        Self {
            undelayed: Undelayed::new(grid, pace),
            block: pace.block,
            hop_len: grid.hop,
            hop: Hop { from: Pose::IDENTITY, to: Pose::IDENTITY, trim: Trim::NEUTRAL, draft: false },
            images: [vec![0.0; pace.block], vec![0.0; pace.block]],
            waiting: vec![[0.0; 2]; waits],
            at: 0,
        }
    }

    /// Samples that may be taken now.
    pub(crate) fn room(&self) -> usize {
        self.undelayed.room()
    }

    /// Whether a hop has begun since it was new.
    pub(crate) fn has_begun(&self) -> bool {
        self.undelayed.is_set()
    }

    /// Begins a hop with the filter of the hops that do not wait, where it is another than before.
    pub(crate) fn begin(&mut self, hop: Hop, filter: Option<&[EarBlocks]>, waves: Option<&mut WaveBass>) {
        self.undelayed.set(filter);
        self.hop = hop;
        if let Some(waves) = waves {
            waves.begin(&hop.to, &hop.trim);
        }
    }

    /// Adds what is heard of some samples of the hop, of which waves leave the upper half.
    pub(crate) fn take(
        &mut self,
        hop: &mut [f32],
        span: Range<usize>,
        waves: Option<&mut WaveBass>,
        images: Option<&mut ImageRenderer>,
        [left, right]: [&mut [f32]; 2],
    ) {
        if let Some(waves) = waves {
            waves.take(&mut hop[span.clone()], span.start);
            waves.add_to(span.start, [&mut *left, &mut *right]);
        }
        self.undelayed.process(&hop[span.clone()], [&mut *left, &mut *right]);
        if let Some(images) = images {
            for (ear, heard) in [&mut *left, &mut *right].into_iter().zip(&self.images) {
                ear.iter_mut().zip(&heard[span.start % self.block..]).for_each(|(ear, x)| *ear += x);
            }
            if span.end.is_multiple_of(self.block) {
                let Hop { from, to, trim, draft } = self.hop;
                let pose = if from == to { to } else { from.toward(&to, span.end as f32 / self.hop_len as f32) };
                images.take(&hop[span.end - self.block..span.end], &pose, draft, &trim);
                self.images.iter_mut().for_each(|ear| ear.fill(0.0));
                images.add_to(&mut self.images);
            }
        }
        if self.waiting.is_empty() {
            return;
        }
        for (left, right) in left.iter_mut().zip(right) {
            let waited = std::mem::replace(&mut self.waiting[self.at], [*left, *right]);
            [*left, *right] = waited;
            self.at = if self.at + 1 == self.waiting.len() { 0 } else { self.at + 1 };
        }
    }

    /// Is as new again.
    pub(crate) fn reset(&mut self) {
        self.undelayed.reset();
        self.images.iter_mut().for_each(|ear| ear.fill(0.0));
        self.waiting.fill([0.0; 2]);
        self.at = 0;
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        self.undelayed.memory_bytes() + 2 * size_of_val(&*self.images[0]) + size_of_val(&*self.waiting)
    }
}
