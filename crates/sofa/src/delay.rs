//! Delays that are stored beside responses.

/// A response with its separately stored delay put back: whole samples by shifting, the rest by a windowed sinc of 16 samples
/// to each side (Laakso et al. 1996).
pub(crate) fn delayed(samples: &[f64], delay: f64) -> Vec<f32> {
    const REACH: i32 = 16;
    let whole = delay.round();
    let rest = delay - whole;
    let shift = whole as usize;
    let narrow = |v: &f64| *v as f32;
    let padding = std::iter::repeat_n(0.0, shift);
    if rest.abs() < 1e-3 {
        return padding.chain(samples.iter().map(narrow)).collect();
    }
    let tap = |k: i32| {
        let t = f64::from(k) - rest;
        let phase = std::f64::consts::PI * t;
        phase.sin() / phase * (0.5 + 0.5 * (phase / f64::from(REACH + 1)).cos())
    };
    let taps: Vec<f64> = (-REACH..=REACH).map(tap).collect();
    let at = |i: i64| usize::try_from(i).ok().and_then(|i| samples.get(i)).copied().unwrap_or(0.0);
    let length = i64::try_from(samples.len()).unwrap_or(i64::MAX).saturating_add(i64::from(REACH));
    let filtered =
        (0..length).map(|i| taps.iter().enumerate().map(|(k, t)| t * at(i - k as i64 + i64::from(REACH))).sum::<f64>());
    padding.chain(filtered.map(|v| narrow(&v))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delays_whole_and_broken() {
        let mut pulse = vec![0.0; 64];
        for (i, v) in pulse.iter_mut().enumerate() {
            *v = (-0.5 * ((i as f64 - 30.0) / 2.0).powi(2)).exp();
        }
        assert_eq!(delayed(&pulse, 3.0)[33], 1.0);
        let quarter = delayed(&pulse, 2.25);
        for (i, v) in quarter.iter().take(64).enumerate() {
            let expected = (-0.5 * ((i as f64 - 32.25) / 2.0).powi(2)).exp();
            assert!((f64::from(*v) - expected).abs() < 2e-4, "sample {i}: {v} for {expected}");
        }
    }
}
