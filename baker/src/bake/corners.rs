//! Where the emitter is hidden, and which edges its sound comes round.

use crate::BakeError;
use promenade_acoustics::{Edges, Mesh, Room, Source};
use promenade_core::glam::{DVec3, Vec3};
use promenade_core::{Axis, Corners, DiffractionEdge};
use promenade_room::amplitude;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Metres between places, at least, and how many there are at most.
const SPACING_M: f32 = 0.1;
const MOST_PLACES: f32 = 8000.0;

/// What a place has of the emitter.
#[derive(Clone, Copy)]
enum Sight {
    /// The emitter itself, and how much of what it sends on its axis.
    Seen(f32),
    /// Its sound round an edge, by the bits of its ends.
    Round([[u64; 3]; 2]),
    Nothing,
}

/// How the emitter is seen over the plan of a room, at a height in metres.
pub(super) fn corners(mesh: &Mesh, room: &Room, source: &Source, z: f32) -> Result<Corners, BakeError> {
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
    let closed = mesh.report().volume_m3.is_some();
    let look = |i: usize| -> Result<Option<Sight>, BakeError> {
        let at = Vec3::new(axes[0].nodes()[i % nx], axes[1].nodes()[i / nx], z).as_dvec3().to_array();
        if closed && !room.encloses(at)? {
            return Ok(None);
        }
        if room.sees(source.position, at)? {
            let way = DVec3::from(at) - DVec3::from(source.position);
            return Ok(Some(Sight::Seen(amplitude(&source.directivity.towards(way.to_array())).min(1.0))));
        }
        let around = edges.around(room, source, at)?;
        Ok(Some(around.first().map_or(Sight::Nothing, |way| Sight::Round(way.edge.map(|end| end.map(f64::to_bits))))))
    };
    let sights: Vec<Option<Sight>> = (0..nx * ny).into_par_iter().map(look).collect::<Result<_, BakeError>>()?;
    // Within walls it is as at the nearest place off them.
    let held: Vec<usize> = (0..sights.len()).filter(|i| sights[*i].is_some()).collect();
    let near = |i: usize| {
        let far = |other: &usize| {
            let [dx, dy] = [(i % nx).abs_diff(other % nx), (i / nx).abs_diff(other / nx)];
            dx * dx + dy * dy
        };
        let nearest = || held.iter().min_by_key(|other| far(other)).and_then(|other| sights[*other]);
        sights[i].or_else(nearest).unwrap_or(Sight::Nothing)
    };
    let sights: Vec<Sight> = (0..sights.len()).into_par_iter().map(near).collect();
    let mut numbers: BTreeMap<[[u64; 3]; 2], usize> = BTreeMap::new();
    for sight in &sights {
        if let Sight::Round(edge) = sight {
            numbers.insert(*edge, 0);
        }
    }
    numbers.values_mut().enumerate().for_each(|(n, number)| *number = n);
    let edge = |ends: &[[u64; 3]; 2]| {
        let ends = ends.map(|end| DVec3::from(end.map(f64::from_bits)));
        let way = 0.5 * (ends[0] + ends[1]) - DVec3::from(source.position);
        DiffractionEdge { ends: ends.map(|end| end.as_vec3()), gains: source.directivity.towards(way.to_array()) }
    };
    let number = |sight: &Sight| match sight {
        Sight::Round(edge) => numbers[edge] as f32,
        Sight::Seen(_) | Sight::Nothing => Corners::NO_EDGE,
    };
    let seen = |sight: &Sight| if let Sight::Seen(amount) = sight { *amount } else { 0.0 };
    Ok(Corners {
        direct: sights.iter().map(seen).collect(),
        round: sights.iter().map(number).collect(),
        edges: numbers.keys().map(edge).collect(),
        places: axes,
    })
}
