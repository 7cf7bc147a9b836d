//! Responses from manifests and SOFA files, made here and measured by others.

use promenade_baker::wav::{self, Format};
use promenade_baker::{BakeOptions, HoldOut, LoadOptions, Response, Responses, Side, bake_responses};
use promenade_core::Pose;
use promenade_core::glam::Vec3;
use promenade_core::random::Random;
use promenade_metrics::{ild_db, itd_s};
use promenade_player::render_response;
use std::path::Path;
use std::sync::Arc;

fn load(path: &Path) -> Result<Responses, String> {
    load_with(path, &LoadOptions::default())
}

fn load_with(path: &Path, options: &LoadOptions) -> Result<Responses, String> {
    Responses::load(path, options)
        .map_err(|e| format!("{e}: {}", std::error::Error::source(&e).map(ToString::to_string).unwrap_or_default()))
}

/// Two small responses, the left ear louder, in files named by yaw.
fn small_set(folder: &Path) {
    for yaw in [-40, 0, 40] {
        let left = [0.0, 1.0, 0.25, yaw as f32 / 100.0];
        let name = folder.join(format!("turn_{yaw}.wav"));
        wav::write(&name, 48_000, &[&left, &left.map(|v| 0.5 * v)], Format::Float32).unwrap();
    }
}

#[test]
fn a_pattern_of_head_turns() {
    let folder = tempfile::tempdir().unwrap();
    small_set(folder.path());
    std::fs::write(
        folder.path().join("responses.json"),
        r#"{"title":"t","credit":"c","licence":"l","pattern":"turn_{yaw}.wav","source":[2,0,0]}"#,
    )
    .unwrap();
    let set = load(folder.path()).unwrap();
    assert_eq!((set.title.as_str(), set.credit.as_str(), set.licence.as_str(), set.sample_rate_hz), ("t", "c", "l", 48_000.0));
    let azimuths: Vec<f32> = set.responses.iter().map(|r| r.direction_deg().0.round()).collect();
    assert_eq!(azimuths, [40.0, 0.0, -40.0], "turning to the right puts the source on the left");
    assert_eq!(set.responses[0].name, "turn_-40");
    assert_eq!(set.responses[0].left, [0.0, 1.0, 0.25, -0.4]);
    let (kept, out) = HoldOut::parse("yaw=0").unwrap().split(&set).unwrap();
    assert_eq!((kept, out), (vec![0, 2], vec![1]));
}

#[test]
fn lengths_are_padded_and_rates_must_agree() {
    let folder = tempfile::tempdir().unwrap();
    wav::write(&folder.path().join("a.wav"), 48_000, &[&[1.0], &[0.5]], Format::Float32).unwrap();
    wav::write(&folder.path().join("b.wav"), 48_000, &[&[1.0, 0.5, 0.25], &[0.5, 0.5, 0.5]], Format::Float32).unwrap();
    let manifest = folder.path().join("set.json");
    let entries = r#"{"file":"a.wav","azimuth_deg":0},{"file":"b.wav","azimuth_deg":90,"elevation_deg":30}"#;
    std::fs::write(&manifest, format!(r#"{{"title":"t","distance_m":2,"responses":[{entries}]}}"#)).unwrap();
    let set = load(&manifest).unwrap();
    assert_eq!(set.responses[0].left, [1.0, 0.0, 0.0]);
    let (azimuth, elevation) = set.responses[1].direction_deg();
    assert!(
        (azimuth - 90.0).abs() < 1e-3 && (elevation - 30.0).abs() < 1e-3 && (set.responses[1].distance_m() - 2.0).abs() < 1e-6
    );
    wav::write(&folder.path().join("b.wav"), 44_100, &[&[1.0], &[0.5]], Format::Float32).unwrap();
    let error = load(&manifest).unwrap_err();
    assert!(error.contains("b.wav") && error.contains("a.wav") && error.contains("44100"), "{error}");
}

#[test]
fn errors_name_the_file_and_the_remedy() {
    let folder = tempfile::tempdir().unwrap();
    small_set(folder.path());
    wav::write(&folder.path().join("mono.wav"), 48_000, &[&[1.0]], Format::Float32).unwrap();
    wav::write(&folder.path().join("deaf.wav"), 48_000, &[&[1.0], &[0.0]], Format::Float32).unwrap();
    let manifest = folder.path().join("set.json");
    for (text, clue) in [
        (r#"{"#, "line 1"),
        (r#"{"title":"t"}"#, "at least one file"),
        (r#"{"title":"t","azimut":3}"#, "unknown field `azimut`"),
        (r#"{"title":"t","pattern":"turn_{yaw}.wav"}"#, "a \"source\" or an azimuth"),
        (r#"{"title":"t","pattern":"turn_{azimuth}.wav"}"#, "distance_m"),
        (r#"{"title":"t","pattern":"turn_{azimuth}.wav","distance_m":0}"#, "above 0"),
        (r#"{"title":"t","pattern":"turn_{angle}.wav"}"#, "{azimuth}"),
        (r#"{"title":"t","pattern":"other_{yaw}.wav","source":[1,0,0]}"#, "files named other_{yaw}.wav"),
        (r#"{"title":"t","root":"nowhere","pattern":"turn_{yaw}.wav","source":[1,0,0]}"#, "nowhere: cannot be read"),
        (r#"{"title":"t","source":[1,0,0],"responses":[{"file":"none.wav"}]}"#, "none.wav: cannot be read"),
        (r#"{"title":"t","source":[1,0,0],"responses":[{"file":"mono.wav"}]}"#, "channel 1"),
        (
            r#"{"title":"t","source":[1,0,0],"responses":[{"file":"deaf.wav"}]}"#,
            "deaf, right ear: expected a response, found silence",
        ),
        (r#"{"title":"t","source":[1,0,1e39],"responses":[{"file":"turn_0.wav"}]}"#, "set.json"),
    ] {
        std::fs::write(&manifest, text).unwrap();
        let error = load(&manifest).unwrap_err();
        assert!(error.contains(clue), "{text}: {error}");
    }
    assert!(load(&folder.path().join("turn_0.wav")).unwrap_err().contains("the ending \"wav\""));
}

#[test]
fn a_folder_without_a_manifest_is_told_what_to_write() {
    let folder = tempfile::tempdir().unwrap();
    small_set(folder.path());
    let error = load(folder.path()).unwrap_err();
    assert!(error.contains("a responses.json") && error.contains("\"pattern\": ") && error.contains("found none"), "{error}");
}

#[test]
fn ears_among_many_channels_must_be_named() {
    let folder = tempfile::tempdir().unwrap();
    let ramp: Vec<[f32; 3]> = (1..=7).map(|c| [c as f32, 0.5, 0.25]).collect();
    let channels: Vec<&[f32]> = ramp.iter().map(|c| &c[..]).collect();
    wav::write(&folder.path().join("array.wav"), 48_000, &channels, Format::Float32).unwrap();
    let manifest = folder.path().join("set.json");
    let with = |channels: &str| {
        let text = format!(r#"{{"title":"t",{channels}"source":[1,0,0],"responses":[{{"file":"array.wav"}}]}}"#);
        std::fs::write(&manifest, text).unwrap();
        load(&manifest)
    };
    let error = with("").unwrap_err();
    assert!(error.contains("array.wav: expected 2 channels, or \"channels\"") && error.contains("found 7 channels"), "{error}");
    let error = with(r#""channels":[6,6],"#).unwrap_err();
    assert!(
        error.contains("set.json") && error.contains("\"channels\": expected two") && error.contains("found [6, 6]"),
        "{error}"
    );
    let error = with(r#""channels":[6,7],"#).unwrap_err();
    assert!(error.contains("array.wav: expected a channel 7") && error.contains("found 7 channels"), "{error}");
    let set = with(r#""channels":[6,5],"#).unwrap();
    assert_eq!((set.responses[0].left[0], set.responses[0].right[0]), (7.0, 6.0));
}

#[test]
fn distances_in_centimetres_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    wav::write(&folder.path().join("azi_30_dist_150.wav"), 48_000, &[&[1.0], &[0.5]], Format::Float32).unwrap();
    let text = r#"{"title":"t","pattern":"azi_{azimuth}_dist_{distance}.wav"}"#;
    std::fs::write(folder.path().join("responses.json"), text).unwrap();
    let error = load(folder.path()).unwrap_err();
    for part in ["azi_30_dist_150: expected a source within 100 m", "in metres", "found 150 m"] {
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn a_repeated_pose_is_left_out_and_noted() {
    let folder = tempfile::tempdir().unwrap();
    small_set(folder.path());
    let manifest = folder.path().join("set.json");
    std::fs::write(&manifest, r#"{"title":"t","source":[1,0,0],"responses":[{"file":"turn_0.wav"},{"file":"turn_40.wav"}]}"#)
        .unwrap();
    let set = load(&manifest).unwrap();
    assert_eq!(set.responses.len(), 1);
    assert!(set.notes[0].contains("turn_40 has the listener and source of turn_0"), "{:?}", set.notes);
}

/// Responses of a listener in the origin to a source 2 m ahead of the head, or so many degrees to the left.
fn around(sample_rate_hz: f64, azimuths: &[f32], ears: impl Fn(f32) -> [Vec<f32>; 2]) -> Responses {
    let responses = azimuths.iter().map(|azimuth| {
        let [left, right] = ears(*azimuth);
        let source = 2.0 * Vec3::new(azimuth.to_radians().cos(), azimuth.to_radians().sin(), 0.0);
        Response { listener: Pose::IDENTITY, source, left, right, name: format!("at {azimuth}") }
    });
    Responses { sample_rate_hz, responses: responses.collect(), ..Responses::default() }
}

#[test]
fn responses_shorter_than_a_hop_are_baked() {
    // Clicks of 200 samples where a hop has 220, louder and earlier at the ear of the source's side.
    let click = |at: usize, gain: f32| (0..200).map(|i| if i == at { gain } else { 0.0 }).collect();
    let set = around(44_100.0, &[-45.0, 0.0, 45.0], |azimuth| {
        let side = (azimuth / 45.0) as isize;
        [click(60_usize.saturating_add_signed(-8 * side), 1.0 + 0.4 * side as f32), click(60, 1.0)]
    });
    let scene = Arc::new(bake_responses(&set, |_, _| false, &BakeOptions::default()).unwrap());
    // The source of the scene lies ahead: heads turned to the right have it on the left.
    for (yaw_deg, level_db) in [(-45.0_f32, 2.92), (0.0, 0.0), (45.0, -4.44)] {
        let pose = Pose::from_ypr(Vec3::ZERO, yaw_deg.to_radians(), 0.0, 0.0);
        let [left, right] = render_response(&scene, pose, 882, 4096).unwrap();
        let found = ild_db(&left, &right).unwrap();
        assert!((found - level_db).abs() < 0.5, "yaw {yaw_deg}: {found} dB, not {level_db}");
    }
}

#[test]
fn poses_at_uneven_angles_are_heard_as_they_were_measured() {
    // Clicks with the delays of a head, and a room of its own in every direction.
    let azimuths = [-80.0, -47.0, 0.0, 31.5, 110.0];
    let rate = 16_000.0;
    let ears = |azimuth: f32| {
        [1.0, -1.0].map(|side| -> Vec<f32> {
            let to_ear = side * azimuth.to_radians().sin();
            let mut random = Random::new((azimuth + 200.0) as u64 * 3 + u64::from(side > 0.0));
            let at = 40 - (4.0 * to_ear) as usize;
            let decayed = |i: usize| 0.1 * random.normal() * 10.0_f32.powf(-3.0 * i as f32 / (0.3 * rate));
            let mut ear: Vec<f32> = (0..4_000).map(decayed).collect();
            ear[..100].fill(0.0);
            (ear[at], ear[at + 1]) = (1.0 + 0.5 * to_ear, 0.3);
            ear
        })
    };
    let set = around(f64::from(rate), &azimuths, ears);
    let scene = Arc::new(bake_responses(&set, |_, _| false, &BakeOptions::default()).unwrap());
    let (lead, early) = (640, (0.05 * rate) as usize);
    let mut gain = None;
    for response in &set.responses {
        let (azimuth, _) = response.direction_deg();
        let heard = render_response(&scene, Pose::from_ypr(Vec3::ZERO, -azimuth.to_radians(), 0.0, 0.0), lead, 4_096).unwrap();
        let wanted = [&response.left, &response.right];
        // The arrival at the head's centre, to the sample, is where the rendering begins.
        let at_lag = |lag: usize| {
            let pairs = wanted.iter().zip(&heard).flat_map(|(w, h)| w[30..30 + early].iter().zip(&h[lag..]));
            pairs.fold([0.0_f64; 3], |[a, b, c], (w, h)| [a + f64::from(w * h), b + f64::from(h * h), c + f64::from(w * w)])
        };
        let [cross, own, energy] = (lead - 30..lead + 30).map(at_lag).max_by(|a, b| a[0].total_cmp(&b[0])).unwrap();
        // One gain is that of all poses.
        let gain = *gain.get_or_insert(cross / own);
        let error_db = 10.0 * ((energy - 2.0 * gain * cross + gain * gain * own) / energy).max(1e-12).log10();
        assert!(error_db < -35.0, "{azimuth} degrees: {error_db} dB");
    }
}

#[test]
fn long_reverberation_is_baked_as_it_is() {
    let (rate, t60_s) = (8_000.0, 25.0);
    let decay = |seed: u64, length: usize| -> Vec<f32> {
        let mut random = Random::new(seed);
        let decayed = |i: usize| 10.0_f32.powf(-3.0 * i as f32 / (rate * t60_s) as f32);
        (0..length).map(|i| if i == 0 { 1.0 } else { 0.05 * random.normal() * decayed(i) }).collect()
    };
    let bake = |seconds: usize| {
        let set = around(rate, &[0.0, 45.0], |azimuth| [1, 2].map(|ear| decay(ear + azimuth as u64, 8_000 * seconds)));
        bake_responses(&set, |_, _| false, &BakeOptions::default())
    };
    let scene = bake(12).unwrap();
    let times = &scene.parts().tail.t60_s;
    assert!(times.iter().all(|t| (t - 25.0).abs() < 5.0), "{times:?}");
    let error = bake(1).unwrap_err().to_string();
    assert!(error.contains("decay of the responses: expected a fall of 10 dB") && error.contains(" in 1.0"), "{error}");
}

#[test]
fn what_is_larger_than_a_scene_is_refused_before_the_work() {
    let responses = (0..13_000_u16).map(|i| {
        let t = f32::from(i) * 0.05;
        let ear = vec![1.0; if i == 0 { 12_000 } else { 1 }];
        let listener = Pose::from_ypr(Vec3::new(t, 3.0 * t.sin(), 0.0), 7.3 * t, 0.1 * t.sin(), 0.0);
        Response { listener, source: Vec3::new(10.0, 8.0, 1.0), left: ear.clone(), right: ear, name: i.to_string() }
    });
    let set = Responses { sample_rate_hz: 48_000.0, responses: responses.collect(), ..Responses::default() };
    let error = bake_responses(&set, |_, _| false, &BakeOptions::default()).unwrap_err().to_string();
    for part in ["size of the scene: expected at most 1073741824 bytes", "for 13000 responses and ", "directions"] {
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn a_walk_is_as_large_as_its_measurements_and_exact_at_each_of_them() {
    let rate = 16_000.0;
    let (mut random, source) = (Random::new(8), Vec3::new(1.0, 2.0, 1.5));
    let mut response = |i: usize| {
        let position = Vec3::new(2.0 + 3.0 * random.uniform(), 4.0 * random.uniform(), 1.5 + 0.2 * random.uniform());
        let listener = Pose::from_ypr(position, 6.0 * random.uniform(), 0.3 * random.normal(), 0.0);
        let side = listener.to_head(source).normalize().y;
        let [left, right] = [1.0, -1.0].map(|ear| -> Vec<f32> {
            let at = 40 - (4.0 * ear * side) as usize;
            let decayed = |i: usize| 0.1 * random.normal() * 10.0_f32.powf(-3.0 * i as f32 / (0.3 * rate));
            let mut samples: Vec<f32> = (0..4_000).map(decayed).collect();
            samples[..100].fill(0.0);
            samples[at] = 1.0 + 0.5 * ear * side;
            samples
        });
        Response { listener, source, left, right, name: i.to_string() }
    };
    let responses: Vec<Response> = (0..60).map(&mut response).collect();
    let set = Responses { sample_rate_hz: f64::from(rate), responses, ..Responses::default() };
    let scene = Arc::new(bake_responses(&set, |_, _| false, &BakeOptions::default()).unwrap());
    let bytes = scene.to_bytes().unwrap().len();
    // Half floats of what is heard of the measurements, and the table of the direct sound.
    let samples = 60 * 2 * (scene.shape().taps + 1) * scene.grid().hop;
    assert!(bytes < 2 * samples + 2_300_000, "{bytes} bytes of {samples} samples");
    let scene = Arc::new(promenade_core::Scene::from_bytes(&scene.to_bytes().unwrap()).unwrap());
    let lead = 640;
    let mut gain = None;
    for response in set.responses.iter().step_by(7) {
        let heard = render_response(&scene, response.listener, lead, 4_096).unwrap();
        let wanted = [&response.left, &response.right];
        let at_lag = |lag: usize| {
            let pairs = wanted.iter().zip(&heard).flat_map(|(w, h)| w[30..830].iter().zip(&h[lag..]));
            pairs.fold([0.0_f64; 3], |[a, b, c], (w, h)| [a + f64::from(w * h), b + f64::from(h * h), c + f64::from(w * w)])
        };
        let [cross, own, energy] = (lead - 30..lead + 30).map(at_lag).max_by(|a, b| a[0].total_cmp(&b[0])).unwrap();
        let gain = *gain.get_or_insert(cross / own);
        let error_db = 10.0 * ((energy - 2.0 * gain * cross + gain * gain * own) / energy).max(1e-12).log10();
        assert!(error_db < -35.0, "{}: {error_db} dB", response.name);
    }
}

/// The ears must agree with the direction: a source on the left is louder there and earlier.
fn agrees_with_its_ears(set: &Responses, at_least_deg: f32) {
    let mut judged = 0;
    for r in &set.responses {
        let (azimuth, elevation) = r.direction_deg();
        // Straight ahead, behind and above the ears hardly differ.
        if elevation.abs() > 30.0 || azimuth.abs() < at_least_deg || azimuth.abs() > 180.0 - at_least_deg {
            continue;
        }
        let (itd, ild) = (itd_s(&r.left, &r.right, set.sample_rate_hz).unwrap(), ild_db(&r.left, &r.right).unwrap());
        assert!(ild.signum() == f64::from(azimuth.signum()), "{} at {azimuth}: ILD {ild} dB", r.name);
        assert!(itd.signum() == -f64::from(azimuth.signum()), "{} at {azimuth}: ITD {itd} s", r.name);
        judged += 1;
    }
    assert!(judged > 0, "nothing to judge");
}

/// A SOFA file of two emitters and two head turns, the delays stored apart, views spherical and up Cartesian as writers leave
/// it.
fn small_sofa(path: &Path, right_ear_first: bool) {
    use hdf5_pure::{AttrValue, FileBuilder};
    let text = |t: &str| AttrValue::AsciiString(t.to_owned());
    let mut file = FileBuilder::new();
    for (name, value) in [("SOFAConventions", "MultiSpeakerBRIR"), ("DataType", "FIRE"), ("Title", "small")] {
        file.set_attr(name, text(value));
    }
    let y = if right_ear_first { -0.09 } else { 0.09 };
    file.create_dataset("ReceiverPosition")
        .with_f64_data(&[0.0, y, 0.0, 0.0, -y, 0.0])
        .with_shape(&[2, 3, 1])
        .set_attr("Type", text("cartesian"));
    file.create_dataset("ListenerPosition")
        .with_f64_data(&[1.0, 0.0, 0.0])
        .with_shape(&[1, 3])
        .set_attr("Type", text("cartesian"));
    file.create_dataset("ListenerView")
        .with_f64_data(&[0.0, 0.0, 1.0, 90.0, 0.0, 1.0])
        .with_shape(&[2, 3])
        .set_attr("Type", text("spherical"));
    file.create_dataset("ListenerUp").with_f64_data(&[0.0, 0.0, 1.0]).with_shape(&[1, 3]);
    file.create_dataset("SourcePosition").with_f64_data(&[0.0; 3]).with_shape(&[1, 3]).set_attr("Type", text("cartesian"));
    // Emitter 0 is 2 m ahead, emitter 1 is 2 m to the left.
    file.create_dataset("EmitterPosition")
        .with_f64_data(&[0.0, 0.0, 2.0, 90.0, 0.0, 2.0])
        .with_shape(&[2, 3, 1])
        .set_attr("Type", text("spherical"));
    file.create_dataset("Data.SamplingRate").with_f64_data(&[48_000.0]).with_shape(&[1]);
    file.create_dataset("Data.Delay").with_f64_data(&[2.0, 3.0, 2.0, 3.0]).with_shape(&[1, 2, 2]);
    // [measurement][receiver][emitter][sample]: the first sample counts up.
    let ir: Vec<f64> = (0..8).flat_map(|i| [f64::from(i + 1), 0.5]).collect();
    file.create_dataset("Data.IR").with_f64_data(&ir).with_shape(&[2, 2, 2, 2]);
    file.write(path).unwrap();
}

#[test]
fn emitters_views_and_delays_of_a_sofa_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("small.sofa");
    for right_ear_first in [false, true] {
        small_sofa(&path, right_ear_first);
        assert!(load(&path).unwrap_err().contains("2 emitters"), "one must be chosen");
        let set = load_with(&path, &LoadOptions { source: Some(1), ..LoadOptions::default() }).unwrap();
        let [ahead, turned] = &set.responses[..] else { panic!("two measurements") };
        assert!((ahead.source.y - 2.0).abs() < 1e-6 && ahead.source.x.abs() < 1e-6);
        assert_eq!((ahead.listener.position.x, turned.listener.position.x), (1.0, 1.0));
        assert!((turned.listener.ypr().0.to_degrees() - 90.0).abs() < 1e-3, "the second view is to the left");
        let first = [&ahead.left, &ahead.right].map(|ear| ear.clone());
        let mut expected = [vec![0.0, 0.0, 0.0, 2.0, 0.5], vec![0.0, 0.0, 0.0, 4.0, 0.5]];
        if right_ear_first {
            expected.reverse();
        }
        assert_eq!(first, expected, "emitter 1 with its delay of 3 samples");
    }
}

#[test]
fn damaged_sofa_files_are_errors_not_panics() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("small.sofa");
    small_sofa(&path, false);
    let whole = std::fs::read(&path).unwrap();
    let options = LoadOptions { source: Some(0), ..LoadOptions::default() };
    assert!(load_with(&path, &options).is_ok());
    for length in (0..whole.len()).step_by(97) {
        std::fs::write(&path, &whole[..length]).unwrap();
        assert!(load_with(&path, &options).is_err(), "{length} of {} bytes", whole.len());
    }
    for at in (0..whole.len()).step_by(13) {
        let mut damaged = whole.clone();
        damaged[at] ^= 0xff;
        std::fs::write(&path, &damaged).unwrap();
        // Either is fine; neither may panic.
        let _ = load_with(&path, &options);
    }
}

mod needs_shared {
    use super::*;
    use promenade_testing::shared;

    #[test]
    #[ignore = "needs ../shared"]
    fn iosr_rooms_by_file_name() {
        for (recipe, frames) in [("iosr-room-a.json", 6259), ("iosr-room-b.json", 16001)] {
            let recipe = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../presets/recipes").join(recipe);
            let set =
                load_with(&recipe, &LoadOptions { root: Some(shared("data/iosr_brir")), ..LoadOptions::default() }).unwrap();
            assert_eq!((set.responses.len(), set.responses[0].left.len(), set.sample_rate_hz), (37, frames, 16_000.0));
            agrees_with_its_ears(&set, 10.0);
            assert_eq!(HoldOut::parse("azimuth=odd5").unwrap().split(&set).unwrap().1.len(), 18);
        }
    }

    #[test]
    #[ignore = "needs ../shared"]
    fn iosr_room_by_sofa_with_clockwise_azimuths() {
        let file = shared("data/iosr_brir/original_sofa/UniS_Room_A_BRIR_16k.sofa");
        assert!(load(&file).unwrap_err().contains("ears that agree with the directions"), "as labelled it is mirrored");
        let set = load_with(&file, &LoadOptions { azimuth_positive: Some(Side::Right), ..LoadOptions::default() }).unwrap();
        assert_eq!((set.responses.len(), set.sample_rate_hz, set.licence.as_str()), (37, 16_000.0, "MIT license"));
        agrees_with_its_ears(&set, 10.0);
        // The same measurements as the WAV files.
        let recipe = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../presets/recipes/iosr-room-a.json");
        let wavs = load_with(&recipe, &LoadOptions { root: Some(shared("data/iosr_brir")), ..LoadOptions::default() }).unwrap();
        for r in &set.responses {
            let twin = wavs.responses.iter().find(|w| (w.direction_deg().0 - r.direction_deg().0).abs() < 0.01).unwrap();
            let error = twin.left.iter().zip(&r.left).fold(0.0_f32, |m, (a, b)| m.max((a - b).abs()));
            assert!(error < 1e-4, "{}: {error}", r.name);
        }
    }

    #[test]
    #[ignore = "needs ../shared"]
    fn hrtfs_whose_labels_are_right_or_wrong() {
        for (file, count, notes) in [("KEMAR_HRTFs_lfcorr.sofa", 360, 1), ("MIT_KEMAR_normal_pinna.sofa", 710, 0)] {
            let set = load(&shared("data/hrtf_kemar").join(file)).unwrap();
            assert_eq!(
                (set.responses.len(), set.sample_rate_hz, set.notes.len()),
                (count, 44_100.0, notes),
                "{file}: {:?}",
                set.notes
            );
            agrees_with_its_ears(&set, 30.0);
        }
    }

    #[test]
    #[ignore = "needs ../shared"]
    fn loudspeakers_above_and_below() {
        let recipe = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../presets/recipes/bbcrd-listening-room.json");
        let set = load_with(&recipe, &LoadOptions { root: Some(shared("data/bbcrd_brir")), ..LoadOptions::default() }).unwrap();
        assert_eq!((set.responses.len(), set.sample_rate_hz), (32, 48_000.0));
        agrees_with_its_ears(&set, 20.0);
        assert_eq!(HoldOut::parse("elevation=90").unwrap().split(&set).unwrap().1.len(), 1);
    }
}
