//! Rooms that tests and benches share, and an oracle.

#![allow(dead_code, reason = "each test uses some of them")]
#![allow(unreachable_pub, reason = "shared between test binaries")]

use glam::DVec3;
use promenade_acoustics::{Material, Mesh, Shoebox, Triangle};

pub const SOURCE: [f64; 3] = [3.1, 2.3, 1.9];
pub const LISTENERS: [[f64; 3]; 5] = [[1.0, 1.0, 1.0], [6.1, 4.2, 1.3], [5.2, 0.9, 2.4], [2.2, 3.9, 0.7], [3.4, 2.6, 1.5]];

pub fn shoebox(absorption: f32, scattering: f32) -> Shoebox {
    Shoebox { size: [7.0, 5.0, 3.0], materials: std::array::from_fn(|_| Material::even("wall", absorption, scattering)) }
}

/// A prism of `height` over a plan whose corners go round to the left, faces inwards; `caps` are triangles of the plan.
fn prism(plan: &[[f64; 2]], caps: &[[u32; 3]], height: f64) -> Mesh {
    let n = plan.len() as u32;
    let at = |z: f64| plan.iter().map(move |p| [p[0], p[1], z]);
    let mut triangles = Vec::new();
    for i in 0..n {
        let (a, b) = (i, (i + 1) % n);
        triangles.extend([[b, a, a + n], [b, a + n, b + n]].map(|corners| Triangle { corners, group: 0 }));
    }
    for [a, b, c] in caps {
        triangles.push(Triangle { corners: [*a, *b, *c], group: 0 });
        triangles.push(Triangle { corners: [a + n, c + n, b + n], group: 0 });
    }
    Mesh { vertices: at(0.0).chain(at(height)).collect(), triangles, groups: vec!["wall".into()] }
}

pub const L_SOURCE: [f64; 3] = [1.3, 4.9, 1.2];
pub const L_LISTENERS: [[f64; 3]; 2] = [[5.1, 1.4, 1.6], [2.1, 1.1, 1.4]];

/// Two arms of 3 m width and 6 m length, 2.7 m high.
pub fn l_room() -> Mesh {
    let plan = [[0.0, 0.0], [6.0, 0.0], [6.0, 3.0], [3.0, 3.0], [3.0, 6.0], [0.0, 6.0]];
    prism(&plan, &[[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]], 2.7)
}

/// Two rooms of 4 x 4 m with a doorway of .9 m in the wall of .4 m between them.
pub fn two_rooms() -> Mesh {
    let first = [[0.0, 0.0], [4.0, 0.0], [4.0, 1.5]];
    let second = [[4.4, 1.5], [4.4, 0.0], [8.4, 0.0], [8.4, 4.0], [4.4, 4.0], [4.4, 2.4]];
    let plan = [&first[..], &second, &[[4.0, 2.4], [4.0, 4.0], [0.0, 4.0]]].concat();
    let rooms = [[0, 1, 2], [0, 2, 9], [0, 9, 10], [0, 10, 11], [6, 7, 8], [6, 8, 3], [6, 3, 4], [6, 4, 5]];
    prism(&plan, &[&rooms[..], &[[2, 3, 8], [2, 8, 9]]].concat(), 2.5)
}

/// A box whose walls are grids of `2 * steps * steps` triangles each, moved by up to `bump` metres.
pub fn bumpy(size: [f64; 3], steps: u32, bump: f64) -> Mesh {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for wall in 0..6 {
        let (axis, far) = (wall / 2, wall % 2 == 1);
        let first = vertices.len() as u32;
        for i in 0..=steps {
            for j in 0..=steps {
                let mut v = [0.0; 3];
                let inner = i > 0 && j > 0 && i < steps && j < steps;
                let height = if inner { bump * (0.5 + 0.5 * f64::from(i * 37 + j * 91 + wall as u32 * 13).sin()) } else { 0.0 };
                v[axis] = if far { size[axis] - height } else { height };
                v[(axis + 1) % 3] = size[(axis + 1) % 3] * f64::from(i) / f64::from(steps);
                v[(axis + 2) % 3] = size[(axis + 2) % 3] * f64::from(j) / f64::from(steps);
                vertices.push(v);
            }
        }
        for i in 0..steps {
            for j in 0..steps {
                let at = |i: u32, j: u32| first + i * (steps + 1) + j;
                let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
                triangles.extend([[a, b, c], [a, c, d]].map(|corners| Triangle { corners, group: 0 }));
            }
        }
    }
    Mesh { vertices, triangles, groups: vec!["wall".into()] }
}

/// The positions of all images up to an order that a listener sees in a closed room whose faces look inwards, by trying every
/// sequence of planes and every triangle on every piece of its way (Borish 1984). Slow, and in double precision throughout.
pub fn seen(mesh: &Mesh, source: [f64; 3], listener: [f64; 3], order: u32) -> Vec<(u32, DVec3)> {
    let corner = |i: u32| DVec3::from_array(mesh.vertices[i as usize]);
    let triangles: Vec<[DVec3; 3]> = mesh.triangles.iter().map(|t| t.corners.map(corner)).collect();
    let mut planes: Vec<(DVec3, f64, Vec<[DVec3; 3]>)> = Vec::new();
    for t in &triangles {
        let normal = (t[1] - t[0]).cross(t[2] - t[0]).normalize();
        let offset = normal.dot(t[0]);
        match planes.iter_mut().find(|p| p.0.dot(normal) > 1.0 - 1e-9 && (p.1 - offset).abs() < 1e-9) {
            Some(plane) => plane.2.push(*t),
            None => planes.push((normal, offset, vec![*t])),
        }
    }
    let mut oracle = Oracle { triangles, planes, listener: listener.into(), found: Vec::new(), order };
    oracle.try_all(&mut vec![(usize::MAX, source.into())]);
    let mut distinct: Vec<(u32, DVec3)> = Vec::new();
    for image in oracle.found {
        if !distinct.iter().any(|d| d.0 == image.0 && d.1.distance(image.1) < 1e-6) {
            distinct.push(image);
        }
    }
    distinct
}

struct Oracle {
    triangles: Vec<[DVec3; 3]>,
    planes: Vec<(DVec3, f64, Vec<[DVec3; 3]>)>,
    listener: DVec3,
    found: Vec<(u32, DVec3)>,
    order: u32,
}

impl Oracle {
    fn try_all(&mut self, images: &mut Vec<(usize, DVec3)>) {
        let (last, position) = images[images.len() - 1];
        if self.sees(images) {
            self.found.push((images.len() as u32 - 1, position));
        }
        if images.len() as u32 > self.order {
            return;
        }
        for plane in (0..self.planes.len()).filter(|p| *p != last) {
            let (normal, offset, _) = &self.planes[plane];
            let height = normal.dot(position) - offset;
            // Only what is on the inner side of a wall is mirrored by it.
            if height > 0.0 {
                images.push((plane, position - 2.0 * height * normal));
                self.try_all(images);
                images.pop();
            }
        }
    }

    fn sees(&self, images: &[(usize, DVec3)]) -> bool {
        let mut here = self.listener;
        for (plane, image) in images.iter().skip(1).rev() {
            let (normal, offset, wall) = &self.planes[*plane];
            let (from, to) = (normal.dot(here) - offset, normal.dot(*image) - offset);
            if from <= 1e-9 || to >= 0.0 {
                return false;
            }
            let there = here + (*image - here) * (from / (from - to));
            if !wall.iter().any(|t| inside(t, there, *normal)) || self.blocked(here, there) {
                return false;
            }
            here = there;
        }
        !self.blocked(here, images[0].1)
    }

    fn blocked(&self, from: DVec3, to: DVec3) -> bool {
        self.triangles.iter().any(|t| {
            let normal = (t[1] - t[0]).cross(t[2] - t[0]).normalize();
            let (a, b) = (normal.dot(from - t[0]), normal.dot(to - t[0]));
            a.abs() > 1e-7 && b.abs() > 1e-7 && a * b < 0.0 && inside(t, from + (to - from) * (a / (a - b)), normal)
        })
    }
}

fn inside(t: &[DVec3; 3], point: DVec3, normal: DVec3) -> bool {
    (0..3).all(|i| (t[(i + 1) % 3] - t[i]).cross(point - t[i]).dot(normal) >= -1e-9)
}
