//! A time filter as a stream applies it.

use crate::published::frames::Frames;

/// What the newest frames of a few neighbouring bands add to a frame of a stream, and a bias, for one listener.
///
/// `mix[f](t) = bias[f] + sum over i, l of kernel[i][l][f] masked[f - i](t - l)`, with lags l in hops from minus the look-ahead
/// on.
#[derive(Clone, Debug)]
pub struct StreamTaps {
    pub(super) lookahead: usize,
    pub(super) causal: usize,
    pub(super) kernel: Kernel,
    pub(super) bias: Frames,
}

#[derive(Clone, Debug)]
pub(super) enum Kernel {
    /// One weight for all bands, `[neighbour][lag]` in one row.
    Shared(Frames),
    /// One value per band, rows `[neighbour][lag]`.
    Banded(Frames),
}

impl StreamTaps {
    /// Taps that let nothing through.
    pub(super) fn silent(bands: usize, neighbours: usize, lookahead: usize, causal: usize, banded: bool) -> Self {
        let taps = neighbours * (lookahead + causal);
        let kernel = if banded { Kernel::Banded(Frames::new(taps, bands)) } else { Kernel::Shared(Frames::new(1, taps)) };
        Self { lookahead, causal, kernel, bias: Frames::new(1, bands) }
    }

    /// Bands that the taps are for.
    #[must_use]
    pub fn bands(&self) -> usize {
        self.bias.len()
    }

    /// Hops of the future that the taps read.
    #[must_use]
    pub fn lookahead_hops(&self) -> usize {
        self.lookahead
    }

    /// Hops of the present and the past that the taps read.
    #[must_use]
    pub fn causal_hops(&self) -> usize {
        self.causal
    }

    /// Bias of each band, linear magnitude.
    #[must_use]
    pub fn bias(&self) -> &[f32] {
        self.bias.row(0)
    }

    /// What a band's own past adds at a lag in hops, summed over its neighbours as for a spectrum that changes slowly over
    /// frequency; 0 beyond the last tap.
    #[must_use]
    pub fn gain(&self, lag: usize, band: usize) -> f32 {
        let lags = self.lookahead + self.causal;
        if lag >= self.causal {
            return 0.0;
        }
        let taps = |count: usize| (self.lookahead + lag..count).step_by(lags);
        match &self.kernel {
            Kernel::Shared(kernel) => taps(kernel.row(0).len()).map(|tap| kernel.row(0)[tap]).sum(),
            Kernel::Banded(kernel) => taps(kernel.iter().count()).map(|tap| kernel.row(tap)[band]).sum(),
        }
    }

    /// Becomes `from + fraction (to - from)`; all three are of one [`TapProjector`](crate::published::TapProjector).
    ///
    /// # Real-time
    /// Audio thread; no allocation.
    pub fn blend(&mut self, from: &Self, to: &Self, fraction: f32) {
        match (&mut self.kernel, &from.kernel, &to.kernel) {
            (Kernel::Shared(out), Kernel::Shared(a), Kernel::Shared(b))
            | (Kernel::Banded(out), Kernel::Banded(a), Kernel::Banded(b)) => out.blend(a, b, fraction),
            _ => debug_assert!(false, "taps of different projectors"),
        }
        self.bias.blend(&from.bias, &to.bias, fraction);
    }

    /// Values of [`StreamTaps::write_to`].
    #[must_use]
    pub fn flat_len(&self) -> usize {
        self.rows().map(<[f32]>::len).sum()
    }

    /// Writes kernel and bias into a row; what has no room is left out.
    pub(crate) fn write_to(&self, row: &mut [f32]) {
        row.iter_mut().zip(self.rows().flatten()).for_each(|(to, from)| *to = *from);
    }

    /// Takes kernel and bias from a row that [`StreamTaps::write_to`] has written for taps of the same sizes.
    pub(crate) fn read_from(&mut self, row: &[f32]) {
        let mut rest = row.iter();
        let (Kernel::Shared(kernel) | Kernel::Banded(kernel)) = &mut self.kernel;
        for frames in [kernel, &mut self.bias] {
            for i in 0..frames.count() {
                frames.row_mut(i).iter_mut().zip(&mut rest).for_each(|(to, from)| *to = *from);
            }
        }
    }

    fn rows(&self) -> impl Iterator<Item = &[f32]> {
        let (Kernel::Shared(kernel) | Kernel::Banded(kernel)) = &self.kernel;
        kernel.iter().chain(self.bias.iter())
    }

    /// The filtered frame, one value per band; `masked` gives the row of magnitudes at a lag in hops, where there is one.
    #[inline(always)]
    pub(crate) fn apply<'a>(&self, masked: impl Fn(isize) -> Option<(&'a Frames, usize)>, mix: &mut [f32]) {
        mix.copy_from_slice(self.bias());
        let lags = self.lookahead + self.causal;
        let row = |tap: usize| masked((tap % lags).cast_signed() - self.lookahead.cast_signed());
        match &self.kernel {
            Kernel::Shared(kernel) => {
                for (tap, w) in kernel.row(0).iter().enumerate() {
                    if let Some((rows, row)) = row(tap) {
                        let x = rows.shifted(row, tap / lags);
                        mix.iter_mut().zip(x).for_each(|(m, x)| *m += w * x);
                    }
                }
            }
            Kernel::Banded(kernel) => {
                for (tap, w) in kernel.iter().enumerate() {
                    if let Some((rows, row)) = row(tap) {
                        let x = rows.shifted(row, tap / lags);
                        mix.iter_mut().zip(x).zip(w).for_each(|((m, x), w)| *m += w * x);
                    }
                }
            }
        }
    }
}
