//! Geometry baking: a room of surfaces becomes a scene of image sources with a late field.
//!
//! The strongest images are played as they are. What the rest of them and the scattered rays bring is energy, by hop and band,
//! that noise carries; together they have all of the room's energy at every place.

mod arrivals;
mod corrected;
mod head;
mod options;

pub use corrected::CorrectedResponse;
pub use head::scene_head;
pub use options::GeometryOptions;

use crate::bake::corners::corners;
use crate::bake::emission::emission;
use crate::bake::halved::halved;
use crate::bake::late_unit::Late;
use crate::bake::seed::truest_seed;
use crate::bake::sides::Sides;
use crate::error::BakeError;
use crate::sources::simulation::{Bass, Hrtf, Inside, Pilot};
use arrivals::{Arrivals, left_over, listen, start_pose, typical_t60_s};
use corrected::{correct, joined};
use promenade_acoustics::{Mesh, Room, Source};
use promenade_core::glam::Vec3;
use promenade_core::{Axis, Provenance, Scene, TailModel, TransferShape};
use promenade_room::{
    HopEnergies, LateEnergies, LatePart, Places, Played, RoomBass, SceneHead, SceneOptions, ShoeboxRoom, Surfaces, bass_axis,
    bass_places, outline,
};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::f32::consts::PI;

/// Places of the listener, at most.
const MOST_PLACES: usize = 4096;
/// Height over the floor of a box's bass, metres.
const LAYER_M: f32 = 1.5;
/// Places of the bass keep this far from surfaces, metres, and beyond walls its slopes are followed so far.
const BASS_OFF_WALLS_M: f32 = 0.12;
const BEYOND_WALLS_M: f64 = 0.3;

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
    halved(&surfaces.scene(&head, options.seed, &Baked { hrtf, head: &head, turns: options.head_turns, by_phase: false })?)
}

/// The scene of a box room as its file has it: below the crossover of its responses, the sum over modes, on one layer.
///
/// # Errors
/// Those of [`ShoeboxRoom::scene`].
pub fn bake_box(room: &ShoeboxRoom, head: &SceneHead, options: &SceneOptions) -> Result<Scene, BakeError> {
    let mesh = room.walls.mesh()?;
    let source = Source::from((room.emitter - room.corner).as_dvec3().to_array());
    let bass = Bass::of(&mesh, &Room::new(&mesh, &room.walls.materials)?, &source, options.waves_hz)?;
    let waves_hz = Some(bass.map_or(0.0, |bass| bass.crossover_hz));
    let layer_m = options.layer_m.or(Some(LAYER_M));
    halved(&room.scene(head, &SceneOptions { waves_hz, layer_m, ..options.clone() })?)
}

/// Bakes a scene of a room as it is where responses without waves correct it; `about` says what it was learnt from; the head's
/// credit is added.
///
/// # Errors
/// Those of [`bake_geometry`], and no response.
pub fn bake_corrected(
    (mesh, room, source): (&Mesh, &Room, &Source),
    hrtf: &Hrtf,
    options: &GeometryOptions,
    (responses, is_levelled): (&[CorrectedResponse], bool),
    about: Provenance,
) -> Result<Scene, BakeError> {
    if responses.is_empty() {
        return Err(BakeError::argument("responses that correct a room", "one or more", "none"));
    }
    let head = scene_head(hrtf)?;
    let mut surfaces = surfaces(mesh, room, source, (hrtf, &head), options, |_| ())?;
    let level = correct(&mut surfaces, responses, &head, options.air);
    if is_levelled {
        surfaces.gain *= level.sqrt();
    }
    let notes = [about.notes, surfaces.provenance.notes].concat();
    let (credit, licence) = (joined(&about.credit, &hrtf.credit), joined(&about.licence, &hrtf.licence));
    surfaces.provenance = Provenance { notes, credit, licence, ..about };
    halved(&surfaces.scene(&head, options.seed, &Baked { hrtf, head: &head, turns: options.head_turns, by_phase: true })?)
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
    let volume = mesh.report().volume_m3;
    let eyring = room.eyring_t60_s(volume, options.air);
    // Between walls that face each other sound stays longer in an open room.
    let stays = if volume.is_some() { 1.0 } else { 2.0 };
    let longest = stays * eyring.iter().copied().filter(|t| t.is_finite()).fold(0.0, f64::max);
    let (images, heard) = listen((mesh, room, source), &places.at, (head.grid().hop_s(), longest), options, done)?;
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
    let [x, y, z] = &places.axes;
    Ok(Surfaces {
        emitter,
        direct: heard.iter().map(|h| if h.sees() { 1.0 } else { 0.0 }).collect(),
        open: false,
        late,
        emission,
        corners,
        bass,
        gain: 10.0_f64.powf(options.gain_db / 20.0),
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

/// The bass by waves, on a table of its own at the height of the ears or at several.
fn bass(mesh: &Mesh, room: &Room, source: &Source, options: &GeometryOptions) -> Result<Option<RoomBass>, BakeError> {
    let Some(bass) = Bass::of(mesh, room, source, options.waves_hz)? else { return Ok(None) };
    let [low, high] = mesh.bounds().map(|corner| Vec3::from_array(corner.map(|c| c as f32)));
    let margin = BASS_OFF_WALLS_M.min(options.margin_m);
    let axis = |a: usize| bass_axis(low[a] + margin, high[a] - margin, bass.crossover_hz, false);
    let heights = || bass_axis(low.z + margin, high.z - margin, bass.crossover_hz, true);
    let height = if options.layered { heights() } else { Axis::single(low.z + options.height_m) };
    let axes = [axis(0), axis(1), height];
    let emitter = Vec3::from_array(source.position.map(|c| c as f32));
    let inside = Inside::new(mesh, room, emitter, 0.5 * margin)?;
    let at = bass_places(&axes);
    let held: Vec<usize> = (0..at.len()).filter(|i| inside.encloses(at[*i].as_vec3())).collect();
    if held.is_empty() {
        return Ok(None);
    }
    let places: Vec<[f64; 3]> = held.iter().map(|i| at[*i].to_array()).collect();
    let pilot = Pilot::new(room, source, &places, (options.rays, 1.5 * bass.t60_s), (options.air, options.seed))?;
    let mut field = bass.field(room, source, &places, &pilot, (bass.t60_s, options.air), |_| ())?;
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
    /// See [`TailModel::by_phase`].
    by_phase: bool,
}

impl LatePart for Baked<'_> {
    fn unit(
        &self,
        tail: &mut TailModel,
        shape: TransferShape,
        late: &[LateEnergies],
        start: usize,
    ) -> Result<HopEnergies, BakeError> {
        let (grid, bands, top_hz) = (self.head.grid(), self.head.bands(), self.head.top_hz());
        tail.by_phase = self.by_phase;
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
