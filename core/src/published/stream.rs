//! The published head hop by hop.

use crate::StftGrid;
use crate::network::CloudModel;
use crate::published::conv::{CONV_DELAY, ConvLayers, Planes};
use crate::published::error::PublishedError;
use crate::published::frames::Frames;
use crate::published::hann::HannFrames;
use crate::published::{Projection, StreamTaps};
use promenade_fourier::num_complex::Complex32;
use pulp::{Arch, Simd, WithSimd};

/// Input below this is silence: nothing after it is slowed down by subnormal numbers.
const SILENT: f32 = 1e-15;
/// Input above this, or not a number, counts as silence as well.
const LOUDEST: f32 = 1e15;
/// The loosest gate: infinity times silence would be no number.
const MAX_GAIN: f32 = 1e12;

/// How a stream uses the convolution layers, which look five hops ahead.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConvMode {
    /// Not at all: the time filter's output is added itself.
    Off,
    /// What the layers add comes five hops late; the masked magnitudes are not delayed.
    Causal,
    /// All is delayed by five hops: what a clip's frames would be.
    LookAhead,
}

impl ConvMode {
    /// The name used in files and on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::Causal => "causal",
            Self::LookAhead => "look-ahead",
        }
    }

    /// The mode of that name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        [Self::Off, Self::Causal, Self::LookAhead].into_iter().find(|m| m.name() == name)
    }
}

/// Settings of a [`PublishedStream`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PublishedOptions {
    /// Use of the convolution layers; a model without them is always [`ConvMode::Off`].
    pub conv: ConvMode,
    /// Hops of the future that the taps read, by which the stream is delayed.
    pub lookahead_hops: usize,
    /// Hops of the present and the past that are kept for the taps; longer taps are cut off.
    pub causal_hops: usize,
    /// The most by which the magnitude of a bin may exceed the source's, linear. The network's biases sound at the hop rate
    /// without any input; this keeps silence silent.
    pub max_gain: f32,
}

impl Default for PublishedOptions {
    fn default() -> Self {
        Self { conv: ConvMode::Causal, lookahead_hops: 0, causal_hops: 32, max_gain: 10.0 }
    }
}

impl PublishedOptions {
    /// How a scene streams a model with clips of `frames` frames, with `taps` hops of the past besides the present.
    #[must_use]
    pub fn streaming(conv: ConvMode, projection: Projection, frames: usize, taps: usize) -> Self {
        Self { conv, lookahead_hops: projection.lookahead_hops(frames), causal_hops: taps + 1, ..Self::default() }
    }

    /// Hops by which the frame given out is older than the newest.
    fn delay(&self) -> usize {
        let conv = if self.conv == ConvMode::LookAhead { CONV_DELAY } else { 0 };
        self.lookahead_hops + conv
    }

    /// Samples by which a stream with these options lags behind, where a hop of input is collected before its output sounds.
    #[must_use]
    pub fn latency_samples(&self, grid: &StftGrid) -> usize {
        grid.n_fft + self.delay() * grid.hop
    }
}

/// What a frame of a stream is rendered with.
#[derive(Clone, Copy, Debug)]
pub struct FrameMasks<'a> {
    /// Mixture mask, one value per bin, linear gain.
    pub mixture: &'a [f32],
    /// Difference mask in (-1, 1), one value per bin; positive = right louder.
    pub difference: &'a [f32],
    /// Time filter; without one its output is zero.
    pub taps: Option<&'a StreamTaps>,
}

/// Renders a mono stream hop by hop: the published transform, masks, time filter and convolution layers.
///
/// The window is a periodic Hann window in analysis and synthesis, and outputs are divided by the sum of its squares, which
/// repeats every hop. Frames before the stream's start are zero, as they are before a clip's.
///
/// # Real-time
/// The audio thread owns it; no method but `new` allocates, locks or waits.
pub struct PublishedStream {
    arch: Arch,
    grid: StftGrid,
    options: PublishedOptions,
    conv: Option<ConvLayers>,
    transform: HannFrames,
    /// The newest input, one frame, oldest first.
    input: Vec<f32>,
    history: History,
    mix: Vec<f32>,
    nothing: Vec<f32>,
    ears: Frames,
    spectrum: Vec<Complex32>,
    /// Overlap-add sums of both ears, oldest first.
    sums: [Vec<f32>; 2],
    /// One over the sum of squared windows at each sample of a hop.
    scale: Vec<f32>,
}

/// The newest frames, each in its slot of a ring.
struct History {
    slots: usize,
    newest: usize,
    /// Frames since the start, at most as many as there are slots.
    seen: usize,
    spectra: Vec<Complex32>,
    source: Frames,
    masked: Frames,
    mixture: Frames,
    difference: Frames,
}

impl PublishedStream {
    /// For the grid that the model was trained on.
    ///
    /// # Errors
    /// The grid has other bins than the model has bands, or is not usable.
    pub fn new(model: &CloudModel, grid: StftGrid, options: PublishedOptions) -> Result<Self, PublishedError> {
        Self::with_arch(model, grid, options, Arch::new())
    }

    /// A stream that computes with the given instruction set.
    ///
    /// # Errors
    /// The model has no published head, or the grid does not fit it ([`PublishedError`]).
    pub fn with_arch(
        model: &CloudModel,
        grid: StftGrid,
        options: PublishedOptions,
        arch: Arch,
    ) -> Result<Self, PublishedError> {
        let (bands, bins) = (model.sizes().bands, grid.bins());
        if bands != bins {
            return Err(PublishedError::Bands { bands, bins });
        }
        let transform = HannFrames::new(&grid, arch)?;
        let conv = if options.conv == ConvMode::Off { None } else { ConvLayers::new(model, bins, arch) };
        let conv_mode = if conv.is_some() { options.conv } else { ConvMode::Off };
        let max_gain = if options.max_gain.is_nan() { 0.0 } else { options.max_gain.clamp(0.0, MAX_GAIN) };
        let options = PublishedOptions { conv: conv_mode, max_gain, ..options };
        let window: Vec<f32> = transform.squared_window().collect();
        let scale = |i: usize| 1.0 / window.iter().skip(i).step_by(grid.hop).sum::<f32>();
        let slots = options.lookahead_hops + options.causal_hops.max(CONV_DELAY + 1);
        let rows = || Frames::new(slots, bins);
        Ok(Self {
            arch,
            grid,
            options,
            conv,
            transform,
            input: vec![0.0; grid.n_fft],
            history: History {
                slots,
                newest: 0,
                seen: 0,
                spectra: vec![Complex32::default(); slots * bins],
                source: rows(),
                masked: rows(),
                mixture: rows(),
                difference: rows(),
            },
            mix: vec![0.0; bins],
            nothing: vec![0.0; bins],
            ears: Frames::new(2, bins),
            spectrum: vec![Complex32::default(); bins],
            sums: [vec![0.0; grid.n_fft], vec![0.0; grid.n_fft]],
            scale: (0..grid.hop).map(scale).collect(),
        })
    }

    /// The grid that the model was trained on.
    pub(crate) fn grid(&self) -> &StftGrid {
        &self.grid
    }

    /// Samples by which a stream lags behind, where a hop of input is collected before its output sounds. What one call gives
    /// out lags a hop less behind what it is given.
    #[must_use]
    pub fn latency_samples(&self) -> usize {
        self.options.latency_samples(&self.grid)
    }

    /// Magnitudes of an ear, left 0 or right 1, of the newest frame given out, one value per bin.
    #[must_use]
    pub fn magnitudes(&self, ear: usize) -> &[f32] {
        self.ears.row(ear.min(1))
    }

    /// Takes a hop of input and gives out a hop of each ear, left and right. The masks are those of the newest frame, the taps
    /// those of the frame [`PublishedOptions::lookahead_hops`] before it.
    ///
    /// # Real-time
    /// Audio thread; no allocation.
    pub fn hop(&mut self, input: &[f32], frame: FrameMasks<'_>, out: [&mut [f32]; 2]) {
        debug_assert!(input.len() == self.grid.hop && out.iter().all(|o| o.len() == self.grid.hop));
        debug_assert!(frame.mixture.len() == self.mix.len() && frame.difference.len() == self.mix.len());
        self.take(input, &frame);
        let filtered = self.options.lookahead_hops;
        let started = self.history.seen > filtered;
        self.filter(frame.taps);
        let (arch, history) = (self.arch, &self.history);
        let inside = self.conv.as_mut().is_none_or(|conv| conv.push(started.then(|| history.planes(filtered, &self.mix))));
        let base = history.slot(self.options.delay());
        for (ear, sums) in self.sums.iter_mut().enumerate() {
            let added = match &self.conv {
                None => &self.mix,
                Some(conv) if inside => conv.ear(ear),
                // Nothing yet of the frames before the start.
                Some(_) => &self.nothing,
            };
            let (max_gain, out) = (self.options.max_gain, self.ears.row_mut(ear));
            arch.dispatch(Gated { ear, history, slot: base, added, max_gain, out });
            let (magnitudes, source) = (self.ears.row(ear), history.source.row(base));
            if magnitudes.iter().any(|m| *m > 0.0) {
                self.transform.with_phase(magnitudes, history.spectrum(base), source, &mut self.spectrum);
                self.transform.synthesise(&mut self.spectrum, sums);
            }
        }
        for (sums, out) in self.sums.iter_mut().zip(out) {
            for ((o, s), scale) in out.iter_mut().zip(&*sums).zip(&self.scale) {
                *o = s * scale;
            }
            sums.copy_within(self.grid.hop.., 0);
            let kept = sums.len() - self.grid.hop;
            sums[kept..].fill(0.0);
        }
    }

    /// Forgets the stream so far.
    ///
    /// # Real-time
    /// Audio thread; no allocation.
    pub fn reset(&mut self) {
        self.input.fill(0.0);
        self.sums.iter_mut().for_each(|s| s.fill(0.0));
        self.ears.clear();
        if let Some(conv) = &mut self.conv {
            conv.reset();
        }
        let h = &mut self.history;
        (h.newest, h.seen) = (0, 0);
        h.spectra.fill(Complex32::default());
        [&mut h.source, &mut h.masked, &mut h.mixture, &mut h.difference].into_iter().for_each(Frames::clear);
    }

    /// Bytes in memory.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let h = &self.history;
        let rows: usize = [&h.source, &h.masked, &h.mixture, &h.difference].map(Frames::memory_bytes).iter().sum();
        rows + 8 * h.spectra.len() + self.conv.as_ref().map_or(0, ConvLayers::memory_bytes)
    }

    /// Analyses the newest frame.
    fn take(&mut self, input: &[f32], frame: &FrameMasks<'_>) {
        let hop = self.grid.hop;
        self.input.copy_within(hop.., 0);
        let kept = self.input.len() - hop;
        for (kept, x) in self.input[kept..].iter_mut().zip(input) {
            *kept = if (SILENT..=LOUDEST).contains(&x.abs()) { *x } else { 0.0 };
        }
        let history = &mut self.history;
        history.newest = (history.newest + 1) % history.slots;
        history.seen = (history.seen + 1).min(history.slots);
        let (slot, bins) = (history.newest, self.mix.len());
        let spectrum = &mut history.spectra[slot * bins..][..bins];
        self.transform.analyse(&self.input, spectrum);
        self.transform.magnitudes(spectrum, history.source.row_mut(slot));
        history.mixture.row_mut(slot).copy_from_slice(&frame.mixture[..bins]);
        history.difference.row_mut(slot).copy_from_slice(&frame.difference[..bins]);
        let masked = history.masked.row_mut(slot).iter_mut().zip(history.source.row(slot));
        masked.zip(frame.mixture).for_each(|((s, x), m)| *s = x * m);
    }

    /// Filters the frame that the look-ahead allows.
    fn filter(&mut self, taps: Option<&StreamTaps>) {
        match taps {
            None => self.mix.fill(0.0),
            Some(taps) => {
                debug_assert!(taps.bands() == self.mix.len() && taps.lookahead_hops() == self.options.lookahead_hops);
                let lookahead = self.options.lookahead_hops;
                self.arch.dispatch(Filtered { taps, history: &self.history, lookahead, mix: &mut self.mix });
            }
        }
    }
}

impl History {
    /// Slot of the frame that many hops before the newest.
    fn slot(&self, behind: usize) -> usize {
        (self.newest + self.slots - behind) % self.slots
    }

    fn spectrum(&self, slot: usize) -> &[Complex32] {
        let bins = self.source.len();
        &self.spectra[slot * bins..][..bins]
    }

    fn planes<'a>(&'a self, behind: usize, mix: &'a [f32]) -> Planes<'a> {
        let slot = self.slot(behind);
        let (masked, mixture, difference) = (self.masked.row(slot), self.mixture.row(slot), self.difference.row(slot));
        Planes { mix, masked, mixture, difference }
    }
}

struct Filtered<'a> {
    taps: &'a StreamTaps,
    history: &'a History,
    lookahead: usize,
    mix: &'a mut [f32],
}

impl WithSimd for Filtered<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let Self { taps, history, lookahead, mix } = self;
        taps.apply(
            |lag| {
                let behind = lookahead.checked_add_signed(lag).filter(|behind| *behind < history.slots)?;
                Some((&history.masked, history.slot(behind)))
            },
            mix,
        );
    }
}

struct Gated<'a> {
    ear: usize,
    history: &'a History,
    slot: usize,
    added: &'a [f32],
    max_gain: f32,
    out: &'a mut [f32],
}

impl WithSimd for Gated<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let (masked, difference) = (self.history.masked.row(self.slot), self.history.difference.row(self.slot));
        magnitudes_of_ear(self.ear, masked, difference, self.added, self.out);
        for (m, x) in self.out.iter_mut().zip(self.history.source.row(self.slot)) {
            *m = m.min(self.max_gain * x);
        }
    }
}

/// `ReLU(added + (1 + sign difference) masked)`; the sign is -1 on the left, ear 0, and 1 on the right.
#[inline(always)]
pub(crate) fn magnitudes_of_ear(ear: usize, masked: &[f32], difference: &[f32], added: &[f32], out: &mut [f32]) {
    let sign = if ear == 0 { -1.0 } else { 1.0 };
    for (((o, s), d), a) in out.iter_mut().zip(masked).zip(difference).zip(added) {
        *o = (a + (1.0 + sign * d) * s).max(0.0);
    }
}
