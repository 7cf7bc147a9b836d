//! Where a response begins.

/// First sample whose magnitude is above 10 % of the peak; `None` for silence or an empty slice.
#[must_use]
pub fn onset(response: &[f32]) -> Option<usize> {
    let peak = response.iter().fold(0.0_f64, |m, &v| m.max(f64::from(v).abs()));
    if peak <= 0.0 || !peak.is_finite() {
        return None;
    }
    response.iter().position(|&v| f64::from(v).abs() > 0.1 * peak)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_first_loud_sample() {
        assert_eq!(onset(&[0.0, 0.05, -0.2, 1.0]), Some(2));
        assert_eq!(onset(&[0.0; 8]), None);
        assert_eq!(onset(&[]), None);
    }
}
