//! What surfaces do to sound.

use crate::error::AcousticsError;
use crate::materials::curve::Curve;
use crate::octave::{BANDS, LOW_HZ, Octaves, octave_energy, octave_energy_from_63, octave_place};

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
    /// Share that is absorbed in the octave at 63 Hz; where it is not stated, that of 125 Hz holds below it.
    pub absorption_63: Option<f32>,
    /// Absorption and scattering where they are known closer than by octaves, as of a fit or in thirds: images and waves have
    /// these, rays the means of octaves.
    pub fine: [Curve; 2],
}

impl Material {
    /// A material of some absorption and scattering; what else it has is as materials have it that do not say so.
    #[must_use]
    pub fn new(name: &str, absorption: Octaves, scattering: Octaves) -> Self {
        Self { name: name.to_owned(), absorption, scattering, absorption_63: None, fine: <[Curve; 2]>::default() }
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
        if let Some(share) = self.fine[0].at(hz) {
            return share;
        }
        let octaves = self.absorption.map(f64::from);
        match self.absorption_63 {
            Some(low) => octave_energy_from_63(low.into(), &octaves, hz),
            None => octave_energy(&octaves, hz),
        }
    }

    /// Share that a reflection takes of what a mirror would send on, absorbed or scattered, at a frequency, Hz: straight lines
    /// over the logarithm of frequency.
    #[must_use]
    pub fn taken(&self, hz: f64) -> f64 {
        let [absorption, scattering] = &self.fine;
        let kept = |octaves: &Octaves, low: f32, fine: &Curve| 1.0 - fine.at(hz).unwrap_or_else(|| line(octaves, low, hz));
        let absorbed = kept(&self.absorption, self.low(), absorption);
        1.0 - absorbed * kept(&self.scattering, self.scattering[0], scattering)
    }

    /// What a ray that carries the octave at 63 Hz finds absorbed.
    pub(crate) fn low(&self) -> f32 {
        self.absorption_63.unwrap_or(self.absorption[0])
    }

    /// # Errors
    /// A share outside 0 to 1.
    pub(crate) fn check(&self) -> Result<(), AcousticsError> {
        for (what, shares) in [("absorption", &self.absorption), ("scattering", &self.scattering)] {
            if let Some(found) = shares.iter().find(|s| !(0.0..=1.0).contains(*s)) {
                return Err(AcousticsError::argument(format!("{what} of {}", self.name), "0 to 1", found));
            }
        }
        for (what, curve) in ["absorption", "scattering"].iter().zip(&self.fine) {
            if let Some([_, found]) = curve.points().iter().find(|p| !(p[0] > 0.0 && (0.0..=1.0).contains(&p[1]))) {
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

/// Shares by octave, with that at 63 Hz, at a frequency.
fn line(octaves: &Octaves, low: f32, hz: f64) -> f64 {
    let (below, fraction) = octave_place(hz);
    let (a, b, fraction) = match (hz / LOW_HZ).log2() {
        place if place < 1.0 => (low, octaves[0], place.max(0.0)),
        _ => (octaves[below], octaves[below + 1], fraction),
    };
    f64::from(a) + fraction * f64::from(b - a)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_closer_than_octaves_are_kept() {
        let mut material = Material::even("", 0.2, 0.5);
        assert!((material.taken(700.0) - 0.6).abs() < 1e-6);
        material.fine = [Curve::new(vec![[500.0, 0.2], [700.0, 0.8], [1000.0, 0.2]]), Curve::default()];
        assert!((material.taken(700.0) - 0.9).abs() < 1e-6 && (material.absorbed(700.0) - 0.8).abs() < 1e-6);
        material.fine[1] = Curve::new(vec![[700.0, 0.0]]);
        assert!((material.taken(1000.0) - 0.2).abs() < 1e-6);
        material.fine[1] = Curve::new(vec![[700.0, 1.1]]);
        assert!(material.check().unwrap_err().to_string().contains("scattering"));
    }

    #[test]
    fn what_is_absorbed_at_63_hz_is_known_where_it_is_stated() {
        let plain = Material::absorbing([0.2, 0.4, 0.4, 0.4, 0.4, 0.4, 0.4]);
        let low = Material { absorption_63: Some(0.05), ..plain.clone() };
        for (hz, without, with) in [(20.0, 0.2, 0.05), (62.5, 0.2, 0.05), (125.0, 0.2, 0.2), (250.0, 0.4, 0.4)] {
            assert!((plain.absorbed(hz) - without).abs() < 1e-6, "{hz}");
            assert!((low.absorbed(hz) - with).abs() < 0.002, "{hz}: {}", low.absorbed(hz));
        }
        assert!((low.absorbed(88.4) - 0.1).abs() < 1e-3, "between both, as levels");
        assert!((low.taken(89.1) - (1.0 - 0.875 * 0.9)).abs() < 1e-3 && (plain.taken(89.1) - 0.28).abs() < 1e-3, "as shares");
        assert!(Material { absorption_63: Some(1.5), ..plain }.check().unwrap_err().to_string().contains("63 Hz"));
    }
}
