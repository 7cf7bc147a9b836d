//! Sequences of planes that a source is mirrored in.

use super::ImageOptions;
use super::cone::Cone;
use crate::lattice::direction;
use crate::ray::Ray;
use crate::room::Room;
use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Most images of one order that are made without a beam.
const MOST_EXACT: usize = 16_384;
/// A beam's half angle, times the radius of a circle of its share of the sphere; 1.4 leaves no gap between beams.
const OVERLAP: f64 = 1.4;
/// Images nearer to each other than this, metres, are one. On flat walls they differ by rounding only.
const SAME_IMAGE_M: f64 = 1e-5;
/// End of a sequence, or a beam that has left the room.
const NOTHING: u32 = u32::MAX;

/// An image that somebody may see.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    pub(super) position: DVec3,
    pub(super) order: u32,
    /// Where from it, is who may see it.
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
    pub(super) fn grow_along(mut self, room: &Room, options: &ImageOptions) -> Vec<Candidate> {
        let order = options.order as usize;
        let mut steps = vec![(NOTHING, DVec3::ZERO); options.beams * order];
        if order > 0 {
            let source = self.nodes[0].position;
            steps.par_chunks_mut(order).with_min_len(256).enumerate().for_each(|(i, steps)| {
                let mut ray = Ray::new(source, direction(i, options.beams));
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
        let half_angle = OVERLAP * 2.0 / (options.beams as f64).sqrt();
        let mut cones: Vec<(Cone, f64)> = self.nodes.iter().map(|node| node.cone()).map(|cone| (cone, 1.0)).collect();
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
    fn cone(&self) -> Cone {
        match self.beams {
            Beams::Unasked => Cone::EVERYWHERE,
            Beams::Towards(sum) => Cone::new(sum, 0.0),
        }
    }
}

/// Candidates without those that lie where another of the same order does, in order.
pub(super) fn distinct(candidates: Vec<Candidate>) -> Vec<Candidate> {
    let mut found: FxHashMap<[i64; 4], usize> = FxHashMap::default();
    let mut all: Vec<Candidate> = Vec::with_capacity(candidates.len());
    for candidate in candidates {
        let cell = |shift: f64| (candidate.position / (4.0 * SAME_IMAGE_M) + shift).floor().to_array().map(|c| c as i64);
        let (low, high) = (cell(-0.25), cell(0.25));
        let keys = (0..8).map(|corner| {
            let [x, y, z] = std::array::from_fn(|a| if (corner >> a) & 1 == 0 { low[a] } else { high[a] });
            [x, y, z, i64::from(candidate.order)]
        });
        // Who lies within a quarter of a cell is in one of the cells of the corners.
        if let Some(same) = keys.clone().find_map(|key| found.get(&key)) {
            all[*same].cone = all[*same].cone.with(&candidate.cone);
            continue;
        }
        let [x, y, z] = cell(0.0);
        found.insert([x, y, z, i64::from(candidate.order)], all.len());
        all.push(candidate);
    }
    all.sort_by_key(|c| c.order);
    all
}
