//! Storage of activations.

use crate::number::single;
use pulp::Simd;

/// Positions side by side in a panel.
pub(crate) const PANEL: usize = 32;

/// One feature at the positions of a panel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(64))]
pub(crate) struct Row(pub(crate) [f32; PANEL]);

impl Row {
    /// `V` vectors, from number `first` on.
    #[inline(always)]
    pub(crate) fn load<S: Simd, const V: usize>(&self, _simd: S, first: usize) -> [S::f32s; V] {
        let vectors = S::as_simd_f32s(&self.0).0;
        // The smaller of both is always `first`; it shows that the loads lie in the row.
        let first = first.min(PANEL / S::F32_LANES - V);
        let mut values = [vectors[first]; V];
        values.copy_from_slice(&vectors[first..first + V]);
        values
    }

    /// Writes `V` vectors, from number `first` on.
    #[inline(always)]
    pub(crate) fn store<S: Simd, const V: usize>(&mut self, _simd: S, first: usize, values: [S::f32s; V]) {
        let vectors = S::as_mut_simd_f32s(&mut self.0).0;
        let first = first.min(PANEL / S::F32_LANES - V);
        vectors[first..first + V].copy_from_slice(&values);
    }
}

/// Features of many positions, `[panel][feature][position]`; values after the last position are finite and mean nothing.
pub(crate) struct Panels {
    rows: Vec<Row>,
    features: usize,
    positions: usize,
}

impl Panels {
    /// All zero.
    pub(crate) fn new(features: usize, positions: usize) -> Self {
        Self { rows: vec![Row::default(); features * positions.div_ceil(PANEL)], features, positions }
    }

    /// From `value(position, feature)`.
    pub(crate) fn from_fn(features: usize, positions: usize, value: impl Fn(usize, usize) -> f64) -> Self {
        let mut panels = Self::new(features, positions);
        for position in 0..positions {
            for (feature, row) in panels.panel_mut(position / PANEL).iter_mut().enumerate() {
                row.0[position % PANEL] = single(value(position, feature));
            }
        }
        panels
    }

    pub(crate) fn positions(&self) -> usize {
        self.positions
    }

    /// Number of panels.
    pub(crate) fn count(&self) -> usize {
        self.positions.div_ceil(PANEL)
    }

    /// Positions that a panel holds.
    pub(crate) fn held(&self, panel: usize) -> usize {
        (self.positions - panel * PANEL).min(PANEL)
    }

    /// Rows of a panel, one per feature.
    pub(crate) fn panel(&self, panel: usize) -> &[Row] {
        &self.rows[panel * self.features..][..self.features]
    }

    pub(crate) fn panel_mut(&mut self, panel: usize) -> &mut [Row] {
        &mut self.rows[panel * self.features..][..self.features]
    }

    /// All panels with the rows of each.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &[Row]> {
        self.rows.chunks_exact(self.features)
    }
}
