//! What is left of a scene, and what is heard of that.

use assert_no_alloc::assert_no_alloc;
use promenade_core::{
    Audible, BlockParams, Emitters, FrontPoint, ImageSource, Measure, Pose, Renderer, Scene, SceneParts, Setting, glam::Vec3,
};
use promenade_testing::hostile::is_output;
use promenade_testing::noise;
use promenade_testing::scenes::{
    played_by, render, room, room_of_responses, room_with_cloud, room_with_images, spatializer, walk,
};
use std::sync::Arc;

const RATE: f64 = 16_000.0;

fn kept(scene: &Scene, setting: Setting) -> Arc<Scene> {
    Arc::new(scene.with_setting(setting).unwrap())
}

fn heard(scene: &Arc<Scene>, input: &[f32], pose_at: impl Fn(usize) -> Pose) -> [Vec<f32>; 2] {
    render(&mut spatializer(scene, RATE), input, &[512], &BlockParams::default(), pose_at)
}

/// Level of the difference over that of the second, dB.
fn difference_db(of: &[Vec<f32>; 2], other: &[Vec<f32>; 2], from: usize) -> f64 {
    let energy = |values: &mut dyn Iterator<Item = f32>| values.map(|v| f64::from(v * v)).sum::<f64>();
    let pairs = || of.iter().zip(other).flat_map(|(a, b)| a[from..].iter().zip(&b[from..]));
    10.0 * (energy(&mut pairs().map(|(a, b)| a - b)) / energy(&mut pairs().map(|(_, b)| *b))).log10()
}

#[test]
fn all_of_a_scene_is_the_scene() {
    for scene in [room_with_images(RATE, 0.4, 0.1, 12), room_of_responses(RATE).0] {
        assert_eq!(*kept(&scene, Setting::ALL), *scene);
        assert_eq!(*kept(&scene, Setting::default().of(&scene)), *scene);
    }
}

#[test]
fn a_setting_keeps_what_it_says_and_the_rest_stays() {
    let scene = room_with_images(RATE, 0.5, 0.05, 8);
    let all = Setting::ALL.of(&scene);
    assert_eq!((all.taps, all.images, all.order, all.refresh, all.waves), (24, 8, 3, 1, false));
    let few = kept(&scene, Setting { images: 4, ..all });
    // What goes leaves its energy to what is heard at about the same time.
    let energy = |images: &[ImageSource]| -> f32 {
        images.iter().map(|image| (image.gains[2] / image.position.distance(scene.start_pose().position)).powi(2)).sum()
    };
    let (kept_images, whole) = (&few.images().unwrap().images, &scene.images().unwrap().images);
    assert_eq!(kept_images.len(), 4);
    assert!((energy(kept_images) / energy(whole) - 1.0).abs() < 1e-3, "{} {}", energy(kept_images), energy(whole));
    assert_eq!(kept_images[0], whole[0], "the farthest of them is the nearest to all that go");
    assert_eq!(few.field(), scene.field());
    let least = kept(&scene, Setting { taps: 0, images: 0, order: 0, refresh: 9, waves: true, decodes: 0 });
    let found = Setting::ALL.of(&least);
    assert_eq!((found.taps, found.images, found.order, found.refresh), (11, 1, 0, Setting::SLOWEST));
    // It comes back from a file.
    let parts = SceneParts { decodes: 7, ..least.parts().clone() };
    let least = Scene::new(parts).unwrap();
    assert_eq!(Scene::from_bytes(&least.to_bytes().unwrap()).unwrap(), least);
}

#[test]
fn a_front_comes_back_from_a_file_and_stays_with_all_of_the_scene_alone() {
    let scene = room_with_images(RATE, 0.5, 0.05, 8);
    let all = Setting::ALL;
    let point = |setting, jnds, measure| FrontPoint { setting, error: Audible { jnds, measure }, cost: 1.0 - 0.25 * jnds };
    let front = vec![point(all, 0.0, Measure::Levels), point(Setting { taps: 9, order: 1, ..all }, 0.5, Measure::Modulation)];
    let scene = Scene::new(SceneParts { front: front.clone(), ..scene.parts().clone() }).unwrap();
    let read = Scene::from_bytes(&scene.to_bytes().unwrap()).unwrap();
    assert_eq!(read.parts().front, front);
    assert!(kept(&read, front[1].setting).parts().front.is_empty(), "errors are to the scene that it was");
    let wrong = SceneParts { front: vec![point(all, f32::NAN, Measure::Itd)], ..scene.parts().clone() };
    assert!(Scene::new(wrong).unwrap_err().to_string().contains("front"));
}

#[test]
fn a_cloud_that_is_not_decoded_leaves_its_table() {
    let scene = room_with_cloud(RATE, 0.3, 0.1);
    let table = kept(&scene, Setting { decodes: 0, ..Setting::ALL });
    assert!(table.cloud().is_none() && table.parts().decodes == usize::MAX);
    assert_eq!(table.parts().field, played_by(&scene, None).parts().field);
    // Without a table it is decoded all the same.
    let mut parts = scene.parts().clone();
    parts.field = None;
    let bare = Scene::new(parts).unwrap();
    assert_eq!(Setting { decodes: 0, ..Setting::ALL }.of(&bare).decodes, 1);
    assert!(kept(&bare, Setting { decodes: 0, ..Setting::ALL }).cloud().is_some());
}

#[test]
fn a_late_part_that_begins_earlier_has_the_level_that_decays_to_the_old_one() {
    let scene = room(RATE, 0.5, 0.05);
    let fewer = kept(&scene, Setting { taps: 12, ..Setting::ALL });
    let pose = scene.start_pose();
    let (old, new) = (scene.field().unwrap().decode(&pose), fewer.field().unwrap().decode(&pose));
    let hops = 12.0 * scene.grid().hop_s() as f32;
    for ((old, new), t60) in old.late.iter().zip(&new.late).zip(scene.tail().t60_s.iter().cycle()) {
        let decayed = new * 10.0_f32.powf(-3.0 * hops / t60);
        assert!((decayed / old - 1.0).abs() < 1e-3, "{decayed} {old}");
    }
    assert_eq!(new.taps, old.taps[..new.taps.len()]);
}

#[test]
fn images_in_a_lower_order_are_as_loud() {
    let mut parts = room_with_images(RATE, 0.2, 0.0, 20).parts().clone();
    // A head whose ears are cardioids to its sides.
    let images = parts.images.as_mut().unwrap();
    let length = images.head.len();
    images.head.filters.fill(0.0);
    for ear in 0..2 {
        images.head.filters[ear * length] = 0.5;
        images.head.filters[(2 + ear) * length] = [0.5, -0.5][ear] / 3.0_f32.sqrt();
        images.head.filters[(2 * 8 + ear) * length] = 0.1;
    }
    let scene = Arc::new(Scene::new(parts).unwrap());
    assert_eq!(scene.images().unwrap().head.order(), 2);
    let input = noise(3, 16_000);
    let whole = heard(&scene, &input, |_| Pose::IDENTITY);
    let level = |ears: &[Vec<f32>; 2]| ears.each_ref().map(|ear| 10.0 * ear.iter().map(|v| v * v).sum::<f32>().log10());
    for order in [0, 1] {
        let lower = kept(&scene, Setting { order, ..Setting::ALL });
        assert_eq!(lower.images().unwrap().head.order(), order);
        let found = heard(&lower, &input, |_| Pose::IDENTITY);
        for (found, wanted) in level(&found).iter().zip(level(&whole)) {
            assert!((found - wanted).abs() < 1.5, "order {order}: {found} dB, not {wanted} dB");
        }
        assert!(order == 0 || difference_db(&found, &whole, 0) < -12.0, "{}", difference_db(&found, &whole, 0));
    }
}

#[test]
fn filters_that_follow_slowly_are_those_of_the_pose_once_the_listener_stands() {
    let scene = room(RATE, 0.3, 0.1);
    let slow = kept(&scene, Setting { refresh: 4, ..Setting::ALL });
    let input = noise(5, 48_000);
    let stops = |i: usize| if i < 16_000 { walk(RATE)(i) } else { Pose::from_ypr(Vec3::new(0.3, 0.2, 0.0), 0.7, 0.0, 0.0) };
    let [a, b] = [&scene, &slow].map(|scene| heard(scene, &input, stops));
    let (moving, standing) = (difference_db(&b, &a, 0), difference_db(&b, &a, 30_000));
    assert!(moving > -60.0, "{moving} dB: it follows as fast");
    assert!(standing < -100.0, "{standing} dB: it never arrives");
}

#[test]
fn a_knob_that_is_turned_all_the_time_clicks_no_more_than_it_must_and_allocates_nothing() {
    let scene = room_with_images(RATE, 0.3, 0.1, 20);
    let all = Setting::ALL;
    let least = Setting { taps: 12, images: 2, order: 0, refresh: 4, ..all };
    let settings = [all, Setting { taps: 18, images: 10, order: 2, ..all }, Setting { images: 5, order: 1, ..all }, least];
    let emitters = |setting: Setting| -> Box<Emitters> { Box::new(Renderer::new(kept(&scene, setting), RATE).unwrap().into()) };
    let tone: Vec<f32> = (0..80_000).map(|i| 0.2 * (i as f32 * 0.25).sin()).collect();
    let mut s = spatializer(&scene, RATE);
    let mut ears = [vec![0.0; tone.len()], vec![0.0; tone.len()]];
    let (mut ready, mut retired): (Vec<_>, Vec<Box<Emitters>>) = ((0..8).map(|n| emitters(settings[n % 4])).collect(), vec![]);
    retired.reserve(8);
    let mut turns = 0;
    for (n, x) in tone.chunks(64).enumerate() {
        let [left, right] = ears.each_mut().map(|ear| &mut ear[64 * n..64 * n + x.len()]);
        assert_no_alloc(|| {
            // Every 52 ms, as often as one is taken.
            if n % 13 == 0
                && s.is_free()
                && let Some(next) = ready.pop()
            {
                turns += 1;
                assert!(s.swap_in_sounding(next).is_ok());
            }
            s.process(&[x], &[], [left, right], &BlockParams::default(), |_| Pose::IDENTITY);
            retired.extend(s.take_retired());
        });
    }
    assert_eq!(turns, 8);
    // A tone that never jumps: its second difference stays that of a tone of its level.
    let bend = |ear: &[f32]| ear.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs()).fold(0.0, f32::max);
    let still = settings.map(|setting| heard(&kept(&scene, setting), &tone, |_| Pose::IDENTITY));
    for (ear, turned) in ears.iter().enumerate() {
        assert!(turned.iter().all(|x| x.is_finite()));
        let bends = still.each_ref().map(|ears| bend(&ears[ear][4_000..]));
        let (found, wanted) = (bend(&turned[4_000..]), bends.into_iter().fold(0.0, f32::max));
        assert!(found < 1.1 * wanted, "{found}, and {wanted} where it is left alone");
        // The room never falls silent while one takes the place of another.
        let level = |ear: &[f32]| ear.chunks(800).map(|c| c.iter().map(|x| x * x).sum::<f32>()).fold(f32::MAX, f32::min);
        let levels = still.each_ref().map(|ears| level(&ears[ear][8_000..76_000]));
        assert!(level(&turned[8_000..76_000]) > 0.5 * levels.into_iter().fold(f32::MAX, f32::min));
    }
}

#[test]
fn a_knob_that_is_turned_stays_finite_at_every_rate_and_block_whatever_comes_in() {
    let scene = room_with_images(RATE, 0.3, 0.1, 20);
    let all = Setting::ALL;
    let settings = [all, Setting { images: 5, order: 1, ..all }, Setting { taps: 12, images: 2, order: 0, refresh: 4, ..all }];
    let scenes = settings.map(|setting| kept(&scene, setting));
    for (rate, block) in [(8_000.0, 1), (8_000.0, 8_192), (48_000.0, 31), (192_000.0, 64), (192_000.0, 8_192)] {
        let made = |n: usize| -> Box<Emitters> { Box::new(Renderer::new(Arc::clone(&scenes[n % 3]), rate).unwrap().into()) };
        let mut ready: Vec<_> = (0..6).map(made).collect();
        let mut retired: Vec<Box<Emitters>> = Vec::with_capacity(8);
        let mut s = spatializer(&scenes[0], rate);
        let len = (0.8 * rate) as usize;
        let mut input = noise(7, len);
        // A third is 200 dB too loud, and a third has every other sample no number.
        input[len / 3..2 * len / 3].iter_mut().for_each(|x| *x *= 1e10);
        input[2 * len / 3..].iter_mut().step_by(2).for_each(|x| *x = f32::NAN);
        let [mut left, mut right] = [(); 2].map(|()| vec![0.0; block]);
        let (mut next, mut at) = (0, 0);
        for x in input.chunks(block) {
            let out = [&mut left[..x.len()], &mut right[..x.len()]];
            assert_no_alloc(|| {
                if at >= next
                    && s.is_free()
                    && let Some(renderer) = ready.pop()
                {
                    next = at + (0.05 * rate) as usize;
                    assert!(s.swap_in_sounding(renderer).is_ok());
                }
                s.process(&[x], &[], out, &BlockParams::default(), walk(rate));
                retired.extend(s.take_retired());
            });
            at += x.len();
            let played = left[..x.len()].iter().chain(&right[..x.len()]);
            assert!(played.copied().all(is_output), "{rate} Hz, blocks of {block}, at {at}");
        }
        assert!(!retired.is_empty(), "{rate} Hz, blocks of {block}: nothing was swapped");
    }
}
