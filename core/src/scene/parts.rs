//! What a scene is made of.

use super::setting::FrontPoint;
use super::{BassField, Corners, ImageSources, MeasuredRoom, TailModel, Weather};
use crate::head::HEAD_BANDS;
use crate::network::{CloudEmitter, CloudModel};
use crate::number::single;
use crate::published::{ConvMode, Projection, PublishedOptions};
use crate::{Bands, Field, Pose, StftGrid, TransferShape};
use glam::Vec3;

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
///
/// A part of a scene; a live decoder is made of it, off the audio thread.
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

/// What is known of the head that a scene was measured with.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredHead {
    /// Its name.
    pub name: String,
    /// Its level by band over the scene's directions, both ears together, dB against a diffuse field.
    pub around_db: [f32; HEAD_BANDS],
    /// Level of the left and the right ear by band in a diffuse field against that of both, dB.
    pub diffuse_db: [[f32; HEAD_BANDS]; 2],
}

/// All parts of a [`Scene`].
///
/// Filled by whoever makes a scene (baker, simulation, trainer, reader of files), off the audio thread, and used up by
/// [`Scene::new`](crate::Scene::new).
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
    /// Baked transfer functions, looked up where no cloud is decoded.
    pub field: Option<Field>,
    /// Time filters by listener position and head orientation, in a table of their own: its shape has no bins, and that of
    /// `field` no taps then.
    pub room: Option<Field>,
    /// Early reflections with a place of their own.
    pub images: Option<ImageSources>,
    /// How the emitter is seen round corners, where geometry has it; without it as the image sources' places have it.
    pub corners: Option<Corners>,
    /// The bass, where waves have it: below what all else plays.
    pub bass: Option<BassField>,
    /// Anchor cloud with its decoder, and with convolution layers the published head: played in place of `field`.
    pub cloud: Option<AnchorCloud>,
    /// Times as many hops over which the time filters follow a listener who moves, 1 to 4: accuracy against processor time.
    pub refresh: usize,
    /// Decodes a second of an anchor cloud, at most.
    pub decodes: usize,
    /// Settings of all that it holds with their costs and errors, where they are known.
    pub front: Vec<FrontPoint>,
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
            refresh: 1,
            decodes: usize::MAX,
            front: Vec::new(),
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
