//! Whole clips, rendered as the published code does.

use crate::StftGrid;
use crate::network::{CloudKind, CloudModel, CloudSizes, Listener, Masks};
use crate::number::whole;
use crate::published::clip::{ClipSource, PublishedClip};
use crate::published::conv::ConvLayers;
use crate::published::error::PublishedError;
use crate::published::frames::Frames;
use crate::published::time_filter::TimeFilter;
use pulp::Arch;
use std::ops::RangeInclusive;

/// Renders a clip of as many frames as the model was trained on, one listener for all of it.
///
/// Made by the offline player for one clip; it is not for the audio thread.
///
/// The magnitudes of the source times the mixture mask go through the time filter; convolution layers over frequency and time
/// add to the masked magnitudes of each ear, which take the source's phase. Without convolution layers the time filter's output
/// is added itself; a model without time filters is rendered as if their output were zero, in clips of a second.
pub struct ClipRenderer {
    sizes: CloudSizes,
    grid: StftGrid,
    filter: Option<TimeFilter>,
    conv: Option<ConvLayers>,
    head: PublishedClip,
    source: ClipSource,
    /// `[frame][bin]`, as the time filter's output is.
    masked: Frames,
    mix: Frames,
}

impl ClipRenderer {
    /// For clips on the grid that the model was trained on.
    ///
    /// # Errors
    /// The grid has other bins than the model has bands, is not usable, or a clip is too short to be reflected at its ends.
    pub fn new(model: &CloudModel, grid: StftGrid) -> Result<Self, PublishedError> {
        Self::with_arch(model, grid, Arch::new())
    }

    /// A renderer that computes with the given instruction set.
    ///
    /// # Errors
    /// The model has no published head, or the grid does not fit it ([`PublishedError`]).
    pub fn with_arch(model: &CloudModel, grid: StftGrid, arch: Arch) -> Result<Self, PublishedError> {
        let (sizes, bins) = (model.sizes(), grid.bins());
        if model.parts().kind == CloudKind::Taps {
            return Err(PublishedError::Streamed);
        }
        if sizes.bands != bins {
            return Err(PublishedError::Bands { bands: sizes.bands, bins });
        }
        let frames = if sizes.frames > 0 { sizes.frames } else { second(&grid) / grid.hop.max(1) + 1 };
        let head = PublishedClip::new(grid, frames, arch)?;
        Ok(Self {
            sizes,
            grid,
            filter: TimeFilter::new(model, arch),
            conv: ConvLayers::new(model, bins, arch),
            source: head.source(),
            head,
            masked: Frames::new(frames, bins),
            mix: Frames::new(frames, bins),
        })
    }

    /// Lengths of clips that have the model's number of frames, samples.
    #[must_use]
    pub fn clip_samples(&self) -> RangeInclusive<usize> {
        self.head.clip_samples()
    }

    /// Length of a rendered clip, samples: the shortest of [`ClipRenderer::clip_samples`].
    #[must_use]
    pub fn out_samples(&self) -> usize {
        self.head.out_samples()
    }

    /// Magnitudes of an ear, left 0 or right 1, of the last rendered clip, frame by frame, one value per bin.
    pub fn magnitudes(&self, ear: usize) -> impl Iterator<Item = &[f32]> {
        self.head.magnitudes(ear)
    }

    /// Renders one clip to the left and the right ear, time-aligned with the input.
    ///
    /// # Real-time
    /// Not for the audio thread: takes milliseconds. Does not allocate.
    ///
    /// # Errors
    /// The input's length is not in [`ClipRenderer::clip_samples`], an output's is not [`ClipRenderer::out_samples`], or the
    /// masks are another model's.
    pub fn render(
        &mut self,
        mono: &[f32],
        masks: &Masks,
        listener: &Listener,
        out: [&mut [f32]; 2],
    ) -> Result<(), PublishedError> {
        self.head.check_masks(&masks.mixture, &masks.difference)?;
        self.head.analyse(mono, &mut self.source)?;
        for frame in 0..self.head.frames() {
            let masked = self.masked.row_mut(frame).iter_mut().zip(self.source.frame(frame));
            masked.zip(&masks.mixture).for_each(|((s, x), m)| *s = x * m);
        }
        match &mut self.filter {
            Some(filter) => filter.apply(listener, masks, &self.masked, &mut self.mix),
            None => self.mix.clear(),
        }
        let masks = (&masks.mixture[..], &masks.difference[..]);
        self.head.render(&self.source, [&self.masked, &self.mix], masks, self.conv.as_mut(), out)
    }

    /// Renders a signal of any length as clips that overlap by a twentieth, each faded linearly into the next (Chen and
    /// Shlizerman 2024, appendix A.2). `masks_at` is given the seconds of each clip's centre; it decodes the masks and returns
    /// the listener. The outputs are as long as the input and aligned with it.
    ///
    /// # Real-time
    /// Not for the audio thread: allocates.
    ///
    /// # Errors
    /// The masks are another model's.
    pub fn render_long(
        &mut self,
        mono: &[f32],
        mut masks_at: impl FnMut(f64, &mut Masks) -> Listener,
    ) -> Result<[Vec<f32>; 2], PublishedError> {
        let samples = self.out_samples();
        let overlap = samples / 20;
        let clip_samples = second(&self.grid).clamp(*self.clip_samples().start(), *self.clip_samples().end());
        let mut masks = Masks::new(&self.sizes);
        let mut clip = vec![0.0; clip_samples];
        let mut rendered = [vec![0.0; samples], vec![0.0; samples]];
        let mut out = [vec![0.0; mono.len()], vec![0.0; mono.len()]];
        let mut start = 0;
        while start < mono.len() {
            let input = &mono[start..mono.len().min(start + clip_samples)];
            clip.fill(0.0);
            clip[..input.len()].copy_from_slice(input);
            let listener = masks_at((start as f64 + 0.5 * samples as f64) / self.grid.sample_rate_hz, &mut masks);
            let [left, right] = &mut rendered;
            self.render(&clip, &masks, &listener, [left, right])?;
            for (out, clip) in out.iter_mut().zip(&rendered) {
                for (i, (o, x)) in out[start..].iter_mut().zip(clip).enumerate() {
                    let faded_in = if start == 0 { 1.0 } else { ((i as f32 + 0.5) / overlap as f32).min(1.0) };
                    let faded_out = (((samples - i) as f32 - 0.5) / overlap as f32).min(1.0);
                    // Where the next clip fades in there is one; the last clip ends with the signal.
                    let last = start + samples >= mono.len();
                    *o += x * faded_in * if last { 1.0 } else { faded_out };
                }
            }
            if start + samples >= mono.len() {
                break;
            }
            start += samples - overlap;
        }
        Ok(out)
    }

    /// Bytes in memory.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let filter = self.filter.as_ref().map_or(0, TimeFilter::memory_bytes);
        let rows = self.masked.memory_bytes() + self.mix.memory_bytes();
        let conv = self.conv.as_ref().map_or(0, ConvLayers::memory_bytes);
        rows + filter + conv + self.source.memory_bytes() + self.head.memory_bytes()
    }
}

/// Samples of a second.
fn second(grid: &StftGrid) -> usize {
    whole(grid.sample_rate_hz.round())
}
