//! The factory scenes meet their accuracy at poses they were not baked from, on what the render head puts out.

use promenade_baker::measure::{MeanErrors, compare_held_out};
use promenade_baker::{BakeOptions, CONTENT, Levels, Response, Responses, bake_responses};
use promenade_core::glam::Vec3;
use promenade_core::random::Random;
use promenade_core::{FrontPoint, Pose, RenderParams, Renderer, Rows, Scene};
use promenade_metrics::{DecayRange, decay_time_s, ild_db, itd_s};
use promenade_player::{Player, Playing, render_response};
use std::path::Path;
use std::sync::Arc;

fn factory(name: &str) -> Arc<Scene> {
    let path = format!("{}/../../presets/scenes/{name}.promenade", env!("CARGO_MANIFEST_DIR"));
    Arc::new(Scene::from_bytes(&std::fs::read(&path).unwrap()).unwrap())
}

#[test]
fn held_out_errors_are_below_a_just_noticeable_difference() {
    for (name, seconds) in [("iosr-room-a", 0.39), ("iosr-room-b", 1.0)] {
        let scene = factory(name);
        let comparisons = compare_held_out(&scene, seconds).unwrap();
        assert_eq!(comparisons.len(), 18);
        let e = MeanErrors::of(&comparisons).unwrap();
        println!("{name}: {e:?}");
        // The nearest measurement is 38 us, 0.6 dB, 1.3 to 1.6 % and 0.15 to 0.23 dB off.
        assert!(e.itd_s <= 6e-6 && e.ild_db <= 0.2 && e.t20.unwrap() <= 0.016 && e.c50_db.unwrap() <= 0.21, "{name}: {e:?}");
    }
}

#[test]
fn the_direct_sound_follows_the_head_and_the_distance() {
    let scene = factory("iosr-room-b");
    let at = |x: f32, y: f32, yaw_deg: f32| Pose::from_ypr(on_the_floor(x, y), yaw_deg.to_radians(), 0.0, 0.0);
    let rate = scene.grid().sample_rate_hz;
    let measure = |pose: Pose| {
        let [left, right] = render_response(&scene, pose, 400, 8_000).unwrap();
        let energy = |from: usize, to: usize| (from..to).map(|i| left[i].powi(2) + right[i].powi(2)).sum::<f32>();
        let (direct, late) = (energy(380, 440), energy(400 + 1_600, 8_000));
        (itd_s(&left, &right, rate).unwrap(), ild_db(&left, &right).unwrap(), direct, late)
    };
    let ahead = measure(at(0.0, 0.0, 0.0));
    let source_right = measure(at(0.0, 0.0, 60.0));
    assert!(source_right.0 > 300e-6 && source_right.1 < -3.0, "turned left, the source is on the right: {source_right:?}");
    let source_left = measure(at(0.0, 0.0, -60.0));
    assert!(source_left.0 < -300e-6 && source_left.1 > 3.0, "{source_left:?}");
    let walked_past = measure(at(1.5, 1.5, 0.0));
    assert!(walked_past.0 > 300e-6, "beside the source, it is on the right: {walked_past:?}");
    let behind = measure(at(0.0, 0.0, 180.0));
    assert!(behind.0.abs() < 150e-6, "{behind:?}");
    let far = measure(at(-4.5, 0.0, 0.0));
    let fall_db = 10.0 * (far.2 / ahead.2).log10();
    assert!((fall_db + 20.0 * 4.0_f32.log10()).abs() < 1.5, "four times as far is 12 dB less direct sound: {fall_db}");
    assert!((10.0 * (far.3 / ahead.3).log10()).abs() < 0.5, "the late part stays");
}

#[test]
fn above_the_data_the_brightness_follows_the_head_without_jumps() {
    let rate = 48_000.0;
    for name in ["iosr-room-a", "iosr-room-b"] {
        let scene = factory(name);
        let brightness = |yaw_deg: f32| {
            let pose = Pose::from_ypr(on_the_floor(0.0, 0.0), yaw_deg.to_radians(), 0.0, 0.0);
            let [left, _] = Player::new(&scene, rate, Playing::Stream).unwrap().render(&impulse(), &mut |_| pose).unwrap();
            let spectrum = promenade_fourier::spectrum(left.iter().map(|v| f64::from(*v)), 16_384);
            let energy = |from: f64, to: f64| {
                let bins = (from / rate * 16_384.0) as usize..(to / rate * 16_384.0) as usize;
                spectrum[bins.clone()].iter().map(|x| x.norm_sqr()).sum::<f64>() / bins.len() as f64
            };
            10.0 * (energy(8e3, 16e3) / energy(1e3, 4e3)).log10()
        };
        let levels: Vec<f64> = (-8..9).map(|i| brightness(5.0 * i as f32)).collect();
        let largest = levels.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f64::max);
        // With the last bin's level held it jumped by up to 5 dB in 5 degrees.
        assert!(largest < 1.5, "{name}: {largest:.1} dB in 5 degrees: {levels:.1?}");
    }
}

#[test]
fn the_same_at_every_host_rate() {
    for name in ["iosr-room-a", "iosr-room-b"] {
        let scene = factory(name);
        assert_eq!(scene.playable_at(768_000.0), Ok(()));
        for rate in [8_000.0, 22_050.0, 44_100.0, 48_000.0, 96_000.0, 192_000.0] {
            let mut renderer = Renderer::new(Arc::clone(&scene), rate).unwrap();
            let latency = renderer.latency_samples();
            assert!(latency as f64 / rate <= 1024.0 / 48_000.0);
            let mut input = vec![0.0; rate as usize];
            input[1000] = 1.0;
            let mut ears = [vec![0.0; input.len()], vec![0.0; input.len()]];
            let pose = Pose::from_ypr(on_the_floor(0.0, 0.0), 0.6, 0.0, 0.0);
            let [left, right] = &mut ears;
            renderer.process(&[input[..].into()], [left, right], RenderParams::default(), &mut |_| pose);
            let itd = itd_s(&ears[0], &ears[1], rate).unwrap();
            let native = {
                let [l, r] = render_response(&scene, pose, 400, 8_000).unwrap();
                itd_s(&l, &r, scene.grid().sample_rate_hz).unwrap()
            };
            assert!((itd - native).abs() < 25e-6, "{name} at {rate}: {itd} against {native}");
        }
    }
}

/// Costs are counts, so that a front that belongs to another scene is seen.
#[test]
fn factory_scenes_carry_their_own_fronts() {
    for name in ["iosr-room-a", "iosr-room-b", "loft", "box"] {
        let scene = factory(name);
        let (front, whole) = (&scene.parts().front, scene.operations(48_000.0));
        assert_eq!((front[0].error.jnds, front[0].cost), (0.0, 1.0), "{name}: {front:?}");
        assert!(front.windows(2).all(|p| p[0].cost > p[1].cost && p[0].error.jnds < p[1].error.jnds), "{name}: {front:?}");
        for point in front {
            let cost = scene.with_setting(point.setting).unwrap().operations(48_000.0) / whole;
            assert!((cost - f64::from(point.cost)).abs() < 1e-3, "{name}: {point:?} costs {cost}; presets/recipes/factory.py");
        }
        let cheapest = FrontPoint::within(front, 2.0).unwrap();
        assert!(cheapest.cost < 0.75, "{name}: {cheapest:?}");
    }
}

fn on_the_floor(x: f32, y: f32) -> promenade_core::glam::Vec3 {
    promenade_core::glam::Vec3::new(x, y, 0.0)
}

fn impulse() -> Vec<f32> {
    let mut impulse = vec![0.0; 12_000];
    impulse[480] = 1.0;
    impulse
}

#[test]
fn places_of_the_library_can_be_walked_in_and_sound_as_they_are_called() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../presets/library");
    let files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    let scenes: Vec<_> = files.iter().filter(|file| file.extension().is_some_and(|e| e == "promenade")).collect();
    let mut bytes = 0;
    for file in &scenes {
        let content = std::fs::read(file).unwrap();
        bytes += content.len();
        let scene = Arc::new(Scene::from_bytes(&content).unwrap());
        let (low, high) = scene.bounds();
        assert!(scene.images().is_some() && high.x - low.x > 1.0 && scene.grid().sample_rate_hz == 48_000.0, "{file:?}");
        assert!(scene.credit().contains("Gardner") && !scene.licence().is_empty(), "{file:?}");
        assert!(file.with_extension("png").is_file() && file.with_extension("obj").is_file(), "{file:?}");
        let range = match file.file_stem().and_then(|stem| stem.to_str()) {
            Some("dry-studio") => 0.04..0.2,
            Some("living-room") => 0.4..0.8,
            Some("cathedral") => 4.0..10.0,
            _ => continue,
        };
        let length = (48_000.0 * 1.2 * range.end) as usize;
        let [left, _] = render_response(&scene, scene.start_pose(), 480, length).unwrap();
        let t20 = decay_time_s(&left, 48_000.0, DecayRange::T20).unwrap();
        assert!(range.contains(&t20), "{file:?}: {t20} s");
    }
    assert!(scenes.len() >= 10 && bytes < 15_000_000, "{} scenes, {bytes} bytes", scenes.len());
}

/// Energies of what a scene holds, and what it is played by.
fn content(scene: &Scene) -> Vec<f64> {
    let (parts, measured) = (scene.parts(), scene.measured().unwrap());
    let Some(Rows::Whole(rows)) = scene.parts().field.as_ref().map(|field| field.rows()) else { panic!("a table") };
    let energy = |values: &[f32]| values.iter().map(|v| f64::from(v * v)).sum::<f64>();
    let sizes = [measured.sites.len(), measured.low_hops, parts.taps, rows.len()].map(|size| size as f64);
    let values = [rows, &measured.samples, &measured.low, &measured.late, &measured.late_before, &parts.tail.t60_s];
    sizes.into_iter().chain(values.map(|values| energy(values))).collect()
}

fn alike(found: &[f64], wanted: &[f64]) -> bool {
    found.len() == wanted.len() && found.iter().zip(wanted).all(|(f, w)| (f / w - 1.0).abs() < 2e-3)
}

#[test]
fn the_same_responses_make_the_same_content() {
    let response = |i: u16| {
        let listener = Pose::from_ypr(Vec3::ZERO, f32::from(30 * i).to_radians(), 0.0, 0.0);
        let side = listener.to_head(Vec3::X).y;
        let [left, right] = [1.0, -1.0].map(|ear: f32| -> Vec<f32> {
            let mut random = Random::new(u64::from(2 * i) + u64::from(ear > 0.0));
            let mut samples: Vec<f32> = (0..6_000).map(|n| 0.1 * random.normal() * (-(n as f32) / 900.0).exp()).collect();
            samples[..100].fill(0.0);
            samples[40 - (4.0 * ear * side) as usize] = 1.0 + 0.5 * ear * side;
            samples
        });
        Response { listener, source: 2.0 * Vec3::X, left, right, name: i.to_string() }
    };
    let responses = (0..12).map(response).collect();
    let set = Responses { sample_rate_hz: 16_000.0, responses, levels: Some(Levels::Measured), ..Responses::default() };
    let found = content(&bake_responses(&set, |_, _| false, &BakeOptions::default()).unwrap());
    let wanted = [24.0, 66.0, 40.0, 147_528.0, 44_127.0, 27.9736, 2.27762, 0.074_195_6, 658.53, 2.97426];
    let what = "count bake::CONTENT up, and make the factory scenes again: presets/recipes/factory.py";
    assert!(alike(&found, &wanted), "{what}\n{found:?}");
}

#[test]
fn the_factory_scenes_are_of_this_content() {
    for name in ["iosr-room-a", "iosr-room-b"] {
        let provenance = factory(name).provenance().clone();
        let recipe = format!("promenade bake responses {name}.json --hold-out azimuth=-85..85/10 --window-ms 20 --seed 1");
        assert_eq!(provenance.recipe, recipe);
        let what = "make it again: presets/recipes/factory.py";
        assert!(provenance.notes.iter().any(|note| note == CONTENT), "{what}: {:?}", provenance.notes);
    }
}

mod needs_shared {
    use super::*;
    use promenade_baker::{HoldOut, LoadOptions};
    use promenade_testing::shared;

    #[test]
    #[ignore = "needs ../shared"]
    fn the_factory_scenes_are_what_their_recipes_make() {
        for name in ["iosr-room-a", "iosr-room-b"] {
            let recipe = format!("{}/../../presets/recipes/{name}.json", env!("CARGO_MANIFEST_DIR"));
            let options = LoadOptions { root: Some(shared("data/iosr_brir")), ..LoadOptions::default() };
            let set = Responses::load(Path::new(&recipe), &options).unwrap();
            let held_out = HoldOut::parse("azimuth=-85..85/10").unwrap();
            let options = BakeOptions { recipe: factory(name).provenance().recipe.clone(), ..BakeOptions::default() };
            let made = bake_responses(&set, |response, index| held_out.selects(response, index), &options).unwrap();
            let shipped = factory(name);
            assert_eq!(made.provenance(), shipped.provenance(), "presets/recipes/factory.py");
            let contents = [&made, &*shipped].map(content);
            assert!(alike(&contents[0], &contents[1]), "{name}: {contents:?}");
            // Rounding differs with the processor.
            let samples = [&made, &*shipped].map(|scene| scene.measured().unwrap().samples.clone());
            let apart = samples[0].iter().zip(&samples[1]).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>();
            assert!(apart < 1e-6 * contents[1][5], "{name}: {apart}");
        }
    }
}
