//! Shares of energy over frequency, closer than by octaves.

/// Shares at frequencies, straight lines between them over the logarithm of frequency and held beyond their ends.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curve(Vec<[f32; 2]>);

impl Curve {
    /// Of points `[hz, share]` in any order; without any the curve is none, and octaves hold.
    #[must_use]
    pub fn new(mut points: Vec<[f32; 2]>) -> Self {
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        Self(points)
    }

    /// Points `[hz, share]`, the lowest first.
    #[must_use]
    pub fn points(&self) -> &[[f32; 2]] {
        &self.0
    }

    /// The share at a frequency, if there is a curve.
    #[must_use]
    pub fn at(&self, hz: f64) -> Option<f64> {
        let (first, last) = (self.0.first()?, self.0.last()?);
        let place = hz.max(1e-3).log2();
        let of = |[hz, share]: [f32; 2]| (f64::from(hz).log2(), f64::from(share));
        let pair = self.0.windows(2).find(|pair| of(pair[0]).0 <= place && place <= of(pair[1]).0);
        Some(pair.map_or(f64::from(if place < of(*first).0 { first[1] } else { last[1] }), |pair| {
            let [(from, a), (to, b)] = [of(pair[0]), of(pair[1])];
            if to > from { a + (b - a) * (place - from) / (to - from) } else { a }
        }))
    }

    /// A curve of these shares, each changed with its frequency, Hz.
    #[must_use]
    pub fn map(&self, change: impl Fn(f32, f32) -> f32) -> Self {
        Self(self.0.iter().map(|[hz, share]| [*hz, change(*hz, *share)]).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_has_straight_lines_between_its_points_and_holds_beyond_them() {
        let curve = Curve::new(vec![[400.0, 0.5], [100.0, 0.1], [200.0, 0.3]]);
        for (hz, share) in [(20.0, 0.1), (100.0, 0.1), (141.42, 0.2), (282.84, 0.4), (9000.0, 0.5)] {
            assert!((curve.at(hz).unwrap() - share).abs() < 1e-4, "{hz}: {:?}", curve.at(hz));
        }
        assert_eq!(Curve::default().at(100.0), None);
    }
}
