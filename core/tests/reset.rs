//! After a reset a stream is as new: the same sound and poses give the same samples.

use promenade_core::published::ConvMode;
use promenade_core::{BlockParams, Emitters, LiveParams, Scene, Spatializer, Trim};
use promenade_testing::noise;
use promenade_testing::scenes::{
    DIRECT, full_renderer, played_by, render, room_of_responses, room_with_cloud, room_with_images, walk,
};
use promenade_testing::signal::first_difference;
use std::sync::Arc;

const RATE: f64 = 16_000.0;

/// Plays a walk, resets in the middle of a hop and plays it again. `twice` comes from a spatializer that has played something
/// else too.
fn check(name: &str, scene: &Arc<Scene>, params: &BlockParams) {
    check_at(RATE, name, scene, params);
}

fn check_at(rate: f64, name: &str, scene: &Arc<Scene>, params: &BlockParams) {
    let emitters = || Emitters::from(full_renderer(scene, rate, 2)).with_second();
    let mut s = Spatializer::new(rate);
    s.install(Box::new(emitters()));
    let input = noise(3, 20_000);
    let once = render(&mut s, &input, &[128], params, walk(RATE));
    assert!(once[0].iter().any(|x| x.abs() > 1e-4), "{name}: silent");
    s.reset();
    let again = render(&mut s, &input, &[128], params, walk(RATE));
    assert_eq!(first_difference(&once, &again), None, "{name}: not as new after a walk");
    // Another trim and length in between, so that nothing ends where it began.
    let other = BlockParams { trim: Trim { decay: 1.7, early: 0.3, low_cut_hz: 200.0, ..Trim::NEUTRAL }, mix: 0.4, ..*params };
    let far = walk(RATE);
    render(&mut s, &noise(4, 7_777), &[100, 33], &other, |i| far(3 * i + 9_000));
    s.reset();
    let last = render(&mut s, &input, &[128], params, walk(RATE));
    assert_eq!(first_difference(&once, &last), None, "{name}: not as new after another trim");
}

#[test]
fn what_is_played_after_a_reset_is_what_was_played_before() {
    let live = LiveParams { rate_hz: 40.0, wait: true };
    let params = BlockParams { live, ..BlockParams::default() };
    let trimmed = BlockParams {
        trim: Trim { direct: 0.7, late: 1.5, decay: 0.8, width: 1.2, low_cut_hz: 120.0, ..Trim::NEUTRAL },
        ..params
    };
    let clouds = room_with_cloud(RATE, 0.4, 0.1);
    check("table", &played_by(&clouds, None), &params);
    check("table, trimmed", &played_by(&clouds, None), &trimmed);
    check("cloud", &played_by(&clouds, Some(ConvMode::Off)), &params);
    check("published head", &clouds, &params);
    check_at(22_050.0, "published head at another rate", &clouds, &params);
    check("images", &room_with_images(RATE, 0.4, 0.1, 12), &params);
    check("images, trimmed", &room_with_images(RATE, 0.4, 0.1, 12), &trimmed);
    check("responses", &room_of_responses(RATE).0, &params);
    check("responses, no room", &room_of_responses(RATE).0, &BlockParams { trim: DIRECT, ..params });
}
