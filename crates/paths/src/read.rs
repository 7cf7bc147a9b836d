//! From the bytes of a file to a path.

use crate::limit::MAX_FILE_BYTES;
use crate::options::{Beside, ImportOptions};
use crate::placement::Frame;
use crate::{Format, PathFileError, PlacementOptions, adm, colmap, csv, gltf, json, simplify, speed, trajectory, transforms};
use promenade_core::CameraPath;

/// How far the path of a glTF animation or an ADM object may be from what the file says, metres.
pub const GLTF_TOLERANCE_M: f32 = 1e-3;
/// How far its orientation may be from the animation's, radians: 0.1 degrees.
pub const GLTF_TOLERANCE_RAD: f32 = 1.745_329_3e-3;

/// A path that was read.
#[derive(Clone, Debug, PartialEq)]
pub struct Imported {
    /// What the file was.
    pub format: Format,
    /// The path in Promenade's world, metres.
    pub path: CameraPath,
    /// What was assumed or left out, in words.
    pub notes: Vec<String>,
}

/// Reads a camera path; `file` is its name, for its ending and for errors, `beside` reads the buffers of a glTF file that keeps
/// them apart.
///
/// # Errors
/// A file of another kind, a damaged one, keyframes that make no path, more than [`MAX_FILE_BYTES`] or
/// [`crate::MAX_KEYFRAMES`], or an option that is out of range or not for this kind of file. The message names the file and the
/// place in it.
///
/// # Real-time
/// Not real-time safe.
pub fn read(file: &str, bytes: &[u8], options: &ImportOptions, beside: &mut Beside<'_>) -> Result<Imported, PathFileError> {
    if bytes.len() as u64 > MAX_FILE_BYTES {
        return Err(PathFileError::content(file, format!("at most {MAX_FILE_BYTES} bytes"), bytes.len().to_string()));
    }
    let format = Format::of(file, bytes)?;
    options.check(format)?;
    let mut track = match format {
        Format::Json => json::read(file, bytes)?,
        Format::Csv => csv::read(file, bytes)?,
        Format::ColmapText | Format::ColmapBinary => colmap::read(file, bytes, format, options)?,
        Format::Trajectory => trajectory::read(file, bytes, options)?,
        Format::Transforms => transforms::read(file, bytes, options)?,
        Format::Gltf => gltf::read(file, bytes, options, beside)?,
        Format::Adm => adm::read(file, bytes, options)?,
    };
    if !format.is_colmap() && format != Format::Trajectory {
        // An ADM file has applied the scale itself: its emitter is in metres already.
        let metres_per_unit = options.placement.metres_per_unit.filter(|_| format != Format::Adm);
        let placement = PlacementOptions { metres_per_unit, ..options.placement };
        let frame = placement.frame(Frame::IDENTITY, &track.waypoints)?;
        if frame != Frame::IDENTITY {
            frame.place(&mut track.waypoints);
        }
    }
    let mut path = track.path(file)?;
    if matches!(format, Format::Gltf | Format::Adm) {
        path = simplify(path.keyframes(), GLTF_TOLERANCE_M, GLTF_TOLERANCE_RAD)
            .and_then(CameraPath::new)
            .map_err(PathFileError::at(file, "no camera path"))?;
    }
    let mut notes = track.notes;
    if format.is_of_cameras() {
        // In units of their own the cameras' speed says nothing, but their turns do.
        let metric = options.placement.metres_per_unit.is_some() || format == Format::Trajectory;
        notes.extend(speed::warning(&path, metric));
    }
    Ok(Imported { format, path, notes })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Origin, alone};
    use glam::Vec3;

    fn placed(placement: PlacementOptions) -> ImportOptions {
        ImportOptions { placement, ..ImportOptions::default() }
    }

    const CSV: &[u8] = b"t,x,y,z,yaw,pitch,roll\n0,1,0,0,90,0,0\n1,2,0,0,90,0,0\n";

    fn said(options: &ImportOptions) -> String {
        read("p.csv", CSV, options, &mut alone).unwrap_err().to_string()
    }

    #[test]
    fn every_form_can_be_scaled_and_moved() {
        let options = placed(PlacementOptions { metres_per_unit: Some(0.01), origin: Some(Origin::First), up: None });
        let path = read("p.csv", CSV, &options, &mut alone).unwrap().path;
        let last = path.keyframes()[1].pose;
        assert!((last.position - Vec3::new(0.0, -0.01, 0.0)).length() < 1e-7, "{}", last.position);
        assert!((last.orientation * Vec3::X - Vec3::X).length() < 1e-6);
        let kept = read("p.csv", CSV, &ImportOptions::default(), &mut alone).unwrap();
        assert_eq!((kept.path.keyframes()[0].pose.position, kept.format), (Vec3::X, Format::Csv));
    }

    #[test]
    fn options_are_for_the_forms_that_have_use_for_them() {
        let (none, here) = (ImportOptions::default(), PlacementOptions::default());
        for (options, clue) in [
            (ImportOptions { fps: Some(30.0), ..none.clone() }, "option fps: expected poses of cameras, or a glTF animation"),
            (
                placed(PlacementOptions { up: Some(Vec3::Z), ..here }),
                "option up: expected poses of cameras, found a path in CSV",
            ),
            (ImportOptions { camera: Some(1), ..none.clone() }, "option camera"),
            (ImportOptions { animation: Some("a".to_owned()), ..none.clone() }, "option animation"),
            (placed(PlacementOptions { metres_per_unit: Some(0.0), ..here }), "option metres-per-unit: expected a number from"),
            (ImportOptions { fps: Some(f64::NAN), ..none }, "option fps: expected a number from"),
        ] {
            let error = said(&options);
            assert!(error.contains(clue), "{error}");
        }
    }
}
