//! Medians and quantiles. Values are ordered as [`f64::total_cmp`] orders them; none of them is left out.

/// The middle value, or the mean of the two middle ones of an even number; `None` of no values.
#[must_use]
pub fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut all: Vec<f64> = values.into_iter().collect();
    let middle = all.len() / 2;
    let even = all.len().is_multiple_of(2);
    let (below, upper, _) = (!all.is_empty()).then(|| all.select_nth_unstable_by(middle, f64::total_cmp))?;
    let lower = below.iter().copied().filter(|_| even).max_by(f64::total_cmp);
    Some(lower.map_or(*upper, |lower| 0.5 * (lower + *upper)))
}

/// The middle value, or the upper of the two middle ones of an even number: always one of the values. `None` of no values.
#[must_use]
pub fn median_high(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut all: Vec<f64> = values.into_iter().collect();
    let middle = all.len() / 2;
    (!all.is_empty()).then(|| *all.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// The value below which a share from 0 to 1 of rising values lies, along straight lines between them; `None` of no values.
#[must_use]
pub fn quantile(rising: &[f64], share: f64) -> Option<f64> {
    let last = rising.len().checked_sub(1)?;
    let place = share.clamp(0.0, 1.0) * last as f64;
    let below = place.floor() as usize;
    let (lower, upper) = (rising[below], rising[(below + 1).min(last)]);
    Some(lower + (upper - lower) * place.fract())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_of_odd_and_even_numbers() {
        assert_eq!(median([3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median([4.0, 1.0, 2.0, 3.0]), Some(2.5));
        assert_eq!(median([]), None);
        assert_eq!(median_high([3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median_high([4.0, 1.0, 2.0, 3.0]), Some(3.0));
        assert_eq!(median_high([]), None);
    }

    #[test]
    fn quantiles_are_interpolated() {
        let rising = [1.0, 2.0, 3.0, 5.0];
        assert_eq!([0.0, 0.5, 0.9, 1.0].map(|share| quantile(&rising, share)), [1.0, 2.5, 4.4, 5.0].map(Some));
        assert_eq!(quantile(&[7.0], 0.3), Some(7.0));
        assert_eq!(quantile(&[], 0.5), None);
    }
}
