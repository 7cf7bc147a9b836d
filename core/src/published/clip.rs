//! The published head over a clip.

use crate::StftGrid;
use crate::published::conv::{CONV_DELAY, ConvLayers, Planes};
use crate::published::error::PublishedError;
use crate::published::frames::Frames;
use crate::published::hann::HannFrames;
use crate::published::stream::magnitudes_of_ear;
use promenade_fourier::num_complex::Complex32;
use pulp::Arch;
use std::ops::RangeInclusive;

/// Spectra of a clip's dry sound.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ClipSource {
    bins: usize,
    spectra: Vec<Complex32>,
    magnitudes: Vec<f32>,
}

impl ClipSource {
    /// Magnitudes of one frame.
    pub(crate) fn frame(&self, frame: usize) -> &[f32] {
        &self.magnitudes[frame * self.bins..][..self.bins]
    }

    pub(crate) fn spectrum(&self, frame: usize) -> &[Complex32] {
        &self.spectra[frame * self.bins..][..self.bins]
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        8 * self.spectra.len() + 4 * self.magnitudes.len()
    }
}

/// Renders clips from masks and the time filter's output, as the published code does.
///
/// The magnitudes of each ear are `ReLU(added + (1 + sign difference) mixture |X|)`, sign -1 left and 1 right, where `added` is
/// the time filter's output or what the convolution layers make of it; they take the source's phase. One serves any number of
/// clips, one at a time: a thread has its own.
pub(crate) struct PublishedClip {
    grid: StftGrid,
    frames: usize,
    transform: HannFrames,
    /// A clip's samples with half a frame before and after.
    padded: Vec<f32>,
    /// Magnitudes.
    ears: [Frames; 2],
    spectrum: Vec<Complex32>,
    /// One over the sum of squared windows at each sample of the output.
    scale: Vec<f32>,
}

impl PublishedClip {
    /// For clips of so many frames on this grid, computed with the given instruction set.
    ///
    /// # Errors
    /// The grid is not usable, or a clip is too short to be reflected at its ends.
    pub(crate) fn new(grid: StftGrid, frames: usize, arch: Arch) -> Result<Self, PublishedError> {
        let transform = HannFrames::new(&grid, arch)?;
        let bins = grid.bins();
        let samples = frames.saturating_sub(1) * grid.hop;
        if samples <= grid.n_fft / 2 {
            return Err(PublishedError::Short { frames, samples, expected: grid.n_fft / 2 });
        }
        let mut scale = vec![0.0; samples + grid.n_fft];
        for frame in 0..frames {
            scale[frame * grid.hop..].iter_mut().zip(transform.squared_window()).for_each(|(s, w)| *s += w);
        }
        Ok(Self {
            grid,
            frames,
            transform,
            padded: vec![0.0; frames * grid.hop + grid.n_fft],
            ears: [Frames::new(frames, bins), Frames::new(frames, bins)],
            spectrum: vec![Complex32::default(); bins],
            scale: scale[grid.n_fft / 2..][..samples].iter().map(|s| 1.0 / s).collect(),
        })
    }

    /// Frames of a clip.
    pub(crate) fn frames(&self) -> usize {
        self.frames
    }

    /// Lengths of clips that have this number of frames, samples.
    pub(crate) fn clip_samples(&self) -> RangeInclusive<usize> {
        (self.frames - 1) * self.grid.hop..=self.frames * self.grid.hop - 1
    }

    /// Length of a rendered clip, samples: the shortest of [`PublishedClip::clip_samples`].
    pub(crate) fn out_samples(&self) -> usize {
        self.scale.len()
    }

    /// Room for a clip's sound.
    pub(crate) fn source(&self) -> ClipSource {
        let (bins, values) = (self.grid.bins(), self.frames * self.grid.bins());
        ClipSource { bins, spectra: vec![Complex32::default(); values], magnitudes: vec![0.0; values] }
    }

    /// Transforms a clip: frames are centred, the signal is reflected at its ends. Does not allocate.
    ///
    /// # Errors
    /// The length is not in [`PublishedClip::clip_samples`].
    pub(crate) fn analyse(&mut self, mono: &[f32], source: &mut ClipSource) -> Result<(), PublishedError> {
        length("input samples", self.clip_samples(), mono.len())?;
        let (n, hop, bins) = (self.grid.n_fft, self.grid.hop, self.grid.bins());
        let (before, rest) = self.padded.split_at_mut(n / 2);
        let (middle, after) = rest.split_at_mut(mono.len());
        middle.copy_from_slice(mono);
        before.iter_mut().rev().zip(&mono[1..]).for_each(|(p, x)| *p = *x);
        after.iter_mut().zip(mono.iter().rev().skip(1)).for_each(|(p, x)| *p = *x);
        let spectra = source.spectra.chunks_exact_mut(bins).zip(source.magnitudes.chunks_exact_mut(bins));
        for (frame, (spectrum, magnitudes)) in spectra.enumerate() {
            self.transform.analyse(&self.padded[frame * hop..][..n], spectrum);
            self.transform.magnitudes(spectrum, magnitudes);
        }
        Ok(())
    }

    /// Renders a clip to the left and the right ear, time-aligned with what was analysed: from the masked magnitudes and the
    /// time filter's output by frame, and masks whose lengths were checked. Does not allocate.
    ///
    /// # Errors
    /// An output of another length than [`PublishedClip::out_samples`].
    pub(crate) fn render(
        &mut self,
        source: &ClipSource,
        [masked, mix]: [&Frames; 2],
        (mixture, difference): (&[f32], &[f32]),
        conv: Option<&mut ConvLayers>,
        out: [&mut [f32]; 2],
    ) -> Result<(), PublishedError> {
        self.check_out(out.each_ref().map(|o| o.len()))?;
        let mut mix_ears = |frame: usize, added: [&[f32]; 2]| {
            for (ear, (rows, added)) in self.ears.iter_mut().zip(added).enumerate() {
                magnitudes_of_ear(ear, masked.row(frame), difference, added, rows.row_mut(frame));
            }
        };
        match conv {
            None => (0..self.frames).for_each(|frame| mix_ears(frame, [mix.row(frame); 2])),
            Some(layers) => {
                layers.reset();
                for pushed in 0..self.frames + CONV_DELAY {
                    let planes = |frame| Planes { mix: mix.row(frame), masked: masked.row(frame), mixture, difference };
                    if layers.push((pushed < self.frames).then(|| planes(pushed))) {
                        mix_ears(pushed - CONV_DELAY, [layers.ear(0), layers.ear(1)]);
                    }
                }
            }
        }
        for (ear, out) in out.into_iter().enumerate() {
            self.synthesise(ear, source, out);
        }
        Ok(())
    }

    /// Magnitudes of an ear, left 0 or right 1, of the last clip, frame by frame, one value per bin.
    pub(crate) fn magnitudes(&self, ear: usize) -> impl Iterator<Item = &[f32]> {
        self.ears[ear.min(1)].iter()
    }

    /// Bytes in memory.
    pub(crate) fn memory_bytes(&self) -> usize {
        let [left, right] = &self.ears;
        left.memory_bytes() + right.memory_bytes()
    }

    /// Whether masks fit.
    pub(crate) fn check_masks(&self, mixture: &[f32], difference: &[f32]) -> Result<(), PublishedError> {
        let bins = self.grid.bins();
        exactly("values of the mixture mask", bins, mixture.len())?;
        exactly("values of the difference mask", bins, difference.len())
    }

    fn check_out(&self, [left, right]: [usize; 2]) -> Result<(), PublishedError> {
        exactly("samples of the left output", self.out_samples(), left)?;
        exactly("samples of the right output", self.out_samples(), right)
    }

    fn synthesise(&mut self, ear: usize, source: &ClipSource, out: &mut [f32]) {
        let (n, hop) = (self.grid.n_fft, self.grid.hop);
        self.padded.fill(0.0);
        for frame in 0..self.frames {
            let wanted = self.ears[ear].row(frame);
            self.transform.with_phase(wanted, source.spectrum(frame), source.frame(frame), &mut self.spectrum);
            self.transform.synthesise(&mut self.spectrum, &mut self.padded[frame * hop..][..n]);
        }
        for ((o, s), scale) in out.iter_mut().zip(&self.padded[n / 2..]).zip(&self.scale) {
            *o = s * scale;
        }
    }
}

fn length(what: &'static str, expected: RangeInclusive<usize>, found: usize) -> Result<(), PublishedError> {
    if expected.contains(&found) { Ok(()) } else { Err(PublishedError::Length { what, expected, found }) }
}

fn exactly(what: &'static str, expected: usize, found: usize) -> Result<(), PublishedError> {
    length(what, expected..=expected, found)
}

#[cfg(test)]
mod tests;
