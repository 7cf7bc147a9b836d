//! What needs no room: predictions that any fit has to be compared with.

use crate::measurements::{Figures, Measurement, Measurements, distance};

/// A prediction without a room.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Baseline {
    /// The response of the nearest place.
    Nearest,
    /// The mean figure of all places.
    Mean,
    /// Each figure a line over the logarithm of the distance from the source.
    LogDistance,
}

impl Baseline {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Nearest, Self::Mean, Self::LogDistance];

    /// How it is called in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Nearest => "nearest",
            Self::Mean => "mean",
            Self::LogDistance => "regression on log distance",
        }
    }

    /// Figures at a place, of measurements elsewhere and their figures; none of no measurements.
    #[must_use]
    pub fn predict(self, at: &Measurement, train: &Measurements, figures: &[Figures]) -> Option<Figures> {
        let nearest = (0..train.all.len()).min_by(|a, b| apart(at, &train.all[*a]).total_cmp(&apart(at, &train.all[*b])))?;
        match self {
            Self::Nearest => Some(figures[nearest].clone()),
            Self::Mean => Figures::mean(figures),
            Self::LogDistance => {
                let rows: Vec<Vec<f64>> = figures.iter().map(Figures::row).collect();
                let x: Vec<f64> = train.all.iter().map(|m| m.distance_m().ln()).collect();
                let row = (0..rows[0].len()).map(|i| {
                    let points = x.iter().zip(&rows).map(|(x, row)| (*x, row[i]));
                    let points: Vec<(f64, f64)> = points.filter(|p| p.1.is_finite()).collect();
                    line_at(&points, at.distance_m().ln())
                });
                Some(figures[0].with_row(&row.collect::<Vec<f64>>()))
            }
        }
    }
}

/// How far two measurements are apart: both their source and their microphone may have moved.
fn apart(a: &Measurement, b: &Measurement) -> f64 {
    distance(a.source.at_m, b.source.at_m).hypot(distance(a.microphone.at_m, b.microphone.at_m))
}

/// A line of least squares at a place; where all points have one x, their mean.
fn line_at(points: &[(f64, f64)], x: f64) -> f64 {
    let n = points.len() as f64;
    let (mean_x, mean_y) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let spread: f64 = points.iter().map(|p| (p.0 - mean_x).powi(2)).sum();
    let slope = if spread > 1e-9 { points.iter().map(|p| (p.0 - mean_x) * (p.1 - mean_y)).sum::<f64>() / spread } else { 0.0 };
    mean_y + slope * (x - mean_x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_goes_through_its_points() {
        let points = [(0.0, 1.0), (1.0, 3.0), (2.0, 5.0)];
        assert!((line_at(&points, 3.0) - 7.0).abs() < 1e-12);
        assert!((line_at(&[(1.0, 2.0), (1.0, 4.0)], 9.0) - 3.0).abs() < 1e-12);
        assert!(line_at(&[], 0.0).is_nan());
    }
}
