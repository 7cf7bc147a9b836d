//! What `measure --trade` finds is had by the commands that play or write it, with the figures that it promised.

use super::common::{Place, all_fail, json, succeeds};
use promenade_core::Scene;
use serde_json::Value;

fn number(setting: &Value, path: &str) -> f64 {
    setting.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("{path} in {setting}"))
}

#[test]
fn a_setting_within_an_error_is_had_by_the_commands() {
    let place = Place::new();
    let text = |name: &str| place.text(name);
    let (room, less, with_front, dry) = (place.bake(), text("less.promenade"), text("front.promenade"), text("dry.wav"));
    let trade = json(&["measure", &room, "--trade", "--within", "1", "--json", "-"]);
    let front = trade["front"].as_array().unwrap();
    assert!(front.len() > 1 && front[0]["name"] == "all" && number(&front[0], "/error/jnd") == 0.0, "{trade}");
    for pair in front.windows(2) {
        assert!(number(&pair[0], "/operations") > number(&pair[1], "/operations"), "{trade}");
        assert!(number(&pair[0], "/error/jnd") < number(&pair[1], "/error/jnd"), "{trade}");
    }
    let chosen = front.iter().find(|setting| setting["name"] == trade["chosen"]).unwrap();
    assert!(number(chosen, "/error/jnd") <= 1.0 && number(chosen, "/operations") < 0.9, "{chosen}");
    // The scene of that setting.
    let said = succeeds(&["bake", "less", &room, "--within", "1", "-o", &less]).1;
    assert!(said.contains(chosen["name"].as_str().unwrap()), "{said}");
    assert!(succeeds(&["inspect", &less]).0.contains("reduced from a scene made by: promenade bake responses"));
    // The player finds it too, and a file that carries its front says it at once.
    promenade_baker::wav::write(std::path::Path::new(&dry), 16_000, &[&[0.1; 4000]], promenade_baker::wav::Format::Float32)
        .unwrap();
    succeeds(&["bake", "less", &room, "-o", &with_front]);
    let wet = ["searched.wav", "carried.wav", "baked.wav"].map(text);
    for (scene, within, wet) in [(&room, "1", &wet[0]), (&with_front, "1", &wet[1]), (&less, "0", &wet[2])] {
        succeeds(&["render", scene, &dry, "-o", wet, "--within", within]);
    }
    let [searched, carried, baked] = wet.map(|file| std::fs::read(file).unwrap());
    assert!(searched == carried && searched == baked, "one setting, three ways to it");
}

#[test]
fn what_makes_a_scene_writes_no_more_than_an_error_asks_for() {
    let place = Place::new();
    let text = |name: &str| place.text(name);
    crate::simulate::head(&place.path("head"));
    std::fs::write(place.path("room.obj"), crate::simulate::ROOM).unwrap();
    let (responses, ears, mesh, cloud) = (place.text("."), text("head"), text("room.obj"), text("cloud.promenade"));
    std::fs::write(&cloud, crate::commands::small_cloud().to_bytes().unwrap()).unwrap();
    let room = ["--emitter", "3,3.2,1.5", "--materials", "*=0.3", "--head", &ears, "--rate", "8000"];
    let of_box = ["--size", "3,2.5,2.2", "--emitter", "1,1.2,1", "--materials", "0.5", "--head", &ears, "--rate", "8000"];
    let whole = text("whole.promenade");
    for made_by in [
        vec!["bake", "responses", &responses],
        [&["simulate", "box"][..], &of_box].concat(),
        [&["simulate", &mesh, "--rays", "2000", "--grid", "2", "--waves", "0", "--order", "2"][..], &room].concat(),
        vec!["bake", "field", &cloud, "--pitch", "0,0", "--roll", "0,0", "--max-mb", "0.3"],
        vec!["bake", "less", &whole],
    ] {
        let less = text("less.promenade");
        if made_by[1] != "less" {
            succeeds(&[&made_by[..], &["-o", &whole]].concat());
        }
        let (_, said) = succeeds(&[&made_by[..], &["-o", &less, "--within", "2"]].concat());
        let [all, least] = [&whole, &less].map(|file| Scene::from_bytes(&std::fs::read(file).unwrap()).unwrap());
        let share = 100.0 * least.operations(48_000.0) / all.operations(48_000.0);
        let words = format!("{share:.0} % of the operations");
        assert!(said.contains("within 2 JND: ") && said.contains(&words) && share < 95.0, "{made_by:?}: {words}, {said}");
        let recipe = &least.provenance().recipe;
        assert!(recipe.ends_with(" --within 2") || all.provenance().recipe.is_empty(), "{made_by:?}: {recipe}");
    }
    let folder = text("folder");
    let room = [&["simulate", &mesh, "--at", "1,1,1", "-o", &folder][..], &room].concat();
    all_fail(&[([&room[..], &["--within", "1"]].concat(), "folder: expected a scene to write for --within, found another")]);
}
