//! Spectra of short pieces of a response.

use promenade_core::{Bands, StftGrid};
use promenade_fourier::Fourier;
use promenade_fourier::num_complex::Complex64;
use promenade_room::HopEnergies;

/// Transform of pieces up to one frame of a grid long.
pub(crate) struct Analyser {
    grid: StftGrid,
    fourier: Fourier<f64>,
}

impl Analyser {
    pub(crate) fn new(grid: StftGrid) -> Self {
        Self { grid, fourier: Fourier::new(grid.n_fft) }
    }

    /// One-sided spectrum of a piece, zero-padded (or cut) to the grid's transform length.
    pub(crate) fn spectrum(&self, piece: &[f64]) -> Vec<Complex64> {
        self.fourier.spectrum(piece.iter().copied())
    }

    /// Mean energy density per band of a response's hops, `[hop][band]`, when the head's centre hears the direct sound at
    /// sample `origin`: hop `l` is what tap `l` of the render head covers, cut out with soft edges of a quarter of a hop.
    pub(crate) fn hop_energies(&self, response: &[f32], origin: i64, hops: usize, bands: &Bands) -> HopEnergies {
        let (hop, edge) = (self.grid.hop as i64, self.grid.lead() as i64);
        let window: Vec<f64> = (0..hop + edge)
            .map(|i| {
                let inside = ((i.min(hop + edge - 1 - i)) as f64 + 0.5) / edge as f64;
                (0.5 * std::f64::consts::PI * inside.min(1.0)).sin()
            })
            .collect();
        (0..hops)
            .map(|l| {
                let start = origin + l as i64 * hop - edge - edge / 2;
                let piece: Vec<f64> = window.iter().zip(start..).map(|(w, i)| w * at(response, i)).collect();
                band_means(&self.grid, bands, &self.spectrum(&piece))
            })
            .collect()
    }
}

/// A sample, or 0 outside the response.
pub(crate) fn at(response: &[f32], index: i64) -> f64 {
    usize::try_from(index).ok().and_then(|i| response.get(i)).map_or(0.0, |v| f64::from(*v))
}

/// Mean of |X|^2 over each band, weighted as the bands interpolate.
pub(crate) fn band_means(grid: &StftGrid, bands: &Bands, spectrum: &[Complex64]) -> Vec<f64> {
    let (mut sum, mut weight) = (vec![0.0; bands.count()], vec![1e-12; bands.count()]);
    for (k, x) in spectrum.iter().enumerate() {
        for (band, w) in bands.weights(grid.bin_hz(k) as f32) {
            sum[band] += f64::from(w) * x.norm_sqr();
            weight[band] += f64::from(w);
        }
    }
    sum.iter().zip(&weight).map(|(s, w)| s / w).collect()
}
