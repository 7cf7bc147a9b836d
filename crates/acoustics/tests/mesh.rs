//! Meshes from files, and what is said of them.

use crate::common::{l_room, shoebox};
use cpu_time::ThreadTime;
use glam::DVec3;
use promenade_acoustics::{AcousticsError, Material, Materials, Mesh, Room, Sights, Triangle};
use promenade_core::random::Random;
use std::path::PathBuf;

fn written(folder: &tempfile::TempDir, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

const OBJ: &str = "mtllib is-not-there.mtl\no room\nv 0 0 0\nv 4 0 0\nv 4 3 0\nv 0 3 0\nv 0 0 2.5\nv 4 0 2.5\n\
    usemtl marble_floor\nf 1 2 3 4\nusemtl brickwork\nf 1 2 6 5\n";

#[test]
fn an_obj_file_names_its_materials() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = Mesh::load(&written(&folder, "room.obj", OBJ.as_bytes())).unwrap();
    assert_eq!(mesh.groups, ["marble_floor", "brickwork"]);
    assert_eq!(mesh.triangles.iter().map(|t| t.group).collect::<Vec<_>>(), [0, 0, 1, 1]);
    assert_eq!(mesh.bounds(), [[0.0; 3], [4.0, 3.0, 2.5]]);
    let materials = Materials::default().assign(&mesh.groups, &[]).unwrap();
    assert_eq!(materials[1].absorption[6], 0.04);
    let plain = OBJ.lines().filter(|l| !l.contains("usemtl")).collect::<Vec<_>>().join("\n");
    assert_eq!(Mesh::load(&written(&folder, "plain.obj", plain.as_bytes())).unwrap().groups, ["room"]);
}

#[test]
fn stl_and_ply_files_hold_one_group() {
    let folder = tempfile::tempdir().unwrap();
    let mut stl = vec![0; 80];
    stl.extend(1_u32.to_le_bytes());
    let numbers = [0.0_f32, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 3.0, 0.0];
    stl.extend(numbers.iter().flat_map(|v| v.to_le_bytes()));
    stl.extend([0, 0]);
    let text =
        "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 2 0 0\nvertex 0 3 0\nendloop\nendfacet\nendsolid a\n";
    let ply = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty double z\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n2 0 0\n2 3 0\n0 3 0\n4 0 1 2 3\n";
    for (name, bytes, triangles) in [("a.stl", &stl[..], 1), ("b.STL", text.as_bytes(), 1), ("c.ply", ply.as_bytes(), 2)] {
        let mesh = Mesh::load(&written(&folder, name, bytes)).unwrap();
        assert_eq!((mesh.triangles.len(), &mesh.groups[..]), (triangles, &["surface".to_owned()][..]), "{name}");
        assert_eq!(mesh.bounds()[1], [2.0, 3.0, 0.0]);
    }
    // Cut off anywhere, a file is an error or a smaller mesh, never a panic.
    for (name, bytes) in [("d.stl", &stl[..]), ("e.ply", ply.as_bytes()), ("f.obj", OBJ.as_bytes())] {
        for end in 0..bytes.len() {
            let _ = Mesh::load(&written(&folder, name, &bytes[..end]));
        }
    }
}

#[test]
fn solids_of_a_text_are_groups_and_a_binary_file_may_begin_with_that_word() {
    let folder = tempfile::tempdir().unwrap();
    let facet =
        |z: u32| format!("facet normal 0 0 1\nouter loop\nvertex 0 0 {z}\nvertex 2 0 {z}\nvertex 0 3 {z}\nendloop\nendfacet\n");
    let text = format!("solid floor\n{}endsolid floor\nsolid my ceiling\n{}endsolid\n", facet(0), facet(2));
    let mesh = Mesh::load(&written(&folder, "a.stl", text.as_bytes())).unwrap();
    assert_eq!((mesh.triangles.len(), &mesh.groups[..]), (2, &["floor".to_owned(), "my ceiling".to_owned()][..]));
    assert_eq!(mesh.bounds(), [[0.0; 3], [2.0, 3.0, 2.0]]);
    let unnamed = format!("solid\n{}endsolid\n", facet(0));
    assert_eq!(Mesh::load(&written(&folder, "b.stl", unnamed.as_bytes())).unwrap().triangles.len(), 1);
    let mut binary = b"solid written by a program that knows no better".to_vec();
    binary.resize(80, b' ');
    binary.extend(1_u32.to_le_bytes());
    binary.extend([0.0_f32, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 3.0, 0.0].iter().flat_map(|v| v.to_le_bytes()));
    binary.extend([0, 0]);
    assert_eq!(Mesh::load(&written(&folder, "c.stl", &binary)).unwrap().triangles.len(), 1);
}

#[test]
fn lines_of_obj_go_on_after_a_backslash_and_words_may_be_apart_by_tabs() {
    let folder = tempfile::tempdir().unwrap();
    let text = "v 0 0 0\nv 2 0 0\nv 2 3 0\nv 0 3 0\nusemtl\tbrick wall\nf 1 2 \\\r\n 3 4\n";
    let mesh = Mesh::load(&written(&folder, "a.obj", text.as_bytes())).unwrap();
    assert_eq!((mesh.triangles.len(), &mesh.groups[..]), (2, &["brick wall".to_owned()][..]));
}

/// A glTF file of one primitive over a buffer.
fn gltf(mode: u32, component: u32, count: usize, more: &str, uri: &str, bytes: usize) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0"}},{more}"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"mode":{mode}}}]}}],
        "accessors":[{{"bufferView":0,"componentType":{component},"count":{count},"type":"VEC3","min":[0,0,0],"max":[2,3,0]}}],
        "bufferViews":[{{"buffer":0,"byteLength":{bytes},"byteStride":{stride}}}],
        "buffers":[{{"uri":"{uri}","byteLength":{bytes}}}]}}"#,
        stride = bytes / count
    )
}

#[test]
fn strips_fans_integers_and_buffers_of_all_kinds_are_read_from_gltf() {
    let folder = tempfile::tempdir().unwrap();
    let floats: Vec<u8> = [[0.0_f32, 0.0], [2.0, 0.0], [0.0, 3.0], [2.0, 3.0]]
        .iter()
        .flat_map(|[x, y]| [*x, *y, 0.0].map(f32::to_le_bytes).concat())
        .collect();
    // The format's own way to write a space.
    written(&folder, "My Room.bin", &floats);
    let of = |text: String| Mesh::load(&written(&folder, "a.gltf", text.as_bytes()));
    for (mode, triangles) in [(4, 1), (5, 2), (6, 2)] {
        let mesh = of(gltf(mode, 5126, 4, "", "My%20Room.bin", 48)).unwrap();
        assert_eq!((mesh.triangles.len(), mesh.bounds()), (triangles, [[0.0; 3], [2.0, 0.0, 3.0]]), "{mode}");
    }
    let embedded = "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAAAAQAAAAAAAAAAAAAAAAAAAQEAAAAAA";
    assert_eq!(of(gltf(4, 5126, 3, "", embedded, 36)).unwrap().bounds()[1], [2.0, 0.0, 3.0]);
    // Whole numbers of 16 bits, four bytes to spare.
    let shorts: Vec<u8> =
        [[0_u16, 0], [2, 0], [0, 3]].iter().flat_map(|[x, y]| [*x, *y, 0, 0].map(u16::to_le_bytes).concat()).collect();
    written(&folder, "small.bin", &shorts);
    let quantized = r#""extensionsRequired":["KHR_mesh_quantization","KHR_materials_unlit"],"#;
    assert_eq!(of(gltf(4, 5123, 3, quantized, "small.bin", 24)).unwrap().bounds()[1], [2.0, 0.0, 3.0]);
    let draco = r#""extensionsRequired":["KHR_draco_mesh_compression"],"#;
    let error = of(gltf(4, 5126, 4, draco, "My%20Room.bin", 48)).unwrap_err().to_string();
    assert!(error.contains("found KHR_draco_mesh_compression"), "{error}");
}

#[test]
fn gltf_files_are_turned_upright() {
    let folder = tempfile::tempdir().unwrap();
    let positions = [0.0_f32, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 3.0, 0.0];
    written(&folder, "room.bin", &positions.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>());
    let text = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
        "nodes":[{"mesh":0,"name":"wall","translation":[1,0,0]}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]}],"materials":[{"name":"brickwork"}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[2,3,0]}],
        "bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"uri":"room.bin","byteLength":36}]}"#;
    let mesh = Mesh::load(&written(&folder, "room.gltf", text.as_bytes())).unwrap();
    assert_eq!((&mesh.groups[..], mesh.triangles.len()), (&["brickwork".to_owned()][..], 1));
    // Up is z.
    assert_eq!(mesh.bounds(), [[1.0, 0.0, 0.0], [3.0, 0.0, 3.0]]);
}

/// Points on the triangles of a mesh, about as many on each square metre, with some noise, and a table's in the middle.
fn scanned(mesh: &Mesh, per_m2: f64) -> Vec<[f64; 3]> {
    let mut random = Random::stream(5, 0);
    let mut points = Vec::new();
    for t in &mesh.triangles {
        let [a, b, c] = t.corners.map(|c| DVec3::from(mesh.vertices[c as usize]));
        let area = 0.5 * (b - a).cross(c - a).length();
        for _ in 0..(area * per_m2) as usize {
            let (u, v) = (random.uniform_f64(), random.uniform_f64());
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let noise = DVec3::new(random.uniform_f64(), random.uniform_f64(), random.uniform_f64()) - 0.5;
            points.push((a + u * (b - a) + v * (c - a) + 0.02 * noise).to_array());
        }
    }
    points
}

#[test]
fn the_free_space_of_an_l_shaped_room_is_l_shaped() {
    let mesh = l_room();
    let room = Room::new(&mesh, &[Material::even("", 0.1, 0.1)]).unwrap();
    let points = scanned(&mesh, 60.0);
    // A walk through both arms; the ceiling of one is not seen.
    let eyes: Vec<[f64; 3]> = (0..12)
        .map(|i| if i < 6 { [1.5, 5.2 - 0.7 * f64::from(i), 1.5] } else { [1.5 + 0.6 * f64::from(i - 5), 1.5, 1.5] })
        .collect();
    let unseen = |p: &[f64; 3]| p[2] > 2.6 && p[0] > 3.5;
    let seen: Vec<[f64; 3]> = points.iter().copied().filter(|p| !unseen(p)).collect();
    let mut lines = Vec::new();
    for (e, eye) in eyes.iter().enumerate() {
        for (p, point) in seen.iter().enumerate() {
            let near = DVec3::from(*eye).lerp((*point).into(), 0.98).to_array();
            if (e + p) % 3 == 0 && room.sees(*eye, near).unwrap() {
                lines.push([e as u32, p as u32]);
            }
        }
    }
    for lines in [&lines[..], &[]] {
        let sights = Sights { points: &seen, eyes: &eyes, lines, held: &[] };
        let mut found = Mesh::around_free_space(&sights, 0.12).unwrap();
        let done = found.flatten(Some(0.09)).unwrap();
        found.simplify(0.03);
        let report = found.report();
        let volume = report.volume_m3.unwrap();
        println!("{} lines: {volume:.1} m3, {} triangles; {done}", lines.len(), found.triangles.len());
        assert!((volume / (27.0 * 2.7) - 1.0).abs() < 0.12, "{volume} m3");
        let inside = Room::new(&found, &vec![Material::even("", 0.1, 0.1); found.groups.len()]).unwrap();
        assert!(eyes.iter().all(|eye| inside.encloses(*eye).unwrap()));
        assert!(!inside.encloses([4.5, 4.5, 1.3]).unwrap(), "what is outside of the L is no part of the room");
        assert!(done.area_share > 0.7 && found.triangles.len() < 4000, "{done}");
        let [low, high] = found.bounds();
        assert!(low[2].abs() < 0.1 && (high[0] - 6.0).abs() < 0.15, "{low:?} {high:?}");
    }
    let none = Sights { points: &seen, eyes: &[], lines: &[], held: &[] };
    assert!(Mesh::around_free_space(&none, 0.12).unwrap_err().to_string().contains("places that points are seen from"));
    let one = Sights { points: &seen, eyes: &eyes, lines: &[], held: &[] };
    assert!(Mesh::around_free_space(&one, 1e-3).unwrap_err().to_string().contains("6000000 in all"));
}

#[test]
fn tables_of_materials_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let mut table = Materials::default();
    let rows = "Material,property,description,63,125,250,500,1000,2000,4000,8000 Hz\n\
        Brickwork,absorption,\"bricks, painted\",0.3,0.1,0.2,0.2,0.2,0.2,0.2,0.25\nbrickwork,scattering,,,0.5,,,,,,\n";
    assert_eq!(table.add_table(&written(&folder, "own.csv", rows.as_bytes())).unwrap(), 1);
    let brick = table.material("brickwork").unwrap();
    assert_eq!((brick.absorption[0], brick.absorption[6], brick.absorption_63), (0.1, 0.25, Some(0.3)));
    assert_eq!(brick.scattering, [0.5; 7]);
    // As the database BRAS has them: thirds from 20 Hz to 20 kHz.
    let line = |of: &dyn Fn(i32) -> f64| (-17..14).map(|n| format!("{:.4}", of(n))).collect::<Vec<_>>().join(",");
    let thirds =
        [line(&|n| 1000.0 * (f64::from(n) / 3.0).exp2()), line(&|n| 0.02 * f64::from(n + 17)), line(&|_| 0.2)].join("\n");
    table.add_table(&written(&folder, "mat_CR2_concrete.csv", thirds.as_bytes())).unwrap();
    let concrete = table.material("mat_CR2_concrete").unwrap();
    assert!((concrete.absorption[3] - 0.34).abs() < 1e-4 && (concrete.absorption_63.unwrap() - 0.1).abs() < 1e-4);
    assert!(concrete.scattering.iter().all(|s| (*s - 0.2).abs() < 1e-6));
    for (text, says) in [
        ("", "found an empty file"),
        ("name,about\na,b\n", "shares in columns of frequencies"),
        ("what,125\na,0.1\n", "a column called material"),
        ("material,125\na,1.5\n", "row 2: a share from 0 to 1 at 125 Hz, found \"1.5\""),
        ("material,property,125\na,colour,0.5\n", "row 2: absorption or scattering, found \"colour\""),
        ("material,property,125\na,scattering,0.5\n", "a row of absorption"),
        ("125,250\n", "a line of absorption"),
        ("material,125\n,0.5\n", "row 2: the name of a material"),
    ] {
        let error = table.add_table(&written(&folder, "bad.csv", text.as_bytes())).unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
    }
}

#[test]
fn files_that_are_no_mesh_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |name: &str, bytes: &[u8], says: &str| {
        let error = Mesh::load(&written(&folder, name, bytes)).unwrap_err().to_string();
        assert!(error.contains(name) && error.contains(says), "{error}");
    };
    refused("room.blend", b"x", "a file ending in .obj, .stl, .ply, .glb or .gltf, found the ending \"blend\"");
    refused("empty.obj", b"v 0 0 0\n", "expected a mesh of triangles");
    refused("bad.obj", b"v 0 0 0\nf 1 2 3\n", "");
    refused("bad.stl", &[7; 100], "triangles in 100 bytes");
    refused("bad.ply", b"plyx", "a readable PLY file");
    refused("bad.glb", b"glTF", "a readable glTF file");
    assert!(Mesh::load(&folder.path().join("none.obj")).unwrap_err().to_string().contains("cannot be read"));
}

#[test]
fn a_report_counts_what_is_odd() {
    let whole = shoebox(0.1, 0.1).mesh().unwrap();
    let report = whole.report();
    assert_eq!((report.open_edges, report.flipped, report.degenerate, report.duplicate), (0, 0, 0, 0));
    assert!((report.volume_m3.unwrap() - 105.0).abs() < 1e-9 && (report.area_m2 - 142.0).abs() < 1e-9, "{report:?}");
    assert_eq!((report.size_m, report.warnings().len()), ([7.0, 5.0, 3.0], 0));
    let report = l_room().report();
    assert!((report.volume_m3.unwrap() - 27.0 * 2.7).abs() < 1e-9 && report.warnings().is_empty(), "{report:?}");

    let mut broken = whole.clone();
    broken.triangles.remove(3);
    let [a, b, c] = broken.triangles[5].corners;
    broken.triangles[5].corners = [a, c, b];
    broken.triangles.push(broken.triangles[1]);
    broken.triangles.push(Triangle { corners: [0, 0, 1], group: 0 });
    let report = broken.report();
    assert_eq!((report.open_edges, report.flipped, report.degenerate, report.duplicate), (3, 1, 1, 1));
    assert_eq!(report.volume_m3, None);
    let warnings = report.warnings().join("; ");
    for says in ["3 edges, ", "1 of 13 triangles have no area", "1 of 13 triangles are there twice", "1 of 13 triangles look"] {
        assert!(warnings.contains(says), "{warnings}");
    }
    let mut millimetres = whole;
    millimetres.scale(1000.0);
    assert!(
        millimetres.report().warnings()[0].contains("--scale 0.001 makes it 7.0 x 5.0 x 3.0 m"),
        "{:?}",
        millimetres.report().warnings()
    );
}

#[test]
fn slivers_leave_a_mesh_closed() {
    // The first triangle's longest edge is met by a triangle without an area, which ends at its middle, and two halves behind
    // that.
    let whole = shoebox(0.1, 0.1).mesh().unwrap();
    let mut mesh = whole.clone();
    let Triangle { corners: [a, b, c], group } = mesh.triangles[0];
    let middle = mesh.vertices.len() as u32;
    let half = |axis: usize| 0.5 * (mesh.vertices[a as usize][axis] + mesh.vertices[b as usize][axis]);
    mesh.vertices.push([half(0), half(1), half(2)]);
    mesh.triangles[0].corners = [a, middle, c];
    mesh.triangles.push(Triangle { corners: [middle, b, c], group });
    mesh.triangles.push(Triangle { corners: [a, b, middle], group });
    let report = mesh.report();
    assert_eq!((report.open_edges, report.degenerate), (0, 1), "{report:?}");
    assert!((report.volume_m3.unwrap() - 105.0).abs() < 1e-9, "{report:?}");
}

/// A triangle in a `.glb` file that so many nodes show.
fn instances(nodes: usize, triangles: usize) -> Vec<u8> {
    let list = |of: &dyn Fn(usize) -> String| (0..nodes).map(of).collect::<Vec<_>>().join(",");
    let corners: Vec<u8> =
        (0..triangles).flat_map(|_| [0.0_f32, 0., 0., 2., 0., 0., 0., 3., 1.]).flat_map(f32::to_le_bytes).collect();
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[{}]}}],"nodes":[{}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":{},"type":"VEC3","min":[0,0,0],"max":[2,3,1]}}],
        "bufferViews":[{{"buffer":0,"byteLength":{length}}}],"buffers":[{{"byteLength":{length}}}]}}"#,
        list(&|i| i.to_string()),
        list(&|i| format!(r#"{{"mesh":0,"translation":[{i},0,0]}}"#)),
        3 * triangles,
        length = corners.len()
    );
    let json = format!("{json}{}", " ".repeat(json.len().next_multiple_of(4) - json.len()));
    let word = |n: usize| u32::try_from(n).unwrap().to_le_bytes();
    let head = [&b"glTF"[..], &word(2), &word(28 + json.len() + corners.len()), &word(json.len()), b"JSON"].concat();
    [&head, json.as_bytes(), &word(corners.len()), b"BIN\0", &corners].concat()
}

/// Corners of a wall, in words of OBJ.
const CORNERS: &str = "v 0 0 0\nv 5 0 0\nv 5 4 1\nv 0 4 0\n";

/// The mesh in a file of these bytes.
fn loaded(name: &str, bytes: &[u8]) -> Result<Mesh, AcousticsError> {
    let folder = tempfile::tempdir().unwrap();
    Mesh::load(&written(&folder, name, bytes))
}

/// What `work` gives, which may take so much of a processor as a search lets a small file take.
fn in_ten_seconds<T>(work: impl FnOnce() -> T) -> T {
    let began = ThreadTime::now();
    let result = work();
    let took_s = began.elapsed().as_secs_f64();
    assert!(took_s < 10.0, "{took_s:.1} s of processor time");
    result
}

#[test]
fn nodes_that_share_a_mesh_ask_for_no_large_work() {
    in_ten_seconds(|| {
        assert_eq!(loaded("few.glb", &instances(20, 5)).unwrap().triangles.len(), 100);
        let error = loaded("many.glb", &instances(3000, 1000)).unwrap_err().to_string();
        assert!(error.contains("many.glb: expected a mesh of at most 2000000 triangles"), "{error}");
    });
}

#[test]
fn groups_and_materials_by_the_ten_thousand_ask_for_no_large_work() {
    let groups: String = (0..20_000).map(|i| format!("g group{i}\nf 1 2 3\nf 1 3 4\n")).collect();
    in_ten_seconds(|| {
        let mut mesh = loaded("groups.obj", format!("{CORNERS}{groups}").as_bytes()).unwrap();
        assert_eq!((mesh.groups.len(), mesh.triangles.len()), (20_000, 40_000));
        let all = vec![Material::even("", 0.1, 0.1); 20_000];
        assert_eq!((mesh.merge_groups(all).len(), &mesh.groups[..]), (1, &["group0".to_owned()][..]));
    });
    let materials: String = (0..100_000).map(|i| format!("usemtl material{i}\n")).collect();
    let mesh = in_ten_seconds(|| loaded("materials.obj", format!("{CORNERS}{materials}f 1 2 3\n").as_bytes()).unwrap());
    assert_eq!(mesh.groups, ["material99999"]);
}

#[test]
fn equal_and_nearly_equal_triangles_ask_for_no_large_work() {
    // Equal ones are one, and nearly equal ones no chain of boxes in boxes.
    let equal = format!("{CORNERS}{}", "f 1 2 3\n".repeat(200_000));
    let fan: String = (0..100_000).map(|i| format!("v {} {} 0\nf 1 {} {}\n", 5 + i, 4 + i % 7, i + 5, 2)).collect();
    let wall = [Material::even("", 0.1, 0.1)];
    in_ten_seconds(|| {
        let room = Room::new(&loaded("equal.obj", equal.as_bytes()).unwrap(), &wall).unwrap();
        assert!(room.surroundings([2.5, 1.5, 3.0]).unwrap().enclosed > 0.0);
        Room::new(&loaded("fan.obj", format!("{CORNERS}{fan}").as_bytes()).unwrap(), &wall).unwrap();
    });
}

#[test]
fn places_beyond_any_room_are_refused() {
    for far in ["1e20", "-3e38", "2000000"] {
        let mesh = loaded("far.obj", format!("{CORNERS}v {far} 0 0\nf 1 2 5\nf 2 3 4\n").as_bytes()).unwrap();
        let error = Room::new(&mesh, &[Material::even("", 0.1, 0.1)]).unwrap_err().to_string();
        assert!(error.contains("expected coordinates within 1000 km"), "{error}");
    }
}

#[test]
fn places_are_within_a_closed_room_or_not() {
    let walls = shoebox(0.1, 0.1);
    let room = Room::new(&walls.mesh().unwrap(), &walls.materials).unwrap();
    let l = Room::new(&l_room(), &[Material::even("wall", 0.1, 0.1)]).unwrap();
    for at in [[1.0, 1.0, 1.0], [6.9, 4.9, 2.9], [3.5, 2.5, 1.5]] {
        assert!(room.encloses(at).unwrap(), "{at:?}");
    }
    for at in [[-1.0, 1.0, 1.0], [3.5, 2.5, 3.1], [100.0, 0.0, 0.0]] {
        assert!(!room.encloses(at).unwrap(), "{at:?}");
    }
    assert!(l.encloses([1.0, 5.0, 1.0]).unwrap() && !l.encloses([4.5, 4.5, 1.0]).unwrap(), "the corner that is not there");
    let near = room.nearest_inside([9.0, 2.5, 1.5], 0.1).unwrap().unwrap();
    assert!(room.encloses(near).unwrap() && near[0] > 6.5 && (near[1] - 2.5).abs() < 0.5, "{near:?}");
    assert_eq!(room.nearest_inside([9.0, 2.5, 1.5], 50.0).unwrap(), None);
}

#[test]
fn directions_name_what_has_no_name() {
    let mut mesh = shoebox(0.1, 0.1).mesh().unwrap();
    mesh.group_by_direction();
    let count = |name: &str| {
        let group = mesh.groups.iter().position(|g| g == name).unwrap() as u32;
        mesh.triangles.iter().filter(|t| t.group == group).count()
    };
    assert_eq!((count("wall"), count("floor"), count("ceiling")), (8, 2, 2));
}

#[test]
fn only_regular_files_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("room.obj");
    std::fs::create_dir(&path).unwrap();
    let refused = |path: &std::path::Path| {
        let error = Mesh::load(path).unwrap_err();
        assert!(error.to_string().contains("room.obj"), "{error}");
        std::error::Error::source(&error).unwrap().to_string()
    };
    assert_eq!(refused(&path), "expected a regular file, found a folder");
    #[cfg(unix)]
    {
        let path = folder.path().join("endless room.obj");
        std::os::unix::fs::symlink("/dev/zero", &path).unwrap();
        assert_eq!(refused(&path), "expected a regular file, found a pipe, a socket or a device");
    }
}

/// Meshes of real rooms, which the repository may not hold.
mod needs_shared {
    use super::*;
    use promenade_acoustics::{ImageOptions, Images, Reflected};

    #[test]
    #[ignore = "reads ../shared/data"]
    fn real_rooms_are_read_and_traced() {
        let folder = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/haa_meshes"));
        for (name, triangles, source, listener) in [
            ("classroom", 18, [3.5, 0.7, 1.2], [1.5, 6.0, 1.5]),
            ("complex", 64, [4.0, 3.0, 1.2], [3.0, 9.0, 1.5]),
            ("dampened", 12, [2.0, 2.0, 1.2], [3.0, 4.0, 1.5]),
            ("hallway", 12, [0.7, 2.0, 1.2], [0.8, 15.0, 1.5]),
        ] {
            let mut mesh = Mesh::load(&folder.join(format!("{name}.obj"))).unwrap();
            mesh.group_by_direction();
            println!("{name}: {:?}", mesh.report().warnings());
            assert_eq!(mesh.triangles.len(), triangles);
            let rules = [("*".to_owned(), "hard_surface".to_owned())];
            let materials = Materials::default().assign(&mesh.groups, &rules).unwrap();
            let room = Room::new(&mesh, &materials).unwrap();
            let images = Images::new(&room, source, &ImageOptions::default()).unwrap();
            let seen = images.seen_from(&room, listener, Reflected::Specular).unwrap();
            assert!(seen.len() > 100, "{name}: {}", seen.len());
        }
    }
}
