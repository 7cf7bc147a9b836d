//! Third-order Ambisonics: directions in, both ears out.

use crate::head::channels;
use crate::number::{single, whole};
use crate::scene::{AMBISONIC_CHANNELS, AmbisonicHead};
use glam::Vec3;
use promenade_fourier::Fft;
use promenade_fourier::num_complex::{Complex32, Complex64};
use pulp::{Arch, Simd, WithSimd};
use std::sync::Arc;

/// A value of each channel.
pub(crate) type Channels = [f32; AMBISONIC_CHANNELS];

/// [`crate::head::harmonics`] of third order, written out for the audio thread, which has no memory to give away: of a
/// direction of unit length (forward, left, up). Their squares sum to 16.
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
    /// Channels are transformed two at a time, as real and imaginary part; those beyond the head's order are left out.
    pairs: usize,
    n_fft: usize,
    /// `[pair][ear][n_fft]`: channels a and b sound at an ear as the real part of `(a + ib) * (filter of a - i filter of b)`.
    /// Divided by twice the transform length, which the inverse and both halves of a real part leave in.
    filters: Vec<Complex32>,
    /// Samples of the host before the sound is at the head's centre.
    pub(crate) lead: f64,
}

impl HeadSpectra {
    /// For a host's rate and hop.
    pub(crate) fn new(head: &AmbisonicHead, sample_rate_hz: f64, hop: usize) -> Self {
        let ratio = sample_rate_hz / head.sample_rate_hz;
        // Some samples more for the ripple of a change of rate.
        let ripple = if ratio == 1.0 { 0 } else { 16 };
        let n_fft = (hop + whole((head.len() as f64 * ratio).ceil()) + ripple).next_multiple_of(64);
        let pairs = channels(head.order()).div_ceil(2);
        let mut filters = vec![Complex32::default(); 2 * pairs * n_fft];
        for k in 0..=n_fft / 2 {
            let hz = k as f64 * sample_rate_hz / n_fft as f64;
            if hz > 0.5 * head.sample_rate_hz {
                break;
            }
            for (pair, [a, b]) in head.at(hz).as_chunks().0.iter().take(pairs).enumerate() {
                for (ear, (a, b)) in a.iter().zip(b).enumerate() {
                    let mirrored = (n_fft - k) % n_fft;
                    let spectrum = &mut filters[(2 * pair + ear) * n_fft..][..n_fft];
                    for (k, factor) in [(mirrored, a.conj() - Complex64::i() * b.conj()), (k, a - Complex64::i() * b)] {
                        let factor = factor / (2 * n_fft) as f64;
                        spectrum[k] = Complex32::new(single(factor.re), single(factor.im));
                    }
                }
            }
        }
        Self { hop, pairs, n_fft, filters, lead: head.lead as f64 * ratio }
    }

    /// Pairs of channels that are heard.
    pub(crate) fn pairs(&self) -> usize {
        self.pairs
    }

    /// Samples of a hop.
    pub(crate) fn hop(&self) -> usize {
        self.hop
    }

    /// Samples that sound on after the input has ended.
    pub(crate) fn tail(&self) -> usize {
        self.n_fft
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(&*self.filters)
    }
}

/// Fast convolution of Ambisonic channels with a head, by overlap-add, hop by hop.
pub(crate) struct HeadConvolver {
    arch: Arch,
    head: Arc<HeadSpectra>,
    /// A hop of a pair of channels, and silence.
    frame: Vec<Complex32>,
    spectrum: Vec<Complex32>,
    sums: [Vec<Complex32>; 2],
    /// What each ear still hears of earlier hops.
    tails: [Vec<f32>; 2],
    /// Level of the difference between the ears.
    width: f32,
    scratch: Vec<Complex32>,
    forward: Arc<dyn Fft<f32>>,
    inverse: Arc<dyn Fft<f32>>,
}

impl HeadConvolver {
    pub(crate) fn new(head: Arc<HeadSpectra>) -> Self {
        let n = head.n_fft;
        let [forward, inverse] = promenade_fourier::complex(n);
        let scratch = forward.get_immutable_scratch_len().max(inverse.get_inplace_scratch_len());
        Self {
            arch: Arch::new(),
            frame: vec![Complex32::default(); n],
            spectrum: vec![Complex32::default(); n],
            sums: [vec![Complex32::default(); n], vec![Complex32::default(); n]],
            tails: [vec![0.0; n], vec![0.0; n]],
            width: 1.0,
            scratch: vec![Complex32::default(); scratch],
            forward,
            inverse,
            head,
        }
    }

    /// Takes a hop of all channels, which `read` writes two by two, and adds what the ears hear of it while the level of the
    /// difference between them goes to `width`.
    pub(crate) fn add(&mut self, read: impl Fn(usize, &mut [Complex32]), width: f32, ears: &mut [Vec<f32>; 2]) {
        let HeadSpectra { n_fft, hop, filters, .. } = &*self.head;
        self.sums.iter_mut().for_each(|sums| sums.fill(Complex32::default()));
        for (pair, filters) in filters.chunks_exact(2 * n_fft).enumerate() {
            read(pair, &mut self.frame[..*hop]);
            self.forward.process_immutable_with_scratch(&self.frame, &mut self.spectrum, &mut self.scratch);
            for (filter, sums) in filters.chunks_exact(*n_fft).zip(&mut self.sums) {
                self.arch.dispatch(MultiplyAdd { spectrum: &self.spectrum, filter, sums });
            }
        }
        join(&self.sums, &mut self.spectrum);
        self.inverse.process_with_scratch(&mut self.spectrum, &mut self.scratch);
        let [left, right] = &mut self.tails;
        for ((left, right), x) in left.iter_mut().zip(right).zip(&self.spectrum) {
            *left += x.re;
            *right += x.im;
        }
        let (from, change) = (self.width, (width - self.width) / *hop as f32);
        self.width = width;
        for (ear, out) in ears.iter_mut().enumerate() {
            let pair = self.tails[ear].iter().zip(&self.tails[1 - ear]);
            for (n, (out, (own, other))) in out.iter_mut().zip(pair).take(*hop).enumerate() {
                let width = if change == 0.0 { width } else { from + change * (n + 1) as f32 };
                *out += (0.5 + 0.5 * width) * own + (0.5 - 0.5 * width) * other;
            }
        }
        for tail in &mut self.tails {
            tail.copy_within(*hop.., 0);
            tail[n_fft - hop..].fill(0.0);
        }
    }

    pub(crate) fn reset(&mut self) {
        self.tails.iter_mut().for_each(|tail| tail.fill(0.0));
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(&*self.frame)
            + size_of_val(&*self.spectrum)
            + self.sums.iter().map(|sums| size_of_val(&**sums)).sum::<usize>()
            + self.tails.iter().map(|tail| size_of_val(&**tail)).sum::<usize>()
    }
}

/// Makes of both ears' spectra, of which the real parts are heard, twice that of the left ear as real and the right ear as
/// imaginary part.
fn join([left, right]: &[Vec<Complex32>; 2], out: &mut [Complex32]) {
    let n = out.len();
    for (k, out) in out.iter_mut().enumerate() {
        let mirrored = if k == 0 { 0 } else { n - k };
        let [l, r] = [left, right].map(|ear| ear[k] + ear[mirrored].conj());
        *out = Complex32::new(l.re - r.im, l.im + r.re);
    }
}

/// `sums += spectrum * filter`, bin by bin; as many as whole vectors hold.
struct MultiplyAdd<'a> {
    spectrum: &'a [Complex32],
    filter: &'a [Complex32],
    sums: &'a mut [Complex32],
}

impl WithSimd for MultiplyAdd<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (x, h) = (S::as_simd_c32s(self.spectrum).0, S::as_simd_c32s(self.filter).0);
        for ((sum, x), h) in S::as_mut_simd_c32s(self.sums).0.iter_mut().zip(x).zip(h) {
            *sum = simd.mul_add_e_c32s(*x, *h, *sum);
        }
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
    fn a_head_of_two_channels_is_a_plain_convolution_at_its_own_rate() {
        let length = 40;
        let mut filters = vec![0.0; 2 * AMBISONIC_CHANNELS * length];
        let taps = promenade_testing::noise(3, 4 * length);
        filters[4 * length..8 * length].copy_from_slice(&taps);
        let head = AmbisonicHead { sample_rate_hz: 48_000.0, lead: 5, filters };
        let hop = 50;
        let mut convolver = HeadConvolver::new(Arc::new(HeadSpectra::new(&head, 48_000.0, hop)));
        let x = promenade_testing::noise(4, 4 * hop);
        let mut ears = [Vec::new(), Vec::new()];
        for part in x.chunks(hop) {
            let mut out = [vec![0.0; hop], vec![0.0; hop]];
            let read = |pair: usize, out: &mut [Complex32]| {
                for (o, x) in out.iter_mut().zip(part) {
                    *o = if pair == 1 { Complex32::new(*x, -2.0 * x) } else { Complex32::default() };
                }
            };
            convolver.add(read, 1.0, &mut out);
            ears.iter_mut().zip(out).for_each(|(ear, out)| ear.extend(out));
        }
        let (second, third) = taps.split_at(2 * length);
        for ((ear, a), b) in ears.iter().zip(second.chunks(length)).zip(third.chunks(length)) {
            for n in 0..x.len() {
                let want: f32 = (0..length.min(n + 1)).map(|i| (a[i] - 2.0 * b[i]) * x[n - i]).sum();
                assert!((ear[n] - want).abs() < 1e-4, "{n}: {} {want}", ear[n]);
            }
        }
    }
}
