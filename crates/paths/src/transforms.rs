//! The cameras of NeRF tools: `transforms.json` (`frames`, each with a `transform_matrix`), and the `camera_path` of RWAVS and
//! nerfstudio (each with a `camera_to_world`), and the `poses` of Record3D.
//!
//! Matrices take camera axes of OpenGL, x right, y up, z backward, to a world with z up. They have 3 or 4 rows of 4 numbers, as
//! rows or in one list.

use crate::colmap::{self, Image};
use crate::waypoint::Track;
use crate::{ImportOptions, PathFileError, text};
use glam::{DMat3, DQuat, DVec3};
use promenade_core::MAX_KEYFRAMES;
use serde::Deserialize;

/// How far the columns of a rotation may be from unit length and from right angles.
const SQUARE: f64 = 0.01;

/// Fields that are not read, such as those of lenses, are many.
#[derive(Deserialize)]
struct Document {
    frames: Option<Vec<Frame>>,
    camera_path: Option<Vec<Frame>>,
    /// Record3D: qx, qy, qz, qw, x, y, z of each picture, to a world with y up (ARKit).
    poses: Option<Vec<[f64; 7]>>,
    /// Polycam has a file for each picture.
    t_00: Option<f64>,
    /// Of a camera path that was drawn: frames a second. Of pictures it says nothing: tools write their default there.
    fps: Option<f64>,
}

#[derive(Deserialize)]
struct Frame {
    file_path: Option<String>,
    #[serde(alias = "camera_to_world")]
    transform_matrix: Matrix,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Matrix {
    Rows(Vec<Vec<f64>>),
    Flat(Vec<f64>),
}

impl Frame {
    /// A pose of Record3D's.
    fn recorded([qx, qy, qz, qw, x, y, z]: &[f64; 7]) -> Self {
        let axes = DMat3::from_quat(DQuat::from_xyzw(*qx, *qy, *qz, *qw));
        // To z up.
        let row = |axis: usize, sign: f64, at: f64| axes.row(axis).to_array().into_iter().chain([at]).map(move |v| sign * v);
        let flat = row(0, 1.0, *x).chain(row(2, -1.0, *z)).chain(row(1, 1.0, *y)).collect();
        Self { file_path: None, transform_matrix: Matrix::Flat(flat) }
    }
}

pub(crate) fn read(file: &str, bytes: &[u8], options: &ImportOptions) -> Result<Track, PathFileError> {
    let document: Document = serde_json::from_str(text::of(file, bytes)?).map_err(PathFileError::json(file))?;
    let recorded = document.poses.map(|poses| poses.iter().map(Frame::recorded).collect());
    let Some(frames) = document.frames.or(document.camera_path).or(recorded) else {
        if document.t_00.is_some() {
            let found = "one picture of Polycam's; `ns-process-data polycam` makes a transforms.json of all";
            return Err(PathFileError::content(file, "a file with all cameras", found));
        }
        let expected = "an array of keyframes, or an object with \"frames\" or a \"camera_path\"";
        return Err(PathFileError::content(file, expected, "an object with neither"));
    };
    if frames.is_empty() || frames.len() > MAX_KEYFRAMES {
        return Err(PathFileError::content(file, format!("1 to {MAX_KEYFRAMES} frames"), frames.len().to_string()));
    }
    let images = frames.iter().enumerate().map(|(index, frame)| image(file, index, frame)).collect::<Result<_, _>>()?;
    let images = colmap::sorted(file, images)?;
    let mut notes = Vec::new();
    let drawn = frames.iter().all(|frame| frame.file_path.is_none());
    let fps = options.fps.or(document.fps.filter(|fps| drawn && (1e-6..=1e6).contains(fps)));
    if let (Some(ignored), None, false) = (document.fps, options.fps, drawn) {
        notes.push(format!("the file's {ignored} frames a second are not taken for the rate of its pictures"));
    }
    let times = colmap::times::of(file, &images, fps, &mut notes)?;
    if options.placement.up.is_none() {
        notes.push("up is the file's z; the option up says otherwise".to_owned());
    }
    if options.placement.metres_per_unit.is_none() {
        notes.push("one unit is taken as 1 m; the option metres-per-unit says otherwise".to_owned());
    }
    let waypoints = images.iter().zip(times).map(|(image, t_s)| image.waypoint(t_s)).collect();
    Ok(Track { waypoints, place: Box::new(move |index| format!("frame {}", images[index].name)), notes })
}

/// A frame as an image of COLMAP's: from the world to a camera with x right, y down, z forward.
fn image(file: &str, index: usize, frame: &Frame) -> Result<Image, PathFileError> {
    let name = frame.file_path.clone().unwrap_or_else(|| format!("{index}"));
    let wrong = |expected: &str, found: String| PathFileError::entry(file, format!("frame {name}"), expected, found);
    let flat = match &frame.transform_matrix {
        Matrix::Flat(values) => values.clone(),
        Matrix::Rows(rows) if rows.iter().all(|row| row.len() == 4) => rows.concat(),
        Matrix::Rows(rows) => {
            let lengths: Vec<String> = rows.iter().map(|row| row.len().to_string()).collect();
            return Err(wrong("rows of 4 numbers", format!("rows of {}", lengths.join(", "))));
        }
    };
    if !matches!(flat.len(), 12 | 16) {
        return Err(wrong("a matrix of 3 or 4 rows of 4 numbers", format!("{} numbers", flat.len())));
    }
    if flat.len() == 16 && flat[12..] != [0.0, 0.0, 0.0, 1.0] {
        return Err(wrong("0, 0, 0, 1 as the last row, the matrix row by row", format!("{:?}", &flat[12..])));
    }
    let column = |c: usize| DVec3::new(flat[c], flat[4 + c], flat[8 + c]);
    let (axes, position) = (DMat3::from_cols(column(0), column(1), column(2)), column(3));
    let square = (axes.transpose() * axes).to_cols_array().iter().zip(DMat3::IDENTITY.to_cols_array()).all(|(a, b)| {
        (a - b).abs() <= SQUARE // Not where one is no number.
    });
    if !square || axes.determinant() < 0.0 || !position.is_finite() {
        return Err(wrong("a rotation and a finite position", format!("{flat:?}")));
    }
    let camera_to_world = DMat3::from_cols(axes.x_axis, -axes.y_axis, -axes.z_axis);
    let rotation = DQuat::from_mat3(&camera_to_world).normalize().inverse();
    Ok(Image { id: 0, name, camera: 1, rotation, translation: -(rotation * position) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Format, Imported, PlacementOptions, alone};
    use glam::Vec3;

    fn import(json: &str, options: &ImportOptions) -> Result<Imported, String> {
        let said =
            |e: PathFileError| format!("{e}: {}", std::error::Error::source(&e).map(ToString::to_string).unwrap_or_default());
        crate::read("transforms.json", json.as_bytes(), options, &mut alone).map_err(said)
    }

    /// A camera at 1, 2, 3 that looks along the world's y with the world's z up: x right is x, y up is z, z backward is -y.
    const ROWS: &str = "[[1,0,0,1],[0,0,-1,2],[0,1,0,3],[0,0,0,1]]";

    fn frames(list: &[(&str, &str)]) -> String {
        let frame =
            |(name, matrix): &(&str, &str)| format!(r#"{{"file_path":"{name}","sharpness":9,"transform_matrix":{matrix}}}"#);
        let frames: Vec<String> = list.iter().map(frame).collect();
        format!(r#"{{"camera_angle_x":0.8,"fl_x":500,"frames":[{}]}}"#, frames.join(","))
    }

    #[test]
    fn a_camera_is_a_head_that_looks_where_it_does() {
        let rows = frames(&[("images/0010.png", ROWS), ("images/0002.png", "[[1,0,0,0],[0,0,-1,0],[0,1,0,0],[0,0,0,1]]")]);
        let found = import(&rows, &ImportOptions { fps: Some(2.0), ..ImportOptions::default() }).unwrap();
        assert_eq!(found.format, Format::Transforms);
        let [first, second] = found.path.keyframes() else { panic!("two frames") };
        assert_eq!((first.t_s, second.t_s), (0.0, 4.0), "by the numbers of their names");
        assert!(first.pose.position.length() < 1e-6 && second.pose.position.distance(Vec3::new(1.0, 2.0, 3.0)) < 1e-6);
        let q = second.pose.orientation;
        assert!((q * Vec3::X).distance(Vec3::Y) < 1e-6 && (q * Vec3::Z).distance(Vec3::Z) < 1e-6, "{q}");
        assert!(found.notes.iter().any(|n| n.contains("up is the file's z")), "{:?}", found.notes);
        let up = PlacementOptions { up: Some(Vec3::Y), metres_per_unit: Some(0.5), ..PlacementOptions::default() };
        let turned = import(&rows, &ImportOptions { placement: up, ..ImportOptions::default() }).unwrap();
        let head = turned.path.keyframes()[1].pose;
        assert!((head.position.z - 1.0).abs() < 1e-6 && (head.orientation * Vec3::X).distance(Vec3::Z) < 1e-6, "{head:?}");
    }

    #[test]
    fn camera_paths_of_rwavs_and_of_viewers_are_read() {
        let flat = "[1,0,0,1, 0,0,-1,2, 0,1,0,3, 0,0,0,1]";
        let whole = format!(r#"{{"camera_path":[{{"file_path":"frames/00001.png","camera_to_world":{flat}}}]}}"#);
        let rows = import(&frames(&[("frames/00001.png", ROWS)]), &ImportOptions::default()).unwrap().path;
        assert_eq!(import(&whole, &ImportOptions::default()).unwrap().path, rows);
        let frame = |n: u32| format!(r#"{{"file_path":"frames/{n:05}.png","camera_to_world":{flat}}}"#);
        let walk = format!(r#"{{"camera_path":[{},{}],"fps":24,"seconds":25.6}}"#, frame(1), frame(615));
        let walk = import(&walk, &ImportOptions::default()).unwrap();
        assert_eq!(walk.path.keyframes()[1].t_s, 614.0, "a picture a second, whatever a viewer would play");
        assert!(walk.notes.iter().any(|n| n.contains("24 frames a second are not taken")), "{:?}", walk.notes);
        let bare = format!(r#"{{"camera_to_world":{flat},"fov":50,"aspect":1}}"#);
        let drawn = format!(r#"{{"camera_type":"perspective","camera_path":[{bare},{bare},{bare}],"fps":24,"seconds":1}}"#);
        let times: Vec<f64> =
            import(&drawn, &ImportOptions::default()).unwrap().path.keyframes().iter().map(|k| 24.0 * k.t_s).collect();
        assert_eq!(times, [0.0, 1.0, 2.0]);
    }

    #[test]
    fn what_is_no_pose_is_named() {
        let column_by_column = "[1,0,0,0, 0,0,1,0, 0,-1,0,0, 1,2,3,1]";
        for (matrix, clue) in [
            (
                column_by_column,
                "frame a1.png: expected 0, 0, 0, 1 as the last row, the matrix row by row, found [1.0, 2.0, 3.0, 1.0]",
            ),
            ("[[1,0,0],[0,1,0],[0,0,1]]", "frame a1.png: expected rows of 4 numbers, found rows of 3, 3, 3"),
            ("[1,2,3]", "expected a matrix of 3 or 4 rows of 4 numbers, found 3 numbers"),
            ("[[2,0,0,0],[0,2,0,0],[0,0,2,0]]", "expected a rotation and a finite position"),
            ("[[-1,0,0,0],[0,1,0,0],[0,0,1,0]]", "expected a rotation and a finite position"),
            ("7", "transforms.json: not the JSON that is expected here"),
        ] {
            let error = import(&frames(&[("a1.png", matrix)]), &ImportOptions::default()).unwrap_err();
            assert!(error.contains(clue), "{matrix}: {error}");
        }
        let twice = import(&frames(&[("a1.png", ROWS), ("a1.png", ROWS)]), &ImportOptions::default()).unwrap_err();
        assert!(twice.contains("image a1.png: expected each image once"), "{twice}");
        for (json, clue) in
            [("{}", "or an object with \"frames\""), (r#"{"frames":[]}"#, "expected 1 to 1000000 frames, found 0")]
        {
            let error = import(json, &ImportOptions::default()).unwrap_err();
            assert!(error.contains(clue), "{error}");
        }
    }
}
