//! Filtering whole signals by one long transform.

use promenade_fourier::num_complex::Complex32;
use promenade_fourier::{signal, spectrum};

/// `x` convolved with a filter for each ear; as long as both together, less one.
pub(crate) fn convolve(x: &[f32], filters: [&[f32]; 2]) -> [Vec<f32>; 2] {
    filters.map(|filter| {
        if x.is_empty() || filter.is_empty() {
            return Vec::new();
        }
        let whole = x.len() + filter.len() - 1;
        let length = whole.next_power_of_two().max(2);
        let [mut product, filter] = [x, filter].map(|v| spectrum(v.iter().copied(), length));
        product.iter_mut().zip(&filter).for_each(|(a, b)| *a *= b);
        first(whole, product)
    })
}

/// `x` through a filter for each ear, given by its response at each frequency in hertz; as long as `x`. Ringing before or after
/// the signal, up to its own length, is cut off and does not wrap round.
pub(crate) fn shape(x: &[f32], sample_rate_hz: f64, mut response: impl FnMut(f64) -> [Complex32; 2]) -> [Vec<f32>; 2] {
    if x.is_empty() {
        return [Vec::new(), Vec::new()];
    }
    let length = (2 * x.len()).next_power_of_two();
    let spectrum = spectrum(x.iter().copied(), length);
    let mut ears = [spectrum.clone(), spectrum];
    for bin in 0..ears[0].len() {
        let gains = response(bin as f64 * sample_rate_hz / length as f64);
        ears.iter_mut().zip(gains).for_each(|(ear, gain)| ear[bin] *= gain);
    }
    ears.map(|ear| first(x.len(), ear))
}

/// The first samples of what a spectrum stands for.
fn first(samples: usize, spectrum: Vec<Complex32>) -> Vec<f32> {
    let length = 2 * (spectrum.len() - 1);
    let mut time = signal(spectrum, length);
    time.truncate(samples);
    time
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: &[f32], b: &[f32]) {
        assert_eq!(a.len(), b.len());
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6), "{a:?} {b:?}");
    }

    #[test]
    fn as_by_hand() {
        let [left, right] = convolve(&[1.0, 2.0, 3.0], [&[1.0], &[0.0, 0.5]]);
        near(&left, &[1.0, 2.0, 3.0]);
        near(&right, &[0.0, 0.5, 1.0, 1.5]);
        near(&convolve(&[1.0], [&[3.0], &[]])[0], &[3.0]);
    }

    #[test]
    fn a_phase_is_a_delay_and_nothing_folds_back() {
        let x = [1.0, 0.0, 0.0, 2.0];
        let late = |hz: f64| {
            let turn = Complex32::from_polar(1.0, (-2.0 * std::f64::consts::PI * hz / 100.0) as f32);
            [turn, Complex32::new(0.5, 0.0)]
        };
        let [left, right] = shape(&x, 100.0, late);
        near(&left, &[0.0, 1.0, 0.0, 0.0]);
        near(&right, &[0.5, 0.0, 0.0, 1.0]);
    }
}
