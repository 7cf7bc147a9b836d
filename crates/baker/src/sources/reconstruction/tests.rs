use super::*;
use promenade_core::Pose;
use promenade_core::glam::Quat;
use promenade_core::network::HARMONIC;
use promenade_paths::{ImportOptions, Origin};

const ALL: PointOptions = PointOptions { min_track: 0, max_error_px: f64::INFINITY, min_opacity: 0.0 };

/// Two points, seen in 2 and 1 images.
fn binary_points() -> Vec<u8> {
    let mut bytes = 2_u64.to_le_bytes().to_vec();
    for (id, (position, error, track)) in [([1.0, -2.0, 3.5], 0.5, 2_u64), ([0.0, 4.0, 0.25], 1.5, 1)].iter().enumerate() {
        bytes.extend((id as u64).to_le_bytes());
        bytes.extend(position.iter().flat_map(|v: &f64| v.to_le_bytes()));
        bytes.extend([255, 0, 51 * id as u8]);
        bytes.extend(f64::to_le_bytes(*error));
        bytes.extend(track.to_le_bytes());
        bytes.extend(vec![7; 8 * *track as usize]);
    }
    bytes
}

const TEXT_POINTS: &str = "# 3D point list\n0 1 -2 3.5 255 0 0 0.5 1 10 2 11\n\n1 0 4 0.25 255 0 51 1.5 3 12\n";

const IMAGES: &str = "1 1 0 0 0 0 0 0 1 a_01.jpg\n\n2 0.7071067811865476 0 -0.7071067811865476 0 2 0.5 -1 1 a_02.jpg\n\n";

fn points(name: &str, bytes: &[u8], options: &PointOptions) -> Result<(Vec<Point>, usize), String> {
    let good = colmap::points(Path::new(name), bytes, options).map_err(|e| e.to_string())?;
    assert!(good.sights.iter().all(|[_, point]| (*point as usize) < good.points.len()));
    Ok((good.points, good.left_out))
}

#[test]
fn binary_and_text_hold_the_same_points() {
    let (binary, _) = points("points3D.bin", &binary_points(), &ALL).unwrap();
    assert_eq!(binary, points("points3D.txt", TEXT_POINTS.as_bytes(), &ALL).unwrap().0);
    assert_eq!(binary[1], Point { position: Vec3::new(0.0, 4.0, 0.25), colour: [1.0, 0.0, 0.2] });
    for options in [PointOptions { min_track: 2, ..ALL }, PointOptions { max_error_px: 1.0, ..ALL }] {
        let good = points("points3D.bin", &binary_points(), &options).unwrap();
        assert_eq!((good.0.len(), good.1), (1, 1), "the second is seen once, with an error of 1.5");
        assert_eq!(good, points("points3D.txt", TEXT_POINTS.as_bytes(), &options).unwrap());
    }
}

#[test]
fn damaged_points_are_errors() {
    let whole = binary_points();
    for length in 0..whole.len() {
        let error = points("points3D.bin", &whole[..length], &ALL).unwrap_err();
        assert!(error.starts_with("points3D.bin: byte "), "cut to {length} bytes: {error}");
    }
    for i in 0..whole.len() {
        let mut flipped = whole.clone();
        flipped[i] ^= 0xff;
        // Numbers may be others; nothing may panic or be allocated that is not there.
        let _ = points("points3D.bin", &flipped, &ALL);
    }
    let says = |bytes: &[u8], clue: &str| {
        let error = points("points3D.bin", bytes, &ALL).unwrap_err();
        assert!(error.contains(clue), "{error}");
    };
    let with = |at: usize, bytes: &[u8]| [&whole[..at], bytes, &whole[at + bytes.len()..]].concat();
    says(&with(0, &u64::MAX.to_le_bytes()), "byte 0: expected at most 2 points in 134 bytes");
    says(&with(51, &u64::MAX.to_le_bytes()), "bytes of a track");
    says(&with(16, &f64::NAN.to_le_bytes()), "byte 8: expected a point with a finite position");
    says(&with(16, &1e300_f64.to_le_bytes()), "a finite position");
    says(&[&whole[..], &[1]].concat(), "expected the end after 2 points, found 1 bytes more");
    for (text, clue) in [
        ("1 0 0 0 255 0 300 0.5", "line 1: expected POINT3D_ID X Y Z R G B ERROR"),
        ("\n1 0 0 zero 255 0 0 0.5", "line 2: expected POINT3D_ID"),
        ("1 0 0 0 1 2 3 0.5 7", "pairs of IMAGE_ID"),
        ("1 inf 0 0 1 2 3 0.5", "line 1: expected a point with a finite position"),
    ] {
        let error = points("points3D.txt", text.as_bytes(), &ALL).unwrap_err();
        assert!(error.contains(clue), "{error}");
    }
    assert!(points("points3D.txt", b"\xff", &ALL).unwrap_err().contains("text in UTF-8"));
}

fn model(folder: &Path) {
    std::fs::create_dir_all(folder).unwrap();
    std::fs::write(folder.join("points3D.bin"), binary_points()).unwrap();
    std::fs::write(folder.join("images.txt"), IMAGES).unwrap();
}

#[test]
fn a_model_is_found_in_its_folder() {
    let folder = tempfile::tempdir().unwrap();
    let error = Reconstruction::load(folder.path(), &ALL).unwrap_err().to_string();
    assert!(error.contains("points3D.bin or points3D.txt or with sparse/0"), "{error}");
    model(&folder.path().join("sparse/0"));
    let found = Reconstruction::load(folder.path(), &ALL).unwrap();
    assert_eq!((found.points.len(), found.cameras.len()), (2, 2));
    assert_eq!(Reconstruction::load_cameras(folder.path()).unwrap(), found.cameras);
    let head: Pose = found.cameras[1].head();
    assert!((head.position - Vec3::new(1.0, -0.5, 2.0)).length() < 1e-6, "{}", head.position);
    std::fs::remove_file(folder.path().join("sparse/0/images.txt")).unwrap();
    assert!(Reconstruction::load(folder.path(), &ALL).unwrap_err().to_string().contains("images.bin or images.txt"));
}

#[test]
fn a_reconstruction_lies_where_the_path_of_its_cameras_does() {
    let folder = tempfile::tempdir().unwrap();
    model(folder.path());
    let place = Reconstruction::load(folder.path(), &ALL).unwrap();
    let landmarks = [&Landmark::Camera("01.jpg".to_owned()), &Landmark::Point(Vec3::new(0.0, 0.0, 4.0))];
    let metres_per_unit = Some(place.metres_per_unit(landmarks, 2.0).unwrap());
    for origin in [None, Some(Origin::First), Some(Origin::Centroid), Some(Origin::Keep), Some(Origin::Point(Vec3::ONE))] {
        let options = PlacementOptions { metres_per_unit, origin, up: None };
        let placement = place.place(&options, &mut Vec::new()).unwrap();
        assert!((placement.units_per_metre - 2.0).abs() < 1e-6, "two units a metre");
        let import = ImportOptions { placement: options, ..ImportOptions::default() };
        let path = promenade_paths::read("images.txt", IMAGES.as_bytes(), &import, &mut promenade_paths::alone).unwrap().path;
        for (camera, keyframe) in place.cameras.iter().zip(path.keyframes()) {
            let listener = placement.listener(&keyframe.pose);
            assert!(listener.centre.distance(camera.centre().as_vec3()) < 1e-5, "{origin:?}: {}", camera.name);
            let ahead = camera.head().orientation * Vec3::X;
            assert!((listener.camera_to_world * Vec3::Z).distance(ahead) < 1e-5, "{origin:?}: {}", camera.name);
        }
    }
}

#[test]
fn what_cannot_be_placed_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    model(folder.path());
    let mut place = Reconstruction::load(folder.path(), &ALL).unwrap();
    let camera = |name: &str| Landmark::Camera(name.to_owned());
    for (name, clue) in [
        (".jpg", "found \".jpg\", with which 2 of 2 images end"),
        ("b", "with which 0 of 2"),
        ("a_01.jpg", "expected places that lie apart, found 0 units"),
    ] {
        let error = place.metres_per_unit([&camera(name), &camera("a_01.jpg")], 1.0).unwrap_err().to_string();
        assert!(error.contains(clue), "{error}");
    }
    let none = PlacementOptions::default();
    let fails = |place: &Reconstruction, options: PlacementOptions, clue: &str| {
        let error = place.place(&options, &mut Vec::new()).unwrap_err().to_string();
        assert!(error.contains(clue), "{error}");
    };
    fails(&place, PlacementOptions { metres_per_unit: Some(-1.0), ..none }, "metres-per-unit");
    place.cameras.clear();
    let first = PlacementOptions { origin: Some(Origin::First), ..none };
    fails(&place, first, "keep or a point, where there are no cameras, found first");
    let mut notes = Vec::new();
    let up = PlacementOptions { up: Some(Vec3::NEG_Y), origin: Some(Origin::Point(Vec3::ONE)), ..none };
    let placement = place.place(&up, &mut notes).unwrap();
    assert!((placement.rotation * Vec3::Z).distance(Vec3::NEG_Y) < 1e-6 && placement.origin == Vec3::ONE);
    assert!(notes.iter().any(|n| n.contains("one unit is taken as 1 m")), "{notes:?}");
    assert_eq!(place.place(&none, &mut notes).unwrap().rotation, Quat::IDENTITY);
}

/// The same two vertices in the three encodings.
fn clouds(properties: &[(&str, &str, [f32; 2])]) -> Vec<Vec<u8>> {
    let head = |encoding: &str| {
        let lines: String = properties.iter().map(|(kind, name, _)| format!("property {kind} {name}\n")).collect();
        format!("ply\nformat {encoding} 1.0\ncomment a test\nelement vertex 2\n{lines}end_header\n").into_bytes()
    };
    let binary = |big: bool| {
        let mut bytes = head(if big { "binary_big_endian" } else { "binary_little_endian" });
        for i in 0..2 {
            for (kind, _, values) in properties {
                match (*kind, big) {
                    ("uchar", _) => bytes.push(values[i] as u8),
                    ("double", true) => bytes.extend(f64::from(values[i]).to_be_bytes()),
                    ("double", false) => bytes.extend(f64::from(values[i]).to_le_bytes()),
                    (_, true) => bytes.extend(values[i].to_be_bytes()),
                    (_, false) => bytes.extend(values[i].to_le_bytes()),
                }
            }
        }
        bytes
    };
    let mut ascii = head("ascii");
    for i in 0..2 {
        let words: Vec<String> = properties.iter().map(|p| p.2[i].to_string()).collect();
        ascii.extend((words.join(" ") + "\n").into_bytes());
    }
    vec![ascii, binary(false), binary(true)]
}

fn read_ply(bytes: &[u8], options: &PointOptions) -> Result<Place, String> {
    ply::read(Path::new("cloud.ply"), bytes, options)
        .map_err(|e| format!("{e}: {}", std::error::Error::source(&e).map(ToString::to_string).unwrap_or_default()))
}

#[test]
fn clouds_and_splats_in_every_encoding() {
    let xyz = [("float", "x", [1.0, -1.5]), ("double", "y", [2.0, 0.0]), ("float", "z", [-3.0, 0.5])];
    let bytes = [("uchar", "red", [255.0, 0.0]), ("uchar", "green", [51.0, 102.0]), ("uchar", "blue", [0.0, 255.0])];
    let floats = [("float", "red", [1.0, 0.0]), ("float", "green", [0.2, 0.4]), ("float", "blue", [0.0, 1.0])];
    let extra = ("float", "nx", [9.0, 9.0]);
    for colours in [bytes, floats] {
        for file in clouds(&[&xyz[..], &[extra], &colours].concat()) {
            let Place::Points(found) = read_ply(&file, &ALL).unwrap() else { panic!("no points") };
            assert_eq!((found.points.len(), found.left_out), (2, 0));
            let second = found.points[1];
            assert_eq!(second.position, Vec3::new(-1.5, 0.0, 0.5));
            assert!(second.colour.iter().zip([0.0, 0.4, 1.0]).all(|(a, b)| (a - b).abs() < 1e-6), "{second:?}");
        }
    }
    let splat = [
        ("float", "f_dc_0", [0.3, 9.0]),
        ("float", "f_dc_1", [-0.2, -9.0]),
        ("float", "f_dc_2", [0.0, 0.0]),
        ("float", "f_rest_0", [5.0, 5.0]),
        ("float", "opacity", [-1.0, 2.0]),
    ];
    for file in clouds(&[&xyz[..], &splat].concat()) {
        let Place::Points(all) = read_ply(&file, &ALL).unwrap() else { panic!("no points") };
        let expected = [0.5 + 0.3 * HARMONIC, 0.5 - 0.2 * HARMONIC, 0.5];
        assert!(all.points[0].colour.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6));
        assert_eq!(all.points[1].colour, [1.0, 0.0, 0.5], "limited to colours");
        // A logit of -1 is an opacity of 0.27.
        let Place::Points(solid) = read_ply(&file, &PointOptions { min_opacity: 0.3, ..ALL }).unwrap() else { panic!() };
        assert_eq!((solid.points.len(), solid.left_out, solid.points[0]), (1, 1, all.points[1]));
    }
    let plain = clouds(&xyz);
    let Place::Points(grey) = read_ply(&plain[0], &ALL).unwrap() else { panic!("no points") };
    assert_eq!(grey.points[0].colour, [0.5; 3]);
}

#[test]
fn damaged_clouds_are_errors() {
    let xyz = [("float", "x", [1.0, -1.5]), ("float", "y", [2.0, 0.0]), ("float", "z", [-3.0, 0.5])];
    let files = clouds(&xyz);
    for (encoding, file) in files.iter().enumerate() {
        let header = file.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
        for length in 0..file.len() {
            let cut = read_ply(&file[..length], &ALL);
            // A text that lacks only its last digits is another text.
            assert!(cut.is_err() || (encoding == 0 && length + 4 > file.len()), "cut to {length} of {}", file.len());
        }
        for i in 0..file.len() {
            let mut flipped = file.clone();
            flipped[i] ^= 0x80;
            let read = read_ply(&flipped, &ALL);
            assert!(i >= header || read.is_err() || (20..60).contains(&i), "byte {i}");
        }
    }
    let text = String::from_utf8(files[0].clone()).unwrap();
    for (from, to, clue) in [
        ("vertex 2", "vertex 18446744073709551615", "element vertex: expected at most"),
        ("vertex 2", "vertex 3", "no readable PLY file"),
        ("float z", "float w", "expected properties x, y and z, found x, y, w"),
        ("element vertex", "element point", "expected an element vertex, found none"),
        ("-1.5", "1e999", "vertex 1: expected a finite position"),
        ("float z", "int z", "no readable PLY file"),
    ] {
        let error = read_ply(text.replace(from, to).as_bytes(), &ALL).unwrap_err();
        assert!(error.contains(clue), "{from} -> {to}: {error}");
    }
}

const SQUARE: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty \
    uchar red\n\
    property uchar green\nproperty uchar blue\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
    0 0 0 0 0 0\n2 0 0 255 0 0\n2 2 0 255 255 0\n0 2 0 0 255 0\n4 0 1 2 3\n";

#[test]
fn surfaces_are_sampled_evenly_with_their_colours() {
    let Place::Surface(square) = read_ply(SQUARE.as_bytes(), &ALL).unwrap() else { panic!("no surface") };
    assert_eq!((square.triangles(), square.area()), (2, 4.0));
    let points = square.sample(4000, 1).unwrap();
    assert_eq!((points.len(), &points), (4000, &square.sample(4000, 1).unwrap()));
    assert_ne!(points, square.sample(4000, 2).unwrap());
    let mut quarters = [0_i32; 4];
    for p in &points {
        assert!(p.position.z == 0.0 && p.position.cmpge(Vec3::ZERO).all() && p.position.cmple(Vec3::splat(2.0)).all());
        // On this square colours are the place.
        assert!((p.colour[0] - p.position.x / 2.0).abs() < 1e-5 && (p.colour[1] - p.position.y / 2.0).abs() < 1e-5, "{p:?}");
        quarters[usize::from(p.position.x > 1.0) + 2 * usize::from(p.position.y > 1.0)] += 1;
    }
    assert!(quarters.iter().all(|q| (q - 1000).abs() < 150), "{quarters:?}");
    for (from, to, clue) in [
        ("4 0 1 2 3", "4 0 1 2 4", "face 0: expected vertices 0 to 3, found 4"),
        ("4 0 1 2 3", "2 0 1", "3 vertices or more"),
        ("4 0 1 2 3", "3 0 1 -1", "found -1"),
    ] {
        let error = read_ply(SQUARE.replace(from, to).as_bytes(), &ALL).unwrap_err();
        assert!(error.contains(clue), "{error}");
    }
    let Place::Surface(flat) = read_ply(SQUARE.replace("4 0 1 2 3", "3 0 1 1").as_bytes(), &ALL).unwrap() else { panic!() };
    assert!(flat.sample(10, 1).unwrap_err().to_string().contains("an area above 0"));
}

#[test]
fn the_work_for_a_surface_is_bounded_whatever_area_it_claims() {
    let sized = |edge: &str| {
        let text = SQUARE.replace("\n2 ", &format!("\n{edge} ")).replace(" 2 0 ", &format!(" {edge} 0 "));
        let Place::Surface(square) = read_ply(text.as_bytes(), &ALL).unwrap() else { panic!("no surface") };
        square.sample_voxels(0.25, 1)
    };
    assert_eq!(sized("2").unwrap().len(), 1000, "a few square metres");
    assert_eq!(sized("100").unwrap().len(), 1_920_000);
    for (edge, found) in [("1000", "found 1.920e8 points for 1.000e6 square units"), ("1e30", "found inf points")] {
        let error = sized(edge).unwrap_err().to_string();
        assert!(error.contains("at most 2000000 points") && error.contains(found), "{error}");
    }
}

#[test]
fn obj_meshes_have_the_colours_of_vertices_or_materials() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("room.obj");
    let read = |text: &str| {
        std::fs::write(&file, text).unwrap();
        Place::load(&file, &ALL).map_err(|e| e.to_string())
    };
    std::fs::write(folder.path().join("room.mtl"), "newmtl wood\nKd 0.6 0.4 0.2\n").unwrap();
    let corners = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    for (text, colour) in [
        (format!("mtllib room.mtl\n{corners}usemtl wood\nf 1 2 3 4\n"), [0.6, 0.4, 0.2]),
        (format!("mtllib gone.mtl\n{corners}f 1 2 3 4\n"), [0.5; 3]),
        (corners.replace("0\nv", "0 0.1 0.2 0.3\nv").replace("1 0\n", "1 0 0.1 0.2 0.3\n") + "f 1 2 3 4\n", [0.1, 0.2, 0.3]),
    ] {
        let Place::Surface(square) = read(&text).unwrap() else { panic!("no surface") };
        assert!((square.area() - 1.0).abs() < 1e-6 && square.triangles() == 2, "{text}");
        let point = square.sample(1, 1).unwrap()[0];
        assert!(point.colour.iter().zip(colour).all(|(a, b)| (a - b).abs() < 1e-6), "{text}: {point:?}");
    }
    let whole = format!("{corners}f 1 2 3 4\n");
    for length in 0..whole.len() {
        let _ = read(&whole[..length]);
    }
    assert!(read(corners).unwrap_err().contains("a mesh with triangles, found none"));
    assert!(read(&format!("{corners}f 1 2 9\n")).is_err());
    assert!(read("v nan 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n").is_err());
    assert!(Place::load(&folder.path().join("room.stl"), &ALL).unwrap_err().to_string().contains("found the ending \"stl\""));
}

mod needs_shared {
    use super::*;
    use promenade_testing::shared;

    /// The models of `../shared/data/colmap` beside the checkout.
    #[test]
    #[ignore = "needs ../shared"]
    fn models_that_colmap_made() {
        let models = shared("data/colmap");
        let load = |name: &str| Reconstruction::load(&models.join(name), &ALL).unwrap_or_else(|e| panic!("{e}"));
        for (name, points, cameras) in [
            ("bedroom_plush_mit_rebuilt/bin", 6002, 48),
            ("sceaux_castle_mit/colmap_example_model_bin", 7862, 11),
            ("sceaux_castle_mit/colmap_example_model_not_shared_txt", 8024, 11),
            ("sceaux_castle_mit/colmap_example_model_txt_missing_cams_and_subfolders", 6319, 9),
            ("maupertuis_bsd/samples/maupertuis/colmap/reconstruction", 1039, 4),
        ] {
            let found = load(name);
            assert_eq!((found.points.len(), found.cameras.len()), (points, cameras), "{name}");
        }
        for (binary, text) in [
            ("bedroom_plush_mit_rebuilt/bin", "bedroom_plush_mit_rebuilt/txt"),
            ("sceaux_castle_mit/colmap_example_model_bin", "sceaux_castle_mit/colmap_example_model_txt"),
        ] {
            let (a, b) = (load(binary), load(text));
            // Text has fewer digits, and another order.
            let middle = |r: &Reconstruction| r.points.iter().map(|p| p.position).sum::<Vec3>() / r.points.len() as f32;
            let colour = |r: &Reconstruction| r.points.iter().map(|p| f64::from(p.colour.iter().sum::<f32>())).sum::<f64>();
            assert!(middle(&a).distance(middle(&b)) < 1e-3, "{binary}: {} and {}", middle(&a), middle(&b));
            assert!((colour(&a) - colour(&b)).abs() < 0.1, "{binary}: {} and {}", colour(&a), colour(&b));
            assert_eq!(a.cameras.len(), b.cameras.len());
        }
    }
}
