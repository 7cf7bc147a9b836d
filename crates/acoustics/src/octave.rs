//! Octaves, as scenes have them, and the one below them.

pub use promenade_core::octave::{OCTAVES as BANDS, OCTAVES_HZ, Octaves, octave_energy, octave_place};

/// The octave below those of scenes, Hz.
pub(crate) const LOW_HZ: f64 = 63.0;

/// Energy at a frequency, Hz, of energies by octave with that of the octave at 63 Hz beside them: [`octave_energy`] over eight
/// octaves.
#[must_use]
pub fn octave_energy_from_63(low: f64, energies: &[f64; BANDS], hz: f64) -> f64 {
    if hz >= 2.0 * LOW_HZ {
        return octave_energy(energies, hz);
    }
    // An octave lower, so that 63 Hz is the first of seven.
    let lower: [f64; BANDS] = std::array::from_fn(|b| if b == 0 { low } else { energies[b - 1] });
    octave_energy(&lower, 2.0 * hz)
}
