//! Box rooms as scenes.

use crate::bass::{CROSSOVERS_HZ, RoomBass, bass_axis, bass_places, crossover_hz, whole_hz};
use crate::error::RoomError;
use crate::late::{HopEnergies, LONGEST_T60_S, LateEnergies, early_taps, sided};
use crate::reverberation::decaying;
use crate::scene_head::SceneHead;
use crate::surfaces::{LatePart, Places, Played, Surfaces, outline};
use promenade_acoustics::{Air, BoxImage, Echogram, LowPlaces, ParticleOptions, Reflected, Shoebox, box_images, low_t20_s};
use promenade_core::glam::{DVec3, Vec3};
use promenade_core::{Axis, Pose, Provenance, Scene, TailModel, TransferShape, late_share};
use std::f32::consts::PI;
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
/// Cells of the late field in a cube.
const CELLS: f64 = 12.0;
/// Most cells along an axis.
const MOST_CELLS: usize = 8;
/// Particles that fly for a second, and the least and greatest number of them.
const PARTICLES_A_SECOND: f64 = 2500.0;
const PARTICLES: (f64, f64) = (1024.0, 8192.0);
/// The longest that particles fly, seconds.
const LONGEST_S: f64 = 3.0;
/// Length of the bass, seconds.
const SHORTEST_BASS_S: f64 = 0.15;
const LONGEST_BASS_S: f64 = 3.0;
/// Its places keep this far from the walls, metres.
const BASS_OFF_WALLS_M: f32 = 0.12;
/// The most that it takes, as [`Shoebox::low_field_cost`] counts: some 30 ms.
const MOST_BASS: f64 = 1.4e7;
/// Distance of places from walls, metres, where there is room for it.
const MARGIN_M: f32 = 0.3;

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
    /// The air.
    pub air: Air,
    /// Below this frequency, Hz, the sum over modes is in the place of images and particles; 0 for none. Without it as high as
    /// the room's size asks for and time allows.
    pub waves_hz: Option<f64>,
    /// Height over the floor of the one layer of places that waves have, metres; without it there are as many as waves need.
    pub layer_m: Option<f32>,
    /// Level of the direct sound at 1 m over that of the dry sound, dB.
    pub gain_db: f64,
    /// Seed of scattering and noise.
    pub seed: u64,
    /// Name shown to the user.
    pub title: String,
    /// How the scene is made, in one line, for its provenance.
    pub recipe: String,
}

/// Cells of the late field along each axis, and their middles as places.
fn cells(size: [f64; 3], corner: Vec3) -> ([usize; 3], Places) {
    let side = (size.iter().product::<f64>() / CELLS).cbrt();
    let counts = size.map(|length| ((length / side).round() as usize).clamp(1, MOST_CELLS));
    let step: [f64; 3] = std::array::from_fn(|a| size[a] / counts[a] as f64);
    let axes = std::array::from_fn(|a| {
        let first = corner[a] + 0.5 * step[a] as f32;
        if counts[a] == 1 { Axis::single(first) } else { Axis::uniform(first, step[a] as f32, counts[a]) }
    });
    let [x, y, z] = counts;
    let place = |i: usize| DVec3::new((i % x) as f64, (i / x % y) as f64, (i / x / y) as f64);
    let at = (0..x * y * z).map(|i| corner.as_dvec3() + (place(i) + 0.5) * DVec3::from(step)).collect();
    (counts, Places { axes, at, nearest: (0..x * y * z).collect() })
}

impl ShoeboxRoom {
    /// The room as a scene that is heard with a head: its strongest image sources, exact and seen from everywhere, and noise
    /// with the energy of all other sound by time, band and place. The same input makes the same scene.
    ///
    /// At a gain of 0 dB the direct sound at 1 m has the level of the dry sound.
    ///
    /// # Errors
    /// A side that is not finite or outside [`SIZES_M`], a share of a material outside 0 to 1, an emitter that is not in the
    /// room and off its walls.
    pub fn scene(&self, head: &SceneHead, options: &SceneOptions) -> Result<Scene, RoomError> {
        self.surfaces(head, options)?.scene(head, NOISE_SEED.wrapping_add(options.seed), &Modelled { head })
    }

    /// What the room gives of itself.
    ///
    /// # Errors
    /// The rooms that [`Self::scene`] refuses.
    pub fn surfaces(&self, head: &SceneHead, options: &SceneOptions) -> Result<Surfaces, RoomError> {
        let source = self.check()?;
        let walls = &self.walls;
        let air = options.air;
        let hop_s = head.grid.hop_s();
        let corner = self.corner.as_dvec3();
        let (counts, places) = cells(walls.size, self.corner);
        let emitter = corner + DVec3::from(source);
        let mut images = walls.images(source, ORDER, Reflected::Specular)?;
        images.iter_mut().for_each(|image| image.position = (DVec3::from(image.position) + corner).to_array());
        let played = Played::strongest(&places, emitter, options.images, |_| &images);
        let longest = walls.eyring_t60_s(Some(air)).into_iter().fold(0.05, |a: f64, t| a.max(t.min(LONGEST_T60_S)));
        let reach = DVec3::from(walls.size).length() / air.speed_m_s();
        let taps_s = early_taps(longest, hop_s) as f64 * hop_s;
        let length_s = (taps_s + reach + 0.5 * longest).min(LONGEST_S.max(reach + 1.0));
        let rays = ParticleOptions {
            particles: (PARTICLES_A_SECOND / length_s).clamp(PARTICLES.0, PARTICLES.1) as usize,
            length_s,
            bin_s: 0.5 * hop_s,
            cells: counts,
            air: Some(air),
            seed: options.seed,
        };
        // Images are numbered as their rooms are; the first is the emitter itself.
        let rooms = box_images(ORDER);
        let held: Vec<BoxImage> = std::iter::once(0).chain(played.images.iter().map(|i| i.index)).map(|i| rooms[i]).collect();
        let echograms = walls.late_field(source, &held, &rays)?;
        let heard = places.at.iter().zip(&echograms);
        let late =
            |(at, echogram): (&DVec3, &Echogram)| LateEnergies::of(echogram, at.distance(emitter) / air.speed_m_s(), head);
        let size = Vec3::from_array(walls.size.map(|length| length as f32));
        let inset = Vec3::splat(MARGIN_M).min(0.45 * size);
        let bass = self.bass(source, longest, options)?;
        let low = bass.as_ref().map(|bass| format!("waves below {:.0} Hz", bass.crossover_hz));
        let note = format!("{} image sources, {} particles, {} cells", played.images.len(), rays.particles, places.at.len());
        Ok(Surfaces {
            emitter: self.emitter,
            direct: vec![1.0; places.at.len()],
            open: true,
            late: heard.map(late).collect(),
            emission: None,
            corners: None,
            bass,
            gain: 10.0_f64.powf(options.gain_db / 20.0),
            typical_t60_s: longest,
            air: Some(air),
            start_pose: self.start_pose(inset),
            bounds: (self.corner + inset, self.corner + size - inset),
            outline: outline(&self.edges(), self.emitter),
            provenance: Provenance {
                title: options.title.clone(),
                credit: head.credit.clone(),
                licence: head.licence.clone(),
                recipe: options.recipe.clone(),
                notes: [note].into_iter().chain(low).collect(),
            },
            places,
            played,
        })
    }

    /// The bass by the sum over modes, where it takes little time.
    fn bass(&self, source: [f64; 3], longest_s: f64, options: &SceneOptions) -> Result<Option<RoomBass>, RoomError> {
        let (walls, speed_m_s) = (&self.walls, options.air.speed_m_s());
        let [t60_s, ..] = walls.eyring_t60_s(None);
        let length_s = (1.1 * t60_s.min(longest_s)).clamp(SHORTEST_BASS_S, LONGEST_BASS_S);
        let size = Vec3::from_array(walls.size.map(|length| length as f32));
        let by_itself = || crossover_hz(walls.volume_m3(), t60_s.min(LONGEST_BASS_S));
        let Some(mut crossover_hz) = options.waves_hz.map_or_else(by_itself, |hz| (hz > 0.0).then_some(hz)) else {
            return Ok(None);
        };
        loop {
            let off = Vec3::splat(BASS_OFF_WALLS_M).min(0.2 * size);
            let layer = options.layer_m.map(|height| Axis::single(height.clamp(off.z, size.z - off.z)));
            let axis = |axis: usize| bass_axis(off[axis], size[axis] - off[axis], crossover_hz, axis == 2);
            let axes = [axis(0), axis(1), layer.unwrap_or_else(|| axis(2))];
            let coordinates = axes.each_ref().map(|axis| axis.nodes().iter().map(|at| f64::from(*at)).collect());
            let places = LowPlaces { axes: coordinates, top_hz: whole_hz(crossover_hz), length_s, speed_m_s };
            if options.waves_hz.is_none() && walls.low_field_cost(&places) > MOST_BASS {
                crossover_hz *= 0.9;
                if crossover_hz < CROSSOVERS_HZ.0 {
                    return Ok(None);
                }
                continue;
            }
            let mut field = walls.low_field(source, &places)?;
            let at: Vec<[f64; 3]> = bass_places(&axes).iter().map(DVec3::to_array).collect();
            field.add_direct(-1.0, source, &at, speed_m_s);
            if let Some(t20_s) = low_t20_s(&[decaying(walls, options.air, source, options.seed)?]) {
                field.decay_as(0..at.len(), t20_s);
            }
            let moved = |(axis, by): (&Axis, f32)| {
                Axis::new(axis.nodes().iter().map(|at| at + by).collect(), false).unwrap_or_else(|| axis.clone())
            };
            let [x, y, z] = &axes;
            let by = self.corner;
            let axes = [moved((x, by.x)), moved((y, by.y)), moved((z, by.z))];
            return Ok(Some(RoomBass { crossover_hz, axes, field }));
        }
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

    /// The twelve edges, world.
    fn edges(&self) -> Vec<[Vec3; 2]> {
        let size = Vec3::from_array(self.walls.size.map(|length| length as f32));
        let corner = |i: usize| self.corner + size * Vec3::from_array([0, 1, 2].map(|a| ((i >> a) & 1) as f32));
        let along = |i: usize| (0..3).filter(move |a| (i >> a) & 1 == 0).map(move |a| [corner(i), corner(i | (1 << a))]);
        (0..8).flat_map(along).collect()
    }
}

/// Turns of the head that are told apart in what comes from one side.
const TURNS: usize = 6;

/// The late part as it is expected to be played, which takes no time: the seed stays.
struct Modelled<'a> {
    head: &'a SceneHead,
}

impl LatePart for Modelled<'_> {
    /// It sets in over some hops and then decays.
    fn unit(
        &self,
        tail: &mut TailModel,
        shape: TransferShape,
        late: &[LateEnergies],
        _start: usize,
    ) -> Result<HopEnergies, RoomError> {
        let first = shape.taps + 1;
        let hops = late.iter().map(|late| late.energies.len()).max().unwrap_or(0);
        let at = |hop: usize, t60_s: f32| {
            let hops_s = (hop as f64 - first as f64) * self.head.grid.hop_s();
            late_share(hop, shape.taps) * (-6.0 * LN_10 * hops_s / f64::from(t60_s)).exp()
        };
        Ok((0..hops.max(first + 1)).map(|hop| tail.t60_s.iter().map(|t| at(hop, *t)).collect()).collect())
    }

    fn turned(&self, rows: Vec<Vec<f32>>, late: &[LateEnergies], shape: TransferShape) -> (Axis, Vec<Vec<Vec<f32>>>) {
        let yaw = Axis::circle(-PI, TURNS);
        let all = |(row, late): (Vec<f32>, &LateEnergies)| {
            let turned = |yaw: &f32| sided(&row, &late.vectors, shape, |vector| self.head.sides(vector, *yaw));
            yaw.nodes().iter().map(turned).collect()
        };
        let rows = rows.into_iter().zip(late).map(all).collect();
        (yaw, rows)
    }
}

#[cfg(test)]
mod tests;
