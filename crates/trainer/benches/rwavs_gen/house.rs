//! Made rooms: what they are, and what a scan of them with default materials gives.

use promenade_core::glam::Vec3;
use promenade_core::random::Random;
use std::collections::BTreeMap;
use std::fmt::Write;

/// Materials of a scan, of which nothing is known.
pub(crate) const DEFAULT_MATERIALS: &str = "*=0.2";
/// A scan is larger than the room by this, as of a reconstruction whose unit was measured wrong.
const SCAN_SCALE: f32 = 1.02;
/// Standard deviation of a scan's vertices, and the longest edge of its facets, metres.
const SCAN_NOISE_M: f32 = 0.03;
const SCAN_EDGE_M: f32 = 1.2;
/// Height of the listener's ears, metres, and how far the head is turned to and fro along the walk, degrees.
const EARS_M: f32 = 1.55;
const TURN_DEG: f32 = 100.0;

/// A block from its lowest corner to its highest, metres.
type Block = [[f32; 3]; 2];

/// A room.
pub(crate) struct Room {
    /// Name, of which folders and rows are named.
    pub(crate) name: &'static str,
    air: &'static [Block],
    furniture: &'static [Block],
    /// Emitters, metres.
    pub(crate) emitters: [[f32; 3]; 4],
    /// What the true room's groups are made of.
    pub(crate) materials: &'static str,
    /// Corners of the listener's walk, metres.
    walk: &'static [[f32; 2]],
}

/// Three rooms with two doors between them, and one room.
pub(crate) const ROOMS: [Room; 2] = [
    Room {
        name: "house",
        air: &[
            [[0.0, 0.0, 0.0], [5.2, 4.4, 2.6]],
            [[5.2, 1.0, 0.0], [5.4, 1.9, 2.05]],
            [[5.4, 0.0, 0.0], [8.4, 3.2, 2.6]],
            [[5.2, 3.45, 0.0], [5.4, 4.3, 2.05]],
            [[5.4, 3.4, 0.0], [8.4, 4.4, 2.6]],
        ],
        furniture: &[
            [[1.6, 2.6, 0.0], [3.0, 3.4, 0.75]],
            [[0.0, 1.2, 0.0], [0.9, 2.4, 0.6]],
            [[7.8, 0.4, 0.0], [8.4, 2.0, 2.0]],
        ],
        emitters: [[0.7, 0.7, 1.4], [4.4, 3.7, 1.2], [6.4, 2.6, 1.3], [7.7, 3.9, 1.5]],
        materials: "floor=0.07/0.08/0.1/0.12/0.15/0.2/0.25,wall=0.12/0.09/0.06/0.05/0.05/0.06/0.08,\
                    ceiling=0.2/0.15/0.1/0.08/0.07/0.07/0.08,furniture=0.15/0.25/0.4/0.5/0.55/0.55/0.55:0.5",
        walk: &[[1.3, 1.0], [4.2, 0.9], [4.5, 1.45], [6.2, 1.45], [7.2, 1.2], [6.0, 1.5], [4.6, 1.6], [4.5, 3.2], [3.6, 3.8]],
    },
    Room {
        name: "office",
        air: &[[[0.0, 0.0, 0.0], [6.1, 4.6, 2.8]]],
        furniture: &[
            [[1.0, 3.0, 0.0], [2.6, 3.8, 0.75]],
            [[3.6, 3.0, 0.0], [5.2, 3.8, 0.75]],
            [[5.6, 0.3, 0.0], [6.1, 2.0, 1.9]],
        ],
        emitters: [[0.6, 0.7, 1.4], [4.9, 4.2, 1.2], [5.0, 0.8, 1.3], [0.7, 4.0, 1.5]],
        materials: "floor=0.05/0.08/0.15/0.25/0.35/0.4/0.45,wall=0.1/0.08/0.06/0.05/0.05/0.06/0.08,\
                    ceiling=0.3/0.4/0.5/0.55/0.6/0.55/0.5,furniture=0.12/0.1/0.08/0.07/0.07/0.08/0.1:0.4",
        walk: &[[1.2, 1.2], [3.0, 0.8], [5.0, 1.5], [5.1, 2.5], [3.1, 2.4], [3.1, 3.9], [3.0, 2.2], [1.0, 2.3], [1.2, 1.2]],
    },
];

impl Room {
    pub(crate) fn named(name: &str) -> Option<&'static Self> {
        ROOMS.iter().find(|room| room.name == name)
    }

    /// Corners of the box around it, metres.
    pub(crate) fn bounds(&self) -> [Vec3; 2] {
        let corners = |i: usize| self.air.iter().map(move |block| Vec3::from(block[i]));
        [corners(0).fold(Vec3::MAX, Vec3::min), corners(1).fold(Vec3::MIN, Vec3::max)]
    }

    /// The true mesh as OBJ; groups are the floor, the walls, the ceiling and furniture.
    pub(crate) fn mesh(&self) -> String {
        self.surfaces(f32::INFINITY).obj(|at| at)
    }

    /// What a scan gives: facets cut small, whose vertices are off by noise, all in one group.
    pub(crate) fn scan(&self, seed: u64) -> String {
        let mut random = Random::new(seed);
        let mut noise =
            move |at: Vec3| SCAN_SCALE * at + SCAN_NOISE_M * Vec3::new(random.normal(), random.normal(), random.normal());
        let mut surfaces = self.surfaces(SCAN_EDGE_M);
        surfaces.quads.iter_mut().for_each(|(group, _)| *group = "scan");
        surfaces.obj(&mut noise)
    }

    /// So many points on the scan's surfaces, which INRAS lets the sound bounce at: corners of its facets.
    pub(crate) fn points(&self, count: usize, seed: u64) -> Vec<Vec3> {
        let scan = self.scan(seed);
        let corner = |line: &str| {
            let numbers: Vec<f32> = line.strip_prefix("v ")?.split(' ').filter_map(|n| n.parse().ok()).collect();
            (numbers.len() == 3).then(|| Vec3::from_slice(&numbers))
        };
        let corners: Vec<Vec3> = scan.lines().filter_map(corner).collect();
        Random::new(seed).order(corners.len()).into_iter().take(count).map(|i| corners[i]).collect()
    }

    /// The listener's walk as rows of a path, from corner to corner.
    pub(crate) fn walk(&self) -> String {
        let mut out = "t,x,y,z,yaw,pitch,roll\n".to_owned();
        let mut seconds = 0.0;
        for (i, [x, y]) in self.walk.iter().enumerate() {
            let yaw = TURN_DEG * if i % 2 == 0 { 1.0 } else { -1.0 } + 35.0 * i as f32;
            let _ = writeln!(out, "{seconds:.3},{x},{y},{EARS_M},{:.1},0,0", (yaw + 180.0).rem_euclid(360.0) - 180.0);
            if let Some([next, other]) = self.walk.get(i + 1) {
                seconds += (next - x).hypot(other - y);
            }
        }
        out
    }

    fn surfaces(&self, edge_m: f32) -> Surfaces {
        let blocks = || self.air.iter().chain(self.furniture);
        let planes = [0, 1, 2].map(|axis| planes(blocks().flatten().map(|corner| corner[axis]), edge_m));
        let inside = |block: &Block, at: [f32; 3]| (0..3).all(|i| block[0][i] < at[i] && at[i] < block[1][i]);
        let fill = |cell: [i64; 3]| {
            let within = |i: usize| (0..planes[i].len() as i64 - 1).contains(&cell[i]);
            if !(0..3).all(within) {
                return Fill::Wall;
            }
            let at = [0, 1, 2].map(|i| 0.5 * (planes[i][cell[i] as usize] + planes[i][cell[i] as usize + 1]));
            let is_in = |block: &Block| inside(block, at);
            match (self.air.iter().any(is_in), self.furniture.iter().any(is_in)) {
                (true, false) => Fill::Air,
                (true, true) => Fill::Furniture,
                (false, _) => Fill::Wall,
            }
        };
        let counts = [0, 1, 2].map(|axis| planes[axis].len() as i64 - 1);
        let mut quads = Vec::new();
        for cell in (0..counts.iter().product()).map(|i| [i % counts[0], i / counts[0] % counts[1], i / counts[0] / counts[1]])
        {
            if fill(cell) != Fill::Air {
                continue;
            }
            for (axis, step) in [0, 1, 2].into_iter().flat_map(|axis| [(axis, -1), (axis, 1)]) {
                let mut next = cell;
                next[axis] += step;
                let group = match (fill(next), axis, step) {
                    (Fill::Air, ..) => continue,
                    (Fill::Furniture, ..) => "furniture",
                    (Fill::Wall, 2, -1) => "floor",
                    (Fill::Wall, 2, _) => "ceiling",
                    (Fill::Wall, ..) => "wall",
                };
                quads.push((group, corners(cell, axis, step)));
            }
        }
        Surfaces { planes, quads }
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Fill {
    Air,
    Furniture,
    Wall,
}

/// Quads between planes; each corner is a number of a plane along each axis.
struct Surfaces {
    planes: [Vec<f32>; 3],
    quads: Vec<(&'static str, [[i64; 3]; 4])>,
}

impl Surfaces {
    fn obj(&self, mut moved: impl FnMut(Vec3) -> Vec3) -> String {
        let mut numbers = BTreeMap::new();
        let (mut vertices, mut facets, mut last) = (String::new(), String::new(), "");
        let mut quads = self.quads.clone();
        quads.sort_by_key(|(group, _)| *group);
        for (group, corners) in quads {
            if group != last {
                let _ = writeln!(facets, "g {group}");
                last = group;
            }
            let of = corners.map(|corner| {
                let next = numbers.len() + 1;
                *numbers.entry(corner).or_insert_with(|| {
                    let at = moved(Vec3::from([0, 1, 2].map(|axis| self.planes[axis][corner[axis] as usize])));
                    let _ = writeln!(vertices, "v {} {} {}", at.x, at.y, at.z);
                    next
                })
            });
            // Two triangles, as corners that are moved lie in no plane.
            let _ = writeln!(facets, "f {0} {1} {2}\nf {0} {2} {3}", of[0], of[1], of[2], of[3]);
        }
        vertices + &facets
    }
}

/// Where surfaces lie along an axis, and planes between them, so that none are farther from each other than an edge.
fn planes(at: impl Iterator<Item = f32>, edge_m: f32) -> Vec<f32> {
    let mut sorted: Vec<f32> = at.collect();
    sorted.sort_by(f32::total_cmp);
    sorted.dedup();
    let between = |pair: &[f32]| {
        let parts = ((pair[1] - pair[0]) / edge_m).ceil().max(1.0);
        let (low, step) = (pair[0], (pair[1] - pair[0]) / parts);
        (0..parts as usize).map(move |i| low + step * i as f32)
    };
    let inner: Vec<f32> = sorted.windows(2).flat_map(between).collect();
    inner.into_iter().chain(sorted.last().copied()).collect()
}

/// Corners of a cell's side, so that it looks into the cell.
fn corners(cell: [i64; 3], axis: usize, step: i64) -> [[i64; 3]; 4] {
    let (along, across) = ((axis + 1) % 3, (axis + 2) % 3);
    let corner = |[a, b]: [i64; 2]| {
        let mut at = cell;
        at[axis] += i64::from(step > 0);
        at[along] += a;
        at[across] += b;
        at
    };
    let turn = [[0, 0], [1, 0], [1, 1], [0, 1]];
    if step < 0 { turn.map(corner) } else { [0, 3, 2, 1].map(|i| corner(turn[i])) }
}
