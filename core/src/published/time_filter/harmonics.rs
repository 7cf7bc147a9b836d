//! Spherical harmonics of the directions to the anchors.

use crate::network::relative::directions;
use crate::network::{CloudModel, MAX_HARMONICS};
use crate::published::frames::{FrameProduct, Frames};
use crate::simd::Weights;
use glam::Vec3;
use pulp::Arch;

/// Real spherical harmonics of a unit vector, by degree and order from the lowest, with the Condon-Shortley phase; normalised
/// to a mean square of one over 4 pi (Blanco, Florez and Bermejo 1997, table 1). Of the zero vector only the zeroth counts.
#[must_use]
pub fn spherical_harmonics(u: Vec3) -> [f32; MAX_HARMONICS] {
    let Vec3 { x, y, z } = u;
    if u == Vec3::ZERO {
        let mut none = [0.0; MAX_HARMONICS];
        none[0] = 0.282_094_8;
        return none;
    }
    [
        0.282_094_8,
        -0.488_602_5 * y,
        0.488_602_5 * z,
        -0.488_602_5 * x,
        1.092_548_4 * x * y,
        -1.092_548_4 * y * z,
        0.315_391_57 * (2.0 * z * z - x * x - y * y),
        -1.092_548_4 * x * z,
        0.546_274_2 * (x * x - y * y),
        -0.590_043_6 * y * (3.0 * x * x - y * y),
        2.890_611_4 * x * y * z,
        -0.457_045_8 * y * (4.0 * z * z - x * x - y * y),
        0.373_176_33 * z * (2.0 * z * z - 3.0 * x * x - 3.0 * y * y),
        -0.457_045_8 * x * (4.0 * z * z - x * x - y * y),
        1.445_305_7 * z * (x * x - y * y),
        -0.590_043_6 * x * (x * x - 3.0 * y * y),
    ]
}

/// Harmonics of the directions from a listener to the anchors.
pub(super) struct Harmonics {
    anchors: Vec<Vec3>,
    directions: Vec<Vec3>,
    /// `[anchor][harmonic]`.
    values: Vec<f32>,
}

impl Harmonics {
    pub(super) fn new(model: &CloudModel) -> Self {
        let anchors = model.parts().anchors.clone();
        let values = vec![0.0; anchors.len() * model.sizes().harmonics];
        Self { directions: vec![Vec3::ZERO; anchors.len()], values, anchors }
    }

    /// Values at a place in the cloud, `[anchor][harmonic]`; axes are the cloud's, the listener's orientation does not count.
    /// An anchor at that place has no direction: only its zeroth harmonic counts.
    pub(super) fn at(&mut self, centre: Vec3) -> &[f32] {
        directions(&self.anchors, centre, &mut self.directions);
        let count = self.values.len() / self.anchors.len();
        for (u, values) in self.directions.iter().zip(self.values.chunks_exact_mut(count)) {
            values.copy_from_slice(&spherical_harmonics(*u)[..count]);
        }
        &self.values
    }
}

/// `sum over bands f of time_freq_weights[i][f][c] time_weights[f][t] / sqrt(F)`, rows `[anchor][harmonic]` of frames t.
pub(super) fn frame_table(model: &CloudModel, arch: Arch) -> Frames {
    let sizes = model.sizes();
    let harmonics = sizes.harmonics;
    let coefficients = model.weights("time_freq_weights");
    let scale = 1.0 / (sizes.bands as f32).sqrt();
    let mut x = Frames::new(sizes.bands, sizes.frames);
    for (band, w) in model.weights("time_weights").chunks_exact(sizes.frames).enumerate() {
        x.row_mut(band).copy_from_slice(w);
    }
    let at = |band: usize, o: usize| scale * coefficients[(o / harmonics * sizes.bands + band) * harmonics + o % harmonics];
    let weights = Weights::new(sizes.bands, sizes.anchors * harmonics, at);
    let mut table = Frames::new(sizes.anchors * harmonics, sizes.frames);
    FrameProduct { weights: &weights, x: &x, gate: None, out: &mut table }.run(arch);
    table
}

/// `time_freq_weights` as rows `[anchor][harmonic]` of bands.
pub(super) fn band_table(model: &CloudModel) -> Frames {
    let sizes = model.sizes();
    let harmonics = sizes.harmonics;
    let mut table = Frames::new(sizes.anchors * harmonics, sizes.bands);
    for (anchor, w) in model.weights("time_freq_weights").chunks_exact(sizes.bands * harmonics).enumerate() {
        for (band, w) in w.chunks_exact(harmonics).enumerate() {
            for (c, w) in w.iter().enumerate() {
                table.row_mut(anchor * harmonics + c)[band] = *w;
            }
        }
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn harmonics_are_orthonormal_over_the_sphere() {
        // Evenly spread points (Swinbank and Purser 2006): their mean is the sphere's to about one over their number.
        let count = 4000;
        let golden = 0.5 * (1.0 + 5.0_f32.sqrt());
        let mut products = [[0.0_f64; MAX_HARMONICS]; MAX_HARMONICS];
        for i in 0..count {
            let z = 1.0 - (2 * i + 1) as f32 / count as f32;
            let turn = std::f32::consts::TAU * (i as f32 / golden).fract();
            let across = (1.0 - z * z).sqrt();
            let y = spherical_harmonics(Vec3::new(across * turn.cos(), across * turn.sin(), z));
            for (row, a) in products.iter_mut().zip(y) {
                row.iter_mut().zip(y).for_each(|(p, b)| *p += f64::from(a * b));
            }
        }
        let area = 4.0 * std::f64::consts::PI / f64::from(count);
        for (i, row) in products.iter().enumerate() {
            for (j, p) in row.iter().enumerate() {
                let wanted = if i == j { 1.0 } else { 0.0 };
                assert!((area * p - wanted).abs() < 2e-3, "{i} by {j}: {}", area * p);
            }
        }
    }
}
