//! The tree of bounding volumes that rays are searched in.

use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::bvh2_to_cwbvh::bvh2_to_cwbvh;
use std::ops::Range;

/// Places along an axis at which a group of volumes may be divided.
const BINS: usize = 16;
/// Levels on which groups are divided where that is best; below it they are halved, so that the tree ends.
const BEST_LEVELS: u32 = 40;
/// Triangles that a leaf has at most, as the tree's form allows.
const LEAF: u32 = 3;

/// The tree over volumes, in time that grows as their number times its logarithm, however they lie.
///
/// Clustered from below, as the crate does it, volumes that each hold the one before make a chain that is deeper than a search
/// goes: the lids of a cylinder of many facets.
pub(super) fn tree(bounds: &[Aabb]) -> CwBvh {
    if bounds.is_empty() { CwBvh::default() } else { bvh2_to_cwbvh(&divided(bounds), LEAF, true, false) }
}

/// A binary tree from above, divided where the surface heuristic says so (Wald 2007, "On fast construction of SAH-based
/// bounding volume hierarchies").
fn divided(bounds: &[Aabb]) -> Bvh2 {
    let count = bounds.len();
    let mut order: Vec<u32> = (0..count as u32).collect();
    let mut nodes = vec![Bvh2Node::default(); 2 * count - 1];
    let mut free = 1;
    let mut waiting = vec![(0, 0..count, 0)];
    while let Some((node, range, level)) = waiting.pop() {
        let own = &mut order[range.clone()];
        let all = own.iter().fold(Aabb::empty(), |all, i| all.union(&bounds[*i as usize]));
        if own.len() == 1 {
            nodes[node] = Bvh2Node::new(all, 1, range.start as u32);
            continue;
        }
        let best = if level < BEST_LEVELS { division(own, bounds) } else { None };
        let middle = range.start + best.unwrap_or(own.len() / 2);
        nodes[node] = Bvh2Node::new(all, 0, free as u32);
        waiting.push((free, range.start..middle, level + 1));
        waiting.push((free + 1, middle..range.end, level + 1));
        free += 2;
    }
    Bvh2 { nodes, primitive_indices: order, children_are_ordered_after_parents: true, ..Bvh2::default() }
}

/// Sorts volumes into two groups and returns how many are in the first; `None` where their middles do not tell them apart.
fn division(order: &mut [u32], bounds: &[Aabb]) -> Option<usize> {
    let middle = |i: u32| bounds[i as usize].center();
    let (low, high) = order.iter().fold((Vec3A::INFINITY, Vec3A::NEG_INFINITY), |(low, high), i| {
        let at = middle(*i);
        (low.min(at), high.max(at))
    });
    let size = high - low;
    let axis = if size.x >= size.y && size.x >= size.z { 0 } else { 1 + usize::from(size.z > size.y) };
    if size[axis] <= 0.0 {
        return None;
    }
    let scale = BINS as f32 / size[axis];
    let bin = |i: u32| (((middle(i)[axis] - low[axis]) * scale) as usize).min(BINS - 1);
    let mut bins = [(Aabb::empty(), 0_usize); BINS];
    for i in &*order {
        let (volume, count) = &mut bins[bin(*i)];
        *volume = volume.union(&bounds[*i as usize]);
        *count += 1;
    }
    // The cost of those before each place, then with that of those behind it.
    let part = |range: Range<usize>| {
        let all = bins[range].iter().fold((Aabb::empty(), 0), |(volume, n), (v, c)| (volume.union(v), n + c));
        if all.1 > 0 { all.0.half_area() * all.1 as f32 } else { 0.0 }
    };
    let cost = |place: usize| part(0..place) + part(place..BINS);
    let place = (1..BINS).min_by(|a, b| cost(*a).total_cmp(&cost(*b)))?;
    let mut first = 0;
    for i in 0..order.len() {
        if bin(order[i]) < place {
            order.swap(first, i);
            first += 1;
        }
    }
    (first > 0 && first < order.len()).then_some(first)
}
