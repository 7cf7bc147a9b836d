//! Fewer triangles where a mesh is about flat (M. Garland and P. S. Heckbert, "Surface simplification using quadric error
//! metrics", SIGGRAPH 1997).

use super::welded::Welded;
use super::{Mesh, Triangle};
use glam::{DMat3, DVec3};
use rustc_hash::FxHashSet;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Least cosine of the angle by which a triangle turns.
const TURNED: f64 = 0.3;
/// Least height of a triangle over its longest side that is made of a better one.
const SLIVER: f64 = 0.02;

/// What is nearer to its planes than this is on them, square metres.
const EXACT_M2: f64 = 1e-12;

/// Mean of squared distances from planes, by area: `x A x - 2 b x + c`.
#[derive(Clone, Copy)]
struct Quadric {
    a: DMat3,
    b: DVec3,
    c: f64,
    area: f64,
}

impl Quadric {
    const NONE: Self = Self { a: DMat3::ZERO, b: DVec3::ZERO, c: 0.0, area: 0.0 };

    fn of(place: DVec3, area: DVec3) -> Self {
        let size = area.length();
        let normal = area.normalize_or_zero();
        let offset = normal.dot(place);
        let a = DMat3::from_cols(normal.x * normal, normal.y * normal, normal.z * normal) * size;
        Self { a, b: size * offset * normal, c: size * offset * offset, area: size }
    }

    fn with(mut self, other: &Self) -> Self {
        self.a += other.a;
        self.b += other.b;
        self.c += other.c;
        self.area += other.area;
        self
    }

    /// Mean square, square metres.
    fn at(&self, place: DVec3) -> f64 {
        ((place.dot(self.a * place) - 2.0 * self.b.dot(place) + self.c) / self.area.max(f64::MIN_POSITIVE)).max(0.0)
    }
}

/// An edge that may be drawn together, the least first.
struct Edge {
    cost: f64,
    ends: [u32; 2],
    to: DVec3,
    /// How often each end has changed when this was found.
    ages: [u32; 2],
}

impl PartialEq for Edge {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Edge {}
impl PartialOrd for Edge {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Edge {
    fn cmp(&self, other: &Self) -> Ordering {
        other.cost.total_cmp(&self.cost).then_with(|| other.ends.cmp(&self.ends))
    }
}

impl Mesh {
    /// Draws edges together as long as the surface moves by no more than so many metres, root mean square about each vertex.
    /// Vertices at open edges, where edges have more than two triangles, and between groups stay.
    pub fn simplify(&mut self, within_m: f64) {
        let mut all = Simplified::new(self);
        let mut waiting = BinaryHeap::new();
        for vertex in 0..all.places.len() as u32 {
            all.edges(vertex, vertex, &mut waiting);
        }
        while let Some(edge) = waiting.pop() {
            if edge.cost > within_m * within_m {
                break;
            }
            let fresh = edge.ends.iter().zip(edge.ages).all(|(end, age)| all.ages[*end as usize] == age);
            if fresh && all.draw(&edge) {
                all.edges(edge.ends[0], 0, &mut waiting);
            }
        }
        all.write(self);
    }
}

struct Simplified {
    places: Vec<DVec3>,
    quadrics: Vec<Quadric>,
    fixed: Vec<bool>,
    ages: Vec<u32>,
    /// Triangles at each vertex.
    at: Vec<Vec<u32>>,
    corners: Vec<[u32; 3]>,
    groups: Vec<u32>,
    gone: Vec<bool>,
    middle: DVec3,
}

impl Simplified {
    fn new(mesh: &Mesh) -> Self {
        let Welded { places, corners, .. } = Welded::new(mesh);
        let middle = places.iter().sum::<DVec3>() / places.len().max(1) as f64;
        let places: Vec<DVec3> = places.into_iter().map(|place| place - middle).collect();
        let count = places.len();
        let mut all = Self {
            quadrics: vec![Quadric::NONE; count],
            fixed: vec![false; count],
            ages: vec![0; count],
            at: vec![Vec::new(); count],
            groups: mesh.triangles.iter().map(|t| t.group).collect(),
            gone: corners.iter().map(|[a, b, c]| a == b || b == c || c == a).collect(),
            places,
            corners,
            middle,
        };
        let mut edges: rustc_hash::FxHashMap<[u32; 2], u32> = rustc_hash::FxHashMap::default();
        for t in (0..all.corners.len()).filter(|t| !all.gone[*t]) {
            let corners = all.corners[t];
            let [a, b, c] = corners.map(|v| all.places[v as usize]);
            let quadric = Quadric::of(a, 0.5 * (b - a).cross(c - a));
            for k in 0..3 {
                let v = corners[k] as usize;
                all.quadrics[v] = all.quadrics[v].with(&quadric);
                all.fixed[v] |= all.at[v].first().is_some_and(|first| all.groups[*first as usize] != all.groups[t]);
                all.at[v].push(t as u32);
                let (from, to) = (corners[k], corners[(k + 1) % 3]);
                *edges.entry([from.min(to), from.max(to)]).or_default() += 1;
            }
        }
        for (ends, _) in edges.iter().filter(|(_, count)| **count != 2) {
            ends.iter().for_each(|end| all.fixed[*end as usize] = true);
        }
        all
    }

    fn around(&self, vertex: u32) -> FxHashSet<u32> {
        let all = self.at[vertex as usize].iter().flat_map(|t| self.corners[*t as usize]);
        all.filter(|other| *other != vertex).collect()
    }

    /// The edges of a vertex to others from a number on.
    fn edges(&self, vertex: u32, from: u32, waiting: &mut BinaryHeap<Edge>) {
        let mut around: Vec<u32> = self.around(vertex).into_iter().filter(|other| *other >= from).collect();
        around.sort_unstable();
        for other in around {
            let ends = [vertex, other];
            let [fixed, other_fixed] = ends.map(|end| self.fixed[end as usize]);
            if fixed && other_fixed {
                continue;
            }
            let [a, b] = ends.map(|end| self.places[end as usize]);
            let quadric = self.quadrics[vertex as usize].with(&self.quadrics[other as usize]);
            // A vertex that is to stay is where both go.
            let of = |place: DVec3, other: bool| if other { f64::INFINITY } else { quadric.at(place) };
            let ends_m2 = [of(a, other_fixed), of(b, fixed)];
            let mut best = if ends_m2[0] <= ends_m2[1] { (ends_m2[0], a) } else { (ends_m2[1], b) };
            // An end that is on all planes stays exactly there.
            if best.0 > EXACT_M2 && !fixed && !other_fixed {
                let place = self.nearest(&quadric, 0.5 * (a + b), a.distance(b));
                let cost = quadric.at(place);
                if cost < 0.5 * best.0 {
                    best = (cost, place);
                }
            }
            let (cost, to) = best;
            let ages = ends.map(|end| self.ages[end as usize]);
            // Of equal ones, short edges first: their triangles stay even.
            waiting.push(Edge { cost: cost + 1e-9 * a.distance_squared(b), ends, to, ages });
        }
    }

    /// Where a quadric is least, near a place.
    fn nearest(&self, quadric: &Quadric, near: DVec3, length: f64) -> DVec3 {
        let slack = 1e-3 * quadric.area;
        let matrix = quadric.a + DMat3::from_diagonal(DVec3::splat(slack));
        let found = matrix.inverse() * (quadric.b + slack * near);
        if found.is_finite() && found.distance(near) < length { found } else { near }
    }

    /// Draws an edge together if the surface stays one.
    fn draw(&mut self, edge: &Edge) -> bool {
        let [keep, lose] = edge.ends;
        if self.at[keep as usize].is_empty() || self.at[lose as usize].is_empty() {
            return false;
        }
        let shared = self.around(keep).intersection(&self.around(lose)).count();
        if shared != 2 {
            return false;
        }
        for (vertex, other) in [(keep, lose), (lose, keep)] {
            for t in self.at[vertex as usize].iter().filter(|t| !self.corners[**t as usize].contains(&other)) {
                let before = self.corners[*t as usize].map(|v| self.places[v as usize]);
                let after = self.corners[*t as usize].map(|v| if v == vertex { edge.to } else { self.places[v as usize] });
                let area = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a);
                let thin = |corners: [DVec3; 3]| {
                    let [a, b, c] = corners;
                    let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
                    area(corners).length() / longest.max(f64::MIN_POSITIVE)
                };
                let (from, to) = (area(before), area(after));
                if from.dot(to) < TURNED * from.length() * to.length() || thin(after) < SLIVER.min(thin(before)) {
                    return false;
                }
            }
        }
        self.places[keep as usize] = edge.to;
        self.quadrics[keep as usize] = self.quadrics[keep as usize].with(&self.quadrics[lose as usize]);
        self.fixed[keep as usize] |= self.fixed[lose as usize];
        let moved = std::mem::take(&mut self.at[lose as usize]);
        for t in moved {
            if self.corners[t as usize].contains(&keep) {
                self.gone[t as usize] = true;
                for v in self.corners[t as usize] {
                    self.at[v as usize].retain(|other| *other != t);
                }
            } else {
                self.corners[t as usize].iter_mut().filter(|v| **v == lose).for_each(|v| *v = keep);
                self.at[keep as usize].push(t);
            }
        }
        self.ages[keep as usize] += 1;
        self.ages[lose as usize] += 1;
        true
    }

    fn write(self, mesh: &mut Mesh) {
        let mut numbers = vec![u32::MAX; self.places.len()];
        mesh.vertices.clear();
        mesh.triangles.clear();
        for t in (0..self.corners.len()).filter(|t| !self.gone[*t]) {
            let corners = self.corners[t].map(|v| {
                let number = &mut numbers[v as usize];
                if *number == u32::MAX {
                    *number = mesh.vertices.len() as u32;
                    mesh.vertices.push((self.places[v as usize] + self.middle).to_array());
                }
                *number
            });
            mesh.triangles.push(Triangle { corners, group: self.groups[t] });
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::{Material, Mesh, Room, Triangle};

    /// A box of grids of triangles.
    fn fine(steps: u32) -> Mesh {
        let size = [4.0, 3.0, 2.5];
        let mut mesh = Mesh { groups: vec!["wall".into()], ..Mesh::default() };
        for wall in 0..6 {
            let axis = wall / 2;
            let first = mesh.vertices.len() as u32;
            for i in 0..=steps {
                for j in 0..=steps {
                    let mut v = [0.0; 3];
                    v[axis] = if wall % 2 == 1 { size[axis] } else { 0.0 };
                    v[(axis + 1) % 3] = size[(axis + 1) % 3] * f64::from(i) / f64::from(steps);
                    v[(axis + 2) % 3] = size[(axis + 2) % 3] * f64::from(j) / f64::from(steps);
                    mesh.vertices.push(v);
                }
            }
            for (i, j) in (0..steps).flat_map(|i| (0..steps).map(move |j| (i, j))) {
                let at = |i: u32, j: u32| first + i * (steps + 1) + j;
                let quad = if wall % 2 == 1 {
                    [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]
                } else {
                    [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)]
                };
                let [a, b, c, d] = quad;
                mesh.triangles.extend([[a, b, c], [a, c, d]].map(|corners| Triangle { corners, group: 0 }));
            }
        }
        mesh
    }

    #[test]
    fn flat_walls_become_few_triangles() {
        let mut mesh = fine(20);
        mesh.simplify(0.001);
        let report = mesh.report();
        assert!(mesh.triangles.len() < 60, "{} triangles", mesh.triangles.len());
        assert_eq!((report.open_edges, report.flipped), (0, 0));
        assert!((report.volume_m3.unwrap() - 30.0).abs() < 1e-9 && (report.area_m2 - 59.0).abs() < 1e-9, "{report:?}");
        assert_eq!(mesh.bounds(), [[0.0; 3], [4.0, 3.0, 2.5]]);
        let room = Room::new(&mesh, &[Material::even("", 0.1, 0.1)]).unwrap();
        assert_eq!(room.planes().len(), 6);
    }

    #[test]
    fn borders_and_groups_stay() {
        let mut mesh = fine(8);
        mesh.groups.push("door".into());
        mesh.triangles[20].group = 1;
        mesh.triangles.remove(130);
        let before = mesh.report();
        mesh.simplify(0.001);
        let after = mesh.report();
        assert!((before.open_length_m - after.open_length_m).abs() < 1e-9 && (before.area_m2 - after.area_m2).abs() < 1e-9);
        let door: Vec<&Triangle> = mesh.triangles.iter().filter(|t| t.group == 1).collect();
        assert_eq!(door.len(), 1);
    }
}
