//! A place as it is played: an immutable value, read from and written to one file.

mod ambisonics;
mod bass_field;
mod card;
mod check;
mod corners;
mod cost;
mod emission;
mod error;
mod format;
mod head;
mod image_sources;
mod lifted;
mod manifest;
mod measured;
mod older;
mod turning_room;
mod weather;

use crate::network::{CloudEmitter, CloudModel};
use crate::number::single;
use crate::published::{ConvMode, Projection, PublishedOptions};
use crate::{Axis, Bands, Facing, Field, FieldGrid, Pose, Rows, StftGrid, Tier, TransferFunction, TransferShape};
use error::value;
use glam::Vec3;

pub use ambisonics::{NotAmbisonicError, ambisonic_dry};
pub(crate) use bass_field::Shares as BassShares;
pub use bass_field::{BASS_SIGNALS, BassEars, BassField, noise_share, wave_share};
pub use card::SceneCard;
pub use corners::{Corners, DiffractionEdge, barrier_db};
pub(crate) use corners::{MOST_ROUND, Round};
pub(crate) use cost::Cost;
pub use cost::TooCostly;
pub use emission::Emission;
pub use error::SceneError;
pub use head::{MeasuredHead, NoHeadError};
pub use image_sources::{AMBISONIC_CHANNELS, AmbisonicHead, ImageSource, ImageSources};
pub use lifted::Lifted;
pub use manifest::MAX_SCENE_BYTES;
pub use measured::{MeasuredRoom, Site};
pub use turning_room::{Mover, TurningRoom};
pub use weather::Weather;

/// What the time filters of all poses share.
#[derive(Clone, Debug, PartialEq)]
pub struct TailModel {
    /// Seed of the pseudo-random carriers.
    pub seed: u64,
    /// Reverberation time of the late part per band, seconds (60 dB).
    pub t60_s: Vec<f32>,
    /// Interaural coherence of the room's sound per band, real, in [-1, 1].
    pub coherence: Vec<f32>,
}

impl TailModel {
    /// The longest reverberation time of a band, seconds.
    #[must_use]
    pub fn longest_t60_s(&self) -> f32 {
        self.t60_s.iter().fold(0.0, |a, b| a.max(*b))
    }
}

/// A point of the anchor cloud.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Anchor {
    /// World position, metres.
    pub position: Vec3,
    /// Colour, red, green and blue in [0, 1].
    pub colour: Vec3,
}

/// A measured pose that the scene was not baked from, and what was measured there.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldOut {
    /// Name of the measurement.
    pub name: String,
    /// Listener pose in the scene's world.
    pub pose: Pose,
    /// Measures of the response.
    pub measured: ResponseMeasures,
    /// Its energy over both ears where the scene has the level of its measurements, dB: of the whole band, then of the octaves
    /// from 125 Hz on that its rate has; empty where it is not known.
    pub levels_db: Vec<f64>,
}

/// Measures of a binaural room response: direction, decay and clarity. T20, EDT and C50 are means over both ears.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ResponseMeasures {
    /// Interaural time difference, seconds; positive when the left ear is later.
    pub itd_s: f64,
    /// Interaural level difference, dB; positive when the left ear is louder.
    pub ild_db: f64,
    /// Reverberation time from the decay between -5 and -25 dB, seconds; `None` where the response does not decay so far.
    pub t20_s: Option<f64>,
    /// Early decay time from the first 10 dB, seconds; `None` where the response does not decay so far.
    pub edt_s: Option<f64>,
    /// Clarity C50, dB; `None` where the response ends within 50 ms of its onset, as an anechoic one does.
    pub c50_db: Option<f64>,
}

/// Where a scene comes from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Provenance {
    /// Name shown to the user.
    pub title: String,
    /// Whom to credit.
    pub credit: String,
    /// Licence of the data behind the scene.
    pub licence: String,
    /// How it was made: the command with its options, one line.
    pub recipe: String,
    /// Notes of the baker: what was assumed, what was dropped.
    pub notes: Vec<String>,
}

/// An anchor cloud with its decoder, as a stream plays it.
#[derive(Clone, Debug, PartialEq)]
pub struct AnchorCloud {
    /// The learned weights.
    pub model: CloudModel,
    /// How its convolution layers are used; [`ConvMode::Off`] for a model without them.
    pub conv: ConvMode,
    /// How its time filters become taps.
    pub projection: Projection,
    /// The emitter, where its place is known.
    pub emitter: Option<CloudEmitter>,
}

impl AnchorCloud {
    /// How the published head streams it, with `taps` hops of the past besides the present.
    #[must_use]
    pub fn stream_options(&self, taps: usize) -> PublishedOptions {
        PublishedOptions::streaming(self.conv, self.projection, self.model.sizes().frames, taps)
    }
}

/// All parts of a [`Scene`].
#[derive(Clone, Debug, PartialEq)]
pub struct SceneParts {
    /// Where it comes from.
    pub provenance: Provenance,
    /// Short-time Fourier grid of the masks.
    pub grid: StftGrid,
    /// Bands of the time filters.
    pub bands: Bands,
    /// Time filters of all poses.
    pub tail: TailModel,
    /// Explicit time-filter taps, one per hop after the direct sound.
    pub taps: usize,
    /// Measured responses that carry the time filters, and where they were measured; without them noise does. With them the
    /// rows of `field` have no taps.
    pub measured: Option<MeasuredRoom>,
    /// The head that the responses were measured with, where it is known.
    pub measured_head: Option<MeasuredHead>,
    /// Baked transfer functions: the tiers Draft and Standard.
    pub field: Option<Field>,
    /// Time filters by listener position and head orientation, in a table of their own: its shape has no bins, and that of
    /// `field` no taps then.
    pub room: Option<Field>,
    /// Early reflections with a place of their own.
    pub images: Option<ImageSources>,
    /// How the emitter is seen round corners, where geometry has it; without it as the image sources' places have it.
    pub corners: Option<Corners>,
    /// The bass, where waves have it: in every tier, below what all else plays.
    pub bass: Option<BassField>,
    /// Anchor cloud with its decoder: the tiers High and, with convolution layers, Reference.
    pub cloud: Option<AnchorCloud>,
    /// Above this frequency the data say nothing, Hz: masks and filters are held from here for faster host rates.
    pub top_hz: f32,
    /// A measured pose to start at.
    pub start_pose: Pose,
    /// Corners of the box of listener positions that the scene was made for, metres; equal when there is one position.
    pub bounds: (Vec3, Vec3),
    /// The air that it was computed for.
    pub weather: Weather,
    /// Points of the place, for display.
    pub anchors: Vec<Anchor>,
    /// Measurements kept for judging the scene.
    pub held_out: Vec<HeldOut>,
}

impl SceneParts {
    /// A place that plays nothing yet: no taps, tables, images or cloud, known up to the Nyquist frequency, one position at the
    /// origin. What makes a scene states what it has, `SceneParts { taps, ..SceneParts::new(grid, bands, tail) }`.
    #[must_use]
    pub fn new(grid: StftGrid, bands: Bands, tail: TailModel) -> Self {
        Self {
            provenance: Provenance::default(),
            top_hz: single(0.5 * grid.sample_rate_hz),
            grid,
            bands,
            tail,
            taps: 0,
            measured: None,
            measured_head: None,
            field: None,
            room: None,
            images: None,
            corners: None,
            bass: None,
            cloud: None,
            start_pose: Pose::IDENTITY,
            bounds: (Vec3::ZERO, Vec3::ZERO),
            weather: Weather::default(),
            anchors: Vec::new(),
            held_out: Vec::new(),
        }
    }

    /// Sizes of the transfer functions.
    #[must_use]
    pub fn shape(&self) -> TransferShape {
        TransferShape { bins: self.grid.bins(), bands: self.bands.count(), taps: self.taps }
    }
}

/// A place: anchors, field, grid and provenance; immutable, shared between instances and threads.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    parts: SceneParts,
}

impl Scene {
    /// Checks that the parts fit together and are finite.
    ///
    /// # Errors
    /// [`SceneError::Value`] names the first part that does not.
    pub fn new(parts: SceneParts) -> Result<Self, SceneError> {
        check::check(&parts)?;
        Ok(Self { parts })
    }

    /// A scene in which every pose hears one transfer function, in the tiers Draft and Standard.
    ///
    /// # Errors
    /// What [`Scene::new`] refuses; a transfer function that does not fit `grid` and `bands`.
    pub fn of_transfer(
        transfer: &TransferFunction,
        grid: StftGrid,
        bands: Bands,
        tail: TailModel,
        top_hz: f32,
    ) -> Result<Self, SceneError> {
        let shape = TransferShape { bins: grid.bins(), bands: bands.count(), taps: transfer.taps.len() / (2 * bands.count()) };
        let [x, y, z, yaw, pitch, roll] = [(); 6].map(|()| Axis::single(0.0));
        let nodes = FieldGrid { position: [x, y, z], facing: Facing::Head { yaw, pitch, roll } };
        let field = Field::new(nodes, shape, Rows::Whole(transfer.to_row()));
        let field = field.ok_or_else(|| value("transfer function", format!("{shape:?}"), "another shape"))?;
        Self::new(SceneParts { taps: shape.taps, field: Some(field), top_hz, ..SceneParts::new(grid, bands, tail) })
    }

    /// Reads a scene file.
    ///
    /// # Errors
    /// Says what is damaged, too large, of another version or not finite; no byte is trusted.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, SceneError> {
        Self::new(format::read(bytes)?)
    }

    /// The scene as a file's content.
    ///
    /// # Errors
    /// A scene larger than is read, or a container that cannot be written.
    pub fn to_bytes(&self) -> Result<Vec<u8>, SceneError> {
        format::write(&self.parts)
    }

    /// Where it comes from.
    #[must_use]
    pub fn provenance(&self) -> &Provenance {
        &self.parts.provenance
    }

    /// Name shown to the user.
    #[must_use]
    pub fn title(&self) -> &str {
        &self.parts.provenance.title
    }

    /// Whom to credit.
    #[must_use]
    pub fn credit(&self) -> &str {
        &self.parts.provenance.credit
    }

    /// Licence of the data behind the scene.
    #[must_use]
    pub fn licence(&self) -> &str {
        &self.parts.provenance.licence
    }

    /// Short-time Fourier grid of the masks.
    #[must_use]
    pub fn grid(&self) -> &StftGrid {
        &self.parts.grid
    }

    /// Bands of the time filters.
    #[must_use]
    pub fn bands(&self) -> &Bands {
        &self.parts.bands
    }

    /// Time filters of all poses.
    #[must_use]
    pub fn tail(&self) -> &TailModel {
        &self.parts.tail
    }

    /// All parts.
    #[must_use]
    pub fn parts(&self) -> &SceneParts {
        &self.parts
    }

    /// Sizes of the transfer functions.
    #[must_use]
    pub fn shape(&self) -> TransferShape {
        self.parts.shape()
    }

    /// Measured responses that carry the time filters.
    #[must_use]
    pub fn measured(&self) -> Option<&MeasuredRoom> {
        self.parts.measured.as_ref()
    }

    /// The head that the scene was measured with, where it is known.
    #[must_use]
    pub fn measured_head(&self) -> Option<&MeasuredHead> {
        self.parts.measured_head.as_ref()
    }

    /// Baked transfer functions.
    #[must_use]
    pub fn field(&self) -> Option<&Field> {
        self.parts.field.as_ref()
    }

    /// Early reflections with a place of their own.
    #[must_use]
    pub fn images(&self) -> Option<&ImageSources> {
        self.parts.images.as_ref()
    }

    /// How the emitter is seen round corners.
    #[must_use]
    pub fn corners(&self) -> Option<&Corners> {
        self.parts.corners.as_ref()
    }

    /// The bass, where waves have it.
    #[must_use]
    pub fn bass(&self) -> Option<&BassField> {
        self.parts.bass.as_ref()
    }

    /// Anchor cloud with its decoder.
    #[must_use]
    pub fn cloud(&self) -> Option<&AnchorCloud> {
        self.parts.cloud.as_ref()
    }

    /// Highest frequency that the data cover, Hz.
    #[must_use]
    pub fn top_hz(&self) -> f32 {
        self.parts.top_hz
    }

    /// Emitter position in the world, metres, where it is known.
    #[must_use]
    pub fn emitter(&self) -> Option<Vec3> {
        let cloud = self.parts.cloud.as_ref().and_then(|c| c.emitter);
        self.parts.field.as_ref().and_then(Field::emitter).or(cloud.map(|e| e.position))
    }

    /// A measured pose to start at.
    #[must_use]
    pub fn start_pose(&self) -> Pose {
        self.parts.start_pose
    }

    /// The air that it was computed for.
    #[must_use]
    pub fn weather(&self) -> Weather {
        self.parts.weather
    }

    /// Anchor cloud.
    #[must_use]
    pub fn anchors(&self) -> &[Anchor] {
        &self.parts.anchors
    }

    /// Measurements kept for judging the scene.
    #[must_use]
    pub fn held_out(&self) -> &[HeldOut] {
        &self.parts.held_out
    }

    /// Corners of the box of listener positions that the scene was made for, metres; equal when there is one position.
    #[must_use]
    pub fn bounds(&self) -> (Vec3, Vec3) {
        self.parts.bounds
    }

    /// Whether the scene has what a tier renders.
    #[must_use]
    pub fn has_tier(&self, tier: Tier) -> bool {
        let p = &self.parts;
        match tier {
            Tier::Draft => p.field.is_some(),
            Tier::Standard => p.field.is_some() && p.taps > 0,
            Tier::High => p.cloud.is_some(),
            Tier::Reference => p.cloud.as_ref().is_some_and(|c| c.conv != ConvMode::Off),
        }
    }

    /// The tiers that the scene has, the cheapest first.
    pub fn tiers(&self) -> impl DoubleEndedIterator<Item = Tier> + Clone {
        Tier::ALL.into_iter().filter(|t| self.has_tier(*t))
    }

    /// The tier that is played for a wanted one: the best that the scene has up to it, else the cheapest that it has.
    #[must_use]
    pub fn played_tier(&self, wanted: Tier) -> Tier {
        self.tiers().rev().find(|t| *t <= wanted).or_else(|| self.tiers().next()).unwrap_or(wanted)
    }

    /// Bytes that the scene takes in memory, once for all its instances.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let p = &self.parts;
        4 * 3 * p.bands.count()
            + p.measured.as_ref().map_or(0, MeasuredRoom::memory_bytes)
            + [&p.field, &p.room].into_iter().flatten().map(Field::memory_bytes).sum::<usize>()
            + p.images.as_ref().map_or(0, ImageSources::memory_bytes)
            + p.corners.as_ref().map_or(0, Corners::memory_bytes)
            + p.bass.as_ref().map_or(0, BassField::memory_bytes)
            + p.cloud.as_ref().map_or(0, |c| c.model.memory_bytes())
            + p.anchors.len() * size_of::<Anchor>()
            + p.held_out.len() * size_of::<HeldOut>()
            + size_of::<Self>()
    }
}
