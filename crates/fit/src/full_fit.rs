//! The full fit: geometry, places, surfaces, scattering and source of a room of flat walls from its measured responses.
//!
//! Rounds of descent (Adam), each about what was found before: the beginnings of responses against images and the mean power of
//! scattered sound, tied to the late part through rays. Places and walls move first, from coarse to fine frequencies; then
//! surfaces and source.

mod descent;
mod errors;
mod late;
mod rescue;
mod result;
pub(crate) mod voxel_fit;

use crate::bands::{BANDS, Bands, PerBand};
use crate::chain::Chain;
use crate::early_model::EarlyModel;
use crate::error::FitError;
use crate::estimate::Estimate;
use crate::flat_room::{FlatRoom, Way};
use crate::full_fit::voxel_fit::VoxelFit;
use crate::histories::Histories;
use crate::late_tie::logit;
use crate::measurements::{LEAST_RESPONSES, Measurement, Measurements, distance};
use crate::picture::Curve;
use crate::residual::Residual;
use crate::saved::Saved;
use crate::source_nodes::{NODES, Nodes};
use crate::unknowns::{Prior, Unknowns, WALL_SD_M};
use crate::wall_scan::Scanned;
use descent::Full;
use promenade_acoustics::{Directivity, Octaves, fibonacci};

pub(crate) use late::late_energies;

/// How a fit goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FullOptions {
    /// Reflections of images.
    pub order: u32,
    /// Seconds from the direct sound on that are compared.
    pub window_s: f64,
    /// Whether walls are scanned and moved.
    pub geometry: bool,
    /// Whether places move within their uncertainty.
    pub places: bool,
    /// Whether what the source sends by direction is sought, where the data can tell.
    pub source: bool,
    /// Seed of rays and of the choice of responses.
    pub seed: u64,
}

impl Default for FullOptions {
    fn default() -> Self {
        Self { order: 8, window_s: 0.05, geometry: true, places: true, source: true, seed: 0 }
    }
}

/// A number that is known less than this much better than before is not determined by the data.
const UNDETERMINED: f64 = 0.7;
/// Directions in which what the source sends is told.
const DIRECTIONS: usize = 512;
/// Source and microphone at least this far apart are different places, metres.
const SAME_PLACE_M: f64 = 1e-3;
/// What a source that faces somewhere sends beside its axis to begin with, by octave from 63 Hz: the sharpness of
/// `exp(sharpness (cos - 1))`.
const SHARPNESS: [f64; 8] = [0.03, 0.05, 0.1, 0.25, 0.5, 0.8, 1.2, 1.6];

/// A surface as it was found.
#[derive(Clone, Debug, PartialEq)]
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
    /// Logarithm of the amplitude that the source sends towards each of its nodes over that of its axis; none where it is taken
    /// to send the same everywhere.
    pub sent: Vec<PerBand>,
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
    /// What pieces of surfaces absorb, if these have numbers of their own.
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

/// Fits a room to measurements. `each` is told the state and the share of the work that is done after every round; a state that
/// it was told goes on to the same bits.
///
/// # Errors
/// A source or a microphone outside of the room, fewer than three measurements, a state of another fit.
pub fn full_fit(
    room: &FlatRoom,
    set: &Measurements,
    options: &FullOptions,
    from: Option<Saved>,
    each: &mut dyn FnMut(&Saved, f64) -> Result<(), FitError>,
) -> Result<FullFit, FitError> {
    let Some(chain) = Chain::of(set) else {
        return Err(FitError::argument("measurements", "at least one", "none"));
    };
    if set.all.len() < LEAST_RESPONSES {
        return Err(FitError::argument("measurements", format!("at least {LEAST_RESPONSES} responses"), set.all.len()));
    }
    room.check_places(set)?;
    let all_face = set.all.iter().all(|m| m.source.facing.is_some());
    let one_source = set.all.iter().all(|m| distance(m.source.at_m, set.all[0].source.at_m) < SAME_PLACE_M);
    // Sources in several places whose facing is not known have no directions in common.
    let nodes = if options.source && (all_face || one_source) { NODES } else { 0 };
    let u = Unknowns { surfaces: room.surfaces.len(), nodes, walls: room.walls.len(), places: set.all.len() };
    let model = EarlyModel::new(u, set, &chain, options.order, options.window_s);
    let sharpness = if all_face { model.bands.from_octaves(&SHARPNESS) } else { [0.0; BANDS] };
    let prior = Prior::new(&u, set, &model.bands, &sharpness, &Nodes::new(nodes).cosines(), all_face);
    let fit = Full { model, prior, options, chain };
    fit.run(room, from, each)
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
            (0..u.nodes).for_each(|n| x[u.node(n, b)] = self.sent[n][b]);
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

    /// The same room with another absorption of a surface, by octave from 125 Hz.
    #[must_use]
    pub fn with_absorption(&self, surface: usize, absorption: &promenade_acoustics::Octaves) -> Self {
        let mut changed = self.clone();
        let octaves: [f64; 8] = std::array::from_fn(|o| f64::from(absorption[o.saturating_sub(1)]));
        let bands = self.bands.from_octaves(&octaves);
        let stated = bands.map(|value| Estimate { value, error: 0.0, determined: true });
        changed.surfaces[surface].absorption = stated;
        if let Some(own) = &mut changed.voxels {
            for (patch, absorption) in own.voxels.patches.iter().zip(&mut own.absorption) {
                if patch.surface == surface {
                    *absorption = stated;
                }
            }
        }
        changed
    }

    /// What the source sends where beside its axis, which is x; of a source that faces nowhere x of the room.
    ///
    /// # Errors
    /// What was found is not finite.
    pub fn directivity(&self) -> Result<Directivity, FitError> {
        if self.sent.is_empty() {
            return Ok(Directivity::default());
        }
        let nodes = Nodes::new(self.sent.len());
        let directions: Vec<([f64; 3], Octaves)> = (0..DIRECTIONS)
            .map(|i| {
                let towards = if i == 0 { [1.0, 0.0, 0.0] } else { fibonacci(i, DIRECTIONS) };
                let shares = nodes.shares(towards, None);
                let sent: PerBand =
                    std::array::from_fn(|b| shares.iter().map(|(n, s)| s * self.sent[usize::from(*n)][b]).sum::<f64>());
                let octaves = self.bands.to_octaves(&sent);
                (towards, std::array::from_fn(|o| octaves[o + 1].exp() as f32))
            })
            .collect();
        Directivity::measured(&directions)
    }

    /// Absorption by surface and band.
    #[must_use]
    pub fn curves(&self) -> Vec<Curve> {
        let points = |s: &SurfaceFit| self.bands.centres_hz.into_iter().zip(s.absorption).collect();
        self.surfaces.iter().map(|s| Curve { name: s.name.clone(), points: points(s) }).collect()
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

    /// Amplitudes of a way by band, where the chain on the axis has 1 at 1 m.
    #[must_use]
    pub fn gains(&self, way: &Way, facing: Option<[f64; 3]>) -> PerBand {
        let shares = if self.sent.is_empty() {
            Vec::new()
        } else {
            Nodes::new(self.sent.len()).shares(way.departure, facing.filter(|_| self.facing))
        };
        std::array::from_fn(|b| {
            let sent: f64 = shares.iter().map(|(n, s)| s * self.sent[usize::from(*n)][b]).sum();
            let one = |(s, n): &(u16, f64)| {
                let of = usize::from(*s);
                let own = self.voxels.as_ref().map_or_else(|| &self.surfaces[of].absorption, |v| &v.absorption[of]);
                let left = (1.0 - own[b].value) * (1.0 - self.scattering[b].value);
                0.5 * n * left.max(1e-12).ln()
            };
            let walls: f64 = way.hits.iter().map(one).sum();
            let per_m = self.histories.air.energy_decay_per_m(self.bands.centres_hz[b]);
            (self.level[b] + sent + walls - 0.5 * per_m * way.length_m).exp() / way.length_m
        })
    }
}
