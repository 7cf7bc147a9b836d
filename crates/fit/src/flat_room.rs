//! Rooms of flat walls, and the ways of sound in them with what moves them.
//!
//! A box has its images in closed form; in any mesh they are searched by beams, and their lengths follow from mirroring the
//! source at one wall after the other. Walls are moved along their normals.

pub(crate) mod voxels;

use crate::error::FitError;
use crate::flat_room::voxels::{Reflection, Voxels};
use crate::measurements::Measurements;
use crate::walls::{WALLS, Walls};
use promenade_acoustics::{ImageOptions, Images, Material, Mesh, Reflected, Room, Shoebox};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Walls of a mesh at most: each is a number that is sought.
const MOST_WALLS: usize = 512;
/// Two triangles of a group whose normals or distances differ by less are of one wall: a share, and metres.
const SAME: (f64, f64) = (1e-4, 1e-3);

/// A flat wall: points `p` with `normal . p = at_m`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlatWall {
    /// Unit length; of a box, out of the room, of a mesh, as its triangles say.
    pub normal: [f64; 3],
    /// Metres from the origin along the normal.
    pub at_m: f64,
    /// Number of its surface.
    pub surface: usize,
    /// Square metres.
    pub area_m2: f64,
}

/// What is known of a room's form.
#[derive(Clone, Debug, PartialEq)]
pub enum Form {
    /// A box along the axes, a surface for each wall.
    Box(Walls),
    /// Any mesh of flat walls, a surface for each of its groups.
    Mesh(Arc<Mesh>),
}

/// A room of flat walls with a surface for each.
#[derive(Clone, Debug, PartialEq)]
pub struct FlatRoom {
    /// Its form.
    pub form: Form,
    /// Names of the surfaces.
    pub surfaces: Vec<String>,
    /// Walls.
    pub walls: Vec<FlatWall>,
    /// Of each triangle of a mesh its wall; nothing of degenerate ones.
    of_triangle: Vec<Option<u16>>,
    /// Its surfaces in pieces; ways then meet these.
    pub voxels: Option<Arc<Voxels>>,
}

/// A way of sound from a source to a microphone.
#[derive(Clone, Debug, PartialEq)]
pub struct Way {
    /// Its length, metres.
    pub length_m: f64,
    /// Surfaces that it meets, of a room in voxels pieces, and how often, pieces with their shares.
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

impl Way {
    /// Reflections.
    #[must_use]
    pub fn order(&self) -> u32 {
        self.hits.iter().map(|(_, n)| n).sum::<f64>().round() as u32
    }
}

/// Which sequences of walls mirror a source towards a microphone. Of a box it is all of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sequences(Vec<Vec<u16>>);

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn along(a: [f64; 3], by: f64, b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| a[i] + by * b[i])
}

impl FlatRoom {
    /// A box.
    ///
    /// # Errors
    /// As [`Walls::check`].
    pub fn of_box(walls: Walls) -> Result<Self, FitError> {
        walls.check()?;
        let mut room = Self {
            form: Form::Box(walls),
            surfaces: WALLS.iter().map(|n| (*n).to_owned()).collect(),
            walls: Vec::new(),
            of_triangle: Vec::new(),
            voxels: None,
        };
        room.walls = box_walls(&walls);
        Ok(room)
    }

    /// A mesh: triangles of one group in one plane are a wall.
    ///
    /// # Errors
    /// A mesh without triangles, or with more than 512 walls.
    pub fn of_mesh(mesh: Mesh) -> Result<Self, FitError> {
        let mut walls: Vec<FlatWall> = Vec::new();
        let mut of_triangle = Vec::new();
        for t in &mesh.triangles {
            let [a, b, c] = t.corners.map(|i| mesh.vertices[i as usize]);
            let (u, v) = (along(b, -1.0, a), along(c, -1.0, a));
            let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
            let twice = dot(cross, cross).sqrt();
            if twice < 1e-12 {
                of_triangle.push(None);
                continue;
            }
            let normal = cross.map(|c| c / twice);
            let at_m = dot(normal, a);
            let same = walls.iter().position(|w| {
                let side = dot(w.normal, normal);
                w.surface == t.group as usize && side.abs() > 1.0 - SAME.0 && (w.at_m - side.signum() * at_m).abs() < SAME.1
            });
            let wall = same.unwrap_or(walls.len());
            if same.is_none() {
                walls.push(FlatWall { normal, at_m, surface: t.group as usize, area_m2: 0.0 });
            }
            walls[wall].area_m2 += 0.5 * twice;
            of_triangle.push(Some(wall as u16));
        }
        if walls.is_empty() || walls.len() > MOST_WALLS {
            return Err(FitError::argument("flat walls of the mesh", format!("1 to {MOST_WALLS}"), walls.len()));
        }
        Ok(Self { surfaces: mesh.groups.clone(), form: Form::Mesh(Arc::new(mesh)), walls, of_triangle, voxels: None })
    }

    /// The same room with a surface for each wall, named after its own with a number: `wall.2`.
    #[must_use]
    pub fn per_wall(&self) -> Self {
        let Form::Mesh(mesh) = &self.form else { return self.clone() };
        let mut each = self.clone();
        let mut mesh = (**mesh).clone();
        let mut of_surface = vec![0; self.surfaces.len()];
        each.surfaces = self
            .walls
            .iter()
            .map(|w| {
                of_surface[w.surface] += 1;
                format!("{}.{}", self.surfaces[w.surface], of_surface[w.surface])
            })
            .collect();
        each.walls.iter_mut().enumerate().for_each(|(i, w)| w.surface = i);
        // Triangles without an area belong to no wall, and reflect nothing.
        for (t, wall) in mesh.triangles.iter_mut().zip(&self.of_triangle) {
            t.group = wall.map_or(0, u32::from);
        }
        mesh.groups.clone_from(&each.surfaces);
        each.form = Form::Mesh(Arc::new(mesh));
        each
    }

    /// Its surfaces as a mesh, a group for each.
    ///
    /// # Errors
    /// A box without a volume.
    pub fn mesh(&self) -> Result<Mesh, FitError> {
        let walls = match &self.form {
            Form::Mesh(mesh) => return Ok((**mesh).clone()),
            Form::Box(walls) => walls,
        };
        let materials = std::array::from_fn(|_| Material::even("", 0.1, 0.1));
        let mut mesh = Shoebox { size: walls.size_m(), materials }.mesh()?;
        for v in &mut mesh.vertices {
            *v = along(*v, 1.0, walls.low_m);
        }
        Ok(mesh)
    }

    /// Its triangles with the wall of each.
    pub(crate) fn triangles(&self) -> Result<(Mesh, Vec<Option<u16>>), FitError> {
        let mesh = self.mesh()?;
        let walls = match &self.form {
            Form::Mesh(_) => self.of_triangle.clone(),
            Form::Box(_) => mesh.triangles.iter().map(|t| Some(t.group as u16)).collect(),
        };
        Ok((mesh, walls))
    }

    /// The same room with its surfaces in pieces. One of a mesh, which has the same ways.
    ///
    /// # Errors
    /// As [`Voxels::new`].
    pub fn in_voxels(&self, edge_m: f64) -> Result<Self, FitError> {
        let voxels = Arc::new(Voxels::new(self, edge_m)?);
        let mesh = self.mesh()?;
        let (form, of_triangle) = (Form::Mesh(Arc::new(mesh)), self.triangles()?.1);
        Ok(Self { form, of_triangle, voxels: Some(voxels), ..self.clone() })
    }

    /// The same room with its walls moved along their normals, metres. Corners of a mesh move to where their walls meet, in the
    /// sense of least squares and of least motion.
    ///
    /// # Errors
    /// A box that is none any more.
    pub fn moved(&self, by_m: &[f64]) -> Result<Self, FitError> {
        let mut moved = self.clone();
        moved.walls.iter_mut().zip(by_m).for_each(|(w, by)| w.at_m += by);
        match &mut moved.form {
            Form::Box(walls) => {
                for (w, by) in by_m.iter().enumerate().take(6) {
                    let outwards = if w.is_multiple_of(2) { -1.0 } else { 1.0 };
                    walls.set_wall(w, walls.wall_m(w) + outwards * by);
                }
                walls.check()?;
                moved.walls = box_walls(walls);
            }
            Form::Mesh(mesh) => move_corners(Arc::make_mut(mesh), &self.of_triangle, &self.walls, by_m),
        }
        Ok(moved)
    }

    /// The same for its ways alone, which do not ask where a mesh's corners are.
    pub(crate) fn shifted(&self, by_m: &[f64]) -> Self {
        let mut shifted = self.clone();
        shifted.walls.iter_mut().zip(by_m).for_each(|(w, by)| w.at_m += by);
        if let Form::Box(walls) = &mut shifted.form {
            for (w, wall) in shifted.walls.iter().enumerate() {
                walls.set_wall(w, if w.is_multiple_of(2) { -wall.at_m } else { wall.at_m });
            }
        }
        shifted
    }

    /// Refuses places that cannot be in it.
    ///
    /// # Errors
    /// A source or a microphone outside of a box, or outside of the box along the axes that a mesh lies in.
    pub fn check_places(&self, set: &Measurements) -> Result<(), FitError> {
        let [low, high] = match &self.form {
            Form::Box(walls) => [walls.low_m, walls.high_m],
            Form::Mesh(mesh) => mesh.bounds(),
        };
        for one in &set.all {
            for (what, at) in [("source", one.source.at_m), ("microphone", one.microphone.at_m)] {
                if (0..3).any(|a| at[a] < low[a] || at[a] > high[a]) {
                    let expected = format!("its {what} in the room from {low:?} to {high:?} m");
                    return Err(crate::error::measurement(&one.name, expected, format!("{at:?}")));
                }
            }
        }
        Ok(())
    }

    /// Square metres by surface.
    #[must_use]
    pub fn areas_m2(&self) -> Vec<f64> {
        let mut areas = vec![0.0; self.surfaces.len()];
        self.walls.iter().for_each(|w| areas[w.surface] += w.area_m2);
        areas
    }

    /// Cubic metres; of a mesh that is not closed it means little.
    #[must_use]
    pub fn volume_m3(&self) -> f64 {
        match &self.form {
            Form::Box(walls) => walls.volume_m3(),
            Form::Mesh(mesh) => {
                let sixth = |t: &promenade_acoustics::Triangle| {
                    let [a, b, c] = t.corners.map(|i| mesh.vertices[i as usize]);
                    let cross = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
                    dot(a, cross) / 6.0
                };
                mesh.triangles.iter().map(sixth).sum::<f64>().abs()
            }
        }
    }

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

    /// The ways from a source to a microphone of at most `order` reflections and `reach_m` metres, the direct one first, if it
    /// is free.
    #[must_use]
    pub fn ways(&self, of: &Sequences, source_m: [f64; 3], microphone_m: [f64; 3], order: u32, reach_m: f64) -> Vec<Way> {
        match &self.form {
            Form::Box(walls) => walls
                .paths(source_m, microphone_m, order, reach_m)
                .into_iter()
                .map(|p| {
                    let some = |w: usize| (p.hits[w] > 0).then_some((w as u16, f64::from(p.hits[w])));
                    let outwards = |w: usize| if w.is_multiple_of(2) { -p.by_wall[w] } else { p.by_wall[w] };
                    Way {
                        length_m: p.length_m,
                        hits: (0..6).filter_map(some).collect(),
                        departure: p.departure,
                        by_source: p.by_source,
                        by_microphone: p.by_microphone,
                        by_wall: (0..6).filter(|w| p.by_wall[*w] != 0.0).map(|w| (w as u16, outwards(w))).collect(),
                    }
                })
                .collect(),
            Form::Mesh(_) => {
                of.0.iter()
                    .filter(|s| s.len() <= order as usize)
                    .filter_map(|s| self.way(s, source_m, microphone_m).filter(|w| w.length_m <= reach_m))
                    .collect()
            }
        }
    }

    /// The way along a sequence of walls, by mirroring the source.
    fn way(&self, sequence: &[u16], source_m: [f64; 3], microphone_m: [f64; 3]) -> Option<Way> {
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
        Some(Way {
            length_m,
            hits: hits.into_iter().collect(),
            departure: heading,
            by_source: heading.map(|c| -c),
            by_microphone: towards.map(|c| -c),
            by_wall: by_wall.into_iter().collect(),
        })
    }
}

fn box_walls(walls: &Walls) -> Vec<FlatWall> {
    let areas = walls.areas_m2();
    let wall = |w: usize| {
        let outwards = if w.is_multiple_of(2) { -1.0 } else { 1.0 };
        let mut normal = [0.0; 3];
        normal[w / 2] = outwards;
        FlatWall { normal, at_m: outwards * walls.wall_m(w), surface: w, area_m2: areas[w] }
    };
    (0..6).map(wall).collect()
}

/// Moves each corner by the least that puts it on its walls: Gauss-Seidel on the walls that meet there.
fn move_corners(mesh: &mut Mesh, of_triangle: &[Option<u16>], walls: &[FlatWall], by_m: &[f64]) {
    let mut meeting: Vec<Vec<u16>> = vec![Vec::new(); mesh.vertices.len()];
    for (t, wall) in mesh.triangles.iter().zip(of_triangle) {
        for (corner, wall) in t.corners.iter().zip(std::iter::repeat(*wall)) {
            let own = &mut meeting[*corner as usize];
            if let Some(wall) = wall.filter(|w| !own.contains(w)) {
                own.push(wall);
            }
        }
    }
    for (vertex, own) in mesh.vertices.iter_mut().zip(&meeting) {
        let start = *vertex;
        for _ in 0..200 {
            for w in own {
                let (wall, by) = (&walls[usize::from(*w)], by_m[usize::from(*w)]);
                let gone = dot(along(*vertex, -1.0, start), wall.normal);
                *vertex = along(*vertex, by - gone, wall.normal);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [f64; 3] = [5.5, 4.1, 2.9];

    fn rooms() -> [FlatRoom; 2] {
        let walls = Shoebox { size: SIZE, materials: std::array::from_fn(|_| Material::even("", 0.1, 0.0)) };
        [FlatRoom::of_box(Walls::of_size(SIZE).unwrap()).unwrap(), FlatRoom::of_mesh(walls.mesh().unwrap()).unwrap()]
    }

    fn ways(room: &FlatRoom, source: [f64; 3], microphone: [f64; 3]) -> Vec<Way> {
        let sequences = room.sequences(&[(source, microphone)], 3).unwrap();
        let mut ways = room.ways(&sequences[0], source, microphone, 3, 100.0);
        ways.sort_by(|a, b| a.length_m.total_cmp(&b.length_m));
        ways
    }

    #[test]
    fn a_box_and_its_mesh_have_the_same_ways_and_the_same_derivatives() {
        let [a, b] = rooms();
        let (source, microphone) = ([1.1, 2.3, 1.3], [3.7, 1.2, 1.7]);
        let [of_box, of_mesh] = [&a, &b].map(|r| ways(r, source, microphone));
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
    fn ways_grow_with_walls_as_their_derivatives_say() {
        let (source, microphone) = ([1.1, 2.3, 1.3], [3.7, 1.2, 1.7]);
        for room in rooms() {
            let before = ways(&room, source, microphone);
            for w in 0..6 {
                let mut by = [0.0; 6];
                by[w] = 1e-6;
                for (a, b) in before.iter().zip(&ways(&room.moved(&by).unwrap(), source, microphone)) {
                    let says = a.by_wall.iter().find(|(wall, _)| usize::from(*wall) == w).map_or(0.0, |(_, by)| *by);
                    assert!(((b.length_m - a.length_m) / 1e-6 - says).abs() < 1e-4, "{w}: {a:?} {b:?}");
                }
            }
        }
    }

    #[test]
    fn ways_of_a_room_in_voxels_meet_the_pieces_where_they_are_mirrored() {
        let [room, _] = rooms();
        let room = room.in_voxels(0.15).unwrap();
        let voxels = room.voxels.clone().unwrap();
        let (source, microphone) = ([1.1, 2.3, 1.3], [3.7, 1.2, 1.7]);
        let all = ways(&room, source, microphone);
        assert_eq!(all.len(), 63);
        for way in &all {
            // The straight line to the image, folded back where it leaves the box: middles of pieces by wall.
            let mut middles = [[0.0; 4]; 6];
            for (p, share) in &way.hits {
                let patch = &voxels.patches[usize::from(*p)];
                (0..3).for_each(|a| middles[patch.wall][a] += share * patch.centre_m[a]);
                middles[patch.wall][3] += share;
            }
            let to: [f64; 3] = std::array::from_fn(|a| -way.by_microphone[a] * way.length_m);
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
                assert!(near < 0.4, "{wall} {near} {middle:?} {way:?}");
            }
        }
    }

    #[test]
    fn corners_follow_their_walls() {
        let [_, room] = rooms();
        let by: Vec<f64> = (0..6).map(|w| 0.01 * f64::from(w + 1)).collect();
        let moved = room.moved(&by).unwrap();
        for (before, after) in room.walls.iter().zip(&moved.walls) {
            assert!((after.at_m - before.at_m).abs() > 5e-3);
        }
        let Form::Mesh(mesh) = &moved.form else { panic!() };
        for (t, wall) in mesh.triangles.iter().zip(&moved.of_triangle) {
            let wall = &moved.walls[usize::from(wall.unwrap())];
            for c in t.corners {
                assert!((dot(wall.normal, mesh.vertices[c as usize]) - wall.at_m).abs() < 1e-9);
            }
        }
        let inwards = room.walls.iter().all(|w| dot(w.normal, [2.0, 2.0, 1.5]) > w.at_m);
        assert!(inwards, "the box's mesh faces inwards");
    }
}
