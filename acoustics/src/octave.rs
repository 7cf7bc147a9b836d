//! Octaves.

/// How many octaves are simulated.
pub const BANDS: usize = 7;

/// Their centres, hertz.
pub const OCTAVES_HZ: [f32; BANDS] = [125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0];

/// A number for each of [`OCTAVES_HZ`].
pub type Octaves = [f32; BANDS];
