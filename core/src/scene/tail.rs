//! What decays after the taps.

/// What the time filters of all poses share.
#[derive(Clone, Debug, PartialEq)]
pub struct TailModel {
    /// Seed of the pseudo-random carriers.
    pub seed: u64,
    /// Reverberation time of the late part per band, seconds (60 dB).
    pub t60_s: Vec<f32>,
    /// Interaural coherence of the room's sound per band, real, in [-1, 1].
    pub coherence: Vec<f32>,
    /// Whether the taps' noise differs between the ears nearly in phase alone: no draw of it is louder at one ear, and per bin
    /// within a few decibels.
    pub by_phase: bool,
}

impl TailModel {
    /// The longest reverberation time of a band, seconds.
    #[must_use]
    pub fn longest_t60_s(&self) -> f32 {
        self.t60_s.iter().fold(0.0, |a, b| a.max(*b))
    }
}
