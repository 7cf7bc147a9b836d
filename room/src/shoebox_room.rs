//! Box rooms as scenes.

use crate::error::RoomError;
use crate::late::{HopEnergies, LONGEST_EARLY_S, SHORTEST_EARLY_S, decay_s, hop_energies, time_filters};
use crate::receiver::Receiver;
use promenade_acoustics::{
    Air, BoxImage, Echogram, Image, OCTAVES_HZ, ParticleOptions, SPEED_OF_SOUND_M_S, Share, Shoebox, box_images,
};
use promenade_core::glam::{DVec3, Vec3};
use promenade_core::{
    Anchor, Axis, Facing, Field, FieldGrid, ImageSource, ImageSources, Pose, Provenance, Rows, Scene, SceneParts, TailModel,
    TransferShape, late_share,
};
use std::f64::consts::LN_10;

/// The least and the greatest length of a side, metres.
pub const SIZES_M: (f64, f64) = (0.5, 200.0);
/// Image sources that a room is usually played with.
pub const PLAYED_IMAGES: usize = 60;
/// Of the noise with seed 1: of 64 draws at 48 kHz the one whose octaves decay most truly, with reverberation times of 0.4 to
/// 1.8 s. There is no time to try draws while a room is drawn.
const NOISE_SEED: u64 = 48;
/// The emitter keeps this far from the walls, metres.
const OFF_WALLS_M: f64 = 0.01;
/// Reflections of the images among which the played ones are.
const ORDER: u32 = 6;
/// Images farther than this from the emitter are left to the late field, metres: scenes have none.
const FARTHEST_M: f64 = 199.0;
/// Cells of the late field in a cube.
const CELLS: f64 = 12.0;
/// Most cells along an axis.
const MOST_CELLS: usize = 8;
/// Particles that fly for a second, and the least and greatest number of them.
const PARTICLES_A_SECOND: f64 = 2500.0;
const PARTICLES: (f64, f64) = (1024.0, 8192.0);
/// The longest that particles fly, seconds.
const LONGEST_S: f64 = 3.0;
/// The longest reverberation time, seconds: that of hard walls in air alone is longer than any room's.
const LONGEST_T60_S: f64 = 60.0;
/// Distance of places from walls, metres, where there is room for it.
const MARGIN_M: f32 = 0.3;
/// Metres between points of the outline.
const OUTLINE_M: f32 = 0.25;

/// A box in the world with an emitter.
#[derive(Clone, Debug, PartialEq)]
pub struct ShoeboxRoom {
    /// Size and materials.
    pub walls: Shoebox,
    /// The box's corner of least coordinates in the world, metres.
    pub corner: Vec3,
    /// Where the sound comes from in the world, metres.
    pub emitter: Vec3,
}

/// How a scene is made of a room.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneOptions {
    /// Image sources that are played, at most; the strongest are.
    pub images: usize,
    /// Seed of scattering and noise.
    pub seed: u64,
    /// Name shown to the user.
    pub title: String,
    /// How the scene is made, in one line, for its provenance.
    pub recipe: String,
}

/// Cells of the late field.
struct Cells {
    counts: [usize; 3],
    axes: [Axis; 3],
    /// Their middles in the box, `[z][y][x]`.
    middles: Vec<DVec3>,
}

impl Cells {
    fn of(size: [f64; 3], corner: Vec3) -> Self {
        let side = (size.iter().product::<f64>() / CELLS).cbrt();
        let counts = size.map(|length| ((length / side).round() as usize).clamp(1, MOST_CELLS));
        let step: [f64; 3] = std::array::from_fn(|a| size[a] / counts[a] as f64);
        let axes = std::array::from_fn(|a| {
            let first = corner[a] + 0.5 * step[a] as f32;
            if counts[a] == 1 { Axis::single(first) } else { Axis::uniform(first, step[a] as f32, counts[a]) }
        });
        let [x, y, z] = counts;
        let place = |i: usize| DVec3::new((i % x) as f64, (i / x % y) as f64, (i / x / y) as f64);
        let middles = (0..x * y * z).map(|i| (place(i) + 0.5) * DVec3::from(step)).collect();
        Self { counts, axes, middles }
    }
}

impl ShoeboxRoom {
    /// The room as a scene that is heard with a head: its strongest image sources, exact and seen from everywhere, and noise
    /// with the energy of all other sound by time, band and place. The same input makes the same scene.
    ///
    /// Levels are such that a listener at 1 m from the emitter in a diffuse field of the room's mean energy at 1 kHz hears a
    /// gain of 1.
    ///
    /// # Errors
    /// A side that is not finite or outside [`SIZES_M`], a share of a material outside 0 to 1, an emitter that is not in the
    /// room and off its walls.
    pub fn scene(&self, receiver: &Receiver, options: &SceneOptions) -> Result<Scene, RoomError> {
        let source = self.check()?;
        let walls = &self.walls;
        let air = Air::default();
        let (grid, bands) = (receiver.grid, &receiver.bands);
        let cells = Cells::of(walls.size, self.corner);
        let images = self.played(source, &cells, options.images)?;
        let longest = walls.eyring_t60_s(Some(air)).into_iter().fold(0.05, |a: f64, t| a.max(t.min(LONGEST_T60_S)));
        let taps = ((0.5 * longest).clamp(SHORTEST_EARLY_S, LONGEST_EARLY_S) / grid.hop_s()).round() as usize;
        let shape = TransferShape { bins: grid.bins(), bands: bands.count(), taps };
        let reach = DVec3::from(walls.size).length() / SPEED_OF_SOUND_M_S;
        let length_s = (taps as f64 * grid.hop_s() + reach + 0.5 * longest).min(LONGEST_S.max(reach + 1.0));
        let rays = ParticleOptions {
            particles: (PARTICLES_A_SECOND / length_s).clamp(PARTICLES.0, PARTICLES.1) as usize,
            length_s,
            bin_s: 0.5 * grid.hop_s(),
            cells: cells.counts,
            air: Some(air),
            seed: options.seed,
        };
        let direct = BoxImage { rooms: [0; 3] };
        let held: Vec<BoxImage> = std::iter::once(direct).chain(images.iter().map(|(rooms, _)| *rooms)).collect();
        let echograms = walls.late_field(source, &held, &rays)?;
        let distance_s = |place: &DVec3| place.distance(source.into()) / SPEED_OF_SOUND_M_S;
        let rest: Vec<HopEnergies> = echograms
            .iter()
            .zip(&cells.middles)
            .map(|(echogram, place)| hop_energies(echogram, distance_s(place), receiver))
            .collect();
        let t60_s: Vec<f32> =
            decay_s(&rest, taps + 1, grid.hop_s(), longest).into_iter().map(|t| t.min(LONGEST_T60_S as f32)).collect();
        let tail = TailModel { seed: NOISE_SEED.wrapping_add(options.seed), t60_s, coherence: receiver.coherence.clone() };
        let gain = level(&images, &echograms, &cells);
        let hops = rest.iter().map(Vec::len).max().unwrap_or(0);
        let unit = late_unit(&tail, taps, hops, grid.hop_s());
        let rows = rest.iter().flat_map(|energies| {
            let row = time_filters(energies, &unit, shape, gain);
            [vec![0.0], row].concat()
        });
        let [yaw, pitch, roll] = [(); 3].map(|()| Axis::single(0.0));
        let nodes = FieldGrid { position: cells.axes.clone(), facing: Facing::Head { yaw, pitch, roll } };
        let reverberation = Field::new(nodes, TransferShape { bins: 0, ..shape }, Rows::Whole(rows.collect()));
        let field = receiver.direct(self.emitter, gain as f32);
        let (Some(reverberation), Some(field)) = (reverberation, field) else {
            return Err(RoomError::argument("table of the scene", "a row per node", "another number"));
        };
        let here = |at: [f64; 3]| (DVec3::from(at) + self.corner.as_dvec3()).as_vec3();
        let scaled = |image: &Image| {
            let sine = |at: &DVec3| (DVec3::from(image.position) - *at).normalize_or_zero().z;
            let levels = receiver.image_gains(cells.middles.iter().map(sine).sum::<f64>() / cells.middles.len() as f64);
            let gains = std::array::from_fn(|b| gain as f32 * levels[b] * image.gains[b]);
            ImageSource { position: here(image.position), gains }
        };
        let sources: Vec<ImageSource> = images.iter().map(|(_, image)| scaled(image)).collect();
        let count = sources.len();
        let sources = ImageSources {
            images: sources,
            air_db_per_m: OCTAVES_HZ.map(|hz| air.db_per_m(f64::from(hz)) as f32),
            places: [self.emitter.x, self.emitter.y, self.emitter.z].map(Axis::single),
            seen: vec![1.0; count],
            direct: vec![1.0],
            head: receiver.head.clone(),
        };
        let top = self.corner + Vec3::from_array(walls.size.map(|length| length as f32));
        let inset = Vec3::splat(MARGIN_M).min(0.45 * (top - self.corner));
        Ok(Scene::new(SceneParts {
            provenance: Provenance {
                title: options.title.clone(),
                credit: receiver.credit.clone(),
                licence: receiver.licence.clone(),
                recipe: options.recipe.clone(),
                notes: vec![format!("{count} image sources, {} particles, {} cells", rays.particles, cells.middles.len())],
            },
            grid,
            bands: bands.clone(),
            tail,
            taps,
            measured: None,
            measured_head: None,
            field: Some(field),
            room: Some(reverberation),
            images: (count > 0).then_some(sources),
            cloud: None,
            top_hz: receiver.top_hz,
            start_pose: self.start_pose(inset),
            bounds: (self.corner + inset, top - inset),
            anchors: self.outline(),
            held_out: Vec::new(),
        })?)
    }

    /// Where the emitter is in the box, if everything is as it should be.
    fn check(&self) -> Result<[f64; 3], RoomError> {
        let size = self.walls.size;
        if !size.iter().all(|length| (SIZES_M.0..=SIZES_M.1).contains(length)) {
            let expected = format!("three lengths of {} to {} m", SIZES_M.0, SIZES_M.1);
            return Err(RoomError::argument("size of the room", expected, format!("{size:?}")));
        }
        if !self.corner.is_finite() || self.corner.abs().max_element() > 1e4 {
            return Err(RoomError::argument("corner of the room", "three finite coordinates of at most 10 km", self.corner));
        }
        let source = self.emitter.as_dvec3() - self.corner.as_dvec3();
        let inside = |a: usize| (OFF_WALLS_M..=size[a] - OFF_WALLS_M).contains(&source[a]);
        if !(0..3).all(inside) {
            let [x, y, z] = size;
            let expected = format!("inside the room of {x} x {y} x {z} m from {}", self.corner);
            return Err(RoomError::argument("emitter", expected, self.emitter));
        }
        Ok(source.to_array())
    }

    /// The images that are strongest at any cell's middle, the strongest first.
    fn played(&self, source: [f64; 3], cells: &Cells, most: usize) -> Result<Vec<(BoxImage, Image)>, RoomError> {
        let images = self.walls.images(source, ORDER, Share::Specular)?;
        let score = |image: &Image| {
            let near = cells.middles.iter().map(|at| at.distance_squared(image.position.into())).fold(f64::INFINITY, f64::min);
            energy(&image.gains) / near.max(1e-4)
        };
        let near = |image: &Image| DVec3::from(image.position).distance(source.into()) <= FARTHEST_M;
        let all = box_images(ORDER).into_iter().zip(images);
        let mut scored: Vec<(f64, (BoxImage, Image))> = all
            .filter(|(_, image)| image.order > 0 && near(image))
            .map(|pair| (score(&pair.1), pair))
            .filter(|(score, _)| *score > 0.0)
            .collect();
        scored.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.1.index.cmp(&b.1.1.index)));
        scored.truncate(most);
        Ok(scored.into_iter().map(|(_, pair)| pair).collect())
    }

    /// Opposite the emitter, facing it.
    fn start_pose(&self, inset: Vec3) -> Pose {
        let size = Vec3::from_array(self.walls.size.map(|length| length as f32));
        let opposite = 2.0 * self.corner + size - self.emitter;
        let (low, high) = (self.corner + inset, self.corner + size - inset);
        let away = (opposite - self.emitter).truncate();
        // An emitter in the middle has no opposite.
        let way = if away.length() > 1.0 { away } else { Vec3::new(-0.25 * size.x.max(2.0), 0.0, 0.0).truncate() };
        let at = (self.emitter.truncate() + way).extend(self.emitter.z).clamp(low, high);
        let ahead = self.emitter - at;
        Pose::from_ypr(at, ahead.y.atan2(ahead.x), 0.0, 0.0)
    }

    /// Points along the edges, and the emitter.
    fn outline(&self) -> Vec<Anchor> {
        let size = Vec3::from_array(self.walls.size.map(|length| length as f32));
        let corner = |i: usize| self.corner + size * Vec3::from_array([0, 1, 2].map(|a| ((i >> a) & 1) as f32));
        let step = OUTLINE_M.max(size.element_sum() / 200.0);
        let edges = (0..8).flat_map(|i| (0..3).filter(move |a| (i >> a) & 1 == 0).map(move |a| (i, i | (1 << a))));
        let points = edges.flat_map(|(a, b)| {
            let (a, b) = (corner(a), corner(b));
            let count = (a.distance(b) / step).ceil() as usize;
            (0..=count).map(move |n| a.lerp(b, n as f32 / count as f32))
        });
        let grey = |position| Anchor { position, colour: Vec3::splat(0.6) };
        let mut all: Vec<Anchor> = points.map(grey).collect();
        all.push(Anchor { position: self.emitter, colour: Vec3::new(0.9, 0.5, 0.2) });
        all
    }
}

fn energy(gains: &[f32; 7]) -> f64 {
    gains.iter().map(|g| f64::from(*g).powi(2)).sum()
}

/// The gain of the scene: 1 over the amplitude of the direct sound at 1 m with all that walls reflect, mean over the cells, at
/// 1 kHz.
fn level(images: &[(BoxImage, Image)], echograms: &[Echogram], cells: &Cells) -> f64 {
    const BAND: usize = 3;
    let reflected: f64 = cells
        .middles
        .iter()
        .zip(echograms)
        .map(|(at, echogram)| {
            let of =
                |image: &Image| f64::from(image.gains[BAND]).powi(2) / at.distance_squared(image.position.into()).max(0.06);
            images.iter().map(|(_, image)| of(image)).sum::<f64>() + echogram.energy(BAND)
        })
        .sum();
    (1.0 + reflected / cells.middles.len() as f64).sqrt().recip()
}

/// Energy per hop and band that the late part is expected to have at a gain of 1: it sets in over some hops and then decays.
fn late_unit(tail: &TailModel, taps: usize, hops: usize, hop_s: f64) -> HopEnergies {
    let first = taps + 1;
    let at = |hop: usize, t60_s: f32| {
        late_share(hop, taps) * (-6.0 * LN_10 * (hop as f64 - first as f64) * hop_s / f64::from(t60_s)).exp()
    };
    (0..hops.max(first + 1)).map(|hop| tail.t60_s.iter().map(|t| at(hop, *t)).collect()).collect()
}

#[cfg(test)]
mod tests;
