//! Whole clips, rendered as the published code does.

use crate::StftGrid;
use crate::cloud::conv::{CONV_DELAY, ConvLayers, Planes};
use crate::cloud::hann::HannFrames;
use crate::cloud::rows::Rows;
use crate::cloud::sarh::magnitudes_of_ear;
use crate::cloud::time_filter::TimeFilter;
use crate::cloud::{CloudKind, CloudModel, CloudSizes, Listener, Masks, SarhError};
use pulp::Arch;
use realfft::num_complex::Complex32;
use std::ops::RangeInclusive;

/// Renders a clip of as many frames as the model was trained on, one listener for all of it.
///
/// The magnitudes of the source times the mixture mask go through the time filter; convolution layers over frequency and time add to
/// the masked magnitudes of each ear, which take the source's phase. Without convolution layers the time filter's output is added
/// itself; a model without time filters is rendered as if their output were zero, in clips of a second.
pub struct ClipRenderer {
    sizes: CloudSizes,
    grid: StftGrid,
    frames: usize,
    filter: Option<TimeFilter>,
    conv: Option<ConvLayers>,
    transform: HannFrames,
    padded: Vec<f32>,
    /// `[frame][bin]`, as are all that follow.
    spectra: Vec<Complex32>,
    source: Rows,
    masked: Rows,
    mix: Rows,
    ears: [Rows; 2],
    spectrum: Vec<Complex32>,
    sums: Vec<f32>,
    /// One over the sum of squared windows at each sample of the output.
    scale: Vec<f32>,
}

impl ClipRenderer {
    /// For clips on the grid that the model was trained on.
    ///
    /// # Errors
    /// The grid has other bins than the model has bands, is not usable, or a clip is too short to be reflected at its ends.
    pub fn new(model: &CloudModel, grid: StftGrid) -> Result<Self, SarhError> {
        Self::with_arch(model, grid, Arch::new())
    }

    /// The same with these instructions.
    ///
    /// # Errors
    /// As [`ClipRenderer::new`].
    pub fn with_arch(model: &CloudModel, grid: StftGrid, arch: Arch) -> Result<Self, SarhError> {
        let (sizes, bins) = (model.sizes(), grid.bins());
        if model.parts().kind == CloudKind::Taps {
            return Err(SarhError::Streamed);
        }
        if sizes.bands != bins {
            return Err(SarhError::Bands { bands: sizes.bands, bins });
        }
        let transform = HannFrames::new(&grid, arch)?;
        let frames = if sizes.frames > 0 { sizes.frames } else { second(&grid) / grid.hop + 1 };
        let samples = (frames - 1) * grid.hop;
        if samples <= grid.n_fft / 2 {
            return Err(SarhError::Short { frames, samples, expected: grid.n_fft / 2 });
        }
        let mut scale = vec![0.0; (frames - 1) * grid.hop + grid.n_fft];
        for frame in 0..frames {
            scale[frame * grid.hop..].iter_mut().zip(transform.squared_window()).for_each(|(s, w)| *s += w);
        }
        let scale = scale[grid.n_fft / 2..][..samples].iter().map(|s| 1.0 / s).collect();
        let rows = || Rows::new(frames, bins);
        Ok(Self {
            sizes,
            grid,
            frames,
            filter: TimeFilter::new(model, arch),
            conv: ConvLayers::new(model, bins, arch),
            transform,
            padded: vec![0.0; frames * grid.hop + grid.n_fft],
            spectra: vec![Complex32::default(); frames * bins],
            source: rows(),
            masked: rows(),
            mix: rows(),
            ears: [rows(), rows()],
            spectrum: vec![Complex32::default(); bins],
            sums: vec![0.0; samples + grid.n_fft],
            scale,
        })
    }

    /// Lengths of clips that have the model's number of frames, samples.
    #[must_use]
    pub fn clip_samples(&self) -> RangeInclusive<usize> {
        (self.frames - 1) * self.grid.hop..=self.frames * self.grid.hop - 1
    }

    /// Length of a rendered clip, samples: the shortest of [`ClipRenderer::clip_samples`].
    #[must_use]
    pub fn out_samples(&self) -> usize {
        (self.frames - 1) * self.grid.hop
    }

    /// Magnitudes of an ear, left 0 or right 1, of the last rendered clip, frame by frame, one value per bin.
    pub fn magnitudes(&self, ear: usize) -> impl Iterator<Item = &[f32]> {
        self.ears[ear.min(1)].iter()
    }

    /// Renders one clip to the left and the right ear, time-aligned with the input.
    ///
    /// # Real-time
    /// Not for the audio thread: takes milliseconds. Does not allocate.
    ///
    /// # Errors
    /// The input's length is not in [`ClipRenderer::clip_samples`], an output's is not [`ClipRenderer::out_samples`], or the masks are
    /// another model's.
    pub fn render(&mut self, mono: &[f32], masks: &Masks, listener: &Listener, out: [&mut [f32]; 2]) -> Result<(), SarhError> {
        let bins = self.grid.bins();
        let exactly = |n: usize| n..=n;
        let samples = self.out_samples();
        for (what, expected, found) in [
            ("input samples", self.clip_samples(), mono.len()),
            ("samples of the left output", exactly(samples), out[0].len()),
            ("samples of the right output", exactly(samples), out[1].len()),
            ("values of the mixture mask", exactly(bins), masks.mixture.len()),
            ("values of the difference mask", exactly(bins), masks.difference.len()),
        ] {
            if !expected.contains(&found) {
                return Err(SarhError::Length { what, expected, found });
            }
        }
        self.analyse(mono, masks);
        match &mut self.filter {
            Some(filter) => filter.apply(listener, masks, &self.masked, &mut self.mix),
            None => self.mix.clear(),
        }
        self.mix_ears(masks);
        for (ear, out) in out.into_iter().enumerate() {
            self.synthesise(ear, out);
        }
        Ok(())
    }

    /// Renders a signal of any length as clips that overlap by a twentieth, each faded linearly into the next (Chen and Shlizerman 2024,
    /// appendix A.2). `masks_at` is given the seconds of each clip's centre; it decodes the masks and returns the listener. The outputs
    /// are as long as the input and aligned with it.
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
    ) -> Result<[Vec<f32>; 2], SarhError> {
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
        let [left, right] = &self.ears;
        let rows = [&self.source, &self.masked, &self.mix, left, right].map(Rows::memory_bytes);
        let parts = [
            self.filter.as_ref().map_or(0, TimeFilter::memory_bytes),
            self.conv.as_ref().map_or(0, ConvLayers::memory_bytes),
            8 * self.spectra.len(),
        ];
        rows.iter().chain(&parts).sum()
    }

    /// Spectra, magnitudes and masked magnitudes of all frames, centred, the signal reflected at its ends.
    fn analyse(&mut self, mono: &[f32], masks: &Masks) {
        let (n, hop, bins) = (self.grid.n_fft, self.grid.hop, self.grid.bins());
        let (before, rest) = self.padded.split_at_mut(n / 2);
        let (middle, after) = rest.split_at_mut(mono.len());
        middle.copy_from_slice(mono);
        before.iter_mut().rev().zip(&mono[1..]).for_each(|(p, x)| *p = *x);
        after.iter_mut().zip(mono.iter().rev().skip(1)).for_each(|(p, x)| *p = *x);
        for (frame, spectrum) in self.spectra.chunks_exact_mut(bins).enumerate() {
            self.transform.analyse(&self.padded[frame * hop..][..n], spectrum);
            let source = self.source.row_mut(frame);
            self.transform.magnitudes(spectrum, source);
            let masked = self.masked.row_mut(frame).iter_mut().zip(source);
            masked.zip(&masks.mixture).for_each(|((s, x), m)| *s = *x * m);
        }
    }

    /// Magnitudes of both ears.
    fn mix_ears(&mut self, masks: &Masks) {
        let Self { frames, conv, masked, mix, ears, .. } = self;
        let Some(conv) = conv else {
            for frame in 0..*frames {
                for (ear, rows) in ears.iter_mut().enumerate() {
                    magnitudes_of_ear(ear, masked.row(frame), &masks.difference, mix.row(frame), rows.row_mut(frame));
                }
            }
            return;
        };
        conv.reset();
        for newest in 0..*frames + CONV_DELAY {
            let planes = |frame| Planes {
                mix: mix.row(frame),
                masked: masked.row(frame),
                mixture: &masks.mixture,
                difference: &masks.difference,
            };
            if conv.push((newest < *frames).then(|| planes(newest))) {
                let frame = newest - CONV_DELAY;
                for (ear, rows) in ears.iter_mut().enumerate() {
                    magnitudes_of_ear(ear, masked.row(frame), &masks.difference, conv.ear(ear), rows.row_mut(frame));
                }
            }
        }
    }

    fn synthesise(&mut self, ear: usize, out: &mut [f32]) {
        let (n, hop) = (self.grid.n_fft, self.grid.hop);
        self.sums.fill(0.0);
        for (frame, source) in self.spectra.chunks_exact(self.grid.bins()).enumerate() {
            let wanted = self.ears[ear].row(frame);
            self.transform.with_phase(wanted, source, self.source.row(frame), &mut self.spectrum);
            self.transform.synthesise(&mut self.spectrum, &mut self.sums[frame * hop..][..n]);
        }
        for ((o, s), scale) in out.iter_mut().zip(&self.sums[n / 2..]).zip(&self.scale) {
            *o = s * scale;
        }
    }
}

/// Samples of a second.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a sample rate, checked to be above 0")]
fn second(grid: &StftGrid) -> usize {
    grid.sample_rate_hz.round() as usize
}
