//! Which side a room's energy comes from, for a head that turns.

use crate::sources::simulation::Hrtf;
use promenade_core::TransferShape;
use promenade_core::glam::Quat;
use promenade_fourier::num_complex::Complex32;
use promenade_room::{EnergyVector, SceneHead, ear_energy, sided};
use std::ops::Range;

/// A third-octave about a band's centre: half of it, as a ratio.
const HALF_BAND: f64 = 1.122_462;

/// A head in a room whose energy comes more from one side than from others.
pub(super) struct Sides<'a> {
    hrtf: &'a Hrtf,
    head: &'a SceneHead,
    /// Bins of the head's responses that are of each band.
    bins: Vec<Range<usize>>,
}

impl<'a> Sides<'a> {
    /// `head` is made of `hrtf`.
    pub(super) fn new(hrtf: &'a Hrtf, head: &'a SceneHead) -> Self {
        let last = hrtf.bins.count() - 1;
        let bin = |hz: f64| ((hz / hrtf.bins.hz(1)).round() as usize).clamp(1, last);
        let of_band = |hz: &f32| bin(f64::from(*hz) / HALF_BAND)..bin(f64::from(*hz) * HALF_BAND) + 1;
        Self { hrtf, head, bins: head.bands().centres_hz().iter().map(of_band).collect() }
    }

    /// Gains of taps and late part, which are the same at both ears, as a head hears them that is turned by `yaw`, radians:
    /// what of a hop comes from one side has the level of the ear's response there instead of its mean over all turns of the
    /// head.
    pub(super) fn turned(&self, row: &[f32], vectors: &[EnergyVector], yaw: f32, shape: TransferShape) -> Vec<f32> {
        sided(row, vectors, shape, |vector| self.ratios(vector, yaw))
    }

    /// Amplitudes at both ears by band over those of the mean of all turns.
    fn ratios(&self, vector: &EnergyVector, yaw: f32) -> [Vec<f32>; 2] {
        let Some((from, share)) = vector.side() else { return [(); 2].map(|()| vec![1.0; self.bins.len()]) };
        let near = self.hrtf.near(Quat::from_rotation_z(-yaw) * from.as_vec3());
        let means: Vec<f64> = self.head.heard_from(from.z).collect();
        let mut spectrum = vec![Complex32::default(); self.hrtf.bins.count()];
        [0, 1].map(|ear| {
            near.spectrum(ear, &mut spectrum);
            let level = |bins: &Range<usize>| {
                let energy: f64 = spectrum[bins.clone()].iter().map(|x| f64::from(x.norm_sqr())).sum();
                energy / bins.len() as f64
            };
            let ratio =
                |(bins, mean): (&Range<usize>, &f64)| (ear_energy(share, level(bins)) / ear_energy(share, *mean)).sqrt() as f32;
            self.bins.iter().zip(&means).map(ratio).collect()
        })
    }
}
