//! The manifest's own types, apart from the scene's: the file is a boundary.

mod cloud;

use super::{BassField, Corners, Emission, ImageSources, Mover, Provenance, TurningRoom};
use crate::decode::field::{Axis, Facing, FieldGrid, Rows, mirrored};
use crate::octave::Octaves;
use crate::{Field, HeldOut, Pose, ResponseMeasures, StftGrid};
use glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};

pub(super) use cloud::ManifestCloud;

/// Version of the format that this code writes and reads.
pub(super) const VERSION: u32 = 2;
/// The largest scene file that is read, bytes.
pub const MAX_SCENE_BYTES: usize = 1 << 30;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Manifest {
    pub(super) version: u64,
    pub(super) title: String,
    pub(super) credit: String,
    pub(super) licence: String,
    pub(super) recipe: String,
    pub(super) notes: Vec<String>,
    pub(super) grid: ManifestGrid,
    pub(super) seed: u64,
    /// Whether the ears' noise differs nearly in phase alone.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub(super) noise_by_phase: bool,
    pub(super) taps: usize,
    /// Absent in scenes whose time filters follow as fast as they can.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) refresh: Option<usize>,
    /// Absent in scenes whose poses are decoded as often as is asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) decodes: Option<usize>,
    pub(super) top_hz: f32,
    pub(super) start: ManifestPose,
    /// Corners of the box of listener positions.
    pub(super) bounds: [[f32; 3]; 2],
    /// Degrees Celsius, relative humidity in per cent, kilopascals; absent where they are 20, 50 and 101.325.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) weather: Option<[f64; 3]>,
    /// Hops of each measured response; absent in scenes that have none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) measured_hops: Option<usize>,
    /// Samples from one of the responses' bass to the next.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) measured_low_step: Option<usize>,
    /// Whether image sources play early reflections of the responses.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub(super) measured_lifted: bool,
    /// Name of the head that the responses were measured with; absent where it is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) measured_head: Option<String>,
    pub(super) field: Option<ManifestField>,
    /// Absent in scenes whose time filters are the field's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) room: Option<ManifestField>,
    /// Absent in scenes without image sources.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) images: Option<ManifestImages>,
    /// Absent where nothing hides the emitter, or nothing more is known of it than of images.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) corners: Option<ManifestCorners>,
    /// Absent in scenes whose bass is like their rest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) bass: Option<ManifestBass>,
    pub(super) cloud: Option<ManifestCloud>,
    pub(super) held_out: Vec<ManifestHeldOut>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ManifestGrid {
    pub(super) sample_rate_hz: f64,
    n_fft: usize,
    hop: usize,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ManifestAxis {
    nodes: Vec<f32>,
    circle: bool,
}

/// Places of a table, along x, y and z.
#[derive(Serialize, Deserialize)]
#[serde(transparent)]
pub(super) struct ManifestPlaces([ManifestAxis; 3]);

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
enum ManifestFacing {
    Emitter { position: [f32; 3], elevation: ManifestAxis, azimuth: ManifestAxis },
    Head { yaw: ManifestAxis, pitch: ManifestAxis, roll: ManifestAxis },
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ManifestField {
    position: [ManifestAxis; 3],
    facing: ManifestFacing,
    pub(super) low_rank: bool,
    /// Whether azimuths on the left are missing, since they are the right ones mirrored.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub(super) mirrored: bool,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ManifestImages {
    pub(super) places: ManifestPlaces,
    pub(super) air_db_per_m: Octaves,
    pub(super) head_rate_hz: f64,
    pub(super) head_lead: usize,
    /// Absent where images keep their place in the world.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    turning: Option<ManifestTurning>,
    /// Absent where the emitter sends the same in all directions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    emission: Option<ManifestEmission>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ManifestEmission {
    elevation: ManifestAxis,
    azimuth: ManifestAxis,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ManifestTurning {
    listener: ManifestPose,
    centre: [f32; 3],
    source_moves: bool,
    side: f32,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ManifestCorners {
    pub(super) places: ManifestPlaces,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ManifestBass {
    pub(super) places: ManifestPlaces,
    pub(super) crossover_hz: f64,
    pub(super) rate_hz: f64,
    pub(super) direct: f32,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ManifestPose {
    position: [f32; 3],
    /// w, x, y, z.
    quat: [f32; 4],
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ManifestHeldOut {
    name: String,
    pose: ManifestPose,
    itd_s: f64,
    ild_db: f64,
    t20_s: Option<f64>,
    edt_s: Option<f64>,
    c50_db: Option<f64>,
    /// Absent in older files.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    levels_db: Vec<f64>,
}

impl ManifestAxis {
    fn axis(self) -> Option<Axis> {
        Axis::new(self.nodes, self.circle)
    }
}

impl ManifestImages {
    pub(super) fn of(images: &ImageSources) -> Self {
        Self {
            places: ManifestPlaces::of(&images.places),
            air_db_per_m: images.air_db_per_m,
            head_rate_hz: images.head.sample_rate_hz,
            head_lead: images.head.lead,
            turning: images.turning.as_ref().map(|room| ManifestTurning {
                listener: (&room.listener).into(),
                centre: room.centre.to_array(),
                source_moves: room.moves == Mover::Source,
                side: room.side,
            }),
            emission: images.emission.as_ref().map(|emission| ManifestEmission {
                elevation: (&emission.elevation).into(),
                azimuth: (&emission.azimuth).into(),
            }),
        }
    }

    /// What the emitter sends, still without its levels and turns, if there is any; an error where an axis does not rise.
    pub(super) fn emission(&mut self) -> Option<Option<Emission>> {
        let Some(ManifestEmission { elevation, azimuth }) = self.emission.take() else { return Some(None) };
        let [elevation, azimuth] = [elevation, azimuth].map(ManifestAxis::axis);
        Some(Some(Emission { elevation: elevation?, azimuth: azimuth?, levels: Vec::new(), turns: Vec::new() }))
    }

    /// The room that turns, still without its mirrors.
    pub(super) fn turning(&self) -> Option<TurningRoom> {
        self.turning.as_ref().map(|room| TurningRoom {
            listener: (&room.listener).into(),
            centre: Vec3::from_array(room.centre),
            moves: if room.source_moves { Mover::Source } else { Mover::Listener },
            side: room.side,
            mirrors: Vec::new(),
        })
    }
}

impl ManifestCorners {
    pub(super) fn of(corners: &Corners) -> Self {
        Self { places: ManifestPlaces::of(&corners.places) }
    }
}

impl ManifestBass {
    pub(super) fn of(bass: &BassField) -> Self {
        Self {
            places: ManifestPlaces::of(&bass.places),
            crossover_hz: bass.crossover_hz,
            rate_hz: bass.rate_hz,
            direct: bass.direct,
        }
    }
}

impl ManifestField {
    pub(super) fn of(field: &Field) -> Self {
        let (grid, low_rank) = (field.grid(), matches!(field.rows(), Rows::LowRank(_)));
        let [x, y, z] = &grid.position;
        let facing = match &grid.facing {
            Facing::Emitter { position, elevation, azimuth } => {
                ManifestFacing::Emitter { position: position.to_array(), elevation: elevation.into(), azimuth: azimuth.into() }
            }
            Facing::Head { yaw, pitch, roll } => {
                ManifestFacing::Head { yaw: yaw.into(), pitch: pitch.into(), roll: roll.into() }
            }
        };
        Self { position: [x.into(), y.into(), z.into()], facing, low_rank, mirrored: mirrored::half(field).is_some() }
    }

    /// The grid; `None` where an axis does not rise.
    pub(super) fn grid(self) -> Option<FieldGrid> {
        let axis = ManifestAxis::axis;
        let facing = match self.facing {
            ManifestFacing::Emitter { position, elevation, azimuth } => {
                Facing::Emitter { position: position.into(), elevation: axis(elevation)?, azimuth: axis(azimuth)? }
            }
            ManifestFacing::Head { yaw, pitch, roll } => {
                Facing::Head { yaw: axis(yaw)?, pitch: axis(pitch)?, roll: axis(roll)? }
            }
        };
        let [x, y, z] = self.position.map(axis);
        Some(FieldGrid { position: [x?, y?, z?], facing })
    }
}

impl Manifest {
    pub(super) fn provenance(&self) -> Provenance {
        Provenance {
            title: self.title.clone(),
            credit: self.credit.clone(),
            licence: self.licence.clone(),
            recipe: self.recipe.clone(),
            notes: self.notes.clone(),
        }
    }
}

impl From<&StftGrid> for ManifestGrid {
    fn from(g: &StftGrid) -> Self {
        Self { sample_rate_hz: g.sample_rate_hz, n_fft: g.n_fft, hop: g.hop }
    }
}

impl From<&ManifestGrid> for StftGrid {
    fn from(g: &ManifestGrid) -> Self {
        Self { sample_rate_hz: g.sample_rate_hz, n_fft: g.n_fft, hop: g.hop }
    }
}

impl ManifestPlaces {
    fn of(axes: &[Axis; 3]) -> Self {
        Self(axes.each_ref().map(Into::into))
    }

    /// The axes; `None` where one does not rise.
    pub(super) fn axes(self) -> Option<[Axis; 3]> {
        let [x, y, z] = self.0.map(ManifestAxis::axis);
        Some([x?, y?, z?])
    }
}

impl From<&Axis> for ManifestAxis {
    fn from(a: &Axis) -> Self {
        Self { nodes: a.nodes().to_vec(), circle: a.is_circle() }
    }
}

impl From<&Pose> for ManifestPose {
    fn from(p: &Pose) -> Self {
        let q = p.orientation;
        Self { position: p.position.to_array(), quat: [q.w, q.x, q.y, q.z] }
    }
}

impl From<&ManifestPose> for Pose {
    fn from(p: &ManifestPose) -> Self {
        let [w, x, y, z] = p.quat;
        Self { position: Vec3::from_array(p.position), orientation: Quat::from_xyzw(x, y, z, w) }
    }
}

impl From<&HeldOut> for ManifestHeldOut {
    fn from(h: &HeldOut) -> Self {
        let m = &h.measured;
        Self {
            name: h.name.clone(),
            pose: (&h.pose).into(),
            itd_s: m.itd_s,
            ild_db: m.ild_db,
            t20_s: m.t20_s,
            edt_s: m.edt_s,
            c50_db: m.c50_db,
            levels_db: h.levels_db.clone(),
        }
    }
}

impl From<&ManifestHeldOut> for HeldOut {
    fn from(h: &ManifestHeldOut) -> Self {
        let measured = ResponseMeasures { itd_s: h.itd_s, ild_db: h.ild_db, t20_s: h.t20_s, edt_s: h.edt_s, c50_db: h.c50_db };
        Self { name: h.name.clone(), pose: (&h.pose).into(), measured, levels_db: h.levels_db.clone() }
    }
}
