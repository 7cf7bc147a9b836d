//! Frames: rows of values, neighbouring positions in neighbouring lanes, with zeros around them; and sums of weighted rows.

use crate::simd::{LANES, TILE, Tile, Weights, for_tiles, load, step};
use pulp::{Arch, Simd, WithSimd};

/// Zeros on either side of a row: further than any convolution reaches.
pub(crate) const MARGIN: usize = 16;

/// Frames of equal length, with [`MARGIN`] zeros before each and at least as many after it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Frames {
    values: Vec<f32>,
    len: usize,
    stride: usize,
}

impl Frames {
    pub(crate) fn new(rows: usize, len: usize) -> Self {
        let stride = len.next_multiple_of(LANES) + 2 * MARGIN;
        Self { values: vec![0.0; rows * stride], len, stride }
    }

    /// Positions of a row.
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// Number of rows.
    pub(crate) fn count(&self) -> usize {
        self.values.len() / self.stride
    }

    pub(crate) fn row(&self, row: usize) -> &[f32] {
        &self.padded(row)[MARGIN..][..self.len]
    }

    pub(crate) fn row_mut(&mut self, row: usize) -> &mut [f32] {
        let len = self.len;
        &mut self.padded_mut(row)[MARGIN..][..len]
    }

    /// A row with the zeros around it.
    #[inline(always)]
    pub(crate) fn padded(&self, row: usize) -> &[f32] {
        &self.values[row * self.stride..][..self.stride]
    }

    #[inline(always)]
    pub(crate) fn padded_mut(&mut self, row: usize) -> &mut [f32] {
        &mut self.values[row * self.stride..][..self.stride]
    }

    /// A row moved up by some positions, at most [`MARGIN`]: zeros come in from below.
    pub(crate) fn shifted(&self, row: usize, positions: usize) -> &[f32] {
        &self.padded(row)[MARGIN - positions..][..self.len]
    }

    /// Zeros after the last position, which whole vectors have written over.
    #[inline(always)]
    pub(crate) fn clear_after(&mut self, row: usize) {
        let end = MARGIN + self.len;
        self.padded_mut(row)[end..].fill(0.0);
    }

    pub(crate) fn clear(&mut self) {
        self.values.fill(0.0);
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &[f32]> {
        self.values.chunks_exact(self.stride).map(|r| &r[MARGIN..][..self.len])
    }

    pub(crate) fn blend(&mut self, from: &Self, to: &Self, fraction: f32) {
        blend(&mut self.values, &from.values, &to.values, fraction);
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        4 * self.values.len()
    }
}

/// `out = from + fraction (to - from)`.
pub(crate) fn blend(out: &mut [f32], from: &[f32], to: &[f32], fraction: f32) {
    for ((o, a), b) in out.iter_mut().zip(from).zip(to) {
        *o = a + fraction * (b - a);
    }
}

/// `out = sum over rows of weight times row`, from one row of a table on.
pub(crate) struct WeightedRows<'a> {
    pub(crate) weights: &'a [f32],
    pub(crate) table: &'a Frames,
    pub(crate) first: usize,
    pub(crate) out: &'a mut [f32],
}

impl WithSimd for WeightedRows<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        self.out.fill(0.0);
        for (row, w) in self.weights.iter().enumerate() {
            self.out.iter_mut().zip(self.table.row(self.first + row)).for_each(|(o, r)| *o += w * r);
        }
    }
}

/// Adds `sum over taps i and rows s of weights[i x.count() + s][o] * x[s] moved up by i positions` to every row o of `out`,
/// times a gate per position where there is one.
pub(crate) struct FrameProduct<'a> {
    pub(crate) weights: &'a Weights,
    pub(crate) x: &'a Frames,
    pub(crate) gate: Option<(&'a Frames, usize)>,
    pub(crate) out: &'a mut Frames,
}

impl FrameProduct<'_> {
    pub(crate) fn run(self, arch: Arch) {
        debug_assert!(self.out.count() == self.weights.outputs() && self.weights.inputs().is_multiple_of(self.x.count()));
        debug_assert!(self.out.len() == self.x.len());
        arch.dispatch(self);
    }
}

impl WithSimd for FrameProduct<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        for_tiles(simd, self.weights.outputs(), self.out.len, &mut self);
        for row in 0..self.out.count() {
            self.out.clear_after(row);
        }
    }
}

impl Tile for FrameProduct<'_> {
    #[inline(always)]
    fn tile<S: Simd, const O: usize, const V: usize>(&mut self, simd: S, output: usize, position: usize) {
        let weights = self.weights.tile(output / TILE);
        let within = output % TILE;
        let mut acc = [[simd.splat_f32s(0.0); V]; O];
        for (tap, weights) in weights.chunks_exact(self.x.count().max(1)).enumerate() {
            let at = MARGIN + position - tap;
            for (w, x) in weights.iter().zip(self.x.values.chunks_exact(self.x.stride)) {
                step(simd, &mut acc, &w[within..][..O], &x[at..][..V * S::F32_LANES]);
            }
        }
        let gate = self.gate.map(|(rows, row)| load::<S, V>(simd, &rows.padded(row)[MARGIN + position..]));
        for (o, acc) in acc.iter().enumerate() {
            if output + o == self.weights.outputs() {
                break;
            }
            let row = &mut self.out.padded_mut(output + o)[MARGIN + position..][..V * S::F32_LANES];
            let row = S::as_mut_simd_f32s(row).0;
            for (v, (r, a)) in row.iter_mut().zip(acc).enumerate() {
                *r = match &gate {
                    Some(gate) => simd.mul_add_e_f32s(gate[v], *a, *r),
                    None => simd.add_f32s(*r, *a),
                };
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::tests::arches;
    use promenade_testing::noise_at;

    #[test]
    fn a_product_adds_weighted_rows_moved_by_its_taps() {
        for arch in arches() {
            for (len, rows, outputs, taps) in [(257, 5, 8, 3), (40, 3, 13, 1), (33, 7, 1, 2), (1, 1, 3, 3)] {
                let mut x = Frames::new(rows, len);
                (0..rows).for_each(|r| (0..len).for_each(|i| x.row_mut(r)[i] = noise_at(1, r * len + i)));
                let mut gate = Frames::new(1, len);
                (0..len).for_each(|i| gate.row_mut(0)[i] = noise_at(3, i));
                let at = |k: usize, o: usize| noise_at(2, k * outputs + o);
                let weights = Weights::new(rows * taps, outputs, at);
                for gated in [false, true] {
                    let mut out = Frames::new(outputs, len);
                    (0..outputs).for_each(|o| out.row_mut(o).fill(0.5));
                    FrameProduct { weights: &weights, x: &x, gate: gated.then_some((&gate, 0)), out: &mut out }.run(arch);
                    for o in 0..outputs {
                        for i in 0..len {
                            let mut want = 0.0;
                            for tap in 0..taps.min(i + 1) {
                                want += (0..rows).map(|r| at(tap * rows + r, o) * x.row(r)[i - tap]).sum::<f32>();
                            }
                            let want = 0.5 + want * if gated { gate.row(0)[i] } else { 1.0 };
                            assert!((out.row(o)[i] - want).abs() < 1e-5, "{arch:?} {len} {o} {i}");
                        }
                        assert!(out.padded(o)[MARGIN + len..].iter().all(|v| *v == 0.0), "zeros stay around rows");
                    }
                }
            }
        }
    }
}
