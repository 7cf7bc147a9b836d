//! Where the emitter is hidden, and which edges its sound and that of its images comes round.

use crate::BakeError;
use promenade_acoustics::{DiffractionPath, Edges, Images, Mesh, Octaves, Reflected, Room, Source};
use promenade_core::glam::{DVec3, Vec3};
use promenade_core::{Axis, Corners, DiffractionEdge};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Ways of images round edges that a place has at most: the loudest.
pub(super) const MOST_BENT: usize = 2;
/// Sounds at edges that lie this near to each other and come from so near are one, metres.
const SAME: f64 = 0.25;

/// Metres between places, at least, and how many there are at most.
const SPACING_M: f32 = 0.1;
const MOST_PLACES: f32 = 8000.0;

/// Ways round another edge that differ by less than this are one, metres.
const LONGER: f64 = 0.02;

/// Where the sound at an edge comes from in steps of [`SAME`], none if that is the emitter, the edge's ends by their bits,
/// whether what sends it is seen past the edge, and how much longer the way to it is in steps of [`LONGER`].
type Key = (Option<[i64; 3]>, [[u64; 3]; 2], bool, i64);

/// Sound at an edge, by where it comes from.
#[derive(Clone, Copy)]
struct Bend {
    key: Key,
    from: DVec3,
    sent: Octaves,
    longer_m: f64,
}

impl Bend {
    fn of(way: &DiffractionPath, source: &Source) -> Self {
        let from = DVec3::from(way.from);
        let own = way.from != source.position;
        let from_m = own.then(|| (from / SAME).round().to_array().map(|c| c as i64));
        let longer = (way.longer_m / LONGER).round() as i64;
        let key = (from_m, way.edge.map(|end| end.map(f64::to_bits)), way.lit, longer);
        Self { key, from, sent: way.gains, longer_m: way.longer_m }
    }
}

/// All that a place has.
#[derive(Clone, Default)]
struct Look {
    /// Whether it sees the emitter, and the edge that it sees it past or hears it round.
    sees: bool,
    round: Option<Bend>,
    bent: Vec<Bend>,
    /// The first images that it sees, by the bits of their numbers.
    seen: u32,
}

/// How the emitter is seen over the plan of a room, at a height in metres, and the first of the images that are played, by
/// their numbers among all.
pub(super) fn corners(
    mesh: &Mesh,
    room: &Room,
    source: &Source,
    (images, played): (&Images, &[usize]),
    z: f32,
) -> Result<Corners, BakeError> {
    let [low, high] = mesh.bounds().map(|corner| Vec3::from_array(corner.map(|c| c as f32)));
    let size = high - low;
    let spacing = (size.x * size.y / MOST_PLACES).sqrt().max(SPACING_M);
    let axis = |a: usize| {
        let cells = (size[a] / spacing).ceil().max(1.0);
        Axis::uniform(low[a] + 0.5 * size[a] / cells, size[a] / cells, cells as usize)
    };
    let axes = [axis(0), axis(1), Axis::single(z)];
    let [nx, ny] = [axes[0].count(), axes[1].count()];
    let edges = Edges::of(mesh);
    let lit = edges.diffracted_images(room, images, Reflected::Specular)?;
    let closed = mesh.report().volume_m3.is_some();
    let look = |i: usize| -> Result<Option<Look>, BakeError> {
        let at = Vec3::new(axes[0].nodes()[i % nx], axes[1].nodes()[i / nx], z).as_dvec3().to_array();
        if closed && !room.encloses(at)? {
            return Ok(None);
        }
        let sees = room.sees(source.position, at)?;
        let ways = if sees { edges.beside_shadows(room, source, at) } else { edges.paths_round_one_or_two(room, source, at) };
        let round = ways?.first().map(|way| Bend::of(way, source));
        let bent = lit.paths(at)?.iter().take(MOST_BENT).map(|way| Bend::of(way, source)).collect();
        let mut seen = 0;
        for (i, image) in played.iter().take(Corners::MOST_SEEN).enumerate() {
            seen |= u32::from(images.sees(room, at, *image)?) << i;
        }
        Ok(Some(Look { sees, round, bent, seen }))
    };
    let looks: Vec<Option<Look>> = (0..nx * ny).into_par_iter().map(look).collect::<Result<_, BakeError>>()?;
    let looks = everywhere(&looks, nx);
    let numbers = numbered(&looks);
    let number = |bend: &Bend| numbers[&bend.key].0 as f32;
    let round = |look: &Look| look.round.as_ref().map_or(Corners::NO_EDGE, number);
    let seen = |look: &Look| if look.sees { 1.0 } else { 0.0 };
    let bent = |table: usize| looks.iter().map(move |look| look.bent.get(table).map_or(Corners::NO_EDGE, number));
    let tables = looks.iter().map(|look| look.bent.len()).max().unwrap_or(0);
    Ok(Corners {
        direct: looks.iter().map(seen).collect(),
        round: looks.iter().map(round).collect(),
        images: (0..tables).flat_map(bent).collect(),
        seen: looks.iter().map(|look| look.seen as f32).collect(),
        edges: numbers.values().map(|(_, bend)| edge_of(bend, source)).collect(),
        places: axes,
    })
}

/// How the emitter is seen at all places, rows of `nx`: within walls as at the nearest place off them.
fn everywhere(looks: &[Option<Look>], nx: usize) -> Vec<Look> {
    let held: Vec<usize> = (0..looks.len()).filter(|i| looks[*i].is_some()).collect();
    let near = |i: usize| {
        let far = |other: &usize| {
            let [dx, dy] = [(i % nx).abs_diff(other % nx), (i / nx).abs_diff(other / nx)];
            dx * dx + dy * dy
        };
        let nearest = || held.iter().min_by_key(|other| far(other)).and_then(|other| looks[*other].clone());
        looks[i].clone().or_else(nearest).unwrap_or_default()
    };
    (0..looks.len()).into_par_iter().map(near).collect()
}

/// All edges by the order of their keys, in which the emitter's own come first.
fn numbered(looks: &[Look]) -> BTreeMap<Key, (usize, Bend)> {
    let mut numbers: BTreeMap<Key, (usize, Bend)> = BTreeMap::new();
    for look in looks {
        look.round.iter().chain(&look.bent).for_each(|bend| _ = numbers.entry(bend.key).or_insert((0, *bend)));
    }
    numbers.values_mut().enumerate().for_each(|(n, (number, _))| *number = n);
    numbers
}

/// An edge as a scene has it: the emitter's own, or an image's.
fn edge_of(bend: &Bend, source: &Source) -> DiffractionEdge {
    let ends = bend.key.1.map(|end| DVec3::from(end.map(f64::from_bits)));
    let way = 0.5 * (ends[0] + ends[1]) - DVec3::from(source.position);
    let (own, sign) = (bend.key.0.is_none(), if bend.key.2 { -1.0 } else { 1.0 });
    DiffractionEdge {
        ends: ends.map(|end| end.as_vec3()),
        gains: if own && bend.longer_m == 0.0 { source.directivity.towards(way.to_array()) } else { bend.sent }
            .map(|gain| sign * gain),
        from: (!own).then(|| bend.from.as_vec3()),
        longer_m: bend.longer_m as f32,
    }
}

#[cfg(test)]
mod tests;
