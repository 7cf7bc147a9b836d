//! Further sources in the room of a renderer: each alone is what an instance of its own would play but for what comes later.

use promenade_core::glam::Vec3;
use promenade_core::{BlockParams, EmitterParams, Latency, Pose, Renderer, RendererConfig, Scene, Spatializer, Trim, Voice};
use promenade_metrics::{c50_db, octave_of};
use promenade_testing::noise;
use promenade_testing::scenes::{room, room_of_responses, room_with_images, walk};
use promenade_testing::signal::{difference_db, first_difference};
use std::sync::Arc;
use std::time::Instant;

const RATE: f64 = 48_000.0;

fn factory(name: &str) -> Arc<Scene> {
    let file = format!("{}/../presets/scenes/{name}.promenade", env!("CARGO_MANIFEST_DIR"));
    Arc::new(Scene::from_bytes(&std::fs::read(file).unwrap()).unwrap())
}

fn with_further(scene: &Arc<Scene>, count: usize) -> Spatializer {
    let mut s = Spatializer::new(RATE);
    s.install(Box::new(Renderer::new(Arc::clone(scene), RendererConfig { voices: 1 + count, ..RATE.into() }).unwrap()));
    s
}

/// Plays a main sound and further ones, each from its place.
fn play(
    s: &mut Spatializer,
    main: &[f32],
    further: &[(&[f32], Vec3)],
    sizes: &[usize],
    params: &BlockParams,
    pose_at: impl Fn(usize) -> Pose,
) -> [Vec<f32>; 2] {
    let mut out = [vec![0.0; main.len()], vec![0.0; main.len()]];
    let (mut at, mut turn) = (0, 0);
    while at < main.len() {
        let span = at..main.len().min(at + sizes[turn % sizes.len()]);
        let blocks: Vec<_> = further.iter().map(|(input, offset)| Voice::at(&input[span.clone()], *offset)).collect();
        let [left, right] = &mut out;
        let ears = [&mut left[span.clone()], &mut right[span.clone()]];
        s.process(&[&main[span.clone()]], &blocks, ears, params, |i| pose_at(at + i));
        (at, turn) = (span.end, turn + 1);
    }
    out
}

/// What an instance plays whose emitter is moved.
fn alone(
    scene: &Arc<Scene>,
    input: &[f32],
    offset: Vec3,
    params: &BlockParams,
    pose_at: impl Fn(usize) -> Pose,
) -> [Vec<f32>; 2] {
    let params = BlockParams { emitters: EmitterParams { offset, spread: 0.0 }, ..*params };
    play(&mut with_further(scene, 0), input, &[], &[512], &params, pose_at)
}

/// A further source where the first one is has the same room, however the listener walks.
#[test]
fn a_further_source_at_the_first_ones_place_is_the_first_one() {
    let scenes = [
        ("noise", room(RATE, 0.5, 0.1), -90.0),
        ("images", room_with_images(RATE, 0.5, 0.1, 12), -90.0),
        ("responses", room_of_responses(RATE).0, -90.0),
        ("Room A", factory("iosr-room-a"), -90.0),
        // Its late part depends on the place, and is brought to it by turns.
        ("loft", factory("loft"), -65.0),
    ];
    let (input, silence) = (noise(5, 48_000), vec![0.0; 48_000]);
    for (name, scene, bar) in scenes {
        for trim in [Trim::NEUTRAL, Trim { early: 0.5, decay: 1.3, width: 0.7, distance_law: 0.5, ..Trim::NEUTRAL }] {
            let params = BlockParams { trim, ..BlockParams::default() };
            let wanted = alone(&scene, &input, Vec3::ZERO, &params, walk(RATE));
            let mut s = with_further(&scene, 3);
            let further = [(&silence[..], Vec3::X), (&input[..], Vec3::ZERO)];
            let found = play(&mut s, &silence, &further, &[512, 31, 100], &params, walk(RATE));
            let db = difference_db(&wanted, &found);
            assert!(db < bar, "{name} {trim:?}: {db} dB");
        }
    }
}

/// Samples of a window and of what is its own of a room's response, 55 ms.
const FRAME: usize = 780;
const OWN: usize = 2_640;

/// By how much the sound differs in the first 55 ms after each of some clicks, dB.
fn early_difference_db(a: &[Vec<f32>; 2], b: &[Vec<f32>; 2], clicks: &[usize]) -> f32 {
    let early = |ears: &[Vec<f32>; 2]| {
        ears.each_ref().map(|ear| clicks.iter().flat_map(|at| &ear[at + 600..at + FRAME + OWN]).copied().collect())
    };
    difference_db(&early(a), &early(b))
}

#[test]
fn a_further_sources_early_sound_is_that_of_an_instance_of_its_own() {
    let scenes = [
        ("noise", room(RATE, 0.15, 0.1), -80.0),
        ("images", room_with_images(RATE, 0.15, 0.1, 12), -80.0),
        ("Room A", factory("iosr-room-a"), -80.0),
        ("loft", factory("loft"), -80.0),
    ];
    // What comes late of one click has died away when the next comes.
    let clicks = [48_000, 96_000, 144_000];
    let mut input = vec![0.0; 150_000];
    clicks.iter().for_each(|at| input[*at] = 1.0);
    let silence = vec![0.0; input.len()];
    let offset = Vec3::new(-0.6, 0.8, 0.1);
    for (name, scene, bar) in scenes {
        // Silence would let the source sleep.
        let mut awake = input.clone();
        awake.iter_mut().step_by(1_000).for_each(|x| *x += 1e-11);
        let params = BlockParams::default();
        let wanted = alone(&scene, &awake, offset, &params, walk(RATE));
        let found = play(&mut with_further(&scene, 1), &silence, &[(&awake, offset)], &[512], &params, walk(RATE));
        let db = early_difference_db(&wanted, &found, &clicks);
        assert!(db < bar, "{name}: {db} dB");
    }
}

/// What comes later is the first source's room at the further source's level: by how much energies of octaves from 80 ms on
/// differ from those of an instance of its own, and clarity.
#[test]
fn the_shared_part_of_a_room_is_as_loud_as_its_own() {
    let (len, at) = (72_000, 24_000);
    let mut click = vec![0.0; len];
    click[at] = 1.0;
    let silence = vec![0.0; len];
    // Where a room was measured each voice has the bass that was measured for it.
    for (name, octave_bar, c50_bar) in [("iosr-room-a", 1.0, 0.4), ("iosr-room-b", 1.5, 0.7), ("loft", 0.3, 0.2)] {
        let scene = factory(name);
        let pose = scene.start_pose();
        for offset in [Vec3::new(0.7, 1.1, 0.0), Vec3::new(-0.9, 0.4, 0.2)] {
            let params = BlockParams::default();
            let own = alone(&scene, &click, offset, &params, |_| pose);
            let shared = play(&mut with_further(&scene, 1), &silence, &[(&click, offset)], &[512], &params, |_| pose);
            let late = at + FRAME + 3_840;
            let level = |ears: &[Vec<f32>; 2], hz: f64| {
                let energy = |ear: &[f32]| octave_of(&ear[late..], RATE, hz).iter().map(|x| f64::from(x * x)).sum::<f64>();
                10.0 * (energy(&ears[0]) + energy(&ears[1])).log10()
            };
            let octaves = [125.0, 250.0, 500.0, 1e3, 2e3, 4e3, 8e3].map(|hz| level(&shared, hz) - level(&own, hz));
            let c50 = |ears: &[Vec<f32>; 2]| c50_db(&ears[0][at..], RATE).unwrap();
            let clarity = c50(&shared) - c50(&own);
            println!("{name} {offset}: octaves {octaves:.1?} dB, C50 {clarity:.2} dB");
            assert!(octaves.iter().all(|db| db.abs() < octave_bar), "{name} {offset}: {octaves:.1?}");
            assert!(clarity.abs() < c50_bar, "{name} {offset}: {clarity:.2} dB");
        }
    }
}

#[test]
fn sources_add_up_in_one_room_and_a_reset_is_as_new() {
    let scene = room_with_images(RATE, 0.5, 0.1, 12);
    let inputs: Vec<_> = (0..4).map(|seed| noise(seed, 30_000)).collect();
    let places = [Vec3::ZERO, Vec3::new(0.5, 0.0, 0.0), Vec3::new(0.0, -1.0, 0.3), Vec3::new(-0.4, 0.9, 0.0)];
    let silence = vec![0.0; 30_000];
    let params = BlockParams { mix: 0.8, ..BlockParams::default() };
    let mut s = with_further(&scene, 3);
    let mut of = |which: &dyn Fn(usize) -> bool| {
        s.reset();
        let sound = |i: usize| if which(i) { &inputs[i][..] } else { &silence[..] };
        let further: Vec<_> = (1..4).map(|i| (sound(i), places[i])).collect();
        play(&mut s, sound(0), &further, &[300], &params, walk(RATE))
    };
    let together = of(&|_| true);
    assert_eq!(first_difference(&of(&|_| true), &together), None);
    let mut sum = [silence.clone(), silence.clone()];
    for one in 0..4 {
        for (sum, ear) in sum.iter_mut().zip(of(&|i| i == one)) {
            sum.iter_mut().zip(ear).for_each(|(sum, x)| *sum += x);
        }
    }
    let db = difference_db(&together, &sum);
    assert!(db < -110.0, "{db} dB");
}

#[test]
fn a_further_source_falls_silent_and_wakes_where_the_listener_is() {
    let scene = room(RATE, 0.3, 0.1);
    let mut input = noise(7, 6_000);
    input.resize(150_000, 0.0);
    input[144_000] = 1.0;
    let silence = vec![0.0; input.len()];
    let (offset, params) = (Vec3::new(0.3, 0.3, 0.0), BlockParams::default());
    // It walks away and comes back.
    let away = |i: usize| if i > 100_000 { walk(RATE)(120_000) } else { walk(RATE)(i) };
    let found = play(&mut with_further(&scene, 1), &silence, &[(&input, offset)], &[512], &params, away);
    assert!(found.iter().all(|ear| ear[140_000..144_000].iter().all(|x| *x == 0.0)), "ends exactly");
    let wanted = alone(&scene, &input, offset, &params, away);
    let db = early_difference_db(&wanted, &found, &[144_000]);
    assert!(db < -80.0, "{db} dB");
}

/// Every latency has all voices: each is heard as it would be by itself, but for what comes later, and so much earlier.
#[test]
fn voices_with_a_short_latency_are_those_of_an_instance_of_their_own() {
    let clicks = [48_001, 96_017, 144_000];
    let mut input = vec![0.0; 150_000];
    clicks.iter().for_each(|at| input[*at] = 1.0);
    let silence = vec![0.0; input.len()];
    let offset = Vec3::new(-0.6, 0.8, 0.1);
    for (name, scene) in
        [("noise", room(RATE, 0.15, 0.1)), ("images", room_with_images(RATE, 0.15, 0.1, 12)), ("loft", factory("loft"))]
    {
        let pose = scene.start_pose();
        for latency in [Latency::Samples64, Latency::None] {
            let engine = |voices: usize| {
                let mut s = Spatializer::new(RATE);
                let config = RendererConfig { latency, voices, ..RATE.into() };
                s.install(Box::new(Renderer::new(Arc::clone(&scene), config).unwrap()));
                s
            };
            let params = BlockParams::default();
            let own = BlockParams { emitters: EmitterParams { offset, spread: 0.0 }, ..params };
            let wanted = play(&mut engine(1), &input, &[], &[512], &own, |_| pose);
            let found = play(&mut engine(3), &silence, &[(&silence, Vec3::X), (&input, offset)], &[512, 33], &params, |_| pose);
            let early = |ears: &[Vec<f32>; 2]| {
                ears.each_ref().map(|ear| clicks.iter().flat_map(|at| &ear[*at..at + OWN]).copied().collect::<Vec<f32>>())
            };
            let db = difference_db(&early(&wanted), &early(&found));
            assert!(db < -80.0, "{name}, latency {}: {db} dB", latency.name());
        }
    }
}

/// A voice has a level of its own, may be muted, and switched off, which leaves nothing of it.
#[test]
fn voices_have_levels_and_are_muted_and_switched_off() {
    let scene = room_with_images(RATE, 0.15, 0.1, 12);
    let input = noise(7, 96_000);
    let pose = scene.start_pose();
    let heard = |of: &dyn Fn(usize) -> Voice<'static>| {
        let mut s = with_further(&scene, 1);
        let mut out = [vec![0.0; input.len()], vec![0.0; input.len()]];
        for at in (0..input.len()).step_by(480) {
            let [left, right] = &mut out;
            let (left, right) = (&mut left[at..at + 480], &mut right[at..at + 480]);
            let voice = Voice { input: &input[at..at + 480], ..of(at) };
            s.process(&[&[0.0; 480]], &[voice], [left, right], &BlockParams::default(), |_| pose);
        }
        out
    };
    let plain = heard(&|_| Voice::default());
    let half = heard(&|_| Voice { level: 0.5, ..Voice::default() });
    let doubled = half.each_ref().map(|ear| ear.iter().map(|x| 2.0 * x).collect());
    assert!(difference_db(&plain, &doubled) < -120.0);
    let silent = |ears: &[Vec<f32>; 2], from: usize| ears.iter().all(|ear| ear[from..].iter().all(|x| *x == 0.0));
    assert!(silent(&heard(&|_| Voice { mute: true, ..Voice::default() }), 0));
    assert!(silent(&heard(&|_| Voice { off: true, ..Voice::default() }), 0));
    let until = |at: usize| at < 48_000;
    let muted = heard(&|at| Voice { mute: !until(at), ..Voice::default() });
    let off = heard(&|at| Voice { off: !until(at), ..Voice::default() });
    // A muted voice's reflections go on, those of one that is switched off end with a frame; the room that is shared goes on.
    let energy = |ears: &[Vec<f32>; 2], from: usize| ears[0][from..from + 2_400].iter().map(|x| x * x).sum::<f32>();
    assert!(energy(&off, 49_500) < 0.5 * energy(&muted, 49_500) && energy(&off, 49_500) > 0.0);
    let again = heard(&|at| Voice { off: (24_000..48_000).contains(&at), ..Voice::default() });
    let end = |ears: &[Vec<f32>; 2]| ears.each_ref().map(|ear| ear[80_000..].to_vec());
    assert!(difference_db(&end(&plain), &end(&again)) < -60.0);
}

/// What nobody hears is not worked out, be it sound or silence. The least times of many spans are compared.
#[test]
fn a_muted_voice_with_sound_costs_what_a_silent_one_does() {
    let scene = room_with_images(RATE, 0.15, 0.1, 12);
    let pose = scene.start_pose();
    let (sound, silence) = (noise(9, 4_096), vec![0.0; 4_096]);
    let [muted, heard, silent] = [(&sound, true), (&sound, false), (&silence, false)].map(|(input, mute)| {
        let mut s = with_further(&scene, 24);
        let mut out = [silence.clone(), silence.clone()];
        let spans = (0..60).map(|_| {
            let started = Instant::now();
            let [left, right] = &mut out;
            let voices = [Voice { input, mute, ..Voice::default() }; 24];
            s.process(&[&silence], &voices, [left, right], &BlockParams::default(), |_| pose);
            started.elapsed()
        });
        // It falls asleep first.
        spans.skip(20).min().unwrap()
    });
    println!("24 voices, 4,096 samples: muted {muted:?}, silent {silent:?}, heard {heard:?}");
    assert!(muted < silent.mul_f64(1.5) && heard > silent.mul_f64(2.0), "{muted:?}, {silent:?}, {heard:?}");
}

#[test]
fn the_dry_sound_of_a_further_voice_glides_to_its_level() {
    let scene = room(RATE, 0.3, 0.1);
    let mut s = with_further(&scene, 1);
    let (silence, sound) = ([0.0; 480], [0.5; 480]);
    let params = BlockParams { mix: 0.0, ..BlockParams::default() };
    let mut heard = Vec::new();
    for block in 0..40 {
        let mut ears = [[0.0; 480]; 2];
        let voice = Voice { input: &sound, mute: block >= 20, ..Voice::default() };
        let [left, right] = &mut ears;
        s.process(&[&silence], &[voice], [left, right], &params, |_| Pose::IDENTITY);
        heard.extend(ears[0]);
    }
    let steady = &heard[4_800..];
    let step = steady.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f32::max);
    assert!((steady[0] - 0.5).abs() < 1e-3 && *steady.last().unwrap() == 0.0 && step < 0.02, "a step of {step}");
}
