//! What is odd about a mesh.

use super::{Mesh, normal};
use glam::DVec3;
use std::collections::HashMap;

/// Corners nearer to each other than this share of the mesh's diagonal are one.
const WELD: f64 = 1e-5;
/// Greatest lengths that a room has, metres; what is outside has another unit.
const LENGTHS_M: [f64; 2] = [1.0, 300.0];
/// Height from which a mesh is asked about: naves reach 48 m, and few domes more than this.
const HIGHEST_M: f64 = 60.0;
/// Metres of units that a mesh may have, and what they are called.
const UNITS: [(f64, &str); 5] =
    [(0.001, "millimetre"), (0.01, "centimetre"), (0.0254, "inch"), (0.3048, "foot"), (1000.0, "kilometre")];

/// Defects of a mesh, in numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshReport {
    /// Triangles of the mesh.
    pub triangles: usize,
    /// Triangles without an area, which reflect nothing.
    pub degenerate: usize,
    /// Triangles with the corners of an earlier one.
    pub duplicate: usize,
    /// Edges that only one triangle has: borders of holes, or where triangles meet whose corners do not.
    pub open_edges: usize,
    /// Length of the open edges together, metres.
    pub open_length_m: f64,
    /// Edges of more than two triangles.
    pub shared_edges: usize,
    /// Triangles that look the other way than most of those that they are joined to. Either side of a triangle reflects, so
    /// this is heard only in the volume.
    pub flipped: usize,
    /// Lengths along the axes, metres.
    pub size_m: [f64; 3],
    /// Area of one side of all triangles, square metres.
    pub area_m2: f64,
    /// Volume within, cubic metres, of a mesh without open edges.
    pub volume_m3: Option<f64>,
}

/// A triangle: numbers of its corners, those that lie together being one, and their places.
type Face = ([u32; 3], [DVec3; 3]);

/// Triangles that differ.
struct Faces {
    faces: Vec<Face>,
    degenerate: usize,
    duplicate: usize,
}

impl Mesh {
    /// The triangles that differ, with corners in one cell being one.
    fn faces(&self, low: DVec3, cell: f64) -> Faces {
        let mut numbers: HashMap<[i64; 3], u32> = HashMap::new();
        let mut weld = |v: DVec3| {
            let key = ((v - low) / cell).round().to_array().map(|c| c as i64);
            let next = numbers.len() as u32;
            *numbers.entry(key).or_insert(next)
        };
        let mut faces: Vec<Face> = Vec::new();
        let mut seen: HashMap<[u32; 3], ()> = HashMap::new();
        let (mut degenerate, mut duplicate) = (0, 0);
        for t in &self.triangles {
            let corners = self.corners(t);
            let welded = corners.map(&mut weld);
            let mut sorted = welded;
            sorted.sort_unstable();
            let [a, b, c] = corners;
            let apart = sorted[0] != sorted[1] && sorted[1] != sorted[2];
            if !apart || normal(a, b, c).is_none() {
                degenerate += 1;
            }
            if !apart {
                continue;
            }
            // One without an area still joins its neighbours.
            if seen.insert(sorted, ()).is_some() {
                duplicate += 1;
            } else {
                faces.push((welded, corners));
            }
        }
        Faces { faces, degenerate, duplicate }
    }

    /// Looks for leaks, triangles without an area or looking the other way, and sizes that no room has.
    #[must_use]
    pub fn report(&self) -> MeshReport {
        let [low, high] = self.bounds().map(DVec3::from_array);
        let cell = (WELD * low.distance(high)).max(f64::MIN_POSITIVE);
        let Faces { faces, degenerate, duplicate } = self.faces(low, cell);
        // Of each edge, its triangles and whether they go along it upwards.
        let mut edges: HashMap<[u32; 2], Vec<(usize, bool)>> = HashMap::new();
        let mut open_length_m = 0.0;
        let mut lengths: HashMap<[u32; 2], f64> = HashMap::new();
        for (i, (welded, corners)) in faces.iter().enumerate() {
            for k in 0..3 {
                let (a, b) = (welded[k], welded[(k + 1) % 3]);
                let key = [a.min(b), a.max(b)];
                edges.entry(key).or_default().push((i, a < b));
                lengths.insert(key, corners[k].distance(corners[(k + 1) % 3]));
            }
        }
        let open: Vec<&[u32; 2]> = edges.iter().filter(|(_, on)| on.len() == 1).map(|(key, _)| key).collect();
        open_length_m += open.iter().map(|key| lengths[*key]).sum::<f64>();
        let (turned, flipped) = turned(faces.len(), &edges);
        let volume: f64 = faces
            .iter()
            .zip(&turned)
            .map(|((_, [a, b, c]), turned)| {
                let six = (*a - low).dot((*b - low).cross(*c - low));
                if *turned { -six / 6.0 } else { six / 6.0 }
            })
            .sum();
        MeshReport {
            triangles: self.triangles.len(),
            degenerate,
            duplicate,
            open_edges: open.len(),
            open_length_m,
            shared_edges: edges.values().filter(|on| on.len() > 2).count(),
            flipped,
            size_m: (high - low).to_array(),
            area_m2: faces.iter().map(|(_, [a, b, c])| 0.5 * (*b - *a).cross(*c - *a).length()).sum(),
            volume_m3: open.is_empty().then_some(volume.abs()),
        }
    }
}

/// Which faces look the other way than the first one that they hang together with, and how many do against the rest.
fn turned(faces: usize, edges: &HashMap<[u32; 2], Vec<(usize, bool)>>) -> (Vec<bool>, usize) {
    let mut joined: Vec<Vec<(usize, bool)>> = vec![Vec::new(); faces];
    for on in edges.values() {
        if let [(a, up), (b, also_up)] = on[..] {
            // Neighbours that look the same way go along their edge in opposite directions.
            joined[a].push((b, up == also_up));
            joined[b].push((a, up == also_up));
        }
    }
    let mut turned: Vec<Option<bool>> = vec![None; faces];
    let mut flipped = 0;
    for start in 0..faces {
        if turned[start].is_some() {
            continue;
        }
        turned[start] = Some(false);
        let (mut waiting, mut count, mut against) = (vec![start], 0, 0);
        while let Some(face) = waiting.pop() {
            let here = turned[face] == Some(true);
            count += 1;
            against += usize::from(here);
            for (other, differs) in &joined[face] {
                if turned[*other].is_none() {
                    turned[*other] = Some(here != *differs);
                    waiting.push(*other);
                }
            }
        }
        flipped += against.min(count - against);
    }
    (turned.into_iter().map(|t| t == Some(true)).collect(), flipped)
}

impl MeshReport {
    /// What is said of a mesh that is as large as no room, with the scale of the unit that it may have.
    #[must_use]
    pub fn odd_size(&self) -> Option<String> {
        let longest = self.size_m.into_iter().fold(0.0, f64::max);
        let [x, y, z] = self.size_m;
        if (LENGTHS_M[0]..=LENGTHS_M[1]).contains(&longest) && z <= HIGHEST_M {
            return None;
        }
        let is_room = |scale: f64| (3.0..=60.0).contains(&(scale * longest)) && (1.8..=20.0).contains(&(scale * z));
        let unit = UNITS.into_iter().find(|(scale, _)| is_room(*scale)).map_or(String::new(), |(scale, name)| {
            let [x, y, z] = self.size_m.map(|length| scale * length);
            format!("; if its unit is the {name}, --scale {scale} makes it {x:.1} x {y:.1} x {z:.1} m")
        });
        Some(format!("the mesh is {x:.4} x {y:.4} x {z:.4} m, which no room is{unit}"))
    }

    /// What should be looked at, a sentence each; nothing for a mesh that is closed, clean and as large as a room.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        let mut found: Vec<String> = self.odd_size().into_iter().collect();
        if self.open_edges > 0 {
            found.push(format!(
                "{} edges, {:.2} m, have one triangle only: holes, or corners that do not meet",
                self.open_edges, self.open_length_m
            ));
        }
        if self.shared_edges > 0 {
            found.push(format!("{} edges have more than two triangles", self.shared_edges));
        }
        for (count, what) in [
            (self.degenerate, "have no area and are left out"),
            (self.duplicate, "are there twice"),
            (self.flipped, "look the other way than those that they are joined to"),
        ] {
            if count > 0 {
                found.push(format!("{count} of {} triangles {what}", self.triangles));
            }
        }
        found
    }
}
