//! Spectra in blocks of as many bins as the widest vector has lanes.

use crate::simd::LANES;
use promenade_fourier::num_complex::Complex32;

/// One block of complex bins: real parts, then imaginary parts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(64))]
pub(crate) struct Block {
    pub(crate) re: [f32; LANES],
    pub(crate) im: [f32; LANES],
}

/// A filter's block for both ears.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(64))]
pub(crate) struct EarBlocks {
    pub(crate) ears: [Block; 2],
}

/// Blocks that hold `bins` bins.
pub(crate) fn blocks_for(bins: usize) -> usize {
    bins.div_ceil(LANES)
}

/// Reads an ear's spectrum, as many bins as there is room for, whose end bins are a real signal's: the inverse transform
/// insists on it.
pub(crate) fn ear_spectrum(blocks: &[EarBlocks], ear: usize, bins: &mut [Complex32]) {
    for (bins, block) in bins.chunks_mut(LANES).zip(blocks) {
        let block = &block.ears[ear];
        for (i, bin) in bins.iter_mut().enumerate() {
            *bin = Complex32::new(block.re[i], block.im[i]);
        }
    }
    if let [first, .., last] = bins {
        (first.im, last.im) = (0.0, 0.0);
    }
}
