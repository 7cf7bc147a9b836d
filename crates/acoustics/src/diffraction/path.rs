//! The path of diffracted sound.

use crate::SPEED_OF_SOUND_M_S;
use crate::octave::{OCTAVES_HZ, Octaves, octave_energy};
use promenade_core::{barrier_db, lit_gain};

/// Sound round an edge, as a listener hears it: of the source or of one of its images, and round another edge before. Of a
/// listener who sees past the edge it is what the edge takes away.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiffractionPath {
    /// Where it seems to come from, metres: behind the edge, as far away as its path is long.
    pub position: [f64; 3],
    /// Its length, metres.
    pub path_m: f64,
    /// How much longer than the straight line that is, metres.
    pub detour_m: f64,
    /// Straight line to where it comes from, metres.
    pub direct_m: f64,
    /// Where the sound that reaches the edge comes from, metres: the source or its image.
    pub from: [f64; 3],
    /// How much longer its way to the edge is than the straight one, metres: round another edge.
    pub longer_m: f64,
    /// The source's directivity towards the edge, times what walls and edges on the path leave of it: amplitudes by octave.
    pub gains: Octaves,
    /// Ends of the edge.
    pub edge: [[f64; 3]; 2],
    /// Whether the listener sees past the edge.
    pub lit: bool,
}

impl DiffractionPath {
    /// Amplitude against a source seen at 1 m on its axis, without air, at a frequency; negative where it is taken away.
    #[must_use]
    pub fn amplitude(&self, hz: f64) -> f64 {
        let gain = octave_energy(&self.gains.map(|a| f64::from(a).powi(2)), hz).sqrt();
        gain * if self.lit { self.left(hz) - 1.0 } else { self.left(hz) } / self.direct_m
    }

    /// What the edge leaves of an amplitude at a frequency.
    pub(super) fn left(&self, hz: f64) -> f64 {
        if self.lit {
            return lit_gain(self.detour_m, hz, SPEED_OF_SOUND_M_S);
        }
        10.0_f64.powf(-barrier_db(self.detour_m, hz, SPEED_OF_SOUND_M_S) / 20.0)
    }

    /// Amplitudes by octave against a source seen at 1 m on its axis, without air.
    #[must_use]
    pub fn amplitudes(&self) -> Octaves {
        OCTAVES_HZ.map(|hz| self.amplitude(hz.into()) as f32)
    }
}
