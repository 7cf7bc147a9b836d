//! Geometry baking: a room of surfaces becomes a scene of image sources with a late field.
//!
//! The strongest images are played as they are. What the rest of them and the scattered rays bring is energy, by hop and band,
//! that noise carries; together they have all of the room's energy at every place.

mod corrected;

pub use corrected::CorrectedResponse;

use crate::bake::corners::{MOST_BENT, corners};
use crate::bake::direct::Direct;
use crate::bake::emission::emission;
use crate::bake::halved::halved;
use crate::bake::late_unit::Late;
use crate::bake::log_transfer::LogTransfer;
use crate::bake::seed::truest_seed;
use crate::bake::sides::Sides;
use crate::error::BakeError;
use crate::signal::spectrum::Analyser;
use crate::sources::ambisonic::{ambisonic_head, head_responses};
use crate::sources::simulation::{Bass, Hrtf, Inside, OCTAVES_HZ};
use corrected::{correct, joined};
use promenade_acoustics::{
    Air, DiffractionPath, Echogram, Edges, Image, ImageOptions, Images, Mesh, Octaves, RayOptions, Reflected, Room, Source,
    late_field, speed_m_s,
};
use promenade_core::glam::{DVec3, Vec3};
use promenade_core::{
    Axis, Bands, Facing, Field, FieldGrid, Pose, Provenance, Rows, Scene, StftGrid, TailModel, TransferShape,
};
use promenade_fourier::num_complex::Complex32;
use promenade_room::{
    CROSSOVERS_HZ, HopEnergies, LateEnergies, LatePart, Level, Places, Played, RoomBass, SceneHead, Surfaces, bass_axis,
    bass_places, energy_at, outline, whole_hz,
};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::f32::consts::PI;

/// Directions that the direct sound is stored for: elevations from as low as heads are measured to straight up, degrees, close
/// where emitters mostly are, and azimuths.
const ELEVATIONS: [f32; 8] = [-40.0, -20.0, -10.0, 0.0, 10.0, 20.0, 45.0, 90.0];
const AZIMUTHS: usize = 32;
/// Frame of the short-time transform, seconds.
const WINDOW_S: f64 = 0.020;
/// Places of the listener, at most.
const MOST_PLACES: usize = 4096;
/// Reverberation time of a room in which nothing decays in sight, seconds.
const UNKNOWN_T60_S: f64 = 0.3;
/// Places of the bass keep this far from surfaces, metres, and beyond walls its slopes are followed so far.
const BASS_OFF_WALLS_M: f32 = 0.12;
const BEYOND_WALLS_M: f64 = 0.3;
/// Values that the bass of a scene has at most, and samples of its responses in a second for each Hz that they are whole up to.
const MOST_BASS_VALUES: f64 = 5e5;
const SAMPLES: f64 = 2.5;
/// A head is the same on both sides up to this share of its energy, and this interaural delay, seconds.
const MIRRORED_ERROR: f32 = 1e-5;
const MIRRORED_S: f32 = 5e-7;
/// The longest and shortest time that rays are followed, seconds.
const RAY_LENGTH_S: (f64, f64) = (0.3, 8.0);

/// How a scene is made of a room.
#[derive(Clone, Debug, PartialEq)]
pub struct GeometryOptions {
    /// Image sources that are played, at most; the strongest are.
    pub images: usize,
    /// Turns of the head that time filters are stored for, evenly around; with one, what comes more from one side is heard by
    /// both ears alike.
    pub head_turns: usize,
    /// Reflections that an image has at most, and beams that search them.
    pub order: u32,
    /// Beams of the search.
    pub beams: usize,
    /// Rays of the late field.
    pub rays: usize,
    /// Metres between places of the listener.
    pub spacing_m: f32,
    /// Height of the listener's head over the lowest point of the room, metres.
    pub height_m: f32,
    /// Distance of places from surfaces, metres.
    pub margin_m: f32,
    /// What the air takes; nothing without it.
    pub air: Option<Air>,
    /// Below this frequency, Hz, waves are in the place of images and rays; 0 for none. Without it as high as the room's size
    /// asks for, and time and the size of the file allow.
    pub waves_hz: Option<f64>,
    /// Seed of rays and noise.
    pub seed: u64,
    /// Name shown to the user.
    pub title: String,
    /// How the scene is made, in one line, for its provenance.
    pub recipe: String,
}

/// Places of the listener on a plan of the room.
fn plan(mesh: &Mesh, inside: &Inside<'_>, options: &GeometryOptions) -> Result<Places, BakeError> {
    let [low, high] = mesh.bounds().map(|corner| Vec3::from_array(corner.map(|c| c as f32)));
    let axis = |low: f32, high: f32| {
        let (low, high) = (low + options.margin_m, high - options.margin_m);
        let count = ((high - low) / options.spacing_m).max(0.0).floor() as usize + 1;
        // The same distance is left over on both sides.
        let first = 0.5 * (low + high - (count - 1) as f32 * options.spacing_m);
        Axis::uniform(first, options.spacing_m, count)
    };
    let axes = [axis(low.x, high.x), axis(low.y, high.y), Axis::single(low.z + options.height_m)];
    let count = axes[0].count().saturating_mul(axes[1].count());
    if count > MOST_PLACES {
        let found = format!("{count} at {} m", options.spacing_m);
        return Err(BakeError::argument("places of the listener", format!("at most {MOST_PLACES}"), found));
    }
    let z = axes[2].start();
    let nodes: Vec<Vec3> =
        axes[1].nodes().iter().flat_map(|y| axes[0].nodes().iter().map(move |x| Vec3::new(*x, *y, z))).collect();
    let places: Vec<Vec3> = nodes.iter().copied().filter(|at| inside.holds(*at)).collect();
    if places.is_empty() {
        let found = format!("none at a height of {} m and {} m off surfaces", options.height_m, options.margin_m);
        return Err(BakeError::argument("places of the listener", "one in the room", found));
    }
    let near = |node: &Vec3| {
        let distance = |i: &usize| places[*i].distance_squared(*node);
        (0..places.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
    };
    let nearest = nodes.iter().map(near).collect();
    Ok(Places { axes, at: places.iter().map(|at| at.as_dvec3()).collect(), nearest })
}

/// What one place hears.
struct Arrivals {
    at: DVec3,
    /// In the order of their indices.
    images: Vec<Image>,
    /// Ways of the direct sound round edges where it is hidden, and of images that are.
    around: Vec<DiffractionPath>,
    bent: Vec<DiffractionPath>,
    echogram: Echogram,
    /// Seconds of the direct sound, seen or not.
    direct_s: f64,
}

impl Arrivals {
    /// Whether the emitter itself is seen.
    fn sees(&self) -> bool {
        self.images.iter().any(|image| image.order == 0)
    }
}

/// A head for box rooms.
///
/// # Errors
/// A head without sound in some direction.
pub fn scene_head(hrtf: &Hrtf) -> Result<SceneHead, BakeError> {
    let rate = f64::from(hrtf.sample_rate_hz());
    let grid = StftGrid::four_hops(rate, (rate * WINDOW_S / 4.0).round());
    let bands = Bands::for_rate(rate);
    let shape = TransferShape { bins: grid.bins(), bands: bands.count(), taps: 0 };
    let coherence = bands.centres_hz().iter().map(|hz| hrtf.coherence(f64::from(*hz))).collect();
    let head = direct_field(hrtf, &grid, shape)
        .and_then(|direct| SceneHead::new(grid, bands, coherence, &direct, ambisonic_head(hrtf)));
    let head = head.ok_or_else(|| BakeError::argument("head", "sound in all directions", "silence"))?;
    Ok(head.with_credit(&hrtf.credit, &hrtf.licence))
}

/// Bakes a scene of a room with an emitter, metres, heard with a head at the sample rate of its responses. `done` is told the
/// share of the work that is, 0 to 1. The same input and seed make the same scene.
///
/// # Errors
/// An option out of range, a room without a place for the listener, an emitter that no place hears.
pub fn bake_geometry(
    mesh: &Mesh,
    room: &Room,
    source: &Source,
    hrtf: &Hrtf,
    options: &GeometryOptions,
    done: impl Fn(f64) + Sync,
) -> Result<Scene, BakeError> {
    let head = scene_head(hrtf)?;
    let surfaces = surfaces(mesh, room, source, (hrtf, &head), options, done)?;
    halved(&surfaces.scene(&head, options.seed, &Baked { hrtf, head: &head, turns: options.head_turns })?)
}

/// Bakes a scene of a room, without waves, as it is where responses correct it; `about` says what it
/// was learnt from; the head's credit is added.
///
/// # Errors
/// Those of [`bake_geometry`], and no response.
pub fn bake_corrected(
    (mesh, room, source): (&Mesh, &Room, &Source),
    hrtf: &Hrtf,
    options: &GeometryOptions,
    responses: &[CorrectedResponse],
    about: Provenance,
) -> Result<Scene, BakeError> {
    if responses.is_empty() {
        return Err(BakeError::argument("responses that correct a room", "one or more", "none"));
    }
    let head = scene_head(hrtf)?;
    let options = GeometryOptions { waves_hz: Some(0.0), ..options.clone() };
    let mut surfaces = surfaces(mesh, room, source, (hrtf, &head), &options, |_| ())?;
    correct(&mut surfaces, responses, &head, options.air);
    let notes = [about.notes, surfaces.provenance.notes].concat();
    let (credit, licence) = (joined(&about.credit, &hrtf.credit), joined(&about.licence, &hrtf.licence));
    surfaces.provenance = Provenance { notes, credit, licence, ..about };
    halved(&surfaces.scene(&head, options.seed, &Baked { hrtf, head: &head, turns: options.head_turns })?)
}

/// What the room gives of itself to a head.
fn surfaces(
    mesh: &Mesh,
    room: &Room,
    source: &Source,
    (hrtf, head): (&Hrtf, &SceneHead),
    options: &GeometryOptions,
    done: impl Fn(f64) + Sync,
) -> Result<Surfaces, BakeError> {
    let emitter = Vec3::from_array(source.position.map(|c| c as f32));
    let inside = Inside::new(mesh, room, emitter, options.margin_m)?;
    let places = plan(mesh, &inside, options)?;
    let eyring = room.eyring_t60_s(mesh.report().volume_m3.unwrap_or_else(|| room.bounding_volume()), options.air);
    let longest = eyring.iter().copied().filter(|t| t.is_finite()).fold(0.0, f64::max);
    let (images, heard) = listen(mesh, room, source, &places.at, head.grid().hop_s(), longest, options, done)?;
    let played = Played::strongest(&places, source.position.into(), options.images, |place| &heard[place].images);
    let numbers: Vec<usize> = played.images.iter().map(|image| image.index).collect();
    let kept: BTreeSet<usize> = numbers.iter().copied().collect();
    // What is hidden is played as images are.
    let hidden = !played.images.is_empty() && !heard.iter().all(Arrivals::sees);
    let corners = hidden.then(|| corners(mesh, room, source, (&images, &numbers), places.axes[2].start())).transpose()?;
    let late = heard.par_iter().map(|h| left_over(h, &kept, corners.is_some(), head, options.air)).collect();
    let bass = bass(mesh, room, source, options)?;
    let emission = emission(mesh, source, &played);
    let notes = notes(played.images.len(), places.at.len(), hrtf, options, bass.as_ref());
    let energy = |h: &Arrivals| energy_at(h.at, h.images.iter().map(|image| (image.position.into(), image.gains)), &h.echogram);
    let [x, y, z] = &places.axes;
    Ok(Surfaces {
        emitter,
        direct: heard.iter().map(|h| if h.sees() { 1.0 } else { 0.0 }).collect(),
        open: false,
        late,
        emission,
        corners,
        bass,
        energies: heard.iter().map(energy).collect(),
        level: Level::LoudestPlace,
        typical_t60_s: typical_t60_s(&heard),
        air: options.air,
        start_pose: start_pose(&heard, emitter),
        bounds: (Vec3::new(x.start(), y.start(), z.start()), Vec3::new(x.end(), y.end(), z.end())),
        outline: outline(&edges(mesh), emitter),
        provenance: Provenance {
            title: options.title.clone(),
            credit: hrtf.credit.clone(),
            licence: hrtf.licence.clone(),
            recipe: options.recipe.clone(),
            notes,
        },
        places,
        played,
    })
}

/// The bass by waves, on a table of its own at the height of the ears.
fn bass(mesh: &Mesh, room: &Room, source: &Source, options: &GeometryOptions) -> Result<Option<RoomBass>, BakeError> {
    let Some(mut bass) = Bass::of(mesh, room, source, options.waves_hz)? else { return Ok(None) };
    let [low, high] = mesh.bounds().map(|corner| Vec3::from_array(corner.map(|c| c as f32)));
    let margin = BASS_OFF_WALLS_M.min(options.margin_m);
    let table = |hz: f64| {
        let axis = |a: usize| bass_axis(low[a] + margin, high[a] - margin, hz, false);
        [axis(0), axis(1), Axis::single(low.z + options.height_m)]
    };
    let values = |hz: f64| {
        let count: usize = table(hz).iter().map(Axis::count).product();
        4.0 * count as f64 * SAMPLES * whole_hz(hz) * bass.t60_s
    };
    let mut hz = bass.crossover_hz;
    while options.waves_hz.is_none() && values(hz) > MOST_BASS_VALUES && 0.95 * hz >= CROSSOVERS_HZ.0 {
        hz *= 0.95;
    }
    // What is too large for a file even as low as that stays with images and rays.
    if options.waves_hz.is_none() && values(hz) > MOST_BASS_VALUES {
        return Ok(None);
    }
    bass.crossover_hz = hz;
    let axes = table(bass.crossover_hz);
    let emitter = Vec3::from_array(source.position.map(|c| c as f32));
    let inside = Inside::new(mesh, room, emitter, 0.5 * margin)?;
    let at = bass_places(&axes);
    let held: Vec<usize> = (0..at.len()).filter(|i| inside.encloses(at[*i].as_vec3())).collect();
    if held.is_empty() {
        return Ok(None);
    }
    let places: Vec<[f64; 3]> = held.iter().map(|i| at[*i].to_array()).collect();
    let mut field = bass.field(room, source, &places, bass.t60_s, options.air, |_| ())?;
    field.without_direct(source.position, &places, speed_m_s(options.air));
    // Beyond walls the table has what the nearest place has, as far as its slope says.
    let near = |i: usize| {
        let far = |n: &usize| at[held[*n]].distance_squared(at[i]);
        let nearest = (0..held.len()).min_by(|a, b| far(a).total_cmp(&far(b))).unwrap_or(0);
        let mut response = field.places[nearest].clone();
        let away = at[i] - at[held[nearest]];
        let away = away * (BEYOND_WALLS_M / away.length().max(1e-9)).min(1.0);
        for (slope, along) in response.gradient.iter().zip(away.to_array()) {
            response.pressure.iter_mut().zip(slope).for_each(|(p, s)| *p += along as f32 * s);
        }
        response
    };
    let places = (0..at.len()).map(near).collect();
    field.places = places;
    Ok(Some(RoomBass { crossover_hz: bass.crossover_hz, axes, field }))
}

fn notes(images: usize, places: usize, hrtf: &Hrtf, options: &GeometryOptions, bass: Option<&RoomBass>) -> Vec<String> {
    let made = format!(
        "{images} image sources of order {} at most, {} rays, {places} places {} m apart, head of {} directions",
        options.order,
        options.rays,
        options.spacing_m,
        hrtf.directions()
    );
    let low = bass.map(|bass| {
        let count: usize = bass.axes.iter().map(Axis::count).product();
        format!("waves below {:.0} Hz at {count} places", bass.crossover_hz)
    });
    [made].into_iter().chain(low).collect()
}

/// The late part as the engine plays it, with the draw of noise that suits the room, and each side of the room at the ear that
/// it is nearer to.
struct Baked<'a> {
    hrtf: &'a Hrtf,
    head: &'a SceneHead,
    /// Of the head.
    turns: usize,
}

impl LatePart for Baked<'_> {
    type Error = BakeError;

    fn unit(
        &self,
        tail: &mut TailModel,
        shape: TransferShape,
        late: &[LateEnergies],
        start: usize,
    ) -> Result<HopEnergies, BakeError> {
        let (grid, bands, top_hz) = (self.head.grid(), self.head.bands(), self.head.top_hz());
        tail.seed = truest_seed(tail.seed, &Late { grid, bands, tail, shape, top_hz }, &late[start].energies)?;
        let [left, _] = Late { grid, bands, tail, shape, top_hz }.unit(late[0].energies.len())?;
        Ok(left)
    }

    fn turned(&self, rows: Vec<Vec<f32>>, late: &[LateEnergies], shape: TransferShape) -> (Axis, Vec<Vec<Vec<f32>>>) {
        if self.turns <= 1 {
            return (Axis::single(0.0), rows.into_iter().map(|row| vec![row]).collect());
        }
        let (yaw, sides) = (Axis::circle(-PI, self.turns), Sides::new(self.hrtf, self.head));
        let all = |(row, late): (Vec<f32>, &LateEnergies)| {
            yaw.nodes().iter().map(|yaw| sides.turned(&row, &late.vectors, *yaw, shape)).collect()
        };
        let rows = rows.into_par_iter().zip(late).map(all).collect();
        (yaw, rows)
    }
}

/// Images and echograms of all places.
#[expect(clippy::too_many_arguments, reason = "all of them are of the whole bake")]
fn listen(
    mesh: &Mesh,
    room: &Room,
    source: &Source,
    places: &[DVec3],
    hop_s: f64,
    length_s: f64,
    options: &GeometryOptions,
    done: impl Fn(f64) + Sync,
) -> Result<(Images, Vec<Arrivals>), BakeError> {
    let listeners: Vec<[f64; 3]> = places.iter().map(DVec3::to_array).collect();
    let search = ImageOptions { order: options.order, beams: options.beams, ..ImageOptions::default() };
    let images = Images::new(room, source, &search)?;
    let edges = Edges::of(mesh);
    let lit = edges.diffracted_images(room, &images, Reflected::Specular)?;
    let rays = RayOptions {
        rays: options.rays,
        length_s: length_s.clamp(RAY_LENGTH_S.0, RAY_LENGTH_S.1),
        bin_s: 0.5 * hop_s,
        images: Some(&images),
        radius_m: None,
        air: options.air,
        seed: options.seed,
    };
    let late = late_field(room, source, &listeners, &rays, |share| done(0.9 * share))?;
    let heard: Result<Vec<Arrivals>, BakeError> = listeners
        .par_iter()
        .zip(late.echograms)
        .map(|(at, echogram)| {
            let bent = lit.paths(*at)?;
            let images = images.seen_from(room, *at, Reflected::Specular)?;
            let direct_s = DVec3::from(source.position).distance((*at).into()) / speed_m_s(options.air);
            let hidden = images.iter().all(|image| image.order > 0);
            let around = if hidden { edges.paths_round_one_or_two(room, source, *at)? } else { Vec::new() };
            Ok(Arrivals { at: (*at).into(), images, around, bent, echogram, direct_s })
        })
        .collect();
    done(1.0);
    let heard = heard?;
    Ok((images, heard))
}

/// What played images do not have: rays, all other images, and what comes round edges.
fn left_over(heard: &Arrivals, kept: &BTreeSet<usize>, cornered: bool, head: &SceneHead, air: Option<Air>) -> LateEnergies {
    let mut late = LateEnergies::of(&heard.echogram, heard.direct_s, head);
    let emitter_m = heard.direct_s * speed_m_s(air);
    let speed = speed_m_s(air);
    let mut add = |position: [f64; 3], path_m: f64, low: f32, amplitudes: &Octaves| {
        let left = amplitudes.map(|a| f64::from(a).powi(2));
        let direction = (DVec3::from(position) - heard.at).normalize_or_zero();
        let air = |hz: f64| 10.0_f64.powf(-0.1 * air.map_or(0.0, |air| air.db_per_m(hz) * path_m));
        late.add(path_m / speed, direction, (f64::from(low).powi(2), &left), head, air);
    };
    for image in heard.images.iter().filter(|i| i.order > 0 && !kept.contains(&i.index)) {
        let way = heard.at.distance(image.position.into()).max(emitter_m);
        add(image.position, way, image.gain_63 / way as f32, &image.gains.map(|g| g / way as f32));
    }
    // The shortest way round an edge is heard by itself, as are the loudest of images.
    for way in heard.around.iter().skip(usize::from(cornered)) {
        let amplitudes = way.amplitudes();
        add(way.position, way.path_m, amplitudes[0], &amplitudes);
    }
    for way in heard.bent.iter().skip(if cornered { MOST_BENT } else { 0 }) {
        let amplitudes = way.amplitudes();
        add(way.position, way.path_m, amplitudes[0], &amplitudes);
    }
    late
}

/// The longest of the octaves' reverberation times, seconds, each a mean over all places that show one.
fn typical_t60_s(heard: &[Arrivals]) -> f64 {
    let mean = |band: usize| {
        let times: Vec<f64> = heard.iter().filter_map(|h| h.echogram.t20_s(band)).collect();
        (!times.is_empty()).then(|| times.iter().sum::<f64>() / times.len() as f64)
    };
    (0..OCTAVES_HZ.len()).filter_map(mean).reduce(f64::max).unwrap_or(UNKNOWN_T60_S)
}

/// The direct sound at 1 m by direction, through the head.
fn direct_field(hrtf: &Hrtf, grid: &StftGrid, shape: TransferShape) -> Option<Field> {
    let position = [(); 3].map(|()| Axis::single(0.0));
    let elevation = Axis::new(ELEVATIONS.map(f32::to_radians).to_vec(), false)?;
    let azimuth = Axis::circle(-PI, AZIMUTHS);
    let nodes = FieldGrid { position, facing: Facing::Emitter { position: Vec3::ZERO, elevation, azimuth } };
    let analyser = Analyser::new(*grid);
    let silent = vec![0.0; shape.tap_len()];
    let row = |index: usize| -> Option<Vec<f32>> {
        let [left, right] = head_responses(hrtf, nodes.node(index).1);
        let mut direct = Direct::of([&left, &right], grid, &analyser)?;
        // The bass of a head's response rings longer than a direct sound is cut out, but its level is plain.
        for (gain, ear) in direct.gain.iter_mut().zip([&left, &right]) {
            let whole: Vec<f64> = ear.iter().map(|v| f64::from(*v)).collect();
            gain.iter_mut().zip(analyser.spectrum(&whole)).for_each(|(g, x)| *g = x.norm());
        }
        let transfer = LogTransfer::of(&direct, 1.0, 1.0).to_transfer(&shape, grid);
        Some(promenade_core::TransferFunction { late: silent.clone(), ..transfer }.to_row())
    };
    let rows: Option<Vec<Vec<f32>>> = (0..nodes.nodes()).into_par_iter().map(row).collect();
    let field = Field::new(nodes, shape, Rows::Whole(rows?.concat()))?;
    // A head that is the same on both sides needs half of its directions in a file.
    let mirrored = field.mirrored().filter(|mirrored| alike(&field, mirrored));
    Some(mirrored.unwrap_or(field))
}

/// Whether two tables sound the same, but for what half precision takes.
fn alike(one: &Field, other: &Field) -> bool {
    let (Rows::Whole(a), Rows::Whole(b)) = (one.rows(), other.rows()) else { return false };
    let (bins, len) = (one.shape().bins, one.shape().row_len());
    let ears = |row: &[f32]| -> Vec<Complex32> {
        let ear = |sign: f32, phase: usize| {
            (0..bins).map(move |k| Complex32::from_polar(row[k] * (1.0 + sign * row[bins + k]), row[phase + k]))
        };
        ear(-1.0, 2 * bins).chain(ear(1.0, 3 * bins)).collect()
    };
    let pairs = || a.chunks_exact(len).zip(b.chunks_exact(len));
    let energy: f32 = pairs().flat_map(|(a, _)| ears(a)).map(|x| x.norm_sqr()).sum();
    let error: f32 = pairs().flat_map(|(a, b)| ears(a).into_iter().zip(ears(b))).map(|(a, b)| (a - b).norm_sqr()).sum();
    let late_s = pairs().map(|(a, b)| (a[4 * bins] - b[4 * bins]).abs()).fold(0.0, f32::max);
    error < MIRRORED_ERROR * energy && late_s < MIRRORED_S
}

/// A pose that sees the emitter, at the place nearest to the middle of those that do.
fn start_pose(heard: &[Arrivals], emitter: Vec3) -> Pose {
    let at = |h: &Arrivals| h.at.as_vec3();
    let middle = heard.iter().map(at).sum::<Vec3>() / heard.len() as f32;
    let seeing = heard.iter().filter(|h| h.sees()).map(at);
    let near = seeing.min_by(|a, b| a.distance(middle).total_cmp(&b.distance(middle))).unwrap_or_else(|| at(&heard[0]));
    let way = emitter - near;
    Pose::from_ypr(near, way.y.atan2(way.x), 0.0, 0.0)
}

/// The edges of the room: where two triangles make one plane there is nothing to see.
fn edges(mesh: &Mesh) -> Vec<[Vec3; 2]> {
    // Cosine of two degrees.
    const FLAT: f32 = 0.9994;
    let at = |v: u32| Vec3::from_array(mesh.vertices[v as usize].map(|c| c as f32));
    let mut lines: BTreeMap<[u32; 2], Vec<Vec3>> = BTreeMap::new();
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.corners.map(at);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        for [from, to] in [[0, 1], [1, 2], [2, 0]].map(|edge: [usize; 2]| edge.map(|corner| triangle.corners[corner])) {
            lines.entry([from.min(to), from.max(to)]).or_default().push(normal);
        }
    }
    lines.retain(|_, normals| !matches!(normals[..], [one, other] if one.dot(other).abs() > FLAT));
    lines.into_keys().map(|line| line.map(at)).collect()
}

#[cfg(test)]
mod tests;
