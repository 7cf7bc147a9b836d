//! Third-order Ambisonics: directions in, both ears out.

use crate::number::{single, whole};
use crate::render::lanes::{Accumulate, Block, EarBlocks, LANES, blocks_for, write_slot};
use crate::scene::{AMBISONIC_CHANNELS, AmbisonicHead};
use crate::stft::Spectrum;
use glam::Vec3;
use promenade_fourier::num_complex::{Complex32, Complex64};
use promenade_fourier::{ComplexToReal, RealToComplex};
use pulp::Arch;
use std::f64::consts::TAU;
use std::sync::Arc;

/// A value of each channel.
pub(crate) type Channels = [f32; AMBISONIC_CHANNELS];

/// [`crate::head::harmonics`] of third order, written out for the audio thread, which has no memory to give away: of a direction of unit
/// length (forward, left, up). Their squares sum to 16.
#[inline(always)]
pub(crate) fn harmonics(direction: Vec3) -> Channels {
    let Vec3 { x, y, z } = direction;
    let (xx, yy, zz) = (x * x, y * y, z * z);
    let root = |square: f32| square.sqrt();
    [
        1.0,
        root(3.0) * y,
        root(3.0) * z,
        root(3.0) * x,
        root(15.0) * x * y,
        root(15.0) * y * z,
        root(1.25) * (3.0 * zz - 1.0),
        root(15.0) * x * z,
        root(3.75) * (xx - yy),
        root(4.375) * y * (3.0 * xx - yy),
        root(105.0) * x * y * z,
        root(2.625) * y * (5.0 * zz - 1.0),
        root(1.75) * z * (5.0 * zz - 3.0),
        root(2.625) * x * (5.0 * zz - 1.0),
        root(26.25) * z * (xx - yy),
        root(4.375) * x * (xx - 3.0 * yy),
    ]
}

/// Spectra of a head's filters for hops of a host.
pub(crate) struct HeadSpectra {
    hop: usize,
    n_fft: usize,
    /// `[block][channel]`, divided by the transform length, which the inverse leaves in.
    filters: Vec<EarBlocks>,
    /// Samples of the host before the sound is at the head's centre.
    pub(crate) lead: f64,
}

impl HeadSpectra {
    /// For a host's rate and hop.
    pub(crate) fn new(head: &AmbisonicHead, sample_rate_hz: f64, hop: usize) -> Self {
        let ratio = sample_rate_hz / head.sample_rate_hz;
        // Some samples more for the ripple of a change of rate.
        let ripple = if ratio == 1.0 { 0 } else { 16 };
        let n_fft = (hop + whole((head.len() as f64 * ratio).ceil()) + ripple).next_multiple_of(32);
        let bins = n_fft / 2 + 1;
        let mut filters = vec![EarBlocks::default(); blocks_for(bins) * AMBISONIC_CHANNELS];
        for k in 0..bins {
            let hz = k as f64 * sample_rate_hz / n_fft as f64;
            if hz > 0.5 * head.sample_rate_hz {
                break;
            }
            let step = Complex64::cis(-TAU * hz / head.sample_rate_hz);
            for (channel, ears) in head.filters.chunks_exact(2 * head.len()).enumerate() {
                for (ear, samples) in ears.chunks_exact(head.len()).enumerate() {
                    // Horner's rule, from the last sample on.
                    let sum = samples.iter().rev().fold(Complex64::default(), |sum, x| sum * step + f64::from(*x));
                    let block = &mut filters[k / LANES * AMBISONIC_CHANNELS + channel].ears[ear];
                    block.re[k % LANES] = single(sum.re / n_fft as f64);
                    block.im[k % LANES] = single(sum.im / n_fft as f64);
                }
            }
        }
        Self { hop, n_fft, filters, lead: head.lead as f64 * ratio }
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(&*self.filters)
    }
}

/// Fast convolution of Ambisonic channels with a head, by overlap-save, hop by hop.
pub(crate) struct HeadConvolver {
    arch: Arch,
    head: Arc<HeadSpectra>,
    /// The newest samples of each channel, `[channel][n_fft]`.
    past: Vec<f32>,
    frame: Vec<f32>,
    spectrum: Spectrum,
    /// `[block][channel]`
    spectra: Vec<Block>,
    sums: Vec<EarBlocks>,
    slots: [usize; AMBISONIC_CHANNELS],
    scratch: Vec<Complex32>,
    forward: Arc<dyn RealToComplex<f32>>,
    inverse: Arc<dyn ComplexToReal<f32>>,
}

impl HeadConvolver {
    pub(crate) fn new(head: Arc<HeadSpectra>) -> Self {
        let n = head.n_fft;
        let (forward, inverse) = (promenade_fourier::forward(n), promenade_fourier::inverse(n));
        let (bins, blocks) = (n / 2 + 1, blocks_for(n / 2 + 1));
        Self {
            arch: Arch::new(),
            past: vec![0.0; AMBISONIC_CHANNELS * n],
            frame: vec![0.0; n],
            spectrum: vec![Complex32::default(); bins],
            spectra: vec![Block::default(); blocks * AMBISONIC_CHANNELS],
            sums: vec![EarBlocks::default(); blocks],
            slots: std::array::from_fn(|channel| channel),
            scratch: vec![Complex32::default(); forward.get_scratch_len().max(inverse.get_scratch_len())],
            forward,
            inverse,
            head,
        }
    }

    /// Takes a hop of all channels, which `read` writes one by one, and adds what the ears hear of it.
    pub(crate) fn add(&mut self, read: impl Fn(usize, &mut [f32]), ears: &mut [Vec<f32>; 2]) {
        let HeadSpectra { n_fft, hop: len, filters, .. } = &*self.head;
        for (channel, past) in self.past.chunks_exact_mut(*n_fft).enumerate() {
            past.copy_within(*len.., 0);
            read(channel, &mut past[n_fft - len..]);
            self.frame.copy_from_slice(past);
            // The lengths are fixed at construction, so the only error the transform knows cannot occur.
            let done = self.forward.process_with_scratch(&mut self.frame, &mut self.spectrum, &mut self.scratch);
            debug_assert!(done.is_ok());
            write_slot(&mut self.spectra, AMBISONIC_CHANNELS, channel, &self.spectrum);
        }
        self.sums.fill(EarBlocks::default());
        let Self { arch, slots, spectra, sums, .. } = self;
        Accumulate { arch: *arch, slots, ring_len: AMBISONIC_CHANNELS, ring: spectra, filter: filters, sums }.run();
        for (ear, out) in ears.iter_mut().enumerate() {
            for (bins, block) in self.spectrum.chunks_mut(LANES).zip(&self.sums) {
                let sum = &block.ears[ear];
                bins.iter_mut().zip(sum.re.iter().zip(&sum.im)).for_each(|(bin, (re, im))| *bin = Complex32::new(*re, *im));
            }
            // A real signal's end bins are real; the inverse transform insists on it.
            self.spectrum[0].im = 0.0;
            self.spectrum[n_fft / 2].im = 0.0;
            let done = self.inverse.process_with_scratch(&mut self.spectrum, &mut self.frame, &mut self.scratch);
            debug_assert!(done.is_ok());
            out.iter_mut().zip(&self.frame[n_fft - len..]).for_each(|(o, x)| *o += x);
        }
    }

    /// Samples that sound on after the input has ended.
    pub(crate) fn tail(&self) -> usize {
        self.head.n_fft
    }

    pub(crate) fn reset(&mut self) {
        self.past.fill(0.0);
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(&*self.past)
            + size_of_val(&*self.frame)
            + size_of_val(&*self.spectrum)
            + size_of_val(&*self.spectra)
            + size_of_val(&*self.sums)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn harmonics_written_out_are_those_of_any_order() {
        for (x, y, z) in [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0), (0.3, -0.5, 0.8), (-0.7, -0.2, -0.4)] {
            let direction = Vec3::new(x, y, z).normalize();
            let any = crate::head::harmonics(3, direction);
            assert_eq!(any.len(), AMBISONIC_CHANNELS);
            for (channel, (found, want)) in harmonics(direction).iter().zip(any).enumerate() {
                assert!((found - want).abs() < 1e-5, "{direction} {channel}: {found}, {want}");
            }
        }
    }

    #[test]
    fn a_head_of_one_channel_is_a_plain_convolution_at_its_own_rate() {
        let length = 40;
        let mut filters = vec![0.0; 2 * AMBISONIC_CHANNELS * length];
        let taps = promenade_testing::noise(3, 2 * length);
        filters[4 * length..6 * length].copy_from_slice(&taps);
        let head = AmbisonicHead { sample_rate_hz: 48_000.0, lead: 5, filters };
        let hop = 50;
        let mut convolver = HeadConvolver::new(Arc::new(HeadSpectra::new(&head, 48_000.0, hop)));
        let x = promenade_testing::noise(4, 4 * hop);
        let mut ears = [Vec::new(), Vec::new()];
        for part in x.chunks(hop) {
            let mut out = [vec![0.0; hop], vec![0.0; hop]];
            let read =
                |c: usize, out: &mut [f32]| out.iter_mut().zip(part).for_each(|(o, x)| *o = if c == 2 { *x } else { 0.0 });
            convolver.add(read, &mut out);
            ears.iter_mut().zip(out).for_each(|(ear, out)| ear.extend(out));
        }
        for (ear, taps) in ears.iter().zip(taps.chunks(length)) {
            for n in 0..x.len() {
                let want: f32 = (0..length.min(n + 1)).map(|i| taps[i] * x[n - i]).sum();
                assert!((ear[n] - want).abs() < 1e-4, "{n}: {} {want}", ear[n]);
            }
        }
    }
}
