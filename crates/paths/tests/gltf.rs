//! Animations in glTF and GLB, held against their definition.

use crate::common::{Gltf, cart};
use glam::Vec3;
use promenade_paths::{CameraPath, ImportOptions, Imported, PathFileError, Pose, alone, read};
use serde_json::json;

fn import(bytes: &[u8], options: &ImportOptions) -> Result<Imported, String> {
    let said =
        |e: PathFileError| format!("{e}: {}", std::error::Error::source(&e).map(ToString::to_string).unwrap_or_default());
    read("a.gltf", bytes, options, &mut alone).map_err(said)
}

fn named(name: &str) -> ImportOptions {
    ImportOptions { animation: Some(name.to_owned()), ..ImportOptions::default() }
}

fn path(gltf: &Gltf) -> CameraPath {
    import(&gltf.glb(), &ImportOptions::default()).unwrap().path
}

fn assert_pose(path: &CameraPath, t_s: f64, position: Vec3, ahead: Vec3, up: Vec3) {
    let Pose { position: p, orientation: q } = path.pose_at(t_s);
    assert!(p.distance(position) < 2e-3, "{t_s} s: at {p}, expected {position}");
    assert!((q * Vec3::X).distance(ahead) < 3e-3, "{t_s} s: ahead is {}, expected {ahead}", q * Vec3::X);
    assert!((q * Vec3::Z).distance(up) < 3e-3, "{t_s} s: up is {}, expected {up}", q * Vec3::Z);
}

#[test]
fn a_camera_rides_on_its_parents() {
    let path = path(&cart());
    assert_eq!((path.keyframes()[0].t_s, path.duration_s()), (0.0, 2.5));
    // glTF: the root stands 1 up and doubles, the camera is 0.5 above the cart, which goes 1 a second to -z, our x.
    assert_pose(&path, 0.0, Vec3::new(0.0, 0.0, 2.0), Vec3::X, Vec3::Z);
    let left = |degrees: f32| Vec3::new(degrees.to_radians().cos(), degrees.to_radians().sin(), 0.0);
    // The cart turns by 90 degrees to the left within a second.
    assert_pose(&path, 1.0, Vec3::new(1.0, 0.0, 2.0), left(45.0), Vec3::Z);
    assert_pose(&path, 1.25, Vec3::new(1.5, 0.0, 2.0), left(67.5), Vec3::Z);
    assert_pose(&path, 1.9, Vec3::new(2.8, 0.0, 2.0), left(90.0), Vec3::Z);
    // The camera's step of 0.25, doubled.
    assert_pose(&path, 2.0, Vec3::new(3.0, 0.0, 2.5), left(90.0), Vec3::Z);
    assert_pose(&path, 2.5, Vec3::new(4.0, 0.0, 2.5), left(90.0), Vec3::Z);
    assert!(path.keyframes().len() < 20, "{} keyframes", path.keyframes().len());
}

#[test]
fn buffers_are_inside_beside_or_in_the_glb() {
    let gltf = cart();
    let whole = path(&gltf);
    assert_eq!(import(&gltf.embedded(), &ImportOptions::default()).unwrap().path, whole);
    let mut asked = Vec::new();
    let mut beside = |name: &str| {
        asked.push(name.to_owned());
        Ok(gltf.bytes.clone())
    };
    let json = gltf.beside("my%20ride/data.bin");
    assert_eq!(read("a.gltf", &json, &ImportOptions::default(), &mut beside).unwrap().path, whole);
    assert_eq!(asked, ["my ride/data.bin"], "once");
    let error = import(&json, &ImportOptions::default()).unwrap_err();
    assert!(error.contains("a.gltf: its buffer my%20ride/data.bin cannot be read: only the file itself is here"), "{error}");
    for uri in [
        "../secret.bin",
        "/etc/passwd",
        "%2Fetc/passwd",
        "a/%2e%2e/b",
        "C:\\x",
        "http://example.org/a.bin",
        "file:///a.bin",
        "",
    ] {
        let error = import(&gltf.beside(uri), &ImportOptions::default()).unwrap_err();
        assert!(error.contains("buffer 0: expected the name of a file beside it or below"), "{uri}: {error}");
    }
    for uri in ["data:application/octet-stream,abc", "data:;base64,&&&"] {
        let error = import(&gltf.beside(uri), &ImportOptions::default()).unwrap_err();
        assert!(error.contains("buffer 0: expected a data URI in base64"), "{uri}: {error}");
    }
}

#[test]
fn splines_and_integers_are_read() {
    let mut gltf = Gltf::new();
    let camera = gltf.node(json!({"camera": 0}));
    let animation = gltf.animation("spline");
    // From 0 to -4 along z in 2 s, leaving and coming at rest: 3 u^2 - 2 u^3.
    let key = |value: f32| [[0.0; 3], [0.0, 0.0, value], [0.0; 3]].concat();
    gltf.animate(animation, camera, "translation", "CUBICSPLINE", &[0.0, 2.0], &[key(0.0), key(-4.0)].concat());
    // A quarter turn to the left in 16-bit integers.
    let half = (32767.0 * std::f32::consts::FRAC_1_SQRT_2).round() as i16;
    let bytes: Vec<u8> = [0, 0, 0, 32767, 0, half, 0, half].iter().flat_map(|v: &i16| v.to_le_bytes()).collect();
    let (input, output) = (gltf.floats("SCALAR", &[0.0, 2.0]), gltf.accessor(5122, "VEC4", 2, &bytes));
    gltf.json["accessors"][output]["normalized"] = json!(true);
    gltf.channel(animation, camera, "rotation", "LINEAR", [input, output]);
    let path = path(&gltf);
    for t in [0.0_f32, 0.3, 1.0, 1.5, 2.0] {
        let u = t / 2.0;
        let angle = u * std::f32::consts::FRAC_PI_2;
        let at = Vec3::new(4.0 * (3.0 * u * u - 2.0 * u * u * u), 0.0, 0.0);
        assert_pose(&path, f64::from(t), at, Vec3::new(angle.cos(), angle.sin(), 0.0), Vec3::Z);
    }
}

#[test]
fn matrices_and_uneven_scales_keep_the_head_square() {
    let mut gltf = Gltf::new();
    // Column by column: x to y, y to -x (a roll to the left), z stays; then moved by 3 to the right.
    let matrix = json!([0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 3, 0, 0, 1]);
    gltf.node(json!({"matrix": matrix, "children": [1]}));
    let camera = gltf.node(json!({"camera": 0, "scale": [1.0, 3.0, 1.0]}));
    let animation = gltf.animation("a");
    gltf.animate(animation, camera, "translation", "LINEAR", &[0.0, 1.0], &[0.0, 0.0, 0.0, 0.0, 2.0, 0.0]);
    let path = path(&gltf);
    // Up of the camera is glTF's -x, our left; it goes from 3 right to 1 right.
    assert_pose(&path, 0.0, Vec3::new(0.0, -3.0, 0.0), Vec3::X, Vec3::Y);
    assert_pose(&path, 1.0, Vec3::new(0.0, -1.0, 0.0), Vec3::X, Vec3::Y);
}

#[test]
fn the_first_animated_camera_or_what_is_named() {
    let mut gltf = cart();
    gltf.node(json!({"name": "door"}));
    let other = gltf.node(json!({"name": "second eye", "camera": 0}));
    let (open, look) = (gltf.animation("open"), gltf.animation("look"));
    gltf.animate(open, 3, "translation", "LINEAR", &[0.0, 7.0], &[0.0; 6]);
    gltf.animate(look, other, "translation", "LINEAR", &[0.0, 5.0], &[0.0; 6]);
    let choose = |options: &ImportOptions| import(&gltf.glb(), options).map(|i| (i.path.duration_s(), i.notes.join("; ")));
    let (duration, notes) = choose(&ImportOptions::default()).unwrap();
    assert_eq!(duration, 2.5);
    assert!(notes.contains("the first of 2 animated cameras; the others: camera \"second eye\""), "{notes}");
    assert_eq!(choose(&named("look")).unwrap().0, 5.0, "by the animation's name");
    assert_eq!(choose(&named("second eye")).unwrap().0, 5.0, "by the node's name");
    let (duration, notes) = choose(&named("open")).unwrap();
    assert_eq!(duration, 7.0);
    assert!(notes.contains("node \"door\" has no camera; it looks along its -z axis"), "{notes}");
    assert_eq!(choose(&named("cart")).unwrap().0, 2.0, "a node that carries a camera");
    assert_eq!(choose(&named("Lens")).unwrap().0, 2.5, "by the camera's own name");
    let error = choose(&named("nobody")).unwrap_err();
    assert!(
        error.contains(
            "expected an animation, camera or node called \"nobody\", found none of them; there are animations \"ride\""
        ),
        "{error}"
    );
    let error = choose(&named("root")).unwrap_err();
    assert!(error.contains("expected an animation of the position or rotation"), "{error}");
}

#[test]
fn the_rate_of_samples_is_bounded() {
    let mut gltf = Gltf::new();
    gltf.node(json!({"camera": 0}));
    let animation = gltf.animation("long");
    gltf.animate(animation, 0, "translation", "LINEAR", &[0.0, 1e6], &[0.0; 6]);
    let error = import(&gltf.glb(), &ImportOptions::default()).unwrap_err();
    assert!(error.contains("expected an animation of at most 1000000 steps"), "{error}");
    let slow = ImportOptions { fps: Some(0.01), ..ImportOptions::default() };
    assert_eq!(import(&gltf.glb(), &slow).unwrap().path.keyframes().len(), 2);
}

#[test]
fn errors_name_what_is_wrong() {
    let change = |pointer: &str, value: serde_json::Value| {
        let mut gltf = cart();
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        let parent = gltf.json.pointer_mut(parent).unwrap_or_else(|| panic!("{pointer}"));
        match parent.as_array_mut() {
            Some(list) => list[key.parse::<usize>().unwrap()] = value,
            None => parent[key] = value,
        }
        import(&gltf.glb(), &ImportOptions::default()).unwrap_err()
    };
    for (pointer, value, clue) in [
        ("/asset/version", json!("1.0"), "expected glTF of version 2, found version \"1.0\""),
        ("/animations", json!([]), "expected an animation, found none"),
        ("/nodes/0/children", json!([9]), "node 0: expected children among 3 nodes, found number 9"),
        ("/nodes/0/children", json!([1, 1]), "node 0: expected children of its own, found node 1"),
        ("/nodes/2", json!({"camera": 0, "children": [0]}), "expected at most 1000 parents, found more, or a circle"),
        ("/nodes/2/translation", json!([0, 1e39, 0]), "node 2: expected a transform"),
        ("/nodes/0/scale", json!([0, 0, 0]), "camera \"eye\": expected a direction at 0 s"),
        (
            "/animations/0/channels/0/target/node",
            json!(77),
            "animation 0: expected a channel for one of 3 nodes, found number 77",
        ),
        (
            "/animations/0/channels/0/sampler",
            json!(9),
            "animation 0: expected a channel with one of 3 samplers, found number 9",
        ),
        ("/animations/0/samplers/0/interpolation", json!("BEZIER"), "translation of node 1: expected an interpolation LINEAR"),
        (
            "/animations/0/samplers/0/interpolation",
            json!("CUBICSPLINE"),
            "translation of node 1: expected 6 values for 2 keys, found 2",
        ),
        ("/animations/0/samplers/0/input", json!(99), "accessor 99: expected one of 6 accessors"),
        ("/accessors/1/type", json!("VEC2"), "accessor 1: expected elements of type Vec3"),
        ("/accessors/1/componentType", json!(5123), "accessor 1: expected components of 32-bit floats"),
        ("/accessors/1/count", json!(3), "accessor 1: expected 3 elements inside its buffer view and buffer"),
        ("/accessors/1/count", json!(u64::MAX), "accessor 1: expected at most 3000000 elements"),
        ("/accessors/0/count", json!(0), "translation of node 1: expected keys, found none"),
        (
            "/accessors/1",
            json!({"count": 2, "componentType": 5126, "type": "VEC3"}),
            "accessor 1: expected a buffer view, found none",
        ),
        ("/bufferViews/1/byteOffset", json!(u64::MAX), "accessor 1: expected 2 elements inside"),
        ("/bufferViews/1/byteStride", json!(4), "accessor 1: expected elements at least 12 bytes apart, found 4"),
        ("/bufferViews/1/buffer", json!(3), "buffer 3: expected one of 1 buffers"),
    ] {
        let error = change(pointer, value);
        assert!(error.contains(clue), "{pointer}: {error}");
    }
    let with_times = |times: &[f32]| {
        let mut gltf = Gltf::new();
        gltf.node(json!({"camera": 0}));
        gltf.animation("a");
        gltf.animate(0, 0, "translation", "LINEAR", times, &[0.0; 6]);
        import(&gltf.glb(), &ImportOptions::default()).unwrap_err()
    };
    let error = with_times(&[1.0, 1.0]);
    assert!(error.contains("translation of node 0: expected a time after 1 s at key 1, found 1 s"), "{error}");
    let error = with_times(&[0.0, f32::NAN]);
    assert!(error.contains("accessor 0: expected finite numbers"), "{error}");
    let mut short = cart();
    short.bytes.truncate(40);
    short.json["x"] = json!(0);
    let error = import(&short.glb(), &ImportOptions::default()).unwrap_err();
    assert!(error.contains("elements inside its buffer view and buffer"), "{error}");
    let error = import(b"{\"asset\": 1}", &ImportOptions::default()).unwrap_err();
    assert!(error.contains("not the JSON that is expected here") && error.contains("line 1"), "{error}");
    let error = read("a.glb", b"glTF\x02\0\0\0\x01\0\0\0", &ImportOptions::default(), &mut alone).unwrap_err().to_string();
    assert!(error.contains("expected a GLB file with its header"), "{error}");
}

#[test]
fn a_file_without_a_camera_or_with_one_that_stands_still() {
    let mut gltf = cart();
    gltf.json["nodes"][2].as_object_mut().unwrap().remove("camera");
    let imported = import(&gltf.glb(), &ImportOptions::default()).unwrap();
    assert!(imported.notes[0].contains("node \"cart\" has no camera"), "{:?}", imported.notes);
    let mut still = Gltf::new();
    still.node(json!({"camera": 0}));
    still.node(json!({}));
    still.animation("weights");
    still.animate(0, 1, "scale", "LINEAR", &[0.0, 1.0], &[1.0; 6]);
    let error = import(&still.glb(), &ImportOptions::default()).unwrap_err();
    assert!(error.contains("found none; there are animations \"weights\" and camera \"Lens\""), "{error}");
}
