//! Captures on disk: what is read, what is refused, what is left out.

use promenade_baker::wav::{self, Format};
use promenade_baker::{Capture, Split};
use promenade_core::glam::Vec3;
use promenade_testing::Noise;
use std::path::Path;

const RATE: u32 = 8_000;

/// Noise, the same on every machine.
fn noise(seed: u64, count: usize, gain: f32) -> Vec<f32> {
    Noise::new(seed).take(count).map(|v| gain * v).collect()
}

/// A folder with a track of ten seconds, walked along x at 1 m/s.
struct Place {
    folder: tempfile::TempDir,
    dry: Vec<f32>,
    ears: [Vec<f32>; 2],
}

impl Place {
    fn new() -> Self {
        let count = 10 * RATE as usize;
        let dry = noise(1, count, 0.3);
        let ears = [0.5, 0.25].map(|g| dry.iter().map(|v| g * v).collect());
        let place = Self { folder: tempfile::tempdir().unwrap(), dry, ears };
        place.sounds();
        std::fs::write(place.at("walk.csv"), "t,x,y,z,yaw,pitch,roll\n0,0,0,0,0,0,0\n10,10,0,0,90,0,0\n").unwrap();
        place
    }

    fn at(&self, name: &str) -> std::path::PathBuf {
        self.folder.path().join(name)
    }

    fn sounds(&self) {
        wav::write(&self.at("dry.wav"), RATE, &[&self.dry], Format::Float32).unwrap();
        wav::write(&self.at("ears.wav"), RATE, &[&self.ears[0], &self.ears[1]], Format::Float32).unwrap();
    }

    fn manifest(&self, track: &str, more: &str) {
        let json = format!(
            r#"{{"version":1,"title":"a place","sample_rate_hz":{RATE},"emitter":[5,2,0],
            "tracks":[{{"name":"walk","dry":"dry.wav","binaural":"ears.wav"{track}}}]{more}}}"#
        );
        std::fs::write(self.at("capture.json"), json).unwrap();
    }

    fn load(&self) -> Result<Capture, String> {
        Capture::load(self.folder.path())
            .map_err(|e| format!("{e}: {}", std::error::Error::source(&e).map(ToString::to_string).unwrap_or_default()))
    }
}

const PATH: &str = r#","path":"walk.csv""#;

#[test]
fn a_shifted_clip_has_the_sound_and_the_pose_of_its_own_time() {
    let place = Place::new();
    place.manifest(PATH, "");
    let capture = place.load().unwrap();
    // Clips for testing are the fifth and the tenth.
    let shifted = |number: usize, samples: isize| capture.shifted(&capture.clips[number], samples);
    let later = shifted(2, 4_000);
    assert_eq!((later.start, later.len, later.split), (20_000, 8_000, Split::Train));
    assert!((later.pose.position.x - 3.0).abs() < 1e-5, "its own middle: {}", later.pose.position);
    assert_eq!(capture.binaural(&later), [&place.ears[0][20_000..28_000], &place.ears[1][20_000..28_000]]);
    assert_ne!(later.name, capture.clips[2].name);
    assert_eq!(shifted(3, 4_000), capture.clips[3], "into no clip for testing");
    assert_eq!(shifted(3, -9_000).start, 15_000);
    assert_eq!(shifted(5, -9_000), capture.clips[5]);
    assert_eq!(shifted(0, -9_000), capture.clips[0], "within its track");
}

#[test]
fn a_walk_is_cut_into_clips() {
    let place = Place::new();
    place.manifest(PATH, "");
    let capture = place.load().unwrap();
    assert_eq!((capture.clips.len(), capture.split(Split::Test).count()), (10, 2));
    assert_eq!((capture.emitter(), capture.notes.len()), (Some(Vec3::new(5.0, 2.0, 0.0)), 0));
    let clip = &capture.clips[4];
    assert_eq!((clip.name.as_str(), clip.split, clip.start, clip.len), ("walk-00005", Split::Test, 32_000, 8_000));
    assert!((clip.pose.position.x - 4.5).abs() < 1e-5, "the middle: {}", clip.pose.position);
    let dry = capture.dry(clip, 100);
    assert_eq!(dry, place.dry[31_900..40_000]);
    let first = capture.dry(&capture.clips[0], 100);
    assert!(first[..100] == [0.0; 100] && first[100..] == place.dry[..8_000]);
    assert_eq!(capture.binaural(clip), [&place.ears[0][32_000..40_000], &place.ears[1][32_000..40_000]]);
}

#[test]
fn what_is_written_is_read() {
    let place = Place::new();
    place.manifest(PATH, r#","cut":{"clip_s":0.5,"test_share":0.25,"seed":3},"notes":["said before"]"#);
    let mut capture = place.load().unwrap();
    assert_eq!((capture.clips.len(), capture.split(Split::Test).count()), (20, 5));
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path().join("new/folder");
    capture.write(&at).unwrap();
    let mut again = Capture::load(&at.join("capture.json")).unwrap();
    // Keyframes are stored as quaternions, whose rounding is not the capture's.
    for c in [&mut capture, &mut again] {
        for clip in &mut c.clips {
            clip.pose.orientation = promenade_core::glam::Quat::IDENTITY;
        }
    }
    let near = |a: &Capture, b: &Capture| {
        a.tracks[0].path.keyframes().iter().zip(b.tracks[0].path.keyframes()).all(|(a, b)| {
            a.t_s == b.t_s && a.pose.position == b.pose.position && (a.pose.orientation - b.pose.orientation).length() < 1e-6
        })
    };
    assert!(near(&capture, &again));
    again.tracks[0].path = capture.tracks[0].path.clone();
    assert_eq!(capture, again);
}

#[test]
fn offsets_put_sounds_and_poses_in_their_time() {
    let place = Place::new();
    // The dry file began half a second after the recording: its sounds are later than their file says.
    let late: Vec<f32> = place.dry[4_000..].to_vec();
    wav::write(&place.at("dry.wav"), RATE, &[&late], Format::Float32).unwrap();
    place.manifest(&format!(r#"{PATH},"dry_offset_s":0.5,"pose_offset_s":-2"#), "");
    let capture = place.load().unwrap();
    assert_eq!(capture.tracks[0].voices[0].dry[4_000..], place.dry[4_000..]);
    assert!((capture.clips[0].pose.position.x - 3.5).abs() < 1e-5, "{}", capture.clips[0].pose.position);
    let notes = capture.notes.join("\n");
    assert_eq!((capture.clips[0].name.as_str(), capture.clips.len()), ("walk-00002", 8), "{notes}");
    assert!(notes.contains("1 clips left out, no pose at its time: walk-00010"), "{notes}");
    // And the other way round.
    let early: Vec<f32> = [vec![0.1; 4_000], place.dry.clone()].concat();
    wav::write(&place.at("dry.wav"), RATE, &[&early], Format::Float32).unwrap();
    place.manifest(&format!(r#"{PATH},"dry_offset_s":-0.5"#), "");
    assert_eq!(place.load().unwrap().tracks[0].voices[0].dry, place.dry);
}

#[test]
fn useless_clips_are_left_out_by_name() {
    let mut place = Place::new();
    place.dry[8_000..16_000].fill(0.0);
    place.ears[0][16_000..24_000].fill(0.0);
    place.ears[1][24_000..32_000].fill(1e-6);
    place.ears[1][33_000..33_004].fill(1.0);
    place.dry[41_000..41_010].fill(-1.0);
    place.sounds();
    place.manifest(PATH, "");
    let capture = place.load().unwrap();
    let notes = capture.notes.join("\n");
    for (why, name) in [
        ("the dry sound is silent", "walk-00002"),
        ("the left ear is silent", "walk-00003"),
        ("the right ear is silent", "walk-00004"),
        ("the recording is clipped", "walk-00005"),
        ("the dry sound is clipped", "walk-00006"),
    ] {
        assert!(notes.contains(&format!("1 clips left out, {why}: {name}")), "{notes}");
        assert!(capture.clips.iter().all(|c| c.name != name));
    }
    assert_eq!(capture.clips.len(), 5);
    place.ears.iter_mut().for_each(|ear| ear.fill(0.0));
    place.sounds();
    let error = place.load().unwrap_err();
    assert!(error.contains("at least one clip with sound") && error.contains("left ear is silent"), "{error}");
}

#[test]
fn all_that_is_wrong_is_said_at_once() {
    let place = Place::new();
    let track = |name: &str, dry: &str, ears: &str, path: &str| {
        format!(r#"{{"name":"{name}","dry":"{dry}","binaural":"{ears}","path":"{path}"}}"#)
    };
    let mono = |name: &str, rate, x: &[f32]| wav::write(&place.at(name), rate, &[x], Format::Float32).map(drop).unwrap();
    mono("other-rate.wav", 16_000, &place.dry);
    mono("short.wav", RATE, &place.dry[..70_000]);
    let mut bytes = std::fs::read(place.at("dry.wav")).unwrap();
    let at = bytes.len() - 4000;
    bytes[at..at + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    std::fs::write(place.at("nan.wav"), bytes).unwrap();
    std::fs::write(place.at("bad.csv"), "t,x,y,z,yaw,pitch,roll\n1,0,0,0,0,0,0\n0,0,0,0,0,0,0\n").unwrap();
    let tracks = [
        track("a", "missing.wav", "ears.wav", "walk.csv"),
        track("b", "other-rate.wav", "dry.wav", "missing.csv"),
        track("c", "short.wav", "ears.wav", "walk.csv"),
        track("d", "nan.wav", "ears.wav", "bad.csv"),
        track("d", "dry.wav", "ears.wav", "walk.csv"),
    ];
    let json = format!(r#"{{"version":1,"title":"t","sample_rate_hz":{RATE},"tracks":[{}]}}"#, tracks.join(","));
    std::fs::write(place.at("capture.json"), json).unwrap();
    let error = place.load().unwrap_err();
    for clue in [
        "capture.json: track a: ",
        "missing.wav: cannot be read",
        "track b: ",
        "other-rate.wav: expected 8000 Hz as the manifest says, found 16000 Hz",
        "dry.wav: expected 2 channels, found 1",
        "missing.csv: cannot be read",
        "track c: expected dry and binaural sound of one length, found 8.750 s and 10.000 s",
        "nan.wav: sample 79000 of channel 0: expected a finite number, found NaN",
        "bad.csv: ",
        "track d: its name is there twice",
    ] {
        assert!(error.contains(clue), "{clue}: {error}");
    }
    assert!(!error.contains('\n'));
}

#[test]
fn manifests_that_say_too_little_or_too_much() {
    let place = Place::new();
    let clip = |name: &str, track: &str, start: usize, len: usize| {
        format!(r#"{{"name":"{name}","track":"{track}","start":{start},"len":{len},"split":"train"}}"#)
    };
    let clips = |list: &[String]| format!(r#","clips":[{}]"#, list.join(","));
    for (track, more, clue) in [
        ("", String::new(), "track walk: expected \"path\" or \"poses\", found neither"),
        (r#","path":"walk.csv","poses":[]"#, String::new(), "expected \"path\" or \"poses\", found both"),
        (r#","poses":[]"#, String::new(), "at least one keyframe"),
        (r#","path":"walk.csv","gain":2"#, String::new(), "unknown field `gain`"),
        (PATH, r#","cut":{"clip_s":1},"clips":[]"#.to_owned(), "expected \"clips\" or \"cut\", found both"),
        (PATH, r#","cut":{"clip_s":0}"#.to_owned(), "cut: expected clips of 0.01 to 3600 s, found 0"),
        (PATH, r#","cut":{"clip_s":1,"every":5,"test_share":0.2}"#.to_owned(), "found both"),
        (PATH, r#","cut":{"clip_s":1,"test_share":1.5}"#.to_owned(), "expected a share from 0 to 1, found 1.5"),
        (PATH, r#","cut":{"clip_s":11}"#.to_owned(), "at least one clip with sound and a pose, found tracks shorter"),
        (
            PATH,
            clips(&[clip("x", "walk", 79_999, 2)]),
            "clip x: expected samples of the 80000 in track walk, found 2 from 79999",
        ),
        (PATH, clips(&[clip("x", "stroll", 0, 2)]), "clip x: expected the name of a track, found \"stroll\""),
        (
            PATH,
            clips(&[clip("x", "walk", 0, 200), clip("x", "walk", 0, 0)]),
            "clip x: its name is there twice; clip x: expected",
        ),
        (PATH, clips(&[]), "at least one clip"),
    ] {
        place.manifest(track, &more);
        let error = place.load().unwrap_err();
        assert!(error.contains(clue), "{clue}: {error}");
    }
    std::fs::write(place.at("capture.json"), r#"{"version":2,"anything":1}"#).unwrap();
    assert!(place.load().unwrap_err().contains("expected a capture of version 1, found version 2"));
    assert!(Capture::load(Path::new("/no/such/folder")).unwrap_err().to_string().contains("/no/such/folder: cannot be read"));
    place.manifest(PATH, &clips(&[clip("x", "walk", 10, 200)]));
    assert_eq!(place.load().unwrap().clips.len(), 1);
}

/// Two emitters: each in a track of its own, and both in a third as two channels of its dry sound.
fn with_emitters(place: &Place, tracks: &str) {
    let json = format!(
        r#"{{"version":1,"title":"a place","sample_rate_hz":{RATE},
        "emitters":[{{"name":"sofa","position":[5,2,0],"facing":[90,0]}},{{"name":"desk","position":[1,1,1]}}],
        "tracks":[{tracks}]}}"#
    );
    std::fs::write(place.at("capture.json"), json).unwrap();
    let second = noise(2, place.dry.len(), 0.1);
    wav::write(&place.at("both.wav"), RATE, &[&place.dry, &second], Format::Float32).unwrap();
}

fn track(name: &str, dry: &str, emitters: &str) -> String {
    format!(r#"{{"name":"{name}","emitters":[{emitters}],"dry":"{dry}","binaural":"ears.wav","path":"walk.csv"}}"#)
}

#[test]
fn clips_belong_to_emitters_or_to_a_mix() {
    let place = Place::new();
    let tracks = [track("a", "dry.wav", r#""sofa""#), track("b", "dry.wav", r#""desk""#)];
    with_emitters(&place, &[&tracks[..], &[track("c", "both.wav", r#""desk","sofa""#)]].concat().join(","));
    let mut capture = place.load().unwrap();
    assert_eq!((capture.emitter(), capture.emitters.len(), capture.clips.len()), (None, 2, 30));
    assert_eq!((capture.emitters[0].facing_deg, capture.emitters[1].facing_deg), (Some([90.0, 0.0]), None));
    let of = |capture: &Capture, i: usize| capture.emitter_of(&capture.clips[i]);
    assert_eq!((of(&capture, 0), of(&capture, 10), of(&capture, 20)), (Some(0), Some(1), None));
    let mix = capture.clips[20].clone();
    let voices = capture.voices(&mix, 50);
    assert_eq!(voices.iter().map(|v| v.emitter).collect::<Vec<_>>(), [Some(1), Some(0)]);
    let sum: Vec<f32> = voices[0].dry.iter().zip(&voices[1].dry).map(|(a, b)| a + b).collect();
    assert_eq!(capture.dry(&mix, 50), sum);
    // What is written is read, names and mixes too.
    let folder = tempfile::tempdir().unwrap();
    capture.write(folder.path()).unwrap();
    let again = Capture::load(folder.path()).unwrap();
    assert_eq!(again.emitters, capture.emitters);
    assert!(again.tracks.iter().zip(&capture.tracks).all(|(a, b)| a.voices == b.voices));
    // Of an emitter that is held out nothing is learnt, of a mix with it neither.
    capture.hold_out(&["desk".to_owned()], &[]).unwrap();
    assert!(capture.split(Split::Train).all(|clip| of_name(&capture, clip) == Some("sofa")));
    capture.judge_by("desk").unwrap();
    assert!(capture.split(Split::Test).all(|clip| of_name(&capture, clip) == Some("desk")));
    assert_eq!(capture.split(Split::Test).count(), 10);
    let unknown = capture.hold_out(&["lamp".to_owned()], &[]).unwrap_err().to_string();
    assert!(unknown.contains(r#"one of ["sofa", "desk"], found "lamp""#), "{unknown}");
    let unknown = capture.hold_out(&[], &["d".to_owned()]).unwrap_err().to_string();
    assert!(unknown.contains(r#"one of ["a", "b", "c"], found "d""#), "{unknown}");
}

fn of_name<'c>(capture: &'c Capture, clip: &promenade_baker::Clip) -> Option<&'c str> {
    capture.emitter_of(clip).map(|number| capture.emitters[number].name.as_str())
}

#[test]
fn captures_of_one_place_become_one() {
    let place = Place::new();
    with_emitters(&place, &track("a", "dry.wav", r#""desk""#));
    let first = place.load().unwrap();
    place.manifest(PATH, "");
    let second = place.load().unwrap();
    let whole = Capture::join(vec![first.clone(), second.clone(), first.clone()]).unwrap();
    let names: Vec<&str> = whole.emitters.iter().map(|e| e.name.as_str()).collect();
    assert_eq!(names, ["sofa", "desk", "a place"], "an emitter without a name has its capture's");
    let numbers: Vec<_> = whole.tracks.iter().map(|t| (t.name.as_str(), t.voices[0].emitter)).collect();
    assert_eq!(numbers, [("a", Some(1)), ("walk", Some(2)), ("a place a", Some(1))]);
    assert_eq!(whole.clips.iter().map(|c| c.track).collect::<Vec<_>>(), [[0; 10], [1; 10], [2; 10]].concat());
    let other = Capture { sample_rate_hz: 44_100.0, ..second.clone() };
    assert!(Capture::join(vec![first.clone(), other]).unwrap_err().to_string().contains("44100 Hz in a place"));
    let mut moved = first.clone();
    moved.emitters[1].position.x += 1.0;
    let refused = Capture::join(vec![first, moved]).unwrap_err().to_string();
    assert!(refused.contains(r#""desk" at several places"#), "{refused}");
}

#[test]
fn emitters_that_cannot_be_are_refused() {
    let place = Place::new();
    let wrong = |tracks: &str| {
        with_emitters(&place, tracks);
        place.load().unwrap_err()
    };
    let error = wrong(&track("a", "dry.wav", ""));
    assert!(error.contains("the names of the emitters that play, of sofa, desk, found none"), "{error}");
    let error = wrong(&track("a", "dry.wav", r#""lamp""#));
    assert!(error.contains(r#"expected an emitter of sofa, desk, found "lamp""#), "{error}");
    let error = wrong(&track("a", "dry.wav", r#""sofa","desk""#));
    assert!(error.contains("expected 2 channels, found 1"), "{error}");
    place.manifest(PATH, r#","emitters":[{"name":"a","position":[0,0,0]},{"name":"a","position":[0,0,1]}]"#);
    let error = place.load().unwrap_err();
    assert!(
        error.contains(r#"expected "emitter" or "emitters", found both"#) && error.contains(r#"found "a" again"#),
        "{error}"
    );
}
