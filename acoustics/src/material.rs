//! What surfaces do to sound.

use crate::error::AcousticsError;
use crate::octave::{BANDS, Octaves, octave_energy};

/// Scattering of a surface of which nothing is said: that of a flat wall with little on it.
pub const SCATTERING: f32 = 0.1;

/// A surface: how much of the energy that meets it stays there, and how much of the rest leaves in other directions than a
/// mirror's.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// What it is called in a table.
    pub name: String,
    /// Share of the energy that is absorbed, 0 to 1.
    pub absorption: Octaves,
    /// Share of the reflected energy that is scattered after Lambert's law, 0 to 1 (ISO 17497-1).
    pub scattering: Octaves,
    /// Share that is absorbed in the octave at 63 Hz, which waves know and rays do not; where it is not stated, that of 125 Hz
    /// holds below it.
    pub absorption_63: Option<f32>,
}

/// Frequency of [`Material::absorption_63`], Hz.
pub(crate) const LOW_HZ: f64 = 63.0;

impl Material {
    /// A material of some absorption and scattering; what else it has is as materials have it that do not say so.
    #[must_use]
    pub fn new(name: &str, absorption: Octaves, scattering: Octaves) -> Self {
        Self { name: name.to_owned(), absorption, scattering, absorption_63: None }
    }

    /// A material that does the same in every octave.
    #[must_use]
    pub fn even(name: &str, absorption: f32, scattering: f32) -> Self {
        Self::new(name, [absorption; BANDS], [scattering; BANDS])
    }

    /// A material of which no more is known than what it absorbs: it scatters [`SCATTERING`].
    #[must_use]
    pub fn absorbing(absorption: Octaves) -> Self {
        Self::new("", absorption, [SCATTERING; BANDS])
    }

    /// Share that is absorbed at a frequency, Hz: its level lies between those of the octaves about it.
    pub(crate) fn absorbed(&self, hz: f64) -> f64 {
        let octaves = self.absorption.map(f64::from);
        let Some(low) = self.absorption_63 else { return octave_energy(&octaves, hz) };
        // An octave lower, so that 63 Hz is the first of seven.
        let lower: [f64; BANDS] = std::array::from_fn(|b| if b == 0 { f64::from(low) } else { octaves[b - 1] });
        if hz < 2.0 * LOW_HZ { octave_energy(&lower, 2.0 * hz) } else { octave_energy(&octaves, hz) }
    }

    /// # Errors
    /// A share outside 0 to 1.
    pub(crate) fn check(&self) -> Result<(), AcousticsError> {
        for (what, shares) in [("absorption", &self.absorption), ("scattering", &self.scattering)] {
            if let Some(found) = shares.iter().find(|s| !(0.0..=1.0).contains(*s)) {
                return Err(AcousticsError::argument(format!("{what} of {}", self.name), "0 to 1", found));
            }
        }
        match self.absorption_63 {
            Some(low) if !(0.0..=1.0).contains(&low) => {
                Err(AcousticsError::argument(format!("absorption at 63 Hz of {}", self.name), "0 to 1", low))
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_absorbed_at_63_hz_is_known_where_it_is_stated() {
        let plain = Material::absorbing([0.2, 0.4, 0.4, 0.4, 0.4, 0.4, 0.4]);
        let low = Material { absorption_63: Some(0.05), ..plain.clone() };
        for (hz, without, with) in [(20.0, 0.2, 0.05), (62.5, 0.2, 0.05), (125.0, 0.2, 0.2), (250.0, 0.4, 0.4)] {
            assert!((plain.absorbed(hz) - without).abs() < 1e-6, "{hz}");
            assert!((low.absorbed(hz) - with).abs() < 0.002, "{hz}: {}", low.absorbed(hz));
        }
        assert!((low.absorbed(88.4) - 0.1).abs() < 1e-3, "between both, as levels");
        assert!(Material { absorption_63: Some(1.5), ..plain }.check().unwrap_err().to_string().contains("63 Hz"));
    }
}
