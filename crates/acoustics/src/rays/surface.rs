//! What walls do to rays.

use crate::materials::material::Material;
use crate::octave::BANDS;
use crate::rays::echogram::{LANES, LOW_LANE};

/// What a material does to a ray's lanes.
pub(crate) struct Surface {
    pub(crate) reflected: [f32; LANES],
    /// How often a ray is scattered, and what a band's energy is multiplied with if it is and if it is not, so that each band
    /// keeps its own share on both ways.
    pub(crate) chance: f64,
    pub(crate) if_scattered: [f32; LANES],
    pub(crate) if_mirrored: [f32; LANES],
}

impl Surface {
    pub(crate) fn new(material: &Material) -> Self {
        // What is not stated at 63 Hz is as it is at 125.
        let lanes = |of: &dyn Fn(usize) -> f32| std::array::from_fn(|lane| of(if lane == LOW_LANE { 0 } else { lane }));
        let mut reflected: [f32; LANES] = lanes(&|b| 1.0 - material.absorption[b]);
        reflected[LOW_LANE] = 1.0 - material.low();
        let chance = material.scattering.iter().sum::<f32>() / BANDS as f32;
        Self {
            reflected,
            chance: f64::from(chance),
            if_scattered: lanes(&|b| if chance > 0.0 { material.scattering[b] / chance } else { 1.0 }),
            if_mirrored: lanes(&|b| if chance < 1.0 { (1.0 - material.scattering[b]) / (1.0 - chance) } else { 1.0 }),
        }
    }
}
