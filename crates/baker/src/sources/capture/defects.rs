//! What makes a clip useless: silence and clipping.

/// A signal whose root mean square is below this is silent, dB relative to full scale. One step of 16 bits is -90.3.
pub const SILENT_DBFS: f64 = -90.0;
/// So many equal samples in a row at full scale are clipped.
pub const CLIPPED_RUN: usize = 4;
/// From here on a sample is at full scale.
const FULL_SCALE: f32 = 0.999;
/// Samples of a clipped run differ by no more than this; the crest of a loud wave in floats does.
const EQUAL: f32 = 1e-5;

/// Root mean square of a signal, dB relative to full scale.
#[must_use]
pub fn level_dbfs(x: &[f32]) -> f64 {
    let power = x.iter().map(|&v| f64::from(v) * f64::from(v)).sum::<f64>() / x.len().max(1) as f64;
    10.0 * power.max(1e-30).log10()
}

/// Whether a signal is below [`SILENT_DBFS`].
#[must_use]
pub fn is_silent(x: &[f32]) -> bool {
    level_dbfs(x) < SILENT_DBFS
}

/// Whether [`CLIPPED_RUN`] samples in a row are equal and at full scale.
#[must_use]
pub fn is_clipped(x: &[f32]) -> bool {
    let mut run = 0;
    let mut last = f32::NAN;
    x.iter().any(|&v| {
        run = if v.abs() < FULL_SCALE {
            0
        } else if run > 0 && (v - last).abs() <= EQUAL {
            run + 1
        } else {
            1
        };
        last = v;
        run >= CLIPPED_RUN
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clipping_is_a_flat_top_at_full_scale() {
        let wave = |gain: f32, limit: f32| -> Vec<f32> {
            (0..4800).map(|i| (gain * (i as f32 * 0.03).sin()).clamp(-limit, limit)).collect()
        };
        assert!(is_clipped(&wave(2.0, 1.0)) && is_clipped(&wave(2.0, 0.99997)));
        assert!(!is_clipped(&wave(0.99, 1.0)), "loud");
        assert!(!is_clipped(&wave(3.0, 9.0)), "floats may go beyond full scale");
        assert!(!is_clipped(&wave(2.0, 0.5)), "flat, but no converter's limit");
        assert!(!is_clipped(&[1.0, 1.0, 1.0, 0.0, 1.0]) && is_clipped(&[-1.0; 4]));
    }

    #[test]
    fn silence_is_less_than_a_step_of_16_bits() {
        assert!(is_silent(&[0.0; 10]) && is_silent(&[2e-5; 10]) && is_silent(&[]));
        assert!(!is_silent(&[5e-5; 10]));
    }
}
