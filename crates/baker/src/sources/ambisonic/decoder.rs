//! From Ambisonic channels to both ears by filters.

use super::ears::Frame;
use crate::sources::simulation::Hrtf;
use promenade_core::glam::Vec3;
use promenade_core::head::{Incidence, ambisonic_filters};
use promenade_fourier::num_complex::Complex32;

/// Filters of each channel for each ear, `[channel][ear]`, as impulse responses of a [`Frame`]; `heard` gives both ears'
/// spectra of a direction.
pub(super) fn filters(
    order: usize,
    incidence: Incidence,
    hrtf: &Hrtf,
    frame: Frame,
    heard: impl Fn(Vec3) -> [Vec<Complex32>; 2],
) -> Vec<[Vec<f32>; 2]> {
    let filters = ambisonic_filters(order, incidence, hrtf.bins.hz(1), heard);
    filters.into_iter().map(|ears| ears.map(|spectrum| frame.impulse(spectrum))).collect()
}
