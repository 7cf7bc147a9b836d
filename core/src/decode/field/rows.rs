//! Transfer functions of a field's nodes, whole or as few coefficients of common shapes.

use crate::render::transform::lanes::WeightedSum;
use crate::{TransferFunction, TransferShape};
use pulp::{Arch, Simd, WithSimd};
use std::borrow::Cow;
use std::ops::Range;

/// Level that stands for silence in rows of [`LowRank`], dB.
pub const SILENT_DB: f32 = -70.0;

/// The loudest level of [`LowRank`], dB: as loud as whole rows may be.
const LOUDEST_DB: f32 = 120.0;

/// What a field stores for each node.
#[derive(Clone, Debug, PartialEq)]
pub enum Rows {
    /// Rows of [`TransferFunction::to_row`].
    Whole(Vec<f32>),
    /// Coefficients.
    LowRank(LowRank),
}

/// A mean and shapes around it: `value = mean + sum_r c_r * shape_r`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Basis {
    /// Mean of all rows.
    pub mean: Vec<f32>,
    /// `[rank][len]`.
    pub shapes: Vec<f32>,
}

impl Basis {
    /// Number of shapes.
    #[must_use]
    pub fn rank(&self) -> usize {
        self.shapes.len().checked_div(self.mean.len()).unwrap_or(0)
    }

    fn expand(&self, coefficients: &[f32], range: Range<usize>, out: &mut [f32]) {
        Arch::new().dispatch(Expand { basis: self, coefficients, range, out });
    }
}

/// Works out a part of a row.
struct Expand<'a> {
    basis: &'a Basis,
    coefficients: &'a [f32],
    range: Range<usize>,
    out: &'a mut [f32],
}

impl WithSimd for Expand<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { basis, coefficients, range, out } = self;
        out.copy_from_slice(&basis.mean[range.clone()]);
        let (vectors, rest) = S::as_mut_simd_f32s(out);
        for (c, shape) in coefficients.iter().zip(basis.shapes.chunks_exact(basis.mean.len().max(1))) {
            let (shapes, of_rest) = S::as_simd_f32s(&shape[range.clone()]);
            let all = simd.splat_f32s(*c);
            // Rounded as the rest is: a value does not depend on the part that it is worked out in.
            for (out, shape) in vectors.iter_mut().zip(shapes) {
                *out = simd.add_f32s(*out, simd.mul_f32s(all, *shape));
            }
            for (out, shape) in rest.iter_mut().zip(of_rest) {
                *out += c * shape;
            }
        }
    }
}

/// Rows as coefficients over two bases: levels of both ears over frequency, and gains of the time filters.
///
/// Levels are in dB, so that what is interpolated between nodes is magnitude in the measure that is heard; phase and delay are
/// 0.
#[derive(Clone, Debug, PartialEq)]
pub struct LowRank {
    /// Level of each ear, `[ear][bin]`, dB, no lower than [`SILENT_DB`].
    pub levels: Basis,
    /// Gains of the taps and of the late part, `[tap][ear][band]`, linear amplitude.
    pub taps: Basis,
    /// `[node][levels.rank + taps.rank]`.
    pub coefficients: Vec<f32>,
}

impl LowRank {
    fn row_len(&self) -> usize {
        self.levels.rank() + self.taps.rank()
    }
}

impl Rows {
    /// The rows of [`TransferFunction::to_row`], worked out where there are coefficients of time filters alone; `None` for
    /// coefficients of levels.
    pub(crate) fn whole(&self, shape: &TransferShape) -> Option<Cow<'_, [f32]>> {
        let low = match self {
            Self::Whole(rows) => return Some(rows.into()),
            Self::LowRank(low) if shape.bins == 0 => low,
            Self::LowRank(_) => return None,
        };
        let (rank, len) = (low.taps.rank(), low.taps.mean.len());
        let mut rows = Vec::with_capacity(low.coefficients.len() / rank.max(1) * shape.row_len());
        for coefficients in low.coefficients.chunks_exact(rank.max(1)) {
            // No delay.
            rows.push(0.0);
            let from = rows.len();
            rows.resize(from + len, 0.0);
            low.taps.expand(coefficients, 0..len, &mut rows[from..]);
            rows[from..].iter_mut().for_each(|v| *v = v.max(0.0));
        }
        Some(rows.into())
    }

    /// Whether the rows fit a number of nodes and a shape.
    pub(super) fn fit(&self, nodes: usize, shape: &TransferShape) -> bool {
        let basis =
            |b: &Basis, len: usize| b.mean.len() == len && (len > 0 || b.shapes.is_empty()) && b.shapes.len() == b.rank() * len;
        match self {
            Self::Whole(rows) => rows.len() == nodes * shape.row_len(),
            Self::LowRank(low) => {
                basis(&low.levels, 2 * shape.bins)
                    && basis(&low.taps, shape.tap_len() * (shape.taps + 1))
                    && low.row_len() > 0
                    && low.coefficients.len() == nodes * low.row_len()
            }
        }
    }

    /// All stored numbers.
    pub(crate) fn values(&self) -> impl Iterator<Item = &[f32]> {
        let parts: [&[f32]; 5] = match self {
            Self::Whole(rows) => [rows, &[], &[], &[], &[]],
            Self::LowRank(l) => [&l.coefficients, &l.levels.mean, &l.levels.shapes, &l.taps.mean, &l.taps.shapes],
        };
        parts.into_iter()
    }

    /// Room that [`Rows::masks`] and [`Rows::taps`] work in.
    pub(super) fn scratch(&self) -> Vec<f32> {
        match self {
            Self::Whole(_) => Vec::new(),
            Self::LowRank(low) => vec![0.0; low.row_len()],
        }
    }

    /// Blends masks, phase and delay of the direct sound, before any change with distance.
    pub(super) fn masks(&self, shape: &TransferShape, corners: &[(u32, f32)], scratch: &mut [f32], out: &mut TransferFunction) {
        let bins = shape.bins;
        match self {
            Self::Whole(rows) => {
                let part = |range: Range<usize>, out: &mut [f32]| blend(rows, corners, shape.row_len(), range, out);
                part(0..bins, &mut out.mixture);
                part(bins..2 * bins, &mut out.difference);
                part(2 * bins..4 * bins, &mut out.phase);
                let mut delay = [0.0];
                part(4 * bins..4 * bins + 1, &mut delay);
                out.delay_s = delay[0];
            }
            Self::LowRank(low) => {
                let rank = low.levels.rank();
                blend(&low.coefficients, corners, low.row_len(), 0..rank, &mut scratch[..rank]);
                low.levels.expand(&scratch[..rank], 0..bins, &mut out.mixture);
                low.levels.expand(&scratch[..rank], bins..2 * bins, &mut out.difference);
                for (m, d) in out.mixture.iter_mut().zip(&mut out.difference) {
                    let (left, right) = (amplitude(*m), amplitude(*d));
                    let sum = left + right;
                    (*m, *d) = (0.5 * sum, if sum > 0.0 { (right - left) / sum } else { 0.0 });
                }
                out.phase.fill(0.0);
                out.delay_s = 0.0;
            }
        }
    }

    /// Blends time-filter gains of some taps; the tap after the last explicit one is the late part.
    pub(super) fn taps(
        &self,
        shape: &TransferShape,
        corners: &[(u32, f32)],
        taps: Range<usize>,
        scratch: &mut [f32],
        out: &mut TransferFunction,
    ) {
        let len = shape.tap_len();
        let explicit = taps.start.min(shape.taps)..taps.end.min(shape.taps);
        let with_late = taps.end > shape.taps;
        let explicit = explicit.start * len..explicit.end * len;
        let late = shape.taps * len..(shape.taps + 1) * len;
        match self {
            Self::Whole(rows) => {
                let first = shape.direct_len();
                let part = |r: Range<usize>, out: &mut [f32]| {
                    blend(rows, corners, shape.row_len(), first + r.start..first + r.end, out);
                };
                part(explicit.clone(), &mut out.taps[explicit]);
                if with_late {
                    part(late, &mut out.late);
                }
            }
            Self::LowRank(low) => {
                let (from, rank) = (low.levels.rank(), low.taps.rank());
                let coefficients = &mut scratch[..rank];
                blend(&low.coefficients, corners, low.row_len(), from..from + rank, coefficients);
                let positive = |values: &mut [f32]| values.iter_mut().for_each(|v| *v = v.max(0.0));
                low.taps.expand(coefficients, explicit.clone(), &mut out.taps[explicit.clone()]);
                positive(&mut out.taps[explicit]);
                if with_late {
                    low.taps.expand(coefficients, late, &mut out.late);
                    positive(&mut out.late);
                }
            }
        }
    }
}

/// Linear amplitude of a level; the level of silence is 0.
fn amplitude(db: f32) -> f32 {
    const OCTAVES_PER_DB: f32 = std::f32::consts::LOG2_10 / 20.0;
    if db <= SILENT_DB { 0.0 } else { (OCTAVES_PER_DB * db.min(LOUDEST_DB)).exp2() }
}

fn blend(rows: &[f32], corners: &[(u32, f32)], row_len: usize, part: Range<usize>, out: &mut [f32]) {
    debug_assert_eq!(part.len(), out.len());
    Arch::new().dispatch(WeightedSum { rows, corners, row_len, offset: part.start, out });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_level_is_louder_than_whole_rows_may_be() {
        assert_eq!([SILENT_DB, -1e12].map(amplitude), [0.0; 2]);
        for db in [LOUDEST_DB, 1e3, 1e12, f32::INFINITY] {
            assert!((amplitude(db) - 1e6).abs() < 10.0, "{db}");
        }
    }
}
