//! How late the rendered sound is.

use crate::{Scene, StftGrid};

/// How far the sound that comes out lags behind what goes in.
///
/// In the two short ones the direct sound and what arrives within three hops of it are convolved in the time domain, sample by
/// sample, and the rest of the room by the short-time transform, which then has the time it needs. Sound and levels are those
/// of the frame; a pose is heard up to a hop and a half later than it would be with the frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Latency {
    /// A frame of the scene's transform, 16 ms for most scenes. The cheapest.
    #[default]
    Frame,
    /// 64 samples at 44.1 and 48 kHz, as many more as the rate is higher.
    Samples64,
    /// None is stated, and the dry sound is not delayed. What is rendered comes a quarter of a hop later (1.25 ms), as from
    /// 43 cm farther away.
    None,
}

/// The unit of [`Latency::Samples64`], samples.
const UNIT: usize = 64;

impl Latency {
    /// All of them, the longest first.
    pub const ALL: [Self; 3] = [Self::Frame, Self::Samples64, Self::None];

    /// The name in commands.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Frame => "frame",
            Self::Samples64 => "64",
            Self::None => "none",
        }
    }

    /// What a scene is played with at a sample rate, Hz: this, or its frame where that cannot be told apart from its first
    /// hops ([`Carriers::with_latency`](crate::Carriers::with_latency)).
    #[must_use]
    pub fn played_by(self, scene: &Scene, sample_rate_hz: f64) -> Self {
        Pace::new(self, &scene.grid().at_rate(sample_rate_hz), scene.shape().taps).latency
    }

    /// Samples that a host is told on a grid.
    pub(crate) fn stated(self, grid: &StftGrid) -> usize {
        match self {
            Self::Frame => grid.latency_samples(),
            Self::Samples64 => grid.lead().next_multiple_of(UNIT).max(UNIT),
            Self::None => 0,
        }
    }
}

/// How a stream is cut up on a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Pace {
    /// What is played, which is a frame where the scene's frames cannot be told apart from their first hops.
    pub(crate) latency: Latency,
    /// Samples that are taken at a time by what is neither filter nor transform.
    pub(crate) block: usize,
    /// Samples by which what arrives with the direct sound comes after what was taken in, when a block is given out as soon as
    /// it is complete.
    pub(crate) delay: usize,
    /// Delay of what is taken sample by sample, samples.
    pub(crate) sample_delay: usize,
}

/// Hops that do not wait for a frame.
pub(crate) const EARLY_HOPS: usize = 3;
/// Blocks of a hop, the best number first: as many as a hop has leads, or nearly.
const BLOCKS: [usize; 6] = [4, 5, 3, 6, 2, 7];

impl Pace {
    /// For a latency that is wanted of a scene with so many explicit taps on a host's grid.
    pub(crate) fn new(wanted: Latency, grid: &StftGrid, taps: usize) -> Self {
        // With a frame even these are given out with the next hop.
        let delay = grid.latency_samples().saturating_sub(grid.hop);
        let whole = Self { latency: Latency::Frame, block: grid.hop, delay, sample_delay: delay };
        // With fewer taps the late part begins within the early hops.
        let splits = grid.n_fft == 4 * grid.hop && taps >= EARLY_HOPS + crate::render::late::network::LATE_HOPS;
        match BLOCKS.into_iter().find(|count| splits && grid.hop.is_multiple_of(*count)) {
            Some(count) if wanted != Latency::Frame => {
                let block = grid.hop / count;
                let lead = grid.lead();
                Self { latency: wanted, block, delay: lead.saturating_sub(block), sample_delay: lead }
            }
            _ => whole,
        }
    }

    /// Whether the first hops do not wait for a frame.
    pub(crate) fn is_short(&self) -> bool {
        self.latency != Latency::Frame
    }

    /// Hops of the filters that do not wait for a frame.
    pub(crate) fn early_hops(&self) -> usize {
        if self.is_short() { EARLY_HOPS } else { 0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn usual_rates_have_the_stated_latency() {
        let scene = StftGrid { sample_rate_hz: 48_000.0, n_fft: 960, hop: 240 };
        for (rate, samples) in [(44_100.0, 64), (48_000.0, 64), (88_200.0, 128), (96_000.0, 128), (192_000.0, 256)] {
            let grid = scene.at_rate(rate);
            let pace = Pace::new(Latency::Samples64, &grid, 40);
            assert_eq!((pace.latency, pace.latency.stated(&grid)), (Latency::Samples64, samples), "{rate}");
            assert!(grid.hop.is_multiple_of(pace.block) && pace.block <= grid.hop / 3, "{rate}");
            assert_eq!(Pace::new(Latency::None, &grid, 40).latency.stated(&grid), 0);
            assert_eq!(Pace::new(Latency::Frame, &grid, 40).block, grid.hop);
        }
    }

    #[test]
    fn what_cannot_be_split_keeps_its_frame() {
        let published = StftGrid { sample_rate_hz: 22_050.0, n_fft: 512, hop: 127 };
        assert_eq!(Pace::new(Latency::None, &published, 40).latency, Latency::Frame);
        let grid = StftGrid { sample_rate_hz: 48_000.0, n_fft: 960, hop: 240 };
        assert_eq!(Pace::new(Latency::None, &grid, 4).latency, Latency::Frame);
    }
}
