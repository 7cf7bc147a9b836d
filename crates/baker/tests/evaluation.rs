//! Captures made of responses, and scenes judged on them.

use promenade_baker::capture::{DrySound, FromResponses, from_responses};
use promenade_baker::evaluate::{EvaluateOptions, Evaluation, Figure, Poses, evaluate, evaluate_each, overall};
use promenade_baker::{BakeOptions, Capture, LoadOptions, Response, Responses, Split, bake_responses, sound};
use promenade_core::glam::Vec3;
use promenade_core::{Pose, Scene};
use promenade_player::Playing;
use promenade_testing::Noise;
use std::path::Path;
use std::sync::Arc;

const RATE: f64 = 16_000.0;

/// A room of noise with a source 2 m ahead and a head that turns.
fn room() -> Responses {
    let mut noise = Noise::new(2);
    let response = |yaw: i32| {
        let side = -(yaw as f32).to_radians().sin();
        let mut ear = |sign: f32| -> Vec<f32> {
            let arrival = 40.0 - sign * side * 5.0;
            (0..6400)
                .map(|i| {
                    let t = i as f32 - arrival;
                    let direct = (1.0 + 0.6 * sign * side) * (-0.5 * (t / 0.8).powi(2)).exp();
                    let tail = if t > 20.0 { 0.05 * (-6.9 * t / (0.3 * RATE as f32)).exp() * noise.value() } else { 0.0 };
                    direct + tail
                })
                .collect()
        };
        let (left, right) = (ear(1.0), ear(-1.0));
        let listener = Pose::from_ypr(Vec3::ZERO, (yaw as f32).to_radians(), 0.0, 0.0);
        Response { listener, source: Vec3::new(2.0, 0.0, 0.0), left, right, name: format!("yaw {yaw}") }
    };
    Responses {
        title: "room".to_owned(),
        credit: "nobody".to_owned(),
        licence: "CC0".to_owned(),
        sample_rate_hz: RATE,
        responses: (-90..=90).step_by(15).map(response).collect(),
        ..Responses::default()
    }
}

fn speech() -> DrySound {
    let wav = sound::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/speech.wav")).unwrap();
    DrySound { name: "speech".to_owned(), sample_rate_hz: wav.sample_rate_hz, samples: wav.channels[0].clone() }
}

fn baked(responses: &Responses) -> Arc<Scene> {
    Arc::new(bake_responses(responses, |_, _| false, &BakeOptions::default()).unwrap())
}

fn of(evaluation: &Evaluation, method: &str, figure: Figure) -> f64 {
    let found = evaluation.methods.iter().find(|m| m.name == method).unwrap();
    found.mean.get(figure).unwrap_or_else(|| panic!("{method} has no {figure:?}"))
}

fn show(evaluation: &Evaluation) {
    for m in &evaluation.methods {
        let values: Vec<_> = Figure::ALL.iter().map(|f| format!("{} {:.4?}", f.name(), m.mean.get(*f))).collect();
        println!("{:18} {}", m.name, values.join("  "));
    }
    println!("{:?}", evaluation.notes);
}

#[test]
fn a_capture_of_responses_has_their_past_in_it() {
    let mut set = room();
    // A response that is an echo 300 ms late at half the level.
    for response in &mut set.responses {
        for (ear, gain) in [(&mut response.left, 1.0), (&mut response.right, 0.5)] {
            ear.fill(0.0);
            ear[4800] = gain;
        }
    }
    let options =
        FromResponses { clip_s: 0.5, clips: 2, pre_roll_s: 0.1, test_share: 0.3, seed: 5, ..FromResponses::default() };
    let capture = from_responses(&set, &[speech()], &options).unwrap();
    assert_eq!((capture.tracks.len(), capture.sample_rate_hz), (13, RATE));
    assert!(capture.clips.len() > 20 && capture.emitter() == Some(Vec3::new(2.0, 0.0, 0.0)));
    let whole = speech().samples;
    let mut with_a_past = 0;
    for track in &capture.tracks {
        // Where the track comes from, then what its first sample must be: sound that began before it.
        let at =
            whole.windows(track.voices[0].dry.len()).position(|w| w == track.voices[0].dry).expect("a stretch of the speech");
        for (i, v) in track.binaural[0].iter().enumerate() {
            let expected = if at + i >= 4800 { whole[at + i - 4800] } else { 0.0 };
            assert!((v - expected).abs() < 1e-5 && (track.binaural[1][i] - 0.5 * expected).abs() < 1e-5);
        }
        with_a_past += usize::from(track.binaural[0][..4000].iter().any(|v| v.abs() > 1e-3));
    }
    assert!(with_a_past > 8, "{with_a_past}");
    let poses = |split| capture.split(split).map(|c| c.track).collect::<std::collections::BTreeSet<_>>();
    assert!(poses(Split::Test).is_disjoint(&poses(Split::Train)), "split by pose");
    assert_eq!(poses(Split::Test).len(), 4, "0.3 of 13");
    assert_eq!(from_responses(&set, &[speech()], &options).unwrap(), capture, "the seed decides");
    let other = from_responses(&set, &[speech()], &FromResponses { seed: 6, ..options }).unwrap();
    assert_ne!(other.tracks[0].voices[0].dry, capture.tracks[0].voices[0].dry);
    let folder = tempfile::tempdir().unwrap();
    capture.write(folder.path()).unwrap();
    let again = Capture::load(folder.path()).unwrap();
    assert_eq!((&again.tracks[3].binaural, again.clips.len()), (&capture.tracks[3].binaural, capture.clips.len()));
}

#[test]
fn rates_are_converted_and_bad_options_refused() {
    let set = room();
    let options = FromResponses { sample_rate_hz: Some(22_050), ..FromResponses::default() };
    let capture = from_responses(&set, &[speech()], &options).unwrap();
    assert_eq!((capture.sample_rate_hz, capture.clips[0].len), (22_050.0, 22_050));
    let refused = |options: FromResponses, dry: &[DrySound]| from_responses(&set, dry, &options).unwrap_err().to_string();
    let plain = FromResponses::default();
    assert!(refused(plain, &[]).contains("dry sound: expected at least one, found none"));
    let error = refused(FromResponses { clips: 30, ..plain }, &[speech()]);
    assert!(error.contains("at least 30 s") && error.contains("speech"), "{error}");
    assert!(refused(FromResponses { test_share: 1.5, ..plain }, &[speech()]).contains("share of test clips"));
    let silent = DrySound { samples: vec![0.0; 32_000], ..speech() };
    assert!(refused(plain, &[silent]).contains("at least one clip with sound"));
}

#[test]
fn a_scene_of_the_same_responses_beats_the_dry_sound() {
    let set = room();
    let capture = from_responses(&set, &[speech()], &FromResponses { test_share: 0.3, seed: 3, ..Default::default() }).unwrap();
    let options = EvaluateOptions { baselines: true, ..EvaluateOptions::default() };
    let mut heard = 0;
    let evaluation = evaluate_each(&baked(&set), &capture, &options, &mut |h| {
        assert_eq!(h.predicted[0].len(), h.recorded[1].len());
        heard += 1;
        Ok(())
    })
    .unwrap();
    show(&evaluation);
    assert_eq!((evaluation.methods.len(), heard), (7, 7 * capture.split(Split::Test).count()));
    for figure in [Figure::AvcloudMag, Figure::AvcloudLre, Figure::AvcloudEnv, Figure::Lsd, Figure::Itd, Figure::Ild] {
        let (scene, mono) = (of(&evaluation, "scene", figure), of(&evaluation, "mono-mono", figure));
        assert!(scene < mono, "{figure:?}: {scene} for {mono}");
    }
    // What is told an ear's energy has its level differences.
    assert!(of(&evaluation, "stereo-energy", Figure::AvcloudLre) < 1e-3);
    // Here the energy of the whole changes next to nothing.
    assert!(of(&evaluation, "mono-energy", Figure::AvcloudMag) <= of(&evaluation, "mono-mono", Figure::AvcloudMag));
    // The head is turned, and so the sphere's ears differ as the recording's do.
    assert!(of(&evaluation, "distance-and-head", Figure::Itd) < of(&evaluation, "mono-mono", Figure::Itd));
    let both = overall(&[evaluation.clone(), evaluation.clone()]);
    assert_eq!(both[0].1, evaluation.methods[0].mean);
}

#[test]
fn a_recording_that_the_scene_made_has_no_error() {
    let set = room();
    let scene = baked(&set);
    let mut capture = from_responses(&set, &[speech()], &FromResponses::default()).unwrap();
    // What the scene says is heard becomes what was heard, twice as loud.
    let plain = EvaluateOptions { poses: Poses::Path, ..EvaluateOptions::default() };
    for split in [Split::Train, Split::Test] {
        let mut made = Vec::new();
        let mut one = capture.clone();
        one.clips.iter_mut().for_each(|c| c.split = if c.split == split { Split::Test } else { Split::Train });
        evaluate_each(&scene, &one, &plain, &mut |h| {
            made.push((h.clip.clone(), h.predicted.map(<[f32]>::to_vec)));
            Ok(())
        })
        .unwrap();
        for (clip, ears) in made {
            for (track, ear) in capture.tracks[clip.track].binaural.iter_mut().zip(ears) {
                track[clip.start..clip.start + clip.len].iter_mut().zip(ear).for_each(|(t, v)| *t = 2.0 * v);
            }
        }
    }
    let mean = |options: &EvaluateOptions| evaluate(&scene, &capture, options).unwrap().methods.remove(0).mean;
    assert!(mean(&plain).get(Figure::AvcloudMag).unwrap() > 0.01, "half the level");
    let fitted = mean(&EvaluateOptions { fit_level: true, ..plain.clone() });
    for figure in Figure::ALL {
        assert!(fitted.get(figure).is_none_or(|v| v < 1e-4), "{figure:?}: {fitted:?}");
    }
    // The clip's pose and the path's are the same for a listener who stands still.
    assert_eq!(mean(&plain), mean(&EvaluateOptions { poses: Poses::Fixed, ..plain }));
}

#[test]
fn what_cannot_be_evaluated_says_so() {
    let set = room();
    let scene = baked(&set);
    let mut capture = from_responses(&set, &[speech()], &FromResponses::default()).unwrap();
    let clips = EvaluateOptions { playing: Playing::Clips, ..EvaluateOptions::default() };
    let error = evaluate(&scene, &capture, &clips).unwrap_err().to_string();
    assert!(error.contains("anchor cloud"), "{error}");
    let notes = |capture: &Capture| evaluate(&scene, capture, &EvaluateOptions::default()).unwrap().notes.join("; ");
    assert!(!notes(&capture).contains("another emitter"), "{}", notes(&capture));
    capture.emitters[0].position += Vec3::new(0.0, 1.5, 0.0);
    assert!(notes(&capture).contains("is 1.50 m from the capture's"), "{}", notes(&capture));
    capture.emitters.clear();
    capture.tracks.iter_mut().for_each(|t| t.voices[0].emitter = None);
    capture.clips.iter_mut().for_each(|c| c.split = Split::Test);
    let all = EvaluateOptions { baselines: true, ..EvaluateOptions::default() };
    let evaluation = evaluate(&scene, &capture, &all).unwrap();
    let notes = evaluation.notes.join("; ");
    assert!(notes.contains("no training clips") && notes.contains("where the emitter is"), "{notes}");
    assert_eq!(evaluation.methods.len(), 4);
    capture.clips.iter_mut().for_each(|c| c.split = Split::Train);
    let error = evaluate(&scene, &capture, &all).unwrap_err().to_string();
    assert!(error.contains("at least one clip for testing"), "{error}");
}

mod needs_shared {
    use super::*;
    use promenade_testing::shared;

    #[test]
    #[ignore = "needs ../shared"]
    fn a_measured_room_is_judged() {
        let recipe = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../presets/recipes/iosr-room-a.json");
        let load = LoadOptions { root: Some(shared("data/iosr_brir")), ..LoadOptions::default() };
        let set = Responses::load(&recipe, &load).unwrap();
        let capture = from_responses(&set, &[speech()], &FromResponses::default()).unwrap();
        let tested: Vec<String> = capture.split(Split::Test).map(|c| capture.tracks[c.track].name.clone()).collect();
        let scene = Arc::new(bake_responses(&set, |r, _| tested.contains(&r.name), &BakeOptions::default()).unwrap());
        let head = Responses::load(&shared("data/hrtf_kemar/MIT_KEMAR_normal_pinna.sofa"), &LoadOptions::default()).unwrap();
        let options = EvaluateOptions { baselines: true, head: Some(head), ..EvaluateOptions::default() };
        let evaluation = evaluate(&scene, &capture, &options).unwrap();
        show(&evaluation);
        for figure in [Figure::AvcloudMag, Figure::AvcloudLre, Figure::AvcloudEnv, Figure::Lsd, Figure::Itd, Figure::Ild] {
            assert!(of(&evaluation, "scene", figure) < of(&evaluation, "mono-mono", figure), "{figure:?}");
        }
    }
}
