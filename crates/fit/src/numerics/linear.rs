//! Small systems of linear equations.

use nalgebra::{DMatrix, DVector};

/// Solves a symmetric, positive system by Cholesky's decomposition, and gives the diagonal of its inverse; `None` if it is not
/// positive.
pub(crate) fn solve(matrix: &[Vec<f64>], right: &[f64]) -> Option<(Vec<f64>, Vec<f64>)> {
    let n = right.len();
    let decomposed = DMatrix::from_fn(n, n, |i, j| matrix[i][j]).cholesky()?;
    let solution = decomposed.solve(&DVector::from_column_slice(right));
    Some((solution.as_slice().to_vec(), decomposed.inverse().diagonal().as_slice().to_vec()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_system_by_hand() {
        let (x, inverse) = solve(&[vec![4.0, 2.0], vec![2.0, 3.0]], &[10.0, 9.0]).unwrap();
        assert!((x[0] - 1.5).abs() < 1e-12 && (x[1] - 2.0).abs() < 1e-12);
        assert!((inverse[0] - 3.0 / 8.0).abs() < 1e-12 && (inverse[1] - 0.5).abs() < 1e-12);
        assert!(solve(&[vec![0.0]], &[1.0]).is_none());
    }
}
