//! Paths as rows under a head: `t`, `x`, `y`, `z` and `yaw`, `pitch`, `roll` or `qw`, `qx`, `qy`, `qz`, in any order.

use crate::PathFileError;
use crate::text::{self, decimal, number, quoted};
use crate::waypoint::{Track, Waypoint, from_degrees, to_degrees, unit};
use ::csv::{ReaderBuilder, StringRecord, Trim};
use glam::{DQuat, DVec3};
use promenade_core::{CameraPath, MAX_KEYFRAMES};

/// What other programs call the time.
const TIMES: [&str; 4] = ["time", "time_s", "timestamp", "seconds"];
const TIME_AND_PLACE: [&str; 4] = ["t", "x", "y", "z"];
const ANGLES: [&str; 3] = ["yaw", "pitch", "roll"];
const QUATERNION: [&str; 4] = ["qw", "qx", "qy", "qz"];

/// Where the numbers of a keyframe stand in a row.
struct Columns {
    count: usize,
    time_and_place: Vec<usize>,
    /// Three of angles or four of a quaternion; none where the rows look along x.
    facing: Vec<usize>,
}

pub(crate) fn read(file: &str, bytes: &[u8]) -> Result<Track, PathFileError> {
    let text = text::of(file, bytes)?;
    if text.starts_with("#timestamp") {
        let found = "EuRoC's ground truth, of which poses are an IMU's; saved as TUM's, in the axes of a camera, it is read";
        return Err(PathFileError::content(file, "poses of a head or of a camera", found));
    }
    // Only rows, so that the reader's lines can be told from the file's.
    let rows = text.lines().zip(1_u64..).filter(|(line, _)| !line.trim().is_empty() && !line.trim_start().starts_with('#'));
    let (rows, row_lines): (Vec<&str>, Vec<u64>) = rows.unzip();
    let separator = delimiter(rows.first().copied().unwrap_or_default());
    let rows = rows.join("\n");
    let mut rows = ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(Trim::All)
        .delimiter(separator)
        .from_reader(rows.as_bytes());
    let (mut waypoints, mut notes) = (Vec::new(), Vec::new());
    let mut lines = Vec::new();
    let mut columns: Option<Columns> = None;
    let mut row = StringRecord::new();
    loop {
        let more = rows.read_record(&mut row).map_err(|e| PathFileError::content(file, "rows of numbers", e.to_string()))?;
        if !more {
            break;
        }
        let row_number = row.position().and_then(|p| usize::try_from(p.line()).ok()).unwrap_or_default();
        let line = row_number.checked_sub(1).and_then(|n| row_lines.get(n)).copied().unwrap_or_default();
        // Spreadsheets end in rows of separators.
        if row.iter().all(str::is_empty) {
            continue;
        }
        let Some(columns) = &columns else {
            columns = Some(Columns::of(file, line, &row, &mut notes)?);
            continue;
        };
        if lines.len() == MAX_KEYFRAMES {
            return Err(PathFileError::content(file, format!("at most {MAX_KEYFRAMES} rows"), "more"));
        }
        waypoints.push(columns.waypoint(file, line, &row)?);
        lines.push(line);
    }
    if columns.is_none() {
        return Err(PathFileError::entry(file, "line 1", head_expected(), "no row"));
    }
    Ok(Track { waypoints, place: Box::new(move |index| format!("line {}", lines[index])), notes })
}

/// Comma, semicolon or tab, whichever the head has most of.
fn delimiter(head: &str) -> u8 {
    let count = |separator: u8| head.bytes().filter(|b| *b == separator).count();
    // The last of equals wins, which is the comma.
    [b'\t', b';', b','].into_iter().max_by_key(|s| count(*s)).unwrap_or(b',')
}

fn head_expected() -> String {
    format!("a head with the columns {} and {} or {}", TIME_AND_PLACE.join(","), ANGLES.join(","), QUATERNION.join(","))
}

impl Columns {
    fn of(file: &str, line: u64, head: &StringRecord, notes: &mut Vec<String>) -> Result<Self, PathFileError> {
        let own = |name: &str| {
            let name = name.to_ascii_lowercase();
            if TIMES.contains(&&name[..]) { TIME_AND_PLACE[0].to_owned() } else { name }
        };
        let names: Vec<String> = head.iter().map(own).collect();
        let wrong = |found: String| PathFileError::entry(file, format!("line {line}"), head_expected(), found);
        let find = |name: &str| names.iter().position(|n| n == name);
        let known = |n: &str| TIME_AND_PLACE.contains(&n) || ANGLES.contains(&n) || QUATERNION.contains(&n);
        for (index, name) in names.iter().enumerate() {
            if known(name) && find(name) != Some(index) {
                return Err(wrong(format!("the column {name} twice")));
            }
        }
        if !names.iter().any(|n| known(n)) {
            return Err(wrong(quoted(&head.iter().collect::<Vec<_>>().join(","))));
        }
        let all = |wanted: &[&str]| -> Result<Vec<usize>, _> {
            wanted.iter().map(|n| find(n).ok_or_else(|| wrong(format!("no column {n}")))).collect()
        };
        let time_and_place = all(&TIME_AND_PLACE)?;
        let (angles, quaternion) = (ANGLES.iter().any(|n| find(n).is_some()), QUATERNION.iter().any(|n| find(n).is_some()));
        let facing = match (angles, quaternion) {
            (true, true) => return Err(wrong("columns of both".to_owned())),
            (false, false) => {
                notes.push("there are no columns of an orientation: the path looks along x".to_owned());
                Vec::new()
            }
            (true, false) => all(&ANGLES)?,
            (false, true) => all(&QUATERNION)?,
        };
        for name in names.iter().filter(|n| !known(n) && !n.is_empty()) {
            notes.push(format!("the column {} is not used", quoted(name)));
        }
        Ok(Self { count: names.len(), time_and_place, facing })
    }

    fn waypoint(&self, file: &str, line: u64, row: &StringRecord) -> Result<Waypoint, PathFileError> {
        let place = || format!("line {line}");
        if row.len() != self.count {
            let expected = format!("{} fields, as in the head", self.count);
            return Err(PathFileError::entry(file, place(), expected, row.len().to_string()));
        }
        let values = |columns: &[usize], names: &[&str]| -> Result<Vec<f64>, PathFileError> {
            columns.iter().zip(names).map(|(c, name)| number(file, line, name, &row[*c])).collect()
        };
        let at = values(&self.time_and_place, &TIME_AND_PLACE)?;
        let names = if self.facing.len() == ANGLES.len() { &ANGLES[..] } else { &QUATERNION };
        let orientation = match values(&self.facing, names)?[..] {
            [] => DQuat::IDENTITY,
            [yaw, pitch, roll] => from_degrees([yaw, pitch, roll]),
            ref q => unit([q[0], q[1], q[2], q[3]]).map_err(|length| {
                PathFileError::entry(file, place(), "a unit quaternion", format!("one of length {length}"))
            })?,
        };
        Ok(Waypoint { t_s: at[0], position: DVec3::new(at[1], at[2], at[3]), orientation })
    }
}

pub(crate) fn write(path: &CameraPath) -> String {
    let mut text = format!("{},{}\n", TIME_AND_PLACE.join(","), ANGLES.join(","));
    for k in path.keyframes() {
        let position = k.pose.position.to_array().map(|v| (v + 0.0).to_string()).join(",");
        let angles = to_degrees(k.pose.orientation).map(decimal).join(",");
        text += &format!("{},{position},{angles}\n", k.t_s + 0.0);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn parse(text: &str) -> Result<(CameraPath, Vec<String>), String> {
        let track = read("p.csv", text.as_bytes()).map_err(|e| e.to_string())?;
        let path = track.path("p.csv").map_err(|e| e.to_string())?;
        Ok((path, track.notes))
    }

    #[test]
    fn columns_stand_in_any_order_and_any_separator_does() {
        let (plain, notes) = parse("t,x,y,z,yaw,pitch,roll\n0,1,2,3,90,10,-5\n2.5,0,0,1,0,0,0\n").unwrap();
        assert!(notes.is_empty());
        let ahead = plain.keyframes()[0].pose.orientation * Vec3::X;
        assert!(ahead.y > 0.9 && ahead.z > 0.1, "yaw is to the left, pitch is up: {ahead}");
        let other = "\u{feff}# recorded\r\nRoll; Pitch ;yaw;Z;y;x;\"t\"\r\n-5;10;90;3;2;1;0\r\n\r\n# \
            pause\r\n0;0;0;1;0;0;2.5\r\n;;;;;;\r\n";
        assert_eq!(parse(other).unwrap().0, plain);
        let (turned, notes) = parse("qw\tqx\tqy\tqz\tt\tfov\tx\ty\tz\n0.7071\t0\t0\t0.7071\t0\t60\t0\t0\t0\n").unwrap();
        assert!((turned.keyframes()[0].pose.orientation * Vec3::X - Vec3::Y).length() < 1e-6);
        assert_eq!(notes, ["the column \"fov\" is not used"]);
    }

    #[test]
    fn errors_name_the_line() {
        let head = "t,x,y,z,yaw,pitch,roll";
        for (text, clue) in [
            (
                String::new(),
                "p.csv: line 1: expected a head with the columns t,x,y,z and yaw,pitch,roll or qw,qx,qy,qz, found no row",
            ),
            (
                "0,0,0,0,0,0,0\n".to_owned(),
                "line 1: expected a head with the columns t,x,y,z and yaw,pitch,roll or qw,qx,qy,qz, found \"0,0,0,0,0,0,0\"",
            ),
            ("t,x,z,yaw,pitch,roll\n".to_owned(), "found no column y"),
            ("t,x,y,z,yaw,pitch\n".to_owned(), "found no column roll"),
            ("#timestamp, p_RS_R_x [m]\n1403636580838555648,4.6\n".to_owned(), "EuRoC's ground truth"),
            ("t,x,y,z,yaw,pitch,roll,qw\n".to_owned(), "found columns of both"),
            ("t,x,y,x,z,yaw,pitch,roll\n".to_owned(), "found the column x twice"),
            (
                format!("# a\n\n{head}\n0,0,0,0,0,0,0\n# b\n1,0,zero,0,0,0,0\n"),
                "line 6: expected a finite number for y, found \"zero\"",
            ),
            (format!("{head}\n0,NaN,0,0,0,0,0\n"), "line 2: expected a finite number for x"),
            (format!("{head}\n0,1e300,0,0,0,0,0\n"), "line 2: expected a finite pose"),
            (format!("{head}\n0,0,0\n"), "line 2: expected 7 fields, as in the head, found 3"),
            (
                format!("{head}\n1,0,0,0,0,0,0\n\n1,0,0,0,0,0,0\n"),
                "line 4: expected a time after 1 s, that of line 2, found 1 s",
            ),
            (format!("{head}\n2,0,0,0,0,0,0\n1,0,0,0,0,0,0\n"), "line 3: expected a time after 2 s, that of line 2, found 1 s"),
            ("t,x,y,z,qw,qx,qy,qz\n0,0,0,0,2,0,0,0\n".to_owned(), "line 2: expected a unit quaternion, found one of length 2"),
            (format!("{head}\n"), "p.csv: no camera path"),
        ] {
            let error = parse(&text).unwrap_err();
            assert!(error.contains(clue), "{text:?}: {error}");
        }
    }

    #[test]
    fn there_are_not_too_many() {
        let text = format!("t,x,y,z,yaw,pitch,roll\n{}", "0,0,0,0,0,0,0\n".repeat(MAX_KEYFRAMES + 1));
        assert_eq!(parse(&text).unwrap_err(), "p.csv: expected at most 1000000 rows, found more");
    }
}
