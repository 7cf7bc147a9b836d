//! Mirror images of a source.

use crate::octave::Octaves;

/// Highest order of images.
pub const MAX_ORDER: u32 = 50;

/// A mirror image of a source, as one listener hears it: sound from where it lies, delayed and weakened by its distance, times
/// its gains.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Where it lies, metres. It does not move with the listener.
    pub position: [f64; 3],
    /// Reflections that made it; 0 is the source.
    pub order: u32,
    /// What those reflections leave of the amplitude, times the source's directivity.
    pub gains: Octaves,
    /// [`Self::gains`] in the octave at 63 Hz, with the directivity of 125 Hz.
    pub gain_63: f32,
    /// The source's directivity this way: amplitudes over those on its axis.
    pub directivity: Octaves,
    /// Which of its source's images it is: the same number for every listener.
    pub index: usize,
    /// The triangles that reflect it, in the order in which sound from the source meets them; for a box, its walls.
    pub faces: Vec<u32>,
}

/// What images have of the energy that walls reflect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reflected {
    /// All of it, as if nothing were scattered.
    Whole,
    /// What is not scattered; the rest is the rays'.
    Specular,
}

impl Reflected {
    /// What a reflection leaves of the amplitude.
    pub(crate) fn gains(self, material: &crate::Material) -> Octaves {
        std::array::from_fn(|band| self.gain(material.absorption[band], material.scattering[band]))
    }

    /// What a reflection leaves of the amplitude in the octave at 63 Hz.
    pub(crate) fn gain_63(self, material: &crate::Material) -> f32 {
        self.gain(material.low(), material.scattering[0])
    }

    fn gain(self, absorption: f32, scattering: f32) -> f32 {
        let reflected = 1.0 - absorption;
        match self {
            Self::Whole => reflected.sqrt(),
            Self::Specular => (reflected * (1.0 - scattering)).sqrt(),
        }
    }
}
