//! Trajectories of a camera as benchmarks of odometry have them, in text: a row a pose.
//!
//! TUM (Sturm et al. 2012): `timestamp tx ty tz qx qy qz qw`. KITTI (Geiger et al. 2012): the upper three rows of the matrix,
//! row by row. Both take the camera's axes, x right, y down, z forward, to a world of any orientation, in metres.

use crate::colmap::{self, Image};
use crate::text::{self, number, quoted};
use crate::waypoint::{Track, unit};
use crate::{ImportOptions, PathFileError};
use glam::{DMat3, DQuat, DVec3};
use promenade_core::MAX_KEYFRAMES;

/// Numbers in a row.
const TUM: usize = 8;
const KITTI: usize = 12;
/// Rows a second in KITTI's sequences.
const KITTI_FPS: f64 = 10.0;

pub(crate) fn read(file: &str, bytes: &[u8], options: &ImportOptions) -> Result<Track, PathFileError> {
    let (mut images, mut times): (Vec<Image>, Vec<f64>) = (Vec::new(), Vec::new());
    for (line, row) in (1_u64..).zip(text::of(file, bytes)?.lines()) {
        let row = row.trim();
        if row.is_empty() || row.starts_with('#') {
            continue;
        }
        let wrong = |expected: &str, found: String| PathFileError::entry(file, format!("line {line}"), expected, found);
        let words: Vec<&str> = row.split_whitespace().collect();
        let timed = words.len() == TUM;
        if !(timed || words.len() == KITTI) || (!images.is_empty() && timed == times.is_empty()) {
            return Err(wrong("8 numbers (TUM) or 12 (KITTI), as many in all rows", quoted(row)));
        }
        if images.len() == MAX_KEYFRAMES {
            return Err(PathFileError::content(file, format!("at most {MAX_KEYFRAMES} rows"), "more"));
        }
        let v = words.iter().map(|word| number(file, line, "a pose", word)).collect::<Result<Vec<f64>, _>>()?;
        let (to_world, centre) = if timed {
            times.push(v[0]);
            let rotation = unit([v[7], v[4], v[5], v[6]]);
            let rotation = rotation.map_err(|length| wrong("a unit quaternion", format!("one of length {length}")))?;
            (rotation, DVec3::new(v[1], v[2], v[3]))
        } else {
            let column = |c: usize| DVec3::new(v[c], v[4 + c], v[8 + c]);
            let axes = DMat3::from_cols(column(0), column(1), column(2));
            let square = (axes.transpose() * axes - DMat3::IDENTITY).to_cols_array().iter().all(|off| off.abs() <= 0.01);
            if !square || axes.determinant() < 0.0 {
                return Err(wrong("a rotation in the first three columns", quoted(row)));
            }
            (DQuat::from_mat3(&axes).normalize(), column(3))
        };
        let rotation = to_world.inverse();
        let name = format!("line {line}");
        images.push(Image { id: 0, name, camera: 1, rotation, translation: -(rotation * centre) });
    }
    let mut notes = Vec::new();
    let times = match (times.first(), options.fps) {
        (Some(first), None) => times.iter().map(|t| t - first).collect(),
        (Some(_), Some(_)) => return Err(PathFileError::content(file, "no option fps, as the rows have times", "it")),
        (None, fps) => {
            let fps = fps.unwrap_or(KITTI_FPS);
            notes.push(format!("{fps} rows are taken for a second"));
            (0..images.len()).map(|i| i as f64 / fps).collect::<Vec<_>>()
        }
    };
    let mut options = options.placement;
    options.metres_per_unit = options.metres_per_unit.or(Some(1.0));
    let mut waypoints: Vec<_> = images.iter().zip(times).map(|(image, t_s)| image.waypoint(t_s)).collect();
    colmap::frame(file, &images, &waypoints, &options, &mut notes)?.place(&mut waypoints);
    Ok(Track { waypoints, place: Box::new(move |index| images[index].name.clone()), notes })
}
