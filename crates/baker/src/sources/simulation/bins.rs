//! The transform that images are filtered in.

use promenade_fourier::minimum_phase_log;
use promenade_fourier::num_complex::Complex32;

/// Oversampling of the frequencies, against the cepstrum's folding onto itself.
const OVERSAMPLING: usize = 8;
/// Amplitude that stands for 0, whose logarithm would be infinite.
const LEAST_AMPLITUDE: f64 = 1e-5;

/// Bins of a transform of `n_fft` samples, from 0 to half the sample rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bins {
    pub(crate) n_fft: usize,
    pub(crate) sample_rate_hz: f64,
}

impl Bins {
    /// How many there are.
    pub(crate) fn count(&self) -> usize {
        self.n_fft / 2 + 1
    }

    /// Frequency of a bin, hertz.
    pub(crate) fn hz(&self, bin: usize) -> f64 {
        bin as f64 * self.sample_rate_hz / self.n_fft as f64
    }

    /// The complex logarithm, by bin, of the minimum-phase filter with this amplitude by frequency in hertz.
    pub(super) fn minimum_phase(&self, amplitude: impl Fn(f64) -> f64) -> Vec<Complex32> {
        let fine = Self { n_fft: OVERSAMPLING * self.n_fft, ..*self };
        let log = |k: usize| amplitude(fine.hz(k)).max(LEAST_AMPLITUDE).ln();
        let logs = minimum_phase_log((0..fine.count()).map(log), fine.n_fft);
        logs.iter().step_by(OVERSAMPLING).map(|c| Complex32::new(c.re as f32, c.im as f32)).collect()
    }
}
