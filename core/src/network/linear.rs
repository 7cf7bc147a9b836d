//! The linear network: one attention product without a softmax.
//!
//! Masks are `m_f = q_f . u / sqrt(C N) + b` with `u = sum_n k_n g_n`, where `g_n` is one number per anchor: its weight in the
//! mixture mask, or its value's part in the difference mask. A key is `k_n = W h_n + s_n` with h the pose-dependent hidden
//! layer and s what no pose changes, so sums over anchors of h and s suffice.

use crate::network::kernels::{Activation, Columns, Matrix, PANEL, PanelProduct, Panels, Row, Start, dot, in_columns, total};
use crate::network::relative::{Relative, Visual, in_rows};
use crate::network::{CloudModel, Listener, Masks};
use crate::number::single;
use crate::simd::TILE;
use crate::simd::{Weights, all, times_plus};
use pulp::{Arch, Simd, WithSimd};

/// Network of [`crate::network::CloudKind::SimpleSh`].
pub(crate) struct Linear {
    arch: Arch,
    relative: Relative,
    /// Part of the keys that is the same for all poses.
    fixed: Panels,
    /// Weight of each anchor in the mixture mask, in panels.
    mixture: Vec<Row>,
    /// Weights of a hidden layer in the difference mask, and the part that no pose changes.
    difference: Vec<f32>,
    difference_start: f32,
    /// Second layer of the anchors' embedding.
    second: Weights,
    /// `sum_n s_n g_n`, scaled.
    mixture_fixed: Vec<f32>,
    scale: f32,
    /// Queries, `[panel][feature][band]`.
    queries: Panels,
    query_weights: Weights,
    biases: [f32; 2],
    hidden: Vec<Row>,
    sums: Sums,
    /// Two positions of a panel: mixture and difference.
    pair: Vec<Row>,
    projected: Vec<Row>,
    products: Vec<Row>,
}

/// Sums over panels of anchors, one row per feature.
struct Sums {
    mixture: Vec<Row>,
    difference: Vec<Row>,
    fixed: Vec<Row>,
}

impl Linear {
    pub(crate) fn new(model: &CloudModel, arch: Arch) -> Self {
        let s = model.sizes();
        let c = s.width;
        let doubles = |name: &str| -> Vec<f64> { model.weights(name).iter().map(|v| f64::from(*v)).collect() };
        let visual = Visual::new(model);
        let fixed = visual.hidden.linear(&visual.second, &visual.bias);
        let audio = Matrix::from_weights(model.weights("_audio_features_f"), c);
        let mixture = audio.apply(&doubles("mix_prj.weight"));
        let second = Matrix::from_weights(model.weights("vec_proj.2.proj.weight"), c);
        let difference = doubles("diff_prj.weight");
        let scale = 1.0 / ((c * s.anchors) as f64).sqrt();
        let queries = Matrix::from_weights(model.weights("freq_weights"), c);
        let rows = |count| vec![Row::default(); count];
        Self {
            arch,
            relative: Relative::new(model, arch),
            mixture_fixed: fixed.transposed().apply(&mixture).iter().map(|v| single(v * scale)).collect(),
            fixed: Panels::from_fn(c, s.anchors, |anchor, feature| fixed.at(anchor, feature)),
            mixture: in_rows(&mixture),
            difference: second.transposed().apply(&difference).iter().map(|v| single(*v)).collect(),
            difference_start: single(dot(&doubles("vec_proj.2.proj.bias"), &difference)),
            second: second.weights(&vec![0.0; c]),
            scale: single(scale),
            queries: Panels::from_fn(c, s.bands, |band, feature| queries.at(band, feature)),
            query_weights: queries.weights(&vec![0.0; s.bands]),
            biases: ["mix_prj.bias", "diff_prj.bias"].map(|b| model.weights(b).first().copied().unwrap_or(0.0)),
            hidden: rows(c),
            sums: Sums { mixture: rows(c), difference: rows(c), fixed: rows(c) },
            pair: rows(c),
            projected: rows(c),
            products: rows(s.bands.next_multiple_of(TILE)),
        }
    }

    pub(crate) fn decode(&mut self, listener: &Listener, out: &mut Masks) {
        for sums in [&mut self.sums.mixture, &mut self.sums.difference, &mut self.sums.fixed] {
            sums.fill(Row::default());
        }
        for panel in 0..self.fixed.count() {
            self.relative.hidden(listener, panel, &mut self.hidden);
            let positions = self.fixed.held(panel);
            self.arch.dispatch(Gather { linear: self, panel, positions });
        }
        let total = |row: &Row| row.0.iter().sum::<f32>();
        for ((pair, m), d) in self.pair.iter_mut().zip(&self.sums.mixture).zip(&self.sums.difference) {
            pair.0[..2].copy_from_slice(&[self.scale * total(m), self.scale * total(d)]);
        }
        for ((start, fixed), m) in self.projected.iter_mut().zip(&self.sums.fixed).zip(&self.mixture_fixed) {
            start.0[..2].copy_from_slice(&[*m, self.scale * total(fixed)]);
        }
        PanelProduct {
            weights: &self.second,
            input: &self.pair,
            start: Start::Output,
            activation: Activation::None,
            positions: 2,
            output: &mut self.projected,
        }
        .run(self.arch);
        let (mixture, difference) = (out.mixture.chunks_mut(PANEL), out.difference.chunks_mut(PANEL));
        for ((panel, mixture), difference) in self.queries.iter().zip(mixture).zip(difference) {
            let mut logits = self.biases.map(|b| Row([b; PANEL]));
            self.arch.dispatch(Dots { rows: panel, pairs: &self.projected, out: &mut logits });
            mixture.copy_from_slice(&logits[0].0[..mixture.len()]);
            // 2 sigmoid(x) - 1.
            difference.iter_mut().zip(logits[1].0).for_each(|(d, x)| *d = (0.5 * x).tanh());
        }
    }

    /// Mean magnitude of the attention product over bands, per anchor, divided by its sum.
    pub(crate) fn attention(&mut self, listener: &Listener, attention: &mut [f32]) {
        for (panel, attention) in attention.chunks_mut(PANEL).enumerate().take(self.fixed.count()) {
            let positions = self.fixed.held(panel);
            self.relative.hidden(listener, panel, &mut self.hidden);
            PanelProduct {
                weights: &self.second,
                input: &self.hidden,
                start: Start::Rows(self.fixed.panel(panel)),
                activation: Activation::None,
                positions,
                output: &mut self.projected,
            }
            .run(self.arch);
            PanelProduct {
                weights: &self.query_weights,
                input: &self.projected,
                start: Start::Bias,
                activation: Activation::None,
                positions,
                output: &mut self.products,
            }
            .run(self.arch);
            for (position, attention) in attention.iter_mut().enumerate() {
                *attention = self.products.iter().map(|row| row.0[position].abs()).sum();
            }
        }
        let sum: f32 = attention.iter().sum();
        let even = 1.0 / attention.len().max(1) as f32;
        attention.iter_mut().for_each(|a| *a = if sum > 0.0 { *a / sum } else { even });
    }
}

/// Adds a panel of anchors to the sums.
struct Gather<'a> {
    linear: &'a mut Linear,
    panel: usize,
    positions: usize,
}

impl WithSimd for Gather<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        // Anchors that only fill up the panel count for nothing.
        for row in &mut self.linear.hidden {
            row.0[self.positions..].fill(0.0);
        }
        in_columns(simd, self.positions, &mut self);
    }
}

impl Columns for Gather<'_> {
    #[inline(always)]
    fn columns<S: Simd, const M: usize, const V: usize>(&mut self, simd: S, first: usize) {
        let l = &mut *self.linear;
        let mut parts = [all::<S, V>(simd, 0.0); 4];
        parts[0] = all(simd, l.difference_start);
        for (rows, factors) in l.hidden.as_chunks::<4>().0.iter().zip(l.difference.as_chunks::<4>().0) {
            for i in 0..4 {
                parts[i] = times_plus(simd, rows[i].load(simd, first), all(simd, factors[i]), parts[i]);
            }
        }
        let value = total(simd, parts);
        let mixture = l.mixture[self.panel].load::<S, V>(simd, first);
        let fixed = l.fixed.panel(self.panel);
        let sums = l.sums.mixture.iter_mut().zip(&mut l.sums.difference).zip(&mut l.sums.fixed);
        for ((hidden, fixed), ((m, d), f)) in l.hidden.iter().zip(fixed).zip(sums) {
            let (hidden, fixed) = (hidden.load::<S, V>(simd, first), fixed.load::<S, V>(simd, first));
            for (sum, x, y) in [(m, hidden, mixture), (d, hidden, value), (f, fixed, value)] {
                sum.store(simd, first, times_plus(simd, x, y, sum.load(simd, first)));
            }
        }
    }
}

/// Adds the products of rows with two columns, which are the first two positions of `pairs`.
struct Dots<'a> {
    rows: &'a [Row],
    pairs: &'a [Row],
    out: &'a mut [Row; 2],
}

impl WithSimd for Dots<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        in_columns(simd, PANEL, &mut self);
    }
}

impl Columns for Dots<'_> {
    #[inline(always)]
    fn columns<S: Simd, const M: usize, const V: usize>(&mut self, simd: S, first: usize) {
        let [mixture, difference] = self.out;
        let (mut m, mut d) = (mixture.load::<S, V>(simd, first), difference.load::<S, V>(simd, first));
        for (row, pair) in self.rows.iter().zip(self.pairs) {
            let x = row.load::<S, V>(simd, first);
            m = times_plus(simd, x, all(simd, pair.0[0]), m);
            d = times_plus(simd, x, all(simd, pair.0[1]), d);
        }
        mixture.store(simd, first, m);
        difference.store(simd, first, d);
    }
}
