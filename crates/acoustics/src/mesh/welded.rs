//! Which triangles of a mesh hang together.

use super::Mesh;
use glam::DVec3;
use rustc_hash::FxHashMap;

/// Corners nearer to each other than this share of the mesh's diagonal are one.
const WELD: f64 = 1e-5;

/// A mesh whose corners at one place are one vertex.
pub(super) struct Welded {
    /// Places of the vertices, metres.
    pub(super) places: Vec<DVec3>,
    /// Numbers of the vertices of each triangle.
    pub(super) corners: Vec<[u32; 3]>,
    /// Triangles that share an edge with each.
    pub(super) beside: Vec<Vec<u32>>,
}

impl Welded {
    pub(super) fn new(mesh: &Mesh) -> Self {
        let [low, high] = mesh.bounds().map(DVec3::from_array);
        let cell = (WELD * low.distance(high)).max(f64::MIN_POSITIVE);
        let mut numbers: FxHashMap<[i64; 3], u32> = FxHashMap::default();
        let mut places = Vec::new();
        let mut weld = |v: DVec3| {
            let key = ((v - low) / cell).round().to_array().map(|c| c as i64);
            *numbers.entry(key).or_insert_with(|| {
                places.push(v);
                places.len() as u32 - 1
            })
        };
        let corners: Vec<[u32; 3]> = mesh.triangles.iter().map(|t| mesh.corners(t).map(&mut weld)).collect();
        let mut edges: FxHashMap<[u32; 2], Vec<u32>> = FxHashMap::default();
        for (number, corners) in (0_u32..).zip(&corners) {
            for k in 0..3 {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                edges.entry([a.min(b), a.max(b)]).or_default().push(number);
            }
        }
        let mut beside = vec![Vec::new(); corners.len()];
        for on in edges.values() {
            // Of an edge that very many share, neighbours in the list.
            let near = if on.len() <= 8 { on.len() } else { 2 };
            for (i, a) in on.iter().enumerate() {
                for b in on.iter().skip(i + 1).take(near).filter(|b| *b != a) {
                    beside[*a as usize].push(*b);
                    beside[*b as usize].push(*a);
                }
            }
        }
        beside.iter_mut().for_each(|all| all.sort_unstable());
        Self { places, corners, beside }
    }

    /// Half of the cross product of two sides of a triangle: its normal, as long as its area.
    pub(super) fn area(&self, triangle: usize) -> DVec3 {
        let [a, b, c] = self.corners[triangle].map(|v| self.places[v as usize]);
        0.5 * (b - a).cross(c - a)
    }
}
