//! Octaves.

/// How many octaves are simulated.
pub const BANDS: usize = 7;

/// Their centres, hertz.
pub const OCTAVES_HZ: [f32; BANDS] = [125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0];

/// A number for each of [`OCTAVES_HZ`].
pub type Octaves = [f32; BANDS];

/// Energies by octave at a frequency: their levels lie between those of the octaves.
#[must_use]
pub fn octave_energy(energies: &[f64; 7], hz: f64) -> f64 {
    let (below, fraction) = octave_place(hz);
    let [a, b] = [energies[below], energies[below + 1]];
    if a > 0.0 && b > 0.0 { a * (b / a).powf(fraction) } else { a + fraction * (b - a) }
}

/// The octave below a frequency and how far it is on the way to the next.
#[must_use]
pub fn octave_place(hz: f64) -> (usize, f64) {
    let last = OCTAVES_HZ.len() - 1;
    let place = (hz.max(1.0) / f64::from(OCTAVES_HZ[0])).log2().clamp(0.0, last as f64);
    let below = (place as usize).min(last - 1);
    (below, place - below as f64)
}
