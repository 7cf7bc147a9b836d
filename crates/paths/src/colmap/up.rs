//! Which way is up in a reconstruction.

use super::Image;
use crate::PathFileError;
use glam::{DMat3, DVec3};

/// How much the cameras' mean up counts against their left-right axes: as if one holds a camera level to 3 degrees, in radians
/// squared.
const MEAN_WEIGHT: f64 = 0.003;

/// The direction of up in the reconstruction's world, from cameras that were held level: their mean up, turned so that their
/// left-right axes lie as level as they can.
///
/// The mean alone leans where all cameras look down at one thing from one side.
pub(super) fn of(file: &str, images: &[Image], notes: &mut Vec<String>) -> Result<DVec3, PathFileError> {
    let count = images.len() as f64;
    let mean = images.iter().map(|i| i.head_axes()[2]).sum::<DVec3>() / count;
    if mean.length() < 0.1 {
        let found = "cameras whose up points everywhere";
        return Err(PathFileError::content(file, "cameras that were held upright, or the option up", found));
    }
    // Least squares: minimise the mean square of (left . up) plus MEAN_WEIGHT |up - mean|^2.
    let outer = |v: DVec3| DMat3::from_cols(v * v.x, v * v.y, v * v.z);
    let levels = images.iter().map(|i| outer(i.head_axes()[1])).fold(DMat3::ZERO, |a, b| a + b) * count.recip();
    let up = ((levels + DMat3::from_diagonal(DVec3::splat(MEAN_WEIGHT))).inverse() * mean).normalize();
    let roll = images.iter().map(|i| i.head_axes()[1].dot(up).powi(2)).sum::<f64>() / count;
    let lean = up.angle_between(mean).to_degrees();
    notes.push(format!(
        "up is {:.3},{:.3},{:.3} in the reconstruction's world, as the cameras were held: they roll by {:.1} degrees rms, and \
         it is {lean:.1} \
         degrees off their mean up; the option up says otherwise",
        up.x,
        up.y,
        up.z,
        roll.sqrt().asin().to_degrees(),
    ));
    Ok(up)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::waypoint::from_degrees;
    use glam::DQuat;

    /// Cameras of these yaws, pitches and rolls in a world whose up is `up`.
    fn cameras(up: DVec3, angles: &[[f64; 3]]) -> Vec<Image> {
        let tilt = DQuat::from_rotation_arc(DVec3::Z, up);
        let head_to_camera = DMat3::from_cols(DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y);
        let image = |ypr: &[f64; 3]| Image {
            id: 0,
            name: String::new(),
            camera: 1,
            rotation: DQuat::from_mat3(&(head_to_camera * DMat3::from_quat((tilt * from_degrees(*ypr)).inverse()))),
            translation: DVec3::ZERO,
        };
        angles.iter().map(image).collect()
    }

    #[test]
    fn cameras_that_look_down_from_one_side_do_not_tilt_the_world() {
        let up = DVec3::new(0.1, -0.9, 0.3).normalize();
        let angles: Vec<[f64; 3]> = (-6..=6).map(|i| [f64::from(i) * 12.0, -30.0, 0.0]).collect();
        let images = cameras(up, &angles);
        let mean = images.iter().map(|i| i.head_axes()[2]).sum::<DVec3>().normalize();
        let found = of("images.txt", &images, &mut Vec::new()).unwrap();
        assert!(mean.angle_between(up).to_degrees() > 15.0, "the mean leans");
        assert!(found.angle_between(up).to_degrees() < 3.0, "{}", found.angle_between(up).to_degrees());
    }

    #[test]
    fn one_camera_is_level() {
        let up = DVec3::new(0.0, -1.0, 0.0);
        let found = of("images.txt", &cameras(up, &[[30.0, 0.0, 0.0]]), &mut Vec::new()).unwrap();
        assert!(found.angle_between(up) < 1e-6);
    }

    #[test]
    fn cameras_all_over_have_no_up() {
        let images = cameras(DVec3::Z, &[[0.0, 0.0, 0.0], [0.0, 0.0, 180.0]]);
        let error = of("images.txt", &images, &mut Vec::new()).unwrap_err().to_string();
        assert!(error.contains("or the option up, found cameras whose up points everywhere"), "{error}");
    }
}
