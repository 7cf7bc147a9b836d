//! Surfaces in patches: what lies in one voxel of a wall has an absorption of its own.
//!
//! A mesh is cut where a lattice over its bounds cuts it, so that patches of walls that meet have the same corners. A
//! reflection has the mean of the patches about the place where it is mirrored, weighted by a Gaussian with the covariance of
//! its footprint, as the basis points of AV-DAR are (Jin et al. 2025): the first Fresnel zone at 4 kHz, longer along the path
//! of the sound.

use super::vectors::{cross, dot, less};
use super::wall::FlatWall;
use crate::error::FitError;
use promenade_acoustics::{Mesh, SPEED_OF_SOUND_M_S, Triangle};
use std::collections::{BTreeMap, HashMap};

/// Patches at most.
pub const MOST_PATCHES: usize = 8000;
/// Wavelength whose Fresnel zone is the footprint, metres.
const WAVELENGTH_M: f64 = SPEED_OF_SOUND_M_S / 4000.0;
/// Standard deviations of a footprint that count, and the least cosine of a way to the normal.
const REACH: f64 = 2.5;
const LEAST_COSINE: f64 = 0.2;
/// Corners nearer than this are one, metres.
const SAME_M: f64 = 1e-5;

/// What of a wall lies in one voxel.
#[derive(Clone, Debug, PartialEq)]
pub struct Patch {
    /// Number of its surface, as of the room.
    pub surface: usize,
    /// Number of its wall.
    pub wall: usize,
    /// Its middle, metres.
    pub centre_m: [f64; 3],
    /// Square metres.
    pub area_m2: f64,
    /// Corners of its triangles, metres.
    pub corners_m: Vec<[f64; 3]>,
}

/// All surfaces in patches.
#[derive(Clone, Debug, PartialEq)]
pub struct Voxels {
    /// Edge of a voxel at most, metres.
    pub edge_m: f64,
    /// Patches.
    pub patches: Vec<Patch>,
    /// Patches of one wall that share an edge.
    pub neighbours: Vec<[u32; 2]>,
    /// The mesh in patches: groups are their numbers, without names.
    mesh: Mesh,
    of_wall: Vec<Vec<u32>>,
}

/// A reflection.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reflection {
    pub(crate) wall: usize,
    pub(crate) at_m: [f64; 3],
    /// Where the sound comes from, of unit length.
    pub(crate) along: [f64; 3],
    /// Metres to the source and to the microphone.
    pub(crate) ways_m: [f64; 2],
}

/// What of a convex polygon lies on one side of a plane across an axis.
fn clipped(polygon: &[[f64; 3]], axis: usize, at: f64, above: bool) -> Vec<[f64; 3]> {
    let sign = if above { 1.0 } else { -1.0 };
    let side = |p: &[f64; 3]| sign * (p[axis] - at);
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (a, b) in polygon.iter().zip(polygon.iter().cycle().skip(1)) {
        let (from, to) = (side(a), side(b));
        if from >= 0.0 {
            kept.push(*a);
        }
        if (from > 0.0 && to < 0.0) || (from < 0.0 && to > 0.0) {
            let share = from / (from - to);
            let mut cut: [f64; 3] = std::array::from_fn(|i| a[i] + share * (b[i] - a[i]));
            cut[axis] = at;
            kept.push(cut);
        }
    }
    kept
}

/// Corners of a flat polygon, metres.
type Polygon = Vec<[f64; 3]>;

/// Square metres, the sum of middles times areas, and the triangles of flat polygons, with their corners in a mesh.
fn triangles_of(polygons: &[Polygon], mesh: &mut Mesh, known: &mut HashMap<[i64; 3], u32>) -> (f64, [f64; 3], Vec<[u32; 3]>) {
    let (mut area, mut centre, mut triangles) = (0.0, [0.0; 3], Vec::new());
    for polygon in polygons {
        let corners: Vec<u32> = polygon
            .iter()
            .map(|p| {
                *known.entry(p.map(|c| (c / SAME_M).round() as i64)).or_insert_with(|| {
                    mesh.vertices.push(*p);
                    mesh.vertices.len() as u32 - 1
                })
            })
            .collect();
        for pair in corners[1..].windows(2) {
            let corners = [corners[0], pair[0], pair[1]];
            let [a, b, c] = corners.map(|c| mesh.vertices[c as usize]);
            let twice = cross(less(b, a), less(c, a));
            let own = 0.5 * dot(twice, twice).sqrt();
            if own < 1e-9 {
                continue;
            }
            area += own;
            (0..3).for_each(|i| centre[i] += own * (a[i] + b[i] + c[i]) / 3.0);
            triangles.push(corners);
        }
    }
    (area, centre, triangles)
}

impl Voxels {
    /// The surfaces of walls in voxels of an edge of at most `edge_m`; of each triangle of their mesh the wall.
    ///
    /// # Errors
    /// An edge that is not above 0, or more patches than [`MOST_PATCHES`].
    pub(super) fn new(walls: &[FlatWall], mesh: &Mesh, of_triangle: &[Option<u16>], edge_m: f64) -> Result<Self, FitError> {
        if !(edge_m.is_finite() && edge_m > 0.0) {
            return Err(FitError::argument("edge of voxels", "more than 0 m", edge_m));
        }
        let area: f64 = walls.iter().map(|w| w.area_m2).sum();
        if area / edge_m.powi(2) > 4.0 * MOST_PATCHES as f64 {
            let found = format!("some {:.0} of {edge_m} m", area / edge_m.powi(2));
            return Err(FitError::argument("voxels", format!("at most {MOST_PATCHES}"), found));
        }
        let [low, high] = mesh.bounds();
        let step: [f64; 3] = std::array::from_fn(|a| {
            let length = (high[a] - low[a]).max(1e-3);
            length / (length / edge_m - 1e-6).ceil().max(1.0)
        });
        // The cell of a coordinate; what lies on the border of two is of the upper one.
        let cell = |a: usize, v: f64| ((v - low[a]) / step[a] + 1e-6).floor() as i64;
        let mut found: BTreeMap<(usize, [i64; 3]), Vec<Polygon>> = BTreeMap::new();
        for (t, wall) in mesh.triangles.iter().zip(of_triangle) {
            let Some(wall) = wall else { continue };
            let mut pieces = vec![(t.corners.map(|c| mesh.vertices[c as usize]).to_vec(), [0_i64; 3])];
            for a in 0..3 {
                let mut next = Vec::new();
                for (polygon, place) in pieces {
                    let least = polygon.iter().map(|p| p[a]).fold(f64::INFINITY, f64::min);
                    let most = polygon.iter().map(|p| p[a]).fold(f64::NEG_INFINITY, f64::max);
                    let first = cell(a, least);
                    let last = cell(a, most - 4e-6 * step[a]).max(first);
                    for k in first..=last {
                        let mut own = polygon.clone();
                        if k > first {
                            own = clipped(&own, a, low[a] + k as f64 * step[a], true);
                        }
                        if k < last {
                            own = clipped(&own, a, low[a] + (k + 1) as f64 * step[a], false);
                        }
                        let mut place = place;
                        place[a] = k;
                        next.push((own, place));
                    }
                }
                pieces = next;
            }
            for (polygon, place) in pieces.into_iter().filter(|(p, _)| p.len() >= 3) {
                found.entry((usize::from(*wall), place)).or_default().push(polygon);
            }
        }
        Self::of_polygons(walls, edge_m, found.into_iter().map(|((wall, _), polygons)| (wall, polygons)))
    }

    fn of_polygons(
        walls: &[FlatWall],
        edge_m: f64,
        all: impl Iterator<Item = (usize, Vec<Polygon>)>,
    ) -> Result<Self, FitError> {
        let mut known: HashMap<[i64; 3], u32> = HashMap::new();
        let mut mesh = Mesh::default();
        let mut patches: Vec<Patch> = Vec::new();
        let mut of_wall = vec![Vec::new(); walls.len()];
        let mut edges: BTreeMap<(u32, u32), u32> = BTreeMap::new();
        let mut neighbours = Vec::new();
        for (wall, polygons) in all {
            let (area, centre, triangles) = triangles_of(&polygons, &mut mesh, &mut known);
            if triangles.is_empty() {
                continue;
            }
            let number = patches.len() as u32;
            let mut corners: Vec<u32> = triangles.iter().flatten().copied().collect();
            corners.sort_unstable();
            corners.dedup();
            for [a, b, c] in &triangles {
                for (from, to) in [(a, b), (b, c), (c, a)] {
                    let other = edges.insert((*from.min(to), *from.max(to)), number);
                    let same = |other: &u32| *other != number && patches[*other as usize].wall == wall;
                    neighbours.extend(other.filter(same).map(|other| [other, number]));
                }
            }
            mesh.triangles.extend(triangles.into_iter().map(|corners| Triangle { corners, group: number }));
            of_wall[wall].push(number);
            patches.push(Patch {
                surface: walls[wall].surface,
                wall,
                centre_m: centre.map(|c| c / area),
                area_m2: area,
                corners_m: corners.iter().map(|c| mesh.vertices[*c as usize]).collect(),
            });
        }
        // A diagonal may cut an edge in two.
        neighbours.sort_unstable();
        neighbours.dedup();
        if patches.is_empty() || patches.len() > MOST_PATCHES {
            return Err(FitError::argument("voxels", format!("1 to {MOST_PATCHES}"), patches.len()));
        }
        Ok(Self { edge_m, patches, neighbours, mesh, of_wall })
    }

    /// Patches with their shares of a reflection, which add up to 1.
    pub(crate) fn shares(&self, of: &Reflection, wall: &FlatWall) -> Vec<(u16, f64)> {
        let [from, to] = of.ways_m;
        let zone = 0.25 * WAVELENGTH_M * from * to / (from + to).max(1e-9);
        let upright = dot(of.along, wall.normal);
        let flat: [f64; 3] = std::array::from_fn(|i| of.along[i] - upright * wall.normal[i]);
        let long = dot(flat, flat).max(1e-12).sqrt();
        let variance = zone + 0.25 * self.edge_m.powi(2);
        let longer = zone * (upright.abs().max(LEAST_COSINE).powi(-2) - 1.0);
        let reach = REACH.powi(2) * (variance + longer);
        let mut shares = Vec::new();
        let (mut sum, mut nearest) = (0.0, (f64::INFINITY, 0));
        for number in &self.of_wall[of.wall] {
            let patch = &self.patches[*number as usize];
            let way = less(patch.centre_m, of.at_m);
            let far = dot(way, way);
            if far < nearest.0 {
                nearest = (far, *number);
            }
            if far < reach {
                let along = dot(way, flat) / long;
                let share = patch.area_m2 * (-0.5 * (far - longer / (variance + longer) * along * along) / variance).exp();
                sum += share;
                shares.push((*number as u16, share));
            }
        }
        if sum <= 0.0 {
            return vec![(nearest.1 as u16, 1.0)];
        }
        shares.iter_mut().for_each(|(_, s)| *s /= sum);
        shares
    }

    /// The mesh with patches in groups: `group` says the name of each.
    #[must_use]
    pub fn mesh(&self, group: impl Fn(usize) -> String) -> Mesh {
        let mut mesh = self.mesh.clone();
        let mut numbers: BTreeMap<String, u32> = BTreeMap::new();
        let of: Vec<u32> = (0..self.patches.len())
            .map(|p| {
                let next = numbers.len() as u32;
                *numbers.entry(group(p)).or_insert(next)
            })
            .collect();
        mesh.triangles.iter_mut().for_each(|t| t.group = of[t.group as usize]);
        mesh.groups = vec![String::new(); numbers.len()];
        numbers.into_iter().for_each(|(name, number)| mesh.groups[number as usize] = name);
        mesh
    }

    /// Patches of the same wall within a distance of each, itself among them, the nearest first.
    pub(crate) fn around(&self, patch: usize, most: usize) -> Vec<u32> {
        let own = &self.patches[patch];
        let far = |other: &u32| {
            let way = less(self.patches[*other as usize].centre_m, own.centre_m);
            dot(way, way)
        };
        let mut near: Vec<(f64, u32)> = self.of_wall[own.wall].iter().map(|other| (far(other), *other)).collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        near.into_iter().take(most).map(|(_, other)| other).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::room::{FlatRoom, Walls};

    #[test]
    fn a_box_in_voxels_is_as_large_as_before_and_closed() {
        let room = FlatRoom::of_box(Walls::of_size([3.1, 2.0, 2.4]).unwrap()).unwrap();
        let voxels = room.patches(0.3).unwrap();
        let area: f64 = voxels.patches.iter().map(|p| p.area_m2).sum();
        assert!((area - 2.0 * (3.1 * 2.0 + 3.1 * 2.4 + 2.0 * 2.4)).abs() < 1e-6, "{area}");
        assert_eq!(voxels.patches.len(), 2 * (11 * 7 + 11 * 8 + 7 * 8));
        let mesh = voxels.mesh(|p| room.surfaces[voxels.patches[p].surface].clone());
        assert!(mesh.report().warnings().is_empty(), "{:?}", mesh.report().warnings());
        // Inner edges of a lattice of m by n: m (n - 1) + n (m - 1).
        let inner = |m: usize, n: usize| m * (n - 1) + n * (m - 1);
        assert_eq!(voxels.neighbours.len(), 2 * (inner(11, 7) + inner(11, 8) + inner(7, 8)));
    }

    #[test]
    fn a_footprint_is_about_the_place_and_longer_along_the_way() {
        let room = FlatRoom::of_box(Walls::of_size([6.0, 6.0, 3.0]).unwrap()).unwrap();
        let voxels = room.patches(0.25).unwrap();
        let slanting = [0.8, 0.0, -0.6];
        let of = Reflection { wall: 4, at_m: [3.1, 2.9, 0.0], along: slanting, ways_m: [2.0, 2.0] };
        let shares = voxels.shares(&of, &room.walls[4]);
        let mean = |f: &dyn Fn([f64; 3]) -> f64| -> f64 {
            shares.iter().map(|(p, s)| s * f(voxels.patches[usize::from(*p)].centre_m)).sum()
        };
        assert!((mean(&|_| 1.0) - 1.0).abs() < 1e-9);
        assert!((mean(&|c| c[0]) - 3.1).abs() < 0.03 && (mean(&|c| c[1]) - 2.9).abs() < 0.03);
        let (long, wide) = (mean(&|c| (c[0] - 3.1).powi(2)).sqrt(), mean(&|c| (c[1] - 2.9).powi(2)).sqrt());
        // Half the Fresnel zone of 0.29 m, with half a voxel.
        assert!((wide - 0.19).abs() < 0.03 && (1.15..1.6).contains(&(long / wide)), "{long} {wide}");
    }

    #[test]
    fn too_many_are_refused() {
        let room = FlatRoom::of_box(Walls::of_size([30.0, 20.0, 10.0]).unwrap()).unwrap();
        assert!(room.patches(0.1).unwrap_err().to_string().contains("at most 8000"));
        assert!(room.patches(0.0).is_err() && room.patches(f64::NAN).is_err());
    }
}
