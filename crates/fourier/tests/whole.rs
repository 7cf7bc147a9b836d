//! Whole signals there and back.

use promenade_fourier::{signal, spectrum};

#[test]
fn back_and_forth() {
    for length in [1, 2, 7, 12] {
        let x: Vec<f64> = (0..length).map(|i| f64::from(i * i % 5) - 1.5).collect();
        let y = signal(spectrum(x.iter().copied(), x.len()), x.len());
        assert!(x.iter().zip(&y).all(|(a, b)| (a - b).abs() < 1e-12), "{length}: {x:?} {y:?}");
    }
    assert_eq!(spectrum([1.0, 2.0], 4)[0].re, 3.0, "zeros behind");
    assert_eq!(spectrum([1.0, 2.0, 3.0], 2)[0].re, 3.0, "cut");
}
