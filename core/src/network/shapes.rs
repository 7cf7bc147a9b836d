//! Names and shapes of weights that the network and the render heads agree on.

/// Neighbouring bins that the convolution along frequency of [`CloudKind::Full`](crate::network::CloudKind::Full) reaches over.
pub(crate) const FREQUENCY_TAPS: usize = 3;
/// Name of the shapes that taps are made of, `[shape][hop][band]`.
pub(crate) const TAP_SHAPES: &str = "tap_shapes";
/// Channels between the convolution layers.
pub(crate) const CONV_CHANNELS: usize = 16;
/// Names of the three convolution layers, and the shapes of their weights, `[output][input][bin][frame]`.
pub const CONV_LAYERS: [(&str, [usize; 4]); 3] =
    [("out.0", [CONV_CHANNELS, 4, 7, 7]), ("out.2", [CONV_CHANNELS, CONV_CHANNELS, 3, 3]), ("out.4", [1, CONV_CHANNELS, 3, 3])];
/// Highest degree of the spherical harmonics that time filters are made of.
const MAX_DEGREE: usize = 3;
/// Spherical harmonics up to that degree.
pub const MAX_HARMONICS: usize = (MAX_DEGREE + 1).pow(2);

/// Degree up to which there are so many harmonics: 0 to 3 for 1, 4, 9 or 16, `None` for any other number.
pub(crate) fn harmonic_degree(harmonics: usize) -> Option<usize> {
    (0..=MAX_DEGREE).find(|degree| (degree + 1).pow(2) == harmonics)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn degrees_go_to_the_third() {
        assert_eq!([1, 4, 9, 16, 25, 5, 0].map(harmonic_degree), [Some(0), Some(1), Some(2), Some(3), None, None, None]);
    }
}
