//! Manifests that are written from names, units of lengths in names, and splits that a data set brings.

use promenade_baker::capture::{DrySound, FromResponses, from_responses};
use promenade_baker::responses::{Describe, describe};
use promenade_baker::wav::{self, Format};
use promenade_baker::{LoadOptions, Responses, Split};
use promenade_core::glam::Vec3;
use promenade_testing::Noise;
use std::collections::BTreeMap;
use std::path::Path;

/// A click that is louder and earlier at the left ear for positive sides.
fn click(path: &Path, side: f32) {
    let ear = |sign: f32| -> Vec<f32> {
        let at = (20.0 - 8.0 * sign * side).round() as usize;
        (0..64).map(|i| if i == at { 1.0 + 0.4 * sign * side } else { 0.0 }).collect()
    };
    wav::write(path, 48_000, &[&ear(1.0), &ear(-1.0)], Format::Float32).unwrap();
}

fn folder_of(names: &[(&str, f32)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    names.iter().for_each(|(name, side)| click(&folder.path().join(name), *side));
    folder
}

#[test]
fn names_become_a_manifest_and_ears_say_the_side() {
    let names = [("azi_60_dist_150.wav", 1.0), ("azi_0_dist_150.wav", 0.0), ("azi_300_dist_150.wav", -1.0)];
    let left = folder_of(&names);
    let set = describe(left.path(), &Describe { title: Some("Hall".to_owned()), ..Describe::default() }).unwrap();
    assert_eq!((&set.title[..], set.responses.len()), ("Hall", 3));
    assert!(set.notes[0].contains("taken for centimetres"), "{:?}", set.notes);
    for response in &set.responses {
        assert!((response.distance_m() - 1.5).abs() < 1e-5);
    }
    assert_eq!(Responses::load(left.path(), &LoadOptions::default()).unwrap().responses, set.responses);
    let again = describe(left.path(), &Describe::default()).unwrap_err().to_string();
    assert!(again.contains("expected no responses.json, which is written here, found one"), "{again}");
    let mirrored: Vec<(&str, f32)> = names.iter().map(|(name, side)| (*name, -side)).collect();
    let right = folder_of(&mirrored);
    let set = describe(right.path(), &Describe::default()).unwrap();
    assert!(set.notes.iter().any(|n| n.contains("azimuths grow to the right")), "{:?}", set.notes);
    assert!(set.responses.iter().any(|r| r.source.y < -1.0 && r.name == "azi_60_dist_150"));
    let text = std::fs::read_to_string(right.path().join("responses.json")).unwrap();
    assert!(text.contains("\"azimuth_positive\": \"right\"") && text.contains("\"length_unit_m\": 0.01"), "{text}");
}

#[test]
fn numbers_of_loudspeakers_are_no_azimuths() {
    let ring: Vec<(String, f32)> =
        (1..=16).map(|i| (format!("spk-{i:03}.wav"), 2.0 * (22.5 * i as f32).to_radians().sin())).collect();
    let folder = folder_of(&ring.iter().map(|(name, side)| (&name[..], *side)).collect::<Vec<_>>());
    let error = describe(folder.path(), &Describe { distance_m: Some(2.0), ..Describe::default() }).unwrap_err().to_string();
    assert!(error.contains("are numbers in the names those of loudspeakers") && error.contains("us in 'spk-"), "{error}");
    assert!(!folder.path().join("responses.json").exists());
}

#[test]
fn what_names_do_not_say_is_asked_for() {
    let turns = folder_of(&[("turn_-60.wav", 1.0), ("turn_60.wav", -1.0)]);
    let error = |folder: &tempfile::TempDir| describe(folder.path(), &Describe::default()).unwrap_err().to_string();
    assert!(error(&turns).contains("azimuths in the names, or the place of the source"), "{}", error(&turns));
    let source = Some(Vec3::new(2.0, 0.0, 0.0));
    let set = describe(turns.path(), &Describe { source, ..Describe::default() }).unwrap();
    assert!(set.responses.iter().all(|r| r.source == Vec3::new(2.0, 0.0, 0.0)) && set.responses.len() == 2);
    let azimuths = folder_of(&[("az-60.wav", -1.0), ("az60.wav", 1.0)]);
    assert!(
        error(&azimuths).contains("expected distances in the names, or one that is given in metres"),
        "{}",
        error(&azimuths)
    );
    assert!(!azimuths.path().join("responses.json").exists());
    let set = describe(azimuths.path(), &Describe { distance_m: Some(3.0), ..Describe::default() }).unwrap();
    assert!((set.responses[0].distance_m() - 3.0).abs() < 1e-5);
    let mixed = folder_of(&[("az60.wav", 1.0), ("take2.wav", 0.0)]);
    assert!(error(&mixed).contains("found names of several forms, az60.wav and take2.wav"), "{}", error(&mixed));
    assert!(!mixed.path().join("responses.json").exists());
}

#[test]
fn a_set_that_does_not_load_leaves_no_manifest() {
    let folder = folder_of(&[("az-60.wav", -1.0), ("az60.wav", 1.0)]);
    std::fs::write(folder.path().join("az0.wav"), b"RIFF").unwrap();
    let error = describe(folder.path(), &Describe { distance_m: Some(3.0), ..Describe::default() }).unwrap_err().to_string();
    assert!(error.contains("az0.wav"), "{error}");
    assert!(!folder.path().join("responses.json").exists());
}

#[test]
fn a_split_in_the_manifest_reaches_the_clips() {
    let folder = folder_of(&[("a30.wav", 0.5), ("a60.wav", 1.0), ("held_10.wav", 0.0), ("held_20.wav", 0.1)]);
    let patterns = r#"[{"file":"held_{azimuth}.wav","split":"test"},{"file":"a{azimuth}.wav"}]"#;
    std::fs::write(folder.path().join("responses.json"), format!(r#"{{"title":"t","distance_m":1,"patterns":{patterns}}}"#))
        .unwrap();
    let set = Responses::load(folder.path(), &LoadOptions::default()).unwrap();
    let expected: BTreeMap<String, Split> = ["held_10", "held_20"].map(|name| (name.to_owned(), Split::Test)).into();
    assert_eq!(set.splits, expected);
    let dry = DrySound {
        name: "noise".to_owned(),
        sample_rate_hz: 48_000,
        samples: Noise::new(1).take(48_000).map(|v| 0.3 * v).collect(),
    };
    for test_share in [0.0, 1.0] {
        let options = FromResponses { clip_s: 0.25, test_share, ..FromResponses::default() };
        let capture = from_responses(&set, std::slice::from_ref(&dry), &options).unwrap();
        for clip in &capture.clips {
            let own = clip.name.starts_with("held").then_some(Split::Test);
            let chosen = if test_share > 0.5 { Split::Test } else { Split::Train };
            assert_eq!(clip.split, own.unwrap_or(chosen), "{}", clip.name);
        }
        assert!(
            capture.notes.iter().any(|n| n.contains("2 of 4 responses are split as the data set has it")),
            "{:?}",
            capture.notes
        );
    }
}

#[test]
fn names_change_the_listener_of_the_manifest_where_they_say_more() {
    let folder = folder_of(&[("x1_y2.wav", 0.0), ("x2_y2.wav", 0.1)]);
    let text = r#"{"title":"t","pattern":"x{x}_y{y}.wav","source":[4,2,1.5],"listener":{"position":[9,9,1.5],"ypr":[30,0,0]}}"#;
    std::fs::write(folder.path().join("responses.json"), text).unwrap();
    let set = Responses::load(folder.path(), &LoadOptions::default()).unwrap();
    assert_eq!(set.responses[1].listener.position, Vec3::new(2.0, 2.0, 1.5));
    assert!((set.responses[1].listener.ypr().0.to_degrees() - 30.0).abs() < 1e-3);
}
