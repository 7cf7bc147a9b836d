//! What a fitted room's surfaces do not explain of its sound, octave by octave: how strong reflections are, and the power of
//! diffuse sound over time. A change of material leaves it as it is.

use crate::bands::{BANDS, Bands, PerBand};
use serde::Serialize;

/// The residual of all octaves.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Residual {
    /// Energy of the direct sound by octave over what the chain says.
    pub direct: Vec<f64>,
    /// Energy of all reflections by octave over what surfaces say.
    pub images: Vec<f64>,
    /// Energy of diffuse sound over that of rays, by octave and bin since the direct sound.
    pub diffuse: Vec<Vec<f64>>,
}

impl Residual {
    /// Amplitudes of the direct sound and of reflections by band.
    pub(crate) fn amplitudes(&self, bands: &Bands) -> [PerBand; 2] {
        let of = |e: &[f64]| if e.is_empty() { [1.0; BANDS] } else { bands.from_octaves(e).map(|e| e.max(0.0).sqrt()) };
        [of(&self.direct), of(&self.images)]
    }

    /// Energy of diffuse sound over that of rays in a bin since the direct sound.
    pub(crate) fn at(&self, octave: usize, bin: usize) -> f64 {
        self.diffuse.get(octave).and_then(|d| d.get(bin).or(d.last())).copied().unwrap_or(1.0)
    }
}
