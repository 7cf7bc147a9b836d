//! Sequences of planes that a source is mirrored in.

use super::cone::Cone;
use crate::directivity::lattice::direction;
use crate::room::Room;
use crate::room::ray::Ray;
use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Most images of one order that are made without a beam.
const MOST_EXACT: usize = 16_384;
/// A beam's half angle, times the radius of a circle of its share of the sphere; 1.4 leaves no gap between beams.
const OVERLAP: f64 = 1.4;
/// Images nearer to each other than this, metres, are one. On flat walls they differ by rounding only.
pub(super) const SAME_IMAGE_M: f64 = 1e-5;
/// End of a sequence, or a beam that has left the room.
const NOTHING: u32 = u32::MAX;

/// An image that is seen from some places.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    pub(super) position: DVec3,
    pub(super) order: u32,
    /// The directions, from its position, of the places that may see it.
    pub(super) cone: Cone,
}

/// Sequences of planes that begin alike share their beginning.
pub(super) struct Tree {
    nodes: Vec<Node>,
    children: FxHashMap<(u32, u32), u32>,
}

struct Node {
    position: DVec3,
    order: u32,
    /// The plane that mirrored it last.
    plane: u32,
    beams: Beams,
}

/// What of a node's beams is known.
enum Beams {
    /// It was made without asking for any.
    Unasked,
    /// The sum of their directions.
    Towards(DVec3),
}

impl Tree {
    pub(super) fn new(source: DVec3) -> Self {
        let root = Node { position: source, order: 0, plane: NOTHING, beams: Beams::Unasked };
        Self { nodes: vec![root], children: FxHashMap::default() }
    }

    /// All sequences of up to so many planes, unless an order has too many.
    pub(super) fn grow_exactly(&mut self, room: &Room, order: u32) {
        let mut last = 0..1;
        for _ in 0..order {
            if last.len() * room.planes().len() > MOST_EXACT {
                return;
            }
            let begin = self.nodes.len();
            for node in last {
                for plane in 0..room.planes().len() as u32 {
                    if self.nodes[node].plane != plane {
                        self.child(room, node as u32, plane, || Beams::Unasked);
                    }
                }
            }
            last = begin..self.nodes.len();
        }
    }

    /// The sequences of planes that beams meet. Returns the cones of all nodes.
    pub(super) fn grow_along(mut self, room: &Room, order: u32, beams: usize) -> Vec<Candidate> {
        let order = order as usize;
        let mut steps = vec![(NOTHING, DVec3::ZERO); beams * order];
        if order > 0 {
            let source = self.nodes[0].position;
            steps.par_chunks_mut(order).with_min_len(256).enumerate().for_each(|(i, steps)| {
                let mut ray = Ray::new(source, direction(i, beams));
                for step in steps {
                    let Some(hit) = ray.cast(room) else { return };
                    ray.mirror(room, &hit);
                    *step = (room.plane(hit.face), ray.direction);
                }
            });
        }
        let mut visits = vec![NOTHING; steps.len()];
        for (steps, visits) in steps.chunks(order.max(1)).zip(visits.chunks_mut(order.max(1))) {
            let mut node = 0;
            for ((plane, direction), visit) in steps.iter().zip(visits).take_while(|s| s.0.0 != NOTHING) {
                node = self.child(room, node, *plane, || Beams::Towards(DVec3::ZERO));
                if let Beams::Towards(sum) = &mut self.nodes[node as usize].beams {
                    *sum += direction;
                }
                *visit = node;
            }
        }
        let half_angle = OVERLAP * 2.0 / (beams as f64).sqrt();
        let spheres = room.spheres();
        let mut cones: Vec<(Cone, f64)> = self.nodes.iter().map(|node| (node.cone(&spheres), 1.0)).collect();
        for ((_, direction), visit) in steps.iter().zip(&visits).filter(|(_, visit)| **visit != NOTHING) {
            let (cone, least) = &mut cones[*visit as usize];
            *least = cone.along(*direction).min(*least);
        }
        let candidate = |(node, (cone, least)): (&Node, (Cone, f64))| Candidate {
            position: node.position,
            order: node.order,
            cone: cone.wide(least.clamp(-1.0, 1.0).acos() + half_angle),
        };
        self.nodes.iter().zip(cones).map(candidate).collect()
    }

    fn child(&mut self, room: &Room, node: u32, plane: u32, beams: impl Fn() -> Beams) -> u32 {
        let Self { nodes, children } = self;
        *children.entry((node, plane)).or_insert_with(|| {
            let parent = &nodes[node as usize];
            let position = room.planes()[plane as usize].mirror(parent.position);
            nodes.push(Node { position, order: parent.order + 1, plane, beams: beams() });
            nodes.len() as u32 - 1
        })
    }
}

impl Node {
    /// The directions of its beams, or without any those of the faces of its plane.
    fn cone(&self, spheres: &[(DVec3, f64)]) -> Cone {
        match (&self.beams, spheres.get(self.plane as usize)) {
            (Beams::Towards(sum), _) => Cone::new(*sum, 0.0),
            (Beams::Unasked, Some((middle, radius))) if self.position.distance(*middle) > *radius => {
                Cone::new(*middle - self.position, (radius / self.position.distance(*middle)).asin())
            }
            (Beams::Unasked, _) => Cone::EVERYWHERE,
        }
    }
}

/// Images that are seen from some places, each once, by their order.
#[derive(Clone, Debug)]
pub(super) struct Candidates {
    all: Vec<Candidate>,
    /// By the cell that they lie in, and their order.
    numbers: FxHashMap<[i64; 4], Vec<usize>>,
}

impl Candidates {
    /// Candidates without those that lie where another of the same order does.
    pub(super) fn distinct(candidates: Vec<Candidate>) -> Self {
        let mut found = Self { all: Vec::with_capacity(candidates.len()), numbers: FxHashMap::default() };
        for candidate in candidates {
            if let Some(same) = found.number(candidate.order, candidate.position) {
                found.all[same].cone = found.all[same].cone.with(&candidate.cone);
                continue;
            }
            let cell = key(cell(candidate.position, 0.0), candidate.order);
            found.numbers.entry(cell).or_default().push(found.all.len());
            found.all.push(candidate);
        }
        let mut order: Vec<usize> = (0..found.all.len()).collect();
        order.sort_by_key(|i| found.all[*i].order);
        let mut moved = vec![0; order.len()];
        order.iter().enumerate().for_each(|(to, from)| moved[*from] = to);
        found.numbers.values_mut().flatten().for_each(|number| *number = moved[*number]);
        found.all = order.iter().map(|i| found.all[*i]).collect();
        found
    }

    pub(super) fn get(&self, number: usize) -> Option<&Candidate> {
        self.all.get(number)
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &Candidate> {
        self.all.iter()
    }

    /// The one of an order at a place.
    pub(super) fn at(&self, order: u32, position: DVec3) -> Option<&Candidate> {
        self.number(order, position).map(|number| &self.all[number])
    }

    fn number(&self, order: u32, position: DVec3) -> Option<usize> {
        let (low, high) = (cell(position, -0.25), cell(position, 0.25));
        let near = |number: &&usize| self.all[**number].position.distance_squared(position) <= SAME_IMAGE_M * SAME_IMAGE_M;
        let in_cell = |at: [i64; 3]| self.numbers.get(&key(at, order))?.iter().find(near).copied();
        // Nearly always it is one cell; what lies within a quarter of a cell is in one of the cells of the corners.
        if low == high {
            return in_cell(low);
        }
        (0..8).find_map(|corner| in_cell(std::array::from_fn(|a| if (corner >> a) & 1 == 0 { low[a] } else { high[a] })))
    }
}

fn cell(position: DVec3, shift: f64) -> [i64; 3] {
    (position / (4.0 * SAME_IMAGE_M) + shift).floor().to_array().map(|c| c as i64)
}

fn key([x, y, z]: [i64; 3], order: u32) -> [i64; 4] {
    [x, y, z, i64::from(order)]
}
