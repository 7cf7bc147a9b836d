//! The published render head over a clip, and the derivative of what it renders: what training goes through.

use crate::StftGrid;
use crate::cloud::SarhError;
use crate::cloud::conv::{ClipConv, ClipPlanes, ConvAdjoint, ConvWeights};
use crate::cloud::hann::HannFrames;
use crate::cloud::rows::Rows;
use crate::cloud::sarh::magnitudes_of_ear;
use pulp::{Arch, Simd, WithSimd};
use realfft::num_complex::Complex32;
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
pub struct SarhInput<'a> {
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
pub struct SarhGradient {
    /// By the mixture mask, `[bin]`. What reaches the output through [`SarhInput::mix`] is not in it.
    pub mixture: Vec<f32>,
    /// By the difference mask, `[bin]`.
    pub difference: Vec<f32>,
    /// By the time filter's output, `[frame][bin]`.
    pub mix: Vec<f32>,
    /// By the weights of the convolution layers.
    pub conv: ConvWeights,
}

impl SarhGradient {
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
pub struct SarhClip {
    arch: Arch,
    grid: StftGrid,
    frames: usize,
    transform: HannFrames,
    /// A clip's samples with half a frame before and after.
    padded: Vec<f32>,
    planes: ClipPlanes,
    conv: ClipConv,
    ears: [Rows; 2],
    spectrum: Vec<Complex32>,
    /// One over the sum of squared windows at each sample of the output.
    scale: Vec<f32>,
    /// Made when derivatives are first asked for.
    adjoint: Option<Box<Adjoint>>,
}

struct Adjoint {
    /// By the magnitudes of each ear, `[frame][bin]`.
    ears: [Rows; 2],
    conv: ConvAdjoint,
}

impl SarhClip {
    /// For clips of so many frames on this grid.
    ///
    /// # Errors
    /// The grid is not usable, or a clip is too short to be reflected at its ends.
    pub fn new(grid: StftGrid, frames: usize) -> Result<Self, SarhError> {
        Self::with_arch(grid, frames, Arch::new())
    }

    /// The same with these instructions.
    ///
    /// # Errors
    /// As [`SarhClip::new`].
    pub fn with_arch(grid: StftGrid, frames: usize, arch: Arch) -> Result<Self, SarhError> {
        let transform = HannFrames::new(&grid, arch)?;
        let bins = grid.bins();
        let samples = frames.saturating_sub(1) * grid.hop;
        if samples <= grid.n_fft / 2 {
            return Err(SarhError::Short { frames, samples, expected: grid.n_fft / 2 });
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
            ears: [Rows::new(frames, bins), Rows::new(frames, bins)],
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

    /// Length of a rendered clip, samples: the shortest of [`SarhClip::clip_samples`].
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
    pub fn gradient(&self) -> SarhGradient {
        let zeros = |count| vec![0.0; count];
        let (bins, conv) = (self.grid.bins(), ConvWeights::zeros());
        SarhGradient { mixture: zeros(bins), difference: zeros(bins), mix: zeros(self.frames * bins), conv }
    }

    /// Transforms a clip: frames are centred, the signal is reflected at its ends. Does not allocate.
    ///
    /// # Errors
    /// The length is not in [`SarhClip::clip_samples`], or the source is another head's.
    pub fn analyse(&mut self, mono: &[f32], source: &mut ClipSource) -> Result<(), SarhError> {
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
    /// Something is of another length than this head's; an output's should be [`SarhClip::out_samples`].
    pub fn render(&mut self, source: &ClipSource, input: SarhInput<'_>, out: [&mut [f32]; 2]) -> Result<(), SarhError> {
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
    ) -> Result<(), SarhError> {
        self.check_out(&out.each_ref().map(|o| o.len()))?;
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
        input: SarhInput<'_>,
        by_samples: [&[f32]; 2],
        by: &mut SarhGradient,
    ) -> Result<(), SarhError> {
        self.check(source, &input)?;
        self.check_out(&by_samples.map(<[f32]>::len))?;
        self.check(
            source,
            &SarhInput { mixture: &by.mixture, difference: &by.difference, mix: &by.mix, conv: Some(&by.conv) },
        )?;
        let (frames, bins, arch) = (self.frames, self.grid.bins(), self.arch);
        self.fill_planes(source, (input.mixture, input.difference), |t| &input.mix[t * bins..][..bins]);
        let mut adjoint = self.adjoint.take().unwrap_or_else(|| {
            Box::new(Adjoint {
                ears: [Rows::new(frames, bins), Rows::new(frames, bins)],
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
    pub(crate) fn check_masks(&self, mixture: &[f32], difference: &[f32]) -> Result<(), SarhError> {
        let bins = self.grid.bins();
        exactly("values of the mixture mask", bins, mixture.len())?;
        exactly("values of the difference mask", bins, difference.len())
    }

    fn check(&self, source: &ClipSource, input: &SarhInput<'_>) -> Result<(), SarhError> {
        self.check_source(source)?;
        self.check_masks(input.mixture, input.difference)?;
        exactly("values of the time filter's output", self.frames * self.grid.bins(), input.mix.len())?;
        let mut tensors = input.conv.map(ConvWeights::lengths).into_iter().flatten();
        tensors.try_for_each(|(what, expected, found)| exactly(what, expected, found))
    }

    fn check_source(&self, source: &ClipSource) -> Result<(), SarhError> {
        exactly("bins of the source", self.grid.bins(), source.bins)?;
        exactly("values of the source", self.frames * self.grid.bins(), source.magnitudes.len())
    }

    pub(crate) fn check_out(&self, [left, right]: &[usize; 2]) -> Result<(), SarhError> {
        exactly("samples of the left output", self.out_samples(), *left)?;
        exactly("samples of the right output", self.out_samples(), *right)
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
    fn gate(&self, frame: usize, by: &mut [Rows; 2]) {
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

    /// The adjoint of [`SarhClip::synthesise`].
    fn by_magnitudes(&mut self, source: &ClipSource, by_samples: &[f32], out: &mut Rows) {
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
    ears: &'a [Rows; 2],
    conv: Option<&'a ConvAdjoint>,
    by: &'a mut SarhGradient,
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

fn length(what: &'static str, expected: RangeInclusive<usize>, found: usize) -> Result<(), SarhError> {
    if expected.contains(&found) { Ok(()) } else { Err(SarhError::Length { what, expected, found }) }
}

fn exactly(what: &'static str, expected: usize, found: usize) -> Result<(), SarhError> {
    length(what, expected..=expected, found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::conv::tests::random_weights;
    use crate::cloud::rows::tests::{arches, noise};

    /// All that is learnt: mixture, difference, mix, then weights and biases of the three layers.
    type Inputs = Vec<Vec<f64>>;

    const NAMES: [&str; 9] =
        ["mixture", "difference", "mix", "out.0", "out.0 bias", "out.2", "out.2 bias", "out.4", "out.4 bias"];

    fn random(count: usize, seed: u32, scale: f32) -> Vec<f32> {
        (0..count).map(|i| scale * noise(seed, i)).collect()
    }

    /// A head, a clip whose first frames are silent, and what it is rendered with.
    fn clip(grid: StftGrid, frames: usize, arch: Arch) -> (SarhClip, ClipSource, SarhGradient) {
        let mut head = SarhClip::with_arch(grid, frames, arch).unwrap();
        let mut mono = random(*head.clip_samples().end(), 21, 0.3);
        mono[..grid.n_fft / 2 + 2].fill(0.0);
        let mut source = head.source();
        head.analyse(&mono, &mut source).unwrap();
        let at = SarhGradient {
            mixture: random(grid.bins(), 22, 1.0),
            difference: random(grid.bins(), 23, 0.9),
            mix: random(frames * grid.bins(), 24, 1.0),
            conv: random_weights(),
        };
        (head, source, at)
    }

    fn input(at: &SarhGradient, conv: bool) -> SarhInput<'_> {
        SarhInput { mixture: &at.mixture, difference: &at.difference, mix: &at.mix, conv: conv.then_some(&at.conv) }
    }

    fn rendered(head: &mut SarhClip, source: &ClipSource, input: SarhInput<'_>) -> [Vec<f32>; 2] {
        let mut out = [vec![0.0; head.out_samples()], vec![0.0; head.out_samples()]];
        let [left, right] = &mut out;
        head.render(source, input, [left, right]).unwrap();
        out
    }

    fn inputs(from: &SarhGradient) -> Inputs {
        let layers = from.conv.layers.iter().flat_map(|l| [&l.weight, &l.bias]);
        let all = [&from.mixture, &from.difference, &from.mix].into_iter().chain(layers);
        all.map(|v| v.iter().map(|x| f64::from(*x)).collect()).collect()
    }

    fn layer(x: &[Vec<f64>], weight: &[f64], bias: &[f64], (size, frames, bins): (usize, usize, usize)) -> Vec<Vec<f64>> {
        let mut out: Vec<Vec<f64>> = bias.iter().map(|b| vec![*b; frames * bins]).collect();
        for (i, w) in weight.iter().enumerate() {
            let (kt, kf) = (i % size, i / size % size);
            let (c, o) = (i / (size * size) % x.len(), i / (size * size * x.len()));
            for t in 0..frames {
                let Some(s) = (t + kt).checked_sub(size / 2).filter(|s| *s < frames) else { continue };
                for f in 0..bins {
                    let Some(g) = (f + kf).checked_sub(size / 2).filter(|g| *g < bins) else { continue };
                    out[o][t * bins + f] += w * x[c][s * bins + g];
                }
            }
        }
        out
    }

    fn relu(x: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        x.into_iter().map(|v| v.into_iter().map(|x| x.max(0.0)).collect()).collect()
    }

    /// The head by its definition, in double precision.
    fn naive(grid: StftGrid, frames: usize, source: &ClipSource, of: &Inputs, conv: bool) -> [Vec<f64>; 2] {
        let (bins, n, hop) = (grid.bins(), grid.n_fft, grid.hop);
        let sizes = |size| (size, frames, bins);
        [-1.0, 1.0].map(|sign| {
            let each = |f: &dyn Fn(usize) -> f64| -> Vec<f64> { (0..frames * bins).map(f).collect() };
            let base = each(&|i| (1.0 + sign * of[1][i % bins]) * of[0][i % bins] * f64::from(source.magnitudes[i]));
            let mut added = of[2].clone();
            if conv {
                let x = [added, base.clone(), each(&|i| of[0][i % bins]), each(&|i| sign * of[1][i % bins])];
                let hidden = relu(layer(&x, &of[3], &of[4], sizes(7)));
                let hidden = relu(layer(&hidden, &of[5], &of[6], sizes(3)));
                added = layer(&hidden, &of[7], &of[8], sizes(3)).remove(0);
            }
            let window = |j: usize| 0.5 - 0.5 * (std::f64::consts::TAU * j as f64 / n as f64).cos();
            let (mut sums, mut squares) = (vec![0.0; frames * hop + n], vec![0.0; frames * hop + n]);
            for t in 0..frames {
                for j in 0..n {
                    let mut y = 0.0;
                    for k in 0..bins {
                        let x = source.spectra[t * bins + k];
                        let phase = if x.norm_sqr() == 0.0 { 0.0 } else { f64::from(x.im).atan2(f64::from(x.re)) };
                        let turned = phase + std::f64::consts::TAU * (k * j % n) as f64 / n as f64;
                        let both = if k == 0 || k == n / 2 { 1.0 } else { 2.0 };
                        y += both * (added[t * bins + k] + base[t * bins + k]).max(0.0) * turned.cos() / n as f64;
                    }
                    sums[t * hop + j] += window(j) * y;
                    squares[t * hop + j] += window(j) * window(j);
                }
            }
            (n / 2..n / 2 + (frames - 1) * hop).map(|i| sums[i] / squares[i]).collect()
        })
    }

    fn grid(n_fft: usize, hop: usize) -> StftGrid {
        StftGrid { sample_rate_hz: 8000.0, n_fft, hop }
    }

    /// Few and many frames, hops that do not divide a frame, every width of the last tile.
    const CLIPS: [(usize, usize, usize); 5] = [(64, 15, 9), (32, 7, 23), (16, 8, 3), (30, 11, 8), (160, 77, 4)];

    #[test]
    fn renders_by_the_definition() {
        for (n_fft, hop, frames) in CLIPS {
            for arch in arches() {
                let (mut head, source, at) = clip(grid(n_fft, hop), frames, arch);
                for conv in [true, false] {
                    let want = naive(grid(n_fft, hop), frames, &source, &inputs(&at), conv);
                    for (a, b) in rendered(&mut head, &source, input(&at, conv)).concat().iter().zip(want.concat()) {
                        assert!((f64::from(*a) - b).abs() < 1e-5, "{arch:?} {n_fft}, conv {conv}: {a} for {b}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_adjoint_is_the_derivative() {
        for (n_fft, hop, frames) in CLIPS {
            let grid = grid(n_fft, hop);
            let (head, source, at) = clip(grid, frames, Arch::Scalar);
            let by_samples = [31, 32].map(|seed| random(head.out_samples(), seed, 1.0));
            let weighed = |of: &Inputs, conv| -> f64 {
                let out = naive(grid, frames, &source, of, conv).concat();
                out.iter().zip(by_samples.concat()).map(|(o, w)| o * f64::from(w)).sum()
            };
            for conv in [true, false] {
                let at_f64 = inputs(&at);
                // Along two random directions in each tensor.
                let mut slopes = Vec::new();
                for (tensor, seed) in (0..if conv { 9 } else { 3 }).flat_map(|t| [(t, 41), (t, 42)]) {
                    let direction = random(at_f64[tensor].len(), seed, 1.0);
                    let ends = [1e-6, -1e-6].map(|step| {
                        let mut moved = at_f64.clone();
                        moved[tensor].iter_mut().zip(&direction).for_each(|(x, d)| *x += step * f64::from(*d));
                        weighed(&moved, conv)
                    });
                    slopes.push((tensor, direction, (ends[0] - ends[1]) / 2e-6));
                }
                for arch in arches() {
                    let mut head = SarhClip::with_arch(grid, frames, arch).unwrap();
                    let mut by = head.gradient();
                    // Nothing of an earlier clip is left, and derivatives add up.
                    for clips in 1..3 {
                        head.adjoint(&source, input(&at, conv), by_samples.each_ref().map(|b| &b[..]), &mut by).unwrap();
                        let found = inputs(&by);
                        for (tensor, direction, slope) in &slopes {
                            let (by, slope) = (&found[*tensor], f64::from(clips) * slope);
                            let along: f64 = by.iter().zip(direction).map(|(b, d)| b * f64::from(*d)).sum();
                            let size = by.iter().map(|b| b * b).sum::<f64>().sqrt();
                            let what = NAMES[*tensor];
                            assert!(size > 0.0, "{what}");
                            assert!(
                                (along - slope).abs() < 1e-4 * size,
                                "{arch:?} {n_fft} {what}, conv {conv}: {along} for {slope}"
                            );
                        }
                        assert!(conv || found[3..].iter().flatten().all(|b| *b == 0.0));
                    }
                }
            }
        }
    }

    #[test]
    fn without_layers_the_adjoint_is_the_transpose() {
        // So loud a time filter that nothing is rectified: the output is its affine function.
        for arch in arches() {
            let (mut head, source, mut at) = clip(grid(64, 15), 9, arch);
            let direction = random(at.mix.len(), 51, 1.0);
            at.mix.fill(1e3);
            let resting = rendered(&mut head, &source, input(&at, false)).concat();
            at.mix.iter_mut().zip(&direction).for_each(|(x, d)| *x += 100.0 * d);
            let moved = rendered(&mut head, &source, input(&at, false)).concat();
            let by_samples = [52, 53].map(|seed| random(head.out_samples(), seed, 1.0));
            let mut by = head.gradient();
            head.adjoint(&source, input(&at, false), by_samples.each_ref().map(|b| &b[..]), &mut by).unwrap();
            let difference = moved.iter().zip(&resting).map(|(a, b)| f64::from(a - b) / 100.0);
            let ahead: f64 = difference.zip(by_samples.concat()).map(|(o, w)| o * f64::from(w)).sum();
            let back: f64 = by.mix.iter().zip(&direction).map(|(b, d)| f64::from(b * d)).sum();
            assert!((ahead - back).abs() < 1e-4 * ahead.abs(), "{arch:?}: {ahead} and {back}");
        }
    }

    #[test]
    fn what_does_not_fit_is_said() {
        let (mut head, mut source, at) = clip(grid(64, 15), 9, Arch::Scalar);
        let (mut by, samples) = (head.gradient(), head.out_samples());
        assert_eq!(samples, 120);
        assert!(matches!(SarhClip::new(grid(64, 15), 3), Err(SarhError::Short { samples: 30, expected: 32, .. })));
        assert!(matches!(SarhClip::new(grid(64, 15), 0), Err(SarhError::Short { .. })));
        for (mono, fits) in [(119, false), (120, true), (134, true), (135, false)] {
            assert_eq!(head.analyse(&vec![0.1; mono], &mut source).is_ok(), fits, "{mono}");
        }
        let sound = vec![0.1; samples];
        let mut said = |source: &ClipSource, at: &SarhGradient, by: &mut SarhGradient, right: usize| {
            head.adjoint(source, input(at, true), [&sound, &sound[..right]], by).map_err(|e| e.to_string())
        };
        assert_eq!(said(&source, &at, &mut by, samples), Ok(()));
        assert!(said(&source, &at, &mut by, samples - 1).unwrap_err().contains("right output"));
        let other = SarhClip::new(grid(64, 15), 10).unwrap();
        assert!(said(&other.source(), &at, &mut by, samples).unwrap_err().contains("source"));
        assert!(said(&source, &at, &mut other.gradient(), samples).unwrap_err().contains("time filter"));
        for (tensor, what) in [(0, "out.0"), (1, "out.2"), (2, "out.4")] {
            let mut at = at.clone();
            at.conv.layers[tensor].weight.pop();
            assert!(said(&source, &at, &mut by, samples).unwrap_err().contains(what));
        }
    }
}
