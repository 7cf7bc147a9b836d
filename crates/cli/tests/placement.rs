//! Where a world lies in the scene's: `--up`, `--metres-per-unit` and `--origin` mean the same in every command.

use crate::common::{Place, checkpoint, fails, succeeds};
use promenade_baker::Capture;
use promenade_baker::anchors::AnchorSet;
use promenade_core::Scene;
use promenade_core::glam::{Quat, Vec3};
use promenade_core::network::Placement;
use promenade_paths::{ImportOptions, alone, read};
use std::path::Path;

#[test]
fn an_option_of_import_replaces_one_quantity_of_the_anchor_files_placement() {
    let place = Place::new();
    let (anchors, out) = (place.text("anchors.safetensors"), place.text("out.promenade"));
    let mut set = AnchorSet::load(Path::new(&checkpoint("anchors.safetensors"))).unwrap();
    let stated = Placement { units_per_metre: 4.0, rotation: Quat::from_rotation_x(1.0), origin: Vec3::new(1.0, 2.0, 3.0) };
    set.placement = stated;
    set.save(Path::new(&anchors)).unwrap();
    let weights = checkpoint("sh.safetensors");
    let import = |options: &[&str]| {
        succeeds(&[&["import", &weights, "--anchors", &anchors, "-o", &out], options].concat());
        let scene = Scene::from_bytes(&std::fs::read(&out).unwrap()).unwrap();
        (scene.cloud().unwrap().model.parts().placement, scene.provenance().recipe.clone())
    };
    assert_eq!(import(&[]).0, stated);
    assert_eq!(import(&["--metres-per-unit", "0.5"]).0, Placement { units_per_metre: 2.0, ..stated });
    assert_eq!(import(&["--origin", "7,8,9"]).0, Placement { origin: Vec3::new(7.0, 8.0, 9.0), ..stated });
    assert_eq!(import(&["--origin", "keep"]).0, Placement { origin: Vec3::ZERO, ..stated });
    let (upright, recipe) = import(&["--up", "0,-1,0", "--bounds", "0,0,0,4,3,2", "--start", "1,2,1,90,0,0"]);
    assert!((upright.rotation * Vec3::Z).distance(Vec3::NEG_Y) < 1e-6);
    assert_eq!(upright, Placement { rotation: upright.rotation, ..stated });
    assert_eq!(
        recipe,
        "promenade import sh.safetensors --up 0,-1,0 --anchors anchors.safetensors --bounds 0,0,0,4,3,2 \
         --start 1,2,1,90,0,0 --taps 32 --conv off --projection diagonal --seed 1"
    );
    let said = fails(&["import", &weights, "--anchors", &anchors, "-o", &out, "--origin", "first"]);
    assert!(said.contains("option origin: expected keep or a point, where there are no cameras, found first"), "{said}");
}

/// One reconstruction with y down and a unit of half a metre, as a path, as anchors and as a capture.
#[test]
fn paths_anchors_and_captures_with_the_same_options_meet() {
    let place = Place::new();
    let (model, walk, anchors) = (place.text("model"), place.text("walk.json"), place.text("anchors.safetensors"));
    std::fs::create_dir(&model).unwrap();
    let images = "1 1 0 0 0 0 0 0 1 00001.jpg\n\n2 1 0 0 0 0 0 -2 1 00002.jpg\n\n";
    std::fs::write(place.path("model/images.txt"), images).unwrap();
    let points: String = (0..300).map(|i| format!("{i} {} 0 {} 200 100 50 0.5 1 {i} 2 {i}\n", i % 20, i / 20)).collect();
    std::fs::write(place.path("model/points3D.txt"), points).unwrap();
    let frame = |number: u32| format!(r#"{{"file_path":"frames/{number:05}.png"}}"#);
    let camera = |number: u32, z: f32| {
        format!(r#"{{"img_name":"{number:05}","position":[0,0,{z}],"rotation":[[1,0,0],[0,1,0],[0,0,1]]}}"#)
    };
    let list = |name: &str, items: &[String]| format!(r#"{{"{name}":[{}]}}"#, items.join(","));
    std::fs::create_dir(place.path("set")).unwrap();
    let write = |name: &str, text: String| std::fs::write(place.path(&format!("set/{name}")), text).unwrap();
    write("transforms_scale_train.json", list("camera_path", &[frame(1)]));
    write("transforms_scale_val.json", list("camera_path", &[frame(2)]));
    write("gs_cameras.json", format!("[{},{}]", camera(1, 0.0), camera(2, 2.0)));
    for (name, channels) in [("source_syn_re.wav", 1), ("binaural_syn_re.wav", 2)] {
        place.dry(&format!("set/{name}"), 2.0, channels);
    }
    for options in [
        &["--metres-per-unit", "0.5", "--up", "0,-1,0", "--origin", "first"][..],
        &["--scale", "0.5", "--up", "0,-1,0", "--origin", "centroid"],
        &["--metres-per-unit", "0.5", "--up", "0.1,-1,0.2", "--origin", "keep"],
        &["--metres-per-unit", "0.5", "--up", "0,-1,0", "--origin", "-1,2,3"],
    ] {
        succeeds(&[&["path", &model, "-o", &walk], options].concat());
        succeeds(&[&["anchors", &model, "-o", &anchors, "-n", "8", "--neighbours", "4"], options].concat());
        let capture = place.text("capture");
        let set = place.text("set");
        succeeds(&[&["capture", "import", &set, "--layout", "rwavs", "-o", &capture, "--rate", "16000"], options].concat());
        let walk = std::fs::read(&walk).unwrap();
        let walk = read("walk.json", &walk, &ImportOptions::default(), &mut alone).unwrap();
        let capture = Capture::load(Path::new(&capture)).unwrap();
        let placement = AnchorSet::load(Path::new(&anchors)).unwrap().placement;
        for (number, keyframe) in walk.path.keyframes().iter().enumerate() {
            let camera = placement.listener(&keyframe.pose);
            assert!(camera.centre.distance(Vec3::new(0.0, 0.0, 2.0 * number as f32)) < 1e-4, "{options:?}: {camera:?}");
            let clip = capture.clips.iter().find(|c| c.name == format!("{:05}", number + 1)).unwrap();
            assert!(clip.pose.position.distance(keyframe.pose.position) < 1e-4, "{options:?}: {:?}", clip.pose);
            assert!(clip.pose.orientation.angle_between(keyframe.pose.orientation) < 1e-2, "{options:?}: {:?}", clip.pose);
        }
        std::fs::remove_dir_all(place.path("capture")).unwrap();
    }
}
