//! Errors of the published head.

use promenade_fault::Fault;
use std::ops::RangeInclusive;
use thiserror::Error;

/// Why a published head cannot be built or cannot render.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum PublishedError {
    /// The model's taps are those of the streaming head.
    #[error(
        "the model was trained for streams (kind taps): the published head, by clips or with convolution layers, cannot play it"
    )]
    Streamed,
    /// The masks do not lie on the grid's bins.
    #[error("the model's masks have {bands} bands, the grid has {bins} bins")]
    Bands {
        /// Bands of the model.
        bands: usize,
        /// Bins of the grid.
        bins: usize,
    },
    /// Not a grid that a transform can work on.
    #[error(
        "transform of {n_fft} samples with a hop of {hop} at {sample_rate_hz} Hz: expected an even length of 2 to 65536, a \
         hop of 1 to \
         half of it, a rate of 1 to 1000000 Hz"
    )]
    Grid {
        /// Transform length, samples.
        n_fft: usize,
        /// Hop, samples.
        hop: usize,
        /// Sample rate, Hz.
        sample_rate_hz: f64,
    },
    /// A clip cannot be reflected at its ends.
    #[error("clips of {frames} frames have {samples} samples, expected more than {expected}")]
    Short {
        /// Frames of a clip.
        frames: usize,
        /// Its shortest length, samples.
        samples: usize,
        /// Half of the transform length, samples.
        expected: usize,
    },
    /// A signal or a mask is of another length.
    #[error("{what}: expected {} to {}, found {found}", expected.start(), expected.end())]
    Length {
        /// What is of another length.
        what: &'static str,
        /// Lengths that are taken.
        expected: RangeInclusive<usize>,
        /// Its length.
        found: usize,
    },
}

impl From<PublishedError> for Fault {
    fn from(error: PublishedError) -> Self {
        Self::of(error)
    }
}
