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

fn all(keep: f64, length_s: f64) -> Vec<Vec<f32>> {
    AT.iter().map(|at| response(*at, keep, length_s)).collect()
}

#[test]
fn a_full_fit_writes_its_room_and_goes_on_where_it_was_stopped() {
    let folder = tempfile::tempdir().unwrap();
    let text = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let set = measured(&folder.path().join("set"), &all(0.8, 0.25), &AT, 1.0);
    let (room, state) = (text("room.obj"), text("room.fit-state"));
    // Lengths are searched: the room is not stated.
    let quick = ["fit", &set, "--quick", "-o", &room];
    let (_, said) = succeeds(&quick);
    assert!(said.contains("explains the echoes best"), "{said}");
    let found: Vec<f64> =
        said.split("a box of ").nth(1).unwrap().split(" m ").next().unwrap().split(" x ").map(|n| n.parse().unwrap()).collect();
    assert!(found.iter().zip(SIZE).all(|(a, b)| (a - b).abs() < 0.05), "{found:?}");

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
    assert!(
        report.contains("## Places") && report.contains("± 0.0") && report.contains("no reverberation is known"),
        "{report}"
    );
    assert!(!Path::new(&state).exists(), "what a finished fit would go on from");
    let plan = fs::read_to_string(text("room.report.plan.svg")).unwrap();
    assert_eq!((plan.matches("<rect").count(), plan.matches("<circle").count()), (1 + 2 * AT.len(), 2 * AT.len()));
    let beside = fs::read_to_string(text("room.materials.json")).unwrap();
    assert!(beside.contains("\"ceiling\""), "{beside}");

    fs::write(&state, b"PROMFIT1 and no more").unwrap();
    all_fail(&[(full.to_vec(), "room.fit-state: no fit to go on from; remove it to begin anew")]);
}

#[test]
fn walls_of_a_box_are_found_from_picked_echoes() {
    let folder = tempfile::tempdir().unwrap();
    let mut places = "src_id,src_pos_x,src_pos_y,src_pos_z,mic_id,mic_pos_x,mic_pos_y,mic_pos_z\n".to_owned();
    let mut picked = "mic,src,direct,ceiling,floor,west,south,east,north\n".to_owned();
    let far = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt() / 343.0;
    for (m, at) in AT.iter().enumerate() {
        places += &format!("1,{},{},{},{},{},{},{}\n", SOURCE[0], SOURCE[1], SOURCE[2], m + 1, at[0], at[1], at[2]);
        picked += &format!("{m},0,{}", far(SOURCE, *at));
        // In another order than the walls'.
        for wall in [2, 0, 5, 4, 1, 3] {
            let mut image = SOURCE;
            image[wall / 2] = if wall % 2 == 0 { -image[wall / 2] } else { 2.0 * SIZE[wall / 2] - image[wall / 2] };
            picked += &format!(",{}", far(image, *at));
        }
        picked += "\n";
    }
    fs::write(folder.path().join("dEchorate_database.csv"), places).unwrap();
    fs::write(folder.path().join("echo_pickpeaking.csv"), picked).unwrap();
    let (set, room) = (folder.path().to_str().unwrap().to_owned(), folder.path().join("room.obj"));
    let (table, said) = succeeds(&["fit", &set, "-o", room.to_str().unwrap()]);
    assert!(said.contains("a box of 4.600 x 3.700 x 2.600 m by 5 pairs") && room.exists(), "{said}");
    assert!(table.lines().any(|l| l.starts_with("ceiling") && l.trim_end().ends_with('3')), "{table}");
    all_fail(&[(vec!["fit", "4.6,3.7,2.6", &set, "--evaluate"], "found times of echoes")]);
}

#[test]
fn measurements_that_cannot_be_right_are_refused_or_named() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    let fine = all(0.7, 0.2);
    let said = |set: &str, room: &str| {
        let out = place("out.obj");
        let run = promenade(&["fit", room, set, "--quick", "-o", out.to_str().unwrap()]);
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
    assert!(short.contains("end less than 30 dB below") && short.contains("no response decays by 25 dB"), "{short}");

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
    all_fail(&[
        (vec!["fit", lengths, &few, "-o", &out], "at least 3 responses, found 2"),
        (vec!["fit", &millimetres, &set, "-o", &out], "--scale"),
        (vec!["fit", &open, &set, "--quick", "-o", &out], "--quick: expected a box, found a mesh"),
        (vec!["fit", lengths, &set, "-o", "x.glb"], "ending in .obj or .promenade"),
        (vec!["fit", "2,2,2", &set, "-o", &out], "in the room from"),
        (vec!["fit", "nothing", &set, "-o", &out], "the word box"),
    ]);
    let run = promenade(&["fit", &open, &set, "-o", &out, "--order", "1", "--rate", "8000", "--hold", "walls,places,source"]);
    let open = String::from_utf8(run.stderr).unwrap();
    assert!(run.status.success() && open.contains("holes, or corners that do not meet"), "{open}");
}
