//! Vectors of three coordinates.

pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(super) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `a + by * b`.
pub(super) fn along(a: [f64; 3], by: f64, b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| a[i] + by * b[i])
}

/// `a - b`.
pub(super) fn less(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| a[i] - b[i])
}
