//! Binaural responses of a box room: a mesh whose images need no search (Allen and Berkley, "Image method for efficiently
//! simulating small-room acoustics", J. Acoust. Soc. Am. 65, 1979).

use super::mesh_room::{Surfaces, simulate};
use super::{Hrtf, MeshOptions, Simulated};
use crate::BakeError;
use promenade_acoustics::{Images, Room, Shoebox, Source};
use promenade_core::Pose;
use promenade_core::glam::Vec3;
use promenade_room::SIZES_M;

/// Binaural responses of an emitter in a box for heads at `poses`, as [`simulate_mesh`](super::simulate_mesh) has them of its
/// mesh; [`MeshOptions::beams`] says nothing here.
///
/// # Errors
/// As `simulate_mesh`; a side outside [`SIZES_M`], a material with a share outside 0 to 1, an emitter or a pose outside the
/// box.
pub fn simulate_box(
    walls: &Shoebox,
    emitter: Vec3,
    hrtf: &Hrtf,
    poses: &[Pose],
    options: &MeshOptions,
    done: impl Fn(f64) + Sync,
) -> Result<Simulated, BakeError> {
    let size = Vec3::from_array(walls.size.map(|length| length as f32));
    if !walls.size.iter().all(|length| (SIZES_M.0..=SIZES_M.1).contains(length)) {
        let expected = format!("{} to {} m in each direction", SIZES_M.0, SIZES_M.1);
        return Err(BakeError::argument("size of the room", expected, size));
    }
    let inside = |at: Vec3| at.cmpgt(Vec3::ZERO).all() && at.cmplt(size).all();
    let expected = || format!("inside the room, between 0,0,0 and {size}");
    if !inside(emitter) {
        return Err(BakeError::argument("emitter", expected(), emitter));
    }
    if let Some((index, pose)) = poses.iter().enumerate().find(|(_, pose)| !inside(pose.position)) {
        return Err(BakeError::argument("listener", expected(), format!("pose {index} at {}", pose.position)));
    }
    let source = Source::from(emitter.as_dvec3().to_array());
    let mesh = walls.mesh()?;
    let room = Room::new(&mesh, &walls.materials)?;
    let images = Images::of_box(walls, source.clone(), options.order)?;
    let mut simulated = simulate(&Surfaces { mesh: &mesh, room: &room, images }, &source, hrtf, poses, options, done)?;
    let [x, y, z] = size.to_array();
    simulated.responses.title = format!("Box of {x} x {y} x {z} m");
    Ok(simulated)
}

#[cfg(test)]
mod tests;
