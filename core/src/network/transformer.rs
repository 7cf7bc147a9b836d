//! The transformer networks: queries per frequency attend to each other and to the anchors.

mod fold;

use crate::network::kernels::{Activation, Attention, Norm, PANEL, PanelProduct, Panels, Row, Start, Tally, scores_for};
use crate::network::relative::Relative;
use crate::network::{CloudModel, Listener, Masks};
use crate::simd::{TILE, Weights};
use pulp::Arch;

/// Normalises over features: gain and offset of each.
struct NormWeights {
    scale: Vec<f32>,
    bias: Vec<f32>,
}

/// Self-attention and its normalisation.
struct SelfAttention {
    query: Weights,
    key: Weights,
    value: Weights,
    output: Weights,
    norm: NormWeights,
    /// Query of the cross-attention that follows.
    cross_query: Weights,
}

/// One decoder layer, with what does not depend on the pose taken out.
struct Layer {
    /// None in the first layer: its result is [`Transformer::start`].
    self_attention: Option<SelfAttention>,
    key: Weights,
    /// Part of the keys that is the same for all poses.
    key_start: Panels,
    value: Weights,
    output: Weights,
    norm: NormWeights,
    widen: Weights,
    narrow: Weights,
    final_norm: NormWeights,
}

/// Decoder of a model with layers.
pub(crate) struct Transformer {
    arch: Arch,
    heads: usize,
    relative: Relative,
    layers: Vec<Layer>,
    /// Queries after the first layer's self-attention, and their projection for its cross-attention.
    start: Panels,
    start_query: Panels,
    norm: NormWeights,
    difference: Weights,
    /// Weight of each anchor in the mixture mask, in panels.
    mixture: Vec<Row>,
    mixture_bias: f32,
    scratch: Scratch,
}

struct Scratch {
    /// First layer's outputs of the anchors' embedding.
    anchors: Panels,
    anchor_keys: Panels,
    anchor_values: Panels,
    queries: Panels,
    query_keys: Panels,
    query_values: Panels,
    /// One panel each.
    projected: Vec<Row>,
    attended: Vec<Row>,
    wide: Vec<Row>,
    scores: Vec<Row>,
    logits: Vec<Row>,
}

impl Scratch {
    fn new(model: &CloudModel) -> Self {
        let s = model.sizes();
        let rows = |features| vec![Row::default(); features];
        Self {
            anchors: Panels::new(s.width, s.anchors),
            anchor_keys: Panels::new(s.width, s.anchors),
            anchor_values: Panels::new(s.width, s.anchors),
            queries: Panels::new(s.width, s.bands),
            query_keys: Panels::new(s.width, s.bands),
            query_values: Panels::new(s.width, s.bands),
            projected: rows(s.width),
            attended: rows(s.width),
            wide: rows(s.feed_forward),
            scores: rows(scores_for(s.anchors.max(s.bands))),
            logits: rows(TILE),
        }
    }
}

impl Transformer {
    pub(crate) fn decode(&mut self, listener: &Listener, out: &mut Masks, mut attention: Option<&mut [f32]>) {
        if let Some(attention) = &mut attention {
            attention.fill(0.0);
        }
        for panel in 0..self.scratch.anchors.count() {
            self.relative.hidden(listener, panel, self.scratch.anchors.panel_mut(panel));
        }
        for layer in 0..self.layers.len() {
            self.project(layer);
            for panel in 0..self.scratch.queries.count() {
                let last = layer + 1 == self.layers.len();
                let mixed = self.advance(layer, panel, if last { attention.as_deref_mut() } else { None });
                if last {
                    self.finish(panel, &mixed, out);
                }
            }
        }
        if let Some(attention) = attention {
            let share = 1.0 / (self.heads * self.scratch.queries.positions()) as f32;
            attention.iter_mut().for_each(|a| *a *= share);
        }
    }

    /// Keys and values of a layer.
    fn project(&mut self, layer: usize) {
        let (arch, layer, s) = (self.arch, &self.layers[layer], &mut self.scratch);
        if let Some(own) = &layer.self_attention {
            for panel in 0..s.queries.count() {
                let (input, positions) = (s.queries.panel(panel), s.queries.held(panel));
                for (weights, output) in [(&own.key, &mut s.query_keys), (&own.value, &mut s.query_values)] {
                    apply(arch, weights, input, positions, output.panel_mut(panel));
                }
            }
        }
        for panel in 0..s.anchors.count() {
            let (input, positions) = (s.anchors.panel(panel), s.anchors.held(panel));
            apply(arch, &layer.value, input, positions, s.anchor_values.panel_mut(panel));
            PanelProduct {
                weights: &layer.key,
                input,
                start: Start::Rows(layer.key_start.panel(panel)),
                activation: Activation::None,
                positions,
                output: s.anchor_keys.panel_mut(panel),
            }
            .run(arch);
        }
    }

    /// Takes one panel of queries through a layer; gives the last layer's weighted means of
    /// [`Self::mixture`], summed over heads.
    fn advance(&mut self, layer: usize, panel: usize, mut tally: Option<&mut [f32]>) -> Row {
        let last = layer + 1 == self.layers.len();
        let (arch, layer, s) = (self.arch, &self.layers[layer], &mut self.scratch);
        let positions = s.queries.held(panel);
        let t = s.queries.panel_mut(panel);
        let width = t.len() / self.heads;
        let heads = || (0..self.heads).map(|h| h * width..(h + 1) * width);
        let (mut mixed, mut top, mut inverse) = (Row::default(), Row::default(), Row::default());
        let (projected, residual) = if let Some(own) = &layer.self_attention {
            apply(arch, &own.query, t, positions, &mut s.projected);
            for head in heads() {
                arch.dispatch(Attention {
                    query: &s.projected[head.clone()],
                    keys: &s.query_keys,
                    values: &s.query_values,
                    output: &mut s.attended[head.clone()],
                    head,
                    mixture: &[],
                    mixed: &mut mixed,
                    scores: &mut s.scores,
                    positions,
                    top: &mut top,
                    inverse: &mut inverse,
                });
            }
            add(arch, &own.output, &s.attended, Start::Output, positions, t);
            own.norm.apply(arch, positions, t);
            apply(arch, &own.cross_query, t, positions, &mut s.projected);
            (&*s.projected, Start::Output)
        } else {
            (self.start_query.panel(panel), Start::Rows(self.start.panel(panel)))
        };
        for head in heads() {
            let query = &projected[head.clone()];
            arch.dispatch(Attention {
                query,
                keys: &s.anchor_keys,
                values: &s.anchor_values,
                head: head.clone(),
                mixture: if last { &self.mixture } else { &[] },
                mixed: &mut mixed,
                scores: &mut s.scores,
                positions,
                output: &mut s.attended[head.clone()],
                top: &mut top,
                inverse: &mut inverse,
            });
            if let Some(tally) = &mut tally {
                let (keys, scores) = (&s.anchor_keys, &mut *s.scores);
                arch.dispatch(Tally { query, keys, head, scores, positions, top: &top, inverse: &inverse, tally });
            }
        }
        add(arch, &layer.output, &s.attended, residual, positions, t);
        layer.norm.apply(arch, positions, t);
        PanelProduct {
            weights: &layer.widen,
            input: t,
            start: Start::Bias,
            activation: Activation::Relu,
            positions,
            output: &mut s.wide,
        }
        .run(arch);
        add(arch, &layer.narrow, &s.wide, Start::Output, positions, t);
        layer.final_norm.apply(arch, positions, t);
        mixed
    }

    /// Masks of one panel of queries.
    fn finish(&mut self, panel: usize, mixed: &Row, out: &mut Masks) {
        let s = &mut self.scratch;
        let positions = s.queries.held(panel);
        let t = s.queries.panel_mut(panel);
        self.norm.apply(self.arch, positions, t);
        apply(self.arch, &self.difference, t, positions, &mut s.logits);
        let from = panel * PANEL;
        let masks = out.mixture.iter_mut().zip(&mut out.difference).skip(from).take(positions);
        for (position, (mixture, difference)) in masks.enumerate() {
            *mixture = mixed.0[position] / self.heads as f32 + self.mixture_bias;
            // 2 sigmoid(x) - 1.
            *difference = (0.5 * s.logits[0].0[position]).tanh();
        }
        for (position, embedding) in out.embedding.chunks_exact_mut(t.len()).skip(from).take(positions).enumerate() {
            embedding.iter_mut().zip(&*t).for_each(|(e, row)| *e = row.0[position]);
        }
    }
}

impl NormWeights {
    fn apply(&self, arch: Arch, positions: usize, rows: &mut [Row]) {
        arch.dispatch(Norm { scale: &self.scale, bias: &self.bias, positions, rows });
    }
}

fn apply(arch: Arch, weights: &Weights, input: &[Row], positions: usize, output: &mut [Row]) {
    PanelProduct { weights, input, start: Start::Bias, activation: Activation::None, positions, output }.run(arch);
}

/// A product with weights that is added to `start`.
fn add(arch: Arch, weights: &Weights, input: &[Row], start: Start<'_>, positions: usize, output: &mut [Row]) {
    PanelProduct { weights, input, start, activation: Activation::None, positions, output }.run(arch);
}
