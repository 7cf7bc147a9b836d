//! Flat pieces of a mesh, and how they scatter by their size.

use super::welded::Welded;
use super::{Mesh, Triangle, normal};
use crate::materials::curve::Curve;
use crate::materials::material::Material;
use crate::octave::OCTAVES_HZ;
use glam::{DVec2, DVec3};
use std::collections::HashMap;

/// Least cosine of the angle between triangles of one piece.
const FLAT: f64 = 0.9998;
/// Directions in which the narrowest rectangle about a piece is looked for, in a quarter of a turn.
const TURNS: usize = 45;
/// Mean square of the cosine of what comes from everywhere.
const COSINE2: f64 = 0.5;
/// Steps of scattering, so that pieces of about the same size have one material.
const STEP: f32 = 0.02;

impl Mesh {
    /// Gives each flat piece of a group, of triangles that hang together, what it scatters because it is small beside the wave
    /// (C. L. Christensen and J. H. Rindel, "A new scattering method that combines roughness and diffraction effects", Forum
    /// Acusticum 2005): of the energy that it reflects, it sends on as a mirror the share `K_w K_l` beside what its material
    /// does, `K` being 1 above `c a / (2 x^2 cos^2)` and falling by 3 dB an octave below it, for its width and its length `x`,
    /// where `a` is the characteristic distance of the ways before and after it. Here `a` is the mean free path, and the square
    /// of the cosine is its mean, a half. Pieces are as wide as the narrowest rectangle about them. What their edges scatter
    /// beside that is left out.
    ///
    /// Groups are then pieces of about one size, with the names of their groups. Returns their materials.
    #[must_use]
    pub fn scatter_by_size(&mut self, materials: &[Material], free_path_m: f64, speed_m_s: f64) -> Vec<Material> {
        let mut found: HashMap<(u32, [u16; OCTAVES_HZ.len()]), u32> = HashMap::new();
        let (mut kept, mut names) = (Vec::new(), Vec::new());
        let pieces = self.pieces();
        let mut triangles = std::mem::take(&mut self.triangles);
        for piece in pieces {
            let group = triangles[piece[0]].group;
            // What has no area meets no ray.
            let size = self.piece_size(piece.iter().map(|t| &triangles[*t])).unwrap_or([f64::MAX; 2]);
            let mirrored = |hz: f32| -> f64 {
                let share = |x: f64| f64::from(hz) / (speed_m_s * free_path_m / (2.0 * x * x * COSINE2));
                size.into_iter().map(|x| share(x).min(1.0)).product()
            };
            let of = &materials[group as usize];
            let scattering: [f32; OCTAVES_HZ.len()] = std::array::from_fn(|b| {
                let kept = (1.0 - of.scattering[b]) * mirrored(OCTAVES_HZ[b]) as f32;
                // A whole wall scatters exactly as its material.
                if kept >= 1.0 - of.scattering[b] { of.scattering[b] } else { ((1.0 - kept) / STEP).round() * STEP }
            });
            let key = scattering.map(|s| (s / STEP).round() as u16);
            let number = *found.entry((group, key)).or_insert_with(|| {
                kept.push(Material {
                    scattering: scattering.map(|s| s.clamp(0.0, 1.0)),
                    fine: [of.fine[0].clone(), Curve::default()],
                    ..of.clone()
                });
                names.push(self.groups[group as usize].clone());
                kept.len() as u32 - 1
            });
            piece.iter().for_each(|t| triangles[*t].group = number);
        }
        self.triangles = triangles;
        self.groups = names;
        kept
    }

    /// Triangles by the flat piece that they are in.
    fn pieces(&self) -> Vec<Vec<usize>> {
        let welded = Welded::new(self);
        let normals: Vec<Option<DVec3>> = self.triangles.iter().map(|t| normal_of(self.corners(t))).collect();
        let together = |a: usize, b: usize| {
            let flat = normals[a].zip(normals[b]).is_none_or(|(a, b)| a.dot(b).abs() > FLAT);
            flat && self.triangles[a].group == self.triangles[b].group
        };
        let mut taken = vec![false; self.triangles.len()];
        let mut pieces = Vec::new();
        for start in 0..self.triangles.len() {
            if std::mem::replace(&mut taken[start], true) {
                continue;
            }
            let mut piece = vec![start];
            let mut at = 0;
            while let Some(from) = piece.get(at).copied() {
                for next in welded.beside[from].iter().map(|t| *t as usize).filter(|t| together(from, *t)) {
                    if !std::mem::replace(&mut taken[next], true) {
                        piece.push(next);
                    }
                }
                at += 1;
            }
            pieces.push(piece);
        }
        pieces
    }

    /// Width and length of the narrowest rectangle about triangles of a plane, metres; none where they have no area.
    fn piece_size<'a>(&self, triangles: impl Iterator<Item = &'a Triangle> + Clone) -> Option<[f64; 2]> {
        let upright = triangles.clone().find_map(|t| normal_of(self.corners(t)))?;
        let (along, across) = upright.any_orthonormal_pair();
        let points: Vec<DVec2> =
            triangles.flat_map(|t| self.corners(t)).map(|p| DVec2::new(p.dot(along), p.dot(across))).collect();
        let rectangle = |turn: usize| {
            let axis = DVec2::from_angle(std::f64::consts::FRAC_PI_2 * turn as f64 / TURNS as f64);
            [axis, axis.perp()].map(|axis| {
                let range = points
                    .iter()
                    .map(|p| p.dot(axis))
                    .fold([f64::INFINITY, f64::NEG_INFINITY], |r, x| [r[0].min(x), r[1].max(x)]);
                range[1] - range[0]
            })
        };
        let narrowest = (0..TURNS).map(rectangle).min_by(|a, b| (a[0] * a[1]).total_cmp(&(b[0] * b[1])))?;
        let [a, b] = narrowest;
        Some([a.min(b), a.max(b)])
    }
}

fn normal_of([a, b, c]: [DVec3; 3]) -> Option<DVec3> {
    normal(a, b, c)
}
