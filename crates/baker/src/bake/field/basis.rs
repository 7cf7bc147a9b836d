//! Common shapes of many rows: principal components.

use nalgebra::{DMatrix, SymmetricEigen};
use promenade_core::{Basis, SILENT_DB, TransferFunction};

/// Shapes that are kept at most.
const MOST_SHAPES: usize = 64;

/// Level of both ears, `[ear][bin]`, dB, no lower than silence.
pub(crate) fn levels_db(tf: &TransferFunction) -> Vec<f32> {
    let level = |sign: f32| {
        tf.mixture
            .iter()
            .zip(&tf.difference)
            .map(move |(m, d)| (20.0 * (m * (1.0 + sign * d)).max(1e-9).log10()).max(SILENT_DB))
    };
    level(-1.0).chain(level(1.0)).collect()
}

/// Mean and orthonormal shapes of rows of one length.
pub(crate) struct Shapes {
    mean: Vec<f32>,
    /// `[rank][len]`.
    shapes: Vec<Vec<f32>>,
}

impl Shapes {
    /// The fewest principal components that leave at most `residual` of root mean square in the rows (Jolliffe 2002, section
    /// 6.1).
    ///
    /// Worked out from the rows' inner products, of which there are fewer than of their columns'.
    pub(crate) fn of(rows: &[Vec<f32>], residual: f64) -> Self {
        let (n, len) = (rows.len(), rows.first().map_or(0, Vec::len));
        let mut mean = vec![0.0_f64; len];
        for row in rows {
            mean.iter_mut().zip(row).for_each(|(m, v)| *m += f64::from(*v) / n as f64);
        }
        let centred = DMatrix::from_fn(n, len, |i, k| f64::from(rows[i][k]) - mean[k]);
        let eigen = SymmetricEigen::new(&centred * centred.transpose());
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        let mut left: f64 = eigen.eigenvalues.iter().map(|v| v.max(0.0)).sum();
        let allowed = residual * residual * (n * len) as f64;
        let mut shapes = Vec::new();
        for component in order.into_iter().take(MOST_SHAPES) {
            let energy = eigen.eigenvalues[component].max(0.0);
            if left <= allowed || energy <= 0.0 {
                break;
            }
            left -= energy;
            let shape = centred.tr_mul(&eigen.eigenvectors.column(component)) / energy.sqrt();
            shapes.push(shape.iter().map(|v| narrow(*v)).collect());
        }
        Self { mean: mean.into_iter().map(narrow).collect(), shapes }
    }

    pub(crate) fn rank(&self) -> usize {
        self.shapes.len()
    }

    pub(crate) fn len(&self) -> usize {
        self.mean.len()
    }

    /// Numbers that are stored.
    pub(crate) fn values(&self) -> usize {
        (1 + self.rank()) * self.len()
    }

    /// How much of each shape a row has.
    pub(crate) fn coefficients(&self, row: &[f32]) -> Vec<f32> {
        let dot = |shape: &Vec<f32>| {
            let pairs = row.iter().zip(&self.mean).zip(shape);
            narrow(pairs.map(|((v, m), s)| f64::from(v - m) * f64::from(*s)).sum())
        };
        self.shapes.iter().map(dot).collect()
    }

    pub(crate) fn into_basis(self) -> Basis {
        Basis { mean: self.mean, shapes: self.shapes.concat() }
    }
}

fn narrow(x: f64) -> f32 {
    x as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_two_shapes_need_two() {
        let rows: Vec<Vec<f32>> = (0..40)
            .map(|i| {
                let (a, b) = ((i as f32 * 0.7).sin(), (i as f32 * 1.9).cos());
                (0..9).map(|k| 5.0 + a * k as f32 + b * (k as f32 * 0.5).sin()).collect()
            })
            .collect();
        let shapes = Shapes::of(&rows, 1e-4);
        assert_eq!(shapes.rank(), 2);
        let coefficients = shapes.coefficients(&rows[7]);
        let basis = shapes.into_basis();
        for (k, want) in rows[7].iter().enumerate() {
            let found = basis.mean[k] + coefficients.iter().enumerate().map(|(r, c)| c * basis.shapes[9 * r + k]).sum::<f32>();
            assert!((found - want).abs() < 1e-3, "{k}: {found} for {want}");
        }
    }

    #[test]
    fn equal_rows_need_none() {
        assert_eq!(Shapes::of(&vec![vec![1.0, 2.0]; 5], 1e-3).rank(), 0);
    }
}
