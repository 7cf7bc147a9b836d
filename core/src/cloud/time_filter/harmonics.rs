//! Spherical harmonics of the directions to the anchors.

use crate::cloud::CloudModel;
use crate::cloud::relative::directions;
use crate::cloud::rows::{Product, Rows, Weights};
use glam::Vec3;
use pulp::Arch;

/// Harmonics up to the first degree.
pub(super) const HARMONICS: usize = 4;

const C0: f32 = 0.282_094_8;
const C1: f32 = 0.488_602_5;

/// Harmonics of the directions from a listener to the anchors.
pub(super) struct Harmonics {
    anchors: Vec<Vec3>,
    directions: Vec<Vec3>,
    /// `[anchor][HARMONICS]`.
    values: Vec<f32>,
}

impl Harmonics {
    pub(super) fn new(model: &CloudModel) -> Self {
        let anchors = model.parts().anchors.clone();
        Self { directions: vec![Vec3::ZERO; anchors.len()], values: vec![0.0; anchors.len() * HARMONICS], anchors }
    }

    /// Values at a place in the cloud, `[anchor][HARMONICS]`; axes are the cloud's, the listener's orientation does not count. An
    /// anchor at that place has no direction: only its zeroth harmonic counts.
    pub(super) fn at(&mut self, centre: Vec3) -> &[f32] {
        directions(&self.anchors, centre, &mut self.directions);
        for (u, y) in self.directions.iter().zip(self.values.as_chunks_mut::<HARMONICS>().0) {
            *y = [C0, -C1 * u.y, C1 * u.z, -C1 * u.x];
        }
        &self.values
    }
}

/// `sum over bands f of time_freq_weights[i][f][c] time_weights[f][t] / sqrt(F)`, rows `[anchor][HARMONICS]` of frames t.
pub(super) fn frame_table(model: &CloudModel, arch: Arch) -> Rows {
    let sizes = model.sizes();
    let coefficients = model.weights("time_freq_weights");
    let scale = 1.0 / (sizes.bands as f32).sqrt();
    let mut x = Rows::new(sizes.bands, sizes.frames);
    for (band, w) in model.weights("time_weights").chunks_exact(sizes.frames).enumerate() {
        x.row_mut(band).copy_from_slice(w);
    }
    let at = |band: usize, o: usize| scale * coefficients[(o / HARMONICS * sizes.bands + band) * HARMONICS + o % HARMONICS];
    let weights = Weights::new(sizes.bands, sizes.anchors * HARMONICS, at);
    let mut table = Rows::new(sizes.anchors * HARMONICS, sizes.frames);
    Product { weights: &weights, x: &x, gate: None, out: &mut table }.run(arch);
    table
}

/// `time_freq_weights` as rows `[anchor][HARMONICS]` of bands.
pub(super) fn band_table(model: &CloudModel) -> Rows {
    let sizes = model.sizes();
    let mut table = Rows::new(sizes.anchors * HARMONICS, sizes.bands);
    for (anchor, w) in model.weights("time_freq_weights").chunks_exact(sizes.bands * HARMONICS).enumerate() {
        for (band, w) in w.as_chunks::<HARMONICS>().0.iter().enumerate() {
            for (c, w) in w.iter().enumerate() {
                table.row_mut(anchor * HARMONICS + c)[band] = *w;
            }
        }
    }
    table
}
