//! The cameras of a COLMAP model: `images.txt` or `images.bin`, as a path or as they are in the reconstruction's world.
//!
//! Models with rigs and frames hold each image's pose there too, so these two files are all that is read.

mod binary;
mod images;
mod lens;
mod names;
pub(crate) mod times;
mod up;

pub use lens::{Lens, lenses};

use crate::placement::Frame;
use crate::waypoint::{Track, Waypoint};
use crate::{Format, ImportOptions, Origin, PathFileError, PlacementOptions};
use glam::{DMat3, DQuat, DVec3};
use promenade_core::Pose;
use promenade_core::network::Placement;

/// An image as COLMAP keeps it.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Number by which points say that they are seen in it.
    pub id: u32,
    /// Name, relative to the folder of the images.
    pub name: String,
    /// Id of the camera that took it.
    pub camera: u32,
    /// Rotation from the reconstruction's world to the camera: x right, y down, z forward. Unit quaternion.
    pub rotation: DQuat,
    /// Translation from the world to the camera, the reconstruction's units.
    pub translation: DVec3,
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
        let Waypoint { position, orientation, .. } = self.waypoint(0.0);
        Pose { position: position.as_vec3(), orientation: orientation.as_quat().normalize() }
    }

    /// That head at a time, seconds.
    pub(crate) fn waypoint(&self, t_s: f64) -> Waypoint {
        let [ahead, left, up] = self.head_axes();
        let orientation = DQuat::from_mat3(&DMat3::from_cols(ahead, left, up)).normalize();
        Waypoint { t_s, position: self.centre(), orientation }
    }
}

/// The images of a COLMAP model, by their names, numbers in them by their value.
///
/// # Errors
/// A file of another kind, or a damaged one; there may be no images. The message names the file and the place in it.
pub fn images(file: &str, bytes: &[u8]) -> Result<Vec<Image>, PathFileError> {
    match Format::of(file, bytes)? {
        format @ (Format::ColmapText | Format::ColmapBinary) => sorted(file, parse(file, bytes, format, &mut Vec::new())?),
        other => Err(PathFileError::content(file, "COLMAP's images.txt or images.bin", other.name())),
    }
}

/// Where the world of a reconstruction lies by its cameras, the same as for a path of these images. What is not given is
/// assumed, in `notes`: up as the cameras were held, the first camera as the origin, 1 m a unit; without cameras z up and the
/// world's own origin.
///
/// # Errors
/// An option out of range, an origin by cameras where there are none, or cameras that were held in all directions. `file` is
/// for the message.
pub fn placement(
    file: &str,
    images: &[Image],
    options: &PlacementOptions,
    notes: &mut Vec<String>,
) -> Result<Placement, PathFileError> {
    let heads: Vec<Waypoint> = images.iter().map(|image| image.waypoint(0.0)).collect();
    Ok(frame(file, images, &heads, options, notes)?.placement())
}

/// Where the world of a reconstruction lies, in double precision; `heads` are those at the images.
pub(crate) fn frame(
    file: &str,
    images: &[Image],
    heads: &[Waypoint],
    options: &PlacementOptions,
    notes: &mut Vec<String>,
) -> Result<Frame, PathFileError> {
    let mut options = *options;
    let mut assumed = Frame::IDENTITY;
    if options.up.is_none() && images.is_empty() {
        notes.push("up is taken as 0,0,1 of the cloud's world; the option up says otherwise".to_owned());
    } else if options.up.is_none() {
        assumed = assumed.tilted(up::of(file, images, notes)?);
    }
    if options.metres_per_unit.is_none() {
        notes.push(
            "the scale of a reconstruction is arbitrary: one unit is taken as 1 m; the option metres-per-unit says otherwise"
                .to_owned(),
        );
    }
    if let Some(Image { name, .. }) = images.first() {
        match options.origin {
            None => notes.push(format!("the first camera, {name}, stands at the origin and looks along x")),
            Some(Origin::Centroid | Origin::First) => notes.push(format!("the first camera, {name}, looks along x")),
            Some(Origin::Keep | Origin::Point(_)) => {}
        }
        options.origin = options.origin.or(Some(Origin::First));
    }
    options.frame(assumed, heads)
}

fn parse(file: &str, bytes: &[u8], format: Format, notes: &mut Vec<String>) -> Result<Vec<Image>, PathFileError> {
    match format {
        Format::ColmapBinary => binary::read(file, bytes),
        _ => images::read(file, bytes, notes),
    }
}

pub(crate) fn sorted(file: &str, mut images: Vec<Image>) -> Result<Vec<Image>, PathFileError> {
    images.sort_by(|a, b| names::natural(&a.name, &b.name));
    match images.windows(2).find(|pair| pair[0].name == pair[1].name) {
        Some(twice) => Err(PathFileError::entry(file, format!("image {}", twice[1].name), "each image once", "it twice")),
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
    let mut waypoints: Vec<Waypoint> = images.iter().zip(times).map(|(image, t_s)| image.waypoint(t_s)).collect();
    frame(file, &images, &waypoints, &options.placement, &mut notes)?.place(&mut waypoints);
    Ok(Track { waypoints, place: Box::new(move |index| format!("image {}", images[index].name)), notes })
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
fn image(file: &str, place: &str, name: String, [id, camera]: [u32; 2], pose: [f64; 7]) -> Result<Image, PathFileError> {
    let [w, x, y, z, tx, ty, tz] = pose;
    let rotation = crate::waypoint::unit([w, x, y, z])
        .map_err(|length| PathFileError::entry(file, place, "a unit quaternion", format!("one of length {length}")))?;
    let translation = DVec3::new(tx, ty, tz);
    if !translation.is_finite() {
        return Err(PathFileError::entry(file, place, "a finite translation", translation.to_string()));
    }
    let image = Image { id, name, camera, rotation, translation };
    if !image.head().is_valid() {
        let expected = format!("a camera within {:e} units of the origin", Pose::FARTHEST_M);
        return Err(PathFileError::entry(file, place, expected, format!("one at {}", image.centre())));
    }
    Ok(image)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Imported, alone};
    use glam::Vec3;

    fn import(text: &str, options: &ImportOptions) -> Imported {
        crate::read("images.txt", text.as_bytes(), options, &mut alone).unwrap()
    }

    /// Level cameras in a world as that of a first camera: x right, y down, z ahead. The second stands 2 ahead of the first, 1
    /// to its right and 0.5 above it, and is turned to the right by 90 degrees.
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
            placement: PlacementOptions {
                up: Some(Vec3::new(0.0, -3.0, 0.0)),
                origin: Some(Origin::Keep),
                metres_per_unit: Some(2.0),
            },
            fps: Some(10.0),
            ..ImportOptions::default()
        };
        let path = import(LEVEL, &options).path;
        // Where an anchor cloud of the same reconstruction comes to lie with the same up and scale.
        let rotation = glam::Quat::from_rotation_arc(Vec3::Z, Vec3::NEG_Y);
        let placement = Placement { units_per_metre: 0.5, rotation, origin: Vec3::ZERO };
        let centre = Vec3::new(1.0, -0.5, 2.0);
        assert!((path.keyframes()[1].pose.position - placement.to_scene(centre)).length() < 1e-5);
        let listener = placement.listener(&path.keyframes()[1].pose);
        assert!((listener.camera_to_world * Vec3::Z - Vec3::X).length() < 1e-5, "it looks along the world's x");
        assert!((path.duration_s() - 3.0).abs() < 1e-9);
        let centroid = PlacementOptions { origin: Some(Origin::Centroid), ..PlacementOptions::default() };
        let path = import(LEVEL, &ImportOptions { placement: centroid, ..ImportOptions::default() }).path;
        assert!((path.keyframes()[0].pose.position - Vec3::new(-1.0, 0.5, -0.25)).length() < 1e-6);
    }

    #[test]
    fn a_reconstruction_lies_where_its_path_does() {
        let found = images("images.txt", LEVEL.as_bytes()).unwrap();
        let named = Origin::NAMED.map(|(_, origin)| Some(origin));
        for origin in named.into_iter().chain([None, Some(Origin::Point(Vec3::ONE))]) {
            let options = PlacementOptions { origin, metres_per_unit: Some(0.5), up: None };
            let path = import(LEVEL, &ImportOptions { placement: options, ..ImportOptions::default() }).path;
            let world = placement("images.txt", &found, &options, &mut Vec::new()).unwrap();
            for (image, keyframe) in found.iter().zip(path.keyframes()) {
                let head = world.pose(&image.head());
                assert!((head.position - keyframe.pose.position).length() < 1e-6, "{origin:?} {}", image.name);
                assert!(head.orientation.dot(keyframe.pose.orientation).abs() > 1.0 - 1e-6, "{origin:?} {}", image.name);
            }
        }
        let error = images("walk.json", b"[]").unwrap_err().to_string();
        assert!(error.contains("expected COLMAP's images.txt or images.bin, found JSON"), "{error}");
        let by_cameras = PlacementOptions { origin: Some(Origin::First), ..PlacementOptions::default() };
        assert!(placement("images.txt", &[], &by_cameras, &mut Vec::new()).is_err());
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
