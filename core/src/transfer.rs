//! What one listener pose does to the source.

/// Effect of one listener pose on the source, on a scene's grid and bands.
///
/// Made with its renderer and filled anew for each pose by a decoder; the thread that renders owns it.
///
/// Left gain is `(1 - difference) * mixture`, right gain `(1 + difference) * mixture`, so a positive difference is louder on
/// the right.
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
    /// What carries the time filters, where the scene has measured responses.
    pub shares: Shares,
}

/// The most responses that are mixed at one pose.
pub const MOST_SHARES: usize = 8;

/// How much of which measured responses carries the time filters at one pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shares {
    entries: [(u32, f32); MOST_SHARES],
    count: usize,
    /// Gain of the first hop, which the direct sound is part of, linear amplitude; its distance law.
    pub direct_gain: f32,
    /// How much of what image sources play is taken off them, 0 to 1.
    pub lifted: f32,
}

impl Shares {
    /// All of the first response, or of the noise that scenes without responses have.
    pub const FIRST: Self = Self { entries: [(0, 1.0); MOST_SHARES], count: 1, direct_gain: 1.0, lifted: 0.0 };
    /// Nothing yet.
    pub(crate) fn none(direct_gain: f32) -> Self {
        Self { entries: [(0, 0.0); MOST_SHARES], count: 0, direct_gain, lifted: 0.0 }
    }

    /// Number of each response and its share.
    #[must_use]
    pub fn entries(&self) -> &[(u32, f32)] {
        &self.entries[..self.count]
    }

    /// Adds a share of a response; where there is no room for one more, the smallest makes room if it is smaller.
    pub(crate) fn add(&mut self, response: u32, share: f32) {
        if let Some(entry) = self.entries[..self.count].iter_mut().find(|e| e.0 == response) {
            entry.1 += share;
        } else if self.count < MOST_SHARES {
            self.entries[self.count] = (response, share);
            self.count += 1;
        } else if let Some(smallest) = self.entries.iter_mut().min_by(|a, b| a.1.total_cmp(&b.1))
            && smallest.1 < share
        {
            *smallest = (response, share);
        }
    }

    /// Brings the sum of all shares to 1, so that what had no room is not missed.
    pub(crate) fn normalise(&mut self) {
        let sum: f32 = self.entries().iter().map(|e| e.1).sum();
        if sum > 0.0 {
            self.entries[..self.count].iter_mut().for_each(|e| e.1 /= sum);
        }
    }
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
            shares: Shares::FIRST,
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
