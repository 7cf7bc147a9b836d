//! Facets of curved walls, which mirror no more than what falls within them of a wave's first Fresnel zone.

use super::Room;
use glam::DVec3;
use std::collections::HashMap;

/// Neighbours whose normals differ by less than this continue a curve; the cosine of 40 degrees.
const SMOOTH: f64 = 0.77;
/// An edge runs along an extent if the cosine between both is greater.
const ALONG: f64 = 0.7;

impl Room {
    /// Of each plane the lengths in two directions across it at whose ends a curved wall goes on, metres; infinite where none
    /// does. Nothing where there is no curved wall.
    pub(crate) fn facets(&self) -> Vec<[f64; 2]> {
        let mut extents = vec![[DVec3::INFINITY, DVec3::NEG_INFINITY]; self.planes.len()];
        let mut axes = vec![DVec3::ZERO; self.planes.len()];
        let corners = |leaf: &super::Leaf| {
            [leaf.corner, leaf.corner - leaf.edges[0], leaf.corner + leaf.edges[1]].map(|corner| corner.as_dvec3())
        };
        // The longest edge of a plane is one direction, the other is across it.
        for leaf in &self.leaves {
            let [a, b, c] = corners(leaf);
            let axis = &mut axes[leaf.plane as usize];
            for edge in [b - a, c - b, a - c] {
                if edge.length() > axis.length() {
                    *axis = edge;
                }
            }
        }
        let frames: Vec<[DVec3; 2]> = axes
            .iter()
            .zip(&self.planes)
            .map(|(axis, plane)| {
                let along = axis.normalize_or_zero();
                [along, plane.normal.cross(along)]
            })
            .collect();
        let weld = |v: DVec3| (v / (10.0 * self.skin())).round().to_array().map(|c| c as i64);
        let mut edges: HashMap<[[i64; 3]; 2], Vec<(u32, DVec3)>> = HashMap::new();
        for leaf in &self.leaves {
            let corners = corners(leaf);
            let [along, across] = frames[leaf.plane as usize];
            let [low, high] = &mut extents[leaf.plane as usize];
            for (k, corner) in corners.iter().enumerate() {
                let at = DVec3::new(along.dot(*corner), across.dot(*corner), 0.0);
                (*low, *high) = (low.min(at), high.max(at));
                let next = corners[(k + 1) % 3];
                let mut key = [weld(*corner), weld(next)];
                key.sort_unstable();
                edges.entry(key).or_default().push((leaf.plane, (next - *corner).normalize_or_zero()));
            }
        }
        let mut facets = vec![[f64::INFINITY; 2]; self.planes.len()];
        for sides in edges.values() {
            let [(a, direction), (b, _)] = sides[..] else { continue };
            let between = self.planes[a as usize].normal.dot(self.planes[b as usize].normal).abs();
            if a == b || between < SMOOTH {
                continue;
            }
            for plane in [a, b].map(|plane| plane as usize) {
                let ([along, across], [low, high]) = (frames[plane], extents[plane]);
                let size = high - low;
                if along.dot(direction).abs() > ALONG {
                    facets[plane][1] = size.y;
                }
                if across.dot(direction).abs() > ALONG {
                    facets[plane][0] = size.x;
                }
            }
        }
        if facets.iter().flatten().all(|size| size.is_infinite()) { Vec::new() } else { facets }
    }
}
