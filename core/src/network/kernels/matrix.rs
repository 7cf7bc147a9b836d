//! Matrices in double precision, for folding weights when a decoder is made.

use crate::number::single;
use crate::simd::Weights;
use std::ops::Range;

/// Row by row.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Matrix {
    values: Vec<f64>,
    cols: usize,
}

impl Matrix {
    /// From rows of `cols` values one after the other.
    pub(crate) fn new(values: impl Iterator<Item = f64>, cols: usize) -> Self {
        Self { values: values.collect(), cols }
    }

    /// From stored weights, `[output][input]`.
    pub(crate) fn from_weights(values: &[f32], cols: usize) -> Self {
        Self::new(values.iter().map(|v| f64::from(*v)), cols)
    }

    pub(crate) fn rows(&self) -> usize {
        self.values.len() / self.cols
    }

    pub(crate) fn cols(&self) -> usize {
        self.cols
    }

    pub(crate) fn row(&self, row: usize) -> &[f64] {
        &self.values[row * self.cols..][..self.cols]
    }

    pub(crate) fn row_mut(&mut self, row: usize) -> &mut [f64] {
        &mut self.values[row * self.cols..][..self.cols]
    }

    pub(crate) fn at(&self, row: usize, col: usize) -> f64 {
        self.values[row * self.cols + col]
    }

    /// Some of the rows.
    pub(crate) fn some_rows(&self, rows: Range<usize>) -> Self {
        Self::new(self.values[rows.start * self.cols..rows.end * self.cols].iter().copied(), self.cols)
    }

    /// Some of the columns.
    pub(crate) fn some_cols(&self, cols: Range<usize>) -> Self {
        let values = self.values.chunks_exact(self.cols).flat_map(|row| &row[cols.clone()]).copied();
        Self::new(values, cols.len())
    }

    pub(crate) fn transposed(&self) -> Self {
        Self::new((0..self.cols).flat_map(|c| (0..self.rows()).map(move |r| self.at(r, c))), self.rows())
    }

    pub(crate) fn map(mut self, f: impl Fn(f64) -> f64) -> Self {
        self.values.iter_mut().for_each(|v| *v = f(*v));
        self
    }

    /// The matrix product.
    pub(crate) fn times(&self, other: &Self) -> Self {
        let mut product = Self { values: vec![0.0; self.rows() * other.cols], cols: other.cols };
        for (row, out) in self.values.chunks_exact(self.cols).zip(product.values.chunks_exact_mut(other.cols)) {
            for (factor, row) in row.iter().zip(other.values.chunks_exact(other.cols)) {
                out.iter_mut().zip(row).for_each(|(o, v)| *o += factor * v);
            }
        }
        product
    }

    /// The product with a column.
    pub(crate) fn apply(&self, column: &[f64]) -> Vec<f64> {
        self.values.chunks_exact(self.cols).map(|row| dot(row, column)).collect()
    }

    /// A linear layer, weights `[output][input]`, on every row.
    pub(crate) fn linear(&self, weights: &Self, bias: &[f64]) -> Self {
        let mut out = self.times(&weights.transposed());
        for row in out.values.chunks_exact_mut(weights.rows()) {
            row.iter_mut().zip(bias).for_each(|(o, b)| *o += b);
        }
        out
    }

    /// The matrix, `[output][input]`, and a bias per output as the weights of a product.
    pub(crate) fn weights(&self, bias: &[f64]) -> Weights {
        let mut weights = Weights::new(self.cols, self.rows(), |input, output| single(self.at(output, input)));
        weights.set_bias(&bias.iter().map(|b| single(*b)).collect::<Vec<_>>());
        weights
    }

    /// The sum with a matrix of the same shape.
    pub(crate) fn plus(mut self, other: &Self) -> Self {
        self.values.iter_mut().zip(&other.values).for_each(|(a, b)| *a += b);
        self
    }
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
