//! Geometry baking: a room of surfaces becomes a scene of image sources with a late field.
//!
//! The strongest images are played as they are. What the rest of them and the scattered rays bring is energy, by hop and band,
//! that noise carries; together they have all of the room's energy at every place.

use crate::bake::direct::Direct;
use crate::bake::late_unit::Late;
use crate::bake::log_transfer::LogTransfer;
use crate::bake::seed::truest_seed;
use crate::bake::sides::Sides;
use crate::error::BakeError;
use crate::signal::spectrum::Analyser;
use crate::sources::ambisonic::{ambisonic_head, head_responses};
use crate::sources::simulation::{Hrtf, Inside, OCTAVES_HZ};
use half::f16;
use promenade_acoustics::{
    Air, Diffracted, Echogram, Edges, Image, ImageOptions, Images, Mesh, Octaves, RayOptions, Room, Share, Source, late_field,
    octave_energy,
};
use promenade_core::glam::{DVec3, Vec3};
use promenade_core::network::SPEED_OF_SOUND_M_S;
use promenade_core::{
    Anchor, Axis, Bands, Facing, Field, FieldGrid, ImageSource, ImageSources, Pose, Provenance, Rows, Scene, SceneParts,
    StftGrid, TailModel, TransferShape,
};
use promenade_room::{
    Flow, HopEnergies, LONGEST_EARLY_S, Receiver, SHORTEST_EARLY_S, add_arrival, add_flow, decay_s, hop_energies, hop_flows,
    time_filters,
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
    /// Seed of rays and noise.
    pub seed: u64,
    /// Name shown to the user.
    pub title: String,
    /// How the scene is made, in one line, for its provenance.
    pub recipe: String,
}

/// Places of the listener on a plan.
struct Plan {
    axes: [Axis; 3],
    /// Places in the room.
    places: Vec<Vec3>,
    /// For each node of the axes, `[y][x]`, the nearest place.
    nearest: Vec<usize>,
}

impl Plan {
    fn of(mesh: &Mesh, inside: &Inside<'_>, options: &GeometryOptions) -> Result<Self, BakeError> {
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
        Ok(Self { axes, places, nearest })
    }
}

/// What one place hears.
struct Heard {
    at: [f64; 3],
    /// In the order of their indices.
    images: Vec<Image>,
    /// Ways of the direct sound round edges where it is hidden.
    around: Vec<Diffracted>,
    echogram: Echogram,
    /// Seconds of the direct sound, seen or not.
    direct_s: f64,
}

impl Heard {
    /// What the emitter sends to this place where it is seen, over what it sends on its axis.
    fn direct(&self) -> Option<f32> {
        self.images.iter().find(|image| image.order == 0).map(|image| amplitude(&image.sent).min(1.0))
    }
}

/// A head for box rooms.
///
/// # Errors
/// A head without sound in some direction.
pub fn receiver(hrtf: &Hrtf) -> Result<Receiver, BakeError> {
    let rate = f64::from(hrtf.sample_rate_hz());
    let grid = StftGrid::four_hops(rate, (rate * WINDOW_S / 4.0).round());
    let bands = Bands::for_rate(rate);
    let shape = TransferShape { bins: grid.bins(), bands: bands.count(), taps: 0 };
    let direct = direct_field(Vec3::ZERO, hrtf, &grid, shape, 1.0);
    let receiver =
        direct.and_then(|direct| Receiver::new(grid, bands.clone(), coherence(hrtf, &bands), &direct, ambisonic_head(hrtf)));
    let receiver = receiver.ok_or_else(|| BakeError::argument("head", "sound in all directions", "silence"))?;
    Ok(receiver.with_credit(&hrtf.credit, &hrtf.licence))
}

/// Coherence of a diffuse field between the ears, by band.
fn coherence(hrtf: &Hrtf, bands: &Bands) -> Vec<f32> {
    bands.centres_hz().iter().map(|hz| hrtf.coherence(f64::from(*hz))).collect()
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
    let emitter = Vec3::from_array(source.position.map(|c| c as f32));
    let rate = f64::from(hrtf.sample_rate_hz());
    let grid = StftGrid::four_hops(rate, (rate * WINDOW_S / 4.0).round());
    let inside = Inside::new(mesh, room, emitter, options.margin_m)?;
    let plan = Plan::of(mesh, &inside, options)?;
    let eyring = room.eyring_t60_s(mesh.report().volume_m3.unwrap_or_else(|| room.bounding_volume()), options.air);
    let longest = eyring.iter().copied().filter(|t| t.is_finite()).fold(0.0, f64::max);
    let heard = listen(mesh, room, source, &plan.places, &grid, longest, options, done)?;
    let (images, seen) = strongest(&heard, &plan, options);
    let bands = Bands::for_rate(rate);
    let kept = images.iter().map(|image| image.index).collect();
    let head = receiver(hrtf)?;
    let left: Vec<(HopEnergies, Vec<Flow>)> = heard.par_iter().map(|h| left_over(h, &kept, &head, options.air)).collect();
    let (rest, flows): (Vec<HopEnergies>, Vec<Vec<Flow>>) = left.into_iter().unzip();
    let typical = typical_t60_s(&heard);
    let early_s = (0.5 * typical).clamp(SHORTEST_EARLY_S, LONGEST_EARLY_S);
    let taps = (early_s / grid.hop_s()).round() as usize;
    let shape = TransferShape { bins: grid.bins(), bands: bands.count(), taps };
    let t60_s = decay_s(&rest, taps + 1, grid.hop_s(), typical);
    let mut tail = TailModel { seed: options.seed, t60_s, coherence: coherence(hrtf, &bands) };
    let top_hz = (0.42 * rate) as f32;
    let middle = start_pose(&heard, &plan, emitter);
    let start = plan.places.iter().position(|place| *place == middle.position).unwrap_or(0);
    tail.seed = truest_seed(options.seed, &Late { grid: &grid, bands: &bands, tail: &tail, shape, top_hz }, &rest[start])?;
    let gain = unit_gain(&heard);
    let late = Late { grid: &grid, bands: &bands, tail: &tail, shape, top_hz };
    let unit = late.unit(rest[0].len())?;
    let yaw = if options.head_turns > 1 { Axis::circle(-PI, options.head_turns) } else { Axis::single(0.0) };
    let sides = Sides::new(hrtf, &head, &bands);
    // One row for each turn of the head.
    let filters = rest.par_iter().zip(&flows).map(|(energies, flows)| {
        let row = time_filters(energies, &unit[0], shape, gain);
        let turned = |yaw: f32| if options.head_turns > 1 { sides.turned(&row, flows, yaw, shape) } else { row.clone() };
        yaw.nodes().iter().flat_map(|yaw| [vec![0.0], turned(*yaw)].concat()).collect()
    });
    let filters: Vec<Vec<f32>> = filters.collect();
    let facing = Facing::Head { yaw: yaw.clone(), pitch: Axis::single(0.0), roll: Axis::single(0.0) };
    let nodes = FieldGrid { position: plan.axes.clone(), facing };
    let rows: Vec<f32> = plan.nearest.iter().flat_map(|place| filters[*place].clone()).collect();
    let fits = || BakeError::argument("table of the scene", "a row per node", "another number");
    let reverberation = Field::new(nodes, TransferShape { bins: 0, ..shape }, Rows::Whole(halved(rows))).ok_or_else(fits)?;
    let field = direct_field(emitter, hrtf, &grid, TransferShape { taps: 0, ..shape }, gain).ok_or_else(fits)?;
    let air_db_per_m = OCTAVES_HZ.map(|hz| options.air.map_or(0.0, |air| air.db_per_m(f64::from(hz)) as f32));
    let direct = plan.nearest.iter().map(|place| heard[*place].direct().unwrap_or(0.0)).collect();
    let scaled = |image: &Kept| {
        let places = plan.places.iter().map(|place| place.as_dvec3().to_array());
        let sines = places.map(|at| (image.position[2] - at[2]) / distance(image.position, at).max(1e-3));
        let levels = head.image_gains(sines.sum::<f64>() / plan.places.len() as f64);
        let gains = std::array::from_fn(|b| gain as f32 * levels[b] * image.gains[b]);
        ImageSource { position: Vec3::from_array(image.position.map(|c| c as f32)), gains }
    };
    let sources = ImageSources {
        images: images.iter().map(scaled).collect(),
        air_db_per_m,
        places: plan.axes.clone(),
        seen,
        direct,
        head: head.ambisonic().clone(),
    };
    let [x, y, z] = &plan.axes;
    Ok(Scene::new(SceneParts {
        provenance: Provenance {
            title: options.title.clone(),
            credit: hrtf.credit.clone(),
            licence: hrtf.licence.clone(),
            recipe: options.recipe.clone(),
            notes: notes(source, &sources, &plan, hrtf, options),
        },
        grid,
        bands,
        tail,
        taps,
        measured: None,
        measured_head: None,
        field: Some(field),
        room: Some(reverberation),
        images: (!sources.images.is_empty()).then_some(sources),
        cloud: None,
        top_hz,
        start_pose: middle,
        bounds: (Vec3::new(x.start(), y.start(), z.start()), Vec3::new(x.end(), y.end(), z.end())),
        anchors: outline(mesh, emitter),
        held_out: Vec::new(),
    })?)
}

fn notes(source: &Source, images: &ImageSources, plan: &Plan, hrtf: &Hrtf, options: &GeometryOptions) -> Vec<String> {
    let made = format!(
        "{} image sources of order {} at most, {} rays, {} places {} m apart, head of {} directions",
        images.images.len(),
        options.order,
        options.rays,
        plan.places.len(),
        options.spacing_m,
        hrtf.directions()
    );
    let colour = "the emitter sends more in some directions than in others: the direct sound has its level in each, and the \
        colour of its axis";
    let directive = (!source.directivity.is_omni()).then(|| colour.to_owned());
    [made].into_iter().chain(directive).collect()
}

/// Half precision, of which a scene file takes half the bytes: 0.004 dB, and 0.004 rad of phases up to 8.
fn halved(values: Vec<f32>) -> Vec<f32> {
    values.into_iter().map(|v| f16::from_f32(v).to_f32()).collect()
}

/// Images and echograms of all places.
#[expect(clippy::too_many_arguments, reason = "all of them are of the whole bake")]
fn listen(
    mesh: &Mesh,
    room: &Room,
    source: &Source,
    places: &[Vec3],
    grid: &StftGrid,
    length_s: f64,
    options: &GeometryOptions,
    done: impl Fn(f64) + Sync,
) -> Result<Vec<Heard>, BakeError> {
    let listeners: Vec<[f64; 3]> = places.iter().map(|p| p.as_dvec3().to_array()).collect();
    let search = ImageOptions { order: options.order, beams: options.beams, ..ImageOptions::default() };
    let images = Images::new(room, source, &search)?;
    let edges = Edges::of(mesh);
    let rays = RayOptions {
        rays: options.rays,
        length_s: length_s.clamp(RAY_LENGTH_S.0, RAY_LENGTH_S.1),
        bin_s: 0.5 * grid.hop_s(),
        images: Some(&images),
        radius_m: None,
        air: options.air,
        seed: options.seed,
    };
    let late = late_field(room, source, &listeners, &rays, |share| done(0.9 * share))?;
    let heard: Result<Vec<Heard>, BakeError> = listeners
        .par_iter()
        .zip(late.echograms)
        .map(|(at, echogram)| {
            let images = images.seen_from(room, *at, Share::Specular)?;
            let direct_s = distance(source.position, *at) / f64::from(SPEED_OF_SOUND_M_S);
            let hidden = images.iter().all(|image| image.order > 0);
            let around = if hidden { edges.around(room, source, *at)? } else { Vec::new() };
            Ok(Heard { at: *at, images, around, echogram, direct_s })
        })
        .collect();
    done(1.0);
    heard
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

/// The root mean square over the octaves.
fn amplitude(amplitudes: &Octaves) -> f32 {
    (amplitudes.iter().map(|a| a * a).sum::<f32>() / amplitudes.len() as f32).sqrt()
}

/// An image that is played.
struct Kept {
    index: usize,
    position: [f64; 3],
    gains: Octaves,
}

/// The images that are strongest at any place, the strongest first, and how much of each is seen at each node, `[node][image]`.
fn strongest(heard: &[Heard], plan: &Plan, options: &GeometryOptions) -> (Vec<Kept>, Vec<f32>) {
    /// An image at all places: the largest share of any place's energy, the sum of its gains and the number of places; the
    /// largest of what is sent to it anywhere, and the sum of that.
    struct Found {
        image: Kept,
        score: f64,
        sums: [f64; 7],
        seen: f64,
        most_sent: f32,
        sent: f32,
    }
    let mut found: BTreeMap<usize, Found> = BTreeMap::new();
    for (place, h) in plan.places.iter().zip(heard) {
        let at = place.as_dvec3().to_array();
        for image in h.images.iter().filter(|image| image.order > 0) {
            let entry = found.entry(image.index).or_insert_with(|| Found {
                image: Kept { index: image.index, position: image.position, gains: image.gains },
                score: 0.0,
                sums: [0.0; 7],
                seen: 0.0,
                most_sent: 0.0,
                sent: 0.0,
            });
            let sent = amplitude(&image.sent);
            entry.most_sent = entry.most_sent.max(sent);
            entry.sent += sent;
            let energy: f64 = image.gains.iter().map(|g| f64::from(*g).powi(2)).sum();
            entry.score = entry.score.max(energy / distance(image.position, at).powi(2));
            entry.sums.iter_mut().zip(image.gains).for_each(|(s, g)| *s += f64::from(g));
            entry.seen += 1.0;
        }
    }
    let mut all: Vec<Found> = found.into_values().collect();
    all.sort_by(|a, b| b.score.total_cmp(&a.score).then(a.image.index.cmp(&b.image.index)));
    all.truncate(options.images);
    // As strong as where the source sends most to it, and the mean of its colours.
    let gains = |f: &Found| f.sums.map(|s| (s / f.seen * f64::from(f.most_sent) / (f64::from(f.sent) / f.seen)) as f32);
    let kept: Vec<Kept> = all.into_iter().map(|f| Kept { gains: gains(&f), ..f.image }).collect();
    // A surface of two materials reflects one more here and the other more there.
    let share = |place: &usize, kept: &Kept| {
        let images = &heard[*place].images;
        images.binary_search_by_key(&kept.index, |image| image.index).map_or(0.0, |found| {
            let energy = |gains: &Octaves| gains.iter().map(|g| g * g).sum::<f32>();
            (energy(&images[found].gains) / energy(&kept.gains).max(1e-12)).sqrt().min(1.0)
        })
    };
    let seen = plan.nearest.iter().flat_map(|place| kept.iter().map(move |kept| share(place, kept))).collect();
    (kept, seen)
}

/// Energy per hop after the direct sound and band that played images do not have, and where it comes from: rays, all other
/// images, and what comes round edges.
fn left_over(heard: &Heard, kept: &BTreeSet<usize>, head: &Receiver, air: Option<Air>) -> (HopEnergies, Vec<Flow>) {
    let mut energies = hop_energies(&heard.echogram, heard.direct_s, head);
    let mut flows = hop_flows(&heard.echogram, heard.direct_s, head.hop_s());
    let emitter_m = heard.direct_s * f64::from(SPEED_OF_SOUND_M_S);
    let mut add = |position: [f64; 3], way_m: f64, amplitudes: &Octaves| {
        let left = amplitudes.map(|a| f64::from(a).powi(2));
        let direction = (DVec3::from(position) - DVec3::from(heard.at)).normalize_or_zero();
        let times = [way_m / f64::from(SPEED_OF_SOUND_M_S), heard.direct_s];
        add_flow(&mut flows, times, head.hop_s(), direction, left.iter().sum());
        add_arrival(&mut energies, times, direction.z, head, |hz| {
            let air_db = air.map_or(0.0, |air| air.db_per_m(hz) * way_m);
            octave_energy(&left, hz) * 10.0_f64.powf(-0.1 * air_db)
        });
    };
    for image in heard.images.iter().filter(|i| i.order > 0 && !kept.contains(&i.index)) {
        let way = distance(image.position, heard.at).max(emitter_m);
        add(image.position, way, &image.gains.map(|g| g / way as f32));
    }
    for way in &heard.around {
        add(way.position, way.way_m, &way.amplitudes());
    }
    (energies, flows)
}

/// The longest of the octaves' reverberation times, seconds, each a mean over all places that show one.
fn typical_t60_s(heard: &[Heard]) -> f64 {
    let mean = |band: usize| {
        let times: Vec<f64> = heard.iter().filter_map(|h| h.echogram.t20_s(band)).collect();
        (!times.is_empty()).then(|| times.iter().sum::<f64>() / times.len() as f64)
    };
    (0..OCTAVES_HZ.len()).filter_map(mean).reduce(f64::max).unwrap_or(UNKNOWN_T60_S)
}

/// Gain that brings the loudest place to unit energy.
fn unit_gain(heard: &[Heard]) -> f64 {
    let energy = |h: &Heard| {
        let images: f64 = h.images.iter().map(|i| f64::from(i.gains[3]).powi(2) / distance(i.position, h.at).powi(2)).sum();
        images + h.echogram.energy(3)
    };
    let loudest = heard.iter().map(energy).fold(0.0, f64::max);
    if loudest > 0.0 { loudest.sqrt().recip() } else { 1.0 }
}

/// The direct sound by direction, through the head.
fn direct_field(emitter: Vec3, hrtf: &Hrtf, grid: &StftGrid, shape: TransferShape, gain: f64) -> Option<Field> {
    let position = [(); 3].map(|()| Axis::single(0.0));
    let elevation = Axis::new(ELEVATIONS.map(f32::to_radians).to_vec(), false)?;
    let nodes =
        FieldGrid { position, facing: Facing::Emitter { position: emitter, elevation, azimuth: Axis::circle(-PI, AZIMUTHS) } };
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
        let transfer =
            LogTransfer::of(&direct, &[], gain, 1.0).to_transfer(&shape, grid, vec![0.0; shape.tap_len() * shape.taps]);
        Some(promenade_core::TransferFunction { late: silent.clone(), ..transfer }.to_row())
    };
    let rows: Option<Vec<Vec<f32>>> = (0..nodes.nodes()).into_par_iter().map(row).collect();
    Field::new(nodes, shape, Rows::Whole(halved(rows?.concat())))
}

/// A pose that sees the emitter, at the place nearest to the middle of those that do.
fn start_pose(heard: &[Heard], plan: &Plan, emitter: Vec3) -> Pose {
    let middle = plan.places.iter().sum::<Vec3>() / plan.places.len() as f32;
    let seeing = plan.places.iter().zip(heard).filter(|(_, h)| h.direct().is_some()).map(|(place, _)| *place);
    let near = seeing.min_by(|a, b| a.distance(middle).total_cmp(&b.distance(middle))).unwrap_or(plan.places[0]);
    let way = emitter - near;
    Pose::from_ypr(near, way.y.atan2(way.x), 0.0, 0.0)
}

/// Points along the edges of the room, and the emitter.
fn outline(mesh: &Mesh, emitter: Vec3) -> Vec<Anchor> {
    const STEP_M: f32 = 0.25;
    // Cosine of two degrees.
    const FLAT: f32 = 0.9994;
    const MOST: usize = 4000;
    let at = |v: u32| Vec3::from_array(mesh.vertices[v as usize].map(|c| c as f32));
    let mut lines: BTreeMap<[u32; 2], Vec<Vec3>> = BTreeMap::new();
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.corners.map(at);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        for [from, to] in [[0, 1], [1, 2], [2, 0]].map(|edge: [usize; 2]| edge.map(|corner| triangle.corners[corner])) {
            lines.entry([from.min(to), from.max(to)]).or_default().push(normal);
        }
    }
    // Where two triangles make one plane there is nothing to see.
    lines.retain(|_, normals| !matches!(normals[..], [one, other] if one.dot(other).abs() > FLAT));
    let points = lines.keys().flat_map(|[a, b]| {
        let (a, b) = (at(*a), at(*b));
        let count = (a.distance(b) / STEP_M).ceil().max(1.0) as usize;
        (0..=count).map(move |i| a.lerp(b, i as f32 / count as f32))
    });
    let grey = |position| Anchor { position, colour: Vec3::splat(0.6) };
    let mut all: Vec<Anchor> = points.take(MOST).map(grey).collect();
    all.push(Anchor { position: emitter, colour: Vec3::new(0.9, 0.5, 0.2) });
    all
}

#[cfg(test)]
mod tests;
