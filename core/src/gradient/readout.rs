//! The derivative of a readout.

use crate::TransferFunction;
use crate::bands::BandPlace;
use crate::decode::{QueryValues, Readout};

impl Readout {
    /// Adds the derivatives of a number by values and tap shapes, given its derivatives `by` the transfer function.
    pub fn adjoint(
        &self,
        values: &QueryValues,
        shapes: &[f32],
        gain: f32,
        by: &TransferFunction,
        by_values: &mut QueryValues,
        by_shapes: &mut [f32],
    ) {
        let at = |of: &[f32], p: &BandPlace| of[p.band] + p.fraction * (of[p.band + 1] - of[p.band]);
        for (k, p) in self.bins.iter().enumerate() {
            let heard = if at(&values.mixture, p) > 0.0 { 1.0 } else { 0.0 };
            for (query, share) in [(p.band, 1.0 - p.fraction), (p.band + 1, p.fraction)] {
                by_values.mixture[query] += heard * share * gain * by.mixture[k];
                by_values.difference[query] += share * by.difference[k];
            }
        }
        let (bands, hops, ranks) = (self.shape.bands, self.shape.taps + 1, self.tap_shapes);
        for (band, share) in self.bands.iter().enumerate().filter(|_| ranks > 0) {
            for ear in 0..2 {
                for rank in 0..ranks {
                    let c: f32 = share.iter().map(|(q, w)| w * values.coefficients[(2 * q + ear) * ranks + rank]).sum();
                    let mut by_c = 0.0;
                    for hop in 0..hops {
                        let place = ear * bands + band;
                        let by_tap = if hop + 1 == hops { by.late[place] } else { by.taps[hop * 2 * bands + place] };
                        let shape = (rank * hops + hop) * bands + band;
                        by_c += by_tap * shapes[shape];
                        by_shapes[shape] += by_tap * c;
                    }
                    share.iter().for_each(|(q, w)| by_values.coefficients[(2 * q + ear) * ranks + rank] += w * by_c);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Bands, StftGrid};

    fn values(count: usize, of: f32) -> Vec<f32> {
        (0..count).map(|i| 0.1 + 0.8 * (0.5 + 0.5 * (of * 12.9898 * (i as f32 + 1.0)).sin())).collect()
    }

    #[test]
    fn the_adjoint_is_the_derivative() {
        let grid = StftGrid { sample_rate_hz: 8000.0, n_fft: 64, hop: 16 };
        let bands = Bands::for_rate(8000.0);
        let queries = Bands::new((0..12).map(|i| 300.0 * i as f32).collect()).unwrap();
        let (taps, ranks) = (3, 2);
        let head = Readout::new(&queries, &grid, &bands, taps, ranks);
        let mut at = head.values();
        at.mixture = values(at.mixture.len(), 1.0);
        at.difference = values(at.difference.len(), 2.0);
        at.coefficients = values(at.coefficients.len(), 3.0);
        let shapes = values(ranks * (taps + 1) * bands.count(), 4.0);
        let weights = TransferFunction {
            mixture: values(grid.bins(), 5.0),
            difference: values(grid.bins(), 6.0),
            taps: values(2 * bands.count() * taps, 7.0),
            late: values(2 * bands.count(), 8.0),
            ..head.shape.silent()
        };
        let value = |v: &QueryValues, s: &[f32]| -> f64 {
            let mut t = head.shape.silent();
            head.transfer(v, s, 0.7, &mut t);
            let (a, b) = (t.to_row(), weights.to_row());
            a.iter().zip(&b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum()
        };
        let (mut by, mut by_shapes) = (head.values(), vec![0.0; shapes.len()]);
        head.adjoint(&at, &shapes, 0.7, &weights, &mut by, &mut by_shapes);
        let step = 1e-2;
        let slope = |change: &dyn Fn(&mut QueryValues, &mut Vec<f32>, f32)| {
            let ends = [step, -step].map(|h| {
                let (mut v, mut s) = (at.clone(), shapes.clone());
                change(&mut v, &mut s, h);
                value(&v, &s)
            });
            (ends[0] - ends[1]) / (2.0 * f64::from(step))
        };
        let check = |what: &str, got: f32, want: f64| {
            assert!((f64::from(got) - want).abs() < 1e-3 * want.abs().max(0.1), "{what}: {got} against {want}");
        };
        for q in 0..12 {
            check("mixture", by.mixture[q], slope(&|v, _, h| v.mixture[q] += h));
            check("difference", by.difference[q], slope(&|v, _, h| v.difference[q] += h));
            let c = 4 * q + q % 4;
            check("coefficient", by.coefficients[c], slope(&|v, _, h| v.coefficients[c] += h));
        }
        for i in (0..shapes.len()).step_by(7) {
            check("shape", by_shapes[i], slope(&|_, s, h| s[i] += h));
        }
    }
}
