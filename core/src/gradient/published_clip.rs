//! The derivative of what the published head renders of a clip.

use crate::gradient::conv::{ConvAdjoint, gate};
use crate::published::clip::exactly;
use crate::published::conv::{ClipPlanes, ConvWeights};
use crate::published::frames::Frames;
use crate::published::{ClipSource, PublishedClip, PublishedError, PublishedInput};
use promenade_fourier::num_complex::Complex32;
use pulp::{Arch, Simd, WithSimd};

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
    fn as_input(&self) -> PublishedInput<'_> {
        PublishedInput { mixture: &self.mixture, difference: &self.difference, mix: &self.mix, conv: Some(&self.conv) }
    }

    /// Zeros.
    pub fn clear(&mut self) {
        let layers = self.conv.layers.iter_mut().flat_map(|l| [&mut l.weight, &mut l.bias]);
        [&mut self.mixture, &mut self.difference, &mut self.mix].into_iter().chain(layers).for_each(|v| v.fill(0.0));
    }
}

/// Carries derivatives back through what a [`PublishedClip`] renders.
pub struct PublishedAdjoint {
    arch: Arch,
    /// By the magnitudes of each ear, `[frame][bin]`.
    ears: [Frames; 2],
    conv: ConvAdjoint,
}

impl PublishedAdjoint {
    /// For clips that this head renders; allocates.
    #[must_use]
    pub fn new(clip: &PublishedClip) -> Self {
        Self::with_arch(clip, Arch::new())
    }

    /// A gradient that computes with the given instruction set.
    #[must_use]
    pub fn with_arch(clip: &PublishedClip, arch: Arch) -> Self {
        let (frames, bins) = (clip.frames(), clip.grid.bins());
        let ears = [Frames::new(frames, bins), Frames::new(frames, bins)];
        Self { arch, ears, conv: ConvAdjoint::new(frames, bins, arch) }
    }

    /// Room for derivatives: zeros.
    #[must_use]
    pub fn gradient(&self) -> PublishedGradient {
        let (frames, bins) = (self.ears[0].count(), self.ears[0].len());
        let zeros = |count| vec![0.0; count];
        let conv = ConvWeights::zeros();
        PublishedGradient { mixture: zeros(bins), difference: zeros(bins), mix: zeros(frames * bins), conv }
    }

    /// Adds to `by` the derivatives of a number by what a clip is rendered with, given its derivatives by every sample of both
    /// ears. The source is constant; without convolution layers nothing is added to the derivatives by their weights. Does not
    /// allocate.
    ///
    /// # Errors
    /// Something is of another length than the head's.
    pub fn add(
        &mut self,
        clip: &mut PublishedClip,
        source: &ClipSource,
        input: PublishedInput<'_>,
        by_samples: [&[f32]; 2],
        by: &mut PublishedGradient,
    ) -> Result<(), PublishedError> {
        clip.check(source, &input)?;
        clip.check_out(by_samples.map(<[f32]>::len))?;
        clip.check(source, &by.as_input())?;
        exactly("frames of the adjoint", clip.frames(), self.ears[0].count())?;
        exactly("bins of the adjoint", clip.grid.bins(), self.ears[0].len())?;
        let bins = clip.grid.bins();
        clip.fill_planes(source, (input.mixture, input.difference), |t| &input.mix[t * bins..][..bins]);
        for (out, by_samples) in self.ears.iter_mut().zip(by_samples) {
            by_magnitudes(self.arch, clip, source, by_samples, out);
        }
        match input.conv {
            None => {
                for frame in 0..clip.frames() {
                    clip.mix_ears(frame, input.difference, false);
                    self.rectify(frame, &clip.ears);
                }
            }
            Some(weights) => {
                clip.conv.start(weights, input.mixture, input.difference);
                self.conv.start(weights);
                for pushed in 0..self.conv.pushes() {
                    if let Some(frame) = clip.conv.push(pushed, &clip.planes) {
                        clip.mix_ears(frame, input.difference, true);
                        self.rectify(frame, &clip.ears);
                        for (ear, by) in self.ears.iter().enumerate() {
                            self.conv.out_mut(frame, ear).copy_from_slice(by.row(frame));
                        }
                    }
                    self.conv.follow(&clip.conv, pushed, &clip.planes);
                }
                self.conv.finish(&clip.conv, &mut by.conv);
                let [mixture, difference] = self.conv.by_masks();
                add(&mut by.mixture, mixture);
                add(&mut by.difference, difference);
            }
        }
        let conv = input.conv.map(|_| &self.conv);
        self.arch.dispatch(Gather { source, difference: input.difference, planes: &clip.planes, ears: &self.ears, conv, by });
        Ok(())
    }

    /// Carries derivatives by a frame's magnitudes back through their rectification.
    fn rectify(&mut self, frame: usize, magnitudes: &[Frames; 2]) {
        for (by, magnitudes) in self.ears.iter_mut().zip(magnitudes) {
            gate(by.row_mut(frame), magnitudes.row(frame));
        }
    }
}

/// Derivatives by the magnitudes of an ear, from those by its samples: the adjoint of the synthesis.
fn by_magnitudes(arch: Arch, clip: &mut PublishedClip, source: &ClipSource, by_samples: &[f32], out: &mut Frames) {
    let (n, hop) = (clip.grid.n_fft, clip.grid.hop);
    clip.padded.fill(0.0);
    for ((p, b), scale) in clip.padded[n / 2..].iter_mut().zip(by_samples).zip(&clip.scale) {
        *p = b * scale;
    }
    for frame in 0..clip.frames() {
        clip.transform.analyse(&clip.padded[frame * hop..][..n], &mut clip.spectrum);
        let (spectrum, out) = (&clip.spectrum, out.row_mut(frame));
        let (source, magnitudes) = (source.spectrum(frame), source.frame(frame));
        arch.dispatch(AlongPhase { spectrum, source, magnitudes, scale: 2.0 / n as f32, out });
        // Every bin but the ends stands for its mirror image too.
        out[0] *= 0.5;
        out[n / 2] *= 0.5;
    }
}

/// Sums the derivatives by masks and time filter over frames.
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
        let bins = difference.len();
        let (by_mixture, by_difference) = (&mut by.mixture[..bins], &mut by.difference[..bins]);
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

/// The part of each bin along the source's phase, which the magnitude changes.
struct AlongPhase<'a> {
    spectrum: &'a [Complex32],
    source: &'a [Complex32],
    magnitudes: &'a [f32],
    scale: f32,
    out: &'a mut [f32],
}

impl WithSimd for AlongPhase<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        for (((o, y), x), magnitude) in self.out.iter_mut().zip(self.spectrum).zip(self.source).zip(self.magnitudes) {
            let along = (y.re * x.re + y.im * x.im) / magnitude;
            *o = self.scale * if *magnitude == 0.0 { y.re } else { along };
        }
    }
}

#[cfg(test)]
mod tests;
