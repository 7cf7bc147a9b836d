//! Frames of values with zeros around them, neighbouring positions in neighbouring lanes, and sums of weighted rows.

use pulp::{Arch, Simd, WithSimd};

/// Zeros on either side of a row: further than any convolution reaches.
pub(crate) const MARGIN: usize = 16;
/// The widest vector there is: rows are as long as whole vectors of it.
const WIDEST: usize = 16;
/// Outputs whose weights lie side by side.
pub(crate) const OUTPUTS: usize = 8;

/// Frames of equal length, with [`MARGIN`] zeros before each and at least as many after it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Frames {
    values: Vec<f32>,
    len: usize,
    stride: usize,
}

impl Frames {
    pub(crate) fn new(rows: usize, len: usize) -> Self {
        let stride = len.next_multiple_of(WIDEST) + 2 * MARGIN;
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

    /// Two rows, the first of which comes before or after the second.
    #[inline(always)]
    pub(crate) fn pair_mut(&mut self, a: usize, b: usize) -> [&mut [f32]; 2] {
        let (stride, len) = (self.stride, self.len);
        let (low, high) = self.values.split_at_mut(a.max(b) * stride);
        let (low, high) = (&mut low[a.min(b) * stride + MARGIN..][..len], &mut high[MARGIN..][..len]);
        if a < b { [low, high] } else { [high, low] }
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

/// A matrix in the order that a [`Product`] reads it: `[output / OUTPUTS][input][OUTPUTS]`.
#[derive(Clone, Debug)]
pub(crate) struct Weights {
    packed: Vec<f32>,
    inputs: usize,
    outputs: usize,
}

impl Weights {
    pub(crate) fn new(inputs: usize, outputs: usize, at: impl Fn(usize, usize) -> f32) -> Self {
        let mut w = Self { packed: vec![0.0; outputs.next_multiple_of(OUTPUTS) * inputs], inputs, outputs };
        w.set(at);
        w
    }

    /// Takes other values, by input and output.
    pub(crate) fn set(&mut self, at: impl Fn(usize, usize) -> f32) {
        let outputs = self.outputs;
        for (tile, block) in self.packed.chunks_exact_mut((self.inputs * OUTPUTS).max(1)).enumerate() {
            for (input, w) in block.as_chunks_mut::<OUTPUTS>().0.iter_mut().enumerate() {
                for (o, w) in w.iter_mut().enumerate().take(outputs - tile * OUTPUTS) {
                    *w = at(input, tile * OUTPUTS + o);
                }
            }
        }
    }

    /// Takes a matrix that lies in rows, `[input][output]`.
    pub(crate) fn set_rows(&mut self, rows: &Frames) {
        debug_assert!(rows.count() == self.inputs && rows.len() == self.outputs);
        for (tile, block) in self.packed.chunks_exact_mut((self.inputs * OUTPUTS).max(1)).enumerate() {
            for (w, input) in block.as_chunks_mut::<OUTPUTS>().0.iter_mut().zip(0..) {
                w.copy_from_slice(&rows.padded(input)[MARGIN + tile * OUTPUTS..][..OUTPUTS]);
            }
        }
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        4 * self.packed.len()
    }
}

/// Adds `sum over taps i and rows s of weights[i x.count() + s][o] * x[s] moved up by i positions` to every row o of `out`,
/// times a gate per position where there is one.
pub(crate) struct Product<'a> {
    pub(crate) weights: &'a Weights,
    pub(crate) x: &'a Frames,
    pub(crate) gate: Option<(&'a Frames, usize)>,
    pub(crate) out: &'a mut Frames,
}

impl Product<'_> {
    pub(crate) fn run(self, arch: Arch) {
        debug_assert!(self.out.count() == self.weights.outputs && self.weights.inputs.is_multiple_of(self.x.count()));
        debug_assert!(self.out.len() == self.x.len());
        arch.dispatch(self);
    }
}

impl WithSimd for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        for_tiles(simd, self.weights.outputs, self.out.len, &mut self);
        for row in 0..self.out.count() {
            self.out.clear_after(row);
        }
    }
}

impl Tile for Product<'_> {
    #[inline(always)]
    fn tile<S: Simd, const O: usize, const V: usize>(&mut self, simd: S, output: usize, position: usize) {
        let weights = &self.weights.packed[output / OUTPUTS * OUTPUTS * self.weights.inputs..][..OUTPUTS * self.weights.inputs];
        let within = output % OUTPUTS;
        let mut acc = [[simd.splat_f32s(0.0); V]; O];
        for (tap, weights) in weights.chunks_exact((OUTPUTS * self.x.count()).max(1)).enumerate() {
            let at = MARGIN + position - tap;
            for (w, x) in weights.as_chunks::<OUTPUTS>().0.iter().zip(self.x.values.chunks_exact(self.x.stride)) {
                step(simd, &mut acc, &w[within..][..O], &x[at..][..V * S::F32_LANES]);
            }
        }
        let gate = self.gate.map(|(rows, row)| load::<S, V>(simd, &rows.padded(row)[MARGIN + position..]));
        for (o, acc) in acc.iter().enumerate() {
            if output + o == self.weights.outputs {
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

/// Work on some outputs by some vectors of positions, all of whose sums fit the registers.
pub(crate) trait Tile {
    /// Works on `O` outputs and `V` vectors.
    fn tile<S: Simd, const O: usize, const V: usize>(&mut self, simd: S, output: usize, position: usize);
}

/// Covers all outputs, a multiple of [`OUTPUTS`] or a little less, and positions.
#[inline(always)]
pub(crate) fn for_tiles<S: Simd>(simd: S, outputs: usize, positions: usize, op: &mut impl Tile) {
    let vectors = positions.div_ceil(S::F32_LANES);
    // Three vectors of sums for each output, three of input and a weight: 28 of 32 registers, or all of 16.
    let threes = vectors / 3;
    for three in 0..threes {
        let position = 3 * three * S::F32_LANES;
        if S::REGISTER_COUNT >= 32 {
            for output in (0..outputs).step_by(8) {
                op.tile::<S, 8, 3>(simd, output, position);
            }
        } else {
            for output in (0..outputs).step_by(4) {
                op.tile::<S, 4, 3>(simd, output, position);
            }
        }
    }
    let position = 3 * threes * S::F32_LANES;
    for output in (0..outputs).step_by(4) {
        match vectors % 3 {
            2 => op.tile::<S, 4, 2>(simd, output, position),
            1 => op.tile::<S, 4, 1>(simd, output, position),
            _ => {}
        }
    }
}

/// Covers all positions of `O` outputs that are too few for [`for_tiles`].
#[inline(always)]
pub(crate) fn for_few<S: Simd, const O: usize>(simd: S, positions: usize, op: &mut impl Tile) {
    let vectors = positions.div_ceil(S::F32_LANES);
    let sixes = vectors / 6;
    for six in 0..sixes {
        op.tile::<S, O, 6>(simd, 0, 6 * six * S::F32_LANES);
    }
    let position = 6 * sixes * S::F32_LANES;
    match vectors % 6 {
        5 => op.tile::<S, O, 5>(simd, 0, position),
        4 => op.tile::<S, O, 4>(simd, 0, position),
        3 => op.tile::<S, O, 3>(simd, 0, position),
        2 => op.tile::<S, O, 2>(simd, 0, position),
        1 => op.tile::<S, O, 1>(simd, 0, position),
        _ => {}
    }
}

/// Adds weights times one stretch of a row to the sums of a tile.
#[inline(always)]
pub(crate) fn step<S: Simd, const O: usize, const V: usize>(simd: S, acc: &mut [[S::f32s; V]; O], weights: &[f32], x: &[f32]) {
    let x = load::<S, V>(simd, x);
    for (acc, w) in acc.iter_mut().zip(weights) {
        let w = simd.splat_f32s(*w);
        for (a, x) in acc.iter_mut().zip(&x) {
            *a = simd.mul_add_e_f32s(w, *x, *a);
        }
    }
}

/// The first vectors of a slice.
#[inline(always)]
pub(crate) fn load<S: Simd, const V: usize>(simd: S, x: &[f32]) -> [S::f32s; V] {
    let mut vectors = [simd.splat_f32s(0.0); V];
    for (v, x) in vectors.iter_mut().zip(S::as_simd_f32s(&x[..V * S::F32_LANES]).0) {
        *v = *x;
    }
    vectors
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use promenade_testing::noise_at;

    /// Every instruction set that the running machine has.
    pub(crate) fn arches() -> Vec<Arch> {
        let mut all = vec![Arch::Scalar];
        #[cfg(target_arch = "x86_64")]
        {
            match pulp::x86::V3::try_new() {
                Some(v3) => all.push(Arch::V3(v3)),
                None => println!("no AVX2 here: not tested"),
            }
            match pulp::x86::V4::try_new() {
                Some(v4) => all.push(Arch::V4(v4)),
                None => println!("no AVX-512 here: not tested"),
            }
        }
        #[cfg(not(target_arch = "x86_64"))]
        all.push(Arch::new());
        all
    }

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
                    Product { weights: &weights, x: &x, gate: gated.then_some((&gate, 0)), out: &mut out }.run(arch);
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
