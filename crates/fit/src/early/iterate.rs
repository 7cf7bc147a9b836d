//! Where a fit is while numbers are moved.

use super::loss::{Compared, Loss, Target};
use crate::bands::PerBand;
use crate::room::{FlatRoom, Sequences};
use promenade_fourier::num_complex::Complex64;

/// The room and the chain that the early model is asked about.
pub(crate) struct Geometry {
    pub(crate) room: FlatRoom,
    pub(crate) sequences: Vec<Sequences>,
    /// The chain's spectrum.
    pub(crate) chain: Vec<Complex64>,
    /// Its power.
    pub(crate) power: Vec<f64>,
}

impl Geometry {
    pub(crate) fn new(room: FlatRoom, sequences: Vec<Sequences>, chain: &[Complex64]) -> Self {
        Self { room, sequences, chain: chain.to_vec(), power: chain.iter().map(|c| c.norm_sqr()).collect() }
    }
}

/// One comparison: a loss, targets of all responses, and how much of each bin passes.
pub(crate) struct Stage {
    pub(crate) what: Compared,
    pub(crate) loss: Loss,
    pub(crate) targets: Vec<Target>,
    pub(crate) pass: Vec<f64>,
}

/// Diffuse sound as the mean over the room.
pub(crate) struct Diffuse {
    /// Energies by bin since the source sounded, with the source's mean directivity, but not its level.
    pub(crate) energies: Vec<PerBand>,
    /// By bin, how their logarithms grow with the logits of each surface and of scattering.
    pub(crate) slopes: Vec<Vec<PerBand>>,
    pub(crate) bin_s: f64,
}

/// All numbers, with what they are compared about.
#[derive(Clone, Copy)]
pub(crate) struct Iterate<'a> {
    /// All numbers, as [`Unknowns`](super::Unknowns) places them.
    pub(crate) x: &'a [f64],
    pub(crate) geometry: &'a Geometry,
    pub(crate) stage: &'a Stage,
    pub(crate) diffuse: &'a Diffuse,
}
