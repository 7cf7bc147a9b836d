//! From the bytes of a file to a path.

use crate::placing::{Origin, place};
use crate::{Format, PathFileError, colmap, csv, gltf, json, simplify};
use glam::Vec3;
use promenade_core::CameraPath;
use std::io;

/// Bytes that a file may have: COLMAP's list every point that every image sees.
pub const MAX_FILE_BYTES: u64 = 1 << 30;
/// How far the path of a glTF animation may be from the animation, metres.
pub const GLTF_TOLERANCE_M: f32 = 1e-3;
/// How far its orientation may be from the animation's, radians: 0.1 degrees.
pub const GLTF_TOLERANCE_RAD: f32 = 1.745_329_3e-3;

/// Reads a file beside the one that is read, by the name that is written there.
pub type Beside<'a> = dyn FnMut(&str) -> io::Result<Vec<u8>> + 'a;

/// What a file does not say. `None` everywhere is a sensible choice, and the notes say what was assumed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImportOptions {
    /// COLMAP: images a second, 1 without it, unless their names are times of day. glTF: samples of the animation a second, 60
    /// without it. Above 0.
    pub fps: Option<f64>,
    /// Metres per unit, 1 without it. Above 0.
    pub scale: Option<f64>,
    /// COLMAP: direction of up in the reconstruction's world, of any length; without it, from the cameras.
    pub up: Option<Vec3>,
    /// What becomes the world's origin; without it the first camera for COLMAP, the file's own for the others.
    pub origin: Option<Origin>,
    /// glTF: name of an animation, a camera or a node; without it the first animated camera, else the first animated node.
    pub animation: Option<String>,
    /// COLMAP: id of the camera whose images are the path; without it all of them.
    pub camera: Option<u32>,
}

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

/// No file lies beside the one that is read.
///
/// # Errors
/// Always.
pub fn alone(_: &str) -> io::Result<Vec<u8>> {
    Err(io::Error::new(io::ErrorKind::NotFound, "only the file itself is here"))
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
        Format::Gltf => gltf::read(file, bytes, options, beside)?,
    };
    let colmap = matches!(format, Format::ColmapText | Format::ColmapBinary);
    let origin = options.origin.unwrap_or(if colmap { Origin::First } else { Origin::Keep });
    let scale = options.scale.unwrap_or(1.0);
    if origin != Origin::Keep || scale != 1.0 {
        place(&mut track.waypoints, origin, scale);
    }
    let mut path = track.path(file)?;
    if format == Format::Gltf {
        path = simplify(path.keyframes(), GLTF_TOLERANCE_M, GLTF_TOLERANCE_RAD)
            .and_then(CameraPath::new)
            .map_err(|source| PathFileError::Keyframes { file: file.to_owned(), source })?;
    }
    Ok(Imported { format, path, notes: track.notes })
}

impl ImportOptions {
    fn check(&self, format: Format) -> Result<(), PathFileError> {
        let positive = |option, value: Option<f64>| match value {
            Some(v) if !(1e-6..=1e6).contains(&v) => {
                Err(PathFileError::option(option, "a number from 0.000001 to 1000000", v.to_string()))
            }
            _ => Ok(()),
        };
        positive("fps", self.fps)?;
        positive("scale", self.scale)?;
        if let Some(up) = self.up
            && up.try_normalize().is_none()
        {
            return Err(PathFileError::option("up", "a direction", up.to_string()));
        }
        // An option without an effect would be a surprise.
        let colmap = matches!(format, Format::ColmapText | Format::ColmapBinary);
        let gltf = format == Format::Gltf;
        for (option, given, fits, what) in [
            ("fps", self.fps.is_some(), colmap || gltf, "COLMAP cameras or a glTF animation"),
            ("up", self.up.is_some(), colmap, "COLMAP cameras"),
            ("camera", self.camera.is_some(), colmap, "COLMAP cameras"),
            ("animation", self.animation.is_some(), gltf, "a glTF animation"),
        ] {
            if given && !fits {
                return Err(PathFileError::option(option, what, format!("a path in {}", format.name())));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CSV: &[u8] = b"t,x,y,z,yaw,pitch,roll\n0,1,0,0,90,0,0\n1,2,0,0,90,0,0\n";

    fn said(options: &ImportOptions) -> String {
        read("p.csv", CSV, options, &mut alone).unwrap_err().to_string()
    }

    #[test]
    fn every_form_can_be_scaled_and_moved() {
        let options = ImportOptions { scale: Some(0.01), origin: Some(Origin::First), ..ImportOptions::default() };
        let path = read("p.csv", CSV, &options, &mut alone).unwrap().path;
        let last = path.keyframes()[1].pose;
        assert!((last.position - Vec3::new(0.0, -0.01, 0.0)).length() < 1e-7, "{}", last.position);
        assert!((last.orientation * Vec3::X - Vec3::X).length() < 1e-6);
        let kept = read("p.csv", CSV, &ImportOptions::default(), &mut alone).unwrap();
        assert_eq!((kept.path.keyframes()[0].pose.position, kept.format), (Vec3::X, Format::Csv));
    }

    #[test]
    fn options_are_for_the_forms_that_have_use_for_them() {
        let none = ImportOptions::default();
        for (options, clue) in [
            (ImportOptions { fps: Some(30.0), ..none.clone() }, "option fps: expected COLMAP cameras or a glTF animation"),
            (ImportOptions { up: Some(Vec3::Z), ..none.clone() }, "option up: expected COLMAP cameras, found a path in CSV"),
            (ImportOptions { camera: Some(1), ..none.clone() }, "option camera"),
            (ImportOptions { animation: Some("a".to_owned()), ..none.clone() }, "option animation"),
            (ImportOptions { scale: Some(0.0), ..none.clone() }, "option scale: expected a number from"),
            (ImportOptions { fps: Some(f64::NAN), ..none.clone() }, "option fps: expected a number from"),
            (ImportOptions { up: Some(Vec3::ZERO), ..none }, "option up: expected a direction"),
        ] {
            let error = said(&options);
            assert!(error.contains(clue), "{error}");
        }
    }
}
