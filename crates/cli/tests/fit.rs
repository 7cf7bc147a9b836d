//! `promenade fit` with measured responses, right and wrong ones.

use crate::common::{all_fail, promenade, succeeds};
use promenade_baker::wav::{self, Format};
use std::fs;
use std::path::Path;

const RATE: u32 = 16_000;
const SIZE: [f64; 3] = [4.6, 3.7, 2.6];
const SOURCE: [f64; 3] = [1.2, 1.5, 1.3];
const AT: [[f64; 3]; 5] = [[3.1, 2.2, 1.1], [2.5, 0.8, 1.6], [3.9, 3.0, 1.4], [0.7, 2.9, 1.8], [3.4, 1.0, 0.9]];

/// Images of a room whose walls keep this share of the amplitude.
fn response(microphone: [f64; 3], keep: f64, length_s: f64) -> Vec<f32> {
    let mut x = vec![0.0_f32; (length_s * f64::from(RATE)) as usize];
    let axis = |a: usize| -> Vec<(f64, i32)> {
        let one = |n: i32| {
            let own = if n % 2 == 0 { SOURCE[a] } else { SIZE[a] - SOURCE[a] };
            (f64::from(n) * SIZE[a] + own, n.abs())
        };
        (-14..=14).map(one).collect()
    };
    for (px, i) in axis(0) {
        for (py, j) in axis(1) {
            for (pz, k) in axis(2) {
                let way = [px - microphone[0], py - microphone[1], pz - microphone[2]];
                let far = way.iter().map(|w| w * w).sum::<f64>().sqrt();
                let at = far / 343.0 * f64::from(RATE);
                for n in (at as usize).saturating_sub(7)..at as usize + 9 {
                    let u = std::f64::consts::PI * (n as f64 - at);
                    let sinc = if u.abs() < 1e-9 { 1.0 } else { u.sin() / u } * (-(u / 14.0).powi(2)).exp();
                    if let Some(slot) = x.get_mut(n) {
                        *slot += (keep.powi(i + j + k) / far * sinc) as f32;
                    }
                }
            }
        }
    }
    x
}

/// A folder of responses, stated to be somewhere.
fn measured(folder: &Path, responses: &[Vec<f32>], stated: &[[f64; 3]], scale: f64) -> String {
    fs::create_dir_all(folder).unwrap();
    let entries: Vec<serde_json::Value> = responses
        .iter()
        .zip(stated)
        .enumerate()
        .map(|(i, (samples, at))| {
            let file = format!("{i}.wav");
            wav::write(&folder.join(&file), RATE, &[samples], Format::Float32).unwrap();
            let microphone = serde_json::json!({ "at": at.map(|c| scale * c), "sd_m": 0.01 });
            let source = serde_json::json!({ "at": SOURCE.map(|c| scale * c), "sd_m": 0 });
            serde_json::json!({ "file": file, "source": source, "microphone": microphone })
        })
        .collect();
    let text = serde_json::json!({ "title": "test", "responses": entries }).to_string();
    fs::write(folder.join("measurements.json"), text).unwrap();
    folder.to_str().unwrap().to_owned()
}

/// A fit of surfaces alone, from few reflections.
const HELD: [&str; 4] = ["--order", "1", "--hold", "walls,places,source"];

fn all(keep: f64, length_s: f64) -> Vec<Vec<f32>> {
    AT.iter().map(|at| response(*at, keep, length_s)).collect()
}

#[test]
fn a_full_fit_writes_its_room() {
    let folder = tempfile::tempdir().unwrap();
    let text = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let set = measured(&folder.path().join("set"), &all(0.8, 0.25), &AT, 1.0);
    let room = text("room.obj");
    // Lengths are searched: the room is not stated.
    let (_, said) = succeeds(&[&["fit", &set, "-o", &room], &HELD[..]].concat());
    assert!(said.contains("explains the echoes best"), "{said}");
    let found: Vec<f64> =
        said.split("a box of ").nth(1).unwrap().split(" m ").next().unwrap().split(" x ").map(|n| n.parse().unwrap()).collect();
    assert!(found.iter().zip(SIZE).all(|(a, b)| (a - b).abs() < 0.05), "{found:?}");
    // The same sound in air in which it is 5 % faster is that of a larger room.
    let warm = measured(&folder.path().join("warm"), &all(0.8, 0.25), &AT, 1.05);
    let (_, said) = succeeds(&[&["fit", &warm, "--temperature", "50.05", "-o", &room], &HELD[..]].concat());
    let found: Vec<f64> =
        said.split("a box of ").nth(1).unwrap().split(" m ").next().unwrap().split(" x ").map(|n| n.parse().unwrap()).collect();
    assert!(found.iter().zip(SIZE).all(|(a, b)| (a - 1.05 * b).abs() < 0.05), "{found:?}");

    let full = ["fit", "4.5,3.7,2.6", &set, "-o", &room, "--order", "3", "--rate", "8000", "--hold", "source"];
    succeeds(&full);
    let numbers: serde_json::Value = serde_json::from_str(&fs::read_to_string(text("room.report.json")).unwrap()).unwrap();
    let walls = numbers["walls"].as_array().unwrap();
    let moved: f64 =
        walls.iter().filter(|w| w["surface"] == "x0" || w["surface"] == "x1").map(|w| w["moved_m"].as_f64().unwrap()).sum();
    assert!((moved - 0.1).abs() < 0.02, "{numbers:#}");
    let absorption = numbers["surfaces"][4]["absorption"][9]["value"].as_f64().unwrap();
    assert!((absorption - 0.36).abs() < 0.2, "images up to order 3 tell it roughly: {absorption}");
    let report = fs::read_to_string(text("room.report.md")).unwrap();
    assert!(report.contains("## Beside a regression") && report.contains("| regression on log distance |"), "{report}");
    assert!(
        report.contains("## Places") && report.contains("± 0.0") && report.contains("no reverberation is known"),
        "{report}"
    );
    let decays = fs::read_to_string(text("room.report.decays.svg")).unwrap();
    // Seven octaves up to half of the rate: what was measured and what is foretold.
    assert_eq!((decays.matches("<polyline").count(), decays.matches("<polygon").count()), (14, 7));
    assert!(report.contains("](room.report.decays.svg)"), "{report}");
    let beside = fs::read_to_string(text("room.materials.json")).unwrap();
    assert!(beside.contains("\"ceiling\""), "{beside}");
    assert_eq!(beside.matches('@').count(), 6 * 2 * 16, "absorption and scattering of each wall in 16 bands: {beside}");

    // A scene of it, whole and within an error.
    crate::simulate::head(&folder.path().join("head"));
    let (head, whole, less) = (text("head"), text("whole.promenade"), text("less.promenade"));
    let fit = |out: &str, more: &[&str]| {
        succeeds(&[&["fit", "4.6,3.7,2.6", &set, "-o", out, "--head", &head, "--rate", "8000"], &HELD[..], more].concat()).1
    };
    fit(&whole, &[]);
    let said = fit(&less, &["--within", "2"]);
    let [whole, less] = [whole, less].map(|file| promenade_core::Scene::from_bytes(&fs::read(file).unwrap()).unwrap());
    let share = 100.0 * less.operations(48_000.0) / whole.operations(48_000.0);
    assert!(said.contains("within 2 JND: ") && said.contains(&format!("{share:.0} % of the operations")), "{share}: {said}");
    assert!(share < 95.0 && less.provenance().recipe.ends_with(" --within 2"), "{share}: {}", less.provenance().recipe);
}

#[test]
fn measurements_that_cannot_be_right_are_refused_or_named() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    let fine = all(0.7, 0.2);
    let said = |set: &str, room: &str| {
        let out = place("out.obj");
        let run = promenade(&[&["fit", room, set, "--rate", "8000", "-o", out.to_str().unwrap()], &HELD[..]].concat());
        (run.status.success(), String::from_utf8(run.stderr).unwrap())
    };
    let lengths = "4.6,3.7,2.6";
    let (_, none) = said(&measured(&place("fine"), &fine, &AT, 1.0), lengths);
    for clue in ["permuted", "end less than", "second sound"] {
        assert!(!none.contains(clue), "{none}");
    }

    let (done, millimetres) = said(&measured(&place("mm"), &fine, &AT, 1000.0), lengths);
    assert!(!done && millimetres.contains("within 500 m of the origin, in metres"), "{millimetres}");
    let (done, feet) = said(&measured(&place("feet"), &fine, &AT, 3.281), lengths);
    assert!(!done && feet.contains("in the room from"), "{feet}");

    let permuted = [AT[1], AT[2], AT[0], AT[4], AT[3]];
    let (_, moved) = said(&measured(&place("permuted"), &fine, &permuted, 1.0), lengths);
    assert!(moved.contains("may be permuted"), "{moved}");

    let (_, short) = said(&measured(&place("short"), &all(0.97, 0.05), &AT, 1.0), lengths);
    assert!(short.contains("end less than 30 dB below") && short.contains("no reverberation is known"), "{short}");

    let twice: Vec<Vec<f32>> = fine
        .iter()
        .map(|one| {
            let mut both = one.clone();
            both.extend(one);
            both
        })
        .collect();
    let (_, two) = said(&measured(&place("two"), &twice, &AT, 1.0), lengths);
    assert!(two.contains("second sound"), "{two}");

    let set = measured(&place("set"), &fine, &AT, 1.0);
    let few = measured(&place("few"), &fine[..2], &AT, 1.0);
    let open = place("open.obj");
    let box_obj = promenade_fit::box_obj(&promenade_fit::Walls::of_size(SIZE).unwrap());
    // Without its last triangle.
    let cut = box_obj.trim_end().rsplit_once('\n').unwrap().0;
    fs::write(&open, cut).unwrap();
    let millimetres = place("mm.obj");
    let scaled = |line: &str| match line.strip_prefix("v ") {
        Some(rest) => format!(
            "v {}",
            rest.split(' ').map(|c| format!("{}", 1000.0 * c.parse::<f64>().unwrap())).collect::<Vec<_>>().join(" ")
        ),
        None => line.to_owned(),
    };
    fs::write(&millimetres, box_obj.lines().map(scaled).collect::<Vec<_>>().join("\n")).unwrap();
    let [open, millimetres] = [open, millimetres].map(|p| p.to_str().unwrap().to_owned());
    let out = place("x.obj").to_str().unwrap().to_owned();
    let ears = measured(&place("ears"), &fine, &AT, 1.0);
    let manifest = place("ears").join("measurements.json");
    let text = fs::read_to_string(&manifest).unwrap().replacen("\"file\"", "\"kind\": \"binaural\", \"file\"", 1);
    fs::write(&manifest, text).unwrap();
    all_fail(&[
        (vec!["fit", lengths, &ears, "-o", &out], "models no head"),
        (vec!["fit", lengths, &few, "-o", &out], "at least 3 responses, found 2"),
        (vec!["fit", &millimetres, &set, "-o", &out], "--scale 0.001 "),
        (vec!["fit", lengths, &set, "-o", "x.glb"], "ending in .obj or .promenade"),
        (vec!["fit", "2,2,2", &set, "-o", &out], "in the room from"),
        (vec!["fit", "nothing", &set, "-o", &out], "the word box"),
    ]);
    let run = promenade(&[&["fit", &open, &set, "-o", &out, "--rate", "8000"], &HELD[..]].concat());
    let open = String::from_utf8(run.stderr).unwrap();
    assert!(run.status.success() && open.contains("holes, or corners that do not meet"), "{open}");
}

/// A COLMAP model of the room in a world of half its metres, x right, y down, z along the room's x, with three photographs:
/// red where the room is low, blue above.
fn photographed(folder: &Path) -> [String; 2] {
    let (model, photos) = (folder.join("model"), folder.join("photos"));
    fs::create_dir_all(&model).unwrap();
    fs::create_dir_all(&photos).unwrap();
    fs::write(model.join("cameras.txt"), "1 PINHOLE 64 48 32 32 32 24\n").unwrap();
    fs::write(model.join("points3D.txt"), "1 0 0 0 200 100 50 0.5 1 1 2 1\n").unwrap();
    let mut images = String::new();
    // Along x, back, and to the left: turns about the axis that looks down.
    for (i, (at, turn)) in CAMERAS.iter().zip([0.0_f64, 180.0, -90.0]).enumerate() {
        let half = turn.to_radians() / 2.0;
        let centre = [-0.5 * at[1], -0.5 * at[2], 0.5 * at[0]];
        // The world in the camera's axes: turned back by the camera's own turn.
        let (sin, cos) = (-turn.to_radians()).sin_cos();
        let moved = [cos * centre[0] + sin * centre[2], centre[1], -sin * centre[0] + cos * centre[2]];
        let [x, y, z] = moved.map(|v| -v);
        images += &format!("{} {} 0 {} 0 {x} {y} {z} 1 {i}.png\n\n", i + 1, half.cos(), -half.sin());
        photo(&photos.join(format!("{i}.png")), [64, 48], |y| if y < 24 { [30, 40, 200] } else { [200, 40, 30] });
    }
    fs::write(model.join("images.txt"), images).unwrap();
    [model, photos].map(|p| p.to_str().unwrap().to_owned())
}

/// Writes a picture of a colour for each row.
fn photo(path: &Path, [width, height]: [u32; 2], colour: impl Fn(u32) -> [u8; 3]) {
    let mut encoder = png::Encoder::new(fs::File::create(path).unwrap(), width, height);
    encoder.set_color(png::ColorType::Rgb);
    let pixels: Vec<u8> = (0..height).flat_map(|y| colour(y).repeat(width as usize)).collect();
    encoder.write_header().unwrap().write_image_data(&pixels).unwrap();
}

const CAMERAS: [[f64; 3]; 3] = [[1.0, 1.8, 1.3], [3.5, 1.0, 1.1], [2.0, 1.2, 1.5]];

#[test]
fn pieces_of_surfaces_are_fitted_with_pictures_and_a_fit_comes_to_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    let text = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let set = measured(&folder.path().join("set"), &all(0.8, 0.25), &AT, 1.0);
    let [model, photos] = photographed(folder.path());
    let places: Vec<String> = CAMERAS.iter().enumerate().map(|(i, [x, y, z])| format!("{i}.png={x},{y},{z}")).collect();
    let lengths = "4.6,3.7,2.6";
    let rough = ["--order", "2", "--rate", "8000", "--hold", "walls,source", "--per", "voxels"];
    let seen = ["--pictures", &model, "--photos", &photos];
    let at: Vec<&str> = places.iter().flat_map(|p| ["--landmark", p]).collect();
    let run = |name: &str| -> Vec<String> {
        let of = [&["fit", lengths, &set, "-o", name][..], &rough, &["--voxel", "1.2"], &seen, &at].concat();
        of.into_iter().map(str::to_owned).collect()
    };
    let once = run(&text("once.obj"));
    let (_, said) = succeeds(&once.iter().map(String::as_str).collect::<Vec<_>>());
    assert!(said.contains("a unit of the reconstruction is 2.0000 m; its places are 0.000 m"), "{said}");
    assert!(said.contains("sound tells of") && !said.contains("may lie elsewhere"), "{said}");
    let numbers = fs::read_to_string(text("once.report.json")).unwrap();
    let parsed: serde_json::Value = serde_json::from_str(&numbers).unwrap();
    let (pieces, shown) = (parsed["pieces"]["all"].as_array().unwrap().len(), parsed["pieces"]["shown"].as_u64().unwrap());
    assert!(pieces > 60 && (20..pieces as u64).contains(&shown), "{shown} of {pieces}");
    let (mesh, beside) =
        (fs::read_to_string(text("once.obj")).unwrap(), fs::read_to_string(text("once.materials.json")).unwrap());
    assert!(mesh.contains("ceiling.1") && beside.contains("\"ceiling.1\""), "{beside}");

    let twice = run(&text("twice.obj"));
    succeeds(&twice.iter().map(String::as_str).collect::<Vec<_>>());
    assert_eq!(fs::read_to_string(text("twice.report.json")).unwrap(), numbers);
    assert_eq!(fs::read_to_string(text("twice.obj")).unwrap(), mesh);
}

#[test]
fn pictures_that_cannot_be_the_rooms_are_refused_or_named_before_the_fit() {
    let folder = tempfile::tempdir().unwrap();
    let text = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let set = measured(&folder.path().join("set"), &all(0.8, 0.2), &AT, 1.0);
    let [model, photos] = photographed(folder.path());
    let (other, empty, bare) = (folder.path().join("other"), folder.path().join("empty"), folder.path().join("bare"));
    [&other, &empty, &bare].iter().for_each(|p| fs::create_dir(p).unwrap());
    photo(&other.join("0.png"), [48, 64], |_| [0; 3]);
    for file in ["images.txt", "points3D.txt"] {
        fs::copy(Path::new(&model).join(file), bare.join(file)).unwrap();
    }
    let out = text("x.obj");
    let [other, empty, bare] = [other, empty, bare].map(|p| p.to_str().unwrap().to_owned());
    let fit = |more: &[&'static str]| -> Vec<String> {
        ["fit", "4.6,3.7,2.6", &set, "-o", &out].iter().copied().chain(more.iter().copied()).map(str::to_owned).collect()
    };
    let voxels = |more: &[&str]| -> Vec<String> {
        fit(&["--per", "voxels", "--pictures"]).into_iter().chain(more.iter().map(|m| (*m).to_owned())).collect()
    };
    let cases = [
        (fit(&["--voxel", "0.3"]), "--voxel: expected --per voxels"),
        (fit(&["--per", "voxels", "--voxel", "0.02"]), "at most 8000"),
        (voxels(&[&text("nowhere")]), "expected a COLMAP model"),
        (voxels(&[&model, "--photos", &empty]), "expected photographs named as the 3 images"),
        (voxels(&[&model, "--photos", &other]), "expected the shape of its lens, 64 x 48, found 48 x 64"),
        (voxels(&[&bare, "--photos", &photos]), "cameras.bin"),
        (voxels(&[&model, "--landmark", "0.png=1,2,1", "--landmark", "1.png=2,1,1"]), "not on a line"),
        (voxels(&[&model, "--landmark", "9.png=1,2,1"]), "the name of one image"),
    ];
    let cases: Vec<(Vec<&str>, &str)> =
        cases.iter().map(|(args, clue)| (args.iter().map(String::as_str).collect(), *clue)).collect();
    all_fail(&cases);
    // Up, scale and origin as they are assumed put the cameras elsewhere.
    let rough = ["--order", "1", "--rate", "8000", "--hold", "walls,places,source", "--voxel", "2"];
    let all = [voxels(&[&model, "--photos", &photos]), rough.map(str::to_owned).to_vec()].concat();
    let (_, said) = succeeds(&all.iter().map(String::as_str).collect::<Vec<_>>());
    assert!(said.contains("the reconstruction may lie elsewhere"), "{said}");
}
