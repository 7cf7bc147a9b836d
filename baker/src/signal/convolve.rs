//! Filtering whole signals by one long transform.

use promenade_fourier::num_complex::Complex32;

/// `x` convolved with a filter for each ear; as long as both together, less one.
pub(crate) fn convolve(x: &[f32], filters: [&[f32]; 2]) -> [Vec<f32>; 2] {
    filters.map(|filter| {
        if x.is_empty() || filter.is_empty() {
            return Vec::new();
        }
        let whole = x.len() + filter.len() - 1;
        let spectrum = transform(filter, whole.next_power_of_two());
        let mut product = transform(x, whole.next_power_of_two());
        product.iter_mut().zip(&spectrum).for_each(|(a, b)| *a *= b);
        back(product, whole)
    })
}

/// `x` through a filter for each ear that is given by its response at each frequency in hertz; as long as `x`. What the filters ring
/// before or after the signal, up to its own length, is not folded into it.
pub(crate) fn shape(x: &[f32], sample_rate_hz: f64, mut response: impl FnMut(f64) -> [Complex32; 2]) -> [Vec<f32>; 2] {
    if x.is_empty() {
        return [Vec::new(), Vec::new()];
    }
    let length = (2 * x.len()).next_power_of_two();
    let spectrum = transform(x, length);
    let mut ears = [spectrum.clone(), spectrum];
    for bin in 0..ears[0].len() {
        let gains = response(bin as f64 * sample_rate_hz / length as f64);
        ears.iter_mut().zip(gains).for_each(|(ear, gain)| ear[bin] *= gain);
    }
    ears.map(|ear| back(ear, x.len()))
}

/// Spectrum of a signal with zeros behind it.
fn transform(x: &[f32], length: usize) -> Vec<Complex32> {
    let plan = promenade_fourier::forward::<f32>(length.max(2));
    let mut time = plan.make_input_vec();
    time[..x.len()].copy_from_slice(x);
    let mut spectrum = plan.make_output_vec();
    // The lengths come from the plan itself, the only thing that the transform checks.
    let done = plan.process(&mut time, &mut spectrum);
    debug_assert!(done.is_ok());
    spectrum
}

/// The first samples of what a spectrum stands for.
fn back(mut spectrum: Vec<Complex32>, samples: usize) -> Vec<f32> {
    let length = 2 * (spectrum.len() - 1);
    let plan = promenade_fourier::inverse::<f32>(length);
    let mut time = plan.make_output_vec();
    // A real signal's end bins are real; the inverse transform insists on it.
    spectrum[0].im = 0.0;
    spectrum[length / 2].im = 0.0;
    let done = plan.process(&mut spectrum, &mut time);
    debug_assert!(done.is_ok());
    time.truncate(samples);
    time.iter_mut().for_each(|v| *v /= length as f32);
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
