//! What one listener pose does to the source.

/// Effect of one listener pose on the source, on a scene's grid and bands.
///
/// Left gain is `(1 - difference) * mixture`, right gain `(1 + difference) * mixture`, so a positive difference is louder on the right.
#[derive(Clone, Debug, PartialEq)]
pub struct TransferFunction {
    /// Mixture mask m_m of the direct sound per bin, linear gain, at least 0.
    pub mixture: Vec<f32>,
    /// Difference mask m_d of the direct sound per bin, in [-1, 1].
    pub difference: Vec<f32>,
    /// Phase of the direct sound besides its delay: `[ear][bin]`, radians, unwrapped, ear 0 = left.
    pub phase: Vec<f32>,
    /// Interaural delay of the direct sound, seconds; positive = left ear later.
    pub delay_s: f32,
    /// Time-filter gains, linear amplitude: `[tap][ear][band]`, tap 0 lying one hop after the direct sound, ear 0 = left.
    pub taps: Vec<f32>,
    /// Gain of the exponential late part at its first hop, linear amplitude: `[ear][band]`.
    pub late: Vec<f32>,
}

/// Sizes that a scene's transfer functions share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TransferShape {
    /// Bins of the scene's grid.
    pub bins: usize,
    /// Bands of the time filters.
    pub bands: usize,
    /// Explicit time-filter taps, one per hop after the direct sound.
    pub taps: usize,
}

impl TransferShape {
    /// Values of one transfer function in a row: mixture, difference, phase, delay, taps, late.
    #[must_use]
    pub fn row_len(&self) -> usize {
        self.direct_len() + self.tap_len() * (self.taps + 1)
    }

    /// Values of the direct sound: mixture, difference, two ears of phase, delay.
    #[must_use]
    pub fn direct_len(&self) -> usize {
        4 * self.bins + 1
    }

    /// Values of one tap: two ears of bands.
    #[must_use]
    pub fn tap_len(&self) -> usize {
        2 * self.bands
    }

    /// A transfer function that is silent.
    #[must_use]
    pub fn silent(&self) -> TransferFunction {
        TransferFunction {
            mixture: vec![0.0; self.bins],
            difference: vec![0.0; self.bins],
            phase: vec![0.0; 2 * self.bins],
            delay_s: 0.0,
            taps: vec![0.0; self.tap_len() * self.taps],
            late: vec![0.0; self.tap_len()],
        }
    }
}

impl TransferFunction {
    /// The values in a row, in the order of [`TransferShape::row_len`].
    #[must_use]
    pub fn to_row(&self) -> Vec<f32> {
        [&self.mixture, &self.difference, &self.phase, &[self.delay_s][..], &self.taps, &self.late].concat()
    }
}
