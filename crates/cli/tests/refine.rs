//! `promenade refine` as a user runs it.

use crate::common::{fails, succeeds};
use crate::simulate::{ROOM, head};
use promenade_baker::Responses;
use promenade_core::Scene;
use promenade_core::glam::Vec3;
use std::path::Path;

#[test]
fn measured_responses_refine_a_room_for_a_source_that_was_not_measured() {
    let folder = tempfile::tempdir().unwrap();
    let text = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    head(&folder.path().join("head"));
    let (ears, mesh, measured, out) = (text("head"), text("room.obj"), text("measured"), text("corner.promenade"));
    std::fs::write(&mesh, ROOM).unwrap();
    // What is measured is the same room with other walls, from three places.
    let mut all = Responses::default();
    for (source, name) in [("3,3.2,1.5", "a"), ("1,1,1.2", "b"), ("5,1,1.6", "c")] {
        let of = ["simulate", &mesh, "--source", source, "--materials", "*=0.8", "--head", &ears, "--rate", "16000"];
        let quick = ["--length", "0.15", "--rays", "300", "--beams", "256", "--order", "1", "--poses", "4", "-o", &measured];
        succeeds(&[&of[..], &quick].concat());
        let mut one = Responses::load(Path::new(&measured), &promenade_baker::LoadOptions::default()).unwrap();
        one.responses.iter_mut().for_each(|r| r.name = format!("{name}-{}", r.name));
        let responses = [all.responses, one.responses.clone()].concat();
        all = Responses { responses, ..one };
        std::fs::remove_dir_all(&measured).unwrap();
    }
    all.save(Path::new(&measured)).unwrap();
    let room =
        ["refine", &measured, "--simulate", &mesh, "--materials", "*=0.6", "--order", "1", "--rays", "300", "--steps", "3"];
    let judged = [&room[..], &["--head", &ears, "--evaluate", "--seeds", "1", "--test-source", "2"]].concat();
    let (table, said) = succeeds(&judged);
    assert!(said.contains("8 responses to learn from, 4 of held-out sources"), "{said}");
    assert!(
        ["simulation alone", "regression", "flow"].iter().all(|row| table.contains(row)) && table.lines().count() == 4,
        "{table}"
    );
    succeeds(&[&room[..], &["--head", &ears, "--emitter", "2,2.5,1.4", "-o", &out]].concat());
    let scene = Scene::from_bytes(&std::fs::read(&out).unwrap()).unwrap();
    assert!(scene.emitter().unwrap().distance(Vec3::new(2.0, 2.5, 1.4)) < 1e-4 && scene.provenance().recipe.contains("refine"));
    let none = fails(&[&room[..], &["--head", &ears, "--evaluate", "--test-source", "9"]].concat());
    assert!(none.contains("found 12 and 0"), "{none}");
    let outside = fails(&[&room[..], &["--head", &ears, "--emitter", "9,2.5,1.4", "-o", &out]].concat());
    assert!(outside.contains("expected a place in the closed room"), "{outside}");
}
