//! What is trained is the derivative's, goes on after a stop, and is what plays.

use super::*;
use crate::settings::{LossSettings, NetworkSettings};
use crate::weights::is_fixed;
use promenade_baker::capture::{Emitter, Track, Voice};
use promenade_core::decode::CloudDecoder;
use promenade_core::glam::Vec3;
use promenade_core::network::Placement;
use promenade_core::{CameraPath, Keyframe, LiveParams};
use promenade_testing::noise;
use std::sync::Arc;

const RATE: f64 = 8000.0;

fn settings() -> TrainSettings {
    let network = NetworkSettings {
        width: 16,
        heads: 2,
        layers: 2,
        feed_forward: 32,
        bands: 12,
        octaves: 3,
        highest: 4.0,
        taps: 5,
        ..NetworkSettings::default()
    };
    let loss = LossSettings { n_fft: vec![64, 128], ..LossSettings::default() };
    TrainSettings { network, loss, steps: 40, batch: 3, rate: 3e-3, shift_s: 0.5, look_every: 20, ..TrainSettings::default() }
}

/// A listener who walks round an emitter: softer far away, louder on its side, with an echo.
fn capture() -> Capture {
    let (clip, clips) = (1600, 10);
    let mut random = Random::new(7);
    let emitter = Vec3::new(1.0, 2.0, 1.5);
    let dry: Vec<f32> = (0..clip * clips).map(|_| 0.3 * random.normal()).collect();
    let pose = |i: usize| {
        let at = i as f32;
        Pose::from_ypr(Vec3::new((0.7 * at).sin(), -0.2 * at, 1.5), 0.6 * at, 0.0, 0.0)
    };
    let mut binaural = [vec![0.0; dry.len()], vec![0.0; dry.len()]];
    for i in 0..dry.len() {
        let pose = pose(i / clip);
        let gain = 1.0 / pose.position.distance(emitter).max(0.25);
        let side = pose.to_head(emitter).normalize().y;
        for (ear, side) in binaural.iter_mut().zip([side, -side]) {
            ear[i] = gain * (1.0 + 0.6 * side) * dry[i] + 0.2 * dry[i.saturating_sub(150)];
        }
    }
    let seconds = |i: usize| (i * clip) as f64 / RATE;
    let keyframes = (0..clips).map(|i| Keyframe { t_s: seconds(i) + 0.1, pose: pose(i) }).collect();
    let clips = (0..clips).map(|i| Clip {
        name: format!("{i}"),
        track: 0,
        start: i * clip,
        len: clip,
        pose: pose(i),
        split: if i % 5 == 2 { Split::Test } else { Split::Train },
    });
    Capture {
        title: "Walk".to_owned(),
        credit: String::new(),
        licence: String::new(),
        sample_rate_hz: RATE,
        emitters: vec![Emitter::at(emitter)],
        clips: clips.collect(),
        tracks: vec![Track {
            name: "t".to_owned(),
            voices: vec![Voice { emitter: Some(0), dry }],
            binaural,
            path: CameraPath::new(keyframes).unwrap(),
        }],
        notes: Vec::new(),
    }
}

fn anchors() -> AnchorSet {
    let mut random = Random::new(3);
    let mut spread = |count: usize, by: f32| -> Vec<f32> { (0..count).map(|_| by * random.normal()).collect() };
    let positions = spread(3 * 9, 2.0).chunks_exact(3).map(Vec3::from_slice).collect();
    AnchorSet { placement: Placement::IDENTITY, positions, features: spread(9 * 6, 1.0), neighbours: 2 }
}

fn trainer(capture: &Capture, settings: TrainSettings) -> Trainer<'_> {
    Trainer::new(capture, &anchors(), settings, Device::flex(), 2).unwrap()
}

/// A walk with a second emitter that is heard in half of the clips.
fn mix() -> Capture {
    let mut capture = capture();
    let track = &mut capture.tracks[0];
    let half = track.samples() / 2;
    let second: Vec<f32> =
        noise(77, track.samples()).iter().enumerate().map(|(i, x)| if i < half { 0.2 * x } else { 0.0 }).collect();
    track.binaural.iter_mut().for_each(|ear| ear.iter_mut().zip(&second).for_each(|(sum, x)| *sum += 0.4 * x));
    track.voices.push(Voice { emitter: Some(1), dry: second });
    capture.emitters[0].name = "first".to_owned();
    capture.emitters.push(Emitter { name: "second".to_owned(), ..Emitter::at(Vec3::new(-1.0, 1.0, 1.0)) });
    capture
}

/// A room that is simulated: direct sound and decaying noise, the left ear later by the number of the emitter.
fn simulated(emitter: usize, poses: &[Pose]) -> Result<Vec<[Vec<f32>; 2]>, BakeError> {
    let ear = |seed: u64, direct: usize| -> Vec<f32> {
        let room = noise(seed, 1200).into_iter().enumerate();
        let mut ear: Vec<f32> = room.map(|(i, x)| if i < 60 { 0.0 } else { 0.1 * x * (-(i as f32) / 300.0).exp() }).collect();
        ear[direct] = 0.7;
        ear
    };
    Ok((0..poses.len() as u64).map(|i| [ear(2 * i, 30 + 2 * emitter), ear(2 * i + 1, 30)]).collect())
}

#[test]
fn every_gradient_is_the_derivative() {
    let capture = capture();
    let mix = mix();
    let variants: [fn(&mut NetworkSettings); 4] =
        [|_| (), |n| (n.emitter, n.taps) = (false, 0), |_| (), |n| n.simulated = true];
    for (variant, change) in variants.into_iter().enumerate() {
        let mut settings = settings();
        change(&mut settings.network);
        let mut trainer = match variant {
            2 => trainer(&mix, settings),
            3 => Trainer::on_simulation(&mix, &anchors(), settings, Device::flex(), 2, &simulated).unwrap(),
            _ => trainer(&capture, settings),
        };
        let examples = trainer.batch(0);
        let gradients = trainer.loss(&examples).1;
        let names: Vec<String> = trainer.weights.keys().cloned().collect();
        for name in names {
            let gradient = gradients.get(&name).cloned().unwrap_or_default();
            let norm = gradient.iter().map(|g| g * g).sum::<f32>().sqrt();
            // The weights of a softmax do not change with a bias that all keys have.
            if is_fixed(&name) || name == "pcd_av_proj.2.proj.bias" {
                assert!(norm < 1e-7, "{name} of variant {variant} has a gradient of {norm}");
                continue;
            }
            let whole = trainer.weights[&name].values.clone();
            let scale = (whole.iter().map(|w| w * w).sum::<f32>() / whole.len() as f32).sqrt().max(0.05);
            let mut value = |step: f32| {
                let moved = trainer.weights.get_mut(&name).unwrap();
                let along = whole.iter().zip(&gradient).map(|(w, g)| w + step * g / norm.max(1e-12));
                moved.values = along.collect();
                trainer.loss(&examples).0
            };
            let step = 2e-2 * scale;
            let slope = (value(step) - value(-step)) / (2.0 * f64::from(step));
            trainer.weights.get_mut(&name).unwrap().values = whole;
            // Single precision and the kinks of absolute values leave some percent.
            let off = (slope - f64::from(norm)).abs();
            assert!(off < 0.08 * f64::from(norm) + 2e-4, "{name} of variant {variant}: {norm} against {slope}");
            assert!(norm > 1e-7, "{name} of variant {variant} has no gradient");
        }
    }
}

#[test]
fn a_simulation_begins_as_it_is_and_a_mix_is_the_sum_of_its_voices() {
    let mix = mix();
    let settings = settings();
    let mut trainer = Trainer::on_simulation(&mix, &anchors(), settings, Device::flex(), 2, &simulated).unwrap();
    let clip = mix.split(Split::Test).next().unwrap();
    let example = trainer.example(clip);
    let ears = simulated(0, &[clip.pose]).unwrap().remove(0);
    let refined = trainer.refined(&clip.pose, mix.emitters[0].position, &ears).unwrap();
    // Before the first step the network is nearly silent. Of a mix no response is found, so that the level stays as it is too.
    let energy = |x: &[f32]| x.iter().map(|v| v * v).sum::<f32>();
    for (own, new) in ears.iter().zip(&refined) {
        let level_db = 10.0 * (energy(new) / energy(own)).log10();
        assert!(level_db.abs() < 0.5, "{level_db}");
    }
    assert_eq!(example.voices.len(), 2);
    let whole = trainer.render(std::slice::from_ref(&example)).remove(0);
    let alone = [0, 1].map(|i| {
        let example = Example { voices: vec![example.voices[i].clone()], ..example.clone() };
        trainer.render(&[example]).remove(0)
    });
    for ear in 0..2 {
        let off = whole[ear].iter().zip(alone[0][ear].iter().zip(&alone[1][ear])).map(|(w, (a, b))| (w - a - b).abs());
        assert!(off.fold(0.0, f32::max) < 1e-5 && energy(&alone[1][ear]) > 1e-3);
    }
}

#[test]
fn shifted_clips_are_heard_where_they_are_heard() {
    let capture = capture();
    let trainer = trainer(&capture, TrainSettings { shift_s: 0.1, ..settings() });
    let track = &capture.tracks[0];
    let mut shifted = 0;
    for step in 0..30 {
        for example in trainer.batch(step) {
            let of = |clip: &&Clip| capture.binaural(clip)[0].as_ptr() == example.binaural[0].as_ptr();
            let clip = trainer.clips.iter().flatten().find(of).expect("a stretch of the recording");
            let heard_at = track.path.pose_at(capture.middle_s(clip));
            assert!(example.pose.position.distance(heard_at.position) < 1e-5, "{}", clip.name);
            assert!(example.pose.orientation.dot(heard_at.orientation).abs() > 1.0 - 1e-5, "{}", clip.name);
            assert_eq!(example.voices[0].dry[example.pre_roll..].len(), clip.len);
            shifted += usize::from(clip.start % clip.len != 0);
        }
    }
    assert!(shifted > 20, "{shifted} of 90 clips were shifted");
}

#[test]
fn the_scene_plays_what_was_trained() {
    let capture = capture();
    let mut trainer = trainer(&capture, settings());
    (0..5).for_each(|_| assert!(trainer.step().loss.is_finite()));
    let scene = Arc::new(trainer.scene(Provenance::default()).unwrap());
    let bytes = scene.to_bytes().unwrap();
    assert_eq!(Scene::from_bytes(&bytes).unwrap(), *scene);
    let mut decoder = CloudDecoder::new(&scene).unwrap();
    let mut decoded = decoder.blank();
    let clips: Vec<Clip> = capture.split(Split::Test).cloned().collect();
    for clip in &clips {
        decoder.decode(&clip.pose, &mut decoded);
        let trained = trainer.transfer(&clip.pose, Some(0)).to_row();
        let worst = decoded.transfer.to_row().iter().zip(&trained).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(worst < 1e-4, "transfer functions differ by {worst}");
        let example = trainer.example(clip);
        let rendered = trainer.render(std::slice::from_ref(&example)).remove(0);
        let mut renderer = promenade_testing::scenes::live_renderer(&scene, RATE);
        let latency = renderer.latency_samples();
        let input: Vec<f32> = example.voices[0].dry.iter().copied().chain(vec![0.0; latency]).collect();
        let mut out = [vec![0.0; input.len()], vec![0.0; input.len()]];
        let [left, right] = &mut out;
        let live = LiveParams { wait: true, ..LiveParams::default() };
        renderer.process(&[input[..].into()], [left, right], live, &mut |_| clip.pose);
        for (played, rendered) in out.iter().zip(&rendered) {
            let played = &played[example.pre_roll + latency..];
            let worst = played.iter().zip(rendered).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(worst < 1e-4, "sounds differ by {worst}");
            assert!(rendered.iter().any(|x| x.abs() > 0.01));
        }
    }
}

#[test]
fn goes_on_after_a_stop_as_if_it_had_not_stopped_and_learns() {
    let capture = capture();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("walk.training");
    let mut whole = trainer(&capture, settings());
    let first = whole.note().unwrap();
    for _ in 0..40 {
        whole.step();
        if whole.steps().is_multiple_of(20) {
            whole.note().unwrap();
        }
    }
    let mut parts = trainer(&capture, settings());
    parts.note().unwrap();
    (0..13).for_each(|_| assert!(parts.step().loss.is_finite()));
    parts.checkpoint().save(&file).unwrap();
    drop(parts);
    let mut parts = trainer(&capture, settings());
    parts.resume(Checkpoint::load(&file).unwrap()).unwrap();
    assert_eq!(parts.steps(), 13);
    for _ in 13..40 {
        parts.step();
        if parts.steps().is_multiple_of(20) {
            parts.note().unwrap();
        }
    }
    assert_eq!(parts.weights(), whole.weights());
    for (a, b) in parts.curve().iter().zip(whole.curve()) {
        // Written as decimals on the way.
        assert!(a.step == b.step && (a.loss - b.loss).abs() < 1e-12 && (a.test[0] - b.test[0]).abs() < 1e-12);
    }
    assert_eq!(parts.curve().len(), 3);
    let last = whole.curve().last().unwrap();
    // Forty steps, which serve the responses too.
    assert!(last.test[0] < 0.95 * first.test[0], "MAG from {} to {}", first.test[0], last.test[0]);

    let other = TrainSettings { seed: 2, ..settings() };
    let refused = trainer(&capture, other).resume(Checkpoint::load(&file).unwrap()).unwrap_err();
    assert!(refused.to_string().contains("settings"), "{refused}");
    let bytes = std::fs::read(&file).unwrap();
    for end in (0..bytes.len()).step_by(997) {
        std::fs::write(&file, &bytes[..end]).unwrap();
        let error = Checkpoint::load(&file).unwrap_err().to_string();
        assert!(error.contains("walk.training"), "{error}");
    }
    for (at, flip) in
        (0..bytes.len()).step_by(499).chain(bytes.len() - 4..bytes.len()).zip([1_u8, 0x20, 0x80].into_iter().cycle())
    {
        let mut changed = bytes.clone();
        changed[at] ^= flip;
        std::fs::write(&file, &changed).unwrap();
        let error = Checkpoint::load(&file).map(|_| ()).expect_err("a damaged byte").to_string();
        assert!(error.contains("walk.training") && error.contains("damaged"), "byte {at}: {error}");
    }
}
