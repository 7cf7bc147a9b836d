//! `promenade path`, and paths of every form in `promenade render`.

use crate::common::{Place, fails, rms, succeeds};
use promenade_baker::sound;
use std::path::{Path, PathBuf};

#[test]
fn paths_are_converted_and_shown_in_figures() {
    let place = Place::new();
    let (csv, json, back) = (place.text("walk.csv"), place.text("walk.json"), place.text("back.csv"));
    let rows: Vec<String> =
        (0..=600).map(|i| format!("{},{},0,1.7,{},0,0", i as f32 / 60.0, i as f32 / 100.0, i as f32 / 10.0)).collect();
    std::fs::write(&csv, format!("t,x,y,z,yaw,pitch,roll\n{}\n", rows.join("\n"))).unwrap();
    let (figures, _) = succeeds(&["path", &csv]);
    for line in [
        "form          CSV",
        "keyframes     601",
        "duration      10.00 s, from 0.00 s",
        "length        6.00 m",
        "bounds        0.00, 0.00, 1.70 to 6.00, 0.00, 1.70 m",
        "fastest       0.60 m/s",
        "fastest turn  6 degrees/s",
    ] {
        assert!(figures.contains(line), "{line}: {figures}");
    }
    let (_, said) = succeeds(&["path", &csv, "-o", &json, "--simplify", "0.01,0.5", "--scale", "0.5"]);
    assert!(said.contains("walk.json: 2 of 601 keyframes, 10.00 s"), "{said}");
    succeeds(&["path", &json, "-o", &back]);
    assert_eq!(std::fs::read_to_string(&back).unwrap(), "t,x,y,z,yaw,pitch,roll\n0,0,0,0.85,0,0,0\n10,3,0,0.85,60,0,0\n");

    // A folder of a COLMAP model, and what is assumed about it.
    let model = place.path("model/sparse/0");
    std::fs::create_dir_all(&model).unwrap();
    std::fs::write(model.join("images.txt"), "1 1 0 0 0 0 0 0 1 f_1.jpg\n\n2 1 0 0 0 0 0 -2 1 f_2.jpg\n\n").unwrap();
    let model = place.text("model");
    let (figures, _) = succeeds(&["path", &model, "--fps", "4", "--up", "0,-1,0", "--origin", "centroid"]);
    for line in [
        "COLMAP text",
        "duration      0.25 s",
        "bounds        -1.00, 0.00, 0.00 to 1.00, 0.00, 0.00 m",
        "note          the scale",
    ] {
        assert!(figures.contains(line), "{line}: {figures}");
    }
    let (scene, input) = (place.bake(), place.dry("in.wav", 0.3, 1));
    let (_, said) = succeeds(&["render", &scene, &input, &place.text("out.wav"), "--path", &model]);
    assert!(said.contains("note: times are the numbers in the images' names"), "{said}");

    // A glTF file and the buffer beside it.
    let gltf = r#"{"asset":{"version":"2.0"},"nodes":[{"name":"eye","camera":0}],
        "cameras":[{"type":"perspective","perspective":{"yfov":1,"znear":0.1}}],"buffers":[{"byteLength":32,"uri":"ride.bin"}],
        "bufferViews":[{"buffer":0,"byteLength":8},{"buffer":0,"byteOffset":8,"byteLength":24}],
        "accessors":[{"bufferView":0,"componentType":5126,"type":"SCALAR","count":2},
            {"bufferView":1,"componentType":5126,"type":"VEC3","count":2}],
        "animations":[{"name":"ride","samplers":[{"input":0,"output":1}],
            "channels":[{"sampler":0,"target":{"node":0,"path":"translation"}}]}]}"#;
    std::fs::write(place.path("ride.gltf"), gltf).unwrap();
    let floats: [f32; 8] = [0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 1.5, -3.0];
    std::fs::write(place.path("ride.bin"), floats.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<_>>()).unwrap();
    succeeds(&["path", &place.text("ride.gltf"), "-o", &back, "--animation", "ride"]);
    assert_eq!(std::fs::read_to_string(&back).unwrap(), "t,x,y,z,yaw,pitch,roll\n0,0,0,0,0,0,0\n2,3,0,1.5,0,0,0\n");
    std::fs::remove_file(place.path("ride.bin")).unwrap();

    let before = place.names();
    std::fs::remove_dir_all(place.path("model/sparse")).unwrap();
    for (args, clue) in [
        (vec!["path", &place.text("ride.gltf")], "ride.gltf: its buffer ride.bin cannot be read: "),
        (vec!["path", &place.text("in.wav")], "in.wav: expected a sound file with moves of objects (chunk axml), found none"),
        (vec!["path", &model], "expected a COLMAP model, a folder with images.bin, images.txt or sparse/0/images.bin"),
        (vec!["path", &csv, "-o", &place.text("x.glb")], "expected a name ending in .json or .csv"),
        (vec!["path", &csv, "-o", &place.text("no/such/x.csv")], "cannot be written"),
        (vec!["path", &csv, "--animation", "ride"], "option animation: expected a glTF animation, found a path in CSV"),
        (vec!["path", &place.text("none.csv")], "none.csv: cannot be read"),
    ] {
        let said = fails(&args);
        assert!(said.contains(clue), "{args:?}: {said}");
        assert_eq!(place.names(), before, "{args:?} left something behind");
    }
}

mod needs_shared {
    use super::*;
    use promenade_testing::shared;

    /// The way round a bed that photographs tell, through a factory scene.
    #[test]
    #[ignore = "needs ../shared"]
    fn a_reconstructed_walk_is_rendered() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let model = shared("data/colmap/bedroom_plush_mit_rebuilt/bin");
        let folder = tempfile::tempdir().unwrap();
        let text = |path: PathBuf| path.to_str().unwrap().to_owned();
        let (scene, speech) = (text(root.join("presets/scenes/iosr-room-b.promenade")), text(root.join("data/speech.wav")));
        let (walk, wet, still) =
            (folder.path().join("bed.json"), folder.path().join("wet.wav"), folder.path().join("still.wav"));
        let (walk, wet, still) = (text(walk), text(wet), text(still));
        succeeds(&["path", &text(model), "-o", &walk]);
        succeeds(&["render", &scene, &speech, &wet, "--path", &walk, "--bits", "32f"]);
        succeeds(&["render", &scene, &speech, &still, "--pose", "0,0,0,0,0,0", "--bits", "32f"]);
        // Reading refuses what is not finite.
        let (wet, still) = (sound::read(Path::new(&wet)).unwrap(), sound::read(Path::new(&still)).unwrap());
        for ear in 0..2 {
            assert!(rms(&wet.channels[ear]) > 1e-3 && wet.channels[ear].iter().all(|v| v.is_finite()));
        }
        let apart: Vec<f32> = wet.channels[0].iter().zip(&still.channels[0]).map(|(a, b)| a - b).collect();
        assert!(rms(&apart) > 0.3 * rms(&still.channels[0]), "walking is heard");
    }
}
