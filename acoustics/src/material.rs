//! What surfaces do to sound.

use crate::error::AcousticsError;
use crate::octave::Octaves;

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
    /// A material that does the same in every octave.
    #[must_use]
    pub fn even(name: &str, absorption: f32, scattering: f32) -> Self {
        Self { name: name.to_owned(), absorption: [absorption; 7], scattering: [scattering; 7] }
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
