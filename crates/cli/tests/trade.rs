//! What `measure --trade` finds is had by the commands that play or write it, with the figures that it promised.

use super::common::{json, succeeds};
use serde_json::Value;

const ROOM: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../presets/scenes/iosr-room-a.promenade");

fn number(setting: &Value, path: &str) -> f64 {
    setting.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("{path} in {setting}"))
}

#[test]
fn a_setting_within_an_error_is_had_by_the_commands() {
    let folder = tempfile::tempdir().unwrap();
    let text = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (less, with_front, dry) = (text("less.promenade"), text("front.promenade"), text("dry.wav"));
    let trade = json(&["measure", ROOM, "--trade", "--within", "1", "--json", "-"]);
    let front = trade["front"].as_array().unwrap();
    assert!(front.len() > 3 && front[0]["name"] == "all" && number(&front[0], "/error/jnd") == 0.0, "{trade}");
    for pair in front.windows(2) {
        assert!(number(&pair[0], "/operations") > number(&pair[1], "/operations"), "{trade}");
        assert!(number(&pair[0], "/error/jnd") < number(&pair[1], "/error/jnd"), "{trade}");
    }
    let chosen = front.iter().find(|setting| setting["name"] == trade["chosen"]).unwrap();
    assert!(number(chosen, "/error/jnd") <= 1.0 && number(chosen, "/operations") < 0.9, "{chosen}");
    // The scene of that setting.
    let said = succeeds(&["bake", "less", ROOM, "--within", "1", "-o", &less]).1;
    assert!(said.contains(chosen["name"].as_str().unwrap()), "{said}");
    assert!(succeeds(&["inspect", &less]).0.contains("reduced from a scene made by: promenade bake responses"));
    // The player finds it too, and a file that carries its front says it at once.
    promenade_baker::wav::write(std::path::Path::new(&dry), 16_000, &[&[0.1; 4000]], promenade_baker::wav::Format::Float32)
        .unwrap();
    succeeds(&["bake", "less", ROOM, "-o", &with_front]);
    let wet = ["searched.wav", "carried.wav", "baked.wav"].map(text);
    for (scene, within, wet) in [(ROOM, "1", &wet[0]), (&with_front, "1", &wet[1]), (&less, "0", &wet[2])] {
        succeeds(&["render", scene, &dry, "-o", wet, "--within", within]);
    }
    let [searched, carried, baked] = wet.map(|file| std::fs::read(file).unwrap());
    assert!(searched == carried && searched == baked, "one setting, three ways to it");
}
