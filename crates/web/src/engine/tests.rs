//! The engine against core.

use super::*;
use promenade_core::{Audible, Measure, Setting};
use promenade_testing::noise;
use promenade_testing::scenes::{render, room, room_with_cloud, room_with_images, spatializer};
use promenade_testing::signal::{difference_db, first_difference};

const RATE: f64 = 16_000.0;
/// Two seconds of walking and turning, as rows of a path.
const WALK: [[f64; 8]; 2] = [[0.0, -1.0, 0.3, 0.0, 0.0, 0.0, 0.0, 1.0], [2.0, 1.0, 0.3, 0.0, 0.0, 0.0, 1.0, 0.0]];

fn engine(scene: &Scene, options: LoadOptions) -> Engine {
    let mut engine = Engine::new(RATE);
    engine.load(&scene.to_bytes().unwrap(), options).unwrap();
    engine
}

/// Plays a sound in blocks of 128; `between` is called before each.
fn play(engine: &mut Engine, input: &[f32], mut between: impl FnMut(&mut Engine)) -> [Vec<f32>; 2] {
    let mut out = [Vec::new(), Vec::new()];
    for block in input.chunks(128) {
        between(engine);
        engine.input[0][..block.len()].copy_from_slice(block);
        engine.process(1, 0, block.len());
        out.iter_mut().zip(&engine.ears).for_each(|(out, ear)| out.extend(&ear[..block.len()]));
    }
    out
}

#[test]
fn a_walk_sounds_as_in_core_and_again_after_a_reset() {
    let scene = room(RATE, 0.4, 0.1);
    let input = noise(1, 40_000);
    let mut engine = engine(&scene, LoadOptions::default());
    engine.set_path(WALK.as_flattened()).unwrap();
    engine.walk(0.0, 1.0, false, false);
    let heard = play(&mut engine, &input, |_| ());
    let keyframe = |r: &[f64; 8]| {
        let [t_s, v @ ..] = *r;
        let [x, y, z, qx, qy, qz, qw] = v.map(|v| v as f32);
        Keyframe { t_s, pose: pose(x, y, z, qx, qy, qz, qw) }
    };
    let path = CameraPath::new(WALK.iter().map(keyframe).collect()).unwrap();
    let walked = |i: usize| path.pose_after(i as f64 / RATE, Playback::default());
    let want = render(&mut spatializer(&scene, RATE), &input, &[128], &BlockParams::default(), walked);
    assert_eq!(first_difference(&heard, &want), None);
    engine.reset();
    assert_eq!(first_difference(&play(&mut engine, &input, |_| ()), &heard), None, "after a reset");
}

#[test]
fn an_accuracy_plays_the_least_of_a_scene_that_carries_its_front() {
    let mut parts = room_with_images(RATE, 0.3, 0.1, 12).parts().clone();
    let error = Audible { jnds: 0.9, measure: Measure::C50 };
    parts.front = vec![FrontPoint { setting: Setting { images: 3, ..Setting::ALL }, error, cost: 0.5 }];
    let scene = Scene::new(parts).unwrap();
    let images = |within: f32| {
        let engine = engine(&scene, LoadOptions { within, ..LoadOptions::default() });
        let description: serde_json::Value = serde_json::from_str(&engine.description()).unwrap();
        (description["images"].as_u64(), description["front"].as_bool())
    };
    assert_eq!([0.0, 0.5, 1.0].map(images), [12, 12, 3].map(|count| (Some(count), Some(true))));
    let description = engine(&room(RATE, 0.3, 0.1), LoadOptions::default()).description();
    assert!(description.contains("\"front\":false"), "{description}");
}

#[test]
fn a_decoder_elsewhere_is_heard_like_one_here() {
    let scene = room_with_cloud(RATE, 0.4, 0.1);
    let [mut here, mut stream, mut elsewhere] =
        [true, false, false].map(|inline| engine(&scene, LoadOptions { inline, ..LoadOptions::default() }));
    let input = noise(2, 32_000);
    let there = pose(0.7, 0.2, 0.0, 0.0, 0.0, 0.6, 0.8);
    for engine in [&mut here, &mut stream] {
        engine.jump(there);
    }
    stream.lighten();
    let want = play(&mut here, &input, |_| ());
    let mut asked = 0;
    let heard = play(&mut stream, &input, |stream| {
        if let Some(pose) = stream.asked(0) {
            asked += 1;
            assert!(stream.answer(0, &elsewhere.decode(&pose)));
        }
    });
    assert!(asked > 0 && !stream.answer(0, &[1.0]) && !stream.answer(1, &elsewhere.decode(&there)));
    let last = |ears: &[Vec<f32>; 2]| ears.each_ref().map(|ear| ear[24_000..].to_vec());
    let db = difference_db(&last(&heard), &last(&want));
    assert!(db < -100.0, "{db} dB");
}

#[test]
fn what_is_refused_is_said() {
    let mut engine = Engine::new(RATE);
    assert!(engine.load(b"no scene", LoadOptions::default()).unwrap_err().len() > 10);
    assert!(engine.set_head(b"no head").unwrap_err().contains("head"));
    assert!(engine.set_headphones(b"no headphones").is_err());
    assert!(engine.set_path(&[[0.0; 8]; 2].concat()).is_err(), "times must rise");
    assert_eq!(engine.description(), "null");
    engine.process(1, 0, 128);
    assert!(Engine::new(1.0).load(&room(RATE, 0.4, 0.1).to_bytes().unwrap(), LoadOptions::default()).is_err());
}

#[test]
fn settings_reach_the_stream() {
    let scene = room(RATE, 0.4, 0.1);
    let options = LoadOptions { second_emitter: true, ..LoadOptions::default() };
    let input = noise(3, 8_000);
    let plain = play(&mut engine(&scene, options), &input, |_| ());
    for (setting, value) in [(1, 0.5), (2, 0.3), (3, 1.0), (4, 1.0), (5, 0.1), (6, 0.1), (8, 0.5), (10, 0.0), (11, 500.0)] {
        let mut engine = engine(&scene, options);
        engine.set(setting, value);
        assert!(difference_db(&play(&mut engine, &input, |_| ()), &plain) > -60.0, "setting {setting}");
    }
    let mut engine = engine(&scene, options);
    engine.put(0, Vec3::X);
    assert!(difference_db(&play(&mut engine, &input, |_| ()), &plain) > -60.0, "the first sound elsewhere");
}

#[test]
fn further_sounds_are_voices_of_the_same_room() {
    let scene = room(RATE, 0.4, 0.1);
    let [first, second] = [3, 4].map(|seed| noise(seed, 16_000));
    let offset = Vec3::new(0.5, 1.0, 0.0);
    let mut engine = engine(&scene, LoadOptions { further: 2, ..LoadOptions::default() });
    engine.put(2, offset);
    assert!(engine.input(3).len() == 1024 && engine.input(4).is_empty());
    let mut heard = [Vec::new(), Vec::new()];
    for (a, b) in first.chunks(128).zip(second.chunks(128)) {
        engine.input(0)[..128].copy_from_slice(a);
        engine.input(3)[..128].copy_from_slice(b);
        engine.process(1, 0b10, 128);
        heard.iter_mut().zip(&engine.ears).for_each(|(heard, ear)| heard.extend(&ear[..128]));
    }
    let config = RendererConfig { voices: 3, ..RATE.into() };
    let mut core = Spatializer::new(RATE);
    core.install(Emitters::from(Renderer::new(Arc::clone(&scene), config).unwrap()));
    let (mut want, start) = ([vec![0.0; 16_000], vec![0.0; 16_000]], scene.start_pose());
    let voices = [Voice::default(), Voice { input: &second, offset, ..Voice::default() }];
    let [left, right] = &mut want;
    core.process(&[&first], &voices, [left, right], &BlockParams::default(), |_| start);
    assert_eq!(first_difference(&heard, &want), None);
    assert!(difference_db(&heard, &play(&mut self::engine(&scene, LoadOptions::default()), &first, |_| ())) > -20.0);
}
