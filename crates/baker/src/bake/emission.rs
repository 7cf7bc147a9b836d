//! What a source sends where, as a scene has it.

use promenade_acoustics::{Mesh, Source};
use promenade_core::glam::{DMat3, DVec3, Mat3};
use promenade_core::{Axis, Emission};
use promenade_room::{Played, PlayedImage};
use std::f32::consts::PI;

/// Directions that it is stored for, 10 degrees apart: what is sent is smooth over 30.
const ELEVATIONS: usize = 19;
const AZIMUTHS: usize = 36;

/// What a source sends to a listener and to the images that are played; `None` where that is the same in all directions.
pub(super) fn emission(mesh: &Mesh, source: &Source, played: &Played) -> Option<Emission> {
    if source.directivity.is_omni() {
        return None;
    }
    let elevation = Axis::uniform(-0.5 * PI, PI / (ELEVATIONS - 1) as f32, ELEVATIONS);
    let azimuth = Axis::circle(-PI, AZIMUTHS);
    let sent = |up: f32, around: f32| {
        let [(up, level), (left, ahead)] = [up, around].map(|angle| f64::from(angle).sin_cos());
        source.directivity.towards([level * ahead, level * left, up]).map(f32::ln)
    };
    let around = |up: &f32| azimuth.nodes().iter().map(|around| sent(*up, *around)).collect::<Vec<_>>();
    let levels = elevation.nodes().iter().flat_map(around).collect();
    let turns = played.images.iter().map(|image| leaving(mesh, image)).collect();
    Some(Emission { elevation, azimuth, levels, turns })
}

/// What makes the way from an image to a listener the way on which its sound has left the source: the walls' mirrors, the last
/// one first.
fn leaving(mesh: &Mesh, image: &PlayedImage) -> Mat3 {
    let mirror = |face: &u32| {
        let [a, b, c] = mesh.triangles[*face as usize].corners.map(|corner| DVec3::from(mesh.vertices[corner as usize]));
        let normal = (b - a).cross(c - a).normalize_or_zero();
        DMat3::IDENTITY - 2.0 * DMat3::from_cols(normal.x * normal, normal.y * normal, normal.z * normal)
    };
    image.faces.iter().fold(DMat3::IDENTITY, |turn, face| turn * mirror(face)).as_mat3()
}
