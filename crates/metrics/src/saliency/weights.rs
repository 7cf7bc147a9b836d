//! Weights of pictures beside a sound: how much each of them matters to a listener.
//!
//! After Harvey, Debattista, Bashford-Rogers and Chalmers, "Multi-modal perception for selective rendering", Computer Graphics
//! Forum 2017.

use super::SALIENCY_STEP_S;

/// How long before it is heard a sound may raise its weight, seconds.
const LOOK_AHEAD_S: f64 = 0.5;

/// Weight of each picture, 0 to 1: the largest saliency of each half second stands at its beginning, so that the weight comes
/// before the sound, and a curve without overshoot leads from one to the next.
///
/// `trace`: what [`saliency`](super::saliency) found, at least one value. Shape: one value for each of `pictures`,
/// `pictures_hz` of them a second.
#[must_use]
pub fn picture_weights(trace: &[f64], pictures_hz: f64, pictures: usize) -> Vec<f64> {
    let most = trace.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    let steps = (LOOK_AHEAD_S / SALIENCY_STEP_S) as usize;
    let largest = |stretch: &[f64]| stretch.iter().copied().fold(0.0, f64::max) / most;
    let knots: Vec<f64> = trace.chunks(steps).map(largest).collect();
    (0..pictures).map(|picture| monotone(&knots, picture as f64 / pictures_hz / LOOK_AHEAD_S)).collect()
}

/// A cubic spline through values at 0, 1, 2..., which has no extremum between them (Fritsch and Butland 1984: harmonic means as
/// slopes); as at its ends beyond them, and 0 of no values.
fn monotone(values: &[f64], at: f64) -> f64 {
    let value = |i: usize| values.get(i).or(values.last()).copied().unwrap_or_default();
    let slope = |i: usize| {
        let (before, after) = (value(i) - value(i.saturating_sub(1)), value(i + 1) - value(i));
        if before * after > 0.0 { 2.0 * before * after / (before + after) } else { 0.0 }
    };
    let (i, t) = (at.floor() as usize, at.fract());
    let (a, b) = (value(i), value(i + 1));
    let (square, cube) = (t * t, t * t * t);
    a + (b - a) * (3.0 * square - 2.0 * cube) + slope(i) * (cube - 2.0 * square + t) + slope(i + 1) * (cube - square)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_weight_comes_before_its_sound() {
        // Quiet but for 0.1 s at 3 s.
        let mut trace = vec![0.2; 5000];
        trace[1500..1550].fill(4.0);
        let weights = picture_weights(&trace, 25.0, 250);
        assert_eq!(weights.len(), 250);
        assert!(weights.iter().all(|w| (0.05..=1.0).contains(w)));
        assert!((weights[75] - 1.0).abs() < 1e-9 && weights[70] > 0.4 && weights[62] <= 0.05 + 1e-9, "{weights:?}");
    }

    #[test]
    fn splines_do_not_overshoot() {
        let values = [0.0, 0.0, 1.0, 0.9, 0.9, 0.2];
        for step in 0..600 {
            let at = f64::from(step) / 100.0;
            let (a, b) = (values[(at as usize).min(5)], values[(at as usize + 1).min(5)]);
            let value = monotone(&values, at);
            assert!((f64::min(a, b) - 1e-12..=f64::max(a, b) + 1e-12).contains(&value), "{value} at {at}");
        }
    }
}
