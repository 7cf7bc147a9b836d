//! Trajectories of cameras, and what other programs leave out of files.

use glam::Vec3;
use promenade_core::Keyframe;
use promenade_paths::{Format, ImportOptions, Imported, Origin, PlacementOptions, alone, read};

/// Kept where the file has it, with z up.
fn kept() -> ImportOptions {
    let placement = PlacementOptions { up: Some(Vec3::Z), origin: Some(Origin::Keep), metres_per_unit: None };
    ImportOptions { placement, ..ImportOptions::default() }
}

fn of(name: &str, text: &str, options: &ImportOptions) -> Imported {
    read(name, text.as_bytes(), options, &mut alone).unwrap_or_else(|e| panic!("{e}"))
}

fn is(keyframe: &Keyframe, position: [f32; 3], ahead: Vec3) {
    let found = keyframe.pose.orientation * Vec3::X;
    assert!((keyframe.pose.position - Vec3::from(position)).length() < 1e-5, "{}", keyframe.pose.position);
    assert!((found - ahead).length() < 1e-5, "{found} for {ahead}");
}

#[test]
fn rows_of_tum_are_a_camera_in_its_world() {
    let half = 0.5_f64.sqrt();
    // Turned by -90 degrees about x, a camera's forward z becomes y, and its down y becomes -z.
    let text = format!(
        "# timestamp tx ty tz qx qy qz qw\n1305031102.5 1 2 3 {} 0 0 {half}\n1305031103.0 1 4 3 {} 0 0 {half}\n",
        -half, -half
    );
    let found = of("groundtruth.txt", &text, &kept());
    assert_eq!(found.format, Format::Trajectory);
    let [first, second] = found.path.keyframes() else { panic!("two rows") };
    assert_eq!((first.t_s, second.t_s), (0.0, 0.5));
    is(first, [1.0, 2.0, 3.0], Vec3::Y);
    is(second, [1.0, 4.0, 3.0], Vec3::Y);
}

#[test]
fn rows_of_kitti_are_a_camera_ten_times_a_second() {
    // The world is the first camera: x right, y down, z forward.
    let text = "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 2.5\n";
    let found = of("00.txt", text, &ImportOptions::default());
    let [first, second] = found.path.keyframes() else { panic!("two rows") };
    assert_eq!(second.t_s, 0.1);
    is(first, [0.0; 3], Vec3::X);
    is(second, [2.5, 0.0, 0.0], Vec3::X);
    let slow = of("00.txt", text, &ImportOptions { fps: Some(2.0), ..ImportOptions::default() });
    assert_eq!(slow.path.keyframes()[1].t_s, 0.5);
}

#[test]
fn poses_of_record3d_are_a_camera_with_y_up() {
    // Unturned, the camera looks along -z with y up; z becomes -y here.
    let text = r#"{"fps": 60, "w": 4, "poses": [[0, 0, 0, 1, 1, 1.5, -2], [0, 0, 0, 1, 1, 1.5, -3]]}"#;
    let found = of("metadata.json", text, &kept());
    let [first, second] = found.path.keyframes() else { panic!("two poses") };
    assert!((second.t_s - 1.0 / 60.0).abs() < 1e-9);
    is(first, [1.0, 2.0, 1.5], Vec3::Y);
    is(second, [1.0, 3.0, 1.5], Vec3::Y);
}

#[test]
fn a_table_without_an_orientation_looks_along_x_and_says_so() {
    let found = of("walk.csv", "time,x,y,z\n0,1,2,3\n0.5,2,2,3\n", &ImportOptions::default());
    is(&found.path.keyframes()[1], [2.0, 2.0, 3.0], Vec3::X);
    assert!(found.notes.iter().any(|note| note.contains("looks along x")), "{:?}", found.notes);
}

#[test]
fn images_of_colmap_without_lines_of_points_are_all_there() {
    let image = |n: u32| format!("{n} 1 0 0 0 {n} 0 0 1 {n}.jpg\n");
    let points = "10.5 20.5 3 11 21 -1\n";
    let all: String = (1..=4).map(image).collect();
    let some = format!("{}{points}{}\n{}{}{points}", image(1), image(2), image(3), image(4));
    for text in [all, some] {
        assert_eq!(of("images.txt", &text, &ImportOptions::default()).path.keyframes().len(), 4, "{text}");
    }
}

#[test]
fn what_is_not_read_is_named() {
    for (name, text, clue) in [
        ("a.json", r#"{"t_00": 1.0, "t_01": 0.0}"#, "one picture of Polycam's"),
        ("a.csv", "#timestamp [ns],p_RS_R_x [m]\n1,2\n", "EuRoC's ground truth"),
        ("a.txt", "1 2 3 4 0 0 0 1\n1 2 3\n", "8 numbers (TUM) or 12 (KITTI), as many in all rows"),
        ("a.txt", "1 2 3 4 0 0 0 2\n", "a unit quaternion"),
        ("a.txt", "2 0 0 0 0 1 0 0 0 0 1 0\n", "a rotation in the first three columns"),
        ("a.txt", "-1 0 0 0 0 1 0 0 0 0 1 0\n", "a rotation in the first three columns"),
    ] {
        let error = read(name, text.as_bytes(), &ImportOptions::default(), &mut alone).unwrap_err().to_string();
        assert!(error.starts_with(name) && error.contains(clue), "{error}");
    }
}
