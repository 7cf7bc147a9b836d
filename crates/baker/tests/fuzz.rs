//! Files of every kind that nobody should have made: an error or something that can be used, in bounded memory, and never a
//! panic.
//!
//! States of the plugin and packets of Open Sound Control are searched where the plugin is tested.

use promenade_acoustics::{ImageOptions, Images, Material, Measures, Mesh, RayOptions, Reflected, Room, late_field};
use promenade_baker::checkpoint;
use promenade_baker::reconstruction::{Place, PointOptions};
use promenade_baker::simulation::directivity;
use promenade_baker::{LoadOptions, Responses, read_head, sound};
use promenade_core::headphones::Headphones;
use promenade_core::{BlockParams, Scene, SceneCard, Spatializer};
use promenade_paths::{ImportOptions, Summary, WriteFormat, alone};
use promenade_testing::fuzz::{Counting, Input, Search};
use promenade_testing::{heads, hostile, noise, scenes};
use std::fmt::Display;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// What reading a file of some kilobytes may take at a time, bytes, beside what it says of itself.
const FILE_BYTES: usize = 16 << 20;
/// A path that is read: two keys of an animation may lie as many steps apart as a path has keyframes at most.
const PATH_BYTES: usize = 256 << 20;
/// What preparing a scene for one listener may take at a time, bytes.
const SCENE_BYTES: usize = 512 << 20;

fn text(error: impl Display) -> String {
    error.to_string()
}

/// A file of the repository.
fn file(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path)
}

#[test]
fn scenes_with_a_right_checksum() {
    let seed = |(name, scene): (&str, Arc<Scene>)| Input::new(format!("{name}.promenade"), scene.to_bytes().unwrap());
    let seeds = hostile::scenes(8_000.0).into_iter().filter(|(name, _)| !name.contains("million")).map(seed).collect();
    Search { name: "scene", cases: 1000, most_bytes: SCENE_BYTES }.run(seeds, |input, _| {
        let scene = Arc::new(Scene::from_bytes(&input.bytes).map_err(text)?);
        let head = SceneCard::head_len(&input.bytes[..8]).unwrap();
        assert_eq!(&SceneCard::from_head(&input.bytes[..head]).unwrap().provenance, scene.provenance());
        let again = Scene::from_bytes(&scene.to_bytes().expect("what was read can be written")).map_err(text);
        assert!(again.expect("what was written can be read") == *scene, "a scene is another after it was written");
        let rate = scene.grid().sample_rate_hz;
        if scene.playable_at(rate).is_err() {
            return Ok(());
        }
        let mut player = Spatializer::new(rate);
        player.install(Box::new(scenes::full_renderer(&scene, rate, 1)));
        let dry = noise(1, (rate / 10.0) as usize);
        let out = scenes::render(&mut player, &dry, &[480, 31], &BlockParams::default(), scenes::walk(rate));
        assert!(out.iter().flatten().all(|x| hostile::is_output(*x)), "what is played is no sound");
        Ok(())
    });
}

#[test]
fn sounds() {
    Search { name: "sound", cases: 3000, most_bytes: FILE_BYTES }.run(Vec::new(), |_, path| {
        let sound = sound::read(path).map_err(text)?;
        assert!(sound.frames() > 0 && sound.channels.iter().all(|c| c.len() == sound.frames()));
        assert!(sound.channels.iter().flatten().all(|x| x.is_finite()), "samples that are no numbers");
        Ok(())
    });
}

#[test]
fn measured_responses() {
    let path = std::env::temp_dir().join(format!("promenade-fuzz-{}.sofa", std::process::id()));
    heads::write_sofa_of(&path, 0.09, 8, 64);
    let seed = Input::new("head.sofa", fs::read(&path).unwrap());
    fs::remove_file(path).unwrap();
    Search { name: "sofa", cases: 400, most_bytes: FILE_BYTES }.run(vec![seed], |_, path| {
        let responses = Responses::load(path, &LoadOptions::default()).map_err(text);
        if let Ok(responses) = &responses {
            assert!(responses.responses.iter().all(|r| r.left.iter().chain(&r.right).all(|x| x.is_finite())), "no numbers");
        }
        let head = read_head(path).map_err(text);
        responses.map(|_| ()).and(head.map(|_| ()))
    });
}

#[test]
fn directivities() {
    let path = std::env::temp_dir().join(format!("promenade-fuzz-directivity-{}.sofa", std::process::id()));
    heads::write_directivity(&path, "FreeFieldDirectivityTF", [2, 12], [0.0, 1.0, 0.0]);
    let seed = Input::new("talker.sofa", fs::read(&path).unwrap());
    fs::remove_file(path).unwrap();
    Search { name: "directivity", cases: 400, most_bytes: FILE_BYTES }.run(vec![seed], |_, path| {
        let sent = directivity(path).map_err(text)?.towards([0.3, -0.8, 0.2]);
        assert!(sent.iter().all(|a| a.is_finite() && *a > 0.0), "{sent:?}");
        Ok(())
    });
}

#[test]
fn reconstructions_of_places() {
    let kept = file("crates/testing/fuzz/place/whole");
    Search { name: "place", cases: 4000, most_bytes: FILE_BYTES }.run(Vec::new(), |input, path| {
        let folder = path.parent().unwrap();
        let beside = match input.name.as_str() {
            "images.bin" | "images.txt" => "points3D.bin",
            "points3D.bin" | "points3D.txt" => "images.txt",
            _ => "",
        };
        if beside.is_empty() {
            return Place::load(path, &PointOptions::default()).map(check_place).map_err(text);
        }
        fs::copy(kept.join(beside), folder.join(beside)).unwrap();
        let place = Place::load(folder, &PointOptions::default());
        fs::remove_file(folder.join(beside)).unwrap();
        place.map(check_place).map_err(text)
    });
}

fn check_place(place: Place) {
    match place {
        Place::Points(found) => {
            assert!(found.points.iter().all(|p| p.position.is_finite() && p.colour.iter().all(|c| c.is_finite())));
            assert!(found.cameras.iter().all(|camera| camera.head().is_valid()), "a camera without a pose");
            // Cameras may be where no path can be; that is an error.
            let _refused = found.place(&promenade_paths::PlacementOptions::default(), &mut Vec::new());
        }
        Place::Surface(surface) => {
            // Those of no area or of more than there are numbers are refused here.
            let points = surface.sample(10, 1).unwrap_or_default();
            assert!(points.iter().all(|p| p.position.is_finite()), "points that are nowhere");
        }
    }
}

#[test]
fn shapes_of_rooms() {
    Search { name: "mesh", cases: 4000, most_bytes: FILE_BYTES }.run(Vec::new(), |_, path| {
        let mut mesh = Mesh::load(path).map_err(text)?;
        mesh.group_by_direction();
        let report = mesh.report();
        let _texts = report.warnings();
        assert!(mesh.bounds().iter().flatten().all(|x| x.is_finite()));
        assert!(mesh.section(1.0).iter().flatten().flatten().all(|x| x.is_finite()), "a section that is nowhere");
        // What no room can be made of is refused here.
        let materials = mesh.merge_groups(vec![Material::even("wall", 0.2, 0.3); mesh.groups.len()]);
        if let Ok(room) = Room::new(&mesh, &materials) {
            traced(&mesh, &room);
        }
        Ok(())
    });
}

/// Sends a few rays through a room, whose middle may lie outside of it.
fn traced(mesh: &Mesh, room: &Room) {
    let [low, high] = mesh.bounds();
    let at = |share: f64| [0, 1, 2].map(|axis| low[axis] + share * (high[axis] - low[axis]));
    let (source, listener) = (at(0.4), at(0.6));
    let images = Images::new(room, source, &ImageOptions { order: 2, beams: 64, exact_order: 1 }).unwrap();
    let seen = images.seen_from(room, listener, Reflected::Specular).unwrap();
    let options = RayOptions { rays: 64, length_s: 0.2, images: Some(&images), ..RayOptions::default() };
    let late = late_field(room, source, &[listener], &options, |_| ()).unwrap();
    let measures = Measures::new(listener, &seen, &late.echograms[0], None);
    let values = [measures.level_db, measures.t20_s, measures.c50_db, measures.sti];
    assert!(values.iter().flatten().all(|value| value.is_finite()) || listener == source, "{measures:?}");
    room.encloses(source).unwrap();
}

#[test]
fn texts_for_headphones() {
    let texts = [
        "Preamp: -6.2 dB\nFilter 1: ON LSC Fc 105 Hz Gain 5.5 dB Q 0.70\nFilter 2: ON PK Fc 2300 Hz Gain -4.1 dB BW Oct 0.5\n",
        "Channel: L\nFilter: ON HPQ Fc 30 Hz Q 0.7\nChannel: R\nFilter  3: ON  None\nFilter: ON LS 6dB Fc 90 Hz Gain 4 dB\n",
        "GraphicEQ: 20 0.0; 1000 -6; 20000 -6\n",
    ];
    let utf16 = texts[0].encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<u8>>();
    let seeds = texts.iter().map(|text| text.as_bytes().to_vec()).chain([utf16]);
    let seeds = seeds.enumerate().map(|(i, bytes)| Input::new(format!("{i}.txt"), bytes)).collect();
    Search { name: "headphones", cases: 3000, most_bytes: FILE_BYTES }.run(seeds, |input, _| {
        let headphones = Headphones::from_bytes(&input.bytes).map_err(text)?;
        let kept = serde_json::to_string(&headphones).map_err(text)?;
        assert!(serde_json::from_str::<Headphones>(&kept).is_ok(), "what is kept can be read");
        let mut ears = [vec![0.0; 2000], vec![0.0; 2000]];
        ears.iter_mut().for_each(|ear| ear[0] = 1e3);
        let [left, right] = &mut ears;
        headphones.filter(48_000.0).process([left, right]);
        assert!(ears.iter().flatten().all(|x| x.abs() <= 1e6), "a sample beyond the bound");
        Ok(())
    });
}

#[test]
fn camera_paths_and_objects_of_films() {
    Search { name: "path", cases: 5000, most_bytes: PATH_BYTES }.run(Vec::new(), |input, _| {
        let options = ImportOptions { fps: input.name.starts_with("p.gl").then_some(2.0), ..ImportOptions::default() };
        let path = promenade_paths::read(&input.name, &input.bytes, &options, &mut alone).map_err(text)?.path;
        assert!(path.keyframes().iter().all(|k| k.t_s.is_finite() && k.pose.is_valid()), "a keyframe that is no pose");
        let _sums = Summary::of(&path);
        for (name, form) in [("p.json", WriteFormat::Json), ("p.csv", WriteFormat::Csv)] {
            let written = promenade_paths::write(&path, form);
            let again = promenade_paths::read(name, written.as_bytes(), &ImportOptions::default(), &mut alone);
            let again = again.map_err(text).expect("what was written can be read");
            assert_eq!(again.path.keyframes().len(), path.keyframes().len(), "keyframes are lost");
        }
        Ok(())
    });
}

#[test]
fn checkpoints_and_anchors() {
    let folder = file("crates/baker/tests/checkpoint");
    let names = ["full", "sh", "simple_sh", "formats", "exported", "anchors"].map(|name| format!("{name}.safetensors"));
    let seeds = names.map(|name| Input::new(&name, fs::read(folder.join(&name)).unwrap())).to_vec();
    let (checkpoint, anchors) = (folder.join("simple_sh.safetensors"), folder.join("anchors.safetensors"));
    Search { name: "checkpoint", cases: 3000, most_bytes: FILE_BYTES }.run(seeds, |input, path| {
        let imported = match input.name.as_str() {
            "anchors.safetensors" => checkpoint::import(&checkpoint, Some(path), None),
            "exported.safetensors" => checkpoint::import(path, None, None),
            _ => checkpoint::import(path, Some(&anchors), None),
        };
        imported.map(|_| ()).map_err(text)
    });
}
