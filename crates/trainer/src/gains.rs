//! Gains over time and frequency, applied to a response.

use crate::responses::direct_window;
use promenade_core::{Bands, StftGrid};
use promenade_fourier::{Fourier, signal};
use std::f32::consts::PI;

/// Gains of one ear's response.
pub(crate) struct Gains {
    /// Of the direct sound, one per bin of the grid.
    pub(crate) direct: Vec<f32>,
    /// Of what follows, `[hop][band]`, the first hop being that of the grid's first tap; after the last one it stays.
    pub(crate) hops: Vec<Vec<f32>>,
}

impl Gains {
    /// One ear's response, its direct sound at a sample, with these gains; no sample moves in time.
    pub(crate) fn applied(&self, ear: &[f32], centre: usize, grid: &StftGrid, bands: &Bands) -> Vec<f32> {
        let (inside, [from, .., to]) = direct_window(grid, centre);
        let mut rest = ear.to_vec();
        let mut direct = vec![0.0; ear.len()];
        for i in from.max(0) as usize..(to.max(0) as usize).min(ear.len()) {
            direct[i] = inside(i as i64) * ear[i];
            rest[i] -= direct[i];
        }
        let mut out = vec![0.0; ear.len()];
        let length = 2 * grid.n_fft;
        let start = centre as i64 - (length / 2) as i64;
        let at_bin = |k: usize| {
            let (below, share) = (k / 2, 0.5 * (k % 2) as f32);
            let above = (below + 1).min(self.direct.len() - 1);
            self.direct[below] + share * (self.direct[above] - self.direct[below])
        };
        add_filtered(&mut out, &Fourier::new(length), length, piece(&direct, start, length), start, at_bin);
        // Overlapping windows whose middles are the middles of hops.
        let hop = grid.hop;
        let (window, length) = (2 * hop, 4 * hop);
        let fourier = Fourier::new(length);
        let bin_hz = grid.sample_rate_hz / length as f64;
        let weights: Vec<_> = (0..=length / 2).map(|k| bands.weights((k as f64 * bin_hz) as f32)).collect();
        let first = (centre + hop) as i64 - grid.lead() as i64 - (hop / 2) as i64;
        let before = first.div_euclid(hop as i64) + 2;
        for l in -before..(ear.len() as i64 - first) / hop as i64 + 1 {
            let start = first + l * hop as i64;
            let row = &self.hops[(l.max(0) as usize).min(self.hops.len() - 1)];
            let cut = piece(&rest, start, window).zip(0..window).map(|(x, i)| {
                // Squared sines add up to one from window to window.
                let w = (PI * (i as f32 + 0.5) / window as f32).sin();
                w * w * x
            });
            let padded = std::iter::repeat_n(0.0, hop).chain(cut);
            let gain = |k: usize| weights[k].iter().map(|(band, weight)| weight * row[*band]).sum();
            add_filtered(&mut out, &fourier, length, padded, start - hop as i64, gain);
        }
        out
    }
}

/// So many samples from one on, zeros outside.
fn piece(x: &[f32], start: i64, count: usize) -> impl Iterator<Item = f32> {
    (start..start + count as i64).map(|i| usize::try_from(i).ok().and_then(|i| x.get(i)).copied().unwrap_or(0.0))
}

/// Adds a piece with a gain for each bin, without a change of phase, to where it begins.
fn add_filtered(
    out: &mut [f32],
    fourier: &Fourier<f32>,
    length: usize,
    piece: impl Iterator<Item = f32>,
    start: i64,
    gain: impl Fn(usize) -> f32,
) {
    let mut spectrum = fourier.spectrum(piece);
    spectrum.iter_mut().enumerate().for_each(|(k, x)| *x *= gain(k));
    for (i, x) in (start..).zip(signal(spectrum, length)) {
        if let Some(sum) = usize::try_from(i).ok().and_then(|i| out.get_mut(i)) {
            *sum += x;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_testing::noise;

    #[test]
    fn equal_gains_are_one_gain_and_a_hop_has_its_own() {
        let grid = StftGrid { sample_rate_hz: 16_000.0, n_fft: 512, hop: 128 };
        let bands = Bands::for_rate(16_000.0);
        let decaying = noise(3, 4000).into_iter().enumerate().map(|(i, x)| 0.1 * x * (-(i as f32) / 800.0).exp());
        let mut ear: Vec<f32> = std::iter::repeat_n(0.0, 300).chain(decaying).collect();
        ear[300] = 4.0;
        let flat = |gain: f32| Gains { direct: vec![gain; grid.bins()], hops: vec![vec![gain; bands.count()]; 20] };
        for (x, y) in ear.iter().zip(flat(0.5).applied(&ear, 300, &grid, &bands)) {
            assert!((0.5 * x - y).abs() < 1e-4, "{x} {y}");
        }
        let mut later = flat(1.0);
        later.hops[9..].iter_mut().for_each(|row| row.fill(0.1));
        let out = later.applied(&ear, 300, &grid, &bands);
        let energy = |x: &[f32], from: usize| x[from..from + 256].iter().map(|v| v * v).sum::<f32>();
        let first = 300 + grid.hop - grid.lead();
        let ratio_db = |at: usize| 10.0 * (energy(&out, at) / energy(&ear, at)).log10();
        assert!(ratio_db(first + 4 * 128).abs() < 0.1 && (ratio_db(first + 12 * 128) + 20.0).abs() < 0.1);
        // Without treble the direct sound has none, and stays where it is.
        let mut dull = flat(1.0);
        dull.direct[60..].fill(0.0);
        let out = dull.applied(&ear, 300, &grid, &bands);
        let peak = (0..out.len()).max_by(|a, b| out[*a].total_cmp(&out[*b]));
        assert!(peak == Some(300) && out[300] < 3.0, "{peak:?}");
    }
}
