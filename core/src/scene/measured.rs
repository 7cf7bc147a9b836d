//! The measured responses of a scene.

use crate::StftGrid;

/// Binaural responses of a room, which carry its time filters instead of noise.
///
/// Each is cut into hops, the first from a quarter of a hop before the sound's arrival at the head's centre on. The filters of
/// a pose are the hops of the responses measured nearest to it, mixed, times the gains of [`crate::TransferFunction::taps`] per
/// band: 1 where a response was measured.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredRoom {
    /// Samples at the scene's rate, `[response][ear][hop * sample]`. The first hop is what the direct sound's filter leaves of
    /// it, at a distance of 1 m.
    pub samples: Vec<f32>,
    /// Hops of each response: at least one more than there are taps. Later ones are heard in the lowest bins only.
    pub hops: usize,
}

impl MeasuredRoom {
    /// Samples of both ears of one response.
    pub(super) fn response_len(&self, grid: &StftGrid) -> usize {
        2 * self.hops * grid.hop
    }

    /// Number of responses on a scene's grid.
    #[must_use]
    pub fn count(&self, grid: &StftGrid) -> usize {
        self.samples.len() / self.response_len(grid).max(1)
    }

    /// One hop of one ear of a response.
    pub(crate) fn hop(&self, grid: &StftGrid, response: usize, ear: usize, hop: usize) -> &[f32] {
        let start = ((2 * response + ear) * self.hops + hop) * grid.hop;
        &self.samples[start..start + grid.hop]
    }

    /// Bytes in memory.
    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(&*self.samples)
    }
}
