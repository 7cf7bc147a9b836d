//! A place as it is played: an immutable value, read from and written to one file.

mod ambisonics;
mod bass_field;
mod card;
mod check;
mod corners;
mod cost;
mod emission;
mod emitter;
mod error;
mod format;
mod head;
mod image_sources;
mod less;
mod lifted;
mod manifest;
mod measured;
mod parts;
mod setting;
mod tail;
mod turning_room;
mod weather;

use crate::{Axis, Bands, Facing, Field, FieldGrid, Pose, Rows, StftGrid, TransferFunction, TransferShape};
use error::value;
use glam::Vec3;

pub use ambisonics::{NotAmbisonicError, ambisonic_dry};
pub(crate) use bass_field::Shares as BassShares;
pub use bass_field::{BASS_SIGNALS, BassEars, BassField, noise_share, wave_share};
pub use card::SceneCard;
pub use corners::{Corners, DiffractionEdge, barrier_db, lit_gain};
pub(crate) use corners::{MOST_ROUND, Round};
pub(crate) use cost::Cost;
pub use cost::TooCostly;
pub use emission::Emission;
pub use error::SceneError;
pub use head::NoHeadError;
pub use image_sources::{AMBISONIC_CHANNELS, AmbisonicHead, ImageSource, ImageSources};
pub use lifted::Lifted;
pub use manifest::MAX_SCENE_BYTES;
pub use measured::{MeasuredRoom, Site};
pub use parts::{Anchor, AnchorCloud, HeldOut, MeasuredHead, Provenance, ResponseMeasures, SceneParts};
pub use setting::{Audible, FrontPoint, Measure, Setting};
pub use tail::TailModel;
pub use turning_room::{Mover, TurningRoom};
pub use weather::Weather;

/// A place: anchors, field, grid and provenance.
///
/// Read from bytes or made by a baker, off the audio thread. Immutable from then on: every renderer that plays it shares it.
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

    /// A scene in which every pose hears one transfer function.
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

    /// What playing it takes at a host's rate while the listener walks and turns, about nanoseconds of a processor a second:
    /// counts of operations, each weighed, so that they are the same on every machine.
    #[must_use]
    pub fn operations(&self, sample_rate_hz: f64) -> f64 {
        cost::operations(&self.parts, &self.grid().at_rate(sample_rate_hz))
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
