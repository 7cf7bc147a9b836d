//! The phase that belongs to a magnitude.

use promenade_fourier::minimum_phase_log;
use promenade_fourier::num_complex::Complex64;

#[test]
fn minimum_phase_of_a_one_pole_is_its_own_phase() {
    let response = |k: usize| {
        let w = std::f64::consts::TAU * k as f64 / 320.0;
        let (re, im) = (1.0 - 0.6 * w.cos(), 0.6 * w.sin());
        Complex64::new(-0.5 * (re * re + im * im).ln(), -im.atan2(re))
    };
    for (k, found) in minimum_phase_log((0..161).map(|k| response(k).re), 320).iter().enumerate() {
        assert!((found - response(k)).norm() < 1e-5, "bin {k}");
    }
}
