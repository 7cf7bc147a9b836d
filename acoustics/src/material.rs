//! What surfaces do to sound.

use crate::error::AcousticsError;
use crate::octave::{BANDS, Octaves};

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
}

impl Material {
    /// A material of some absorption and scattering; what else it has is as materials have it that do not say so.
    #[must_use]
    pub fn new(name: &str, absorption: Octaves, scattering: Octaves) -> Self {
        Self { name: name.to_owned(), absorption, scattering }
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

    /// # Errors
    /// A share outside 0 to 1.
    pub(crate) fn check(&self) -> Result<(), AcousticsError> {
        for (what, shares) in [("absorption", &self.absorption), ("scattering", &self.scattering)] {
            if let Some(found) = shares.iter().find(|s| !(0.0..=1.0).contains(*s)) {
                return Err(AcousticsError::argument(format!("{what} of {}", self.name), "0 to 1", found));
            }
        }
        Ok(())
    }
}
