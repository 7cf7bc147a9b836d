//! What a full fit has found.

use super::patches::VoxelFit;
use crate::bands::{BANDS, Bands, Estimate, FITTED_HZ, PerBand, logit, measures, octave_energies_db};
use crate::early::{Chain, EarlyModel, Nodes, WALL_SD_M};
use crate::error::FitError;
use crate::late::{BIN_S, Histories, Surface};
use crate::measurements::{Measurement, Measurements};
use crate::prediction::{Arrival, Prediction, Residual, RoomModel};
use crate::room::{FlatRoom, Path};
use crate::search::Scanned;
use promenade_acoustics::{Directivity, Octaves, fibonacci};
use serde::Serialize;

/// A number that is known less than this much better than before is not determined by the data.
pub(super) const UNDETERMINED: f64 = 0.7;
/// Directions in which what the source sends is told.
const DIRECTIONS: usize = 512;

/// A surface as it was found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SurfaceFit {
    /// Its name.
    pub name: String,
    /// Absorption by band.
    pub absorption: [Estimate; BANDS],
}

/// Where a measurement was made, as it was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// The source, metres.
    pub source_m: [f64; 3],
    /// Standard error of its coordinates, metres; 0 of a place that was not moved.
    pub source_error_m: [f64; 3],
    /// The microphone, metres.
    pub microphone_m: [f64; 3],
    /// Standard error of its coordinates, metres; 0 of a place that was not moved.
    pub microphone_error_m: [f64; 3],
    /// When the source sounded, seconds from the first sample.
    pub began_s: f64,
}

/// A wall as it was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WallFound {
    /// Metres that it moved along its normal in the whole.
    pub moved_m: f64,
    /// Standard error of that, metres; 0 of a wall that was not moved.
    pub error_m: f64,
    /// What the scan said of it.
    pub scanned: Scanned,
}

impl WallFound {
    /// Whether the data say where it is.
    #[must_use]
    pub fn is_determined(&self) -> bool {
        self.scanned.found || self.error_m < UNDETERMINED * WALL_SD_M
    }
}

/// What was found of a room.
#[derive(Clone, Debug)]
pub struct FullFit {
    /// The room, with its walls where they were found.
    pub room: FlatRoom,
    /// Its walls.
    pub walls: Vec<WallFound>,
    /// The bands of all numbers by band.
    pub bands: Bands,
    /// Surfaces.
    pub surfaces: Vec<SurfaceFit>,
    /// Scattering of all surfaces alike.
    pub scattering: [Estimate; BANDS],
    /// Directivity of the source: logarithm of its amplitude towards each of its nodes over that on its axis; none where it is
    /// taken to be omnidirectional.
    pub node_levels: Vec<PerBand>,
    /// Logarithm of its amplitude on its axis, over that of the chain.
    pub level: PerBand,
    /// Whether nodes turn with where sources face.
    pub facing: bool,
    /// The chain's response.
    pub chain: Chain,
    /// Places of the measurements.
    pub places: Vec<Found>,
    /// What surfaces do not explain.
    pub residual: Residual,
    /// Reflections of images.
    pub order: u32,
    /// Seconds that were compared.
    pub(crate) window_s: f64,
    /// What patches of surfaces absorb, if these have numbers of their own.
    pub voxels: Option<VoxelFit>,
    /// Sources and microphones as they were stated.
    pub(crate) stated: Vec<[[f64; 3]; 2]>,
    /// Octaves whose reverberation was not measured, hertz.
    pub missing_hz: Vec<f64>,
    /// Mean difference of logarithms that is left.
    pub left: f64,
    /// Whether responses agree with the room wave by wave, so that these were compared in the end, not magnitudes alone.
    pub waves: bool,
    /// Rays of the room.
    pub histories: Histories,
}

impl FullFit {
    /// All numbers as a model of the same surfaces has them, with walls where they were found.
    pub(crate) fn numbers(&self, model: &EarlyModel<'_>) -> Vec<f64> {
        let u = &model.u;
        let mut x = vec![0.0; u.count()];
        for b in 0..BANDS {
            (0..u.surfaces).for_each(|s| x[u.absorption(s, b)] = logit(self.surfaces[s].absorption[b].value));
            x[u.scattering(b)] = logit(self.scattering[b].value);
            x[u.level(b)] = self.level[b];
            (0..u.nodes).for_each(|n| x[u.node(n, b)] = self.node_levels[n][b]);
        }
        for (i, (found, stated)) in self.places.iter().zip(&self.stated).enumerate() {
            for a in 0..3 {
                x[u.place(i) + a] = found.source_m[a] - stated[0][a];
                x[u.place(i) + 3 + a] = found.microphone_m[a] - stated[1][a];
            }
            x[u.place(i) + 6] = 1e3 * (found.began_s - model.delay_s);
        }
        x
    }

    /// Source and microphone of a measurement: where those of the fit that are stated to be there were found.
    #[must_use]
    pub fn found(&self, at: &Measurement) -> [[f64; 3]; 2] {
        let of = |place: [f64; 3], side: usize| {
            let same = self.stated.iter().position(|s| s[side] == place);
            same.map_or(place, |i| if side == 0 { self.places[i].source_m } else { self.places[i].microphone_m })
        };
        [of(at.source.at_m, 0), of(at.microphone.at_m, 1)]
    }

    /// The source's directivity about its axis, which is x; of a source that faces nowhere x of the room.
    ///
    /// # Errors
    /// What was found is not finite.
    pub fn directivity(&self) -> Result<Directivity, FitError> {
        if self.node_levels.is_empty() {
            return Ok(Directivity::default());
        }
        let nodes = Nodes::new(self.node_levels.len());
        let directions: Vec<([f64; 3], Octaves)> = (0..DIRECTIONS)
            .map(|i| {
                let towards = if i == 0 { [1.0, 0.0, 0.0] } else { fibonacci(i, DIRECTIONS) };
                let shares = nodes.shares(towards, None);
                let levels: PerBand =
                    std::array::from_fn(|b| shares.iter().map(|(n, s)| s * self.node_levels[usize::from(*n)][b]).sum::<f64>());
                let octaves = self.bands.to_octaves(&levels);
                (towards, std::array::from_fn(|o| octaves[o + 1].exp() as f32))
            })
            .collect();
        Directivity::measured(&directions)
    }

    /// What these data do not determine, in words: surfaces and in how many bands, and walls that may be elsewhere.
    #[must_use]
    pub fn undetermined(&self) -> Vec<String> {
        let count = |all: &[Estimate]| all.iter().filter(|e| !e.determined).count();
        let surfaces = self.surfaces.iter().map(|s| (s.name.as_str(), count(&s.absorption)));
        let surfaces = surfaces.chain([("scattering", count(&self.scattering))]).filter(|(_, n)| *n > 0);
        let walls = self.walls.iter().zip(&self.room.walls).filter(|(f, _)| f.error_m > 0.0 && !f.is_determined());
        surfaces
            .map(|(name, bands)| format!("{name} ({bands} of {BANDS} bands)"))
            .chain(walls.map(|(_, wall)| format!("where {} is", self.room.surfaces[wall.surface])))
            .collect()
    }

    /// Absorption of each surface and scattering in an octave of [`FITTED_HZ`].
    #[must_use]
    pub fn octave(&self, number: usize) -> Vec<Surface> {
        let mean = |values: &PerBand| self.bands.to_octaves(values)[number].clamp(0.0, 1.0);
        let scattering = mean(&self.scattering.map(|e| e.value));
        self.surfaces.iter().map(|s| Surface { absorption: mean(&s.absorption.map(|e| e.value)), scattering }).collect()
    }

    /// Energies that rays bring by bin since the source sounded, octave by octave, all and what images do not have, over that
    /// of the chain.
    fn rays(&self, number: usize) -> [Vec<f64>; 2] {
        let power: PerBand = std::array::from_fn(|b| {
            let mean = self.node_levels.iter().map(|n| (2.0 * n[b]).exp()).sum::<f64>() / self.node_levels.len() as f64;
            (if self.node_levels.is_empty() { 1.0 } else { mean }) * (2.0 * self.level[b]).exp()
        });
        let level = self.bands.to_octaves(&power)[number];
        let air = self.histories.air.energy_decay_per_m(FITTED_HZ[number]);
        let mut energies = self.histories.energies(&self.octave(number), self.order, air);
        energies.iter_mut().flatten().for_each(|e| *e *= level);
        energies
    }

    /// Reverberation time in an octave as rays and residual say, seconds; NaN where there is none.
    #[must_use]
    pub fn t20_s(&self, number: usize) -> f64 {
        let [mut diffuse, _] = self.rays(number);
        diffuse.iter_mut().enumerate().for_each(|(bin, e)| *e *= self.residual.at(number, bin));
        measures(&diffuse, BIN_S)[0]
    }

    /// The chain's energy by octave, dB.
    pub(crate) fn chain_db(&self, rate_hz: f64) -> Vec<f64> {
        let mut response: Vec<f32> = self.chain.response.iter().map(|v| *v as f32).collect();
        let length = response.len();
        response.resize(4 * length, 0.0);
        response.rotate_right(length);
        octave_energies_db(&response, rate_hz)
    }

    /// This fit with its residual found anew.
    pub(super) fn with_residual(mut self, set: &Measurements) -> Self {
        self.residual = Residual::default();
        if let Some(residual) = Prediction::new(&self, set).map(|bare| bare.residual_of(set)) {
            self.residual = residual;
        }
        self
    }

    /// Amplitudes of a path by band, where the chain on the axis has 1 at 1 m.
    fn gains(&self, path: &Path, facing: Option<[f64; 3]>) -> PerBand {
        let shares = if self.node_levels.is_empty() {
            Vec::new()
        } else {
            Nodes::new(self.node_levels.len()).shares(path.departure, facing.filter(|_| self.facing))
        };
        std::array::from_fn(|b| {
            let directivity: f64 = shares.iter().map(|(n, s)| s * self.node_levels[usize::from(*n)][b]).sum();
            let one = |(s, n): &(u16, f64)| {
                let of = usize::from(*s);
                let own = self.voxels.as_ref().map_or_else(|| &self.surfaces[of].absorption, |v| &v.absorption[of]);
                let left = (1.0 - own[b].value) * (1.0 - self.scattering[b].value);
                0.5 * n * left.max(1e-12).ln()
            };
            let walls: f64 = path.hits.iter().map(one).sum();
            let per_m = self.histories.air.energy_decay_per_m(self.bands.centres_hz[b]);
            (self.level[b] + directivity + walls - 0.5 * per_m * path.length_m).exp() / path.length_m
        })
    }
}

impl RoomModel for FullFit {
    fn chain(&self, set: &Measurements) -> Option<Chain> {
        (!set.all.is_empty()).then(|| self.chain.clone())
    }

    fn arrivals(&self, at: &Measurement, _: &Bands, reach_m: f64) -> Vec<Arrival> {
        let [source, microphone] = self.found(at);
        let sequences = self.room.sequences(&[(source, microphone)], self.order).unwrap_or_default();
        let Some(own) = sequences.first() else { return Vec::new() };
        let arrival =
            |path: &Path| Arrival { length_m: path.length_m, order: path.order(), gains: self.gains(path, at.source.facing) };
        self.room.paths(own, source, microphone, self.order, reach_m).iter().map(arrival).collect()
    }

    fn late_energies(&self, set: &Measurements) -> Vec<Vec<f64>> {
        let octave = |(o, db): (usize, &f64)| {
            let [mut diffuse, _] = self.rays(o);
            diffuse.iter_mut().for_each(|e| *e *= 10f64.powf(db / 10.0));
            diffuse
        };
        self.chain_db(f64::from(set.sample_rate_hz)).iter().enumerate().map(octave).collect()
    }

    fn residual(&self) -> &Residual {
        &self.residual
    }
}
