//! Rooms of surfaces as scenes: what images and rays bring to some places, made into what is played.

use crate::bass::RoomBass;
use crate::error::RoomError;
use crate::late::{HopEnergies, LateEnergies, decay_s, early_taps, time_filters};
use crate::scene_head::SceneHead;
use promenade_acoustics::{Air, BANDS, Image, OCTAVES_HZ, Octaves};
use promenade_core::glam::{DVec3, Vec3};
use promenade_core::{
    Anchor, Axis, Corners, Emission, Facing, Field, FieldGrid, ImageSource, ImageSources, Pose, Provenance, Rows, Scene,
    SceneParts, TailModel, TransferShape, Weather,
};
use std::collections::BTreeMap;

/// Images farther than this from the emitter are left to the late energies, metres: scenes have none.
const FARTHEST_M: f64 = 199.0;
/// Metres between points of an outline at least, and points that it has at most.
const OUTLINE_M: f32 = 0.25;
const OUTLINE_POINTS: usize = 4000;

/// Places of the listener in a room, and the table that they stand for.
#[derive(Clone, Debug)]
pub struct Places {
    /// Nodes of the table, world, metres.
    pub axes: [Axis; 3],
    /// World, metres.
    pub at: Vec<DVec3>,
    /// For each node, `[z][y][x]`, the number of its place.
    pub nearest: Vec<usize>,
}

/// An image that is played.
#[derive(Clone, Debug)]
pub struct PlayedImage {
    /// [`Image::index`].
    pub index: usize,
    /// World, metres.
    pub position: DVec3,
    /// What walls leave of the amplitude.
    pub gains: Octaves,
    /// What walls leave of the amplitude in the octave at 63 Hz.
    pub gain_63: f32,
    /// [`Image::faces`].
    pub faces: Vec<u32>,
}

/// The images of a room that are played, the strongest first.
#[derive(Clone, Debug)]
pub struct Played {
    /// At most as many as asked for.
    pub images: Vec<PlayedImage>,
    /// How much of each a place sees, 0 to 1, `[place][image]`.
    seen: Vec<Vec<f32>>,
}

impl Played {
    /// The images that are strongest at any place, at most so many; `seen_from` has those that a place sees, in the order of
    /// their indices.
    pub fn strongest<'a>(places: &Places, emitter: DVec3, most: usize, seen_from: impl Fn(usize) -> &'a [Image]) -> Self {
        /// An image at all places: the largest share of any place's energy, the sum of what walls leave of it and the number of
        /// places.
        struct Candidate<'a> {
            image: &'a Image,
            score: f64,
            sums: [f64; BANDS],
            sum_63: f64,
            seen: f64,
        }
        let mut found: BTreeMap<usize, Candidate<'_>> = BTreeMap::new();
        for (place, at) in places.at.iter().enumerate() {
            let near = |image: &&Image| image.order > 0 && emitter.distance(image.position.into()) <= FARTHEST_M;
            for image in seen_from(place).iter().filter(near) {
                let fresh = Candidate { image, score: 0.0, sums: [0.0; BANDS], sum_63: 0.0, seen: 0.0 };
                let entry = found.entry(image.index).or_insert(fresh);
                let energy: f64 = image.gains.iter().map(|g| f64::from(*g).powi(2)).sum();
                entry.score = entry.score.max(energy / at.distance_squared(image.position.into()).max(1e-4));
                entry.sums.iter_mut().zip(walls(image)).for_each(|(s, g)| *s += f64::from(g));
                entry.sum_63 += f64::from(image.gain_63 / image.directivity[0]);
                entry.seen += 1.0;
            }
        }
        let mut all: Vec<Candidate<'_>> = found.into_values().filter(|found| found.score > 0.0).collect();
        all.sort_by(|a, b| b.score.total_cmp(&a.score).then(a.image.index.cmp(&b.image.index)));
        all.truncate(most);
        let played = |f: Candidate<'_>| PlayedImage {
            index: f.image.index,
            position: f.image.position.into(),
            gains: f.sums.map(|s| (s / f.seen) as f32),
            gain_63: (f.sum_63 / f.seen) as f32,
            faces: f.image.faces.clone(),
        };
        let images: Vec<PlayedImage> = all.into_iter().map(played).collect();
        let seen = (0..places.at.len()).map(|place| images.iter().map(|image| share(seen_from(place), image)).collect());
        let seen = seen.collect();
        Self { images, seen }
    }
}

/// How much of a played image is seen among those of a place: a surface of two materials reflects one more here and the other
/// more there.
fn share(seen: &[Image], played: &PlayedImage) -> f32 {
    seen.binary_search_by_key(&played.index, |image| image.index).map_or(0.0, |found| {
        let energy = |gains: &Octaves| gains.iter().map(|g| g * g).sum::<f32>();
        (energy(&walls(&seen[found])) / energy(&played.gains).max(1e-12)).sqrt().min(1.0)
    })
}

/// What walls leave of an image's amplitude.
fn walls(image: &Image) -> Octaves {
    std::array::from_fn(|octave| image.gains[octave] / image.directivity[octave])
}

/// How the noise of a room's late part is known and what a head's turns make of it.
pub trait LatePart {
    /// Energy per hop and band that the late part has at a gain of 1, with the noise that `tail` names afterwards. `late` is
    /// what the places hear, `start` the number of the one to start at.
    ///
    /// # Errors
    /// The late part cannot be known.
    fn unit(
        &self,
        tail: &mut TailModel,
        shape: TransferShape,
        late: &[LateEnergies],
        start: usize,
    ) -> Result<HopEnergies, RoomError>;

    /// Turns of the head that are told apart, and the rows of each place for each of them; `rows` are those of a head that
    /// turns anywhere.
    fn turned(&self, rows: Vec<Vec<f32>>, late: &[LateEnergies], shape: TransferShape) -> (Axis, Vec<Vec<Vec<f32>>>);
}

/// What a room gives of itself: made by the baker of a mesh or by a [`ShoeboxRoom`](crate::ShoeboxRoom), used up by
/// [`Self::scene`]. Places are the same, in the same order, everywhere.
#[derive(Clone, Debug)]
pub struct Surfaces {
    /// World, metres.
    pub emitter: Vec3,
    /// Where it is heard.
    pub places: Places,
    /// Images with a place of their own.
    pub played: Played,
    /// How much of the direct sound each place sees, 0 to 1.
    pub direct: Vec<f32>,
    /// Whether all places see all of it, so that a scene needs no table of that.
    pub open: bool,
    /// All other sound at each place.
    pub late: Vec<LateEnergies>,
    /// What the emitter sends where, if not the same in all directions: then neither images nor direct sound have it yet.
    pub emission: Option<Emission>,
    /// How the emitter is seen round corners, if anything hides it; the edges' gains are what is sent to them.
    pub corners: Option<Corners>,
    /// The bass by waves, which then plays below its crossover in the place of all else.
    pub bass: Option<RoomBass>,
    /// Amplitude of the direct sound at 1 m, over that of the dry sound.
    pub gain: f64,
    /// The longest reverberation time that is expected, seconds: taps cover half of it.
    pub typical_t60_s: f64,
    /// What the air takes of images and direct sound.
    pub air: Option<Air>,
    /// Where to start.
    pub start_pose: Pose,
    /// Corners of the box that the listener may be in, world, metres.
    pub bounds: (Vec3, Vec3),
    /// Points to be shown.
    pub outline: Vec<Anchor>,
    /// Where it comes from.
    pub provenance: Provenance,
}

impl Surfaces {
    /// The scene that is heard with a head. `seed` is that of its noise, if `noise` chooses no other.
    ///
    /// # Errors
    /// What `noise` says; parts that make no scene.
    pub fn scene(self, head: &SceneHead, seed: u64, noise: &impl LatePart) -> Result<Scene, RoomError> {
        let (grid, bands) = (head.grid, head.bands.clone());
        let taps = early_taps(self.typical_t60_s, grid.hop_s());
        let shape = TransferShape { bins: grid.bins(), bands: bands.count(), taps };
        let t60_s = decay_s(&self.late, taps + 1, grid.hop_s(), self.typical_t60_s);
        let mut tail = TailModel { seed, t60_s, coherence: head.coherence.clone(), by_phase: false };
        let to_start = |i: &usize| self.places.at[*i].distance_squared(self.start_pose.position.as_dvec3());
        let start = (0..self.places.at.len()).min_by(|a, b| to_start(a).total_cmp(&to_start(b))).unwrap_or(0);
        let unit = noise.unit(&mut tail, shape, &self.late, start)?;
        let gain = self.gain;
        let rows = self.late.iter().map(|late| time_filters(&late.energies, &unit, shape, gain)).collect();
        let (yaw, rows) = noise.turned(rows, &self.late, shape);
        let mut table = Vec::new();
        for row in self.places.nearest.iter().flat_map(|place| &rows[*place]) {
            table.push(0.0);
            table.extend_from_slice(row);
        }
        let facing = Facing::Head { yaw, pitch: Axis::single(0.0), roll: Axis::single(0.0) };
        let nodes = FieldGrid { position: self.places.axes.clone(), facing };
        let room = Field::new(nodes, TransferShape { bins: 0, ..shape }, Rows::Whole(table));
        let (Some(room), Some(field)) = (room, head.direct(self.emitter, gain as f32)) else {
            return Err(RoomError::argument("table of the scene", "a row per node", "another number"));
        };
        let (images, corners) = (self.images(head, gain), self.corners(head, gain));
        let parts = SceneParts {
            provenance: self.provenance,
            taps,
            field: Some(field),
            room: Some(room),
            images: (!images.images.is_empty()).then_some(images),
            corners,
            bass: self.bass.as_ref().map(|bass| bass.scene(gain)),
            top_hz: head.top_hz,
            start_pose: self.start_pose,
            bounds: self.bounds,
            weather: self.air.map_or_else(Weather::default, weather),
            anchors: self.outline,
            ..SceneParts::new(grid, bands, tail)
        };
        Ok(Scene::new(parts)?)
    }

    /// Corners as they are played, at the level of the head ahead.
    fn corners(&self, head: &SceneHead, gain: f64) -> Option<Corners> {
        let mut corners = self.corners.clone()?;
        let levels = head.image_gains(0.0);
        for edge in &mut corners.edges {
            edge.gains.iter_mut().zip(levels).for_each(|(g, level)| *g *= gain as f32 * level);
        }
        Some(corners)
    }

    /// The images as they are played, each at the level of the head at its mean elevation.
    fn images(&self, head: &SceneHead, gain: f64) -> ImageSources {
        let scaled = |image: &PlayedImage| {
            let sines = self.places.at.iter().map(|at| (image.position.z - at.z) / image.position.distance(*at).max(1e-3));
            let levels = head.image_gains(sines.sum::<f64>() / self.places.at.len() as f64);
            let gains = std::array::from_fn(|b| gain as f32 * levels[b] * image.gains[b]);
            let gain_63 = gain as f32 * levels[0] * image.gain_63;
            ImageSource { position: image.position.as_vec3(), gains, gain_63 }
        };
        let (places, nodes) = if self.open {
            (self.emitter.to_array().map(Axis::single), &[0][..])
        } else {
            (self.places.axes.clone(), &self.places.nearest[..])
        };
        ImageSources {
            images: self.played.images.iter().map(scaled).collect(),
            air_db_per_m: OCTAVES_HZ.map(|hz| self.air.map_or(0.0, |air| air.db_per_m(f64::from(hz)) as f32)),
            places,
            seen: nodes.iter().flat_map(|place| self.played.seen[*place].iter().copied()).collect(),
            direct: nodes.iter().map(|place| self.direct[*place]).collect(),
            head: head.head.clone(),
            turning: None,
            emission: self.emission.clone(),
        }
    }
}

/// Air as a scene keeps it.
fn weather(Air { temperature_c, humidity_percent, pressure_kpa }: Air) -> Weather {
    Weather { temperature_c, humidity_percent, pressure_kpa }
}

/// Points along lines, world, metres, and the emitter.
#[must_use]
pub fn outline(lines: &[[Vec3; 2]], emitter: Vec3) -> Vec<Anchor> {
    let whole: f32 = lines.iter().map(|[a, b]| a.distance(*b)).sum();
    let step = OUTLINE_M.max(whole / OUTLINE_POINTS as f32);
    let points = lines.iter().flat_map(|[a, b]| {
        let count = (a.distance(*b) / step).ceil().max(1.0) as usize;
        (0..=count).map(move |i| a.lerp(*b, i as f32 / count as f32))
    });
    let grey = |position| Anchor { position, colour: Vec3::splat(0.6) };
    let mut all: Vec<Anchor> = points.take(OUTLINE_POINTS).map(grey).collect();
    all.push(Anchor { position: emitter, colour: Vec3::new(0.9, 0.5, 0.2) });
    all
}
