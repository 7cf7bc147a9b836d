//! Paths of sound between two places by image sources, with what moves their lengths.
//!
//! A box has its images in closed form; in any mesh they are searched by beams, and their lengths follow from mirroring the
//! source at one wall after the other.

use super::flat_room::{FlatRoom, Form};
use super::vectors::{along, dot};
use super::voxels::Reflection;
use super::walls::outwards;
use crate::error::FitError;
use promenade_acoustics::{ImageOptions, Images, Material, Reflected, Room};
use std::collections::BTreeMap;

/// A path of sound from a source to a microphone.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    /// Its length, metres.
    pub length_m: f64,
    /// Surfaces that it meets, of a room in voxels patches, and how often, patches with their shares.
    pub hits: Vec<(u16, f64)>,
    /// Where sound leaves the source, of unit length.
    pub departure: [f64; 3],
    /// How the length grows with each coordinate of the source.
    pub by_source: [f64; 3],
    /// Of the microphone.
    pub by_microphone: [f64; 3],
    /// With walls that move along their normals.
    pub by_wall: Vec<(u16, f64)>,
}

impl Path {
    /// Reflections.
    #[must_use]
    pub fn order(&self) -> u32 {
        self.hits.iter().map(|(_, n)| n).sum::<f64>().round() as u32
    }
}

/// Which sequences of walls mirror a source towards a microphone. Of a box it is all of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sequences(Vec<Vec<u16>>);

impl FlatRoom {
    /// The sequences of walls that mirror each source to its microphone, up to an order.
    ///
    /// # Errors
    /// A place that is not finite, a mesh that is none.
    pub fn sequences(&self, places: &[([f64; 3], [f64; 3])], order: u32) -> Result<Vec<Sequences>, FitError> {
        let Form::Mesh(mesh) = &self.form else { return Ok(vec![Sequences::default(); places.len()]) };
        let room = Room::new(mesh, &vec![Material::even("", 0.1, 0.0); mesh.groups.len()])?;
        let options = ImageOptions { order, exact_order: 1, ..ImageOptions::default() };
        let mut found = Vec::with_capacity(places.len());
        // Images of a source are searched once, however many microphones hear it.
        let mut known: BTreeMap<[u64; 3], Images> = BTreeMap::new();
        for (source, microphone) in places {
            let key = source.map(f64::to_bits);
            if !known.contains_key(&key) {
                if known.len() >= 64 {
                    known.clear();
                }
                known.insert(key, Images::new(&room, *source, &options)?);
            }
            let seen = known[&key].seen_from(&room, *microphone, Reflected::Whole)?;
            let walls = |faces: Vec<u32>| faces.into_iter().map(|f| self.of_triangle[f as usize]).collect::<Option<Vec<u16>>>();
            found.push(Sequences(seen.into_iter().filter_map(|image| walls(image.faces)).collect()));
        }
        Ok(found)
    }

    /// The paths from a source to a microphone of at most `order` reflections and `reach_m` metres, the direct one first, if it
    /// is free.
    #[must_use]
    pub fn paths(&self, of: &Sequences, source_m: [f64; 3], microphone_m: [f64; 3], order: u32, reach_m: f64) -> Vec<Path> {
        match &self.form {
            Form::Box(walls) => walls
                .paths(source_m, microphone_m, order, reach_m)
                .into_iter()
                .map(|p| {
                    let some = |w: usize| (p.hits[w] > 0).then_some((w as u16, f64::from(p.hits[w])));
                    Path {
                        length_m: p.length_m,
                        hits: (0..6).filter_map(some).collect(),
                        departure: p.departure,
                        by_source: p.by_source,
                        by_microphone: p.by_microphone,
                        by_wall: (0..6)
                            .filter(|w| p.by_wall[*w] != 0.0)
                            .map(|w| (w as u16, outwards(w) * p.by_wall[w]))
                            .collect(),
                    }
                })
                .collect(),
            Form::Mesh(_) => {
                of.0.iter()
                    .filter(|s| s.len() <= order as usize)
                    .filter_map(|s| self.path(s, source_m, microphone_m).filter(|w| w.length_m <= reach_m))
                    .collect()
            }
        }
    }

    /// The path along a sequence of walls, by mirroring the source.
    fn path(&self, sequence: &[u16], source_m: [f64; 3], microphone_m: [f64; 3]) -> Option<Path> {
        let mut images = vec![source_m];
        let mut image = source_m;
        for wall in sequence {
            let w = &self.walls[usize::from(*wall)];
            image = along(image, -2.0 * (dot(w.normal, image) - w.at_m), w.normal);
            images.push(image);
        }
        let way = along(image, -1.0, microphone_m);
        let length_m = dot(way, way).sqrt();
        if length_m < 1e-6 {
            return None;
        }
        let towards = way.map(|c| c / length_m);
        // How sound travels, from the microphone back to the source.
        let mut heading = towards.map(|c| -c);
        let mut by_wall: BTreeMap<u16, f64> = BTreeMap::new();
        let mut hits: BTreeMap<u16, f64> = BTreeMap::new();
        let (mut at, mut gone) = (microphone_m, 0.0);
        for (wall, image) in sequence.iter().zip(&images[1..]).rev() {
            let w = &self.walls[usize::from(*wall)];
            if let Some(voxels) = &self.voxels {
                // Back to where it is mirrored.
                let steep = dot(heading, w.normal);
                let step = if steep.abs() > 1e-9 { ((dot(w.normal, at) - w.at_m) / steep).max(0.0) } else { 0.0 };
                at = along(at, -step, heading);
                gone += step;
                let left = along(*image, -1.0, at);
                let ways_m = [dot(left, left).sqrt(), gone];
                let reflection = Reflection { wall: usize::from(*wall), at_m: at, along: heading, ways_m };
                for (patch, share) in voxels.shares(&reflection, w) {
                    *hits.entry(patch).or_default() += share;
                }
            } else {
                *hits.entry(w.surface as u16).or_default() += 1.0;
            }
            heading = along(heading, -2.0 * dot(heading, w.normal), w.normal);
            *by_wall.entry(*wall).or_default() += 2.0 * dot(heading, w.normal);
        }
        Some(Path {
            length_m,
            hits: hits.into_iter().collect(),
            departure: heading,
            by_source: heading.map(|c| -c),
            by_microphone: towards.map(|c| -c),
            by_wall: by_wall.into_iter().collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::room::Walls;
    use promenade_acoustics::Shoebox;

    const SIZE: [f64; 3] = [5.5, 4.1, 2.9];

    fn rooms() -> [FlatRoom; 2] {
        let walls = Shoebox { size: SIZE, materials: std::array::from_fn(|_| Material::even("", 0.1, 0.0)) };
        [FlatRoom::of_box(Walls::of_size(SIZE).unwrap()).unwrap(), FlatRoom::of_mesh(walls.mesh().unwrap()).unwrap()]
    }

    fn paths(room: &FlatRoom, source: [f64; 3], microphone: [f64; 3]) -> Vec<Path> {
        let sequences = room.sequences(&[(source, microphone)], 3).unwrap();
        let mut paths = room.paths(&sequences[0], source, microphone, 3, 100.0);
        paths.sort_by(|a, b| a.length_m.total_cmp(&b.length_m));
        paths
    }

    #[test]
    fn a_box_and_its_mesh_have_the_same_paths_and_the_same_derivatives() {
        let [a, b] = rooms();
        let (source, microphone) = ([1.1, 2.3, 1.3], [3.7, 1.2, 1.7]);
        let [of_box, of_mesh] = [&a, &b].map(|r| paths(r, source, microphone));
        assert_eq!((of_box.len(), of_mesh.len()), (63, 63));
        for (x, y) in of_box.iter().zip(&of_mesh) {
            assert!((x.length_m - y.length_m).abs() < 1e-9 && x.hits == y.hits, "{x:?} {y:?}");
            for i in 0..3 {
                assert!(
                    (x.by_source[i] - y.by_source[i]).abs() < 1e-9 && (x.by_microphone[i] - y.by_microphone[i]).abs() < 1e-9
                );
                assert!((x.departure[i] - y.departure[i]).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn paths_grow_with_walls_as_their_derivatives_say() {
        let (source, microphone) = ([1.1, 2.3, 1.3], [3.7, 1.2, 1.7]);
        for room in rooms() {
            let before = paths(&room, source, microphone);
            for w in 0..6 {
                let mut by = [0.0; 6];
                by[w] = 1e-6;
                for (a, b) in before.iter().zip(&paths(&room.moved(&by).unwrap(), source, microphone)) {
                    let says = a.by_wall.iter().find(|(wall, _)| usize::from(*wall) == w).map_or(0.0, |(_, by)| *by);
                    assert!(((b.length_m - a.length_m) / 1e-6 - says).abs() < 1e-4, "{w}: {a:?} {b:?}");
                }
            }
        }
    }

    #[test]
    fn paths_of_a_room_in_voxels_meet_the_patches_where_they_are_mirrored() {
        let [room, _] = rooms();
        let room = room.in_voxels(0.15).unwrap();
        let voxels = room.voxels.clone().unwrap();
        let (source, microphone) = ([1.1, 2.3, 1.3], [3.7, 1.2, 1.7]);
        let all = paths(&room, source, microphone);
        assert_eq!(all.len(), 63);
        for path in &all {
            // The straight line to the image, folded back where it leaves the box: middles of pieces by wall.
            let mut middles = [[0.0; 4]; 6];
            for (p, share) in &path.hits {
                let patch = &voxels.patches[usize::from(*p)];
                (0..3).for_each(|a| middles[patch.wall][a] += share * patch.centre_m[a]);
                middles[patch.wall][3] += share;
            }
            let to: [f64; 3] = std::array::from_fn(|a| -path.by_microphone[a] * path.length_m);
            for (wall, middle) in middles.iter().enumerate().filter(|(_, m)| (m[3] - 1.0).abs() < 1e-9) {
                let axis = wall / 2;
                let plane = [0.0, SIZE[axis], -SIZE[axis], 2.0 * SIZE[axis], -2.0 * SIZE[axis], 3.0 * SIZE[axis]];
                let folded = |share: f64| -> [f64; 3] {
                    std::array::from_fn(|a| {
                        let v = (microphone[a] + share * to[a]).rem_euclid(2.0 * SIZE[a]);
                        if v > SIZE[a] { 2.0 * SIZE[a] - v } else { v }
                    })
                };
                let near = plane
                    .iter()
                    .map(|at| (at - microphone[axis]) / to[axis])
                    .filter(|share| (0.0..1.0).contains(share))
                    .map(folded)
                    .map(|at| (0..3).map(|a| (at[a] - middle[a]).powi(2)).sum::<f64>().sqrt())
                    .fold(f64::INFINITY, f64::min);
                // Footprints are cut off at the ends of walls.
                assert!(near < 0.4, "{wall} {near} {middle:?} {path:?}");
            }
        }
    }
}
