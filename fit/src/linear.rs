//! Small systems of linear equations.

/// Solves a symmetric, positive system by Cholesky's decomposition, and gives the diagonal of its inverse; `None` if it is not
/// positive.
pub(crate) fn solve(matrix: &[Vec<f64>], right: &[f64]) -> Option<(Vec<f64>, Vec<f64>)> {
    let n = right.len();
    let mut lower = vec![vec![0.0; n]; n];
    for i in 0..n {
        for j in 0..=i {
            let sum: f64 = matrix[i][j] - (0..j).map(|k| lower[i][k] * lower[j][k]).sum::<f64>();
            lower[i][j] = if i == j {
                if sum.is_nan() || sum <= 0.0 {
                    return None;
                }
                sum.sqrt()
            } else {
                sum / lower[j][j]
            };
        }
    }
    let substitute = |b: &[f64]| {
        let mut y = b.to_vec();
        for i in 0..n {
            y[i] = (y[i] - (0..i).map(|k| lower[i][k] * y[k]).sum::<f64>()) / lower[i][i];
        }
        for i in (0..n).rev() {
            y[i] = (y[i] - (i + 1..n).map(|k| lower[k][i] * y[k]).sum::<f64>()) / lower[i][i];
        }
        y
    };
    let diagonal = (0..n).map(|i| {
        let mut unit = vec![0.0; n];
        unit[i] = 1.0;
        substitute(&unit)[i]
    });
    Some((substitute(right), diagonal.collect()))
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
