//! How alike two binaural renderings are to the ear: structural similarity of their phases in 32 bands of each ear.
//!
//! The short-time phase of each ear is compared as a picture is (neurogram similarity, Hines and Harte, "Speech
//! intelligibility prediction using a neurogram similarity index measure", Speech Communication 54 (2012)), averaged over the
//! bands of the ear and multiplied over both ears, as BINAQUAL does (Shariat Panah et al., arXiv 2505.11915, 2025): what
//! arrives earlier or later, or in another order, is another picture. Only what is nearly right is told apart.

use crate::{MetricError, check_pair, check_rate};
use promenade_fourier::num_complex::Complex64;
use promenade_fourier::{Fourier, signal, spectrum};
use std::f64::consts::TAU;

/// Length of a frame, seconds, and frames for each of its lengths.
const FRAME_S: f64 = 0.032;
const OVERLAP: usize = 4;
/// Bands, and their ends, Hz: evenly spaced in equivalent rectangular bandwidths (Glasberg and Moore 1990).
const BANDS: usize = 32;
const ENDS_HZ: (f64, f64) = (50.0, 20_000.0);
/// Weights of a value, of those beside it and of those at its corners: a Gaussian of half a value.
const WINDOW: [f64; 3] = [0.6193, 0.0838, 0.0113];
/// Stabilising constants of intensity and structure, as shares of the range of phases.
const STABLE: [f64; 2] = [0.01, 0.03];
/// The longest delay between two renderings that is made up for, seconds, and its steps, samples.
const LONGEST_LAG_S: f64 = 0.002;
const LAG_STEP: f64 = 1.0 / 16.0;

/// Phases of frames, `[frame][bin]`, radians.
type Phases = Vec<Vec<f64>>;

/// How alike two renderings of a sound are, 1 where they are the same: the product of both ears' similarities.
///
/// # Errors
/// Ears of different lengths, samples that are not finite, shorter sounds than three frames, a rate that is none.
pub fn binaural_similarity(reference: [&[f32]; 2], rendered: [&[f32]; 2], sample_rate_hz: f64) -> Result<f64, MetricError> {
    check_rate(sample_rate_hz)?;
    for (a, b) in [(reference[0], reference[1]), (reference[0], rendered[0]), (reference[0], rendered[1])] {
        check_pair(a, b)?;
    }
    let frame = (FRAME_S * sample_rate_hz).round() as usize;
    let (needed, found) = (2 * frame, reference[0].len());
    if found < needed {
        return Err(MetricError::TooShort { measure: "binaural similarity", needed, found });
    }
    let rendered = brought_together(reference, rendered, sample_rate_hz);
    let ears = reference.into_iter().zip(&rendered);
    Ok(ears.map(|(a, b)| similarity(&phases(a, frame), &phases(b, frame), frame, sample_rate_hz)).product())
}

/// The rendering as much later or earlier at both ears that it agrees best with the reference.
fn brought_together(reference: [&[f32]; 2], rendered: [&[f32]; 2], rate: f64) -> [Vec<f32>; 2] {
    let len = reference[0].len();
    let n_fft = (2 * len).next_power_of_two();
    let of = |ear: &[f32]| spectrum(ear.iter().map(|v| f64::from(*v)), n_fft);
    let (wanted, mut found) = (reference.map(of), rendered.map(of));
    // Correlations at fractions of a sample: the spectrum continued with zeros.
    let fine = (1.0 / LAG_STEP) as usize;
    let cross = (0..n_fft / 2).map(|k| (0..2).map(|ear| wanted[ear][k] * found[ear][k].conj()).sum::<Complex64>()).collect();
    let correlation: Vec<f64> = signal(cross, fine * n_fft);
    let reach = (LONGEST_LAG_S * rate / LAG_STEP) as i64;
    let at = |lag: i64| correlation[lag.rem_euclid(correlation.len() as i64) as usize];
    let lag = (-reach..=reach).max_by(|a, b| at(*a).total_cmp(&at(*b))).unwrap_or(0) as f64 * LAG_STEP;
    if lag == 0.0 {
        // Transformed there and back, phases at the turn from one end of their range to the other would change ends.
        return rendered.map(<[f32]>::to_vec);
    }
    for ear in &mut found {
        for (k, x) in ear.iter_mut().enumerate() {
            *x *= Complex64::from_polar(1.0, -TAU * k as f64 * lag / n_fft as f64);
        }
    }
    found.map(|ear| signal(ear, n_fft).into_iter().take(len).map(|v| v as f32).collect())
}

/// Phases of a sound under Hamming windows.
fn phases(ear: &[f32], frame: usize) -> Phases {
    let fourier = Fourier::<f64>::new(frame);
    let window: Vec<f64> = (0..frame).map(|i| 0.54 - 0.46 * (TAU * i as f64 / frame as f64).cos()).collect();
    let frames = (0..=ear.len() - frame).step_by((frame / OVERLAP).max(1));
    frames
        .map(|from| {
            let piece = ear[from..from + frame].iter().zip(&window).map(|(v, w)| f64::from(*v) * w);
            fourier.spectrum(piece).iter().map(|x| x.arg()).collect()
        })
        .collect()
}

/// Similarity of phases: the mean over bands of the mean over their bins and frames.
fn similarity(a: &Phases, b: &Phases, frame: usize, rate: f64) -> f64 {
    let bins = a.first().map_or(0, Vec::len);
    let products = |a: &Phases, b: &Phases| -> Phases {
        a.iter().zip(b).map(|(a, b)| a.iter().zip(b).map(|(a, b)| a * b).collect()).collect()
    };
    let means = [a, b].map(smoothed);
    let squares = [smoothed(&products(a, a)), smoothed(&products(b, b)), smoothed(&products(a, b))];
    let [intensity, structure] = STABLE.map(|share| (share * TAU).powi(2));
    let structure = 0.5 * structure;
    let alike = |frame: usize, bin: usize| {
        let [one, other] = [0, 1].map(|i: usize| means[i][frame][bin]);
        let [own, others, both] = [0, 1, 2].map(|i: usize| squares[i][frame][bin]);
        let deviation = ((own - one * one).max(0.0) * (others - other * other).max(0.0)).sqrt();
        (2.0 * one * other + intensity) / (one * one + other * other + intensity) * (both - one * other + structure)
            / (deviation + structure)
    };
    let edge = |band: usize| {
        let [low, high] = [ENDS_HZ.0, ENDS_HZ.1].map(erbs);
        let place = low + (high - low) * band as f64 / BANDS as f64;
        ((10.0_f64.powf(place / 21.4) - 1.0) / 0.00437 * frame as f64 / rate).round() as usize
    };
    // A band narrower than a bin has none.
    let bands = (0..BANDS).map(|band| edge(band).max(1)..edge(band + 1).min(bins)).filter(|band| !band.is_empty());
    let mean = |bins: std::ops::Range<usize>| -> f64 {
        let count = (bins.len() * a.len()) as f64;
        (0..a.len()).flat_map(|frame| bins.clone().map(move |bin| (frame, bin))).map(|(f, k)| alike(f, k)).sum::<f64>() / count
    };
    let count = bands.clone().count().max(1) as f64;
    bands.map(mean).sum::<f64>() / count
}

/// Equivalent rectangular bandwidths below a frequency.
fn erbs(hz: f64) -> f64 {
    21.4 * (1.0 + 0.00437 * hz).log10()
}

/// Each value with those around it, mirrored at the ends.
fn smoothed(values: &Phases) -> Phases {
    let [own, beside, corner] = WINDOW.map(|w| w / (WINDOW[0] + 4.0 * WINDOW[1] + 4.0 * WINDOW[2]));
    let rows = values.len();
    let row = |frame: usize| {
        let (above, here, below) = (&values[frame.saturating_sub(1)], &values[frame], &values[(frame + 1).min(rows - 1)]);
        let bins = here.len();
        (0..bins)
            .map(|k| {
                let (left, right) = (k.saturating_sub(1), (k + 1).min(bins - 1));
                own * here[k]
                    + beside * (here[left] + here[right] + above[k] + below[k])
                    + corner * (above[left] + above[right] + below[left] + below[right])
            })
            .collect()
    };
    (0..rows).map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_signals::noise;

    const RATE: f64 = 16_000.0;

    /// Noise with the left ear later by a fraction of a sample, and both later by another.
    fn ears(between: f64, both: f64) -> [Vec<f32>; 2] {
        let sound = noise(7, 8_000);
        let n_fft = 16_384;
        let spectrum = spectrum(sound.iter().copied(), n_fft);
        [both + between, both].map(|late| {
            let turned = spectrum.iter().enumerate();
            let turned = turned.map(|(k, x)| x * Complex64::from_polar(1.0, -TAU * k as f64 * (late + 50.0) / n_fft as f64));
            signal(turned.collect(), n_fft).into_iter().take(9_000).map(|v: f64| v as f32).collect()
        })
    }

    fn alike(a: &[Vec<f32>; 2], b: &[Vec<f32>; 2]) -> f64 {
        binaural_similarity([&a[0], &a[1]], [&b[0], &b[1]], RATE).unwrap()
    }

    #[test]
    fn the_same_is_alike_whenever_it_comes_and_a_delay_between_the_ears_is_not() {
        let ahead = ears(0.0, 0.0);
        assert!((alike(&ahead, &ahead) - 1.0).abs() < 1e-9);
        let late = alike(&ahead, &ears(0.0, 3.4375));
        let [near, far] = [0.5, 4.0].map(|between| alike(&ahead, &ears(between, 0.0)));
        assert!(late > 0.8 && near < late - 0.1 && far < near - 0.1, "{late} {near} {far}");
    }

    #[test]
    fn what_is_too_short_is_refused() {
        let short = vec![0.5_f32; 900];
        let ears = [&short[..]; 2];
        assert!(matches!(binaural_similarity(ears, ears, RATE), Err(MetricError::TooShort { needed: 1024, found: 900, .. })));
        assert!(binaural_similarity(ears, [&short[1..], &short], RATE).is_err());
    }
}
