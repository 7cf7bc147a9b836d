//! A fitted room as a mesh, and the materials of its groups.

use crate::error::FitError;
use crate::fits::FullFit;
use crate::measurements::Measurements;
use crate::room::{FlatRoom, Form, WALLS, Walls};
use promenade_acoustics::{Directivity, Mesh, Octaves, fibonacci};
use promenade_core::glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt::Write;

/// Materials of a mesh's groups as `simulate` understands them, in a file beside the mesh.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct MaterialsBeside {
    /// How they were made, for readers.
    pub made: String,
    /// By group: absorption and scattering with a colon between, each bands as
    /// `HZ@SHARE` with slashes between.
    pub materials: BTreeMap<String, String>,
    /// The source, where the fit has found what it sends.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<SourceBeside>,
}

/// A source as a fit has found it.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SourceBeside {
    /// The place that it faces from wherever it stands, metres; without it, it stands as the room does.
    pub faces_m: Option<[f64; 3]>,
    /// Directions in its own axes, x ahead and z up, and the amplitudes that it sends there by octave from 125 Hz.
    pub sends: Vec<([f64; 3], Octaves)>,
}

/// Directions in which a file states what a source sends.
const DIRECTIONS: usize = 256;

impl MaterialsBeside {
    /// Of a fit, for the groups of its mesh.
    ///
    /// # Errors
    /// A source that is not finite.
    pub fn of(fit: &FullFit, set: &Measurements, made: &str) -> Result<Self, FitError> {
        Ok(Self { made: made.to_owned(), materials: fit.materials(), source: Some(SourceBeside::of(fit, set)?) })
    }
}

impl SourceBeside {
    fn of(fit: &FullFit, set: &Measurements) -> Result<Self, FitError> {
        let directivity = fit.directivity()?;
        let sends = (0..DIRECTIONS).map(|i| if i == 0 { [1.0, 0.0, 0.0] } else { fibonacci(i, DIRECTIONS) });
        let sends = sends.map(|towards| (towards, directivity.towards(towards))).collect();
        let lines = set.all.iter().filter_map(|m| Some((DVec3::from(m.source.at_m), DVec3::from(m.source.facing?))));
        Ok(Self { faces_m: meeting(&lines.collect::<Vec<_>>()).map(|at| at.to_array()), sends })
    }

    /// What it sends where, and the yaw and the pitch in degrees that it faces from a place.
    ///
    /// # Errors
    /// Amplitudes that are no directivity.
    pub fn directivity(&self, from_m: [f64; 3]) -> Result<(Directivity, [f64; 2]), FitError> {
        let way = self.faces_m.map_or(DVec3::X, |faces| DVec3::from(faces) - DVec3::from(from_m));
        let facing = [way.y.atan2(way.x), way.z.atan2(way.truncate().length())].map(f64::to_degrees);
        Ok((Directivity::measured(&self.sends)?, facing))
    }
}

/// The place that is nearest to all lines, places with directions of unit length; far along them where they are parallel.
fn meeting(lines: &[(DVec3, DVec3)]) -> Option<DVec3> {
    const PULL: f64 = 1e-6;
    let (at, along) = lines.first()?;
    let pull = PULL * lines.len() as f64;
    let mut sum = DMat3::from_diagonal(DVec3::splat(pull));
    let mut side = pull * (*at + 1000.0 * *along);
    for (at, along) in lines {
        let across = DMat3::IDENTITY - DMat3::from_cols(along.x * *along, along.y * *along, along.z * *along);
        sum += across;
        side += across * *at;
    }
    Some(sum.inverse() * side)
}

/// The group of patches of a surface that are of one of its materials.
pub(super) fn patch_group(surface: &str, number: usize) -> String {
    format!("{surface}.{}", number + 1)
}

/// The mesh of a full fit: a group for each surface, or for each material of its patches, `x0.1`.
///
/// # Errors
/// A box without a volume.
pub fn full_mesh(fit: &FullFit) -> Result<Mesh, FitError> {
    let Some(own) = &fit.voxels else { return fit.room.mesh() };
    let (of, _) = own.materials(fit.room.surfaces.len());
    Ok(own.voxels.mesh(|p| patch_group(&fit.room.surfaces[own.voxels.patches[p].surface], of[p])))
}

/// A room as a text in the format OBJ, metres, a group for each surface.
pub(super) fn room_obj(room: &FlatRoom) -> String {
    match &room.form {
        Form::Box(walls) => box_obj(walls),
        Form::Mesh(mesh) => mesh.to_obj(),
    }
}

/// The box as a mesh of twelve triangles in a group for each wall, as a text in the format OBJ, metres.
#[must_use]
pub fn box_obj(walls: &Walls) -> String {
    let mut text = String::from("# a fitted room; its materials are in the file beside it\n");
    let coordinate = |i: usize, a: usize| if (i >> a) & 1 == 1 { walls.high_m[a] } else { walls.low_m[a] };
    for i in 0..8 {
        let _ = writeln!(text, "v {:.5} {:.5} {:.5}", coordinate(i, 0), coordinate(i, 1), coordinate(i, 2));
    }
    for (w, name) in WALLS.iter().enumerate() {
        let axis = w / 2;
        let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
        let base = if w % 2 == 1 { 1 << axis } else { 0 };
        // Faces look inwards.
        let corners =
            if w % 2 == 0 { [base, base + u, base + u + v, base + v] } else { [base, base + v, base + u + v, base + u] };
        let [a, b, c, d] = corners.map(|i| i + 1);
        let _ = writeln!(text, "usemtl {name}\nf {a} {b} {c}\nf {a} {c} {d}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_meet_where_all_are_nearest_and_parallel_ones_far_away() {
        let line = |at: DVec3, to: DVec3| (at, (to - at).normalize());
        let place = DVec3::new(2.0, -1.0, 1.2);
        let all = [DVec3::ZERO, DVec3::new(4.0, 3.0, 1.0), DVec3::new(-2.0, 2.0, 2.0)].map(|at| line(at, place));
        assert!(meeting(&all).unwrap().distance(place) < 0.01);
        let alike = [(DVec3::ZERO, DVec3::Y), (DVec3::ZERO, DVec3::Y)];
        assert!((meeting(&alike).unwrap().normalize() - DVec3::Y).length() < 1e-3);
        assert_eq!(meeting(&[]), None);
    }

    #[test]
    fn the_mesh_is_a_closed_box_that_looks_inwards() {
        let walls = Walls { low_m: [-0.1, 0.0, 0.2], high_m: [4.0, 3.0, 2.7] };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("room.obj");
        std::fs::write(&path, box_obj(&walls)).unwrap();
        let mesh = promenade_acoustics::Mesh::load(&path).unwrap();
        assert_eq!(mesh.groups, WALLS);
        assert!(mesh.report().warnings().is_empty(), "{:?}", mesh.report().warnings());
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.corners.map(|v| mesh.vertices[v as usize]);
            let edge = |p: [f64; 3], q: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| q[i] - p[i]) };
            let (u, v) = (edge(a, b), edge(a, c));
            let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
            let inwards: f64 = (0..3).map(|i| normal[i] * (0.5 * (walls.low_m[i] + walls.high_m[i]) - a[i])).sum();
            assert!(inwards > 0.0);
        }
    }
}
