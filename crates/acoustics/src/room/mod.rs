//! A mesh with its materials, ready for rays.

mod facets;
pub(crate) mod ray;
mod volumes;

use crate::directivity::lattice::direction;
use crate::error::{AcousticsError, place};
use crate::materials::air::Air;
use crate::materials::eyring;
use crate::materials::material::Material;
use crate::mesh::{Mesh, normal};
use crate::octave::BANDS;
use glam::{DQuat, DVec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::cwbvh::CwBvh;
use obvhs::ray::{Ray, RayHit};
use std::collections::{HashMap, HashSet};

/// Directions in which it is counted how many surfaces lie between a place and the outside; an odd number, for a vote.
const VOTES: usize = 5;
/// Surfaces that are counted on one way at most.
const MOST_CROSSED: usize = 10_000;
/// Places along the longest side of a room at which a nearest place is looked for.
const SEARCHED: f64 = 24.0;

/// Directions in which a place's surroundings are looked at.
const AROUND: usize = 128;
/// No plane.
pub(crate) const NOWHERE: u32 = u32::MAX;
/// How far outside its edges a triangle is still met, as a share of itself, so that no ray slips through between two.
const EDGE: f32 = 2e-6;
/// Planes whose normals' coordinates differ by less, and whose distances by less than this share of the room, are one.
const SAME_PLANE: f64 = 1e-6;
/// How much larger than its triangle a bounding volume is at least, metres: the search passes over volumes that end within a
/// tenth of a millimetre of a ray's start.
const SLACK_M: f64 = 1.5e-4;
/// Length below which places do not differ, as a share of the room.
const SKIN: f64 = 2e-6;

/// A mesh with a material for each group.
#[derive(Debug)]
pub struct Room {
    /// Triangles that are not degenerate, in the order of the mesh.
    faces: Vec<Face>,
    planes: Vec<Plane>,
    materials: Vec<Material>,
    /// By material, square metres of one side.
    areas_m2: Vec<f64>,
    bvh: CwBvh,
    /// Triangles in the order of the bounding volumes.
    leaves: Vec<Leaf>,
    /// Single precision counts from here.
    centre: DVec3,
    /// Half of the room's lengths, metres.
    half: DVec3,
    /// Half of the room's diagonal, metres.
    radius: f64,
}

/// How a place in a room lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surroundings {
    /// Distance of the nearest surface, metres, as seen in 128 directions; infinite where there is none.
    pub clearance_m: f64,
    /// Share of the directions in which there is a surface: 1 in a closed room.
    pub enclosed: f64,
}

#[derive(Clone, Copy, Debug)]
struct Face {
    plane: u32,
    material: u32,
    /// Number of the triangle in the mesh.
    triangle: u32,
}

/// Points `p` with `normal . p = offset`; the normal has unit length.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plane {
    pub(crate) normal: DVec3,
    pub(crate) offset: f64,
}

#[derive(Clone, Copy, Debug)]
struct Leaf {
    corner: Vec3A,
    edges: [Vec3A; 2],
    normal: Vec3A,
    /// How far outside its edges it is still met, times its normal's length.
    edge: f32,
    plane: u32,
    face: u32,
}

impl Plane {
    /// Signed distance from the plane, metres.
    pub(crate) fn height(&self, point: DVec3) -> f64 {
        self.normal.dot(point) - self.offset
    }

    /// A point's mirror image.
    pub(crate) fn mirror(&self, point: DVec3) -> DVec3 {
        point - 2.0 * self.height(point) * self.normal
    }

    /// A direction after a mirror's reflection.
    pub(crate) fn reflect(&self, direction: DVec3) -> DVec3 {
        direction - 2.0 * self.normal.dot(direction) * self.normal
    }
}

impl Room {
    /// Makes a mesh with the material of each of its groups ready for tracing. Degenerate triangles reflect nothing, nor do
    /// those that lie where an earlier one does.
    ///
    /// # Errors
    /// A mesh with coordinates beyond 1000 km or numbers that refer to nothing, or without any area; as many materials as
    /// groups are needed, with shares from 0 to 1.
    pub fn new(mesh: &Mesh, materials: &[Material]) -> Result<Self, AcousticsError> {
        mesh.check_metres()?;
        materials.iter().try_for_each(Material::check)?;
        if materials.len() != mesh.groups.len() {
            let expected = format!("one for each of {} groups", mesh.groups.len());
            return Err(AcousticsError::argument("materials", expected, materials.len()));
        }
        let [low, high] = mesh.bounds().map(DVec3::from_array);
        let (centre, radius) = (0.5 * (low + high), 0.5 * low.distance(high));
        let mut planes = Planes::new(radius);
        let mut areas_m2 = vec![0.0; materials.len()];
        let (mut faces, mut leaves, mut bounds) = (Vec::new(), Vec::new(), Vec::new());
        let mut there: HashSet<[[i32; 3]; 3]> = HashSet::new();
        let cell = |v: DVec3| ((v - centre) / (SKIN * radius)).to_array().map(|c| c.round() as i32);
        for (triangle, t) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = mesh.corners(t);
            let Some(normal) = normal(a, b, c) else { continue };
            let mut cells = [a, b, c].map(cell);
            cells.sort_unstable();
            if !there.insert(cells) {
                continue;
            }
            let plane = planes.number(normal, a);
            areas_m2[t.group as usize] += 0.5 * (b - a).cross(c - a).length();
            let [a, b, c] = [a, b, c].map(|v| (v - centre).as_vec3a());
            let face = faces.len() as u32;
            faces.push(Face { plane, material: t.group, triangle: triangle as u32 });
            let normal = (a - b).cross(c - a);
            leaves.push(Leaf { corner: a, edges: [a - b, c - a], normal, edge: EDGE * normal.length(), plane, face });
            let slack = Vec3A::splat((SKIN * radius).max(SLACK_M) as f32);
            bounds.push(Aabb::new(a.min(b).min(c) - slack, a.max(b).max(c) + slack));
        }
        if faces.is_empty() {
            let found = format!("{} triangles without any", mesh.triangles.len());
            return Err(AcousticsError::argument("mesh", "triangles with an area", found));
        }
        let bvh = volumes::tree(&bounds);
        let leaves = bvh.primitive_indices.iter().map(|i| leaves[*i as usize]).collect();
        Ok(Self {
            faces,
            planes: planes.all,
            materials: materials.to_vec(),
            areas_m2,
            bvh,
            leaves,
            centre,
            half: 0.5 * (high - low),
            radius,
        })
    }

    /// The face that a ray from `origin` in a direction of unit length first meets, of those that are not in the plane that it
    /// leaves, and how far away it is in single precision.
    #[inline]
    pub(crate) fn cast(&self, origin: DVec3, direction: DVec3, leaving: u32) -> Option<(u32, f64)> {
        // A ray that leaves no plane may begin on one, and passes it.
        let least = if leaving == NOWHERE { self.skin() as f32 } else { 0.0 };
        let ray = Ray::new((origin - self.centre).as_vec3a(), direction.as_vec3a(), least, f32::INFINITY);
        let mut hit = RayHit::none();
        let met = self.bvh.ray_traverse(ray, &mut hit, |ray, i| {
            let leaf = &self.leaves[i];
            if leaf.plane == leaving { f32::INFINITY } else { leaf.meet(ray) }
        });
        met.then(|| (self.leaves[hit.primitive_id as usize].face, f64::from(hit.t)))
    }

    /// Length below which places do not differ, metres: what single precision can tell apart.
    pub(crate) fn skin(&self) -> f64 {
        SKIN * self.radius
    }

    /// The number of the plane of a face.
    pub(crate) fn plane(&self, face: u32) -> u32 {
        self.faces[face as usize].plane
    }

    pub(crate) fn centre(&self) -> DVec3 {
        self.centre
    }

    /// Half of the room's lengths, metres.
    pub(crate) fn half(&self) -> DVec3 {
        self.half
    }

    /// The normal of a face, of unit length.
    pub(crate) fn normal(&self, face: u32) -> DVec3 {
        self.planes[self.plane(face) as usize].normal
    }

    /// Where faces square to an axis lie along it, and their areas; `square` is the least cosine.
    pub(crate) fn square_faces(&self, axis: usize, square: f64) -> Vec<(f64, f64)> {
        let of = |leaf: &Leaf| {
            let normal = leaf.normal.as_dvec3();
            let area = 0.5 * normal.length();
            let at = f64::from(leaf.corner[axis]) + self.centre[axis];
            (normal[axis].abs() > 2.0 * square * area).then_some((at, area))
        };
        self.leaves.iter().filter_map(of).collect()
    }

    /// Of each plane a sphere that holds its faces: its middle, and its radius in metres.
    pub(crate) fn spheres(&self) -> Vec<(DVec3, f64)> {
        let mut boxes = vec![[DVec3::INFINITY, DVec3::NEG_INFINITY]; self.planes.len()];
        for leaf in &self.leaves {
            let [low, high] = &mut boxes[leaf.plane as usize];
            for corner in [leaf.corner, leaf.corner - leaf.edges[0], leaf.corner + leaf.edges[1]] {
                let corner = corner.as_dvec3() + self.centre;
                (*low, *high) = (low.min(corner), high.max(corner));
            }
        }
        boxes.iter().map(|[low, high]| (0.5 * (*low + *high), 0.5 * low.distance(*high) + self.skin())).collect()
    }

    /// Of the box along the axes that the mesh lies in, cubic metres; a flat mesh has at least a hundredth of its diagonal's
    /// cube.
    #[must_use]
    pub fn bounding_volume(&self) -> f64 {
        (8.0 * self.half.element_product()).max(0.08 * self.radius.powi(3))
    }

    pub(crate) fn planes(&self) -> &[Plane] {
        &self.planes
    }

    /// The material of a face.
    pub(crate) fn material(&self, face: u32) -> usize {
        self.faces[face as usize].material as usize
    }

    /// The number in the mesh of a face.
    pub(crate) fn triangle(&self, face: u32) -> u32 {
        self.faces[face as usize].triangle
    }

    /// How a place lies.
    ///
    /// # Errors
    /// A place that is not finite.
    pub fn surroundings(&self, at: [f64; 3]) -> Result<Surroundings, AcousticsError> {
        let at = place("place", at)?;
        let ways = (0..AROUND).filter_map(|i| self.cast(at, direction(i, AROUND), NOWHERE));
        let (count, clearance_m) = ways.fold((0, f64::INFINITY), |(n, least), (_, way)| (n + 1, least.min(way)));
        Ok(Surroundings { clearance_m, enclosed: f64::from(count) / AROUND as f64 })
    }

    /// Whether nothing lies between two places.
    ///
    /// # Errors
    /// A place that is not finite.
    pub fn sees(&self, from: [f64; 3], to: [f64; 3]) -> Result<bool, AcousticsError> {
        let (from, way) = (place("place", from)?, place("place", to)? - DVec3::from(from));
        let length = way.length();
        Ok(length == 0.0 || self.cast(from, way / length, NOWHERE).is_none_or(|(_, far)| far >= length - self.skin()))
    }

    /// Whether a place lies within a closed mesh: most ways from it to the outside cross an odd number of surfaces. Of a mesh
    /// with open edges it says nothing.
    ///
    /// # Errors
    /// A place that is not finite.
    pub fn encloses(&self, at: [f64; 3]) -> Result<bool, AcousticsError> {
        let at = place("place", at)?;
        // Not along an axis, a diagonal or a usual edge.
        let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.371, 0.713, 0.197);
        let odd = |i: usize| {
            let way = turn * direction(i, VOTES);
            let (mut from, mut leaving, mut crossed) = (at, NOWHERE, 0);
            while let Some((face, far)) = self.cast(from, way, leaving).filter(|_| crossed < MOST_CROSSED) {
                (from, leaving, crossed) = (from + far * way, self.plane(face), crossed + 1);
            }
            crossed % 2 == 1
        };
        Ok((0..VOTES).filter(|i| odd(*i)).count() > VOTES / 2)
    }

    /// The place nearest to another, of those within a closed mesh that have a margin, metres, to its surfaces, to some 1 %
    /// of the room; none where there is none.
    ///
    /// # Errors
    /// A place that is not finite.
    pub fn nearest_inside(&self, at: [f64; 3], margin_m: f64) -> Result<Option<[f64; 3]>, AcousticsError> {
        let at = place("place", at)?;
        let holds = |at: DVec3| -> Result<bool, AcousticsError> {
            let at = at.to_array();
            Ok(self.surroundings(at)?.clearance_m >= margin_m && self.encloses(at)?)
        };
        let step = 2.0 * self.half.max_element() / SEARCHED;
        let counts = (2.0 * self.half / step).ceil().max(DVec3::ONE);
        let [x, y, z] = counts.to_array().map(|count| count as usize);
        let low = self.centre - self.half;
        let all = (0..x * y * z).map(|i| DVec3::new((i % x) as f64, (i / x % y) as f64, (i / (x * y)) as f64));
        let mut all: Vec<DVec3> = all.map(|i| low + 2.0 * self.half * (i + 0.5) / counts).collect();
        all.sort_by(|a, b| a.distance(at).total_cmp(&b.distance(at)));
        for mut inside in all {
            if !holds(inside)? {
                continue;
            }
            // Nearer to where it was asked for.
            let (mut within, mut beyond) = (1.0, 0.0);
            let found = inside;
            for _ in 0..8 {
                let share = 0.5 * (within + beyond);
                let between = at.lerp(found, share);
                if holds(between)? { (within, inside) = (share, between) } else { beyond = share }
            }
            return Ok(Some(inside.to_array()));
        }
        Ok(None)
    }

    /// Reverberation time by octave after Eyring, seconds, of a closed room of this volume, cubic metres, or of the box about
    /// an open one, whose openings take all; infinite where nothing absorbs.
    #[must_use]
    pub fn eyring_t60_s(&self, closed_m3: Option<f64>, air: Option<Air>) -> [f64; BANDS] {
        let opening = Material::even("opening", 1.0, 0.0);
        let walls = self.areas_m2.iter().copied().zip(&self.materials);
        let [x, y, z] = (2.0 * self.half).to_array();
        let open_m2 = 2.0 * (x * y + y * z + z * x) - self.areas_m2.iter().sum::<f64>();
        let open_m2 = if closed_m3.is_some() { 0.0 } else { open_m2.max(0.0) };
        let volume = closed_m3.unwrap_or_else(|| self.bounding_volume());
        eyring::t60_s(walls.chain([(open_m2, &opening)]), volume, air)
    }

    /// Materials by group of the mesh.
    #[must_use]
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }
}

impl Leaf {
    /// How far along a ray it is met, infinity if it is not (Moeller and Trumbore 1997).
    #[inline]
    fn meet(&self, ray: &Ray) -> f32 {
        let to = self.corner - ray.origin;
        let turned = ray.direction.cross(to);
        let steep = self.normal.dot(ray.direction);
        let side = steep.signum();
        let (u, v) = (side * turned.dot(self.edges[1]), side * turned.dot(self.edges[0]));
        let t = self.normal.dot(to) / steep;
        // Edges are as wide as seen along the ray, however it grazes the plane. Comparisons with what is not a number are
        // false.
        let met = u >= -self.edge && v >= -self.edge && u + v <= steep.abs() + self.edge && t >= ray.tmin && t < ray.tmax;
        if met { t } else { f32::INFINITY }
    }
}

/// Planes that differ.
struct Planes {
    all: Vec<Plane>,
    numbers: HashMap<[i64; 4], u32>,
    radius: f64,
}

impl Planes {
    fn new(radius: f64) -> Self {
        Self { all: Vec::new(), numbers: HashMap::new(), radius }
    }

    fn number(&mut self, normal: DVec3, point: DVec3) -> u32 {
        let first = normal.to_array().into_iter().find(|c| c.abs() > SAME_PLANE);
        let normal = if first.is_some_and(|c| c < 0.0) { -normal } else { normal };
        let plane = Plane { normal, offset: normal.dot(point) };
        // Moved by a number that is no round one, lest round coordinates lie on an edge between two cells.
        let cell = |v: f64| (v / SAME_PLANE + 0.371_93).floor() as i64;
        let [x, y, z] = normal.to_array().map(cell);
        let key = [x, y, z, cell(plane.offset / self.radius.max(f64::MIN_POSITIVE))];
        *self.numbers.entry(key).or_insert_with(|| {
            self.all.push(plane);
            self.all.len() as u32 - 1
        })
    }
}
