//! The cameras of a COLMAP model: `images.txt` or `images.bin`, as a path or as they are in the reconstruction's world.
//!
//! Models with rigs and frames hold each image's pose there too, so these two files are all that is read.

mod binary;
mod images;
mod names;
mod times;
mod up;

use crate::waypoint::{Places, Track, Waypoint};
use crate::{Format, ImportOptions, Origin, PathFileError, placing};
use glam::{DMat3, DQuat, DVec3, Vec3};
use promenade_core::Pose;

/// An image as COLMAP keeps it.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Name, relative to the folder of the images.
    pub name: String,
    /// Id of the camera that took it.
    pub camera: u32,
    /// Rotation from the reconstruction's world to the camera: x right, y down, z forward. Unit quaternion.
    pub rotation: DQuat,
    /// Translation from the world to the camera, the reconstruction's units.
    pub translation: DVec3,
}

/// Where a reconstruction comes to lie in the listener's world: z up, the origin as for a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct World {
    /// The listener's origin in the reconstruction's world, its units.
    pub centre: DVec3,
    /// Rotation from the reconstruction's axes to the listener's, unit quaternion.
    pub turn: DQuat,
}

impl Image {
    /// Centre of the camera in the reconstruction's world.
    #[must_use]
    pub fn centre(&self) -> DVec3 {
        -(self.rotation.inverse() * self.translation)
    }

    /// The camera's axes in the reconstruction's world, as those of a head: forward, left, up.
    fn head_axes(&self) -> [DVec3; 3] {
        [DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y].map(|axis| self.rotation.inverse() * axis)
    }

    /// A head that stands at the camera's centre and looks where it does, in the reconstruction's world.
    #[must_use]
    pub fn head(&self) -> Pose {
        let (position, orientation) = self.placed(DQuat::IDENTITY);
        Pose { position: position.as_vec3(), orientation: orientation.as_quat().normalize() }
    }

    /// Position and orientation of that head in a world turned so.
    fn placed(&self, turn: DQuat) -> (DVec3, DQuat) {
        let [ahead, left, up] = self.head_axes();
        (turn * self.centre(), (turn * DQuat::from_mat3(&DMat3::from_cols(ahead, left, up))).normalize())
    }
}

/// The images of a COLMAP model, by their names, numbers in them by their value.
///
/// # Errors
/// As [`crate::read()`], but images may be none. The message names the file and the place in it.
pub fn images(file: &str, bytes: &[u8]) -> Result<Vec<Image>, PathFileError> {
    match Format::of(file, bytes)? {
        format @ (Format::ColmapText | Format::ColmapBinary) => sorted(file, parse(file, bytes, format, &mut Vec::new())?),
        other => Err(PathFileError::content(file, "COLMAP's images.txt or images.bin", other.name())),
    }
}

/// Where the world of a reconstruction comes to lie by its cameras, the same as for a path of these images: `up` is a direction in the
/// reconstruction's world, without it as the cameras were held. What was assumed is added to `notes`.
///
/// # Errors
/// No images, or cameras that were held in all directions. `file` is for the message.
pub fn world(
    file: &str,
    images: &[Image],
    up: Option<Vec3>,
    origin: Origin,
    notes: &mut Vec<String>,
) -> Result<World, PathFileError> {
    let turn = upright(file, images, up, notes)?;
    let waypoints: Vec<Waypoint> = images
        .iter()
        .map(|image| {
            let (position, orientation) = image.placed(turn);
            Waypoint { t_s: 0.0, position, orientation }
        })
        .collect();
    let (centre, level) = placing::frame(&waypoints, origin);
    Ok(World { centre: turn.inverse() * centre, turn: (level * turn).normalize() })
}

/// The turn that brings up to z.
fn upright(file: &str, images: &[Image], up: Option<Vec3>, notes: &mut Vec<String>) -> Result<DQuat, PathFileError> {
    if images.is_empty() {
        return Err(PathFileError::content(file, "images with a pose", "none"));
    }
    let up = match up {
        Some(up) => up.as_dvec3().normalize(),
        None => up::of(file, images, notes)?,
    };
    // The same turn as that of an imported anchor cloud, so that both meet in one world when nothing else moves them.
    Ok(DQuat::from_rotation_arc(DVec3::Z, up).inverse())
}

fn parse(file: &str, bytes: &[u8], format: Format, notes: &mut Vec<String>) -> Result<Vec<Image>, PathFileError> {
    match format {
        Format::ColmapBinary => binary::read(file, bytes),
        _ => images::read(file, bytes, notes),
    }
}

fn sorted(file: &str, mut images: Vec<Image>) -> Result<Vec<Image>, PathFileError> {
    images.sort_by(|a, b| names::natural(&a.name, &b.name));
    match images.windows(2).find(|pair| pair[0].name == pair[1].name) {
        Some(twice) => Err(PathFileError::at(file, format!("image {}", twice[1].name), "each image once", "it twice")),
        None => Ok(images),
    }
}

pub(crate) fn read(file: &str, bytes: &[u8], format: Format, options: &ImportOptions) -> Result<Track, PathFileError> {
    let mut notes = Vec::new();
    let mut images = parse(file, bytes, format, &mut notes)?;
    if let Some(camera) = options.camera {
        let cameras = cameras(&images);
        images.retain(|i| i.camera == camera);
        if images.is_empty() {
            return Err(PathFileError::content(file, format!("images of camera {camera}"), cameras));
        }
    }
    if images.is_empty() {
        return Err(PathFileError::content(file, "images with a pose", "none"));
    }
    let images = sorted(file, images)?;
    let times = times::of(file, &images, options.fps, &mut notes)?;
    let turn = upright(file, &images, options.up, &mut notes)?;
    let waypoint = |(image, t_s): (&Image, f64)| {
        let (position, orientation) = image.placed(turn);
        Waypoint { t_s, position, orientation }
    };
    let waypoints = images.iter().zip(times).map(waypoint).collect();
    if options.scale.is_none() {
        notes.push(
            "the scale of a reconstruction is arbitrary: one unit is taken as 1 m; the option scale says otherwise".to_owned(),
        );
    }
    match options.origin {
        None => notes.push(format!("the first camera, {}, stands at the origin and looks along x", images[0].name)),
        Some(Origin::Centroid | Origin::First) => notes.push(format!("the first camera, {}, looks along x", images[0].name)),
        Some(Origin::Keep) => {}
    }
    let names = images.into_iter().map(|i| i.name).collect();
    Ok(Track { waypoints, places: Places::Images(names), notes })
}

/// The cameras and how many images each took, in words.
fn cameras(images: &[Image]) -> String {
    const SHOWN: usize = 8;
    let mut counts = std::collections::BTreeMap::<u32, usize>::new();
    for image in images {
        *counts.entry(image.camera).or_default() += 1;
    }
    let shown: Vec<String> = counts.iter().take(SHOWN).map(|(camera, count)| format!("{count} of camera {camera}")).collect();
    let more = counts.len().saturating_sub(SHOWN);
    shown.join(", ") + &if more > 0 { format!(" and {more} more cameras") } else { String::new() }
}

/// A rotation and a translation in COLMAP's order, checked.
fn image(file: &str, place: &str, name: String, camera: u32, pose: [f64; 7]) -> Result<Image, PathFileError> {
    let [w, x, y, z, tx, ty, tz] = pose;
    let rotation = crate::waypoint::unit([w, x, y, z])
        .map_err(|length| PathFileError::at(file, place, "a unit quaternion", format!("one of length {length}")))?;
    let translation = DVec3::new(tx, ty, tz);
    if !translation.is_finite() {
        return Err(PathFileError::at(file, place, "a finite translation", translation.to_string()));
    }
    Ok(Image { name, camera, rotation, translation })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Imported, alone};

    fn import(text: &str, options: &ImportOptions) -> Imported {
        crate::read("images.txt", text.as_bytes(), options, &mut alone).unwrap()
    }

    /// Level cameras in a world as that of a first camera: x right, y down, z ahead. The second stands 2 ahead of the first, 1 to
    /// its right and 0.5 above it, and is turned to the right by 90 degrees.
    const LEVEL: &str = "# Image list with two lines of data per image:\n\
        7 1 0 0 0 0 0 0 1 b_0010.jpg\n\
        1.5 2.5 -1\n\
        # a comment\n\
        3 0.7071067811865476 0 -0.7071067811865476 0 2 0.5 -1 1 b_0040.jpg\n\
        \n";

    #[test]
    fn a_camera_is_a_head_that_looks_where_it_does() {
        let imported = import(LEVEL, &ImportOptions::default());
        let [first, second] = imported.path.keyframes() else { panic!("{:?}", imported.path) };
        assert!(first.pose.position.length() < 1e-6 && (first.pose.orientation * Vec3::X - Vec3::X).length() < 1e-6);
        assert!((first.pose.orientation * Vec3::Z - Vec3::Z).length() < 1e-6);
        assert!((second.pose.position - Vec3::new(2.0, -1.0, 0.5)).length() < 1e-6, "{}", second.pose.position);
        assert!((second.pose.orientation * Vec3::X - Vec3::NEG_Y).length() < 1e-6, "it looks to the right");
        assert!((second.pose.orientation * Vec3::Z - Vec3::Z).length() < 1e-6, "and is level");
        assert!((imported.path.duration_s() - 30.0).abs() < 1e-9, "numbers in names are frames, one a second");
    }

    #[test]
    fn options_place_the_world() {
        let options = ImportOptions {
            up: Some(Vec3::new(0.0, -3.0, 0.0)),
            origin: Some(Origin::Keep),
            scale: Some(2.0),
            fps: Some(10.0),
            ..ImportOptions::default()
        };
        let path = import(LEVEL, &options).path;
        // Where an anchor cloud of the same reconstruction comes to lie with the same up and scale.
        let alignment = promenade_core::network::Alignment {
            scale: 0.5,
            rotation: glam::Quat::from_rotation_arc(Vec3::Z, Vec3::NEG_Y),
            translation: Vec3::ZERO,
        };
        let centre = Vec3::new(1.0, -0.5, 2.0);
        assert!((path.keyframes()[1].pose.position - alignment.to_world(centre)).length() < 1e-5);
        let listener = alignment.listener(&path.keyframes()[1].pose);
        assert!((listener.camera_to_world * Vec3::Z - Vec3::X).length() < 1e-5, "it looks along the world's x");
        assert!((path.duration_s() - 3.0).abs() < 1e-9);
        let centroid = ImportOptions { origin: Some(Origin::Centroid), ..ImportOptions::default() };
        let path = import(LEVEL, &centroid).path;
        assert!((path.keyframes()[0].pose.position - Vec3::new(-1.0, 0.5, -0.25)).length() < 1e-6);
    }

    #[test]
    fn a_reconstruction_lies_where_its_path_does() {
        for origin in Origin::ALL {
            let options = ImportOptions { origin: Some(origin), scale: Some(0.5), ..ImportOptions::default() };
            let path = import(LEVEL, &options).path;
            let images = images("images.txt", LEVEL.as_bytes()).unwrap();
            let world = world("images.txt", &images, None, origin, &mut Vec::new()).unwrap();
            for (image, keyframe) in images.iter().zip(path.keyframes()) {
                let position = 0.5 * (world.turn * (image.centre() - world.centre));
                assert!((position.as_vec3() - keyframe.pose.position).length() < 1e-6, "{origin:?} {}", image.name);
                let orientation = world.turn.as_quat() * image.head().orientation;
                assert!(orientation.dot(keyframe.pose.orientation).abs() > 1.0 - 1e-6, "{origin:?} {}", image.name);
            }
        }
        let error = images("walk.json", b"[]").unwrap_err().to_string();
        assert!(error.contains("expected COLMAP's images.txt or images.bin, found JSON"), "{error}");
        assert!(world("images.txt", &[], None, Origin::First, &mut Vec::new()).is_err());
    }

    #[test]
    fn one_camera_of_a_rig_is_chosen_by_its_id() {
        let rig = "1 1 0 0 0 0 0 0 1 left/001.jpg\n\n2 1 0 0 0 0 0 1 1 left/002.jpg\n\n\
                   3 1 0 0 0 1 0 0 4 right/001.jpg\n\n4 1 0 0 0 1 0 1 4 right/002.jpg\n";
        let error = crate::read("images.txt", rig.as_bytes(), &ImportOptions::default(), &mut alone).unwrap_err().to_string();
        assert!(
            error.contains("image right/001.jpg: expected the images of one camera") && error.contains("2 of camera 4"),
            "{error}"
        );
        let right = import(rig, &ImportOptions { camera: Some(4), ..ImportOptions::default() });
        assert_eq!(right.path.keyframes().len(), 2);
        let none = ImportOptions { camera: Some(3), ..ImportOptions::default() };
        let error = crate::read("images.txt", rig.as_bytes(), &none, &mut alone).unwrap_err().to_string();
        assert!(error.contains("expected images of camera 3, found 2 of camera 1, 2 of camera 4"), "{error}");
    }

    #[test]
    fn an_image_is_there_once() {
        let twice = "1 1 0 0 0 0 0 0 1 a.jpg\n\n2 1 0 0 0 0 0 1 1 a.jpg\n\n";
        let error = crate::read("images.txt", twice.as_bytes(), &ImportOptions::default(), &mut alone).unwrap_err().to_string();
        assert!(error.contains("image a.jpg: expected each image once"), "{error}");
    }
}
