//! `promenade anchors` and `promenade simulate`.

use crate::common::{all_fail, fails, promenade, succeeds};
use promenade_baker::anchors::AnchorSet;
use promenade_baker::capture::Capture;
use promenade_baker::sound;
use promenade_baker::wav::{self, Format};
use promenade_baker::{LoadOptions, Response, Responses};
use promenade_core::Pose;
use promenade_core::glam::Vec3;
use promenade_core::head::{degree, harmonics};
use promenade_core::network::Placement;
use promenade_metrics::ild_db;
use std::path::Path;

const POINTS: usize = 4000;

/// A cloud of points on a sphere of 4 units about 10,0,0, text; colours rise with z.
fn cloud() -> String {
    let point = |i: usize| {
        let z = 1.0 - 2.0 * (i as f32 + 0.5) / POINTS as f32;
        let (r, turn) = ((1.0 - z * z).sqrt(), 2.4 * i as f32);
        format!("{} {} {} {} 0.5 0.5\n", 10.0 + 4.0 * r * turn.cos(), 4.0 * r * turn.sin(), 4.0 * z, 0.5 + 0.5 * z)
    };
    let properties: String = ["x", "y", "z", "red", "green", "blue"].map(|p| format!("property float {p}\n")).concat();
    let points: String = (0..POINTS).map(point).collect();
    format!("ply\nformat ascii 1.0\nelement vertex {POINTS}\n{properties}end_header\n{points}")
}

#[test]
fn anchors_of_a_cloud_a_model_and_a_box() {
    let folder = tempfile::tempdir().unwrap();
    let text = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (cloud_file, out) = (text("sphere.ply"), text("anchors.safetensors"));
    std::fs::write(&cloud_file, cloud()).unwrap();
    let options = ["-n", "20", "--neighbours", "8", "--metres-per-unit", "0.5", "--origin", "10,0,0", "--up", "0,1,0"];
    let (_, said) = succeeds(&[&["anchors", &cloud_file, "-o", &out][..], &options].concat());
    assert!(said.contains("20 anchors of 8 neighbours") && said.contains("a unit is 0.500000 m"), "{said}");
    let set = AnchorSet::load(Path::new(&out)).unwrap();
    assert_eq!((set.positions.len(), set.neighbours, set.features.len()), (20, 8, 480));
    for (position, features) in set.positions.iter().zip(set.features.chunks(24)) {
        let metres = set.placement.to_scene(*position);
        assert!((metres.length() - 2.0).abs() < 0.35, "{metres}");
        assert!((metres.z - 0.5 * position.y).abs() < 1e-5, "up is the cloud's y");
        let red = features.iter().step_by(3).sum::<f32>() / 8.0 * 0.2821 + 0.5;
        assert!((red - (0.5 + position.z / 8.0)).abs() < 0.15, "{red} at {position}");
    }
    let first = std::fs::read(&out).unwrap();
    succeeds(&[&["anchors", &cloud_file, "-o", &out][..], &options].concat());
    assert_eq!(std::fs::read(&out).unwrap(), first, "the same each time");

    succeeds(&["anchors", "--box", "6,4,2.8", "-o", &out, "-n", "64"]);
    let set = AnchorSet::load(Path::new(&out)).unwrap();
    assert_eq!((set.placement, set.positions.len(), set.neighbours), (Placement::IDENTITY, 64, 50));
    let inside = |p: &Vec3| p.cmpge(Vec3::splat(-0.2)).all() && p.cmple(Vec3::new(6.2, 4.2, 3.0)).all();
    assert!(set.positions.iter().all(inside));

    let model = folder.path().join("model");
    std::fs::create_dir(&model).unwrap();
    let images = "1 1 0 0 0 0 0 0 1 a.jpg\n\n2 1 0 0 0 0 0 -2 1 b.jpg\n\n";
    std::fs::write(model.join("images.txt"), images).unwrap();
    let points: String = (0..300).map(|i| format!("{i} {} 0 {} 200 100 50 0.5 1 {i} 2 {i}\n", i % 20, i / 20)).collect();
    std::fs::write(model.join("points3D.txt"), points).unwrap();
    let model = text("model");
    let few = ["-n", "8", "--neighbours", "4"];
    let distance = ["--distance", "a.jpg", "b.jpg", "1"];
    let (_, said) = succeeds(&[&["anchors", &model, "-o", &out][..], &few, &distance].concat());
    assert!(said.contains("the first camera, a.jpg") && said.contains("1 m are 2.0000 units"), "{said}");
    assert!((AnchorSet::load(Path::new(&out)).unwrap().placement.units_per_metre - 2.0).abs() < 1e-6);
    all_fail(&[
        (vec!["anchors", &model, "-o", &out, "-n", "2000"], "expected at least 2000 for 2000 anchors of 50 neighbours"),
        (vec!["anchors", &text("none.ply"), "-o", &out], "none.ply: cannot be read"),
        (vec!["anchors", &text("model/images.txt"), "-o", &out], "a COLMAP model, or a file ending in .ply or .obj"),
        (vec!["anchors", "--box", "6,4,2.8", "-o", &out, "--up", "0,0,1"], "found a box, which is in metres"),
        (vec!["anchors", &cloud_file, "-o", &out, "--origin", "first"], "keep or a point, where there are no cameras"),
        (vec!["anchors", &model, "-o", &out, "--distance", "a.jpg", "c.jpg", "1"], "found \"c.jpg\""),
        (vec!["anchors", &model, "-o", &out, "--distance", "a.jpg", "b.jpg", "far"], "--distance: expected a number"),
    ]);
}

/// A head whose ears hear their own side louder.
pub(crate) fn head(folder: &Path) {
    let response = |i: usize| {
        let azimuth = (i as f32 * 30.0).to_radians();
        let source = 1.4 * Vec3::new(azimuth.cos(), azimuth.sin(), 0.0);
        let ear = |level: f32| (0..40).map(|n| if n == 12 { level } else { 0.0 }).collect::<Vec<f32>>();
        let (left, right) = (ear(1.0 + 0.5 * azimuth.sin()), ear(1.0 - 0.5 * azimuth.sin()));
        Response { listener: Pose::IDENTITY, source, left, right, name: format!("{i}") }
    };
    let set = Responses {
        title: "Head".to_owned(),
        credit: "me".to_owned(),
        licence: "MIT".to_owned(),
        sample_rate_hz: 16_000.0,
        responses: (0..12).map(response).collect(),
        ..Responses::default()
    };
    set.save(folder).unwrap();
}

#[test]
fn a_box_is_simulated_along_a_walk() {
    let folder = tempfile::tempdir().unwrap();
    let text = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    head(&folder.path().join("head"));
    let (ears, walk, out) = (text("head"), text("walk.csv"), text("room"));
    std::fs::write(&walk, "t,x,y,z,yaw,pitch,roll\n0,2,0.5,1.2,0,0,0\n10,4,0.5,1.2,180,0,0\n").unwrap();
    let room = ["simulate", "box", "--size", "6,4,2.8", "--emitter", "3,3.2,1.5", "--head", &ears, "--rate", "16000"];
    let dead = ["--materials", "1", "-o", &out, "--path", &walk, "--poses", "5"];
    let (_, said) = succeeds(&[&room[..], &dead].concat());
    assert!(said.contains("5 responses of") && said.contains("at 16000 Hz"), "{said}");
    let set = Responses::load(Path::new(&out), &LoadOptions::default()).unwrap();
    assert_eq!((set.responses.len(), set.sample_rate_hz, set.licence.as_str()), (5, 16_000.0, "MIT"));
    let (first, last) = (&set.responses[0], &set.responses[4]);
    assert_eq!((first.listener.position, last.listener.position), (Vec3::new(2.0, 0.5, 1.2), Vec3::new(4.0, 0.5, 1.2)));
    assert_eq!(first.source, Vec3::new(3.0, 3.2, 1.5));
    // It is to the left of one who looks along x, and to the right of one who has turned round.
    let side = |r: &Response| ild_db(&r.left, &r.right).unwrap();
    assert!(side(first) > 3.0 && side(last) < -3.0, "{} and {} dB", side(first), side(last));

    let fitted = ["-o", &out, "--path", &walk, "--fit", "0.4"];
    succeeds(&[&room[..], &fitted].concat());
    let set = Responses::load(Path::new(&out), &LoadOptions::default()).unwrap();
    let places: Vec<Vec3> = set.responses.iter().map(|r| r.listener.position).collect();
    assert!(
        places[0].distance(Vec3::new(0.4, 2.0, 1.4)) < 1e-5 && places[1].distance(Vec3::new(5.6, 2.0, 1.4)) < 1e-5,
        "{places:?}"
    );
    succeeds(&[&room[..], &["-o", &out, "--poses", "7", "--length", "0.1", "--materials", "0.1;0.1;0.2;0.2;0.4;0.6"]].concat());
    assert_eq!(Responses::load(Path::new(&out), &LoadOptions::default()).unwrap().responses.len(), 7);

    let wide = text("wide.csv");
    std::fs::write(&wide, "t,x,y,z,yaw,pitch,roll\n0,2,0.5,1.2,0,0,0\n10,9,0.5,1.2,180,0,0\n").unwrap();
    for (more, clue) in [
        (vec!["--path", &wide], "listener: expected inside the room, between 0,0,0 and [6, 4, 2.8], found pose 1"),
        (vec!["--path", &walk, "--fit", "2"], "does not fit: margin: expected 0 to less than half"),
        (vec!["--margin", "1.5"], "margin: expected 0 to less than half"),
        (vec!["--path", &text("none.csv")], "none.csv: cannot be read"),
    ] {
        let said = fails(&[&room[..], &["-o", &text("not")], &more].concat());
        assert!(said.contains(clue), "{more:?}: {said}");
        assert!(!folder.path().join("not").exists(), "{more:?}");
    }
}

/// A closed room of 6 x 4 x 2.8 m with named materials.
pub(crate) const ROOM: &str = "v 0 0 0\nv 6 0 0\nv 6 4 0\nv 0 4 0\nv 0 0 2.8\nv 6 0 2.8\nv 6 4 2.8\nv 0 4 2.8\n\
    usemtl carpet_thin\nf 1 2 3 4\nusemtl top\nf 5 8 7 6\nusemtl plasterboard\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n";

#[test]
fn a_mesh_is_simulated_at_places() {
    let folder = tempfile::tempdir().unwrap();
    let text = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    head(&folder.path().join("head"));
    let (ears, mesh, out) = (text("head"), text("room.obj"), text("out"));
    std::fs::write(&mesh, ROOM).unwrap();
    let room = ["simulate", &mesh, "--source", "3,3.2,1.5", "--head", &ears, "--rate", "16000", "--length", "0.1"];
    let quick = ["--rays", "500", "--beams", "512", "--order", "2", "-o", &out];
    let room = [&room[..], &quick].concat();
    let (_, said) = succeeds(&[&room[..], &["--materials", "top=0.3:0.5", "--at", "3,0.5,1.2", "--turns", "4"]].concat());
    assert!(said.contains("4 responses of 0.10 s at 16000 Hz from") && said.contains("67.2 m3"), "{said}");
    let set = Responses::load(Path::new(&out), &LoadOptions::default()).unwrap();
    assert_eq!((set.responses.len(), set.title.as_str()), (4, "room.obj"));
    // It is to the left of one who looks along x, and to the right of one who has turned round.
    let side = |i: usize| ild_db(&set.responses[i].left, &set.responses[i].right).unwrap();
    assert!(side(0) > 0.5 && side(2) < -0.5, "{} and {} dB", side(0), side(2));

    std::fs::remove_dir_all(&out).unwrap();
    let (_, said) = succeeds(&[&room[..], &["--materials", "top=brickwork", "--grid", "1"]].concat());
    let places = Responses::load(Path::new(&out), &LoadOptions::default()).unwrap().responses.len();
    assert_eq!(places, 6 * 4, "{said}");

    std::fs::write(text("leak.obj"), ROOM.replace("f 5 8 7 6\n", "")).unwrap();
    for (more, clue) in [
        (vec![], "room.obj: its materials cannot be found: material: expected a name of the table, perhaps"),
        (vec!["--materials", "top=brikwork"], "perhaps brickwork"),
        (vec!["--materials", "top=0.1,door=0.2"], "expected one that fits a group of the mesh: carpet_thin, top, plasterboard"),
        (vec!["--materials", "top=2"], "absorption of 2: expected 0 to 1, found 2"),
        (vec!["--materials", "top=0.1", "--at", "3,3.2,1.5"], "at least 0.1 m from the emitter"),
        (vec!["--materials", "top=0.1", "--grid", "1", "--height", "9"], "grid: expected a place in the room, found none"),
    ] {
        let said = fails(&[&room[..], &more].concat());
        assert!(said.contains(clue), "{more:?}: {said}");
    }
    let leak: Vec<&str> = room.iter().map(|a| if *a == mesh { "LEAK" } else { a }).collect();
    let file = text("leak.obj");
    let leak: Vec<&str> = leak.iter().map(|a| if *a == "LEAK" { file.as_str() } else { a }).collect();
    std::fs::remove_dir_all(&out).unwrap();
    let (_, said) = succeeds(&[&leak[..], &["--at", "3,0.5,1.2"]].concat());
    assert!(
        said.contains("4 edges, 20.00 m, have one triangle only") && said.contains("% of the energy left through"),
        "{said}"
    );
    let (table, _) = succeeds(&["simulate", "materials"]);
    assert!(
        table.contains("carpet_thin") && table.contains("0.02 0.04 0.08 0.20 0.35 0.40 0.40  ") && table.contains("scatters")
    );
}

#[test]
fn a_capture_is_simulated() {
    let folder = tempfile::tempdir().unwrap();
    let text = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    head(&folder.path().join("head"));
    let (ears, mesh, out) = (text("head"), text("room.obj"), text("walk"));
    std::fs::write(&mesh, ROOM).unwrap();
    let speech = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/speech.wav");
    let speech = speech.to_str().unwrap();
    let room = ["simulate", &mesh, "--source", "3,3.2,1.5", "--materials", "top=0.3", "--head", &ears, "--rate", "16000"];
    let quick = ["--length", "0.1", "--rays", "500", "--beams", "512", "--order", "2", "--seed", "3"];
    let dry = ["--dry", speech, "--clips", "2", "--clip", "0.25", "--test-share", "0.25"];
    let mesh_room = [&room[..], &quick, &dry, &["--poses", "4", "-o", &out]].concat();
    let (_, said) = succeeds(&mesh_room);
    assert!(said.contains("4 tracks, 6 clips to learn from, 2 to judge by"), "{said}");
    let capture = Capture::load(Path::new(&out)).unwrap();
    assert_eq!((capture.sample_rate_hz, capture.emitter()), (16_000.0, Some(Vec3::new(3.0, 3.2, 1.5))));
    for track in &capture.tracks {
        assert!(track.binaural.iter().all(|ear| ear.len() == track.voices[0].dry.len()));
        let at = track.path.keyframes()[0].pose.position;
        assert!(at.cmpgt(Vec3::splat(0.29)).all() && at.z < 2.8, "{at} is in the room");
    }
    // What is heard is not what is played: the louder ear of all responses has unit energy.
    let track = &capture.tracks[0];
    assert!(track.binaural[0] != track.voices[0].dry && track.binaural[0] != track.binaural[1]);

    let size = ["simulate", "box", "--size", "6,4,2.8", "--emitter", "3,3.2,1.5", "--head", &ears, "--rate", "16000"];
    let (_, said) = succeeds(&[&size[..], &["--length", "0.1", "--poses", "3"], &dry, &["-o", &text("box")]].concat());
    assert!(said.contains("3 tracks") && Capture::load(Path::new(&text("box"))).is_ok(), "{said}");

    let file = text("a.promenade");
    let scene = [&room[..], &quick, &dry, &["-o", &file]].concat();
    let part = [&mesh_room[..], &["--part", "1/2"]].concat();
    assert!(fails(&scene).contains("expected --dry for a capture, found a scene"));
    assert_eq!(promenade(&part).status.code(), Some(2), "parts hold responses");
}

#[test]
fn a_box_becomes_a_scene_that_ambisonic_microphones_hear() {
    let folder = tempfile::tempdir().unwrap();
    let text = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    head(&folder.path().join("head"));
    let (scene, click, out) = (text("box.promenade"), text("click.wav"), text("out.wav"));
    let room = ["simulate", "box", "--size", "6,4,2.8", "--emitter", "3,3.2,1.5", "--materials", "0.6"];
    let (_, said) = succeeds(&[&room[..], &["--head", &text("head"), "-o", &scene]].concat());
    assert!(said.contains("60 image sources"), "{said}");
    let mut dry = vec![0.0; 9_600];
    dry[100] = 1.0;
    wav::write(Path::new(&click), 48_000, &[&dry], Format::Float32).unwrap();
    let heard = |options: &[&str]| {
        succeeds(&[&["render", &scene, &click, &out, "--bits", "32f", "--pose", "2,2.2,1.4,20,0,0"], options].concat());
        sound::read(Path::new(&out)).unwrap().channels
    };
    let third = heard(&["--format", "ambix"]);
    assert_eq!(third.len(), 16);
    // The direct sound with the click, along the channels of its direction.
    let from = Pose::from_ypr(Vec3::new(2.0, 2.2, 1.4), 20.0_f32.to_radians(), 0.0, 0.0);
    let along = |at: Vec3| harmonics(3, from.to_head(at).normalize());
    let wanted = along(Vec3::new(3.0, 3.2, 1.5));
    let first = third[0][100];
    assert!(third[0][..99].iter().all(|x| x.abs() < 0.02 * first), "silence before it");
    for (channel, sound) in third.iter().enumerate() {
        let share = wanted[channel] / (2.0 * degree(channel) as f32 + 1.0).sqrt();
        assert!((sound[100] / first - share).abs() < 0.02, "{channel}: {} of {first}, not {share}", sound[100]);
    }
    // With the amplitude that the distance leaves of it, and air.
    let nearer = {
        succeeds(&["render", &scene, &click, &out, "--bits", "32f", "--pose", "2.5,2.7,1.45,0,0,0", "--format", "ambix"]);
        sound::read(Path::new(&out)).unwrap().channels[0][100]
    };
    assert!((nearer / first - 2.0).abs() < 0.06, "{nearer} of {first}");
    let quieter = heard(&["--format", "ambix", "--direct", "-20"]);
    assert!((quieter[0][100] / first - 0.1).abs() < 0.01);
    // What comes late comes from everywhere alike.
    let late = |channel: usize| third[channel][100 + 3_840..].iter().map(|x| f64::from(*x).powi(2)).sum::<f64>();
    for channel in 1..16 {
        let db = 10.0 * (late(channel) * (2.0 * degree(channel) as f64 + 1.0) / late(0)).log10();
        assert!(db.abs() < 1.5, "{channel}: {db} dB");
    }
    // A further sound where the first one is doubles it; as far away on the other side it comes from there.
    let two = |at: &str| heard(&["--format", "ambix", "--source", &format!("{at}={click}")]);
    let twice = two("3,3.2,1.5");
    let off = twice.iter().flatten().zip(third.iter().flatten()).map(|(two, one)| (two - 2.0 * one).abs()).fold(0.0, f32::max);
    assert!(off < 1e-4 * first, "{off} of {first}");
    let mirrored = along(Vec3::new(3.0, 1.2, 1.5));
    for (channel, sound) in two("3,1.2,1.5").iter().enumerate() {
        let share = (wanted[channel] + mirrored[channel]) / (2.0 * degree(channel) as f32 + 1.0).sqrt();
        assert!((sound[100] / first - share).abs() < 0.04, "{channel}: {} of {first}, not {share}", sound[100]);
    }
    let lower = heard(&["--format", "ambix", "--order", "1"]);
    assert!(lower[..] == third[..4], "a lower order is its first channels");

    let render = ["render", &scene, &click, &out, "--format", "ambix"];
    all_fail(&[
        ([&render[..], &["--width", "0.5"]].concat(), "--width: expected --format binaural with it, found ambix"),
        ([&render[..], &["--head", "ears.sofa"]].concat(), "--head: expected --format binaural"),
        ([&render[..], &["--mix", "0.5"]].concat(), "--mix below 1: expected --format binaural"),
    ]);
    let factory = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../presets/scenes/iosr-room-a.promenade");
    let said = fails(&["render", factory.to_str().unwrap(), &click, &text("none.wav"), "--format", "ambix"]);
    assert!(said.contains("iosr-room-a.promenade: expected a scene of image sources for Ambisonics"), "{said}");
    assert!(!folder.path().join("none.wav").exists());
}

/// Level of what a listener hears of a click in a scene, dB.
fn heard_db(folder: &Path, scene: &str, pose: &str) -> f64 {
    let text = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    let (click, out) = (text("click.wav"), text("heard.wav"));
    let mut dry = vec![0.0; 32_000];
    dry[100] = 1.0;
    wav::write(Path::new(&click), 16_000, &[&dry], Format::Float32).unwrap();
    succeeds(&["render", scene, &click, &out, "--bits", "32f", "--pose", pose]);
    let heard = sound::read(Path::new(&out)).unwrap().channels;
    10.0 * heard.iter().flatten().map(|v| f64::from(*v).powi(2)).sum::<f64>().log10()
}

#[test]
fn a_scene_is_as_loud_however_it_is_made_and_its_recipe_makes_it_again() {
    let folder = tempfile::tempdir().unwrap();
    let text = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    head(&folder.path().join("head"));
    let (ears, mesh, scene, again) = (text("head"), text("room.obj"), text("a.promenade"), text("b.promenade"));
    std::fs::write(&mesh, ROOM).unwrap();
    let of_mesh = ["simulate", &mesh, "--source", "3,3.2,1.5", "--head", &ears, "--rate", "16000", "--rays", "8000"];
    let pose = "2,1.2,1.5,40,0,0";
    let made = |options: &[&str]| {
        succeeds(&[&of_mesh[..], &["--order", "4", "--waves", "0", "-o", &scene], options].concat());
        heard_db(folder.path(), &scene, pose)
    };
    let rules = ["--materials", "*=0.1"];
    let [fine, coarse] = ["0.5", "2"].map(|grid| made(&[&rules[..], &["--grid", grid]].concat()));
    assert!((fine - coarse).abs() < 0.3, "{fine} and {coarse} dB");
    let louder = made(&[&rules[..], &["--grid", "2", "--gain", "-7"]].concat());
    assert!((louder - coarse + 7.0).abs() < 0.05, "{louder} and {coarse} dB");
    let of_box = ["simulate", "box", "--size", "6,4,2.8", "--emitter", "3,3.2,1.5", "--head", &ears, "--rate", "16000"];
    succeeds(&[&of_box[..], &["--materials", "0.1", "--waves", "0", "-o", &scene]].concat());
    let lengths = heard_db(folder.path(), &scene, pose);
    assert!((lengths - coarse).abs() < 0.4, "{lengths} and {coarse} dB");
    // Everything that is not as it is by itself.
    let options = ["--grid", "1.7", "--height", "1.2", "--margin", "0.4", "--beams", "900", "--scale", "1.1", "--gain", "-3"];
    let more = ["--seed", "4", "--images", "20", "--head-turns", "2", "--humidity", "40", "--flatten", "0.001"];
    let first = [&rules[..], &options, &more, &["--title", "Room"]].concat();
    made(&first);
    let bytes = std::fs::read(&scene).unwrap();
    let (about, _) = succeeds(&["inspect", &scene, "--json"]);
    let about: serde_json::Value = serde_json::from_str(&about).unwrap();
    let recipe = about["recipe"].as_str().unwrap().replace('\'', "");
    let words: Vec<&str> = recipe.split(' ').collect();
    let words = words.iter().map(|word| match *word {
        "room.obj" => mesh.as_str(),
        "head" => ears.as_str(),
        other => other,
    });
    succeeds(&[&words.collect::<Vec<&str>>()[..], &["--title", "Room", "-o", &again]].concat());
    assert!(std::fs::read(&again).unwrap() == bytes, "{recipe}");
}

/// Names and contents of all files of a folder.
fn files(folder: &Path) -> std::collections::BTreeMap<String, Vec<u8>> {
    let name = |path: &Path| path.file_name().unwrap().to_str().unwrap().to_owned();
    let all = std::fs::read_dir(folder).unwrap().map(|f| f.unwrap().path());
    all.map(|path| (name(&path), std::fs::read(&path).unwrap())).collect()
}

#[test]
fn parts_together_are_the_whole() {
    let folder = tempfile::tempdir().unwrap();
    let text = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    head(&folder.path().join("head"));
    let (ears, mesh, parts, whole, joined) = (text("head"), text("room.obj"), text("parts"), text("whole"), text("joined"));
    std::fs::write(&mesh, ROOM).unwrap();
    let of_mesh = ["simulate", &mesh, "--source", "3,3.2,1.5", "--head", &ears, "--rate", "16000", "--length", "0.1"];
    let of_mesh = [&of_mesh[..], &["--rays", "500", "--beams", "512", "--order", "2", "--materials", "top=0.3:0.5"]].concat();
    let of_mesh = [&of_mesh[..], &["--poses", "7"]].concat();
    let of_box = ["simulate", "box", "--size", "6,4,2.8", "--emitter", "3,3.2,1.5", "--head", &ears, "--rate", "16000"];
    let of_box = [&of_box[..], &["--length", "0.05", "--order", "2", "--poses", "5"]].concat();
    // The folder of a part, as the command names it.
    let made = |room: &[&str], part: &str| {
        let (_, said) = succeeds(&[room, &["-o", &parts, "--part", part]].concat());
        let line = said.lines().find(|l| l.contains("/part-")).unwrap();
        (line.split(": ").next().unwrap().to_owned(), said)
    };
    for room in [&of_mesh, &of_box] {
        succeeds(&[&room[..], &["-o", &whole]].concat());
        let folders = ["1/3", "2/3", "3/3"].map(|part| made(room, part).0);
        // In any order.
        let (_, said) = succeeds(&["join", &folders[2], &folders[0], &folders[1], "-o", &joined]);
        assert!(said.contains("responses of 3 parts"), "{said}");
        assert_eq!(files(Path::new(&whole)), files(Path::new(&joined)));
        std::fs::remove_dir_all(&whole).unwrap();
        std::fs::remove_dir_all(&joined).unwrap();
    }

    // What is there is not made again, what was broken off is.
    let part = |room: &[&str], part| made(room, part).0;
    let [a, b] = ["1/2", "2/2"].map(|k| part(&of_mesh, k));
    let before = files(Path::new(&a));
    assert!(made(&of_mesh, "1/2").1.contains("is there already"));
    let sound = before.keys().find(|name| name.ends_with(".wav")).unwrap();
    std::fs::write(Path::new(&a).join("responses.json"), "half of i").unwrap();
    fails(&["join", &a, &b, "-o", &joined]);
    assert!(!made(&of_mesh, "1/2").1.contains("is there already"));
    for missing in [sound.as_str(), "responses.json"] {
        std::fs::remove_file(Path::new(&a).join(missing)).unwrap();
        fails(&["join", &a, &b, "-o", &joined]);
        assert!(!made(&of_mesh, "1/2").1.contains("is there already"), "{missing}");
        assert_eq!(files(Path::new(&a)), before);
    }

    let of_thirds = part(&of_mesh, "1/3");
    let other_seed = part(&[&of_mesh[..], &["--seed", "2"]].concat(), "2/2");
    std::fs::write(&mesh, ROOM.replace("2.8", "2.9")).unwrap();
    let other_room = part(&of_mesh, "2/2");
    let bare = text("part-2-of-2-0123456789abcdef");
    std::fs::create_dir(text("empty")).unwrap();
    std::fs::create_dir(&bare).unwrap();
    let wide = [&of_mesh[..], &["-o", &parts, "--part", "8/8"]].concat();
    all_fail(&[
        (vec!["join", &a, "-o", &joined], "parts: expected all 2, found none of number 2"),
        (vec!["join", &a, &b, &a, "-o", &joined], "found the same part"),
        (vec!["join", &a, &of_thirds, "-o", &joined], "found part 1 of 3 of another run"),
        (vec!["join", &a, &other_seed, "-o", &joined], "expected a part of 2 of the same run as"),
        (vec!["join", &a, &other_room, "-o", &joined], "found part 2 of 2 of another run"),
        (vec!["join", &a, &text("empty"), "-o", &joined], "expected a part as `simulate` calls it, part-K-of-N-RUN"),
        (vec!["join", &bare, "-o", &joined], "expected a complete part of a simulation, with a responses.json, found none"),
        (wide, "--part: expected at most as many parts as places of the listener, found 8 of 8"),
    ]);
    // A name that leads out of its folder.
    let manifest = Path::new(&b).join("responses.json");
    let stolen = std::fs::read_to_string(&manifest).unwrap().replace("pose-", "../pose-");
    std::fs::write(manifest, stolen).unwrap();
    assert!(fails(&["join", &a, &b, "-o", &joined]).contains("expected names of files in its folder, found ../pose-"));
    // What was begun is no set.
    assert!(!Path::new(&joined).join("responses.json").exists());
}

#[test]
fn a_room_is_mapped() {
    let folder = tempfile::tempdir().unwrap();
    let text = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (mesh, png, svg) = (text("room.obj"), text("map.png"), text("map.svg"));
    std::fs::write(&mesh, ROOM).unwrap();
    let map = ["map", &mesh, "--source", "1.2,3.2,1.5", "--materials", "top=0.3:0.5", "--rays", "4000", "--beams", "512"];
    let exr = text("map.exr");
    let map = [&map[..], &["--length", "1", "--order", "2"]].concat();
    let (table, _) = succeeds(&[&map[..], &["--grid", "0.5", "-o", &png, "-o", &svg, "-o", &exr]].concat());
    // Least, median and most of a row.
    let row = |name: &str| -> Vec<f64> {
        let line = table.lines().find(|l| l.starts_with(name)).unwrap_or_else(|| panic!("{name}: {table}"));
        line[name.len()..].split_whitespace().take(3).map(|n| n.parse().unwrap()).collect()
    };
    let (level, t20, c50, sti) = (row("level, dB"), row("T20, s"), row("C50, dB"), row("STI"));
    // Near the source most is direct sound; a room of plasterboard is loud everywhere.
    assert!(level[2] > level[0] + 2.0 && level[0] > -12.0, "{table}");
    assert!(t20[0] > 0.2 && t20[2] < 3.0 && t20[1] <= t20[2], "{table}");
    assert!(c50[2] > c50[0] + 2.0 && sti[0] > 0.3 && sti[2] <= 1.0 && sti[2] > sti[0], "{table}");
    let drawn = std::fs::read_to_string(&svg).unwrap();
    for title in ["Level, dB re direct sound at 1 m", "T20, s", "C50, dB", "STI", "2 m"] {
        assert!(drawn.contains(title), "{title}");
    }
    // The same numbers.
    let (size, channels) = numbers_of(&exr);
    let most = |name: &str| channels[name].iter().copied().filter(|n| n.is_finite()).fold(f32::MIN, f32::max);
    assert!((most("level, dB") - level[2] as f32).abs() < 0.006 && (most("STI") - sti[2] as f32).abs() < 0.006);
    assert!(size.0 > 4 && size.1 > 4 && channels.len() == 4, "{size:?}");
    let pixels = std::fs::read(&png).unwrap();
    assert!(pixels.starts_with(b"\x89PNG") && pixels.len() > 10_000, "{} bytes", pixels.len());
    all_fail(&[
        ([&map[..], &["-o", &text("map.pdf")]].concat(), "map.pdf: expected a file ending in .png or .svg or .exr"),
        ([&map[..], &["-o", &png, "--grid", "0.01", "--margin", "0"]].concat(), "--grid: expected at most 4000 places of 1 s"),
    ]);
}

/// Size of an OpenEXR file, and its channels by name, row by row.
fn numbers_of(path: &str) -> ((usize, usize), std::collections::BTreeMap<String, Vec<f32>>) {
    use exr::prelude::{ReadChannels, ReadLayers, read};
    let image = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
    let layer = image.from_file(path).unwrap().layer_data;
    let numbers = |channel: &exr::prelude::AnyChannel<exr::prelude::FlatSamples>| {
        (channel.name.to_string(), channel.sample_data.values_as_f32().collect::<Vec<f32>>())
    };
    ((layer.size.0, layer.size.1), layer.channel_data.list.iter().map(numbers).collect())
}

#[test]
fn a_source_faces_where_it_is_turned() {
    let folder = tempfile::tempdir().unwrap();
    let text = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (mesh, exr) = (text("room.obj"), text("map.exr"));
    std::fs::write(&mesh, ROOM).unwrap();
    let map = ["map", &mesh, "--source", "1.2,2,1.5", "--materials", "top=0.9:0.5", "--rays", "2000", "--beams", "512"];
    let map = [&map[..], &["--length", "0.3", "--order", "0", "--grid", "0.5", "-o", &exr, "--directivity"]].concat();
    // Mean level left and right of the source.
    let sides = |options: &[&str]| {
        succeeds(&[&map[..], options].concat());
        let ((width, height), channels) = numbers_of(&exr);
        let column = |x: usize| {
            let all = (0..height).map(|y| channels["level, dB"][y * width + x]).filter(|level| level.is_finite());
            all.clone().sum::<f32>() / all.count() as f32
        };
        column(width - 1) - column(0)
    };
    let (omni, ahead, away) = (sides(&["omni"]), sides(&["cardioid"]), sides(&["cardioid", "--facing", "180,0"]));
    assert!(ahead > omni + 3.0 && away < omni - 1.5, "{omni}, {ahead}, {away} dB");
    all_fail(&[
        ([&map[..], &["trumpet"]].concat(), "--directivity: expected omni, subcardioid"),
        ([&map[..], &[&text("none.sofa")]].concat(), "none.sofa: "),
    ]);
}

#[test]
fn a_camera_sees_where_the_sound_falls() {
    let folder = tempfile::tempdir().unwrap();
    let text = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (mesh, png, exr) = (text("room.obj"), text("view.png"), text("view.exr"));
    std::fs::write(&mesh, ROOM).unwrap();
    // From the middle of the room along the way to the source, which is near the wall behind it.
    let map = ["map", &mesh, "--source", "0.4,2,1.2", "--materials", "top=0.3:0.5", "--rays", "4000", "--length", "0.5"];
    let map = [&map[..], &["--camera", "4,2,1.2,180,0,0"]].concat();
    let (said, _) = succeeds(&[&map[..], &["--size", "64,48", "--fov", "70", "-o", &png, "-o", &exr]].concat());
    assert!(said.contains("least") && said.contains("most"), "{said}");
    let (size, channels) = numbers_of(&exr);
    assert_eq!(size, (64, 48));
    let (level, distance) = (&channels["level"], &channels["distance"]);
    let loudest = (0..level.len()).max_by(|a, b| level[*a].total_cmp(&level[*b])).unwrap();
    let (x, y) = (loudest % 64, loudest / 64);
    assert!(x.abs_diff(32) < 6 && y.abs_diff(24) < 6, "loudest at {x}, {y}");
    assert!((distance[24 * 64 + 32] - 4.0).abs() < 0.05, "{} m to the wall", distance[24 * 64 + 32]);
    assert!(std::fs::read(&png).unwrap().starts_with(b"\x89PNG"));
    all_fail(&[([&map[..], &["-o", &text("view.svg")]].concat(), "view.svg: expected a file ending in .png or .exr")]);
    for (option, value, clue) in
        [("--size", "0,5", "expected a width and a height of 1 to 8192 pixels"), ("--grid", "1", "cannot be used with")]
    {
        let out = promenade(&[&map[..], &["-o", &png, option, value]].concat());
        let said = String::from_utf8(out.stderr).unwrap();
        assert!(out.status.code() == Some(2) && said.contains(clue), "{said}");
    }
}

#[test]
fn a_mix_stands_out_where_somebody_speaks() {
    let folder = tempfile::tempdir().unwrap();
    let text = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (mix, weights, curves) = (text("mix.wav"), text("mix.json"), text("mix.svg"));
    // Noise of 6 s in which a tone sounds for a second.
    let rate = 16_000_u32;
    let mut noise = promenade_testing::Noise::new(1);
    let sample = |i: u32| {
        let t = f64::from(i) / f64::from(rate);
        let tone = if (3.0..4.0).contains(&t) { 0.3 * (std::f64::consts::TAU * 500.0 * t).sin() } else { 0.0 };
        0.02 * noise.next().unwrap() + tone as f32
    };
    let samples: Vec<f32> = (0..6 * rate).map(sample).collect();
    wav::write(mix.as_ref(), rate, &[&samples, &samples], Format::Float32).unwrap();
    let command = ["map", "saliency", &mix, "--samples", "80", "--least", "20", "-o"];
    let (said, _) = succeeds(&[&command[..], &[&weights, "-o", &curves]].concat());
    assert!(said.starts_with("150 frames: 20 to "), "{said}");
    let found: serde_json::Value = serde_json::from_slice(&std::fs::read(&weights).unwrap()).unwrap();
    let frames = found["frames"].as_array().unwrap();
    let samples: Vec<u64> = frames.iter().map(|frame| frame["samples"].as_u64().unwrap()).collect();
    let total: u64 = samples.iter().sum();
    assert!(frames.len() == 150 && total.abs_diff(80 * 150) <= 75, "{total}");
    let largest = (0..150).max_by_key(|i| samples[*i]).unwrap();
    assert!(
        (62..=100).contains(&largest),
        "most at frame {largest}, where the tone begins at 75, and half a second before is ahead of it"
    );
    assert!(std::fs::read_to_string(&curves).unwrap().contains("Samples per pixel"));
    std::fs::write(&mix, "no sound").unwrap();
    all_fail(&[
        ([&command[..], &[&text("mix.png")]].concat(), "mix.png: expected a file ending in .json or .svg"),
        ([&command[..], &[&weights]].concat(), "mix.wav: "),
    ]);
}

#[test]
fn what_does_not_decay_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let text = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (plane, closed, picture) = (text("plane.obj"), text("room.obj"), text("map.png"));
    let corners = "v 0 0 0\nv 20 0 0\nv 20 20 0\nv 0 20 0\n";
    std::fs::write(&plane, format!("{corners}v 0 0 4\nv 20 0 4\nusemtl asphalt\nf 1 2 3 4\n")).unwrap();
    std::fs::write(&closed, ROOM).unwrap();
    let few = ["--rays", "2000", "--grid", "2", "--length", "0.5", "-o", &picture];
    let outdoors = ["map", &plane, "--source", "5,5,1.5", "--materials", "*=hard_surface"];
    let (out, said) = succeeds(&[&outdoors[..], &few].concat());
    let row = out.lines().find(|line| line.starts_with("T20, s")).unwrap();
    let places: usize = row.split_whitespace().rev().nth(2).unwrap().parse().unwrap();
    // By chance a few rays may scatter to one place along a line.
    assert!(places <= 3 && out.contains("none"), "{out}{said}");
    // Nothing absorbs, not even the picture's colours.
    succeeds(&[&["map", &closed, "--source", "3,2,1.5", "--materials", "*=0"][..], &few].concat());
}

#[test]
fn places_outside_of_a_closed_room_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let text = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    head(&folder.path().join("head"));
    let (closed, ears, out) = (text("room.obj"), text("head"), text("out"));
    std::fs::write(&closed, ROOM).unwrap();
    let simulate = |mesh: &str, more: &[&str]| {
        fails(&[&["simulate", mesh, "--materials", "*=0.2", "--head", &ears, "--rate", "16000", "-o", &out][..], more].concat())
    };
    let said = simulate(&closed, &["--source", "7,2,1.5", "--at", "3,2,1.5"]);
    let clue = "--emitter: expected a place in the closed room, which lies from 0.00,0.00,0.00 to 6.00,4.00,2.80 m, found 7.00";
    assert!(said.contains(clue) && said.contains("the nearest place inside is 5."), "{said}");
    let said = simulate(&closed, &["--source", "3,2,1.5", "--at", "3,2,5"]);
    assert!(said.contains("listener: expected a place in the closed room"), "{said}");
    let millimetres = text("millimetres.obj");
    let scaled = |line: &str| match line.strip_prefix("v ") {
        Some(place) => {
            place.split(' ').fold("v".to_owned(), |line, c| format!("{line} {}", 1000.0 * c.parse::<f64>().unwrap()))
        }
        None => line.to_owned(),
    };
    std::fs::write(&millimetres, ROOM.lines().map(|line| scaled(line) + "\n").collect::<String>()).unwrap();
    let said = simulate(&millimetres, &["--source", "3,2,1.5", "--at", "3,1,1.5"]);
    assert!(said.contains("--scale 0.001 makes it") && said.contains("--scale 1"), "{said}");
}
