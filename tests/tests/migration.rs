//! States of earlier versions: a project that was saved then opens as it was.

use promenade_core::KeyframeEntry;
use promenade_tests::{Host, Setup, in_both_formats};
use serde_json::{Value, json};
use std::path::Path;

in_both_formats!(version_1_is_read_and_written_anew);

/// Version 1 as its plugin wrote it.
fn version_1() -> Vec<u8> {
    std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("states/version-1.json")).unwrap()
}

fn version_1_is_read_and_written_anew<H: Host>() {
    let (old, fresh) = (version_1(), H::open(Setup::default()).state());
    let was: Value = serde_json::from_slice(&old).unwrap();
    let mut host = H::open(Setup::default());
    assert!(host.load(&old));
    host.process(&[&[0.0; 512], &[0.0; 512]]);
    let now = host.state();
    // Tiers are gone.
    assert!(now["params"].get("tier").is_none());
    for (id, value) in was["params"].as_object().unwrap().iter().filter(|(id, _)| *id != "tier") {
        assert_eq!(&now["params"][id], value, "{id}");
    }
    let added = now["params"].as_object().unwrap().iter().filter(|(id, _)| was["params"].get(id).is_none());
    for (id, value) in added {
        // It was saved with the draft, which played the direct sound.
        let expected = if ["early", "late"].contains(&id.as_str()) { &json!({ "f32": -60.0 }) } else { &fresh["params"][id] };
        assert_eq!(value, expected, "{id}");
    }
    let field = |state: &Value, name: &str| -> Value { serde_json::from_str(state["fields"][name].as_str().unwrap()).unwrap() };
    assert_eq!(field(&was, "version"), 1);
    assert_eq!(field(&now, "version"), 3);
    // As keyframes, because JSON tells 1 from 1.0.
    let keyframes = |state| serde_json::from_value::<Vec<KeyframeEntry>>(field(state, "walk")["keyframes"].clone()).unwrap();
    assert_eq!(keyframes(&now), keyframes(&was));
    assert!(was["fields"].get("scene-report").is_some() && now["fields"].get("scene-report").is_none());
    // What is written now is read again.
    assert!(host.load(&now.to_string().into_bytes()));
    assert_eq!(host.state()["params"], now["params"]);
}
