//! The published render head over a clip, and the derivative of what it renders: what training goes through.

use crate::StftGrid;
use crate::published::conv::{ClipConv, ClipPlanes, ConvAdjoint, ConvWeights};
use crate::published::error::PublishedError;
use crate::published::frames::Frames;
use crate::published::hann::HannFrames;
use crate::published::stream::magnitudes_of_ear;
use promenade_fourier::num_complex::Complex32;
use pulp::{Arch, Simd, WithSimd};
use std::ops::RangeInclusive;

/// A clip's dry sound as the head takes it.
#[derive(Clone, Debug, PartialEq)]
pub struct ClipSource {
    bins: usize,
    spectra: Vec<Complex32>,
    magnitudes: Vec<f32>,
}

impl ClipSource {
    /// Magnitudes, `[frame][bin]`.
    #[must_use]
    pub fn magnitudes(&self) -> &[f32] {
        &self.magnitudes
    }

    /// Magnitudes of one frame.
    pub(crate) fn frame(&self, frame: usize) -> &[f32] {
        &self.magnitudes[frame * self.bins..][..self.bins]
    }

    fn spectrum(&self, frame: usize) -> &[Complex32] {
        &self.spectra[frame * self.bins..][..self.bins]
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        8 * self.spectra.len() + 4 * self.magnitudes.len()
    }
}

/// What a clip is rendered with.
#[derive(Clone, Copy, Debug)]
pub struct PublishedInput<'a> {
    /// Mixture mask, one value per bin, linear gain.
    pub mixture: &'a [f32],
    /// Difference mask in (-1, 1), one value per bin; positive = right louder.
    pub difference: &'a [f32],
    /// Output of the time filter, magnitudes, `[frame][bin]`.
    pub mix: &'a [f32],
    /// The convolution layers; without them `mix` is added to the masked magnitudes itself.
    pub conv: Option<&'a ConvWeights>,
}

/// Derivatives of a number by what a clip was rendered with.
#[derive(Clone, Debug, PartialEq)]
pub struct PublishedGradient {
    /// By the mixture mask, `[bin]`. What reaches the output through [`PublishedInput::mix`] is not in it.
    pub mixture: Vec<f32>,
    /// By the difference mask, `[bin]`.
    pub difference: Vec<f32>,
    /// By the time filter's output, `[frame][bin]`.
    pub mix: Vec<f32>,
    /// By the weights of the convolution layers.
    pub conv: ConvWeights,
}

impl PublishedGradient {
    /// Zeros.
    pub fn clear(&mut self) {
        let layers = self.conv.layers.iter_mut().flat_map(|l| [&mut l.weight, &mut l.bias]);
        [&mut self.mixture, &mut self.difference, &mut self.mix].into_iter().chain(layers).for_each(|v| v.fill(0.0));
    }
}

/// Renders clips from masks and the time filter's output, as the published code does, and carries derivatives back.
///
/// The magnitudes of each ear are `ReLU(added + (1 + sign difference) mixture |X|)`, sign -1 left and 1 right, where `added` is the time
/// filter's output or what the convolution layers make of it; they take the source's phase. One serves any number of clips, one at a
/// time: a thread has its own.
pub struct PublishedClip {
    arch: Arch,
    grid: StftGrid,
    frames: usize,
    transform: HannFrames,
    /// A clip's samples with half a frame before and after.
    padded: Vec<f32>,
    planes: ClipPlanes,
    conv: ClipConv,
    ears: [Frames; 2],
    spectrum: Vec<Complex32>,
    /// One over the sum of squared windows at each sample of the output.
    scale: Vec<f32>,
    /// Made when derivatives are first asked for.
    adjoint: Option<Box<Adjoint>>,
}

struct Adjoint {
    /// By the magnitudes of each ear, `[frame][bin]`.
    ears: [Frames; 2],
    conv: ConvAdjoint,
}

impl PublishedClip {
    /// For clips of so many frames on this grid.
    ///
    /// # Errors
    /// The grid is not usable, or a clip is too short to be reflected at its ends.
    pub fn new(grid: StftGrid, frames: usize) -> Result<Self, PublishedError> {
        Self::with_arch(grid, frames, Arch::new())
    }

    /// The same with these instructions.
    ///
    /// # Errors
    /// As [`PublishedClip::new`].
    pub fn with_arch(grid: StftGrid, frames: usize, arch: Arch) -> Result<Self, PublishedError> {
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
            arch,
            grid,
            frames,
            transform,
            padded: vec![0.0; frames * grid.hop + grid.n_fft],
            planes: ClipPlanes::new(frames, bins),
            conv: ClipConv::new(frames, bins, arch),
            ears: [Frames::new(frames, bins), Frames::new(frames, bins)],
            spectrum: vec![Complex32::default(); bins],
            scale: scale[grid.n_fft / 2..][..samples].iter().map(|s| 1.0 / s).collect(),
            adjoint: None,
        })
    }

    /// Frames of a clip.
    #[must_use]
    pub fn frames(&self) -> usize {
        self.frames
    }

    /// Lengths of clips that have this number of frames, samples.
    #[must_use]
    pub fn clip_samples(&self) -> RangeInclusive<usize> {
        (self.frames - 1) * self.grid.hop..=self.frames * self.grid.hop - 1
    }

    /// Length of a rendered clip, samples: the shortest of [`PublishedClip::clip_samples`].
    #[must_use]
    pub fn out_samples(&self) -> usize {
        self.scale.len()
    }

    /// Room for a clip's sound.
    #[must_use]
    pub fn source(&self) -> ClipSource {
        let (bins, values) = (self.grid.bins(), self.frames * self.grid.bins());
        ClipSource { bins, spectra: vec![Complex32::default(); values], magnitudes: vec![0.0; values] }
    }

    /// Room for derivatives: zeros.
    #[must_use]
    pub fn gradient(&self) -> PublishedGradient {
        let zeros = |count| vec![0.0; count];
        let (bins, conv) = (self.grid.bins(), ConvWeights::zeros());
        PublishedGradient { mixture: zeros(bins), difference: zeros(bins), mix: zeros(self.frames * bins), conv }
    }

    /// Transforms a clip: frames are centred, the signal is reflected at its ends. Does not allocate.
    ///
    /// # Errors
    /// The length is not in [`PublishedClip::clip_samples`], or the source is another head's.
    pub fn analyse(&mut self, mono: &[f32], source: &mut ClipSource) -> Result<(), PublishedError> {
        length("input samples", self.clip_samples(), mono.len())?;
        self.check_source(source)?;
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

    /// Renders a clip to the left and the right ear, time-aligned with what was analysed. Does not allocate.
    ///
    /// # Errors
    /// Something is of another length than this head's; an output's should be [`PublishedClip::out_samples`].
    pub fn render(
        &mut self,
        source: &ClipSource,
        input: PublishedInput<'_>,
        out: [&mut [f32]; 2],
    ) -> Result<(), PublishedError> {
        self.check(source, &input)?;
        let bins = self.grid.bins();
        self.render_frames(source, (input.mixture, input.difference), |t| &input.mix[t * bins..][..bins], input.conv, out)
    }

    /// The same for masks and weights of the right length, and the time filter's output by frame.
    pub(crate) fn render_frames<'a>(
        &mut self,
        source: &ClipSource,
        masks: (&[f32], &[f32]),
        mix: impl Fn(usize) -> &'a [f32],
        conv: Option<&ConvWeights>,
        out: [&mut [f32]; 2],
    ) -> Result<(), PublishedError> {
        self.check_out(out.each_ref().map(|o| o.len()))?;
        self.fill_planes(source, masks, mix);
        match conv {
            None => (0..self.frames).for_each(|t| self.mix_ears(t, masks.1, false)),
            Some(weights) => {
                self.conv.start(weights, masks.0, masks.1);
                for pushed in 0..self.conv.pushes() {
                    if let Some(frame) = self.conv.push(pushed, &self.planes) {
                        self.mix_ears(frame, masks.1, true);
                    }
                }
            }
        }
        for (ear, out) in out.into_iter().enumerate() {
            self.synthesise(ear, source, out);
        }
        Ok(())
    }

    /// Adds the derivatives of a number by what a clip is rendered with, from its derivatives by every sample of both ears. The source
    /// is taken as given; without convolution layers nothing is added to the derivatives by their weights. Allocates when first called.
    ///
    /// # Errors
    /// Something is of another length than this head's.
    pub fn adjoint(
        &mut self,
        source: &ClipSource,
        input: PublishedInput<'_>,
        by_samples: [&[f32]; 2],
        by: &mut PublishedGradient,
    ) -> Result<(), PublishedError> {
        self.check(source, &input)?;
        self.check_out(by_samples.map(<[f32]>::len))?;
        self.check(
            source,
            &PublishedInput { mixture: &by.mixture, difference: &by.difference, mix: &by.mix, conv: Some(&by.conv) },
        )?;
        let (frames, bins, arch) = (self.frames, self.grid.bins(), self.arch);
        self.fill_planes(source, (input.mixture, input.difference), |t| &input.mix[t * bins..][..bins]);
        let mut adjoint = self.adjoint.take().unwrap_or_else(|| {
            Box::new(Adjoint {
                ears: [Frames::new(frames, bins), Frames::new(frames, bins)],
                conv: ConvAdjoint::new(frames, bins, arch),
            })
        });
        for (rows, by_samples) in adjoint.ears.iter_mut().zip(by_samples) {
            self.by_magnitudes(source, by_samples, rows);
        }
        match input.conv {
            None => {
                for frame in 0..frames {
                    self.mix_ears(frame, input.difference, false);
                    self.gate(frame, &mut adjoint.ears);
                }
            }
            Some(weights) => {
                self.conv.start(weights, input.mixture, input.difference);
                adjoint.conv.start(weights);
                for pushed in 0..adjoint.conv.pushes() {
                    if let Some(frame) = self.conv.push(pushed, &self.planes) {
                        self.mix_ears(frame, input.difference, true);
                        self.gate(frame, &mut adjoint.ears);
                        for (ear, rows) in adjoint.ears.iter().enumerate() {
                            adjoint.conv.out_mut(frame, ear).copy_from_slice(rows.row(frame));
                        }
                    }
                    adjoint.conv.follow(&self.conv, pushed, &self.planes);
                }
                adjoint.conv.finish(&self.conv, &mut by.conv);
                let [mixture, difference] = adjoint.conv.by_masks();
                add(&mut by.mixture, mixture);
                add(&mut by.difference, difference);
            }
        }
        let conv = input.conv.map(|_| &adjoint.conv);
        let difference = input.difference;
        self.arch.dispatch(Gather { source, difference, planes: &self.planes, ears: &adjoint.ears, conv, by });
        self.adjoint = Some(adjoint);
        Ok(())
    }

    /// Magnitudes of an ear, left 0 or right 1, of the last clip, frame by frame, one value per bin.
    pub fn magnitudes(&self, ear: usize) -> impl Iterator<Item = &[f32]> {
        self.ears[ear.min(1)].iter()
    }

    /// Bytes in memory.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let [left, right] = &self.ears;
        let adjoint = self.adjoint.as_ref().map_or(0, |a| a.conv.memory_bytes() + 2 * a.ears[0].memory_bytes());
        left.memory_bytes() + right.memory_bytes() + self.planes.memory_bytes() + self.conv.memory_bytes() + adjoint
    }

    /// Whether masks fit.
    pub(crate) fn check_masks(&self, mixture: &[f32], difference: &[f32]) -> Result<(), PublishedError> {
        let bins = self.grid.bins();
        exactly("values of the mixture mask", bins, mixture.len())?;
        exactly("values of the difference mask", bins, difference.len())
    }

    fn check(&self, source: &ClipSource, input: &PublishedInput<'_>) -> Result<(), PublishedError> {
        self.check_source(source)?;
        self.check_masks(input.mixture, input.difference)?;
        exactly("values of the time filter's output", self.frames * self.grid.bins(), input.mix.len())?;
        let mut tensors = input.conv.map(ConvWeights::lengths).into_iter().flatten();
        tensors.try_for_each(|(what, expected, found)| exactly(what, expected, found))
    }

    fn check_source(&self, source: &ClipSource) -> Result<(), PublishedError> {
        exactly("bins of the source", self.grid.bins(), source.bins)?;
        exactly("values of the source", self.frames * self.grid.bins(), source.magnitudes.len())
    }

    fn check_out(&self, [left, right]: [usize; 2]) -> Result<(), PublishedError> {
        exactly("samples of the left output", self.out_samples(), left)?;
        exactly("samples of the right output", self.out_samples(), right)
    }

    fn fill_planes<'a>(
        &mut self,
        source: &ClipSource,
        (mixture, difference): (&[f32], &[f32]),
        mix: impl Fn(usize) -> &'a [f32],
    ) {
        for frame in 0..self.frames {
            self.planes.get_mut(frame, 0).copy_from_slice(mix(frame));
            let masks = mixture.iter().zip(difference);
            let [masked, swung] = self.planes.pair_mut(frame);
            for (((s, w), x), (m, d)) in masked.iter_mut().zip(swung).zip(source.frame(frame)).zip(masks) {
                *s = x * m;
                *w = *s * d;
            }
        }
    }

    /// Magnitudes of both ears in one frame.
    fn mix_ears(&mut self, frame: usize, difference: &[f32], conv: bool) {
        let masked = self.planes.get(frame, 1);
        for (ear, rows) in self.ears.iter_mut().enumerate() {
            let added = if conv { self.conv.ear(ear) } else { self.planes.get(frame, 0) };
            magnitudes_of_ear(ear, masked, difference, added, rows.row_mut(frame));
        }
    }

    /// Derivatives by magnitudes become those by what is rectified.
    fn gate(&self, frame: usize, by: &mut [Frames; 2]) {
        for (by, ear) in by.iter_mut().zip(&self.ears) {
            by.row_mut(frame).iter_mut().zip(ear.row(frame)).for_each(|(b, m)| *b = if *m > 0.0 { *b } else { 0.0 });
        }
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

    /// The adjoint of [`PublishedClip::synthesise`].
    fn by_magnitudes(&mut self, source: &ClipSource, by_samples: &[f32], out: &mut Frames) {
        let (n, hop) = (self.grid.n_fft, self.grid.hop);
        self.padded.fill(0.0);
        for ((p, b), scale) in self.padded[n / 2..].iter_mut().zip(by_samples).zip(&self.scale) {
            *p = b * scale;
        }
        for frame in 0..self.frames {
            let (by_samples, source) = (&self.padded[frame * hop..][..n], (source.spectrum(frame), source.frame(frame)));
            self.transform.by_magnitudes(by_samples, source, &mut self.spectrum, out.row_mut(frame));
        }
    }
}

/// Adds up what all frames say of masks and time filter.
struct Gather<'a> {
    source: &'a ClipSource,
    difference: &'a [f32],
    planes: &'a ClipPlanes,
    ears: &'a [Frames; 2],
    conv: Option<&'a ConvAdjoint>,
    by: &'a mut PublishedGradient,
}

impl WithSimd for Gather<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let Self { source, difference, planes, ears: [left, right], conv, by } = self;
        let bins = source.bins;
        let (by_mixture, by_difference) = (&mut by.mixture[..bins], &mut by.difference[..bins]);
        let difference = &difference[..bins];
        for (frame, by_mix) in by.mix.chunks_exact_mut(bins).enumerate() {
            let (left, right, source) = (&left.row(frame)[..bins], &right.row(frame)[..bins], &source.frame(frame)[..bins]);
            let masked = &planes.get(frame, 1)[..bins];
            match conv {
                None => {
                    for k in 0..bins {
                        let (even, odd) = (left[k] + right[k], right[k] - left[k]);
                        by_mix[k] += even;
                        by_mixture[k] += (even + difference[k] * odd) * source[k];
                        by_difference[k] += odd * masked[k];
                    }
                }
                Some(conv) => {
                    let [mix, even_base, odd_base] = [0, 1, 2].map(|plane| &conv.by_plane(frame, plane)[..bins]);
                    for k in 0..bins {
                        let (even, odd) = (left[k] + right[k] + even_base[k], right[k] - left[k] + odd_base[k]);
                        by_mix[k] += mix[k];
                        by_mixture[k] += (even + difference[k] * odd) * source[k];
                        by_difference[k] += odd * masked[k];
                    }
                }
            }
        }
    }
}

fn add(sums: &mut [f32], x: &[f32]) {
    sums.iter_mut().zip(x).for_each(|(s, x)| *s += x);
}

fn length(what: &'static str, expected: RangeInclusive<usize>, found: usize) -> Result<(), PublishedError> {
    if expected.contains(&found) { Ok(()) } else { Err(PublishedError::Length { what, expected, found }) }
}

fn exactly(what: &'static str, expected: usize, found: usize) -> Result<(), PublishedError> {
    length(what, expected..=expected, found)
}

#[cfg(test)]
mod tests;
