//! What `measure --trade` recommends is had by the command that it prints, with the figures that it promised.

use super::common::{fails, json, succeeds};
use serde_json::Value;

const ROOM: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../presets/scenes/iosr-room-a.promenade");

/// Runs a printed command with its files in place of the names that it prints for them.
fn carried_out(command: &str, files: &[(&str, &str)]) {
    let args = command.strip_prefix("promenade ").unwrap().split(' ');
    let args: Vec<&str> = args.map(|arg| files.iter().find(|(name, _)| *name == arg).map_or(arg, |(_, file)| file)).collect();
    succeeds(&args);
}

fn number(setting: &Value, path: &str) -> f64 {
    setting.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("{path} in {setting}"))
}

#[test]
fn a_recommendation_is_had_by_its_command_with_its_figures() {
    let folder = tempfile::tempdir().unwrap();
    let text = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (less, dry, wet) = (text("less.promenade"), text("dry.wav"), text("wet.wav"));
    let trade = json(&["measure", ROOM, "--trade", "--format", "json"]);
    let settings = trade["settings"].as_array().unwrap();
    let promised = settings.iter().find(|setting| setting["name"] == trade["recommended"]).unwrap();
    let command = trade["command"].as_str().unwrap();
    // Costs are times, so that how many taps are the cheapest that will do is not the same on a busy machine.
    assert!(command.starts_with("promenade bake less ") && command.contains("--taps "), "{command}");
    carried_out(command, &[("LESS.promenade", &less)]);
    let had = json(&["measure", &less, "--trade", "--beside", ROOM, "--format", "json"]);
    let whole = |setting: &&Value| setting["name"] == "standard";
    let had = had["settings"].as_array().unwrap().iter().find(whole).unwrap();
    for path in [
        "/to_best/jnd",
        "/to_best/t20_percent",
        "/to_best/c50_db",
        "/to_best/walking_lsd_db",
        "/to_measured/jnd",
        "/memory_bytes",
    ] {
        let [was, is] = [promised, had].map(|setting| number(setting, path));
        assert!((was - is).abs() <= 1e-6 * was.abs() + 1e-9, "{path}: promised {was}, had {is}");
    }
    assert!(number(had, "/to_best/jnd") > 0.02, "another scene's best is what errors are to");
    // So is every other setting.
    promenade_baker::wav::write(std::path::Path::new(&dry), 16_000, &[&[0.1; 400]], promenade_baker::wav::Format::Float32)
        .unwrap();
    let files = [("LESS.promenade", &less[..]), ("IN.wav", &dry), ("OUT.wav", &wet)];
    settings.iter().for_each(|setting| carried_out(setting["command"].as_str().unwrap(), &files));
    let said = fails(&["bake", "less", ROOM, "--images", "3", "-o", &less]);
    assert!(said.contains("--images 3") && said.contains("36 taps, 0 images"), "{said}");
    assert!(succeeds(&["inspect", &less]).0.contains("reduced from a scene made by: promenade bake responses"));
}
