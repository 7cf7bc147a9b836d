//! Every kernel against a plain loop in double precision, on all instructions that this machine has.

use super::exponential::exp2;
use super::*;
use crate::simd::tests::arches;
use promenade_testing::noise_at;
use pulp::{Arch, Simd, WithSimd};

/// Vector instructions, or a stand-in for those of other machines.
#[derive(Clone, Copy, Debug)]
enum Set {
    Here(Arch),
    /// Four lanes, as NEON has.
    Four,
}

impl Set {
    fn all() -> Vec<Self> {
        arches().into_iter().map(Self::Here).chain([Self::Four]).collect()
    }

    fn dispatch<W: WithSimd>(self, work: W) -> W::Output {
        match self {
            Self::Here(arch) => arch.dispatch(work),
            Self::Four => work.with_simd(pulp::Scalar128b),
        }
    }
}

/// A number in [-1, 1) for each pair.
fn value(a: usize, b: usize) -> f64 {
    noise_at(a as u64, b).into()
}

fn panels(features: usize, positions: usize, seed: usize) -> Panels {
    Panels::from_fn(features, positions, |p, f| value(p + 1000 * seed, f))
}

fn at(rows: &[Row], position: usize, feature: usize) -> f64 {
    f64::from(rows[feature].0[position])
}

#[test]
fn products_are_sums_over_inputs() {
    for set in Set::all() {
        // A single position and outputs that fill no tile have paths of their own.
        for (outputs, inputs, positions) in [(16, 5, 32), (8, 63, 17), (72, 31, 1), (3, 8, 1), (10, 12, 9), (128, 128, 25)] {
            let matrix = Matrix::new((0..outputs * inputs).map(|i| value(i, 3)), inputs);
            let bias: Vec<f64> = (0..outputs).map(|i| value(i, 4)).collect();
            let weights = matrix.weights(&bias);
            let filled = outputs.next_multiple_of(8);
            let (input, rows) = (panels(inputs, positions, 1), panels(filled, positions, 2));
            for start in [Start::Bias, Start::Output, Start::Rows(rows.panel(0))] {
                for activation in [Activation::None, Activation::Relu, Activation::Prelu(0.25)] {
                    let mut output = panels(filled, positions, 5);
                    let before = panels(filled, positions, 5);
                    let product = PanelProduct {
                        weights: &weights,
                        input: input.panel(0),
                        start,
                        activation,
                        positions,
                        output: output.panel_mut(0),
                    };
                    match set {
                        Set::Here(arch) => product.run(arch),
                        Set::Four => set.dispatch(product),
                    }
                    for (p, o) in (0..positions).flat_map(|p| (0..outputs).map(move |o| (p, o))) {
                        let start = match start {
                            Start::Bias => 0.0,
                            Start::Output => at(before.panel(0), p, o),
                            Start::Rows(rows) => at(rows, p, o),
                        };
                        let sum: f64 = (0..inputs).map(|i| matrix.at(o, i) * at(input.panel(0), p, i)).sum();
                        let sum = start + bias[o] + sum;
                        let exact = match activation {
                            Activation::None => sum,
                            Activation::Relu => sum.max(0.0),
                            Activation::Prelu(slope) => sum.max(0.0) + f64::from(slope) * sum.min(0.0),
                        };
                        let found = at(output.panel(0), p, o);
                        assert!((found - exact).abs() < 1e-5, "{set:?} {outputs} x {inputs}: {found}, {exact}");
                    }
                }
            }
        }
    }
}

#[test]
fn attention_is_a_softmax_over_all_keys() {
    for set in Set::all() {
        // More keys than are held at a time; a single query and a single key have paths of their own.
        for (keys_count, positions, sharp) in [(1, 32, 1.0), (37, 32, 3.0), (300, 20, 2.0), (700, 1, 1.0), (1000, 3, 90.0)] {
            let (head, features) = (8..24, 24);
            let query = panels(16, positions, 1);
            let keys = Panels::from_fn(features, keys_count, |p, f| sharp * value(p, f));
            let values = panels(features, keys_count, 3);
            let mixture = panels(1, keys_count, 4);
            let numbers: Vec<Row> = mixture.iter().flatten().copied().collect();
            let mut scores = vec![Row::default(); scores_for(keys_count)];
            let (mut mixed, mut top, mut inverse) = (Row([0.5; PANEL]), Row::default(), Row::default());
            let mut output = panels(16, positions, 5);
            set.dispatch(Attention {
                query: query.panel(0),
                keys: &keys,
                values: &values,
                head: head.clone(),
                mixture: &numbers,
                mixed: &mut mixed,
                scores: &mut scores,
                positions,
                output: output.panel_mut(0),
                top: &mut top,
                inverse: &mut inverse,
            });
            let mut tally = vec![0.25; keys_count];
            set.dispatch(Tally {
                query: query.panel(0),
                keys: &keys,
                head: head.clone(),
                scores: &mut scores,
                positions,
                top: &top,
                inverse: &inverse,
                tally: &mut tally,
            });
            let mut exact_tally = vec![0.25; keys_count];
            for p in 0..positions {
                let score = |k: usize| -> f64 {
                    let key = keys.panel(k / PANEL);
                    (0..16).map(|f| at(query.panel(0), p, f) * at(key, k % PANEL, head.start + f)).sum()
                };
                let best = (0..keys_count).map(score).fold(f64::MIN, f64::max);
                let weights: Vec<f64> = (0..keys_count).map(|k| (score(k) - best).exp2()).collect();
                let sum: f64 = weights.iter().sum();
                let mean = |rows: &Panels, f: usize| -> f64 {
                    weights.iter().enumerate().map(|(k, w)| w / sum * at(rows.panel(k / PANEL), k % PANEL, f)).sum()
                };
                for f in 0..16 {
                    let (found, exact) = (at(output.panel(0), p, f), mean(&values, head.start + f));
                    assert!((found - exact).abs() < 3e-5, "{set:?} {keys_count} keys: {found}, {exact}");
                }
                let (found, exact) = (f64::from(mixed.0[p]), 0.5 + mean(&mixture, 0));
                assert!((found - exact).abs() < 3e-5, "{set:?} {keys_count} keys: mixture {found}, {exact}");
                exact_tally.iter_mut().zip(&weights).for_each(|(t, w)| *t += w / sum);
            }
            for (found, exact) in tally.iter().zip(exact_tally) {
                assert!((f64::from(*found) - exact).abs() < 1e-4, "{set:?} {keys_count} keys: tally {found}, {exact}");
            }
        }
    }
}

#[test]
fn normalised_features_have_the_mean_and_deviation_asked_for() {
    for set in Set::all() {
        for positions in [1, 9, 32] {
            let scale: Vec<f32> = (0..24).map(|f| 1.0 + value(f, 1) as f32).collect();
            let bias: Vec<f32> = (0..24).map(|f| value(f, 2) as f32).collect();
            let before = Panels::from_fn(24, positions, |p, f| 5.0 + value(p, f));
            let mut after = Panels::from_fn(24, positions, |p, f| 5.0 + value(p, f));
            set.dispatch(Norm { scale: &scale, bias: &bias, positions, rows: after.panel_mut(0) });
            for p in 0..positions {
                let x: Vec<f64> = (0..24).map(|f| at(before.panel(0), p, f)).collect();
                let mean = x.iter().sum::<f64>() / 24.0;
                let variance = x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 24.0;
                for (f, x) in x.iter().enumerate() {
                    let exact = (x - mean) / (variance + 1e-5).sqrt() * f64::from(scale[f]) + f64::from(bias[f]);
                    assert!((at(after.panel(0), p, f) - exact).abs() < 1e-5, "{set:?}");
                }
            }
        }
    }
}

/// Powers of two of a row.
struct Powers<'a>(&'a mut Row);

impl WithSimd for Powers<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for first in 0..PANEL / S::F32_LANES {
            let x = self.0.load::<S, 1>(simd, first);
            self.0.store(simd, first, exp2(simd, x));
        }
    }
}

#[test]
fn powers_of_two_are_exact() {
    for set in Set::all() {
        for i in 0..10_000 {
            let x = Row(std::array::from_fn(|p| -0.000_31 * (i * PANEL + p) as f32));
            let mut found = x;
            set.dispatch(Powers(&mut found));
            for (x, found) in x.0.iter().zip(found.0) {
                let exact = f64::from(x.max(-100.0)).exp2();
                assert!((f64::from(found) / exact - 1.0).abs() < 3e-7, "{set:?} 2^{x}: {found}");
            }
        }
        let mut rest = Row::default();
        rest.0[1] = f32::MIN;
        rest.0[2] = f32::NEG_INFINITY;
        set.dispatch(Powers(&mut rest));
        assert_eq!(rest.0[..3], [1.0, 2.0_f32.powi(-100), 2.0_f32.powi(-100)]);
    }
}
