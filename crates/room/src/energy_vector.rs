//! Which side energy comes from.

use promenade_acoustics::Bin;
use promenade_core::glam::DVec3;

/// Energy of all octaves together that arrives in a hop, and the sum of the directions that it comes from, each as long as its
/// energy.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EnergyVector {
    /// Without a head.
    pub energy: f64,
    /// World; as long as the energy where all of it comes from one direction.
    pub from: DVec3,
}

impl EnergyVector {
    /// Adds what arrives within a bin of an echogram.
    pub fn add(&mut self, bin: &Bin) {
        self.energy += bin.energy.iter().map(|e| f64::from(*e)).sum::<f64>();
        self.from += DVec3::from(bin.from.map(|axis| axis.iter().map(|e| f64::from(*e)).sum()));
    }

    /// Where most of it comes from, a unit vector, and the share that does; `None` if as much comes from every side.
    #[must_use]
    pub fn side(&self) -> Option<(DVec3, f64)> {
        let side = self.from.try_normalize()?;
        Some((side, (self.from.length() / self.energy.max(f64::MIN_POSITIVE)).min(1.0)))
    }
}

/// Energy that an ear hears of sound of which a share comes from where the head has this level; the rest comes from everywhere,
/// where that is 1.
#[must_use]
pub fn ear_energy(share: f64, level: f64) -> f64 {
    1.0 - share + share * level
}
