//! Log-spectral distance where there is something to hear.

use crate::{MetricError, Spectrogram, check_pair};

/// A frame counts where its largest magnitude lies at most this far below the recording's largest, dB.
pub const AUDIBLE_FRAME_DB: f64 = 40.0;
/// Magnitudes are floored this far below the recording's largest, dB.
pub const AUDIBLE_FLOOR_DB: f64 = 60.0;

/// Log-spectral distance of stretches of one recording, dB: the mean over ears and frames of the root mean square over bins of
/// `20 log10(A / B)`.
///
/// Of each stretch the frames that lie within it count where the recording is audible there: see [`AUDIBLE_FRAME_DB`] and
/// [`AUDIBLE_FLOOR_DB`], both relative to the recording's largest magnitude in all stretches and both ears.
///
/// # Errors
/// Stretches of different numbers or lengths, samples that are not finite, or a recording without an audible frame.
pub fn audible_lsd_db(rendered: &[[Vec<f32>; 2]], recorded: &[[Vec<f32>; 2]], of: Spectrogram) -> Result<f64, MetricError> {
    if rendered.len() != recorded.len() {
        return Err(MetricError::Lengths { first: rendered.len(), second: recorded.len() });
    }
    let bins = of.n_fft / 2 + 1;
    let mut pairs = Vec::new();
    for (a, b) in rendered.iter().flatten().zip(recorded.iter().flatten()) {
        check_pair(a, b)?;
        let first = (of.n_fft / 2).div_ceil(of.hop);
        let last = b.len().saturating_sub(of.n_fft / 2) / of.hop;
        let within = (first * bins)..((last + 1).max(first) * bins);
        pairs.push((of.magnitudes(a), of.magnitudes(b), within));
    }
    let largest_of = |magnitudes: &[f64]| magnitudes.iter().fold(0.0_f64, |m, v| m.max(*v));
    let largest = pairs.iter().map(|(_, b, within)| largest_of(b.get(within.clone()).unwrap_or_default())).fold(0.0, f64::max);
    let below = |db: f64| largest * 10.0_f64.powf(-db / 20.0);
    let (audible, floor) = (below(AUDIBLE_FRAME_DB), below(AUDIBLE_FLOOR_DB));
    let (mut sum, mut count) = (0.0, 0_usize);
    for (a, b, within) in &pairs {
        let frames = |m: &'_ [f64]| m.get(within.clone()).unwrap_or_default().to_vec();
        let (a, b) = (frames(a), frames(b));
        for (a, b) in a.chunks_exact(bins).zip(b.chunks_exact(bins)).filter(|(_, b)| largest_of(b) >= audible) {
            let square: f64 = a.iter().zip(b).map(|(a, b)| (20.0 * (a.max(floor) / b.max(floor)).log10()).powi(2)).sum();
            sum += (square / bins as f64).sqrt();
            count += 1;
        }
    }
    if largest > 0.0 && count > 0 { Ok(sum / count as f64) } else { Err(MetricError::Silent) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_signals::noise;
    use crate::{MetricError, Window};

    const SPECTROGRAM: Spectrogram = Spectrogram { n_fft: 256, hop: 64, window_length: 256, window: Window::Hann };

    fn ears(seed: u64, gain: f64) -> [Vec<f32>; 2] {
        [seed, seed + 1].map(|s| noise(s, 4000).iter().map(|v| (gain * v) as f32).collect())
    }

    #[test]
    fn a_gain_is_its_distance_and_silence_does_not_count() {
        // A draw without a bin below the floor.
        let (loud, softer) = (ears(11, 1.0), ears(11, 0.5));
        let gain = 20.0 * 2.0_f64.log10();
        let distance = |a: &[[Vec<f32>; 2]], b: &[[Vec<f32>; 2]]| audible_lsd_db(a, b, SPECTROGRAM).unwrap();
        assert_eq!(distance(std::slice::from_ref(&loud), std::slice::from_ref(&loud)), 0.0);
        assert!((distance(std::slice::from_ref(&softer), std::slice::from_ref(&loud)) - gain).abs() < 1e-6);
        // A stretch 60 dB down is not audible, whatever a rendering makes of it.
        let (faint, other) = (ears(13, 1e-3), ears(15, 1.0));
        assert!((distance(&[softer, other], &[loud, faint]) - gain).abs() < 1e-6);
    }

    #[test]
    fn what_is_below_the_floor_is_as_good_as_the_floor() {
        let tone = |level: f32| {
            let x: Vec<f32> =
                (0..4000).map(|i| (i as f32 * std::f32::consts::TAU / 8.0).sin() + level * (-1.0_f32).powi(i)).collect();
            [x.clone(), x]
        };
        let near = audible_lsd_db(&[tone(1e-4)], &[tone(1e-5)], SPECTROGRAM).unwrap();
        assert!(near < 1e-3, "80 and 100 dB down: {near}");
        let above = audible_lsd_db(&[tone(1e-2)], &[tone(1e-4)], SPECTROGRAM).unwrap();
        assert!(above > 1.0, "40 dB down is seen: {above}");
    }

    #[test]
    fn silence_has_no_distance() {
        let silent = [vec![0.0; 4000], vec![0.0; 4000]];
        assert_eq!(audible_lsd_db(&[ears(1, 1.0)], &[silent], SPECTROGRAM), Err(MetricError::Silent));
        assert_eq!(audible_lsd_db(&[], &[], SPECTROGRAM), Err(MetricError::Silent));
        let short = [vec![1.0; 100], vec![1.0; 100]];
        assert_eq!(
            audible_lsd_db(std::slice::from_ref(&short), std::slice::from_ref(&short), SPECTROGRAM),
            Err(MetricError::Silent),
            "no frame lies within it"
        );
    }
}
