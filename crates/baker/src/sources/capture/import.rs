//! What a data set does not say; its cameras and sounds.

use crate::sources::file;
use crate::{BakeError, resample, sound};
use promenade_core::Pose;
use promenade_core::glam::{Mat3, Quat, Vec3};
use promenade_core::network::Placement;
use promenade_paths::PlacementOptions;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;

/// Bytes that a file of cameras may have.
pub(super) const MAX_BYTES: u64 = 256 << 20;
/// How far the columns of a rotation may be from unit length and right angles.
const ROTATION_SLACK: f32 = 0.02;

/// What a data set does not say.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImportCapture {
    /// Name of the place.
    pub title: String,
    /// Whom to credit.
    pub credit: String,
    /// Terms of the data.
    pub licence: String,
    /// Samples per second of the capture; without it what the layout's publications use.
    pub sample_rate_hz: Option<u32>,
    /// Where the sound came from, metres in the capture's world.
    pub emitter: Option<Vec3>,
    /// Where the data's world lies in the capture's; without up as the layout has it.
    pub placement: PlacementOptions,
}

impl ImportCapture {
    /// Takes heads from the data's world into the capture's, and says where the one lies in the other; `up` is the layout's.
    pub(super) fn place<Name>(&self, up: Vec3, heads: &mut BTreeMap<Name, Pose>) -> Result<Placement, BakeError> {
        let options = PlacementOptions { up: self.placement.up.or(Some(up)), ..self.placement };
        let placement = options.over(&Placement::IDENTITY, &heads.values().copied().collect::<Vec<_>>())?;
        heads.values_mut().for_each(|head| *head = placement.pose(head));
        Ok(placement)
    }
}

/// A camera in a `cameras.json` or `gs_cameras.json`; other fields are not read.
#[derive(Deserialize)]
struct Camera {
    img_name: String,
    /// Centre in the reconstruction's world.
    position: [f32; 3],
    /// Rows of the rotation from camera axes, x right, y down, z forward, to the world's.
    rotation: [[f32; 3]; 3],
}

/// Heads at the places of cameras in their own world, by the names of their images without ending.
pub(super) fn cameras(path: &Path) -> Result<BTreeMap<String, Pose>, BakeError> {
    let mut heads = BTreeMap::new();
    for camera in file::json::<Vec<Camera>>(path, MAX_BYTES)? {
        let rotation = Mat3::from_cols_array_2d(&camera.rotation).transpose();
        let entry = || format!("camera {}", camera.img_name);
        let head = head(Vec3::from_array(camera.position), rotation).ok_or_else(|| {
            let found = format!("{:?} and {:?}", camera.position, camera.rotation);
            BakeError::entry(path, entry(), "a finite position and a rotation", found)
        })?;
        if heads.insert(stem(&camera.img_name).to_owned(), head).is_some() {
            return Err(BakeError::entry(path, entry(), "each image once", "it twice"));
        }
    }
    Ok(heads)
}

/// A head that looks where a camera does, from the camera's centre and its axes as columns: x right, y down, z forward. `None`
/// where they are no rotation.
pub(super) fn head(centre: Vec3, camera_to_world: Mat3) -> Option<Pose> {
    let product = camera_to_world.transpose() * camera_to_world;
    let off = (product - Mat3::IDENTITY).to_cols_array().into_iter().fold(0.0_f32, |m, v| m.max(v.abs()));
    if !(off <= ROTATION_SLACK && camera_to_world.determinant() > 0.0 && centre.is_finite()) {
        return None;
    }
    let [right, down, ahead] = [camera_to_world.x_axis, camera_to_world.y_axis, camera_to_world.z_axis];
    Some(Pose { position: centre, orientation: Quat::from_mat3(&Mat3::from_cols(ahead, -right, -down)).normalize() })
}

/// A name without its folders and its ending.
pub(super) fn stem(name: &str) -> &str {
    let file = name.rsplit(['/', '\\']).next().unwrap_or(name);
    file.rsplit_once('.').map_or(file, |(stem, _)| stem)
}

/// A file's channels at another rate.
pub(super) fn channels(path: &Path, rate_hz: u32) -> Result<Vec<Vec<f32>>, BakeError> {
    let sound = sound::read(path)?;
    resample::signal(&sound.channels, sound.sample_rate_hz, rate_hz)
}

/// The mean of channels of one length.
#[must_use]
pub fn mean(channels: &[Vec<f32>]) -> Vec<f32> {
    let count = channels.len().max(1) as f32;
    (0..channels.first().map_or(0, Vec::len)).map(|i| channels.iter().map(|c| c[i]).sum::<f32>() / count).collect()
}

/// The two channels of a file.
pub(super) fn ears(path: &Path, rate_hz: u32) -> Result<[Vec<f32>; 2], BakeError> {
    let all = channels(path, rate_hz)?;
    let count = all.len();
    <[Vec<f32>; 2]>::try_from(all).map_err(|_| BakeError::content(path, "2 channels, left and right", count))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_becomes_the_head_that_becomes_the_camera() {
        let rotation = Quat::from_rotation_arc(Vec3::Z, Vec3::new(0.1, -2.0, 0.3).normalize());
        let placement = Placement { units_per_metre: 2.0, rotation, origin: Vec3::new(1.0, 2.0, 3.0) };
        let camera = Mat3::from_quat(Quat::from_rotation_y(0.7) * Quat::from_rotation_x(0.2));
        let centre = Vec3::new(-1.0, 0.5, 4.0);
        let back = placement.listener(&placement.pose(&head(centre, camera).unwrap()));
        assert!(
            (back.centre - centre).length() < 1e-5
                && (back.camera_to_world - camera).to_cols_array().iter().all(|v| v.abs() < 1e-5)
        );
        assert!(head(centre, 1.1 * camera).is_none() && head(centre, -camera).is_none());
        assert!(head(Vec3::NAN, camera).is_none() && head(centre, Mat3::ZERO).is_none());
    }
}
