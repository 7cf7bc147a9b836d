//! Models that COLMAP made, in `../shared/data/colmap` beside the checkout.

use glam::Vec3;
use promenade_paths::{CameraPath, Format, ImportOptions, Imported, Origin, PlacementOptions, Summary, alone, read};
use std::path::Path;

fn import(file: &Path, options: &ImportOptions) -> Imported {
    let bytes = std::fs::read(file).unwrap();
    let name = file.to_str().unwrap();
    read(name, &bytes, options, &mut alone).unwrap_or_else(|e| panic!("{e}"))
}

fn positions(path: &CameraPath) -> Vec<Vec3> {
    path.keyframes().iter().map(|k| k.pose.position).collect()
}

/// The smallest and largest height above the origin, metres.
fn heights(positions: &[Vec3]) -> (f32, f32) {
    positions.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), p| (l.min(p.z), h.max(p.z)))
}

/// Whether the notes say all of these.
fn notes_say(imported: &Imported, clues: &[&str]) {
    for clue in clues {
        assert!(imported.notes.iter().any(|n| n.contains(clue)), "{clue}: {:?}", imported.notes);
    }
}

mod needs_shared {
    use super::*;
    use promenade_testing::shared;

    #[test]
    #[ignore = "needs ../shared"]
    fn a_walk_round_a_bed_by_its_photographs() {
        let models = shared("data/colmap");
        let model = models.join("bedroom_plush_mit_rebuilt");
        let imported = import(&model.join("bin/images.bin"), &ImportOptions::default());
        let keyframes = imported.path.keyframes();
        assert_eq!((imported.format, keyframes.len()), (Format::ColmapBinary, 48));
        notes_say(
            &imported,
            &["times of day", "as the cameras were held", "one unit is taken as 1 m", "20240212_003919.jpg, stands"],
        );
        // The photographs' names are times from 00:39:19 to 00:41:38.
        assert_eq!((keyframes[0].t_s, imported.path.duration_s()), (0.0, 139.0));
        assert!(keyframes[0].pose.position.length() < 1e-6 && keyframes[0].pose.ypr().0.abs() < 1e-5);
        // The third to the eighth were taken in one go round the bed, from one height, over 7 units.
        let arc = positions(&imported.path)[2..8].to_vec();
        let (low, high) = heights(&arc);
        assert!(high - low < 0.08 && arc[0].distance(arc[5]) > 5.0, "{low} to {high} over {}", arc[0].distance(arc[5]));
        // Cameras were held level but for the hands' shaking, and looked down at the bed.
        let angles: Vec<(f32, f32, f32)> = keyframes.iter().map(|k| k.pose.ypr()).collect();
        let rms =
            |f: &dyn Fn(&(f32, f32, f32)) -> f32| (angles.iter().map(|a| f(a).powi(2)).sum::<f32>() / 48.0).sqrt().to_degrees();
        assert!(rms(&|a| a.2) < 6.0, "roll {}", rms(&|a| a.2));
        assert!(angles.iter().all(|a| (-55.0..0.0).contains(&a.1.to_degrees())), "{angles:?}");
        let summary = Summary::of(&imported.path);
        assert!(summary.fastest_m_s.0 < 3.0 && summary.fastest_rad_s.0.to_degrees() < 60.0, "{summary:?}");

        let text = import(&model.join("txt/images.txt"), &ImportOptions::default());
        assert_eq!(text.format, Format::ColmapText);
        for (a, b) in text.path.keyframes().iter().zip(keyframes) {
            assert!(a.pose.position.distance(b.pose.position) < 1e-5 && (a.t_s, 0) == (b.t_s, 0));
            assert!((a.pose.orientation - b.pose.orientation).length() < 1e-5);
        }
    }

    #[test]
    #[ignore = "needs ../shared"]
    fn a_point_that_all_cameras_see_is_ahead_of_all() {
        let models = shared("data/colmap");
        let model = models.join("bedroom_plush_mit_rebuilt/txt");
        // The point with the longest track, in the reconstruction's world, and who sees it.
        let points = std::fs::read_to_string(model.join("points3D.txt")).unwrap();
        let rows = points.lines().filter(|l| !l.starts_with('#')).map(|l| l.split(' ').collect::<Vec<_>>());
        let row = rows.max_by_key(Vec::len).unwrap();
        let at = |i: usize| row[i].parse::<f32>().unwrap();
        let point = Vec3::new(at(1), at(2), at(3));
        let seen_by: Vec<&str> = row[8..].iter().step_by(2).copied().collect();
        let images = std::fs::read_to_string(model.join("images.txt")).unwrap();
        let names: Vec<&str> = images
            .lines()
            .filter(|l| l.ends_with(".jpg"))
            .filter(|l| seen_by.contains(&l.split(' ').next().unwrap()))
            .map(|l| l.rsplit(' ').next().unwrap())
            .collect();
        assert!(names.len() > 10, "{}", names.len());
        let up = Vec3::new(0.0, -1.0, 0.0);
        let kept = PlacementOptions { up: Some(up), origin: Some(Origin::Keep), ..PlacementOptions::default() };
        let options = ImportOptions { placement: kept, ..ImportOptions::default() };
        let path = import(&model.join("images.txt"), &options).path;
        let point = glam::Quat::from_rotation_arc(up, Vec3::Z) * point;
        // Images are in the order of their names; the lens of 827 pixels sees 31 degrees to the sides and 25 up and down.
        let mut all: Vec<&str> =
            images.lines().filter(|l| l.ends_with(".jpg")).map(|l| l.rsplit(' ').next().unwrap()).collect();
        all.sort_unstable();
        for (keyframe, name) in path.keyframes().iter().zip(all).filter(|(_, name)| names.contains(name)) {
            let seen = keyframe.pose.to_head(point);
            let (side, height) = ((seen.y / seen.x).atan().to_degrees(), (seen.z / seen.x).atan().to_degrees());
            assert!(seen.x > 0.0 && side.abs() < 33.0 && height.abs() < 27.0, "{name}: {seen}");
        }
    }

    #[test]
    #[ignore = "needs ../shared"]
    fn a_facade_from_the_ground() {
        let models = shared("data/colmap");
        let model = models.join("sceaux_castle_mit");
        let whole = import(&model.join("colmap_example_model_bin/images.bin"), &ImportOptions::default());
        notes_say(&whole, &["numbers in the images' names, 1 a second, assumed"]);
        assert_eq!((whole.path.keyframes().len(), whole.path.duration_s()), (11, 10.0));
        let (low, high) = heights(&positions(&whole.path));
        assert!(high - low < 0.4, "someone who walks 15 units stays on the ground: {low} to {high}");
        for (other, count) in [("colmap_example_model_txt", 11), ("colmap_example_model_not_shared_txt", 11)] {
            let other = import(&model.join(other).join("images.txt"), &ImportOptions::default());
            assert_eq!(other.path.keyframes().len(), count);
            // Text has fewer digits, and the other reconstruction is nearly the same.
            for (a, b) in positions(&other.path).iter().zip(positions(&whole.path)) {
                assert!(a.distance(b) < 0.2, "{a} {b}");
            }
        }
        // Two photographs are missing, and the others are in folders: their numbers still tell the time.
        let folders = model.join("colmap_example_model_txt_missing_cams_and_subfolders/images.txt");
        let folders = import(&folders, &ImportOptions { fps: Some(0.5), ..ImportOptions::default() });
        let times: Vec<f64> = folders.path.keyframes().iter().map(|k| k.t_s).collect();
        assert_eq!(times, [0.0, 2.0, 4.0, 6.0, 12.0, 14.0, 16.0, 18.0, 20.0]);
    }

    #[test]
    #[ignore = "needs ../shared"]
    fn a_roof_from_a_drone_that_looks_down() {
        let models = shared("data/colmap");
        let file = models.join("maupertuis_bsd/samples/maupertuis/colmap/reconstruction/images.txt");
        let imported = import(&file, &ImportOptions::default());
        // Their mean up would lean by 40 degrees.
        for k in imported.path.keyframes() {
            let (_, pitch, roll) = k.pose.ypr();
            assert!(
                (-60.0..-30.0).contains(&pitch.to_degrees()) && roll.to_degrees().abs() < 3.0,
                "{} {}",
                pitch.to_degrees(),
                roll.to_degrees()
            );
        }
    }
}
