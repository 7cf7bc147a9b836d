//! A minute of the knob Accuracy from end to end, in every scene that is shipped.

use assert_no_alloc::assert_no_alloc;
use promenade_core::glam::Vec3;
use promenade_core::{
    BlockParams, Carriers, Emitters, FrontPoint, Pose, Renderer, RendererConfig, Scene, Setting, Spatializer,
};
use promenade_testing::hostile::is_output;
use promenade_testing::noise;
use std::f64::consts::TAU;
use std::path::Path;
use std::sync::Arc;

const RATES_HZ: [f64; 5] = [8_000.0, 44_100.0, 48_000.0, 96_000.0, 192_000.0];
/// One for each second, again and again.
const BLOCKS: [usize; 8] = [8_192, 1, 512, 31, 64, 4_099, 7, 1_024];
/// Each scene is played for a minute at one of the rates, in turn, and shorter at the others, seconds.
const WHOLE_S: [f64; 2] = [60.0, 6.0];
const TONE_HZ: f64 = 220.0;
/// Shares of a tone, then of noise that is 200 dB too loud, then of what is no number.
const TONE: f64 = 4.0 / 6.0;
const LOUD: f64 = 5.0 / 6.0;
/// Time between turns, seconds.
const TURNED_S: f64 = 0.05;
/// Before that filters settle, seconds.
const SETTLED_S: f64 = 1.0;

fn shipped() -> Vec<(String, Arc<Scene>)> {
    let presets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../presets");
    let files = ["scenes", "library"].map(|folder| std::fs::read_dir(presets.join(folder)).unwrap());
    let mut paths: Vec<_> = files.into_iter().flatten().map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|ending| ending == "promenade"));
    paths.sort();
    let scene = |path: &Path| Arc::new(Scene::from_bytes(&std::fs::read(path).unwrap()).unwrap());
    paths.iter().map(|path| (path.file_stem().unwrap().to_str().unwrap().to_owned(), scene(path))).collect()
}

/// All of a scene, and the least that its front plays.
fn ends(scene: &Arc<Scene>) -> [Arc<Scene>; 2] {
    let cheapest = scene.parts().front.iter().min_by(|a, b| a.cost.total_cmp(&b.cost));
    let least = Setting { taps: 12, images: 2, order: 0, refresh: 4, ..Setting::ALL };
    let least = cheapest.map_or(least, |point: &FrontPoint| point.setting);
    [Arc::clone(scene), Arc::new(scene.with_setting(least).unwrap())]
}

/// There and back at half a metre a second while the head turns.
fn walk(scene: &Scene, seconds: f64) -> Pose {
    let (start, seconds) = (scene.start_pose(), seconds as f32);
    let along = 0.25 * ((seconds + 1.0).rem_euclid(4.0) - 2.0).abs() - 0.25;
    Pose::from_ypr(start.position + along * Vec3::X, start.ypr().0 + 0.5 * seconds, 0.0, 0.0)
}

fn tone(rate: f64, seconds: f64) -> Vec<f32> {
    let at = |i: usize| (0.2 * (TAU * TONE_HZ * i as f64 / rate).sin()) as f32;
    (0..(seconds * rate) as usize).map(at).collect()
}

fn hostile(rate: f64, seconds: f64) -> Vec<f32> {
    let mut input = tone(rate, seconds);
    let [loud, broken] = [TONE, LOUD].map(|share| (share * seconds * rate) as usize);
    let noise = noise(7, broken - loud);
    input[loud..broken].iter_mut().zip(noise).for_each(|(x, noise)| *x = 1e10 * noise);
    input[broken..].iter_mut().step_by(2).for_each(|x| *x = f32::NAN);
    input
}

/// Plays a sound while the ends take turns. Returns both ears and how often the knob was turned.
fn play(ends: &[Arc<Scene>; 2], rate: f64, input: &[f32]) -> ([Vec<f32>; 2], usize) {
    let made = |scene: &Arc<Scene>| -> [Box<Emitters>; 2] {
        let carriers = Some(Arc::new(Carriers::new(scene, rate)));
        [(); 2].map(|()| {
            let config = RendererConfig { carriers: carriers.clone(), ..RendererConfig::inline(scene, rate, 1) };
            Box::new(Renderer::new(Arc::clone(scene), config).unwrap().into())
        })
    };
    let mut ready: Vec<Vec<Box<Emitters>>> = ends.iter().map(|scene| made(scene).into()).collect();
    let mut s = Spatializer::new(rate);
    let first = ready[0].pop().unwrap();
    s.swap_in(first).unwrap_or_else(|_| panic!("nothing plays yet"));
    let (mut turns, mut next, mut at) = (0, TURNED_S * rate, 0);
    let mut ears = [vec![0.0; input.len()], vec![0.0; input.len()]];
    while at < input.len() {
        let size = BLOCKS[(at as f64 / rate) as usize % BLOCKS.len()].min(input.len() - at);
        let [left, right] = ears.each_mut().map(|ear| &mut ear[at..at + size]);
        assert_no_alloc(|| {
            if at as f64 >= next
                && s.is_free()
                && let Some(emitters) = ready[(turns + 1) % 2].pop()
            {
                (turns, next) = (turns + 1, at as f64 + TURNED_S * rate);
                assert!(s.swap_in_sounding(emitters).is_ok());
            }
            s.process(&[&input[at..at + size]], &[], [left, right], &BlockParams::default(), |i| {
                walk(&ends[0], (at + i) as f64 / rate)
            });
            if let Some(mut retired) = s.take_retired() {
                retired.reset();
                let end = usize::from(!Arc::ptr_eq(retired.renderer().scene(), &ends[0]));
                ready[end].push(retired);
            }
        });
        at += size;
    }
    (ears, turns)
}

/// The largest second difference of a tone after it has settled: that of a click is far larger.
fn bend(ears: &[Vec<f32>; 2], rate: f64, until_s: f64) -> f32 {
    let [from, to] = [SETTLED_S, until_s].map(|seconds| (seconds * rate) as usize);
    let of = |ear: &Vec<f32>| ear[from..to].windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs()).fold(0.0, f32::max);
    of(&ears[0]).max(of(&ears[1]))
}

#[test]
#[ignore = "takes minutes"]
fn a_minute_of_the_knob_in_every_shipped_scene() {
    let scenes = shipped();
    assert!(scenes.len() >= 15, "{}", scenes.len());
    let mut wrong = Vec::new();
    for (number, (name, scene)) in scenes.into_iter().enumerate() {
        let ends = ends(&scene);
        for (turn, rate) in RATES_HZ.into_iter().enumerate() {
            let seconds = WHOLE_S[usize::from(turn != number % RATES_HZ.len())];
            let (ears, turns) = play(&ends, rate, &hostile(rate, seconds));
            assert!(ears.iter().flatten().copied().all(is_output), "{name} at {rate} Hz: an output that is none");
            // Each end in place of itself, at the same times: what a change of the scene makes.
            let same = |end: &Arc<Scene>| {
                let again = Arc::new(end.with_setting(Setting::ALL).unwrap());
                bend(&play(&[Arc::clone(end), again], rate, &tone(rate, TONE * seconds)).0, rate, TONE * seconds)
            };
            let changed = ends.iter().map(same).fold(0.0, f32::max);
            let turned = bend(&ears, rate, TONE * seconds);
            println!("{name} at {rate} Hz, {seconds} s: {turns} turns, bend {:.2} of a change of the scene", turned / changed);
            if !(turned <= 1.1 * changed && changed > 0.0) || turns < 3 {
                wrong.push(format!("{name} at {rate} Hz: {turns} turns, {turned} and {changed} at a change of the scene"));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
