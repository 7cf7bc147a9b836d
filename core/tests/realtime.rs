//! The audio thread allocates nothing, whatever happens on it.

use assert_no_alloc::assert_no_alloc;
use promenade_core::glam::Vec3;
use promenade_core::{BlockParams, EmitterParams, Emitters, Renderer, RendererConfig, Scene, Spatializer, Trim, Voice};
use promenade_testing::noise;
use promenade_testing::scenes::{full_renderer, room_with_cloud, room_with_images, spatializer, walk};
use std::sync::Arc;

/// Another trim for each turn, sometimes none.
fn trim(turn: usize) -> Trim {
    let value = |step: usize| [1.0, 0.5, 2.0, 1.3][(turn / 2 * step) % 4];
    let low_cut_hz = if turn.is_multiple_of(3) { 80.0 } else { 0.0 };
    Trim {
        direct: value(1),
        early: value(2),
        late: value(3),
        decay: value(5),
        distance_law: value(7),
        width: value(9),
        low_cut_hz,
    }
}

fn pair(scene: &Arc<Scene>, rate: f64) -> Box<Emitters> {
    Box::new(Emitters::from(full_renderer(scene, rate, 2)).with_second())
}

#[test]
fn processing_never_allocates() {
    for rate in [8_000.0, 44_100.0, 48_000.0, 192_000.0] {
        // The second scene has the rate that is played.
        let (first, second) = (room_with_cloud(16_000.0, 0.4, 0.1), room_with_cloud(rate, 0.8, 0.1));
        let mut s = Spatializer::new(rate);
        s.install(pair(&first, rate));
        let input = noise(1, 60_000);
        let (mut left, mut right) = (vec![0.0; 8_192], vec![0.0; 8_192]);
        let pose = walk(rate);
        let mut next = Some(pair(&second, rate));
        let mut retired = None;
        let mut at = 0;
        for (turn, size) in [1, 7, 64, 511, 4_096, 0, 480, 8_192, 33, 2_000].into_iter().cycle().take(40).enumerate() {
            if at + size > input.len() {
                at = 0;
            }
            let params = BlockParams {
                mix: 1.0 / (turn + 1) as f32,
                gain: turn as f32,
                bypass: turn % 5 == 4,
                wet_solo: turn % 7 == 3,
                trim: trim(turn),
                emitters: EmitterParams { spread: (turn / 8 % 3) as f32, ..EmitterParams::default() },
                ..BlockParams::default()
            };
            let x = &input[at..at + size];
            let stereo = [x, x];
            let input: &[&[f32]] = if turn % 2 == 0 { &stereo[..1] } else { &stereo };
            assert_no_alloc(|| {
                if turn == 10
                    && let Some(renderer) = next.take()
                {
                    next = s.swap_in(renderer).err();
                }
                if turn == 30 {
                    s.reset();
                }
                s.process(input, &[], [&mut left[..size], &mut right[..size]], &params, |i| pose(at + i));
                if retired.is_none() {
                    retired = s.take_retired();
                }
            });
            at += size;
        }
        assert!(next.is_none() && retired.is_some(), "the swap took place");
    }
}

#[test]
fn image_sources_never_allocate() {
    for rate in [8_000.0, 44_100.0, 192_000.0] {
        let mut s = spatializer(&room_with_images(48_000.0, 0.5, 0.1, 40), rate);
        let input = noise(1, 40_000);
        let (mut left, mut right) = (vec![0.0; 4_096], vec![0.0; 4_096]);
        let pose = walk(rate);
        let mut at = 0;
        for (turn, size) in [1, 64, 511, 4_096, 480].into_iter().cycle().take(20).enumerate() {
            let params = BlockParams::default();
            // Now and then the listener is somewhere else at once.
            let start = at + 7_919 * (turn / 3);
            assert_no_alloc(|| {
                s.process(&[&input[at..at + size]], &[], [&mut left[..size], &mut right[..size]], &params, |i| pose(start + i));
            });
            assert!(left.iter().chain(&right).all(|v| v.is_finite()));
            at += size;
        }
    }
}

#[test]
fn further_sources_never_allocate() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../presets/scenes/loft.promenade");
    let loft = Arc::new(Scene::from_bytes(&std::fs::read(file).unwrap()).unwrap());
    for scene in [loft, room_with_images(48_000.0, 0.5, 0.1, 40)] {
        let mut s = Spatializer::new(48_000.0);
        s.install(Box::new(Renderer::new(scene, RendererConfig { voices: 4, ..48_000.0.into() }).unwrap()));
        let mut input = noise(1, 40_000);
        // Long enough for all of them to fall asleep.
        input[10_000..30_000].fill(0.0);
        let (mut left, mut right) = (vec![0.0; 4_096], vec![0.0; 4_096]);
        let pose = walk(48_000.0);
        for (turn, size) in [1, 64, 511, 4_096, 480].into_iter().cycle().take(30).enumerate() {
            let params = BlockParams { trim: trim(turn), ..BlockParams::default() };
            let at = (1_371 * turn) % (input.len() - size);
            // More, fewer and shorter sounds than there are sources.
            let offset = Vec3::new(0.1 * turn as f32, 0.0, 0.0);
            let sounds: [Voice<'_>; 4] = std::array::from_fn(|i| Voice::at(&input[at..at + size / (i + 1)], offset * i as f32));
            let further = &sounds[..turn % 5];
            assert_no_alloc(|| {
                if turn == 17 {
                    s.reset();
                }
                let ears = [&mut left[..size], &mut right[..size]];
                s.process(&[&input[at..at + size]], further, ears, &params, |i| pose(at + i));
            });
            assert!(left.iter().chain(&right).all(|v| v.is_finite()));
        }
    }
}
