//! Extremes: whatever comes in, sound goes out, and nothing of what was broken stays.

use promenade_core::glam::Vec3;
use promenade_core::{Bands, BlockParams, Carriers, LiveParams, Pose, Renderer, Scene, SceneParts, Spatializer, Trim};
use promenade_testing::hostile::{
    Input, LOUDEST, Walk, block, is_output, is_sound, one_transfer, room_of_anchors, scenes, settings, wild,
};
use promenade_testing::scenes::{DIRECT, full_renderer, render, room, room_with_images, spatializer};
use promenade_testing::signal::{difference_db, peak};
use promenade_testing::{Rng, for_seeds, noise};
use std::sync::{Arc, LazyLock};

const RATE: f64 = 8_000.0;

type Ears = [Vec<f32>; 2];

/// Scenes of every kind.
static SCENES: LazyLock<Vec<(&str, Arc<Scene>)>> = LazyLock::new(|| scenes(RATE));

fn playing(scene: &Arc<Scene>, rate: f64) -> Spatializer {
    let mut s = Spatializer::new(rate);
    s.install(Box::new(full_renderer(scene, rate, 1)));
    s
}

/// With the room and without it.
fn usual() -> [BlockParams; 2] {
    [Trim::NEUTRAL, DIRECT].map(|trim| BlockParams { trim, ..BlockParams::default() })
}

#[test]
fn whatever_comes_in_sound_goes_out() {
    for_seeds(16, |rng| assert_eq!(wild(rng, &SCENES, 20_000), Ok(())));
}

#[test]
fn what_is_no_sound_is_as_silence() {
    for (name, scene) in &*SCENES {
        for params in usual() {
            let mut broken = vec![0.0; 6_000];
            Input::Broken.fill(&mut Rng::with_seed(1), &mut broken);
            let clean: Vec<f32> = broken.iter().map(|x| if is_sound(*x) { *x } else { 0.0 }).collect();
            assert!(broken.iter().zip(&clean).any(|(a, b)| a.to_bits() != b.to_bits()));
            let play =
                |input: &[f32]| render(&mut playing(scene, RATE), input, &[333], &params, |i| Walk::Spinning.pose(i, RATE));
            assert!(play(&broken) == play(&clean), "{name}, {params:?}");
        }
    }
    // The dry sound passes what is loud, up to the limit.
    let mut s = spatializer(&SCENES[0].1, RATE);
    let params = BlockParams { mix: 0.0, ..BlockParams::default() };
    let latency = s.latency_samples();
    let input = [1.0, f32::NAN, f32::INFINITY, -1e10, 1e-40, 0.5];
    let padded = [&input[..], &vec![0.0; latency]].concat();
    let dry = render(&mut s, &padded, &[64], &params, |_| Pose::IDENTITY);
    assert_eq!(dry[0][latency..], [1.0, 0.0, 0.0, -LOUDEST, 0.0, 0.5]);
}

#[test]
fn a_pose_that_is_none_leaves_the_listener_where_he_was() {
    const STAY: usize = 1_000;
    let input = noise(2, 8 * STAY);
    for (name, scene) in &*SCENES {
        for params in usual() {
            let last = |i: usize| Walk::Teleports.pose(i / STAY, RATE);
            let broken = |i: usize| {
                let invalid = Walk::INVALID[i / STAY % 4].pose(i, RATE);
                if i % STAY < STAY / 2 { last(i) } else { invalid }
            };
            let play = |pose: &dyn Fn(usize) -> Pose| render(&mut playing(scene, RATE), &input, &[77], &params, pose);
            assert!(play(&broken) == play(&last), "{name}, {params:?}");
        }
    }
    // Without a pose before, he is at the origin.
    let scene = &SCENES[0].1;
    let play = |pose: Pose| render(&mut spatializer(scene, RATE), &input, &[77], &BlockParams::default(), |_| pose);
    for walk in Walk::INVALID {
        assert!(play(walk.pose(0, RATE)) == play(Pose::IDENTITY), "{walk:?}");
    }
}

/// Time in which the right channel of a stereo sound goes from one emitter to the other, seconds.
const EMITTERS_FADE_S: f64 = 0.05;

/// What a scene plays of a calm part after a wild one, and what it would have without.
fn after_a_wild_part(rng: &mut Rng, scene: &Arc<Scene>, params: &BlockParams, calm: &[f32]) -> [Ears; 2] {
    const WILD: usize = 4_000;
    let walks = [Walk::valid(scene), Walk::INVALID.into()].concat();
    let (mut used, mut fresh) = (playing(scene, RATE), playing(scene, RATE));
    let still = |_: usize| Pose::from_ypr(Vec3::new(0.2, 0.1, 0.0), 0.7, 0.1, 0.0);
    let mut at = 0;
    while at < WILD {
        let size = block(rng).min(WILD - at);
        let mut input = vec![0.0; size];
        rng.choice(Input::ALL).unwrap().fill(rng, &mut input);
        let (walk, settings) = (rng.choice(&walks).unwrap(), settings(rng));
        render(&mut used, &input, &[size], &settings, |i| walk.pose(at + i, RATE));
        // As many hops, since frames lie where hops do.
        render(&mut fresh, &vec![0.0; size], &[size], params, still);
        at += size;
    }
    [used, fresh].map(|mut s| render(&mut s, calm, &[500], params, still))
}

#[test]
fn nothing_of_a_wild_part_stays_longer_than_a_tail() {
    for_seeds(2, |rng| {
        for (name, scene) in &*SCENES {
            let renderer = full_renderer(scene, RATE, 1);
            // After a wild angle between two emitters the right channel goes back to the first one.
            let together = (EMITTERS_FADE_S * RATE).ceil() as usize;
            let tail = renderer.tail_samples() + renderer.latency_samples() + together;
            let calm = noise(3, 3 * tail + 2_000);
            let params = BlockParams::default();
            let [used, fresh] = after_a_wild_part(rng, scene, &params, &calm);
            let level = 20.0 * peak(&fresh[0][tail..]).max(1e-6).log10();
            let past = [1, 2, 3].map(|tails| {
                let part = |ears: &Ears| [0, 1].map(|ear| ears[ear][tails * tail..].to_vec());
                difference_db(&part(&used), &part(&fresh)) - level
            });
            println!("{name}: {past:.0?} dB");
            // Beyond the limit of the output the past is loud against what is left of the present.
            let first = if peak(&fresh[0]) < LOUDEST { -90.0 } else { -50.0 };
            let clean = past[0] < first && past[1] < -110.0;
            assert!(clean, "{name}: {past:.0?} dB after one, two and three tails");
        }
    });
}

#[test]
fn at_the_edges_of_places_levels_stay_in_bounds() {
    let input = noise(4, 3_000);
    for scene in [room(RATE, 0.3, 0.1), room_with_images(RATE, 0.3, 0.1, 20)] {
        for walk in Walk::valid(&scene) {
            let mut s = spatializer(&scene, RATE);
            let out = render(&mut s, &input, &[64], &BlockParams::default(), |i| walk.pose(i, RATE));
            // Nearest to the emitter the masks' 1.44 are four times as loud, and so is the image there.
            assert!((0.01..40.0).contains(&peak(&out[0])), "{walk:?}: {}", peak(&out[0]));
        }
        let far = |_: usize| Walk::Far.pose(0, RATE);
        let draft = BlockParams { trim: DIRECT, ..BlockParams::default() };
        let out = render(&mut spatializer(&scene, RATE), &input, &[64], &draft, far);
        assert!(peak(&out[0]) < 1e-7, "nothing is heard from 1e9 m away: {}", peak(&out[0]));
    }
}

#[test]
fn masks_of_nothing_are_silent_and_masks_of_a_million_end() {
    let mut input = noise(5, 2_000);
    input.resize(30_000, 0.0);
    let play = |mask: f32| {
        let mut s = spatializer(&one_transfer(RATE, mask, 8, 0.3), RATE);
        render(&mut s, &input, &[512], &BlockParams::default(), |_| Pose::IDENTITY)
    };
    assert!(play(0.0).iter().flatten().all(|x| *x == 0.0));
    let loud = play(1e6);
    assert!(loud.iter().flatten().all(|x| is_output(*x)));
    assert_eq!(peak(&loud[0]), LOUDEST);
    assert!(loud.iter().all(|ear| ear[25_000..].iter().all(|x| *x == 0.0)), "and falls silent");
}

#[test]
fn a_room_that_falls_within_a_hop_begins_no_louder_than_30_db_over_its_level() {
    let click = [&[1.0][..], &[0.0; 4_000]].concat();
    let level = |t60_s: f32, decay: f32| {
        let mut s = spatializer(&one_transfer(RATE, 1e-3, 8, t60_s), RATE);
        let params = BlockParams { trim: Trim { decay, ..Trim::default() }, ..BlockParams::default() };
        peak(&render(&mut s, &click, &[512], &params, |_| Pose::IDENTITY)[0])
    };
    let longest = level(0.1, 1.0);
    for t60_s in [0.07, 0.02, 0.01, 2e-3, 1e-3] {
        for decay in [0.5, 1.0, 2.0] {
            let times = level(t60_s, decay) / longest;
            assert!(times < 31.6, "a room of {t60_s} s, its decay times {decay}: {times} times a room of 0.1 s");
        }
    }
}

#[test]
fn scenes_may_be_small_but_not_empty() {
    assert!(Bands::new(vec![500.0]).is_none(), "a scene has two bands or more");
    let scene = room_with_images(RATE, 0.3, 0.1, 1);
    let mut parts: SceneParts = scene.parts().clone();
    parts.images.as_mut().unwrap().images.clear();
    parts.images.as_mut().unwrap().seen.clear();
    assert!(Scene::new(parts).unwrap_err().to_string().contains("number of images"));
    let mut s = playing(&room_of_anchors(RATE, 1), RATE);
    let high = BlockParams::default();
    let out = render(&mut s, &noise(6, 4_000), &[64], &high, |i| Walk::Spinning.pose(i, RATE));
    assert!(peak(&out[0]) > 1e-3);
}

#[test]
fn a_thousand_instances_come_and_go() {
    let scene = one_transfer(RATE, 0.5, 4, 0.1);
    let carriers = Arc::new(Carriers::new(&scene, RATE));
    let input = noise(7, 400);
    let play = || {
        let renderer = Renderer::new(Arc::clone(&scene), (RATE, Arc::clone(&carriers))).unwrap();
        let mut s = Spatializer::new(RATE);
        s.install(Box::new(renderer));
        render(&mut s, &input, &[64], &BlockParams::default(), |_| Pose::IDENTITY)
    };
    let first = play();
    // Some sound on while others come and go.
    let held: Vec<_> = (0..100).map(|_| spatializer(&scene, RATE)).collect();
    assert!((0..1_000).all(|_| play() == first));
    for mut s in held {
        assert!(render(&mut s, &input, &[64], &BlockParams::default(), |_| Pose::IDENTITY) == first);
    }
    assert_eq!(Arc::strong_count(&scene), 1, "nothing holds on to the scene");
}

#[test]
fn settings_that_are_no_numbers_are_the_least() {
    let scene = room_of_anchors(RATE, 1);
    let input = noise(8, 4_000);
    // Every other block has the settings in question.
    let play = |odd: BlockParams| {
        let mut s = playing(&scene, RATE);
        let even = BlockParams::default();
        let blocks = input.chunks(200).enumerate().map(|(turn, part)| {
            let params = if turn % 2 == 1 { odd } else { even };
            render(&mut s, part, &[50], &params, |i| Walk::Teleports.pose(turn * 200 + i, RATE))
        });
        blocks.collect::<Vec<_>>()
    };
    let gain = |gain: f32| play(BlockParams { gain, ..BlockParams::default() });
    let mix = |mix: f32| play(BlockParams { mix, ..BlockParams::default() });
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0] {
        assert!(gain(bad) == gain(0.0) && mix(bad) == mix(0.0), "{bad}");
    }
    assert!(gain(1e30) == gain(1e3) && mix(1e30) == mix(1.0));
    let rate = |rate_hz: f32| play(BlockParams { live: LiveParams { rate_hz, wait: true }, ..BlockParams::default() });
    for bad in [f32::NAN, -1.0] {
        assert!(rate(bad) == rate(0.0), "{bad}");
    }
    // One decode a hop is the most; hops of 5 ms are 200 a second.
    assert!(rate(1e9) == rate(200.0) && rate(f32::INFINITY) == rate(200.0) && rate(200.0) != rate(20.0));
}

#[test]
fn the_way_to_a_place_is_not_heard_in_the_air() {
    let scene = room_with_images(RATE, 0.3, 0.1, 4);
    let mut input = vec![0.0; 2_000];
    input.extend(noise(9, 4_000));
    let at = |x: f32| Pose { position: Vec3::new(x, 0.0, 0.0), ..Pose::IDENTITY };
    let draft = BlockParams { trim: DIRECT, ..BlockParams::default() };
    let from = |start: f32| {
        let pose = |i: usize| at(if i < 1_000 { start } else { -1.01 });
        render(&mut spatializer(&scene, RATE), &input, &[100], &draft, pose)
    };
    let came = from(-1.0);
    assert!(came == from(-1.01) && came == from(2.0));
}
