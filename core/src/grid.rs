//! The short-time Fourier grid of a scene, and its equivalent at another sample rate.

use crate::number::whole;

/// A frame's filters may reach back before their input by a hop over this.
const LEADS_A_HOP: usize = 4;

/// How far before its time a tap begins, hops: what arrives `t` hops after the direct sound is played by hop
/// `t + TAP_LEAD_HOPS`, rounded down.
pub const TAP_LEAD_HOPS: f64 = 1.0 / LEADS_A_HOP as f64;

/// The longest latency that the dry sound can be aligned to, seconds; scenes with longer windows are refused when read.
pub(crate) const LONGEST_LATENCY_S: f64 = 0.2;

/// Sample rate, transform length and hop of a short-time Fourier transform.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StftGrid {
    /// Sample rate, Hz.
    pub sample_rate_hz: f64,
    /// Transform and window length, samples; even.
    pub n_fft: usize,
    /// Samples from frame to frame, at most half of `n_fft`.
    pub hop: usize,
}

impl StftGrid {
    /// Number of bins of the one-sided spectrum, from 0 Hz to the Nyquist frequency.
    #[must_use]
    pub fn bins(&self) -> usize {
        self.n_fft / 2 + 1
    }

    /// Seconds from frame to frame.
    #[must_use]
    pub fn hop_s(&self) -> f64 {
        self.hop as f64 / self.sample_rate_hz
    }

    /// Samples that a frame's filters may reach back before their input, and that a tap begins before its time: a quarter of a
    /// hop.
    #[must_use]
    pub fn lead(&self) -> usize {
        self.hop / LEADS_A_HOP
    }

    /// Centre frequency of a bin, Hz.
    #[must_use]
    pub fn bin_hz(&self, bin: usize) -> f64 {
        bin as f64 * self.sample_rate_hz / self.n_fft as f64
    }

    /// The grid of four hops a frame at a rate whose hop lies nearest to a wanted one, samples, and whose transform is
    /// efficient.
    #[must_use]
    pub fn four_hops(sample_rate_hz: f64, hop_samples: f64) -> Self {
        let hop = efficient_unit(hop_samples, 4);
        Self { sample_rate_hz, n_fft: 4 * hop, hop }
    }

    /// The grid of nearly the same duration at another rate whose transform length has no prime factor above 11.
    ///
    /// The overlap `n_fft / hop` is kept where it is a whole number. Durations differ by less than 1 % at rates of 8 kHz and
    /// more; at the grid's own rate the answer is the grid itself.
    #[must_use]
    pub fn at_rate(&self, sample_rate_hz: f64) -> Self {
        if (sample_rate_hz - self.sample_rate_hz).abs() < 1e-6 {
            return *self;
        }
        let ratio = sample_rate_hz / self.sample_rate_hz;
        let (unit, per_hop) =
            if self.n_fft.is_multiple_of(self.hop) { (self.hop, self.n_fft / self.hop) } else { (self.n_fft, 1) };
        let found = efficient_unit(unit as f64 * ratio, per_hop);
        let n_fft = found * per_hop;
        let hop = if per_hop > 1 { found } else { whole((self.hop as f64 * ratio).round().max(1.0)) };
        Self { sample_rate_hz, n_fft, hop: hop.min(n_fft / 2) }
    }
}

/// The length nearest to `ideal` of which `count` make an even transform length with fast kernels, within about 1 %; if there
/// is none, the nearest even length.
fn efficient_unit(ideal: f64, count: usize) -> usize {
    let efficient = |u: usize| is_smooth(u * count) && (u * count).is_multiple_of(2);
    let nearest = whole(ideal.round().max(2.0));
    let reach = 2 + whole(ideal * 0.01);
    (0..=reach)
        .flat_map(|d| [nearest + d, nearest.saturating_sub(d)])
        .find(|&u| u >= 2 && efficient(u))
        .unwrap_or(nearest + nearest % 2)
}

/// Whether no prime factor exceeds 11, the largest radix that the FFT has a fast kernel for.
fn is_smooth(mut n: usize) -> bool {
    for p in [2, 3, 5, 7, 11] {
        while n > 0 && n.is_multiple_of(p) {
            n /= p;
        }
    }
    n == 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeps_duration_and_overlap_at_usual_rates() {
        let scene = StftGrid { sample_rate_hz: 16_000.0, n_fft: 320, hop: 80 };
        for rate in [8_000.0, 11_025.0, 16_000.0, 22_050.0, 44_100.0, 48_000.0, 88_200.0, 96_000.0, 176_400.0, 192_000.0] {
            let g = scene.at_rate(rate);
            assert_eq!(g.n_fft, 4 * g.hop);
            assert!(is_smooth(g.n_fft) && g.n_fft.is_multiple_of(2));
            assert!((g.hop_s() / scene.hop_s() - 1.0).abs() < 0.02, "{rate}: {g:?}");
        }
        assert_eq!(scene.at_rate(48_000.0).n_fft, 960);
    }

    #[test]
    fn a_hop_that_does_not_divide_keeps_its_proportion() {
        let published = StftGrid { sample_rate_hz: 22_050.0, n_fft: 512, hop: 127 };
        assert_eq!(published.at_rate(22_050.0), published);
        let g = published.at_rate(44_100.0);
        assert_eq!((g.n_fft, g.hop), (1024, 254));
    }
}
